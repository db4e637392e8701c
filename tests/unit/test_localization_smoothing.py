"""Values on a leash: still when nothing moves, never far behind when something does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization.live.temporal_filters import Leash, Steady, steadied

LEASH: Final = Leash(0.95, 4.0)
JITTER: Final = 0.3


def run(
    truth: Callable[[float], float], seconds: float, fps: float, jitter: float = JITTER
) -> NDArray[np.float64]:
    """Times, truths, what is shown and what was measured, with uneven pauses."""
    chance = np.random.default_rng(1)
    state: Steady | None = None
    rows, now = [], 0.0
    while now < seconds:
        value = np.array([truth(now) + chance.normal(0.0, jitter)])
        state = Steady.at(value, now) if state is None else steadied(state, value, now, LEASH)
        rows.append((now, truth(now), float(state.position[0]), float(value[0])))
        now += chance.uniform(0.7, 1.3) / fps
    return np.array(rows)


@pytest.mark.parametrize("fps", [8.0, 15.0, 24.0])
def test_jitter_is_stilled(fps: float) -> None:
    """Of 0.3 deg of jitter some 0.05 are left."""
    shown = run(lambda _: 40.0, 120.0, fps)[int(2 * fps) :, 2]
    assert shown.std() < 0.075
    assert np.abs(shown - 40.0).max() < 0.4


@pytest.mark.parametrize("fps", [8.0, 15.0, 24.0])
@pytest.mark.parametrize("speed", [5.0, 10.0, 20.0, 40.0])
def test_the_lag_of_a_turn(fps: float, speed: float) -> None:
    """Less than a degree, and less than 50 ms from 10 deg/s on; from standing still."""
    rows = run(lambda t: speed * max(t - 1.0, 0.0), 6.0, fps)
    behind = (rows[:, 1] - rows[:, 2])[rows[:, 0] > 1.0]
    assert behind.mean() < (1.0 if speed < 10.0 else 0.05 * speed)
    clean = run(lambda t: speed * max(t - 1.0, 0.0), 6.0, fps, jitter=0.0)
    assert (clean[:, 1] - clean[:, 2]).max() < 1.0


def test_a_step_is_followed_at_once() -> None:
    rows = run(lambda t: 0.0 if t < 1.0 else 5.0, 4.0, 15.0, jitter=0.0)
    after = rows[rows[:, 0] >= 1.0]
    assert after[0, 2] > 4.0
    assert np.abs(after[after[:, 0] > 3.5, 2] - 5.0).max() < 0.2
    assert after[:, 2].max() <= 5.0 + 1e-9, "nothing overshoots"


@pytest.mark.parametrize("stop", [10.0, 40.0])
def test_nothing_overshoots_where_a_turn_stops(stop: float) -> None:
    rows = run(lambda t: stop * min(t, 1.0), 5.0, 15.0, jitter=0.0)
    assert rows[:, 2].max() <= stop + 1e-9
    assert rows[-1, 2] == pytest.approx(stop, abs=0.1)


def test_the_leash_holds_whatever_happens() -> None:
    chance = np.random.default_rng(7)
    state, now = Steady.at(np.zeros((4, 2)), 0.0), 0.0
    for _ in range(500):
        now += float(chance.choice([0.0, 0.01, 0.1, 3.0]))
        value = state.measured + chance.normal(0.0, chance.choice([0.1, 2.0, 50.0]), (4, 2))
        state = steadied(state, value, now, LEASH)
        assert np.isfinite(state.position).all()
        assert np.abs(state.position - value).max() <= LEASH.length + 1e-9


def test_a_clock_that_stands_still_or_goes_back_does_no_harm() -> None:
    state = Steady.at(np.array([10.0]), 5.0)
    same = steadied(state, np.array([10.4]), 5.0, LEASH)
    assert same.speed[0] == 0.0
    back = steadied(same, np.array([10.4]), 4.0, LEASH)
    assert back.time_s == 5.0
    assert np.isfinite(back.position).all()


def test_what_was_handed_in_is_not_changed_later() -> None:
    value = np.array([1.0])
    state = Steady.at(value, 0.0)
    value[0] = 9.0
    assert state.position[0] == 1.0
