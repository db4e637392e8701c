"""From Light to the turn and to the lamp held there: one plan, one number, one way back."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from app.core.base.angles import difference, whole, wrap
from app.core.base.colour import luminance
from app.core.base.progress import Token, silent
from app.core.guidance.guide import Phase
from app.core.second_light.added_light import near_picture
from app.core.second_light.in_hand import InHand, prepare_head, take_in_hand
from app.core.second_light.lamp_answers import Answers, LampPosition
from app.core.solver.place_light import turned
from app.core.solver.transport import render
from app.ui.presenters.window_model import LampPlan, Step
from app.ui.screens.light.placement import jobs as work
from app.ui.screens.light.placement.pictures import portrait_with
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.registry import screen
from app.ui.screens.turn.photos.check_job import shot_context
from app.ui.screens.turn.screen import BACK
from app.words.guidance import FOR_LAMP
from tests.helpers.light_rig import Watching
from tests.helpers.styles_screen import head, scene_light
from tests.helpers.turn_rig import Rig


@cache
def _in_hand(kind: str, distance_m: float, lamp: Any) -> InHand:
    del kind, distance_m
    return take_in_hand(prepare_head(head(), Token()), lamp, Token(), silent)


class Journey:
    """Light and Turn on one model, with the real search for an LED panel in the demo studio."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.turn = rig = Rig(patch)
        patch.setattr(
            work,
            "take_in_hand",
            lambda of, lamp, *_: _in_hand(lamp.kind, lamp.distance_m, lamp),
        )
        rig.model.update(head=head(), light=scene_light(), chosen="badger", step=Step.LIGHT)
        self.light = LightPresenter(rig.services, rig.place_controller)
        self.view = Watching()
        self.light.attach(self.view)
        self.light.take_lamp("panel")
        self.light.scale.choose("living")
        self.light.choose("badger")

    @property
    def plan(self) -> LampPlan:
        plan = self.turn.model.lamp_plan
        assert plan is not None
        return plan

    @property
    def answers(self) -> Answers:
        answers = self.light.work.answers
        assert answers is not None
        return answers

    @property
    def held(self) -> LampPosition:
        held = self.light._now
        assert held is not None
        return held

    def go(self) -> None:
        """Press "Turn first", as the window does."""
        self.light.turn()
        assert self.turn.model.step is Step.TURN
        self.light.leave()
        self.turn.start()


@pytest.fixture
def way(monkeypatch: pytest.MonkeyPatch) -> Journey:
    return Journey(monkeypatch)


@pytest.mark.slow
def test_at_the_goal_the_lamp_is_told_in_the_words_of_the_light_screen(way: Journey) -> None:
    told = way.light.resolve().hold
    assert told.hold.startswith("Hold the LED panel ")
    way.go()
    goal = way.turn.goal
    shown = way.turn.turn_to(wrap(goal - 40.0)).guidance
    assert shown.phase is Phase.TURN
    assert shown.pill == FOR_LAMP.before
    at_goal = way.turn.turn_to(goal).guidance
    assert at_goal.phase is Phase.HOLD
    assert at_goal.inside
    assert f" h{told.hold[1:]}. " in at_goal.sentence
    lamp = next(mark for mark in way.turn.state.plan.marks if mark.kind == "lamp")
    assert wrap(whole(goal) - lamp.turn_deg) == pytest.approx(way.held.azimuth_deg)
    assert at_goal.spoken == at_goal.sentence
    assert at_goal.advice == told.hold_line


@pytest.mark.slow
def test_match_and_face_are_those_with_the_lamp(way: Journey) -> None:
    tile = way.light.resolve().detail
    way.go()
    goal = way.turn.goal
    state = way.turn.turn_to(goal)
    assert state.style.match == f"Match now {tile.after}"
    assert state.style.match_at_goal == f"{tile.after} at the goal"
    assert state.style.side == "with the LED panel"
    assert state.style.now_tag == "With the lamp"
    expected = portrait_with(
        way.answers,
        "badger",
        way.held,
        way.turn.model.azimuth_of(float(whole(goal))),
        way.turn.presenter._sizes.portrait,
    )
    assert state.pictures.now is not None
    np.testing.assert_array_equal(state.pictures.now, expected)


@pytest.mark.slow
def test_the_way_back_leads_to_the_lamp_where_it_was_held(way: Journey) -> None:
    way.light.hold_at(30.0, 20.0)
    told = way.light.resolve().hold.hold
    way.go()
    back = next(one for one in way.turn.presenter.actions() if one.key == "turn-back")
    assert back.words == BACK[Step.LIGHT][0]
    assert screen(Step.LIGHT).done(way.turn.model)
    back.run()
    assert way.turn.model.step is Step.LIGHT
    way.light.enter()
    assert way.light.resolve().hold.hold == told
    further = next(one for one in way.light.actions() if one.shortcut == "Esc")
    further.run()
    assert (way.turn.model.step, way.turn.model.chosen) == (Step.STYLES, "badger")


def test_a_photograph_is_judged_with_the_lamp(way: Journey) -> None:
    way.go()
    rig = way.turn
    rig.model.update(place_folder=rig.services.folders.home)
    asked = shot_context(rig.model, None, rig.services.today())
    assert asked is not None
    assert asked.title.endswith(" with the LED panel")
    assert asked.result.match == way.plan.result.match
    assert asked.goal.lamp


def test_a_goal_without_its_lamp_is_an_ordinary_one(way: Journey) -> None:
    way.go()
    model = way.turn.model
    model.update(goal_deg=wrap(way.turn.goal + 10.0))
    assert model.lamp_plan is None
    assert model.goal_result is model.result
    way.turn.presenter.back()
    assert model.step is Step.LIGHT, "where one came from"


def test_the_plan_stays_where_it_is_when_the_photographer_stands_elsewhere(way: Journey) -> None:
    way.go()
    model, goal, match = way.turn.model, way.turn.goal, way.plan.result.match
    model.update(front_deg=30.0, goal_deg=wrap(goal - 30.0))
    result = model.goal_result
    assert result is not None
    assert model.lamp_plan is not None
    assert difference(result.turn_refined_deg, goal - 30.0) == pytest.approx(0.0, abs=1e-6)
    assert result.match == match


def test_match_at_other_turns_is_that_of_the_whole_picture(way: Journey) -> None:
    """Truth: the face rendered whole, in colour, from the full panorama, and correlated here."""
    way.go()
    plan = way.plan
    hand, question, held = way.answers.hand, way.answers.question, way.held
    transport = hand.head.transport
    region = hand.head.pack.region_on(transport)
    target = luminance(hand.head.pack.target("badger").reshape(-1, 3)[transport.pixels])
    lamp = near_picture(hand.base.near, hand.lamp, *held[:2]) * held.power  # type: ignore[arg-type]
    for index in (0, 9, 22, 40, 57):
        place = turned(question.light, wrap(5.625 * index)) * question.gain
        seen = luminance(render(transport, place) + lamp)
        table = np.cov(target, seen, aweights=region)
        truth = 100.0 * table[0, 1] / np.sqrt(table[0, 0] * table[1, 1])
        # What the lamp hides of the place is left out of this truth: a panel hides little.
        assert plan.result.match_curve[index] == pytest.approx(truth, abs=3.0)
    inside = plan.result.arc_deg
    assert 4.0 < (inside[1] - inside[0]) % 360.0 < 120.0
