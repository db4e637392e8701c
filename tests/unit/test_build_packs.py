"""Packs that are made again from transports and style files."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import build_packs
import numpy as np
import pytest

from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.solver.solve import solve_all
from app.core.solver.transport import load_named
from app.core.styles.style_pack_file import load_pack, pack_names, save_pack
from app.core.styles.styles import load_styles

HEAD = "generic"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Resources with one head, whose pack may be written."""
    source = resources()
    copy = tmp_path / "transport"
    copy.mkdir()
    for ending in ("npz", "styles.npz", "shape.npz"):
        shutil.copy(source / "transport" / f"{HEAD}.{ending}", copy)
    (tmp_path / "styles").symlink_to(source / "styles")
    for module in (
        "solver.transport",
        "solver.head_shape",
        "styles.style_pack_file",
        "styles.styles",
    ):
        monkeypatch.setattr(f"app.core.{module}.resources", lambda: tmp_path)
    return copy


def test_a_pack_made_again_is_the_same(folder: Path) -> None:
    path = folder / f"{HEAD}.styles.npz"
    before = load_pack(path)
    rendered, size = build_packs.rebuild(HEAD)
    after = load_pack(path)
    assert rendered == []
    assert size == path.stat().st_size
    assert after.styles == before.styles
    for name in ("targets", "coverage", "region", "areas"):
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    # Processors round differently, and a basis may turn within itself; answers may not.
    light = np.random.default_rng(1).exponential(size=(32, 64, 3))
    for one, two in zip(solve_all(before, light), solve_all(after, light), strict=True):
        assert np.allclose(one.match_curve, two.match_curve, atol=1e-3), one.name
        assert (one.turn_index, one.grade) == (two.turn_index, two.grade), one.name


def test_a_style_without_a_target_gets_one_from_the_transport(folder: Path) -> None:
    """Lamps of 10 deg and more, on texels of 5.6 deg: like the baked picture."""
    path = folder / f"{HEAD}.styles.npz"
    before = load_pack(path)
    keep = [n for n, style in enumerate(before.styles) if style.name != "left-split"]
    rows = {
        name: getattr(before, name)[keep]
        for name in ("targets", "target_rows", "face_rows", "weight_norm", "studio_ratio")
    }
    save_pack(path, replace(before, styles=tuple(before.styles[n] for n in keep), **rows))
    rendered, _ = build_packs.rebuild(HEAD)
    after = load_pack(path)
    assert rendered == ["left-split"]
    baked, made = (pack.target("left-split").ravel() for pack in (before, after))
    assert np.corrcoef(baked, made)[0, 1] > 0.995


def test_a_lamp_smaller_than_a_texel_has_to_be_baked() -> None:
    style = next(style for style in load_styles() if style.name == "left-rembrandt")
    with pytest.raises(CoreError, match="smaller than 10"):
        build_packs.rendered_target(load_named(HEAD), style)


def test_shipped_packs_have_the_styles_as_their_files_say() -> None:
    for head in pack_names():
        pack = load_pack(resources() / "transport" / f"{head}.styles.npz")
        assert pack.styles == load_styles(), head
