"""The fit of a camera's rotation: exact scenes, a sitter beside the axis, wrong pairs, refits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.localization import rotation
from app.core.localization.heading_conversion import assumed_fov, lens_factor
from app.core.localization.rotation import Outlook

Float = NDArray[np.float64]
ANY = Outlook(zoom=(0.5, 3.2), likely=(1.3, 0.6))


def scene(
    heading: float, camera_m: float, count: int = 80, sitter_deg: float = 0.0
) -> tuple[Float, Float]:
    """Points in a room, seen from the probe and from a camera in front of it.

    The camera's axis has the heading; the sitter is beside it.
    """
    chance = np.random.default_rng(11)
    points = chance.uniform([-4.0, -1.5, 2.5], [4.0, 2.0, 9.0], (count, 3))
    # Right, up, behind the sitter as the camera at -camera_m sees it; then turned to its axis.
    seen = points + np.array([0.0, 0.0, camera_m])
    axes = sphere.rotation(sitter_deg) @ (seen * [-1.0, 1.0, 1.0]).T
    rays = -(axes[:2] / axes[2]).T
    level = points / np.linalg.norm(points, axis=1, keepdims=True) * [-1.0, 1.0, 1.0]
    return rays, level @ sphere.rotation(heading + sitter_deg).T


def outlook(sitter_deg: float) -> Outlook:
    return Outlook(sitter=float(np.tan(np.radians(sitter_deg))), sitter_spread=0.015)


@pytest.mark.parametrize("sitter_deg", [-15.0, 0.0, 15.0])
@pytest.mark.parametrize("camera_m", [0.6, 1.5, 2.5])
def test_a_sitter_beside_the_axis(sitter_deg: float, camera_m: float) -> None:
    rays, bearings = scene(33.0, camera_m, sitter_deg=sitter_deg)
    # Points far to the side leave the picture.
    inside = np.abs(rays).max(axis=1) < 0.8
    pose = rotation.fit(rays[inside], bearings[inside], outlook(sitter_deg))
    assert pose is not None
    assert pose.angles_deg[0] == pytest.approx(33.0, abs=0.4)
    assert pose.angles_deg[1] == pytest.approx(0.0, abs=0.6)


def test_who_ignores_the_sitter_is_wrong() -> None:
    """What `sitter` is for: without it the sideways parallax is taken for a turn."""
    rays, bearings = scene(33.0, 1.5, sitter_deg=15.0)
    inside = np.abs(rays).max(axis=1) < 0.8
    pose = rotation.fit(rays[inside], bearings[inside], outlook(0.0))
    assert pose is None or abs(pose.angles_deg[0] - 33.0) > 1.0


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.4])
def test_the_lens_is_found_where_nothing_is_nearer(factor: float) -> None:
    rays, bearings = scene(-120.0, 0.0)
    rays = rays / factor
    pose = rotation.fit(rays, bearings, ANY)
    assert pose is not None
    found = lens_factor(pose.zooms(rays, bearings)[pose.inside])
    assert found == pytest.approx(factor, rel=0.01)
    again = rotation.rescaled(pose, rays, bearings, found, Outlook())
    assert again is not None
    assert again.angles_deg[0] == pytest.approx(-120.0, abs=0.05)
    assert again.zoom == pytest.approx(1.0, abs=0.01)


def test_depth_is_not_taken_for_a_wider_lens() -> None:
    rays, bearings = scene(50.0, 1.5)
    pose = rotation.fit(rays, bearings, ANY)
    assert pose is not None
    assert lens_factor(pose.zooms(rays, bearings)[pose.inside]) == pytest.approx(1.0, abs=0.12)


def test_too_little_says_nothing_of_the_lens() -> None:
    assert lens_factor(np.full(3, 1.3)) == 1.0
    assert lens_factor(np.array([np.nan, -2.0, 50.0] * 9)) == 1.0


def test_the_assumed_field_of_view_is_that_of_the_longer_side() -> None:
    assert assumed_fov((640, 480)) == pytest.approx(60.0)
    assert assumed_fov((480, 640)) == pytest.approx(46.8, abs=0.1)


def test_a_camera_held_askew_is_no_hypothesis() -> None:
    rays, bearings = scene(33.0, 0.0)
    turned = rays @ np.array([[0.0, 1.0], [-1.0, 0.0]])  # by a quarter
    pose = rotation.fit(turned, bearings)
    assert pose is None or pose.inside.mean() < 0.3


def test_a_mirrored_picture_agrees_with_nothing() -> None:
    rays, bearings = scene(33.0, 1.5)
    pose = rotation.fit(rays * [-1.0, 1.0], bearings)
    assert pose is None or pose.inside.mean() < 0.3


def test_a_lens_seen_from_nearer_than_the_probe() -> None:
    """Near things are the smaller ones then, and the farthest tell of the lens."""
    chance = np.random.default_rng(4)
    shrunk = 1.0 - 1.5 / chance.uniform(4.0, 8.0, 200)
    assert lens_factor(shrunk, away=True) == pytest.approx(1.0, abs=0.08)
    assert lens_factor(1.2 * shrunk, away=True) == pytest.approx(1.2, abs=0.1)
    # A wall straight ahead, 1.5 m of 7 nearer: all alike, and still no narrow lens.
    assert lens_factor(np.full(60, 1.0 - 1.5 / 7.0), away=True) == pytest.approx(1.0, abs=0.08)
