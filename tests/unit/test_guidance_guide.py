"""The guidance: numbers that add up, the way that is kept, and every state in words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.guidance.guide import (
    FRESH,
    HOLD_DEG,
    LOCK_DEG,
    NOSE_DEG,
    Goal,
    Guide,
    GuideMemory,
    HeadingSource,
    Phase,
    Reading,
    guide,
)
from app.core.guidance.who_moves import Mode
from app.words.guidance import (
    ARC_IN_LIGHT,
    AT_GOAL,
    HOLD,
    IN_LIGHT,
    MEASURING,
    NOSE_TO,
    STILL,
    TOO_FAR,
    TROUBLE,
    arc_words,
    guide_words,
)
from app.words.phrases.directions import lens_words, nose_words, sitter_words
from app.words.phrases.turns import goal_words, walking_words

REMBRANDT = Goal(95.6, (79.2, 110.6))
TURN = st.floats(-360.0, 360.0)
WALK_LEFT, WALK_RIGHT = (
    walking_words(direction, Mode.WALK)[0] for direction in ("clockwise", "counter-clockwise")
)
RIGHT_ON_THE_SPOT, LEFT_ON_THE_SPOT = (
    walking_words(direction, Mode.SELFIE)[0] for direction in ("clockwise", "counter-clockwise")
)


def walk(goal: Goal, turns: Iterable[float | None]) -> list[Guide]:
    memory, shown = FRESH, []
    for number, turn in enumerate(turns):
        one, memory = guide(goal, Reading(turn, 0.2 * number), memory)
        shown.append(one)
    return shown


def at(goal: Goal, turn: float | None) -> Guide:
    return walk(goal, [turn])[0]


def test_the_mock_up() -> None:
    shown = at(REMBRANDT, 73.3)
    words = guide_words(shown)
    assert (shown.goal, shown.now, shown.to_go, shown.number) == (96, 73, 23, 23)
    assert words.number_words == "to go"
    assert words.headline == shown.direction == "clockwise"
    assert (words.walk, words.company) == walking_words("clockwise", Mode.WALK)
    assert (shown.until_light, words.light) == (6, IN_LIGHT.near)
    assert arc_words(shown) == ARC_IN_LIGHT
    assert shown.phase is Phase.TURN


def test_selfie_has_words_of_its_own() -> None:
    assert guide_words(at(REMBRANDT, 73.3), Mode.SELFIE).walk == RIGHT_ON_THE_SPOT
    back = at(Goal(-40.0, (-50.0, -30.0)), 0.0)
    assert guide_words(back, Mode.SELFIE).walk == LEFT_ON_THE_SPOT
    assert guide_words(back).walk == WALK_RIGHT


@given(TURN, st.lists(TURN, min_size=1, max_size=12), st.floats(2.0, 90.0), st.floats(2.0, 90.0))
def test_to_go_is_goal_minus_now_of_the_shown_degrees(
    goal: float, turns: list[float], before: float, after: float
) -> None:
    arc = ((goal - before + 180) % 360 - 180, (goal + after + 180) % 360 - 180)
    for shown in walk(Goal(goal, arc), turns):
        assert shown.now is not None
        assert shown.to_go is not None
        assert -180 < shown.now <= 180
        assert (shown.goal - shown.now - shown.to_go) % 360 == 0
        assert shown.number == abs(shown.to_go)
        signs = {"clockwise": 1, "counter-clockwise": -1, "none": 0}
        assert signs[shown.direction] * abs(shown.to_go) == shown.to_go
        # The other way round is never 10 deg shorter than the one that is shown.
        assert 360 - abs(shown.to_go) > abs(shown.to_go) - 10
        away = min(abs(shown.to_go), 360 - abs(shown.to_go))
        assert shown.hold or away > HOLD_DEG
        assert not shown.hold or away <= HOLD_DEG + LOCK_DEG
        assert shown.inside == (shown.until_light == 0)
        assert shown.inside or not shown.hold


@given(st.integers(-179, 180), st.integers(-179, 180), st.integers(3, 80), st.integers(3, 80))
def test_inside_is_being_on_the_arc_in_shown_degrees(
    goal: int, now: int, before: int, after: int
) -> None:
    shown = at(Goal(goal, (goal - before, goal + after)), now)
    assert shown.inside == ((now - goal + before) % 360 <= before + after)
    if not shown.inside:
        assert shown.until_light is not None
        assert shown.to_go is not None
        step = 1 if shown.to_go > 0 else -1
        # Who goes so far on the way shown has just come in, and not one degree before.
        assert at(Goal(goal, (goal - before, goal + after)), now + step * shown.until_light).inside
        edge = now + step * (shown.until_light - 1)
        assert not at(Goal(goal, (goal - before, goal + after)), edge).inside


def test_the_shorter_way_is_kept_until_the_other_is_ten_shorter() -> None:
    goal = Goal(0.0, (-10.0, 10.0))
    turns = [-175.0, -179.0, 177.0, 176.0, 175.0, 176.0, -178.0, -175.0]
    assert [one.to_go for one in walk(goal, turns)] == [175, 179, 183, 184, -175, -176, -182, 175]


def test_half_way_round_goes_clockwise() -> None:
    assert at(Goal(180.0), 0.0).to_go == 180
    assert at(Goal(-179.7), 0.0).to_go == 180
    assert at(Goal(0.0), 180.0).to_go == 180


def test_across_the_seam() -> None:
    goal = Goal(-175.0, (170.0, -160.0))
    shown = at(goal, 160.0)
    assert (shown.to_go, shown.direction, shown.until_light) == (25, "clockwise", 10)
    assert guide_words(at(goal, 159.0)).light == IN_LIGHT.before
    inside = at(goal, 175.0)
    assert inside.inside
    assert inside.to_go == 10
    assert at(goal, -150.0).to_go == -25


def test_inside_and_hold() -> None:
    inside = at(REMBRANDT, 92.0)
    assert inside.phase is Phase.INSIDE
    assert guide_words(inside).headline == IN_LIGHT.here
    assert (inside.number, guide_words(inside).walk) == (4, WALK_LEFT)
    for turn in (94.0, 96.0, 98.0):
        hold = at(REMBRANDT, turn)
        assert hold.phase is Phase.HOLD
        assert (guide_words(hold).headline, guide_words(hold).walk) == (HOLD, "")
        assert guide_words(hold).light == IN_LIGHT.here


def test_past_the_end_of_the_arc_is_too_far() -> None:
    seen = walk(REMBRANDT, [60.0, 78.0, 80.0, 95.0, 111.0, 113.0, 117.0, 110.0, 117.0])
    assert [one.phase for one in seen] == [
        Phase.TURN,
        Phase.TURN,
        Phase.INSIDE,
        Phase.HOLD,
        Phase.INSIDE,
        Phase.BEYOND,
        Phase.BEYOND,
        Phase.INSIDE,
        Phase.BEYOND,
    ]
    assert (seen[6].until_light, guide_words(seen[6]).light) == (6, TOO_FAR)
    assert guide_words(seen[6]).walk == WALK_RIGHT
    assert seen[6].to_go == -21


def test_in_the_light_is_not_left_by_a_tremble() -> None:
    edge = [110.0, 112.0, 110.0, 112.0, 113.0, 112.0, 111.0, 112.0]
    inside = [True, True, True, True, False, False, True, True]
    seen = walk(REMBRANDT, edge)
    assert [one.inside for one in seen] == inside
    # The number is never held back, and one who is told to be in the light gets no other words.
    assert [one.number for one in seen] == [14, 16, 14, 16, 17, 16, 15, 16]
    assert {guide_words(one).light for one in seen if one.inside} == {IN_LIGHT.here}
    assert (seen[4].until_light, guide_words(seen[4]).light) == (2, TOO_FAR)
    holds = [one.hold for one in walk(REMBRANDT, [93.0, 94.0, 93.0, 92.0, 93.0])]
    assert holds == [False, True, True, False, False]


def test_another_goal_is_not_entered_by_the_old_ones_lock() -> None:
    _, memory = guide(REMBRANDT, Reading(96.0, 0.0))
    shown, _ = guide(Goal(112.0, (97.0, 130.0)), Reading(96.0, 0.1), memory)
    assert (shown.inside, shown.until_light, guide_words(shown).light) == (
        False,
        1,
        IN_LIGHT.near,
    )


def test_a_camera_left_behind_says_nothing_of_the_turn() -> None:
    shown, memory = guide(REMBRANDT, Reading(96.0, 0.0))
    assert shown.hold
    shown, memory = guide(REMBRANDT, Reading(96.0, 0.1, left_behind=True), memory)
    assert shown.phase is Phase.LEFT
    assert (shown.number, shown.now, shown.inside) == (None, None, False)
    assert guide_words(shown).headline == TROUBLE[Phase.LEFT]
    # It is picked up: what it sees counts from now on, and no old number comes back.
    shown, memory = guide(REMBRANDT, Reading(None, 0.2), memory)
    assert shown.phase is Phase.LOST
    shown, memory = guide(REMBRANDT, Reading(93.0, 0.3), memory)
    assert (shown.inside, shown.hold, shown.number) == (True, False, 3)


def test_going_back_out_where_one_came_in_is_not_too_far() -> None:
    seen = walk(REMBRANDT, [60.0, 85.0, 73.0])
    assert (seen[-1].until_light, guide_words(seen[-1]).light) == (6, IN_LIGHT.near)


def test_leaving_from_a_start_inside_is_too_far_either_way() -> None:
    for turn in (73.0, 117.0):
        shown = walk(REMBRANDT, [96.0, turn])[-1]
        assert (shown.until_light, guide_words(shown).light) == (6, TOO_FAR)


def test_a_leap_over_the_arc_is_too_far_and_far_away_is_not() -> None:
    seen = walk(REMBRANDT, [60.0, 125.0, -150.0])
    assert seen[1].phase is Phase.BEYOND
    assert seen[2].phase is Phase.TURN


def test_a_new_goal_forgets_what_was_too_far() -> None:
    memory = FRESH
    for turn in (60.0, 96.0, 120.0):
        shown, memory = guide(REMBRANDT, Reading(turn, 0.0), memory)
    assert shown.beyond
    shown, memory = guide(Goal(0.0, (-10.0, 10.0)), Reading(120.0, 0.0), memory)
    assert not shown.beyond


def test_a_number_does_not_flicker() -> None:
    seen = [one.now for one in walk(REMBRANDT, [73.0, 73.6, 73.4, 73.65, 73.8, 73.4, 73.2])]
    assert seen == [73, 73, 73, 73, 74, 74, 73]


def test_lost_for_a_second() -> None:
    memory: GuideMemory
    shown, memory = guide(REMBRANDT, Reading(73.0, 10.0))
    shown, memory = guide(REMBRANDT, Reading(None, 10.9), memory)
    assert shown.number == 23
    shown, memory = guide(REMBRANDT, Reading(None, 11.0), memory)
    assert shown.phase is Phase.LOST
    assert (shown.number, shown.now, shown.to_go) == (None, None, None)
    assert guide_words(shown).headline == TROUBLE[Phase.LOST]
    shown, memory = guide(REMBRANDT, Reading(74.0, 11.1), memory)
    assert shown.number == 22


def test_no_number_before_the_first_heading() -> None:
    assert at(REMBRANDT, None).phase is Phase.LOST


def test_without_a_webcam() -> None:
    shown, _ = guide(REMBRANDT, Reading(None, 0.0, HeadingSource.NONE))
    assert guide_words(shown).headline.endswith(goal_words(96.0))
    assert (shown.number, guide_words(shown).number_words, guide_words(shown).walk) == (
        96,
        "",
        WALK_LEFT,
    )
    assert shown.now is None
    ready, _ = guide(Goal(0.0), Reading(None, 0.0, HeadingSource.NONE))
    assert guide_words(ready).headline.endswith(goal_words(0.0))


def test_without_a_heading_it_counts_from_where_the_photo_was_taken() -> None:
    shown, _ = guide(REMBRANDT, Reading(None, 0.0, HeadingSource.NONE, from_deg=108.3))
    assert (shown.number, shown.direction, guide_words(shown).walk) == (
        12,
        "counter-clockwise",
        WALK_RIGHT,
    )
    assert guide_words(shown).headline.endswith(goal_words(-12.0, 108.3))


def test_unplugged_and_back() -> None:
    shown, memory = guide(REMBRANDT, Reading(73.0, 0.0))
    shown, memory = guide(REMBRANDT, Reading(73.0, 0.1, HeadingSource.AWAY), memory)
    assert guide_words(shown).headline == TROUBLE[Phase.AWAY]
    assert shown.number is None
    shown, memory = guide(REMBRANDT, Reading(None, 0.2, HeadingSource.STARTING), memory)
    assert (shown.phase, shown.number) == (Phase.STARTING, 96), "the number stands at once"
    shown, memory = guide(REMBRANDT, Reading(None, 0.3), memory)
    assert shown.phase is Phase.LOST  # no old number after a break
    shown, memory = guide(REMBRANDT, Reading(73.0, 0.4), memory)
    assert shown.number == 23


@pytest.mark.parametrize("arc", [None, (10.0, 20.0)])
def test_a_turn_of_ones_own_counts_by_itself(arc: tuple[float, float] | None) -> None:
    goal = Goal(96.0, arc)
    assert (at(goal, 93.0).until_light, guide_words(at(goal, 93.0)).light) == (
        1,
        AT_GOAL.near,
    )
    assert at(goal, 94.0).hold
    assert at(goal, 15.0).inside is False
    assert arc_words(at(goal, 15.0)) == ""


def test_any_turn_will_do() -> None:
    shown = at(Goal(10.0, (-180.0, 180.0)), -100.0)
    assert shown.inside
    assert arc_words(shown) == ARC_IN_LIGHT


# -- nose and lens apart -----------------------------------------------------------------------

ASIDE = Goal(96.0, (79.0, 111.0), yaw_deg=30.0)


def faced(yaws: Iterable[float | None], turn: float = 96.0) -> list[Guide]:
    """Stand there while a face is read four times a second."""
    memory, shown = FRESH, []
    for number, yaw in enumerate(yaws):
        reading = Reading(turn, 100.0 + 0.25 * number, yaw_deg=yaw)
        one, memory = guide(ASIDE, reading, memory)
        shown.append(one)
    return shown


def test_where_one_stands_and_what_one_says_are_told_while_one_walks() -> None:
    shown = at(ASIDE, 40.0)
    assert (shown.number, shown.direction, guide_words(shown).walk) == (
        56,
        "clockwise",
        WALK_LEFT,
    )
    assert guide_words(shown).company == f"{lens_words(30.0)}.\n“{sitter_words(30.0)}.”"
    other = at(Goal(96.0, yaw_deg=-15.0), 40.0)
    assert guide_words(other).company == f"{lens_words(-15.0)}.\n“{sitter_words(-15.0)}.”"
    alone = guide_words(at(ASIDE, 40.0), Mode.SELFIE)
    _, company = walking_words("clockwise", Mode.SELFIE)
    assert alone.company == f"{company}\n{sitter_words(30.0, Mode.SELFIE)}."


def test_without_a_face_it_goes_by_words_that_come_before_the_picture() -> None:
    held = at(ASIDE, 96.0)
    assert (held.phase, guide_words(held).company) == (
        Phase.HOLD,
        f"“{sitter_words(30.0)}.”",
    )
    assert guide_words(held).spoken.startswith(f"“{sitter_words(30.0)}.” ")
    by_eye, _ = guide(ASIDE, Reading(None, 0.0, HeadingSource.NONE))
    assert guide_words(by_eye).spoken.endswith(f"{WALK_LEFT}. “{sitter_words(30.0)}.”")


@pytest.mark.parametrize(
    ("yaw", "number", "direction", "further"),
    [
        (18.0, 12, "counter-clockwise", 1),
        (0.4, 30, "counter-clockwise", 1),
        (41.0, 11, "clockwise", -1),
    ],
)
def test_a_nose_that_is_off_is_the_one_thing_left_to_turn(
    yaw: float, number: int, direction: str, further: int
) -> None:
    (shown,) = faced([yaw])
    assert shown.phase is Phase.NOSE
    assert (shown.number, shown.direction, guide_words(shown).headline) == (
        number,
        direction,
        NOSE_TO[Mode.WALK][further < 0],
    )
    assert guide_words(shown).spoken == f"{nose_words(further * number)}."
    assert guide_words(shown).company == f"“{sitter_words(further, further=True)}.”"
    # Where one stands is right; the light is not.
    assert (shown.to_go, guide_words(shown).walk, shown.inside, shown.hold) == (0, "", False, False)
    assert guide_words(shown).light == IN_LIGHT.near
    assert guide_words(shown, Mode.SELFIE).headline == NOSE_TO[Mode.SELFIE][further < 0]


def test_while_one_walks_the_nose_is_told_beside_the_way() -> None:
    (shown,) = faced([18.0], turn=40.0)
    assert (shown.phase, shown.number) == (Phase.TURN, 56)
    assert guide_words(shown).company.endswith(f"\n{nose_words(12.0)}.")
    (right,) = faced([27.0], turn=40.0)
    assert guide_words(right).company.endswith(f"\n{nose_words(0.0)}.")


@pytest.mark.parametrize("off", [-float(NOSE_DEG), 0.0, float(NOSE_DEG)])
def test_so_near_the_nose_is_right(off: float) -> None:
    (shown,) = faced([30.0 - off])
    assert (shown.phase, guide_words(shown).company) == (Phase.HOLD, f"{nose_words(0.0)}.")


def test_the_number_of_the_nose_stays_while_a_face_is_read_a_little_otherwise() -> None:
    assert [one.number for one in faced([18.0, 20.5, 15.5, 18.9])] == [12] * 4
    assert [one.number for one in faced([18.0, 14.5])] == [12, 16]


NARROW = replace(ASIDE, arc_deg=(96.0, 102.0))


def nose_at(goal: Goal, yaws: Iterable[float], turn: float) -> list[tuple[Phase, int | None, str]]:
    memory = FRESH
    told: list[tuple[Phase, int | None, str]] = []
    for number, yaw in enumerate(yaws):
        shown, memory = guide(goal, Reading(turn, 0.25 * number, yaw_deg=yaw), memory)
        told.append((shown.phase, shown.number, shown.direction))
    return told


def held(yaw: float) -> list[float]:
    """A face that is read for three seconds, a little otherwise each time."""
    return [yaw + 0.1 * (number % 2) for number in range(12)]


WAITS = (Phase.NOSE, 0, "none")


@pytest.mark.parametrize(
    ("turn", "yaw", "told"),
    [
        # In light 6 degrees wide the nose is sent to its middle, wherever in it the lens is.
        (96.0, 34.0, (Phase.NOSE, 7, "clockwise")),
        (96.0, 23.0, (Phase.NOSE, 4, "counter-clockwise")),
        (102.0, 26.0, (Phase.NOSE, 7, "counter-clockwise")),
        (96.0, 27.0, (Phase.HOLD, 0, "none")),
    ],
)
def test_it_is_where_the_nose_points_that_is_lit(
    turn: float, yaw: float, told: tuple[Phase, int, str]
) -> None:
    assert nose_at(NARROW, held(yaw), turn)[-1] == told
    # Where there is room the same nose is right, and at once.
    assert nose_at(ASIDE, [yaw], 96.0)[0][0] is Phase.HOLD


def test_in_narrow_light_one_face_is_not_enough() -> None:
    told = nose_at(NARROW, held(27.0), 96.0)
    assert told[:10] == [WAITS] * 10
    assert [one[0] for one in told[10:]] == [Phase.HOLD] * 2
    # Far out nobody waits, and who sways is where they are on average.
    assert nose_at(NARROW, [34.0], 96.0)[0][:2] == (Phase.NOSE, 7)
    swaying = [27.0 + 1.5 * (-1) ** number for number in range(16)]
    assert {one[0] for one in nose_at(NARROW, swaying, 96.0)[10:]} == {Phase.HOLD}


def test_a_head_that_moved_is_judged_anew() -> None:
    told = nose_at(NARROW, [*held(27.0), 32.5, 32.6, *held(27.2)], 96.0)
    assert told[11][0] is Phase.HOLD
    assert told[13] == (Phase.NOSE, 6, "clockwise")
    assert told[16] == WAITS
    assert told[-1][0] is Phase.HOLD


def test_the_same_face_handed_in_again_is_not_counted_again() -> None:
    assert nose_at(NARROW, [27.0] * 40, 96.0)[-1] == WAITS


def test_a_sitter_is_asked_to_hold_still_while_it_is_found_out() -> None:
    shown, _ = guide(NARROW, Reading(96.0, 0.0, yaw_deg=27.0))
    said = (
        guide_words(shown).headline,
        guide_words(shown).company,
        guide_words(shown).spoken,
        guide_words(shown).light,
    )
    assert said == (MEASURING, f"“{STILL}.”", f"{STILL}.", IN_LIGHT.near)


def test_a_nose_that_sways_out_is_not_lit_though_the_number_is_steady() -> None:
    # Within 3 deg of the first face the number would stay at 0.
    goal = replace(ASIDE, arc_deg=(96.0, 107.0))
    inside, out = nose_at(goal, [27.0, 29.0], 96.0)
    assert inside[0] is Phase.HOLD
    assert out == (Phase.NOSE, 2, "clockwise")


def test_where_the_nose_is_read_the_lens_may_stand_a_little_beside_its_goal() -> None:
    # 5 deg before light that begins at 96: a nose turned 8 deg less points to its middle.
    assert nose_at(NARROW, held(22.2), 91.0)[-1][0] is Phase.HOLD
    assert nose_at(NARROW, [30.0], 91.0) == [(Phase.NOSE, 8, "clockwise")]
    assert nose_at(NARROW, held(22.2), 90.0)[-1][0] is Phase.TURN
    assert at(NARROW, 91.0).phase is Phase.TURN  # without a face, the lens alone decides


def test_a_turn_of_ones_own_has_no_light_for_the_nose_to_be_in() -> None:
    goal = Goal(96.0, yaw_deg=30.0)
    assert [phase for phase, _, _ in nose_at(goal, [24.0], 96.0)] == [Phase.HOLD]


def test_a_face_that_is_missed_for_a_moment_changes_nothing() -> None:
    seen = faced([18.0, None, None, None, None, None])
    assert [one.phase for one in seen] == [Phase.NOSE] * 4 + [Phase.HOLD] * 2
    assert seen[-1].nose is None


def test_straight_ahead_a_face_changes_nothing() -> None:
    for turn in (40.0, 94.0, 96.0):
        told = [guide(REMBRANDT, Reading(turn, 0.0, yaw_deg=yaw))[0] for yaw in (None, 25.0)]
        assert told[0] == told[1]
        assert (told[0].nose, guide_words(told[0]).sitter) == (None, "")


def test_the_nose_points_beside_the_lens() -> None:
    assert ASIDE.facing(10.0) == (76.0, (59.0, 91.0))
    assert Goal(96.0, (79.0, 111.0)).facing(10.0) == (106.0, (89.0, 121.0))
