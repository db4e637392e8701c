"""As in the paper: the search in grey is held against eq. 5 itself, turn by turn."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.angles import TURNS
from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce
from app.core.solver.search import luminance_of
from app.core.solver.solve import solve_all
from tests.helpers.shipped import generic_pack, generic_transport

SCENES = sorted((resources() / "demo").rglob("*.exr"))


def _light(name: str) -> np.ndarray:
    (file,) = (each for each in SCENES if each.stem == name)
    return reduce(read_environment(file), generic_pack().header.environment)


@pytest.mark.parametrize("scene", [file.stem for file in SCENES])
def test_every_turn_is_that_of_brute_force(scene: str) -> None:
    """Eq. 1, 2, 5 and 6 in plain numpy: grey T, grey L, 64 turns, the largest C."""
    light = _light(scene)
    grey = light.astype(np.float64) @ LUMINANCE_WEIGHTS
    weights = np.asarray(LUMINANCE_WEIGHTS)
    basis = np.tensordot(weights, generic_transport().pixel_basis.astype(np.float64), 1)
    lit = np.stack([np.roll(grey, -turn, axis=1).ravel() for turn in range(TURNS)], axis=1)
    pictures = basis @ (generic_transport().texel_basis.astype(np.float64) @ lit)
    face = generic_transport().coverage >= 0.5
    found = solve_all(generic_pack(), luminance_of(light), "paper")
    assert sum(style.paper for style in generic_pack().styles) == 16
    for result in found:
        target = (
            generic_pack().target(result.name).reshape(-1, 3)[generic_transport().pixels] @ weights
        )
        scaled = (target - target[face].min()) / np.ptp(target[face])
        f = np.where(face, scaled - scaled[face].mean(), 0.0)
        curve = f @ pictures
        assert result.turn_index == int(np.argmax(curve)), result.name
        off = np.abs(result.quality_curve - curve).max()
        assert off <= 2e-3 * np.ptp(curve), result.name
