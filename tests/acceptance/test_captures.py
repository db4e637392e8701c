"""Every model, both plans, on virtual time and with frames of the camera's own size.

The environment must be that of the true scene, up to one scale, as exactly as the light probe makes
it of files; the camera must be left as it was found, and its files must be what was planned.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from app.core.base.colour import luminance
from app.core.environment.environment import reduce_radiance
from app.core.measure.options import MeasureOptions
from app.core.measure.read.metadata import read_header
from app.devices.simulated.exposure_maker import FrameSight
from app.devices.simulated.scene import Scene
from benchmarks.light.shots.brackets import enlarged
from benchmarks.light.shots.views import view_of
from tests.acceptance.test_probe import light
from tests.faulty_camera.models import PERSONALITIES
from tests.helpers.cameras import Rig
from tests.helpers.cases import sample_first

UNLIKE = ("V", "SC2", "X", "insta360")  # models that differ most in what they say and allow
MODELS = (*UNLIKE, *sorted({person.name for person in PERSONALITIES} - {*UNLIKE}))
SCENE = "courtyard"
# The largest frames that the program asks a camera for; a 2048 x 1024 environment is made of them.
SHAPE = (2688, 5376)


class SmoothScene(Scene):
    """A place that looks like a photograph: its texels are joined by straight lines."""

    def view(self, shape: tuple[int, int]) -> FrameSight:
        return view_of(self.environment, shape, smooth=True)


@cache
def place() -> Scene:
    """One scene for all cameras keeps what it rendered for the next."""
    return SmoothScene(light(SCENE))


@cache
def truth() -> Any:
    return luminance(reduce_radiance(enlarged(light(SCENE), SHAPE, smooth=True), (1024, 2048)))


@pytest.mark.slow
@pytest.mark.parametrize("plan", sample_first(["paper", "full"], 1))
@pytest.mark.parametrize("model", sample_first(MODELS, 3))
def test_every_model_and_plan(model: str, plan: Literal["paper", "full"], tmp_path: Path) -> None:
    rig = Rig(
        tmp_path / "session", model, shape=SHAPE, scene=place(), wishes=MeasureOptions(sun="leave")
    )
    before = dict(rig.camera.options)
    result = rig.shoot(plan)

    assert rig.camera.options == before
    assert len(result.frames) == len(result.plan.shots)
    for path, shot in zip(result.frames, result.plan.shots, strict=True):
        exposure = read_header(path).frame.exposure
        assert exposure is not None
        assert exposure.ev == pytest.approx(shot.exposure.ev, abs=0.01)

    merged = result.probe.merged
    known = (merged.clipped == 0) & (merged.dark == 0) & (truth() > 0)
    ratio = luminance(merged.radiance)[known] / truth()[known]
    error = np.abs(ratio / np.median(ratio) - 1.0)
    assert np.median(error) <= 0.01
    assert np.percentile(error, 95) <= 0.04
