"""The live picture on the goal over time: still, without lag, and never flipped over."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.align import BARE, SteadyOverlay, steady_overlay
from app.core.localization.homography import (
    UNSURE,
    Alignment,
    apply_homography,
    corners_of,
    scaled,
    sound,
)

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
    there = apply_homography(matrix, corners) + chance.normal(0.0, pixels, (4, 2))
    found = cv2.getPerspectiveTransform(corners.astype(np.float32), there.astype(np.float32))
    return np.asarray(found, np.float64)


def found(matrix: Float64) -> Alignment:
    return Alignment("found", scaled(matrix), 80, 0.6, 3.0, 0.9)


def corner(state: SteadyOverlay) -> Float64:
    assert state.alignment.homography is not None
    return apply_homography(state.alignment.homography, corners_of(SIZE))


def test_trembling_is_stilled() -> None:
    """Corners that are off by 0.4 % of the width tremble a quarter as much."""
    chance, state, rows = np.random.default_rng(0), BARE, []
    for step in range(200):
        state = steady_overlay(
            state, found(shaken(shifted(30.0), chance, 3.2)), SIZES, step * EVERY_S
        )
        rows.append(corner(state))
    off = np.array(rows[30:]) - apply_homography(shifted(30.0), corners_of(SIZE))
    assert off.std() < 1.0
    assert state.alignment.inliers == 80
    assert state.alignment.turn_error_deg == 3.0


@pytest.mark.parametrize("speed", [50.0, 300.0])
def test_a_turn_is_followed(speed: float) -> None:
    """Pixels a second; never more than 1.5 % of the width behind."""
    state = BARE
    for step in range(25):
        truth = shifted(-200.0 + speed * step * EVERY_S)
        state = steady_overlay(state, found(truth), SIZES, step * EVERY_S)
        assert (
            np.abs(corner(state) - apply_homography(truth, corners_of(SIZE))).max()
            <= 0.015 * 800 + 1e-3
        )


def test_a_jump_has_to_be_seen_twice() -> None:
    state = steady_overlay(BARE, found(shifted(0.0)), SIZES, 0.0)
    other = steady_overlay(state, found(shifted(300.0)), SIZES, 0.1)
    np.testing.assert_array_equal(corner(other), corner(state))
    back = steady_overlay(other, found(shifted(0.0)), SIZES, 0.2)
    np.testing.assert_allclose(corner(back), corner(state), atol=1e-3)
    assert back.rival is None
    twice = steady_overlay(other, found(shifted(302.0)), SIZES, 0.2)
    np.testing.assert_allclose(
        corner(twice), apply_homography(shifted(302.0), corners_of(SIZE)), atol=1e-3
    )


def test_an_unsure_picture_leaves_it_for_a_moment() -> None:
    state = steady_overlay(BARE, found(shifted(0.0)), SIZES, 0.0)
    kept = steady_overlay(state, UNSURE, SIZES, 0.3)
    assert kept.alignment.status == "found"
    gone = steady_overlay(kept, UNSURE, SIZES, 0.7)
    assert gone.alignment.status == "unsure"
    assert gone.alignment.homography is None
    again = steady_overlay(gone, found(shifted(400.0)), SIZES, 0.8)
    np.testing.assert_allclose(
        corner(again), apply_homography(shifted(400.0), corners_of(SIZE)), atol=1e-3
    )


def test_after_a_pause_it_begins_afresh() -> None:
    state = steady_overlay(BARE, found(shifted(0.0)), SIZES, 0.0)
    later = steady_overlay(state, found(shifted(300.0)), SIZES, 5.0)
    np.testing.assert_allclose(
        corner(later), apply_homography(shifted(300.0), corners_of(SIZE)), atol=1e-3
    )


def test_what_is_shown_is_always_sound() -> None:
    """Whatever sound pictures follow one another, and however fast."""
    chance, state, now, shown = np.random.default_rng(5), BARE, 0.0, 0
    for _ in range(600):
        now += float(chance.choice([0.02, 0.1, 0.4]))
        matrix = shaken(shifted(*chance.normal(0.0, 60.0, 2)), chance, 40.0)
        one = found(matrix) if sound(matrix, *SIZES) else UNSURE
        state = steady_overlay(state, one, SIZES, now)
        if state.alignment.homography is not None:
            assert sound(state.alignment.homography, *SIZES)
            shown += 1
    assert shown > 200
