"""Weights of eq. 6, painted weights, and their pre-integration pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base.errors import StyleError
from app.core.solver.weights import paint, painted, painted_weights, target_weights
from benchmarks.speed.plain_search import matrix, preintegrate
from tests.helpers.synthetic import lambert_sphere_transport, lamp_target

TRANSPORT = lambert_sphere_transport(24, (16, 32), 80)
PIXELS = len(TRANSPORT.pixels)


def test_target_weights_follow_eq_6() -> None:
    rng = np.random.default_rng(1)
    picture = rng.random(PIXELS) * 7 + 3
    face = rng.random(PIXELS) < 0.7
    f = target_weights(picture, face)
    inside = picture[face]
    scaled = (inside - inside.min()) / (inside.max() - inside.min())
    np.testing.assert_allclose(f[face], scaled - scaled.mean(), atol=1e-12)
    assert (f[~face] == 0).all()
    assert abs(f.sum()) < 1e-6
    assert np.ptp(f[face]) == pytest.approx(1.0)


@given(st.floats(1e-6, 1e6), st.floats(0, 1e3))
def test_target_weights_ignore_exposure_and_offset(gain: float, offset: float) -> None:
    picture = np.linspace(0, 1, 50) ** 2
    face = np.ones(50, bool)
    np.testing.assert_allclose(
        target_weights(gain * (picture + offset), face), target_weights(picture, face), atol=1e-7
    )


@pytest.mark.parametrize("picture", [np.ones(9), np.zeros(9), np.full(9, np.nan)])
def test_a_picture_that_asks_for_nothing_is_refused(picture: np.ndarray) -> None:
    with pytest.raises(StyleError, match="target picture"):
        target_weights(picture, np.ones(9, bool))


def test_a_picture_without_face_is_refused() -> None:
    with pytest.raises(StyleError):
        target_weights(np.arange(9.0), np.zeros(9, bool))


def test_painted_weights_leave_ignored_pixels_at_zero() -> None:
    values = np.arange(10.0)
    face = np.arange(10) < 8
    ignored = np.arange(10) == 3
    f = painted_weights(values, face, ignored)
    assert (f[[3, 8, 9]] == 0).all()
    assert abs(f.sum()) < 1e-12
    np.testing.assert_allclose(np.diff(f[4:8]), 1.0)


def test_painted_weights_with_everything_ignored_are_zero() -> None:
    face = np.ones(5, bool)
    assert (painted_weights(np.arange(5.0), face, face) == 0).all()


def test_a_target_painted_whole_pre_integrates_as_eq_3() -> None:
    picture = lamp_target(TRANSPORT, ((35.0, 35.0, 1.0),)) @ np.array([0.2126, 0.7152, 0.0722])
    f = target_weights(picture, TRANSPORT.face)
    state = painted(TRANSPORT, f)
    direct = f @ matrix(TRANSPORT)
    scale = np.abs(direct).max()
    np.testing.assert_allclose(state.preintegrated(TRANSPORT).ravel(), direct, atol=1e-5 * scale)
    np.testing.assert_allclose(state.weights, f, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_strokes_give_what_starting_afresh_gives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values, ignored = rng.random(PIXELS), rng.random(PIXELS) < 0.2
    state = painted(TRANSPORT, values, ignored)
    for _ in range(20):
        chosen = rng.choice(PIXELS, rng.integers(1, 30), replace=False)
        values[chosen], ignored[chosen] = rng.random(len(chosen)), rng.random(len(chosen)) < 0.3
        state = paint(TRANSPORT, state, chosen, values[chosen], ignored[chosen])
    fresh = painted(TRANSPORT, values, ignored)
    assert state.count == fresh.count
    np.testing.assert_allclose(state.weights, fresh.weights, atol=1e-12)
    expected = fresh.preintegrated(TRANSPORT)
    np.testing.assert_allclose(
        state.preintegrated(TRANSPORT), expected, atol=1e-5 * np.abs(expected).max()
    )
    full = preintegrate(TRANSPORT, fresh.weights)
    np.testing.assert_allclose(expected, full, atol=1e-5 * np.abs(full).max())


def test_a_thousand_strokes_do_not_drift() -> None:
    rng = np.random.default_rng(7)
    values = rng.random(PIXELS)
    state = painted(TRANSPORT, values)
    for _ in range(1000):
        chosen = rng.choice(PIXELS, 20, replace=False)
        values[chosen] = rng.random(20)
        state = paint(TRANSPORT, state, chosen, values[chosen])
    expected = painted(TRANSPORT, values).preintegrated(TRANSPORT)
    np.testing.assert_allclose(
        state.preintegrated(TRANSPORT), expected, atol=1e-5 * np.abs(expected).max()
    )


def test_a_stroke_reads_only_its_own_rows() -> None:
    """Rows that the stroke does not touch may hold anything."""
    state = painted(TRANSPORT, np.linspace(0, 1, PIXELS))
    chosen = np.array([3, 50, 51])
    spoiled = lambert_sphere_transport.__wrapped__(24, (16, 32), 80)
    others = np.setdiff1d(np.arange(PIXELS), chosen)
    spoiled.luminance_basis[others] = np.nan
    after = paint(spoiled, state, chosen, np.array([0.0, 1.0, 0.5]))
    expected = paint(TRANSPORT, state, chosen, np.array([0.0, 1.0, 0.5]))
    np.testing.assert_array_equal(after.coefficients, expected.coefficients)


def test_the_state_before_a_stroke_is_kept_for_undo() -> None:
    before = painted(TRANSPORT, np.linspace(0, 1, PIXELS))
    copy = before.values.copy()
    paint(TRANSPORT, before, np.array([0, 1]), np.array([9.0, 9.0]))
    np.testing.assert_array_equal(before.values, copy)


def test_strokes_outside_the_face_change_nothing() -> None:
    coverage = TRANSPORT.coverage.copy()
    coverage[:40] = 0.3
    partial = lambert_sphere_transport.__wrapped__(24, (16, 32), 80)
    object.__setattr__(partial, "coverage", coverage)
    state = painted(partial, np.linspace(0, 1, PIXELS))
    after = paint(partial, state, np.arange(40), np.ones(40), np.zeros(40, bool))
    np.testing.assert_array_equal(after.weights, state.weights)


@pytest.mark.parametrize("values", [np.ones(PIXELS + 1), np.full(PIXELS, np.inf)])
def test_painted_values_that_do_not_fit_are_refused(values: np.ndarray) -> None:
    with pytest.raises(StyleError, match="painted"):
        painted(TRANSPORT, values)
