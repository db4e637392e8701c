"""Points that are beside where a pose says: those of another wall, or of another place to stand."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.heading import strays
from app.core.localization.rotation import CameraPose, fit

Float64 = NDArray[np.float64]


def pictured(shift_deg: Float64) -> tuple[Float64, Float64]:
    """Points of a picture without parallax, those of the panorama beside by some degrees."""
    rays = np.random.default_rng(0).uniform(-0.5, 0.5, (len(shift_deg), 2))
    there = np.concatenate([rays, np.ones((len(rays), 1))], axis=1)
    angle = np.radians(shift_deg)
    beside = np.stack(
        [
            there[:, 0] * np.cos(angle) + there[:, 2] * np.sin(angle),
            there[:, 1],
            there[:, 2] * np.cos(angle) - there[:, 0] * np.sin(angle),
        ],
        axis=1,
    )
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    return rays, beside @ np.diag([-1.0, -1.0, 1.0])


@pytest.mark.parametrize(("away_deg", "share"), [(5.0, 10 / 64), (40.0, 0.0)])
def test_only_what_is_beside_strays(away_deg: float, share: float) -> None:
    rays, bearings = pictured(np.repeat([0.0, away_deg], [50, 10]))
    pose = fit(rays, bearings)
    assert isinstance(pose, CameraPose)
    assert pose.inside[:50].all()
    assert not pose.inside[50:].any()
    assert strays(rays, bearings, pose.inside, pose) == pytest.approx(share, abs=0.02)


def test_of_a_few_points_one_says_little() -> None:
    rays, bearings = pictured(np.repeat([0.0, 5.0], [50, 10]))
    pose = fit(rays, bearings)
    assert pose is not None
    few = np.r_[0:3, 50:51]
    assert strays(rays[few], bearings[few], pose.inside[few], pose) == pytest.approx(1 / 8)
