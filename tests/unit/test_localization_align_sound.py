"""Homographies from pairs of points: exact ones, wrong ones among them, and absurd ones."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.homography import apply_homography, corners_of, fit_pairs, scaled, sound
from app.core.localization.views import Lens
from tests.helpers.lens_matrix import lens_matrix

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
SIZE: Final = (640, 480)
SIZES: Final = (SIZE, SIZE)
LENS: Final = Lens(60.0, SIZE)


def turned(azimuth: float, pitch: float = 0.0, roll: float = 0.0, zoom: float = 1.0) -> Float64:
    """What a camera sees that is turned by so many degrees; clockwise moves the picture left."""
    a, p, r = np.radians([azimuth, pitch, roll])
    about_y = [[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]]
    about_x = [[1, 0, 0], [0, np.cos(p), np.sin(p)], [0, -np.sin(p), np.cos(p)]]
    about_z = [[np.cos(r), -np.sin(r), 0], [np.sin(r), np.cos(r), 0], [0, 0, 1]]
    turn = np.array(about_y) @ np.array(about_x) @ np.array(about_z)
    matrix = (
        lens_matrix(LENS)
        @ np.diag([1 / zoom, 1 / zoom, 1.0])
        @ turn
        @ np.linalg.inv(lens_matrix(LENS))
    )
    return scaled(matrix)


def pairs_of(
    matrix: Float64, count: int = 120, noise: float = 0.4, wrong: int = 0, seed: int = 0
) -> tuple[Float32, Float32]:
    chance = np.random.default_rng(seed)
    start = chance.uniform([0, 0], SIZE, (count, 2))
    stop = apply_homography(matrix, start) + chance.normal(0.0, noise, (count, 2))
    inside = ((stop >= 0) & (stop <= np.array(SIZE))).all(axis=1)
    start, stop = start[inside], stop[inside]
    start = np.concatenate([start, chance.uniform([0, 0], SIZE, (wrong, 2))])
    stop = np.concatenate([stop, chance.uniform([0, 0], SIZE, (wrong, 2))])
    return start.astype(np.float32), stop.astype(np.float32)


@pytest.mark.parametrize("azimuth", [-25.0, -8.0, 0.0, 18.0])
@pytest.mark.parametrize("how", [{}, {"pitch": 8.0, "roll": -6.0}, {"zoom": 1.6}, {"zoom": 0.7}])
def test_turns_are_found_among_wrong_pairs(azimuth: float, how: dict[str, float]) -> None:
    """Corners within 1 % of the width, with as many wrong pairs as right ones."""
    truth = turned(azimuth, **how)
    assert sound(truth, *SIZES)
    start, stop = pairs_of(truth)
    chance = np.random.default_rng(1)
    start = np.concatenate([start, chance.uniform([0, 0], SIZE, start.shape)]).astype(np.float32)
    stop = np.concatenate([stop, chance.uniform([0, 0], SIZE, stop.shape)]).astype(np.float32)
    found = fit_pairs(start, stop, SIZES)
    assert found.status == "found"
    assert found.homography is not None
    # What is shown of the view.
    back: Float64 = np.asarray(np.linalg.inv(truth), np.float64)
    seen = apply_homography(back, corners_of(SIZE)).clip(0.0, np.array([640.0, 480.0]))
    inside = np.array(seen, np.float64)
    homography: Float64 = found.homography
    off = apply_homography(homography, inside) - apply_homography(truth, inside)
    assert np.abs(off).max() < 6.4
    assert 0.2 < found.overlap <= 1.0


MIRRORED: Final = scaled(np.array([[-1.0, 0.0, 640.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
FLIPPED: Final = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 480.0], [0.0, 0.0, 1.0]])
FOLDED: Final = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0022, 0.0, 1.0]])
ABSURD: Final[dict[str, Float64]] = {
    "mirrored": MIRRORED,
    "upside down": FLIPPED,
    "turned over": MIRRORED @ FLIPPED,
    "on its side": turned(0.0, roll=90.0),
    "folded": FOLDED,
    "nearly folded": np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.00145, 0.0, 1.0]]),
    "folded at the foot": np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -0.0025, 1.0]]),
    "squeezed": np.diag([0.3, 1.0, 1.0]),
    "stretched": np.diag([1.0, 2.6, 1.0]),
    "tiny": np.diag([0.2, 0.2, 1.0]) + np.array([[0, 0, 256.0], [0, 0, 192.0], [0, 0, 0]]),
    "huge": np.array([[4.0, 0.0, -960.0], [0.0, 4.0, -720.0], [0.0, 0.0, 1.0]]),
    "sheared": np.array([[1.0, 1.4, -300.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    "a line": np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "a point": np.array([[0.0, 0.0, 320.0], [0.0, 0.0, 240.0], [0.0, 0.0, 1.0]]),
    "nothing": np.zeros((3, 3)),
    "not a number": np.full((3, 3), np.nan),
    "endless": np.array([[np.inf, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
}


@pytest.mark.parametrize("name", list(ABSURD))
def test_absurd_pictures_are_not_sound(name: str) -> None:
    assert not sound(np.asarray(ABSURD[name], np.float64), *SIZES)
    assert not sound(-np.asarray(ABSURD[name], np.float64), *SIZES)


@pytest.mark.parametrize("name", ["mirrored", "upside down", "folded", "squeezed", "sheared"])
def test_points_that_say_so_exactly_are_refused(name: str) -> None:
    """Two hundred perfect pairs, and still no such picture is shown."""
    chance = np.random.default_rng(2)
    start = chance.uniform([0, 0], SIZE, (400, 2))
    depth = start @ ABSURD[name][2, :2] + 1.0
    stop = apply_homography(ABSURD[name], start)
    keep = (np.abs(depth) > 0.02) & (np.abs(stop) < 3000).all(axis=1)
    found = fit_pairs(start[keep].astype(np.float32), stop[keep].astype(np.float32), SIZES)
    assert found.status == "unsure"
    assert found.homography is None


def on_a_line(chance: np.random.Generator) -> Float64:
    share = chance.uniform(0.0, 1.0, (80, 1))
    return np.asarray(share * [600.0, 400.0] + [10.0, 30.0] + chance.normal(0.0, 2.0, (80, 2)))


def in_a_corner(chance: np.random.Generator) -> Float64:
    return chance.uniform([20.0, 20.0], [70.0, 60.0], (80, 2))


def at_three_places(chance: np.random.Generator) -> Float64:
    places = np.array([[60.0, 60.0], [560.0, 90.0], [300.0, 420.0]])
    return np.asarray(places[chance.integers(0, 3, 90)] + chance.normal(0.0, 0.3, (90, 2)))


@pytest.mark.parametrize("where", [on_a_line, in_a_corner, at_three_places])
@pytest.mark.parametrize("seed", range(4))
def test_points_that_hold_no_picture_fast(where: Any, seed: int) -> None:
    chance = np.random.default_rng(seed)
    start = where(chance)
    stop = apply_homography(turned(5.0), start) + chance.normal(0.0, 0.8, start.shape)
    found = fit_pairs(start.astype(np.float32), stop.astype(np.float32), SIZES)
    assert found.status == "unsure"


@pytest.mark.parametrize("kind", ["one place", "one point", "none", "few", "equal"])
def test_too_little(kind: str) -> None:
    chance = np.random.default_rng(0)
    many = chance.uniform([0, 0], SIZE, (50, 2)).astype(np.float32)
    start, stop = {
        "one place": (many, np.tile(many[:1], (50, 1))),
        "one point": (np.tile(many[:1], (50, 1)), many),
        "none": (many[:0], many[:0]),
        "few": (many[:8], many[:8]),
        "equal": (np.tile(many[:4], (12, 1)), np.tile(many[:4], (12, 1))),
    }[kind]
    assert fit_pairs(start, stop, SIZES).status == "unsure"


def test_whatever_is_found_is_sound() -> None:
    """Random pairs, random warps, random crowds: nothing absurd ever comes out."""
    found = 0
    for seed in range(250):
        chance = np.random.default_rng(seed)
        matrix = np.eye(3) + chance.normal(0.0, 1.0, (3, 3)) * [
            [0.4, 0.4, 150.0],
            [0.4, 0.4, 150.0],
            [8e-4, 8e-4, 0.0],
        ]
        with np.errstate(all="ignore"):
            start, stop = pairs_of(matrix, 80, float(chance.choice([0.3, 3.0, 15.0])), 40, seed)
        answer = fit_pairs(start, stop, SIZES)
        if answer.homography is None:
            assert answer.status == "unsure"
            continue
        found += 1
        assert sound(answer.homography, *SIZES)
        assert np.isfinite(answer.homography).all()
        corners = apply_homography(answer.homography, corners_of(SIZE)).astype(np.float32)
        assert cv2.isContourConvex(corners.reshape(-1, 1, 2))
        assert cv2.contourArea(corners.reshape(-1, 1, 2), oriented=True) > 0.0
    assert found >= 15, "or nothing was tested"


def test_the_same_points_give_the_same_answer() -> None:
    start, stop = pairs_of(turned(12.0), wrong=60)
    first, second = fit_pairs(start, stop, SIZES), fit_pairs(start, stop, SIZES)
    assert first.homography is not None
    assert second.homography is not None
    np.testing.assert_array_equal(first.homography, second.homography)
