"""A camera on the line through the sitter, or beside it: told apart by points in an exact room."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.localization import rotation
from app.core.localization.parallax import Aim, Line, lined_up
from app.core.localization.rotation import CameraPose, Outlook

Float = NDArray[np.float64]


def seen_from(
    camera_m: tuple[float, float, float], heading: float, strange: int = 0
) -> tuple[Float, Float]:
    """Points of a room as a camera sees them, and as the probe does; the last ones at random.

    The camera is right, up and in front of the probe; its axis has the heading.
    """
    chance = np.random.default_rng(5)
    points = chance.uniform([-4.0, -1.5, 2.0], [4.0, 2.0, 9.0], (200, 3))
    ahead = points - np.array(camera_m)
    rays = ahead[:, :2] / ahead[:, 2:] * [1.0, -1.0]
    inside = (np.abs(rays) < 0.6).all(axis=1)
    level = points / np.linalg.norm(points, axis=1, keepdims=True) * [-1.0, 1.0, 1.0]
    bearings = level[inside] @ sphere.rotation(heading).T
    bearings[:strange] = bearings[chance.permutation(len(bearings))[:strange]]
    noise = chance.normal(0.0, 0.0004, (int(inside.sum()), 2))
    return rays[inside] + noise, bearings


def line_of(pose: CameraPose, rays: Float, bearings: Float, spread: float = 0.03) -> Line | None:
    """As for a photograph with somebody in the middle."""
    certain = np.zeros(len(rays), np.float32)
    aims = [Aim(0.0, 0.087), Aim(0.0, 0.025)]
    return lined_up([pose], rays, bearings, certain, aims, spread, lens_known=spread < 0.1)


def lined(rays: Float, bearings: Float, spread: float = 0.03) -> tuple[CameraPose, Line]:
    pose = rotation.fit(rays, bearings, Outlook(sitter_spread=0.015))
    assert pose is not None
    line = line_of(pose, rays, bearings, spread)
    assert line is not None
    return pose, line


def heading_of(turned: Float) -> float:
    return sphere.angles_of(turned @ np.diag([-1.0, -1.0, 1.0]))[0]


@pytest.mark.parametrize("metres", [0.6, 1.5, 2.5])
@pytest.mark.parametrize("strange", [0, 30])
def test_on_the_line_nothing_is_gained_by_leaving_it(metres: float, strange: int) -> None:
    _, line = lined(*seen_from((0.0, 0.0, -metres), 33.0, strange))
    assert heading_of(line.rotation) == pytest.approx(33.0, abs=0.15)
    assert line.gain < 1.0 + 0.05 * strange  # a few strangers agree by chance
    assert np.degrees(line.error_rad) < 0.5


def test_at_the_probe_there_is_no_line() -> None:
    _, line = lined(*seen_from((0.0, 0.0, 0.0), -70.0))
    assert heading_of(line.rotation) == pytest.approx(-70.0, abs=0.05)
    assert line.gain == line.aside == line.loose_rad == 0.0


@pytest.mark.parametrize("aside", [(1.0, 0.0, 0.0), (-2.0, 0.1, -1.0), (2.5, 0.0, 1.0)])
def test_beside_the_line_many_more_points_agree_elsewhere(
    aside: tuple[float, float, float],
) -> None:
    rays, bearings = seen_from(aside, 33.0)
    pose = rotation.fit(rays, bearings, Outlook(sitter_spread=0.015))
    if pose is None:
        return
    line = line_of(pose, rays, bearings)
    assert line is not None
    assert line.gain + line.aside > 10.0


def test_a_bent_lens_and_a_turning_hand_are_no_parallax() -> None:
    rays, bearings = seen_from((0.0, 0.0, -1.5), 33.0)
    bent = rays * (1.0 + 0.04 * (rays**2).sum(axis=1, keepdims=True))
    # 30 deg/s for 20 ms over the rows.
    bent[:, 0] += np.radians(0.6) * bent[:, 1] / 0.9
    _, line = lined(bent, bearings)
    assert heading_of(line.rotation) == pytest.approx(33.0, abs=0.3)
    assert line.gain < 1.0


def test_a_few_points_say_nothing() -> None:
    rays, bearings = seen_from((0.0, 0.0, -1.5), 33.0)
    pose = rotation.fit(rays, bearings, Outlook(sitter_spread=0.015))
    assert pose is not None
    assert line_of(pose, rays[:7], bearings[:7]) is None


@pytest.mark.parametrize("scale", [0.85, 1.0, 1.2])
def test_a_lens_that_is_not_known_is_not_drawn_to_either_side(scale: float) -> None:
    """Seen towards the sitter, every lens explains the picture alike: what was likely stays."""
    rays, bearings = seen_from((0.0, 0.0, -1.5), 33.0)
    _, line = lined(rays * scale, bearings, 0.12)
    assert heading_of(line.rotation) == pytest.approx(33.0, abs=0.3)
    assert abs(float(line.lens[0])) < 0.03


@pytest.mark.parametrize("aim", [-14.0, 9.0])
def test_the_place_of_the_probe_is_found_where_nobody_said_it_is(aim: float) -> None:
    """A passer-by was taken for the sitter, or nobody was seen."""
    rays, bearings = seen_from((0.0, 0.0, -1.5), 33.0)
    full = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ aimed(aim)
    _, line = lined(full[:, :2] / full[:, 2:], bearings)
    assert heading_of(line.rotation) == pytest.approx(33.0 + aim, abs=0.3)
    assert np.degrees(np.arctan(line.probe[0])) == pytest.approx(-aim, abs=0.5)
    assert line.gain < 1.0


def aimed(degrees: float) -> Float:
    turn = np.radians(degrees)
    return np.array(
        [[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]]
    )


@pytest.mark.parametrize("aim", [-10.0, 0.0, 10.0])
@pytest.mark.parametrize("metres", [-1.2, 1.2])
def test_where_the_camera_stands_is_measured(aim: float, metres: float) -> None:
    """In front of the sitter, or behind them and looking away, up to 10 degrees beside."""
    rays, bearings = seen_from((0.0, 0.0, metres), 33.0)
    full = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ aimed(aim)
    away = metres > 0.0
    # The outlook of a camera that looks away: what it sees looks smaller from the probe.
    outlook = Outlook(0.0, 0.2, (0.3, 1.25), (0.75, 0.2)) if away else Outlook(sitter_spread=0.2)
    flat = full[:, :2] / full[:, 2:]
    pose = rotation.fit(flat, bearings, outlook)
    assert pose is not None
    certain, aims = np.zeros(len(rays), np.float32), [Aim(np.pi if away else 0.0, 0.1)]
    line = lined_up([pose], flat, bearings, certain, aims, 0.03, lens_known=True)
    assert line is not None
    assert line.open_line is not None
    assert heading_of(line.open_line.rotation) == pytest.approx(33.0 + aim, abs=0.2)
    assert np.degrees(np.arctan(line.open_line.probe[0])) == pytest.approx(-aim, abs=1.0)
    assert line.open_line.gain < 1.0
    assert np.degrees(line.open_line.error_rad) < 0.9


def test_a_camera_that_looks_away_from_elsewhere_is_told() -> None:
    rays, bearings = seen_from((1.5, 0.0, 0.0), 33.0)
    pose = rotation.fit(rays, bearings, Outlook(0.0, 0.2, (0.3, 1.25), (0.75, 0.2)))
    assert pose is not None
    certain = np.zeros(len(rays), np.float32)
    line = lined_up([pose], rays, bearings, certain, [Aim(np.pi, 0.1)], 0.03, lens_known=True)
    assert line is not None
    assert line.open_line is not None
    assert line.gain + line.aside > 10.0
    assert line.open_line.gain > 4.0


def test_points_of_another_place_end_in_no_error() -> None:
    """A live search fits what agrees with nothing, several times a second."""
    chance = np.random.default_rng(3)
    certain = np.zeros(30, np.float32)
    for _ in range(20):
        rays = chance.uniform(-0.6, 0.6, (30, 2))
        ahead = np.concatenate([rays, np.ones((30, 1))], axis=1) + chance.normal(0, 0.5, (30, 3))
        bearings = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        pose = CameraPose(np.eye(3), np.zeros(2), np.zeros(3), np.ones(30, bool), 0.01)
        aims = [Aim(np.pi, 0.1)]
        line = lined_up([pose], rays, bearings, certain, aims, 0.03, lens_known=True)
        assert line is None or line.agree < 20.0
