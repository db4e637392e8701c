"""Where a lamp may be held, in the head's frame."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.second_light.placements import (
    ALTITUDES_DEG,
    AZIMUTHS_DEG,
    COUNT,
    MIRRORED,
    direction,
    directions,
    placement,
)


def test_the_grid_is_the_papers() -> None:
    assert COUNT == 576
    assert (AZIMUTHS_DEG[1], len(AZIMUTHS_DEG)) == (5.625, 64)
    np.testing.assert_array_equal(np.diff(ALTITUDES_DEG), 16.875)
    assert (ALTITUDES_DEG[0], ALTITUDES_DEG[-1]) == (-67.5, 67.5)


@pytest.mark.parametrize(
    ("azimuth", "altitude", "expected"),
    [
        (0.0, 0.0, (0, 0, 1)),  # in front
        (90.0, 0.0, (1, 0, 0)),  # at the sitter's left
        (-90.0, 0.0, (-1, 0, 0)),
        (180.0, 0.0, (0, 0, -1)),
        (0.0, 90.0, (0, 1, 0)),
        (0.0, -90.0, (0, -1, 0)),
    ],
)
def test_known_directions(
    azimuth: float, altitude: float, expected: tuple[float, float, float]
) -> None:
    np.testing.assert_allclose(direction(azimuth, altitude), expected, atol=1e-12)


def test_numbers_run_along_azimuth_first_and_from_below_upward() -> None:
    assert placement(0) == (0.0, -67.5)
    assert placement(16) == (90.0, -67.5)
    assert placement(4 * 64) == (0.0, 0.0)
    assert placement(4 * 64 + 32) == (180.0, 0.0)
    assert placement(8 * 64 + 48) == (-90.0, 67.5)
    all_ = directions()
    assert all_.shape == (576, 3)
    np.testing.assert_allclose(np.linalg.norm(all_, axis=1), 1.0)
    assert len(np.unique(all_.round(9), axis=0)) == 576


def test_mirrored_placements_stand_on_the_other_side() -> None:
    all_ = directions()
    np.testing.assert_allclose(all_[MIRRORED], all_ * [-1, 1, 1], atol=1e-12)
    np.testing.assert_array_equal(MIRRORED[MIRRORED], np.arange(COUNT))
