"""What is said in two places agrees, because it is one value."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import pytest

from app.core.base.angles import direction_of, whole, wrap
from app.core.measure.plan.planner import plan
from app.core.measure.read.frame import Exposure
from app.devices.capture.exposures import bracket
from app.devices.capture.status import Stage, Status
from app.devices.protocol_profiles import PROFILES, ModelProfile, profile_for
from app.devices.theta.messages import Info
from app.devices.webcam.sources import LiveSource
from app.ui.overlays.help import key_lines
from app.ui.presenters.actions import SEARCH_SCOPE, Action, nothing_words
from app.ui.presenters.services import Sounds
from app.ui.presenters.window_frame import FramePresenter
from app.ui.screens.light.two_steps import go_words, turn_title, way_icon
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.screens.paint.tools import BrushBox
from app.ui.screens.probe.capture.plans import plan_parts
from app.ui.screens.turn.live.camera import LiveCamera
from app.ui.screens.turn.live.source import NO_WEBCAMS
from app.ui.shell.commands import Commands
from app.words.verdict import verdict_sentence
from tests.helpers.styles_screen import Table, scene_light
from tests.helpers.turn_rig import Rig
from tests.unit.test_presenter_turn_sources import Rig as Picker


def number_in(words: str) -> int:
    """The only number of a sentence."""
    (found,) = re.findall(r"\d+", words)
    return int(found)


def test_sound_is_on_only_where_there_is_a_loudspeaker(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, sounds=True)
    rig.start()
    frame = FramePresenter(rig.services)
    assert frame.resolve().status.startswith("Sound on")
    assert rig.tick().menu.sounds
    deaf = replace(rig.services, sounds=Sounds())
    frame = FramePresenter(deaf)
    assert frame.resolve().status == "No sound output"
    assert frame.resolve().status_icon == "sound-off"


def test_without_a_webcam_no_webcam_is_in_the_list() -> None:
    picker = Picker(webcams=0)
    picker.start()
    assert picker.state.items[0][1:3] == NO_WEBCAMS
    assert "Webcam 1" not in str(picker.state.items)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_too_far_counts_the_way_back_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, way: float
) -> None:
    rig = Rig(monkeypatch, lamp_deg=way * 60.0)
    rig.start()
    rig.turn_to(0.0)
    arc = rig.turn_to(rig.goal).scale.arc_deg
    assert arc is not None
    end = arc[1] if way > 0 else arc[0]
    shown = rig.turn_to(wrap(end + way * 13.0)).guidance
    # One number at a time: back to the best.
    assert shown.number == abs(whole(rig.goal - end - way * 13.0))
    assert shown.number_words == "back"
    assert shown.pill == "Too far"
    assert shown.sign == shown.direction == direction_of(-way)
    assert "to go" not in shown.spoken


@pytest.mark.parametrize("profile", PROFILES, ids=lambda one: one.title)
def test_no_capture_takes_more_frames_than_were_said(profile: ModelProfile) -> None:
    """Truth: what the planner makes of any light that a camera may meter."""
    camera = MagicMock()
    camera.device.model = profile.title
    said = {part.key: part.second for part in plan_parts(camera, None)}
    limits = profile_for(Info(profile.title))
    for shutter in (1 / 2000, 1 / 500, 1 / 125, 1 / 60, 1 / 30, 1 / 8, 1 / 4):
        light = Exposure(shutter, 100.0, 2.0)
        for kind in ("paper", "full"):
            made = plan(light, limits.fallback, kind, limits.max_shots)
            assert len(made.shots) <= number_in(said[kind].split(" frames")[0])
            known = next(one for one in plan_parts(camera, light) if one.key == kind)
            assert known.second.startswith(f"{len(made.shots)} frames, ")
    assert said["full"].startswith("up to ")


def test_the_time_left_is_never_a_second_for_long() -> None:
    assert Status(seconds_left=12.4).left_words == "12 s left"
    assert Status(seconds_left=1.0).left_words == "almost done"
    assert Status().left_words == ""
    job: Any = MagicMock()
    job.plan.expected_s, job.plan.shots, job.delay_s = 10.0, (1, 2, 3), 0
    run: Any = MagicMock()
    run.began = 0.0
    left = []
    for now, completion in ((2.0, 0.1), (9.0, 0.2), (30.0, 0.6), (45.0, 0.9), (60.0, None)):
        job.clock.now.return_value = now
        bracket._tell(job, completion, run)
        (stage, *_), changes = job.board.show.call_args
        assert stage is Stage.EXPOSING
        left.append(changes["seconds_left"])
    # A camera four times slower than planned: what it says of itself counts.
    assert left[:4] == pytest.approx([8.0, 36.0, 20.0, 5.0])
    assert left[4] is None, "planned for 10 s and now at 60: nothing is known, and nothing is said"


@pytest.mark.parametrize("turn", [56.0, -56.0, 0.2, 180.0])
def test_the_icon_of_the_turn_goes_the_way_of_its_words(turn: float) -> None:
    title, icon = turn_title(turn), way_icon(turn)
    if "counter-clockwise" in title:
        assert icon == "counterclockwise"
    elif "clockwise" in title:
        assert icon == "clockwise"
    else:
        assert title == "No turn needed"
        assert icon not in ("turn", "clockwise", "counterclockwise")
        assert "Turn" not in go_words(turn)


def test_a_best_of_nothing_is_not_offered_as_a_turn() -> None:
    result, snapshot = MagicMock(), MagicMock()
    snapshot.question.limits.match, snapshot.question.limits.strength = 45.0, 20.0
    result.turn_refined_deg, result.strength = 158.0, 0.0
    result.match, result.grade = 0.4, None
    told = verdict_sentence(result)
    assert re.findall("[0-9]+", told) == ["0", "45"]
    result.match = 29.0
    told = verdict_sentence(result)
    assert re.findall("[0-9]+", told) == ["29", "158", "45"]


def test_each_key_in_help_has_its_own_words() -> None:
    presenter: Any = MagicMock(tools=BrushBox(MagicMock()))
    presenter.files.actions.return_value = ()
    presenter.look.actions.return_value = ()
    presenter._services.undo.undo_words = "stroke on Mine"
    actions = [
        *PaintPresenter.actions(presenter),
        Action("undo", "Undo", MagicMock(), "", "Ctrl+Z"),
    ]
    lines = dict(key_lines(actions))
    assert lines["B"] == "Brush: brighter"
    assert lines["D"] == "Brush: darker"
    assert (lines["["], lines["]"]) == ("Smaller brush", "Larger brush")
    assert lines["Ctrl+Z"] == "Undo"
    assert all(len(keys.split()) == 1 or keys.startswith(("Ctrl", "Shift")) for keys in lines)


def test_the_foot_names_what_enter_does(tmp_path: Path) -> None:
    table = Table(tmp_path).open(scene_light())
    for result in table.model.results:
        table.presenter.choose(result.name)
        main = next(one for one in table.presenter.actions() if one.key == "styles-main")
        button = table.presenter.resolve().detail.main_words
        assert main.hint == {"Turn to this": "turn", "Try a lamp": "try a lamp"}[button]


def test_nothing_found_says_so_and_what_can_be_searched() -> None:
    told = nothing_words(" xyzzy ")
    assert told.startswith("Nothing found for “xyzzy”.")
    assert told.endswith(f"{SEARCH_SCOPE}.")


def test_the_tour_promises_what_it_has() -> None:
    told: list[str] = []
    services: Any = MagicMock()
    services.model.settings.tour_seen = False
    services.notify.tell = lambda words, **_: told.append(words)
    Commands(services, MagicMock(), MagicMock(), MagicMock()).begin()
    assert "picture" not in told[0]


def test_the_demo_stands_at_its_own_camera_and_forgets_no_other() -> None:
    away = "network:http://192.168.1.20/video"
    demo = Picker(demo=MagicMock(), live_source=away)
    assert demo.camera.chosen == LiveSource.webcam(0)
    demo.camera.use(LiveSource.webcam(1))
    assert demo.settings.live_source == away
    assert Picker(live_source=away).camera.chosen.kind == "network"


def test_a_network_camera_is_not_called_a_webcam(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.start()
    assert rig.turn_to(20.0).live.live == "webcam"
    camera: LiveCamera = rig.presenter._camera
    camera.chosen = LiveSource.network("http://192.168.1.20/video")
    state = rig.turn_to(20.0)
    assert state.live.live == "network camera"
    rig.webcam.unplug()
    state = rig.tick()
    said = f"{state.live} {state.guidance} {state.live.quality}"
    assert "ebcam" not in said.replace(rig.webcam.name, "").replace("sentence_icon='webcam'", "")
