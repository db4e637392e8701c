"""The words of a turn: against the geometry of people who stand on a floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base import sphere
from app.core.base.angles import wrap
from app.core.guidance import words
from app.core.guidance.words import Direction, Mode
from app.core.solver.solve import solve_all
from tests.helpers.synthetic import lamp_environment, synthetic_pack

TURNS = st.floats(-179.4, 179.4)


@given(st.floats(-720.0, 720.0))
def test_whole_degrees_are_near_and_in_range(turn: float) -> None:
    number = words.whole(turn)
    assert -180 < number <= 180
    assert abs(wrap(turn - number)) <= 0.5 + 1e-9


@given(TURNS)
def test_left_and_right_are_mirrors(turn: float) -> None:
    assert words.whole(-turn) == -words.whole(turn)
    there, back = words.turn_words(turn), words.turn_words(-turn)
    if words.whole(turn):
        assert {there.partition(" ")[2], back.partition(" ")[2]} == {
            "clockwise",
            "counter-clockwise",
        }
        assert there.partition(" ")[0] == back.partition(" ")[0]


def test_rounding_never_gives_minus_180_or_minus_0() -> None:
    assert words.signed(-179.8) == words.signed(180.0) == "180°"
    assert words.turn_words(-179.8) == "180° clockwise"
    assert words.signed(-0.4) == "0°"
    assert words.turn_words(-0.4) == "no turn needed"
    assert words.signed(-4.2) == "−4°"


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
    assert words.arc_words(arc) == text
    assert words.strip_arc_words(arc).startswith("in the light")


@given(st.integers(-179, 180))
def test_the_hour_is_the_nearest_on_a_clock_that_lies_on_the_floor(turn: int) -> None:
    hour = int(words.clock_words(turn).split()[1])
    assert 1 <= hour <= 12
    assert abs(wrap(turn - 30.0 * hour)) <= 15.0


def test_goal_words_of_the_mock_up() -> None:
    assert words.goal_words(95.6) == "Turn 96° clockwise, toward 3 o’clock"
    assert words.goal_words(0.2) == "No turn needed"


def test_sides_are_named_twice() -> None:
    assert words.side_words("left") == "Light from the sitter’s left (camera right)"
    assert words.side_words("right") == "Light from the sitter’s right (camera left)"
    assert words.side_words("none", "in front, from above") == "Light in front, from above"
    assert words.side_words("none") == ""


@pytest.mark.parametrize("turn", [-150.0, -60.0, 0.0, 45.0, 170.0])
@pytest.mark.parametrize("direction", ["clockwise", "counter-clockwise"])
def test_walking_words_are_what_the_feet_must_do(turn: float, direction: Direction) -> None:
    """Seen from above: the way the photographer goes lies to the side that the words name."""
    step = 1.0 if direction == "clockwise" else -1.0
    here, there = sphere.direction(turn, 0.0), sphere.direction(turn + step, 0.0)
    went = there - here  # around the sitter in the middle
    facing = -here
    left = np.cross(np.array([0.0, 1.0, 0.0]), facing)
    text, company = words.walking_words(direction, Mode.WALK)
    assert text == ("Walk to your left" if went @ left > 0 else "Walk to your right")
    assert company == "The sitter turns with you."


@pytest.mark.parametrize("turn", [-150.0, 0.0, 170.0])
@pytest.mark.parametrize("direction", ["clockwise", "counter-clockwise"])
def test_selfie_words_are_what_the_own_body_must_do(turn: float, direction: Direction) -> None:
    """Who faces the turn's azimuth and turns on the spot: toward the shoulder that is named."""
    step = 1.0 if direction == "clockwise" else -1.0
    before, after = sphere.direction(turn, 0.0), sphere.direction(turn + step, 0.0)
    left = np.cross(np.array([0.0, 1.0, 0.0]), before)
    text, _ = words.walking_words(direction, Mode.SELFIE)
    assert text == ("Turn to your left" if after @ left > 0 else "Turn to your right")


def test_nothing_to_do_has_no_words() -> None:
    assert words.walking_words("none", Mode.WALK) == ("", "")


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
    assert words.side_words(style.side) == "Light from the sitter’s left (camera right)"
    assert words.direction_words(turn) == "clockwise"
    assert words.walking_words(words.direction_of(turn), Mode.WALK)[0] == "Walk to your left"
    assert words.walking_words(words.direction_of(turn), Mode.SELFIE)[0] == "Turn to your right"
    assert words.clock_words(turn) == "toward 4 o’clock"
    mirrored = found["right-split"].turn_refined_deg
    assert words.turn_words(mirrored) == f"{words.size_words(mirrored)} counter-clockwise"
    assert words.walking_words(words.direction_of(mirrored), Mode.WALK)[0] == "Walk to your right"
