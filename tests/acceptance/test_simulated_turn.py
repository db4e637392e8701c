"""A scripted photographer at the demo location follows the number, and nothing else.

A sample of the runs of ``benchmarks/simulated_turn.py``, which prints the table of all 200.
"""

from __future__ import annotations

from functools import cache

import pytest

from app.core.solver.turn_choice import Objective
from benchmarks.scripted_turn.turn_loop import Outcome
from benchmarks.scripted_turn.turn_runs import demo_world, draw, run_turn

RUNS = range(0, 200, 17)


@cache
def outcomes(objective: Objective = "paper") -> tuple[Outcome, ...]:
    place = demo_world(objective)
    return tuple(run_turn(draw(number, place, 0.5), place, 60.0) for number in RUNS)


@pytest.mark.slow
@pytest.mark.timeout(1500)
@pytest.mark.parametrize(
    "objective",
    [
        "paper",
        pytest.param(
            "picture",
            marks=pytest.mark.xfail(
                strict=True,
                reason="a grade may end an arc beside its best turn, or leave it 5 degrees wide",
            ),
        ),
    ],
)
def test_he_ends_in_the_light(objective: Objective) -> None:
    """98 % of 200 runs must; of twelve that means all."""
    missed = [
        (number, round(o.error_deg, 1))
        for number, o in zip(RUNS, outcomes(objective), strict=True)
        if not o.inside
    ]
    assert not missed


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_he_ends_near_the_best() -> None:
    errors = [abs(o.error_deg) for o in outcomes()]
    assert sum(errors) / len(errors) <= 3.0


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_he_is_told_the_truth_on_the_way() -> None:
    told = sorted(abs(e) for o in outcomes() for e in o.told_errors_deg)
    assert len(told) > 300
    assert told[len(told) // 2] <= 1.5
    assert told[int(0.95 * len(told))] <= 6.0  # smoothed, and he walks by up to 40 deg/s


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_he_takes_seconds_not_minutes() -> None:
    times = sorted(o.seconds for o in outcomes())
    assert times[len(times) // 2] < 20.0
