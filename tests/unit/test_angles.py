"""Wrapping, the search grid and the words for turns."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base.angles import (
    difference,
    direction,
    lies_on_arc,
    turn_of_index,
    wrap,
)

ANGLES = st.floats(-1e6, 1e6)


@given(ANGLES)
def test_wrap_keeps_the_direction_and_the_range(angle: float) -> None:
    inside = wrap(angle)
    assert -180.0 < inside <= 180.0
    assert math.remainder(angle - inside, 360.0) == pytest.approx(0.0, abs=1e-9)


@given(ANGLES)
def test_wrap_mirrors_exactly(angle: float) -> None:
    assert wrap(-angle) == (-wrap(angle) if wrap(angle) != 180.0 else 180.0)


@pytest.mark.parametrize(
    ("angle", "inside"), [(0, 0), (180, 180), (-180, 180), (540, 180), (-0.0, 0)]
)
def test_wrap_at_the_ends(angle: float, inside: float) -> None:
    assert wrap(angle) == inside
    assert math.copysign(1.0, wrap(-0.0)) == 1.0


def test_turns_of_the_grid() -> None:
    assert turn_of_index(16) == 90.0
    assert turn_of_index(48) == -90.0
    assert turn_of_index(32) == 180.0


def test_difference_is_positive_clockwise() -> None:
    assert difference(10.0, 350.0) == 20.0
    assert difference(350.0, 10.0) == -20.0


@pytest.mark.parametrize(
    ("turn", "word"),
    [
        (5.0, "clockwise"),
        (-5.0, "counter-clockwise"),
        (0.04, "none"),
        (-0.04, "none"),
        (180.0, "clockwise"),
        (359.0, "counter-clockwise"),
    ],
)
def test_direction(turn: float, word: str) -> None:
    assert direction(turn) == word


def test_arcs_run_clockwise_and_may_wrap() -> None:
    assert lies_on_arc(0.0, (-10.0, 10.0))
    assert not lies_on_arc(180.0, (-10.0, 10.0))
    assert lies_on_arc(180.0, (10.0, -10.0))
    assert lies_on_arc(123.0, (-180.0, 180.0))
