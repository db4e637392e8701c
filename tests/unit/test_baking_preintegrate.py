"""Pre-integrated targets that are made without a transport agree with those made from one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.core.baking.bake import bake
from app.core.baking.kernel_lanes import select_variant
from app.core.baking.quality import Quality
from app.core.baking.scene import load_head
from app.core.baking.skin import find_skin
from app.core.base.errors import BakeError, Cancelled
from app.core.base.progress import Progress, Token
from app.core.styles.style_pack_build import build_pack
from app.core.styles.styles import load_styles
from benchmarks.answers.evaluation.preintegrate import Effort, Preintegrated, preintegrate_styles
from tests.helpers.meshes import sphere, write_obj

SHAPE = (8, 16)
STYLES = [s for s in load_styles() if s.name in ("butterfly", "left-split", "right-split")]


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mitsuba")
    try:
        select_variant("llvm")
    except BakeError:
        pytest.skip("no LLVM for Mitsuba here")
    return write_obj(tmp_path_factory.mktemp("ball") / "ball.obj", *sphere())


def run(file: Path, token: Token) -> Preintegrated:
    def report(share: float, step: Progress | str) -> None:
        assert 0 <= share <= 1

    return preintegrate_styles(
        load_head("ball", file, None),
        find_skin("medium"),
        STYLES,
        environment=SHAPE,
        pictures=(32, 16),
        effort=Effort(target_paths=1024, paths=1024, glints=64, shadows=4, block=1),
        seed=1,
        report=report,
        token=token,
    )


@pytest.mark.mitsuba
def test_agrees_with_a_transport(ball: Path, tmp_path: Path) -> None:
    found = run(ball, Token())
    assert found.rows.shape == (2, 3, *SHAPE)
    baked = bake(
        load_head("ball", ball, None),
        find_skin("medium"),
        STYLES,
        environment=SHAPE,
        picture=32,
        quality=Quality(paths=2048, glints=64, shadows=4, rank=128),
        seed=2,
        work=tmp_path,
        report=lambda share, message: None,
        token=Token(),
    )
    expected = build_pack(baked.transport, STYLES, baked.targets, baked.shape).preintegrated
    for ours, theirs in zip(found.rows[0], expected, strict=True):
        # The scale of weights is that of the target's darkest and brightest pixel, noise and all.
        scale = (ours * theirs).sum() / np.square(theirs).sum()
        error = np.sqrt(np.square(ours / scale - theirs).mean() / np.square(theirs).mean())
        assert scale == pytest.approx(1.0, abs=0.05)
        assert error < 0.03
    assert found.noise < 0.02


@pytest.mark.mitsuba
def test_can_be_stopped(ball: Path) -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        run(ball, token)
