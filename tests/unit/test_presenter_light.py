"""The Light presenter: which lamp, which style, where it is held, and what is said about it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.base.errors import CoreError
from app.core.places.place import CaptureFacts, Place
from app.core.second_light import lamp_answers as placed
from app.core.second_light.lamp_answers import Answers, LampPosition
from app.core.second_light.place_brightness import illuminance
from app.core.second_light.search import LampPlacement
from app.core.second_light.visible_change import VisibleChange
from app.core.solver.lens.lens_wish import LensWish
from app.ui.presenters.window_model import Step
from app.ui.screens.light.brightness import BRIGHTNESS, STATED
from app.ui.screens.light.detail import verdict_at
from app.ui.screens.light.lamp import DISTANCES_M
from app.ui.screens.light.placement import jobs as work
from app.ui.screens.light.placement.pictures import LampView
from app.ui.screens.light.screen import STILL_SHOWING, TRYING, LightPresenter
from app.ui.screens.light.style_list import (
    BETTER,
    NOW_POSSIBLE,
    STILL_OUT,
    STRONGER,
    TOO_WEAK,
    better,
)
from app.ui.screens.light.two_steps import move_words
from app.words.lamps import HARDLY_CHANGES
from app.words.phrases.directions import SIDES, lens_words
from app.words.phrases.quantities import lower_first
from app.words.why_out_of_reach import too_soft_words
from tests.helpers.light_rig import BEST, LightRig, Watching
from tests.helpers.styles_screen import scene_light


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LightRig:
    return LightRig(tmp_path, monkeypatch)


def keys(rig: LightRig, section: str) -> list[str]:
    found = [part for part in rig.state.sections if part.title == section]
    return [row.key for part in found for row in part.rows]


def test_without_light_it_leads_to_the_probe(rig: LightRig) -> None:
    rig.presenter.attach(rig.view)
    assert "No light" in rig.view.last.empty
    rig.model.update(step=Step.LIGHT)
    rig.presenter.press(rig.view.last.actions[0][0])
    assert rig.model.step is Step.PROBE


def test_without_a_lamp_it_offers_the_phone(rig: LightRig) -> None:
    rig.start(lamp="", bright="")
    assert rig.state.empty.startswith("No lamp chosen. A phone at full brightness")
    rig.presenter.press("phone")
    assert rig.state.lamp.key == "phone"
    assert not rig.state.empty


def test_it_asks_how_bright_it_is_and_nothing_is_tried_before(rig: LightRig) -> None:
    rig.start(bright="")
    assert rig.state.asks
    assert rig.hands == []
    rig.presenter.scale.choose("cellar")
    assert rig.state.lamp.brightness == STATED.format(lux="30 lx")
    assert rig.state.bright.key == "cellar"
    assert rig.view.last.hold.hold
    light = scene_light()
    lux = {key: value for key, _, value in BRIGHTNESS}["cellar"]
    assert rig.questions[-1].gain * illuminance(light.searched) == pytest.approx(lux, rel=1e-6)


def test_the_answer_holds_for_its_place_only(rig: LightRig) -> None:
    rig.start(bright="cellar")
    rig.model.update(light=scene_light("studio"))
    assert rig.state.asks
    rig.model.update(light=scene_light())
    assert not rig.state.asks


def test_a_measured_place_is_not_asked_about(rig: LightRig) -> None:
    place = Place("Here", rig.table.services.today(), capture=CaptureFacts(white_cd_m2=120.0))
    rig.start(bright="")
    rig.model.update(place=place)
    assert not rig.state.asks
    assert rig.questions[-1].gain == 120.0
    assert rig.state.lamp.brightness.endswith(" lx at the face, as measured")


def test_the_list_has_the_rescued_first_then_the_better(rig: LightRig) -> None:
    rig.start()
    assert keys(rig, NOW_POSSIBLE) == ["badger", "below"]
    assert keys(rig, BETTER) == ["left-split"]
    first = rig.state.sections[0]
    assert first.count == "2 of 2"
    row = first.rows[0]
    assert (row.before, row.after) == (20, 62)
    assert "match 20 without the lamp, 62 with it" in row.spoken
    assert rig.state.detail.key == "badger"


def test_a_lamp_that_changes_nothing_is_not_offered(rig: LightRig) -> None:
    rig.same = {"badger", "left-split"}
    rig.start()
    assert keys(rig, NOW_POSSIBLE) == ["below"]
    assert keys(rig, BETTER) == []
    assert keys(rig, HARDLY_CHANGES) == ["left-split", "badger"]  # matches 84 and 62
    assert rig.state.sections[0].count == "1 of 2"
    assert rig.state.detail.key == "below"
    # Chosen, it says so, and is no more in reach than without the lamp.
    for name, verdict in {"badger": "out", "left-split": "in"}.items():
        rig.model.choose(name)
        detail = rig.state.detail
        assert detail.verdict_words == lower_first(HARDLY_CHANGES)
        assert detail.verdict == verdict
    spoken = next(row.spoken for part in rig.state.sections for row in part.rows if row.key == name)
    assert spoken.endswith(lower_first(HARDLY_CHANGES))


def test_a_lamp_that_changes_nothing_closer_either_is_called_too_weak(rig: LightRig) -> None:
    rig.saved = {"badger": (20.0, 62.0)}
    rig.gained, rig.same = {}, {"badger"}
    rig.start()
    one = rig.presenter.front
    assert one is not None
    rig.nearer = one
    rig.presenter.move_away(6)
    assert rig.state.note.endswith(STRONGER)
    assert rig.state.note_action == ""


def test_moved_the_lamp_may_change_nothing(rig: LightRig, monkeypatch: pytest.MonkeyPatch) -> None:
    look = rig._look

    def same(*question: Any) -> LampView:
        return replace(look(*question), change=VisibleChange(1.0))

    monkeypatch.setattr(work, "look", same)
    rig.start()
    # At the best place the answer of the search counts.
    assert rig.state.detail.verdict == "in"
    rig.presenter.hold_at(-70.0, -16.0)
    assert rig.state.detail.verdict_words == lower_first(HARDLY_CHANGES)


def test_a_better_grade_is_better_only_if_it_is_visible(rig: LightRig) -> None:
    rig.start()
    answers = rig.presenter.work.answers
    assert answers is not None
    before = replace(answers.placements[0].before, grade="soft", attainable=True)
    one = replace(answers.placements[0], grade="yes", before=before, attainable=True)
    assert better([one]) == (one,)
    assert better([replace(one, change=VisibleChange(1.0))]) == ()
    # A better match within one grade is not: nobody sees points.
    assert better([replace(one, grade="soft", match=before.match + 30.0)]) == ()


def test_a_style_out_of_reach_stays_in_front_even_if_it_is_not_rescued(rig: LightRig) -> None:
    rig.saved["flat"] = (30.0, 41.0)
    rig.start()
    rig.model.choose("flat")
    assert rig.state.detail.key == "flat"
    assert keys(rig, STILL_OUT) == ["flat"]
    assert rig.state.detail.verdict_words == verdict_at(30.0, 100.0)[1]


def test_words_name_both_steps(rig: LightRig) -> None:
    rig.start()
    rig.presenter.choose("left-split")
    hold = rig.state.hold
    assert hold.turn == "Turn 56° counter-clockwise"
    assert hold.hold.startswith(f"Hold the phone screen to the {SIDES['left']}")
    assert hold.hold.endswith("raised 5°, at full power")
    assert hold.hold_line.startswith("30 cm from the middle of the head, about ")
    rig.presenter.choose("right-split")
    assert SIDES["right"] in rig.state.hold.hold


def test_turn_first_goes_to_the_turn_of_the_lamp(rig: LightRig) -> None:
    rig.start()
    rig.presenter.turn()
    model = rig.model
    assert (model.step, model.chosen, model.goal_deg) == (Step.TURN, "badger", -56.0)


def test_moving_the_lamp_moves_words_numbers_and_match_but_not_the_best(rig: LightRig) -> None:
    rig.start()
    assert rig.state.detail.at_best
    assert rig.state.detail.after == "62"
    rig.presenter.hold_at(-94.0, 4.0)
    state = rig.state
    assert (state.heads.azimuth_deg, state.heads.altitude_deg) == (-94.0, 4.0)
    assert state.heads.best == BEST["badger"]
    assert state.detail.after == "42"
    assert state.detail.verdict == "out"
    assert state.detail.best_title == "Best place: 62"
    assert state.detail.best_line == move_words(
        LampPosition(-94.0, 4.0), LampPosition(*state.heads.best)
    )
    assert dict(state.detail.numbers)["Lamp azimuth"] == "−94°"
    assert state.hold.turn == "Turn 56° counter-clockwise"
    rig.presenter.go_best()
    assert rig.state.detail.after == "62"


def test_the_lamp_stays_within_the_band_that_is_searched(rig: LightRig) -> None:
    rig.start()
    rig.presenter.hold_at(200.0, 90.0)
    assert (rig.state.heads.azimuth_deg, rig.state.heads.altitude_deg) == (-160.0, 67.5)


def test_pictures_of_the_last_place_are_made_and_never_two_at_a_time(rig: LightRig) -> None:
    rig.start()
    rig.looks.clear()
    rig.runner.held.add("light-view")
    for azimuth in (10.0, 20.0, 30.0):
        rig.presenter.hold_at(azimuth, 0.0)
        assert rig.runner.ran.count("light-view") <= 2
    assert rig.state.detail.stale
    rig.runner.release("light-view")
    # The one that was begun is shown, and then the newest; none between.
    assert [held.azimuth_deg for _, held in rig.looks] == [10.0, 30.0]
    assert not rig.state.detail.stale


def test_another_distance_is_tried_anew(rig: LightRig) -> None:
    rig.start()
    stop = DISTANCES_M.index(0.5)
    rig.presenter.hold_at(10.0, 0.0)
    rig.presenter.move_away(stop)
    assert [lamp.distance_m for lamp in rig.hands] == [0.3, 0.5]
    assert DISTANCES_M[rig.state.lamp.distance] == 0.5
    assert rig.state.heads.azimuth_deg == BEST["badger"][0], "at its best place again"


def test_while_another_lamp_is_tried_nobody_is_told_to_hold_the_old_one(rig: LightRig) -> None:
    rig.start()
    rig.runner.held.add("light-lamp")
    rig.presenter.take_lamp("panel")
    hold = rig.state.hold
    assert hold.hold == TRYING.format(lamp="the LED panel")
    assert hold.hold_line == STILL_SHOWING.format(lamp="the phone screen")
    assert not hold.turn_works
    rig.runner.release("light-lamp")
    assert rig.state.hold.hold.startswith("Hold the LED panel ")


def test_a_lens_that_may_stand_elsewhere_is_told_where(
    rig: LightRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, LensWish]] = []

    def seen(answers: Answers, one: LampPlacement) -> LampPlacement:
        asked.append((one.name, answers.question.lens))
        return replace(one, yaw_deg=30.0, lighting="short", match=71.4)

    monkeypatch.setattr(work, "seen_from", seen)
    rig.start()
    assert not rig.state.detail.best_line
    now = rig.table.services.today()
    place = Place("Court", now, lens=LensWish("short", (10.0, 50.0)))
    rig.model.update(place=replace(place, said_white_cd_m2=40.0))
    detail, hold = rig.state.detail, rig.state.hold
    assert asked == [(detail.key, LensWish("short", (10.0, 50.0)))]
    assert detail.best_line.endswith("30° to their left: match 71.")
    assert hold.hold_line.endswith(f"{lens_words(30.0)}.")


def test_the_lens_is_asked_for_from_where_the_photographer_stands(
    rig: LightRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    wishes: list[LensWish] = []

    def aside(
        pack: object, views: object, placements: tuple[LampPlacement, ...], *rest: Any
    ) -> object:
        wishes.append(rest[-1])
        return placements

    monkeypatch.setattr(placed, "seen_aside", aside)
    rig.start()
    answers = rig.presenter.work.answers
    assert answers is not None
    question = replace(answers.question, front_deg=90.0, lens=LensWish("auto", (100.0, 130.0)))
    one = answers.placements[0]
    assert placed.seen_from(replace(answers, question=question), one) is one
    assert wishes == [LensWish("auto", (10.0, 40.0))]


def test_a_style_that_is_too_soft_says_so(rig: LightRig) -> None:
    rig.saved = {"badger": (20.0, 46.0)}
    rig.weak.add("badger")
    rig.start()
    (part,) = [one for one in rig.state.sections if one.title == STILL_OUT]
    assert part.rows[0].line == too_soft_words(12.0, 20.0)


def test_late_answers_for_a_lamp_that_was_put_away_are_not_shown(rig: LightRig) -> None:
    rig.start()
    rig.runner.held.add("light-lamp")
    rig.presenter.take_lamp("panel")
    first = rig.runner.waiting["light-lamp"]
    rig.presenter.take_lamp("flash")
    count = len(rig.questions)
    first()
    assert len(rig.questions) == count
    rig.presenter.move_away(3)
    rig.runner.release("light-lamp")
    assert rig.questions[-1] is not rig.questions[count - 1]


def test_a_weak_lamp_says_what_it_does_from_nearer_by(rig: LightRig) -> None:
    rig.saved = {"badger": (20.0, 40.0)}
    rig.start()
    assert rig.state.note == f"{TOO_WEAK.format(distance='30 cm')} {STRONGER}"
    rig.presenter.choose("badger")
    badger = rig.presenter.front
    assert badger is not None
    assert badger.name == "badger"
    rig.nearer = replace(badger, match=51.0, attainable=True)
    rig.presenter.move_away(DISTANCES_M.index(0.35))
    assert rig.state.note.startswith(TOO_WEAK.format(distance="35 cm"))
    assert re.findall("[0-9]+", rig.state.note) == ["35", "20", "51"]
    assert "20 cm" in rig.state.note_action
    rig.presenter.come_closer()
    assert DISTANCES_M[rig.state.lamp.distance] == 0.2


def test_a_shorter_distance_is_tried_once_the_hand_rests(
    rig: LightRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(work, "wait", lambda clock, seconds, token: pauses.append(seconds))
    rig.saved = {"badger": (20.0, 40.0)}
    rig.runner.held.add("light-closer")
    rig.start()
    rig.presenter.choose("badger")
    badger = rig.presenter.front
    assert badger is not None
    rig.nearer = replace(badger, match=51.0, attainable=True)

    def tries() -> int:
        return rig.runner.ran.count("light-closer")

    before = tries()
    rig.presenter.hold_at(40.0, 10.0)
    rig.presenter.hold_at(41.0, 10.0)
    assert tries() == before + 2, "each move restarts the pause"
    assert not pauses
    rig.runner.release("light-closer")
    assert pauses == [1.5]
    assert "51" in rig.state.note
    rig.presenter.hold_at(42.0, 10.0)
    assert tries() == before + 2, "an answer is not looked for twice"


def test_reach_is_asked_for(rig: LightRig) -> None:
    rig.start()
    assert (rig.questions[-1].arm, rig.questions[-1].floor) == (False, True)
    rig.presenter.set_arm(True)
    rig.presenter.set_floor(False)
    assert (rig.questions[-1].arm, rig.questions[-1].floor) == (True, False)


def test_trouble_is_said_in_its_own_words_and_can_be_tried_again(
    rig: LightRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = CoreError("The head's shape is missing.", "Bake it again.")

    def fails(*_: object) -> None:
        raise missing

    right = rig.take
    monkeypatch.setattr(work, "take_in_hand", fails)
    rig.start()
    assert rig.state.empty == str(missing)
    monkeypatch.setattr(work, "take_in_hand", right)
    rig.presenter.press("again")
    assert not rig.state.empty


def test_nothing_is_tried_while_nobody_looks(rig: LightRig) -> None:
    rig.start()
    rig.presenter.leave()
    count = len(rig.questions)
    rig.model.update(front_deg=40.0)
    assert len(rig.questions) == count
    rig.presenter.enter()
    assert rig.questions[-1].front_deg == 40.0


def own_lamp(path: Path, *, known: bool) -> Path:
    """Write the panorama of a lamp, its mask as the fourth channel."""
    import OpenImageIO as oiio

    picture = np.zeros((64, 128, 4), np.float32)
    picture[26:38, 60:68] = (400.0, 400.0, 400.0, 1.0)
    spec = oiio.ImageSpec(128, 64, 4, "float")
    spec.channelnames = ("R", "G", "B", "A")
    spec.alpha_channel = 3
    if known:
        spec.attribute("whiteLuminance", 1.0)
    out = oiio.ImageOutput.create(str(path))
    assert out is not None
    assert out.open(str(path), spec)
    out.write_image(picture)
    out.close()
    return path


def test_a_captured_lamp_is_taken_in_hand(rig: LightRig, tmp_path: Path) -> None:
    rig.start(lamp="")
    rig.presenter.lamps.take([own_lamp(tmp_path / "mine.exr", known=True)])
    state = rig.state
    assert state.lamp.key == "own:mine"
    assert state.lamp.items[0][:3] == ("own:mine", "mine", "captured")
    # It is kept: another day it is there again.
    again = LightPresenter(rig.table.services, rig.table.desk)
    again.attach(Watching())
    again.take_lamp("own:mine")
    assert again.lamps.own is not None
    assert state.hold.hold.startswith("Hold “mine” ")


def test_a_lamp_of_unknown_exposure_cannot_be_compared(rig: LightRig, tmp_path: Path) -> None:
    rig.start()
    count = len(rig.hands)
    rig.presenter.lamps.take([own_lamp(tmp_path / "mine.exr", known=False)])
    assert rig.state.meter.startswith("The brightness of “mine”")
    assert "Enter the lamp’s illuminance" in rig.state.meter
    assert len(rig.hands) == count
    rig.presenter.lamp_actions.answer("lux", "a lot")
    assert rig.state.meter_error.startswith("This is not a valid lux value")
    rig.presenter.lamps.take([own_lamp(tmp_path / "other.exr", known=False)])
    assert rig.state.meter.startswith("The brightness of “other”")
    assert not rig.state.meter_error, "that was said of another lamp"
    rig.presenter.take_lamp("own:mine")
    rig.presenter.lamp_actions.answer("lux", "640")
    assert not rig.state.meter
    assert rig.presenter.lamps.own is not None
    assert rig.presenter.lamps.own.lux == pytest.approx(640.0)
    assert len(rig.hands) == count + 1


def test_a_file_that_is_no_lamp_changes_nothing(rig: LightRig, tmp_path: Path) -> None:
    rig.start()
    path = tmp_path / "mine.exr"
    path.write_bytes(b"no panorama")
    rig.presenter.lamps.take([path])
    assert "mine" in rig.table.told.messages[-1]
    assert rig.state.lamp.key == "phone"
    assert not rig.state.capturing
