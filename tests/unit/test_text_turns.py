"""The words of a turn: against the geometry of people who stand on a floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base import sphere
from app.core.base.angles import Direction, direction_of, whole, wrap
from app.core.guidance.who_moves import Mode
from app.core.solver.solve import solve_all
from app.words.phrases import turns
from app.words.phrases.directions import light_words
from tests.helpers.synthetic import lamp_environment, synthetic_pack

TURNS = st.floats(-179.4, 179.4)


@given(st.floats(-720.0, 720.0))
def test_whole_degrees_are_near_and_in_range(turn: float) -> None:
    number = whole(turn)
    assert -180 < number <= 180
    assert abs(wrap(turn - number)) <= 0.5 + 1e-9


@given(TURNS)
def test_left_and_right_are_mirrors(turn: float) -> None:
    assert whole(-turn) == -whole(turn)
    there, back = turns.turn_words(turn), turns.turn_words(-turn)
    if whole(turn):
        assert {there.partition(" ")[2], back.partition(" ")[2]} == {
            "clockwise",
            "counter-clockwise",
        }
        assert there.partition(" ")[0] == back.partition(" ")[0]


def test_rounding_never_gives_minus_180_or_minus_0() -> None:
    assert turns.signed(-179.8) == turns.signed(180.0) == "180°"
    assert turns.turn_words(-179.8) == "180° clockwise"
    assert turns.signed(-0.4) == "0°"
    assert turns.turn_words(-0.4) == "no turn needed"
    assert turns.signed(-4.2) == "−4°"


@pytest.mark.parametrize(
    ("arc", "text"),
    [
        ((79.2, 110.6), "79° to 111°"),
        ((-12.0, 12.0), "−12° to 12°"),
        ((170.4, -165.2), "170° to −165°"),
        ((170.0, -179.9), "170° to 180°"),
        ((-180.0, 180.0), "any turn"),
    ],
)
def test_arcs(arc: tuple[float, float], text: str) -> None:
    assert turns.arc_words(arc) == text


@given(st.integers(-179, 180))
def test_the_hour_is_the_nearest_on_a_clock_that_lies_on_the_floor(turn: int) -> None:
    hour = int(turns.clock_words(turn).split()[1])
    assert 1 <= hour <= 12
    assert abs(wrap(turn - 30.0 * hour)) <= 15.0


def test_goal_words_of_the_mock_up() -> None:
    assert turns.goal_words(95.6) == "Turn 96° clockwise, towards 3 o’clock"
    assert turns.goal_words(0.2) == "No turn needed"


@pytest.mark.parametrize("turn", [-150.0, -60.0, 0.0, 45.0, 170.0])
@pytest.mark.parametrize("direction", ["clockwise", "counter-clockwise"])
def test_walking_words_are_what_the_feet_must_do(turn: float, direction: Direction) -> None:
    """Seen from above: the way the photographer goes lies to the side that the words name."""
    step = 1.0 if direction == "clockwise" else -1.0
    here, there = sphere.direction(turn, 0.0), sphere.direction(turn + step, 0.0)
    went = there - here  # around the sitter in the middle
    facing = -here
    left = np.cross(np.array([0.0, 1.0, 0.0]), facing)
    text, company = turns.walking_words(direction, Mode.WALK)
    assert text == ("Walk to your left" if went @ left > 0 else "Walk to your right")
    assert company == "The sitter turns with you."


@pytest.mark.parametrize("turn", [-150.0, 0.0, 170.0])
@pytest.mark.parametrize("direction", ["clockwise", "counter-clockwise"])
def test_selfie_words_are_what_the_own_body_must_do(turn: float, direction: Direction) -> None:
    """Who faces the turn's azimuth and turns on the spot: towards the shoulder that is named."""
    step = 1.0 if direction == "clockwise" else -1.0
    before, after = sphere.direction(turn, 0.0), sphere.direction(turn + step, 0.0)
    left = np.cross(np.array([0.0, 1.0, 0.0]), before)
    text, _ = turns.walking_words(direction, Mode.SELFIE)
    assert text == ("Turn to your left" if after @ left > 0 else "Turn to your right")


def test_nothing_to_do_has_no_words() -> None:
    assert turns.walking_words("none", Mode.WALK) == ("", "")


def test_a_known_lamp_from_solve_to_words() -> None:
    """One lamp at azimuth 30: split from the sitter's left has it 90 deg to their left."""
    found = {
        style.name: style for style in solve_all(synthetic_pack(), lamp_environment(30.0, 10.0))
    }
    style = found["left-split"]
    turn = style.turn_refined_deg
    assert math.isclose(turn, 120.0, abs_tol=2.0)
    # Truth from the room: the sitter faces the turn; left is up cross front.
    left = np.cross(np.array([0.0, 1.0, 0.0]), sphere.direction(turn, 0.0))
    assert sphere.direction(30.0, 0.0) @ left > 0.99
    assert light_words(style.side) == "Light from the sitter’s left (camera right)"
    assert turns.direction_words(turn) == "clockwise"
    assert turns.walking_words(direction_of(turn), Mode.WALK)[0] == "Walk to your left"
    assert turns.walking_words(direction_of(turn), Mode.SELFIE)[0] == "Turn to your right"
    assert turns.clock_words(turn) == "towards 4 o’clock"
    mirrored = found["right-split"].turn_refined_deg
    assert turns.turn_words(mirrored) == f"{turns.size_words(mirrored)} counter-clockwise"
    assert turns.walking_words(direction_of(mirrored), Mode.WALK)[0] == "Walk to your right"
