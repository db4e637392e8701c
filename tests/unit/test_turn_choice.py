"""The rule for the turn that is offered and for what is in reach, on curves made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.angles import TURNS
from app.core.solver.turn_choice import LIMITS, Choice, Limits, Measured, Objective, choose

TURN = np.arange(TURNS)


def bump(at: int, height: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A curve with one peak."""
    away = np.minimum((TURN - at) % TURNS, (at - TURN) % TURNS)
    return height * np.exp(-((away / 6.0) ** 2))


def chosen(
    match: tuple[int, float],
    strength: tuple[int, float],
    whole: tuple[int, float],
    objective: Objective = "picture",
    limits: Limits = LIMITS,
) -> Choice:
    quality = bump(50, 1.0)
    return choose(Measured(quality, bump(*match), bump(*whole), bump(*strength)), objective, limits)


@pytest.mark.parametrize(
    ("case", "turn", "reach", "tier"),
    [
        # The best match is taken where every lamp shows ...
        (chosen((10, 90.0), (10, 80.0), (10, 80.0)), 10, True, 2),
        # ... even where another turn matches better without it.
        (chosen((10, 90.0), (17, 40.0), (17, 40.0)), 13, True, 2),
        # No match with all lamps: the pattern as a whole decides.
        (chosen((10, 40.0), (30, 80.0), (10, 80.0)), 10, False, 1),
        # No strength at all: the largest quality.
        (chosen((10, 40.0), (10, 5.0), (10, 5.0)), 50, False, 0),
        # The paper's objective looks at quality alone.
        (chosen((10, 90.0), (10, 80.0), (10, 80.0), "paper"), 50, False, 2),
        # No strength is asked: the best match of all turns.
        (chosen((10, 90.0), (30, 80.0), (30, 80.0), limits=Limits(45.0, 0.0)), 10, True, 2),
    ],
)
def test_the_turn_and_the_reach(case: Choice, turn: int, reach: bool, tier: int) -> None:
    assert int(case.best) == turn
    assert bool(case.in_reach) is reach
    assert int(case.tier) == tier


def test_many_styles_at_once_are_as_each_by_itself() -> None:
    random = np.random.default_rng(3)
    curves = random.normal(30.0, 25.0, (4, 5, 7, TURNS))
    together = choose(Measured(*curves))
    assert {0, 1, 2} >= set(together.tier.ravel().tolist())
    for light in range(5):
        for row in range(7):
            alone = choose(Measured(*curves[:, light, row]))
            part = together[light][row]
            np.testing.assert_array_equal(part.allowed, alone.allowed)
            np.testing.assert_array_equal(part.curve, alone.curve)
            assert bool(part.in_reach) == bool(alone.in_reach)


def test_what_is_closed_is_never_chosen() -> None:
    measured = Measured(bump(50, 1.0), bump(10, 90.0), bump(10, 80.0), bump(10, 80.0))
    is_open = (TURN < 5) | (TURN > 20)
    assert int(choose(measured).best) == 10
    assert int(choose(measured, is_open=is_open).best) in (4, 21)
    assert not choose(measured, is_open=is_open).allowed[10]
