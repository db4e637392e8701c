"""The live picture on the goal over time: still, without lag, and never flipped over."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.align import BARE, Overlay, laid
from app.core.localization.homography import UNSURE, Alignment, corners_of, moved, scaled, sound

Float64 = NDArray[np.float64]
SIZE: Final = (640, 480)
SIZES: Final = (SIZE, (800, 600))
EVERY_S: Final = 0.12


def shifted(x: float, y: float = 0.0) -> Float64:
    return np.array([[1.2, 0.0, x], [0.0, 1.2, y], [0.0, 0.0, 1.0]])


def shaken(matrix: Float64, chance: np.random.Generator, pixels: float) -> Float64:
    """A homography whose corners are off by so much."""
    import cv2

    corners = corners_of(SIZE)
    there = moved(matrix, corners) + chance.normal(0.0, pixels, (4, 2))
    found = cv2.getPerspectiveTransform(corners.astype(np.float32), there.astype(np.float32))
    return np.asarray(found, np.float64)


def found(matrix: Float64) -> Alignment:
    return Alignment("found", scaled(matrix), 80, 0.6, 3.0, 0.9)


def corner(state: Overlay) -> Float64:
    assert state.shown.homography is not None
    return moved(state.shown.homography, corners_of(SIZE))


def test_trembling_is_stilled() -> None:
    """Corners that are off by 0.4 % of the width tremble a quarter as much."""
    chance, state, rows = np.random.default_rng(0), BARE, []
    for step in range(200):
        state = laid(state, found(shaken(shifted(30.0), chance, 3.2)), SIZES, step * EVERY_S)
        rows.append(corner(state))
    off = np.array(rows[30:]) - moved(shifted(30.0), corners_of(SIZE))
    assert off.std() < 1.0
    assert state.shown.inliers == 80
    assert state.shown.turn_error_deg == 3.0


@pytest.mark.parametrize("speed", [50.0, 300.0])
def test_a_turn_is_followed(speed: float) -> None:
    """Pixels a second; never more than 1.5 % of the width behind."""
    state = BARE
    for step in range(25):
        truth = shifted(-200.0 + speed * step * EVERY_S)
        state = laid(state, found(truth), SIZES, step * EVERY_S)
        assert np.abs(corner(state) - moved(truth, corners_of(SIZE))).max() <= 0.015 * 800 + 1e-3


def test_a_jump_has_to_be_seen_twice() -> None:
    state = laid(BARE, found(shifted(0.0)), SIZES, 0.0)
    other = laid(state, found(shifted(300.0)), SIZES, 0.1)
    np.testing.assert_array_equal(corner(other), corner(state))
    back = laid(other, found(shifted(0.0)), SIZES, 0.2)
    np.testing.assert_allclose(corner(back), corner(state), atol=1e-3)
    assert back.rival is None
    twice = laid(other, found(shifted(302.0)), SIZES, 0.2)
    np.testing.assert_allclose(corner(twice), moved(shifted(302.0), corners_of(SIZE)), atol=1e-3)


def test_an_unsure_picture_leaves_it_for_a_moment() -> None:
    state = laid(BARE, found(shifted(0.0)), SIZES, 0.0)
    kept = laid(state, UNSURE, SIZES, 0.3)
    assert kept.shown.status == "found"
    gone = laid(kept, UNSURE, SIZES, 0.7)
    assert gone.shown.status == "unsure"
    assert gone.shown.homography is None
    again = laid(gone, found(shifted(400.0)), SIZES, 0.8)
    np.testing.assert_allclose(corner(again), moved(shifted(400.0), corners_of(SIZE)), atol=1e-3)


def test_after_a_pause_it_begins_afresh() -> None:
    state = laid(BARE, found(shifted(0.0)), SIZES, 0.0)
    later = laid(state, found(shifted(300.0)), SIZES, 5.0)
    np.testing.assert_allclose(corner(later), moved(shifted(300.0), corners_of(SIZE)), atol=1e-3)


def test_what_is_shown_is_always_sound() -> None:
    """Whatever sound pictures follow one another, and however fast."""
    chance, state, now, shown = np.random.default_rng(5), BARE, 0.0, 0
    for _ in range(600):
        now += float(chance.choice([0.02, 0.1, 0.4]))
        matrix = shaken(shifted(*chance.normal(0.0, 60.0, 2)), chance, 40.0)
        one = found(matrix) if sound(matrix, *SIZES) else UNSURE
        state = laid(state, one, SIZES, now)
        if state.shown.homography is not None:
            assert sound(state.shown.homography, *SIZES)
            shown += 1
    assert shown > 200
