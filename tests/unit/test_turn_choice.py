"""The rule for the turn that is offered and for what is in reach, on curves made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.angles import TURNS
from app.core.solver.style_signature import NO, SOFT, YES
from app.core.solver.turn_choice import LIMITS, Choice, Limits, Objective, StyleMeasures, choose

TURN = np.arange(TURNS)


def bump(at: int, height: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A curve with one peak."""
    away = np.minimum((TURN - at) % TURNS, (at - TURN) % TURNS)
    return height * np.exp(-((away / 6.0) ** 2))


NONE = np.full(TURNS, np.nan)
ONES = np.ones(TURNS)


def chosen(
    match: tuple[int, float],
    yes: tuple[int, float],
    soft: tuple[int, float],
    objective: Objective = "picture",
) -> Choice:
    """A style with a signature: it is shown where its bump reaches 1."""
    shown = (bump(*yes) - 1.0, bump(*soft) - 1.0)
    return choose(
        StyleMeasures(bump(50, 1.0), bump(*match), bump(10, 50.0), *shown, ONES), objective
    )


def painted(
    match: tuple[int, float], strength: tuple[int, float], limits: Limits = LIMITS
) -> Choice:
    measured = StyleMeasures(bump(50, 1.0), bump(*match), bump(*strength), NONE, NONE, ONES)
    return choose(measured, limits=limits)


@pytest.mark.parametrize(
    ("case", "turn", "reach", "grade"),
    [
        # The best match is taken among the turns that show the style ...
        (chosen((10, 90.0), (10, 4.0), (10, 8.0)), 10, True, YES),
        # ... even where another turn matches a little better without showing it ...
        (chosen((10, 90.0), (14, 1.5), (14, 3.0)), 11, True, YES),
        # ... and among those that show it softly where none does.
        (chosen((10, 90.0), (14, 0.9), (14, 1.5)), 11, True, SOFT),
        # A better grade goes first, however much less its turns match.
        (chosen((10, 90.0), (17, 1.5), (14, 1.5)), 14, True, YES),
        (chosen((10, 90.0), (30, 1.5), (30, 2.0)), 27, True, YES),
        (chosen((10, 90.0), (30, 0.5), (30, 2.0)), 26, True, SOFT),
        # No turn shows it: the best match of all.
        (chosen((10, 90.0), (17, 0.5), (17, 0.9)), 10, False, NO),
        # The paper's objective looks at quality alone.
        (chosen((10, 90.0), (10, 4.0), (10, 8.0), "paper"), 50, False, NO),
    ],
)
def test_the_turn_and_the_reach(case: Choice, turn: int, reach: bool, grade: int) -> None:
    assert int(case.best) == turn
    assert bool(case.in_reach) is reach
    assert int(case.grade) == grade


@pytest.mark.parametrize(
    ("case", "turn", "reach"),
    [
        # The best match is taken where the strength is enough ...
        (painted((10, 90.0), (10, 80.0)), 10, True),
        # ... even where another turn matches better without it.
        (painted((10, 90.0), (17, 40.0)), 13, True),
        (painted((10, 40.0), (10, 80.0)), 10, False),
        # No strength at all: the largest quality.
        (painted((10, 40.0), (10, 5.0)), 50, False),
        # No strength is asked: the best match of all turns.
        (painted((10, 90.0), (30, 80.0), Limits(45.0, 0.0)), 10, True),
    ],
)
def test_without_a_signature(case: Choice, turn: int, reach: bool) -> None:
    assert int(case.best) == turn
    assert bool(case.in_reach) is reach


def test_many_styles_at_once_are_as_each_by_itself() -> None:
    random = np.random.default_rng(3)
    curves = random.normal(30.0, 25.0, (6, 5, 7, TURNS))
    curves[3:5, ::2] -= 150.0
    curves[3:5, :, 2] = np.nan
    together = choose(StyleMeasures(*curves))
    assert {NO, SOFT, YES} == set(together.grade.ravel().tolist())
    for light in range(5):
        for row in range(7):
            alone = choose(StyleMeasures(*curves[:, light, row]))
            part = together[light][row]
            np.testing.assert_array_equal(part.eligible, alone.eligible)
            np.testing.assert_array_equal(part.curve, alone.curve)
            assert bool(part.in_reach) == bool(alone.in_reach)


def test_what_is_closed_is_never_chosen() -> None:
    measured = StyleMeasures(
        bump(50, 1.0),
        bump(10, 90.0),
        bump(10, 80.0),
        bump(10, 8.0) - 1.0,
        bump(10, 9.0) - 1.0,
        ONES,
    )
    is_open = (TURN < 5) | (TURN > 20)
    assert int(choose(measured).best) == 10
    assert int(choose(measured, is_open=is_open).best) in (4, 21)
    assert not choose(measured, is_open=is_open).eligible[10]
