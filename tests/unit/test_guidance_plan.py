"""The walk from above: what is drawn is where one stands, and the words say the same."""

from __future__ import annotations

import pytest

from app.core.base.angles import wrap
from app.core.guidance.guide import Goal, Guide, HeadingSource, Reading, guide
from app.core.guidance.walk_plan import PlanDrawing, PlanMark, plan_of
from app.core.guidance.who_moves import Mode
from app.words.phrases.directions import direction_words
from app.words.plan import plan_words

GOAL = Goal(96.0, (79.0, 111.0))


def shown_at(turn: float | None, source: HeadingSource = HeadingSource.LIVE) -> Guide:
    return guide(GOAL, Reading(turn, 0.0, source))[0]


def turns_of(plan: PlanDrawing) -> dict[str, float]:
    return {mark.kind: mark.turn_deg for mark in plan.marks}


def test_everybody_is_where_they_are() -> None:
    plan = plan_of(shown_at(40.0), GOAL, Mode.WALK, 0.0, [PlanMark("light", 60.0)])
    assert turns_of(plan) == {
        "now": 40.0,
        "goal": 96.0,
        "start": 0.0,
        "nose": 40.0,
        "light": 60.0,
        "background": -84.0,
    }
    assert (plan.way, plan.nose_deg, plan.arc_deg) == ((40.0, 56.0), 40.0, (79.0, 111.0))
    assert "nose" not in plan_words(plan).labels
    # 36 deg counter-clockwise of where the sitter looks at the goal is at their left.
    described = plan_words(plan, "Go.").description
    assert described.startswith("Go.")
    assert described.endswith(direction_words(-36.0, 0.0, of_sitter=True))


@pytest.mark.parametrize(
    ("mode", "up", "you"), [(Mode.WALK, 180.0, "you"), (Mode.SELFIE, 0.0, "camera")]
)
def test_up_is_where_one_looks_at_the_start(mode: Mode, up: float, you: str) -> None:
    """Who walks has their left on the left; in a selfie the right is on the right."""
    plan = plan_of(shown_at(0.0), GOAL, mode)
    assert plan.up_deg == up
    assert plan_words(plan).labels[0] == you
    # Clockwise from the foot goes to the left, from the top to the right.
    side = wrap(plan.way[0] + plan.way[1] - plan.up_deg)
    assert (side < 0.0) == (mode is Mode.WALK)


def test_without_a_heading_it_begins_at_the_start_or_at_the_photo() -> None:
    start = plan_of(shown_at(None, HeadingSource.NONE), GOAL, Mode.WALK)
    assert turns_of(start) == {"now": 0.0, "goal": 96.0, "nose": 0.0, "background": -84.0}
    assert start.way == (0.0, 96.0)
    photo, _ = guide(GOAL, Reading(None, 0.0, HeadingSource.NONE, from_deg=108.0))
    plan = plan_of(photo, GOAL, Mode.WALK, 108.0)
    assert (turns_of(plan)["now"], plan.way) == (108.0, (108.0, -12.0))


def test_who_is_lost_is_drawn_nowhere() -> None:
    plan = plan_of(shown_at(None), GOAL, Mode.WALK)
    assert turns_of(plan) == {"goal": 96.0, "start": 0.0, "nose": 0.0, "background": -84.0}


def test_one_mark_where_the_goal_is_reached() -> None:
    plan = plan_of(shown_at(96.0), GOAL, Mode.WALK)
    assert set(turns_of(plan)) == {"now", "start", "nose", "background"}
    assert plan_words(plan, "Here.").description == "Here."


def test_the_longer_way_is_drawn_as_it_is_walked() -> None:
    _, memory = guide(GOAL, Reading(-80.0, 0.0))
    shown, _ = guide(GOAL, Reading(-86.0, 0.1), memory)
    assert (shown.to_go, plan_of(shown, GOAL, Mode.WALK).way) == (182, (-86.0, 182.0))


@pytest.mark.parametrize("mode", list(Mode))
def test_nose_and_lens_are_two_where_the_face_is_turned_aside(mode: Mode) -> None:
    goal = Goal(96.0, (79.0, 111.0), yaw_deg=30.0)
    shown, _ = guide(goal, Reading(40.0, 0.0))
    plan = plan_of(shown, goal, mode, 0.0, [PlanMark("light", 60.0)])
    # The sitter's left of the lens is counter-clockwise of it; the background is the lens's.
    assert (plan.nose_deg, plan.lens_deg, turns_of(plan)["nose"]) == (10.0, 40.0, 10.0)
    assert turns_of(plan)["background"] == -84.0
    assert "nose" in plan_words(plan).labels
    description = plan_words(plan).description
    assert description.startswith("Stand 30° to the sitter’s right of their nose. ")
    # The nose at the goal, 66, is 6 deg clockwise of the light.
    assert description.endswith("At the goal, light: in front")


def test_the_nose_is_drawn_as_the_face_is_read() -> None:
    goal = Goal(96.0, (79.0, 111.0), yaw_deg=30.0)
    shown, _ = guide(goal, Reading(96.0, 100.0, yaw_deg=18.0))
    plan = plan_of(shown, goal, Mode.WALK)
    assert (plan.nose_deg, plan.lens_deg, plan.way) == (78.0, 96.0, (96.0, 0.0))
