"""The Turn screen's presenter: left and right, the webcam's troubles, the question, sounds."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import Direction, difference, whole, wrap
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.guidance.guide import Phase
from app.core.guidance.who_moves import Mode
from app.core.localization.live.tracking import track
from app.core.portrait.head import Head
from app.core.solver.place_light import prepare
from app.core.solver.solve import solve_all
from app.core.solver.turn_choice import Limits
from app.devices.clock import SystemClock
from app.devices.webcam import SimulatedWebcam, WebcamError, WebcamState
from app.ui.presenters.window_model import NO_LIGHT, Step
from app.ui.screens.registry import screen
from app.ui.screens.turn import pictures
from app.ui.screens.turn.guidance import PILLS, REST, TAKE
from app.ui.screens.turn.live import heading_tracker
from app.ui.screens.turn.live.alignment import BESIDE
from app.ui.screens.turn.live.source_words import source_words
from app.ui.screens.turn.screen import NO_STYLE
from app.ui.screens.turn.state import TurnSizes
from app.words.guidance import AT_GOAL, HOLD, IN_LIGHT, TOO_FAR, TROUBLE, trouble_line
from app.words.phrases.turns import sureness_words, turn_words, walking_words
from tests.helpers.turn_rig import Rig, frame_of, lit_from
from tests.helpers.waiting import until


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    made = Rig(monkeypatch)
    made.start()
    return made


# -- left and right ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lamp", "mode", "way"),
    [
        (60.0, "walk", "clockwise"),
        (-60.0, "walk", "counter-clockwise"),
        (60.0, "selfie", "clockwise"),
        (-60.0, "selfie", "counter-clockwise"),
    ],
)
def test_a_lamp_is_turned_to(
    monkeypatch: pytest.MonkeyPatch, lamp: float, mode: str, way: Direction
) -> None:
    """Butterfly has its lamp in front: a lamp at azimuth p asks for turn p."""
    rig = Rig(monkeypatch, lamp_deg=lamp, mode=mode)
    rig.start()
    shown = rig.turn_to(0.0).guidance
    assert shown.number is not None
    assert shown.number == abs(whole(rig.goal)) == pytest.approx(60, abs=2)
    feet, _ = walking_words(way, Mode(mode))
    assert (shown.direction, shown.sign, shown.walk) == (way, way, feet)
    assert f"{shown.number}° to go, {way}" in shown.spoken


@pytest.mark.parametrize(
    ("mode", "looks", "heading"),
    [
        ("walk", "sitter", 180.0),
        ("walk", "me", 0.0),
        ("selfie", "me", 180.0),
        ("selfie", "sitter", 180.0),
    ],
)
def test_where_a_camera_points_at_turn_0(
    monkeypatch: pytest.MonkeyPatch, mode: str, looks: str, heading: float
) -> None:
    rig = Rig(monkeypatch, mode=mode, camera_looks=looks)
    rig.start()
    assert rig.point(heading).scale.now_deg == 0.0
    assert rig.point(wrap(heading + 30.0)).scale.now_deg == 30.0


def test_to_go_is_goal_minus_now_in_whole_degrees(rig: Rig) -> None:
    for turn in np.arange(-170.0, 180.0, 37.3):
        state = rig.turn_to(float(turn))
        now, number = state.scale.now_deg, state.guidance.number
        assert now is not None
        assert number is not None
        away = (state.scale.goal_deg - now) % 360.0
        assert number in (away, 360.0 - away)
        assert (state.scale.goal_words, state.scale.now_words) == ("goal", "now")


def test_the_photographer_stood_elsewhere(rig: Rig) -> None:
    rig.model.update(front_deg=20.0, results=tuple(r.seen_from(20.0) for r in rig.model.results))
    state = rig.point(wrap(20.0 + 180.0))
    assert state.scale.now_deg == 0.0
    assert state.scale.goal_deg == pytest.approx(40.0, abs=2.0)


# -- inside, hold, too far ---------------------------------------------------------------------


def test_inside_the_arc_it_is_green_and_the_degrees_stay(rig: Rig) -> None:
    arc = rig.state.scale.arc_deg
    assert arc is not None
    outside = rig.turn_to(arc[0] - 6.0).guidance
    assert (outside.pill, outside.inside, outside.number_words) == (
        IN_LIGHT.near,
        False,
        "to go",
    )
    inside = rig.turn_to(rig.goal - 4.0).guidance
    assert (inside.phase, inside.sign, inside.inside) == (Phase.INSIDE, "check", True)
    assert (inside.number, inside.number_words, inside.pill) == (
        4,
        "to the best",
        IN_LIGHT.here,
    )
    # Nobody is told to walk and to take the picture at once.
    assert (inside.direction, inside.walk) == (TAKE, "")
    assert inside.company == REST[Mode.WALK][True]
    held = rig.turn_to(rig.goal + 1.0).guidance
    assert (held.direction, held.walk, held.pill_icon) == (TAKE, HOLD, "check")
    beyond = rig.turn_to(arc[1] + 6.0).guidance
    assert (beyond.pill, beyond.number_words) == (TOO_FAR, "back")
    assert beyond.walk == walking_words("counter-clockwise", Mode.WALK)[0]


def test_the_turn_is_done_while_live_sees_the_sitter_in_the_light(rig: Rig) -> None:
    model = rig.model

    def done() -> bool:
        return screen(Step.TURN).done(model)

    rig.turn_to(rig.goal)
    assert not done(), "no goal was set: the best turn is only looked at"
    model.update(goal_deg=rig.goal)
    rig.turn_to(rig.goal - 60.0)
    assert not done()
    rig.turn_to(rig.goal - 4.0)
    assert done()
    # Gone on without a picture, it is yet to be done; left in the light, it stays done.
    rig.turn_to(rig.goal - 60.0)
    assert not done()
    rig.turn_to(rig.goal)
    model.update(step=Step.LIGHT)
    rig.presenter.leave()
    assert done()
    rig.presenter.enter()
    assert done(), "a camera that is only starting says nothing"


def test_a_style_out_of_reach_has_no_arc(monkeypatch: pytest.MonkeyPatch) -> None:
    from dataclasses import replace

    rig = Rig(monkeypatch)
    gone = tuple(replace(one, attainable=False) for one in rig.model.results)
    rig.model.update(results=gone)
    rig.start()
    assert rig.state.scale.arc_deg is None
    assert rig.state.scale.arc_words == ""


def test_a_goal_of_ones_own_takes_the_arc_it_is_on_or_none(rig: Rig) -> None:
    rig.model.update(goal_deg=wrap(rig.goal + 3.0))
    assert rig.state.scale.arc_deg is not None
    rig.model.update(goal_deg=wrap(rig.goal + 70.0))
    state = rig.turn_to(rig.goal - 20.0)
    assert state.scale.arc_deg is None
    # It is a goal, and no light to be in.
    assert state.guidance.pill == AT_GOAL.before
    held = rig.turn_to(rig.goal)
    assert (held.guidance.walk, held.guidance.pill) == (HOLD, AT_GOAL.here)


def test_match_follows_the_turn_and_never_beats_its_best(rig: Rig) -> None:
    result = rig.model.result
    assert result is not None
    best = int(result.match)
    far = rig.turn_to(wrap(rig.goal - 90.0)).style
    assert far.match_at_goal == f"{best} at the goal"
    assert int(far.match.removeprefix("Match now ")) < best
    assert rig.turn_to(rig.goal).style.match == f"Match now {best}"
    matches = [
        int(rig.turn_to(rig.goal + d).style.match.removeprefix("Match now ")) for d in range(-5, 6)
    ]
    assert max(matches) == best


def test_now_picture_follows(rig: Rig) -> None:
    first = rig.turn_to(0.0).pictures.now
    second = rig.turn_to(90.0).pictures.now
    assert first is not None
    assert second is not None
    assert np.abs(first.astype(int) - second).max() > 30
    assert rig.turn_to(90.0).pictures.now is second


def test_the_picture_is_lit_by_where_the_nose_points(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float, float]] = []

    def portrait(head: Head, light: object, facing_deg: float, *_: object) -> NDArray[np.uint8]:
        del light
        asked.append((head.yaw_deg, facing_deg))
        return np.zeros((2, 2, 3), np.uint8)

    monkeypatch.setattr(Head, "turned", lambda head, yaw: replace(head, yaw_deg=yaw))
    monkeypatch.setattr(pictures, "now_portrait", portrait)
    rig = Rig(monkeypatch)
    rig.model.update(
        front_deg=10.0, results=tuple(replace(one, yaw_deg=30.0) for one in rig.model.results)
    )
    rig.start()
    goal = whole(rig.goal)
    assert asked[-1] == pytest.approx((30.0, wrap(goal + 10.0 - 30.0)))
    # The goal's picture and the strip are of what is behind, seen from the lens.
    views = rig.presenter._images.views
    assert views is not None
    assert views.scene.goal_deg == goal
    assert rig.state.style.now_tag == "At the goal"


# -- the webcam --------------------------------------------------------------------------------


def test_no_webcam_shows_the_whole_turn_and_the_goal_twice(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch, webcams=0)
    rig.start()
    state = rig.tick()
    goal = abs(whole(rig.goal))
    assert state.live.message.startswith(source_words("webcam").missing)
    assert (state.guidance.number, state.guidance.number_words) == (goal, "")
    assert state.pictures.live is state.pictures.goal
    assert state.pictures.goal is not None
    assert not state.alignment.available
    assert state.live.quality == "No webcam"


def test_a_webcam_plugged_in_later_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.helpers.turn_rig import FakeWebcam

    rig = Rig(monkeypatch, webcams=0)
    rig.start()
    rig.webcams.append(FakeWebcam())
    rig.tick(3)
    assert rig.devices.webcam.call_count == 0, "it is not looked for all the time"
    rig.tick(1, 6.0)
    assert rig.turn_to(30.0).scale.now_deg == 30.0


def test_unplugged_the_last_picture_stays_dim_and_it_goes_on_by_itself(rig: Rig) -> None:
    shown = rig.turn_to(20.0).pictures.live
    rig.webcam.unplug()
    state = rig.tick()
    assert state.pictures.live is shown
    assert state.live.dim
    assert state.live.message == state.guidance.sentence == TROUBLE[Phase.AWAY]
    assert state.guidance.number is None
    back = rig.turn_to(25.0)
    assert back.guidance.number == whole(rig.goal - 25.0)
    assert not back.live.dim


def test_lost_after_a_second_number_and_arrow_go(rig: Rig) -> None:
    rig.turn_to(20.0)
    assert rig.lose().guidance.number == whole(rig.goal - 20.0)
    state = rig.tick(30)
    assert state.guidance.number is None
    assert state.guidance.sign == "none"
    assert state.guidance.sentence == state.live.quality == TROUBLE[Phase.LOST]
    assert state.scale.now_deg is None
    goal = rig.goal
    assert turn_words(goal) in state.guidance.advice
    back = rig.turn_to(20.0)
    assert (back.live.quality, back.guidance.advice) == ("Heading likely", "")


def test_the_sitters_place_in_the_picture_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    # The axis points 12 deg beside the sitter; what lies behind them is where they turn from.
    rig = Rig(monkeypatch)
    rig.start()
    for beside in (12.0, -12.0, 0.0):
        state = rig.point(wrap(40.0 + 180.0 - beside), beside)
        assert state.scale.now_deg == 40.0
        assert state.guidance.number == whole(rig.goal) - 40
        # The frame on the strip is what the camera sees, the number is the sitter's.
        assert state.scale.camera_deg == pytest.approx(40.0 - beside, abs=0.2)
    state = rig.point(wrap(40.0 + 180.0), None)
    assert state.scale.now_deg == 40.0
    assert sureness_words(0.0) in state.live.quality


def test_who_is_in_the_picture_of_a_camera_that_looks_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A laptop's own camera sees the photographer: where they are in it says nothing of the sitter.
    rig = Rig(monkeypatch, camera_looks="me")
    rig.start()
    state = rig.point(40.0, 15.0)
    assert (state.scale.now_deg, state.live.quality) == (40.0, "Heading likely")
    rig.presenter.set_mode("selfie")
    rig.point(100.0)
    # In selfie mode they are the sitter.
    assert rig.point(wrap(40.0 + 180.0 - 15.0), 15.0).scale.now_deg == 40.0


def test_a_camera_left_behind_is_said_to_be(rig: Rig) -> None:
    rig.turn_to(20.0)
    track = rig.presenter._tracker.track
    assert track is not None
    rig.presenter._tracker.track = replace(track, left_behind=True)
    state = rig.tick()
    assert state.guidance.phase is Phase.LEFT
    assert state.guidance.sentence == TROUBLE[Phase.LEFT]
    assert state.live.quality == trouble_line(Phase.LEFT)
    assert (state.guidance.number, state.scale.now_deg) == (None, None)
    # It is still asked to turn, so that whoever watches over it goes on.
    assert rig.presenter._guidance.asked_deg is not None
    rig.presenter._tracker.track = track
    assert rig.tick().guidance.number == whole(rig.goal) - 20


def wall(seed: int = 0) -> NDArray[np.uint8]:
    """Something with marks all over, by which a camera that moves is told from one that stands."""
    chance = np.random.default_rng(seed)
    spots = cv2.GaussianBlur(chance.integers(0, 255, (144, 256, 3), np.uint8), (0, 0), 3.0)
    return np.asarray(np.clip((spots - 127.0) * 8.0 + 127.0, 0, 255), np.uint8)


def watch_the_walk(
    rig: Rig, heading_deg: float, from_deg: float, to_deg: float, shakes: bool = False
) -> list[Phase]:
    """Somebody walks across the picture for seven seconds; the camera stands, or is held."""
    chance, phases = np.random.default_rng(1), []
    for step in range(70):
        aside = from_deg + (to_deg - from_deg) * min(step / 60.0, 1.0)
        shift = chance.integers(-4, 5, 2) if shakes else (0, 0)
        picture = np.roll(wall(), shift, (0, 1))
        picture[0, :2] = frame_of(heading_deg, sitter_deg=aside)[0, :2]
        rig.webcam.send(picture)
        phases.append(rig.tick(1, 0.1).guidance.phase)
    return phases


def test_who_walks_while_the_camera_stands_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the pictures alone, through tracker and guidance: a laptop stays on the ground."""
    rig = Rig(monkeypatch, camera_looks="me")
    rig.start()
    assert abs(difference(rig.goal, 10.0)) > 20.0
    phases = watch_the_walk(rig, 10.0, -20.0, 20.0)
    assert Phase.LEFT not in phases[:40]
    assert phases[-1] is Phase.LEFT
    assert rig.state.guidance.sentence == TROUBLE[Phase.LEFT]
    # It is carried on: there is a number again.
    rig.turn_to(10.0)
    assert rig.state.guidance.phase is not Phase.LEFT
    assert rig.point(20.0).guidance.number == whole(difference(rig.goal, 20.0))


@pytest.mark.parametrize("case", ["waits", "held", "there", "new goal"])
def test_who_need_not_be_told(monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    rig = Rig(monkeypatch, camera_looks="me")
    rig.start()
    at = rig.goal if case == "there" else 10.0
    walk = (0.0, 1.0) if case == "waits" else (-20.0, 20.0)
    phases = watch_the_walk(rig, at, *walk, shakes=case == "held")
    assert (Phase.LEFT in phases) == (case == "new goal")
    if case == "new goal":
        # Another style whose light is where the camera stands: nobody is asked to walk any more.
        light = lit_from(10.0)
        results = solve_all(rig.head.pack, light.searched, "picture", limits=Limits(0.0, 0.0))
        rig.model.update(results=results)
        assert watch_the_walk(rig, 10.0, 20.0, 20.0)[-1] is Phase.HOLD


def test_the_camera_of_who_is_photographed_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera on a stand that looks at the sitter, who moves: what is asked moves with them."""
    rig = Rig(monkeypatch)
    rig.start()
    heading = wrap(10.0 + 180.0)
    phases = watch_the_walk(rig, heading, -20.0, 20.0)
    assert phases[-1] is Phase.LEFT
    assert rig.presenter._guidance.asked_deg is not None


def test_in_the_light_is_not_left_by_a_tremble(rig: Rig) -> None:
    arc = rig.state.scale.arc_deg
    assert arc is not None
    assert rig.turn_to(arc[1] - 1.0).guidance.inside
    assert rig.turn_to(arc[1] + 1.0).guidance.inside
    assert not rig.turn_to(arc[1] + 3.0).guidance.inside
    assert not rig.turn_to(arc[1] + 1.0).guidance.inside


def test_alignment_gives_way_to_side_by_side_when_nothing_is_known(rig: Rig) -> None:
    rig.turn_to(20.0)
    rig.presenter.alignment.toggle()
    rig.lose()
    state = rig.tick(30)
    assert state.live.tag == BESIDE
    rig.presenter.alignment.toggle()
    alone = rig.tick(2).pictures.live
    assert alone is not None
    assert state.pictures.live is not None
    assert np.array_equal(alone, state.pictures.live)


def test_a_black_picture_says_so_instead(rig: Rig) -> None:
    rig.turn_to(20.0)
    rig.webcam.error = WebcamError("Black.", "Open its cover.", "black")
    rig.lose()
    state = rig.tick(30)
    assert state.guidance.sentence == str(rig.webcam.error)
    assert state.live.message == state.guidance.sentence


def test_a_busy_webcam_says_what_to_do(rig: Rig) -> None:
    rig.webcam.state = WebcamState.RETRYING
    rig.webcam.error = WebcamError("The webcam is in use.", "Close the other program.", "busy")
    state = rig.tick()
    assert state.live.message == str(rig.webcam.error)
    assert state.guidance.number is not None


def test_it_runs_only_while_the_screen_is_in_front(rig: Rig) -> None:
    rig.turn_to(20.0)
    rig.presenter.leave()
    assert rig.webcam.closed == 1
    rig.webcam.send(frame_of(10.0))
    before = rig.view.show_state.call_count
    rig.presenter.tick()
    assert rig.view.show_state.call_count == before
    rig.presenter.enter()
    rig.presenter.enter()
    assert rig.devices.webcam.call_count == 2
    assert rig.turn_to(33.0).scale.now_deg == 33.0


def test_another_webcam_is_taken_and_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, webcams=2)
    rig.start()
    assert rig.tick().menu.webcams == ((0, "Webcam 1"), (1, "Webcam 2"))
    rig.presenter.choose_webcam(1)
    assert rig.webcams[0].closed == 1
    assert rig.model.settings.webcam == 1
    rig.webcams[1].send(frame_of(-170.0))
    assert rig.tick(2).scale.now_deg == 10.0
    keys = [action.key for action in rig.presenter.actions()]
    assert {"turn-webcam-0", "turn-webcam-1"} <= set(keys)


def test_the_newest_picture_wins(rig: Rig) -> None:
    looked: list[int] = []
    real = track

    def locate(picture: object, *rest: object, **named: object) -> object:
        looked.append(1)
        return real(picture, *rest, **named)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(heading_tracker, "track", locate)
        for turn in range(30):
            rig.webcam.send(frame_of(wrap(turn + 180.0)))
        assert rig.tick().scale.now_deg == 29.0
        rig.tick(5)
    assert len(looked) == 1


def test_a_picture_that_cannot_be_worked_on_is_one_without_a_heading(rig: Rig) -> None:
    rig.turn_to(20.0)

    def broken(*_: object, **__: object) -> object:
        raise ValueError

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(heading_tracker, "find_heading", broken)
        rig.turn_to(30.0)
        assert rig.tick(30).guidance.phase is Phase.LOST
    assert rig.turn_to(30.0).scale.now_deg == 30.0


# -- learning the panorama ---------------------------------------------------------------------


def test_the_panorama_is_learnt_once(rig: Rig) -> None:
    rig.turn_to(10.0)
    rig.presenter.leave()
    rig.presenter.enter()
    rig.turn_to(10.0)
    assert rig.runner.ran.count("turn-index") == 1


def test_a_blank_panorama_leaves_the_number(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.blank = True
    rig.start()
    state = rig.turn_to(0.0)
    assert state.guidance.number == abs(whole(rig.goal))
    assert state.guidance.pill == PILLS["blank"][0]
    assert state.live.quality == str(rig.presenter._tracker.error)


# -- which way it looks ------------------------------------------------------------------------


def test_it_is_asked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, camera_looks="ask")
    rig.start()
    assert not rig.tick().live.asking, "there is nothing to ask about before the first picture"
    state = rig.turn_to(20.0)
    assert state.live.asking
    assert state.scale.now_deg is None, "left and right could be mistaken"
    assert state.guidance.pill == PILLS["asking"][0]
    rig.presenter.answer("me")
    assert rig.model.settings.camera_looks == "me"
    state = rig.point(20.0)
    assert not state.live.asking
    assert state.scale.now_deg == 20.0
    rig.presenter.leave()
    rig.presenter.enter()
    assert not rig.point(20.0).live.asking


def test_a_selfie_needs_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, camera_looks="ask", mode="selfie")
    rig.start()
    state = rig.turn_to(20.0)
    assert not state.live.asking
    assert state.scale.now_deg == 20.0


def test_a_webcam_that_knows_is_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, camera_looks="ask")
    rig.webcam.looks_at = "me"  # type: ignore[attr-defined]
    rig.start()
    state = rig.point(20.0)
    assert not state.live.asking
    assert state.scale.now_deg == 20.0


# -- pictures ----------------------------------------------------------------------------------


def test_selfie_mirrors_all_pictures_and_no_words(rig: Rig) -> None:
    rig.presenter.measure(TurnSizes((72, 128), (60, 300), (40, 40)))
    plain = rig.turn_to(20.0)
    rig.presenter.toggle_mode()
    state = rig.turn_to(20.0)
    for one, other in (
        (plain.pictures.live, state.pictures.live),
        (plain.pictures.goal, state.pictures.goal),
        (plain.pictures.strip, state.pictures.strip),
    ):
        assert one is not None
        assert other is not None
        assert np.array_equal(one[:, ::-1], other)
    assert plain.pictures.live is not None
    assert plain.pictures.live[40, 10, 0] < plain.pictures.live[40, 120, 0]
    assert (plain.scale.mirrored, state.scale.mirrored) == (False, True)
    assert state.live.live == "webcam, mirrored"
    assert state.guidance.walk == walking_words("clockwise", Mode.SELFIE)[0]


def test_pictures_have_the_sizes_that_are_asked_for(rig: Rig) -> None:
    rig.presenter.measure(TurnSizes((90, 160), (50, 333), (30, 44)))
    pictures = rig.turn_to(20.0).pictures
    shapes = [p.shape for p in (pictures.live, pictures.goal, pictures.strip) if p is not None]
    assert shapes == [(90, 160, 3), (90, 160, 3), (50, 333, 3)]
    assert pictures.now is not None
    assert pictures.now.shape == (30, 44, 3)


def test_live_is_laid_over_the_goal_as_strongly_as_asked(rig: Rig) -> None:
    rig.presenter.measure(TurnSizes((72, 128), (60, 300), (40, 40)))
    alone = rig.turn_to(20.0).pictures
    rig.presenter.alignment.toggle()
    rig.presenter.alignment.set_opacity(25)
    over = rig.tick(2)
    assert over.alignment.on
    assert over.live.tag == "Live over the goal. Not yet aligned"
    assert alone.live is not None
    assert alone.goal is not None
    assert over.pictures.live is not None
    mixed = 0.25 * alone.live[5:] + 0.75 * alone.goal[5:]
    assert np.abs(mixed - over.pictures.live[5:]).max() <= 2.0
    rig.presenter.alignment.toggle()
    again = rig.tick(2).pictures.live
    assert again is not None
    assert np.array_equal(again, alone.live)


def test_live_and_goal_are_split_with_live_on_the_left(rig: Rig) -> None:
    rig.presenter.measure(TurnSizes((72, 128), (60, 300), (40, 40)))
    alone = rig.turn_to(20.0).pictures
    for mode in ("walk", "selfie"):
        rig.presenter.set_mode(mode)
        alone = rig.turn_to(20.0).pictures
        rig.presenter.alignment.toggle()
        rig.presenter.alignment.set_mode("split")
        rig.presenter.alignment.set_opacity(25)
        state = rig.tick(2)
        assert state.live.tag.startswith("Live on the left, goal on the right")
        assert alone.live is not None
        assert alone.goal is not None
        made = state.pictures.live
        assert made is not None
        # The mark between them is two pixels wide.
        assert np.array_equal(made[5:, :31], alone.live[5:, :31])
        assert np.array_equal(made[5:, 33:], alone.goal[5:, 33:])
        rig.presenter.alignment.toggle()


def test_live_and_goal_blink_or_are_swapped_by_hand(rig: Rig) -> None:
    rig.turn_to(20.0)
    rig.presenter.alignment.toggle()
    rig.presenter.alignment.set_mode("blink")
    seen = [rig.tick(1, 0.1).live.tag.partition(".")[0] for _ in range(24)]
    assert set(seen) == {"Live", "Goal"}
    assert sum(one != other for one, other in pairwise(seen)) in (3, 4)
    assert not rig.state.alignment.swaps
    rig.model.set("reduce_motion", True)
    still = {rig.tick(1, 0.1).live.tag.partition(".")[0] for _ in range(24)}
    assert (still, rig.state.alignment.swaps) == ({"Live"}, True)
    rig.presenter.alignment.swap()
    assert rig.tick(1, 0.1).live.tag.startswith("Goal.")


# -- at once -----------------------------------------------------------------------------------


def test_the_number_stands_before_the_background_is_learnt(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    goal = abs(whole(rig.goal))
    monkeypatch.setattr(heading_tracker.HeadingTracker, "learning", property(lambda _: True))
    rig.webcam.send(frame_of(wrap(20.0 + 180.0)))
    rig.presenter._tracker.forget()
    shown = rig.tick(2).guidance
    feet, _ = walking_words("clockwise", Mode.WALK)
    assert (shown.number, shown.direction, shown.walk) == (goal, "clockwise", feet)
    assert (shown.pill, shown.pill_icon) == PILLS["learning"]
    monkeypatch.undo()


def test_every_text_has_one_number_and_no_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    """Degrees of turn stand on the screen once: in large type."""
    for lamp in (60.0, -60.0):
        for mode in ("walk", "selfie"):
            rig = Rig(monkeypatch, lamp_deg=lamp, mode=mode)
            rig.start()
            for turn in (0.0, rig.goal - 30.0, rig.goal - 4.0, rig.goal, rig.goal + 60.0, 175.0):
                state = rig.turn_to(turn)
                column, scale = state.guidance, state.scale
                texts = [column.number_words, column.direction, column.walk, column.company]
                texts += [column.pill, column.sentence, column.advice, state.live.quality]
                texts += [scale.goal_words, scale.now_words, scale.arc_words, scale.description]
                texts += [state.live.live, state.live.goal, state.live.message, state.live.tag]
                texts += [state.plan_words.title, state.plan_words.description]
                texts += state.plan_words.labels
                assert [one for one in texts if any(sign in one for sign in "°−+0123456789")] == []
                assert column.number is not None
                assert column.number >= 0


# -- sounds ------------------------------------------------------------------------------------


def test_it_beeps_quicker_the_nearer_and_holds_a_tone(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, sounds=True, volume=40.0)
    rig.start()
    rig.turn_to(rig.goal - 90.0)
    counts = []
    for away in (80.0, 20.0):
        rig.turn_to(rig.goal - away)
        rig.sounds.play.reset_mock()
        rig.tick(100)
        counts.append(rig.sounds.play.call_count)
    assert 3 <= counts[0] < counts[1] / 2
    assert rig.sounds.play.call_args[0][1] == pytest.approx(0.4)
    rig.turn_to(rig.goal)
    rig.sounds.play.reset_mock()
    rig.tick(50)
    assert rig.sounds.play.call_count == 0, "the tone goes on by itself"
    rig.tick(200)
    assert rig.sounds.play.call_count == 1
    rig.presenter.toggle_sounds()
    rig.sounds.play.reset_mock()
    rig.tick(50)
    assert not rig.sounds.play.called
    assert rig.sounds.stop.called


def test_nothing_is_heard_once_the_screen_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, sounds=True)
    rig.start()
    rig.turn_to(rig.goal)
    rig.presenter.leave()
    assert rig.sounds.stop.called
    rig.sounds.play.reset_mock()
    rig.tick(30)
    assert not rig.sounds.play.called


# -- the rest ----------------------------------------------------------------------------------


def test_empty_says_what_is_missing_and_leads_there(rig: Rig) -> None:
    rig.model.update(chosen=None)
    assert (rig.state.empty, rig.state.empty_action) == (NO_STYLE, "Choose a style")
    assert rig.presenter.actions()[0].shortcut == "Return; Enter"
    rig.presenter.fill()
    steps = [rig.model.step]
    rig.model.update(light=None)
    assert rig.state.empty == NO_LIGHT
    rig.presenter.fill()
    steps.append(rig.model.step)
    assert steps == [Step.STYLES, Step.PROBE]


def test_four_hints_with_their_keys(rig: Rig) -> None:
    rig.model.update(step=Step.STYLES)
    rig.model.update(step=Step.TURN)
    hints = [(one.shortcut, one.hint) for one in rig.presenter.actions() if one.hint]
    assert hints == [("Space", "align"), ("M", "sound"), ("S", "selfie"), ("Esc", "styles")]
    rig.presenter.back()
    assert rig.model.step is Step.STYLES


def test_a_reader_is_told_seldom_but_at_once_of_a_new_state(rig: Rig) -> None:
    told = set()
    for step in range(12):
        rig.webcam.send(frame_of(rig.goal - 60.0 + step + 180.0))
        told.add(rig.tick(2).guidance.announced)
    assert len(told) <= 2
    assert rig.turn_to(rig.goal).guidance.announced.endswith(f" {IN_LIGHT.here}. {HOLD}.")


def test_no_frame_is_shown_twice_as_new_work(rig: Rig) -> None:
    rig.turn_to(20.0)
    before = list(rig.runner.ran)
    rig.tick(20)
    assert rig.runner.ran == before


@pytest.mark.slow
def _is_at(rig: Rig, turn_deg: float) -> bool:
    return bool(rig.tick().scale.now_deg == turn_deg)


@pytest.mark.parametrize(
    ("views", "probe"), [("location/views", "location/probe-1.exr"), ("cafe", "cafe/probe.exr")]
)
def test_the_demo_camera_at_the_demo_location(
    monkeypatch: pytest.MonkeyPatch, views: str, probe: str
) -> None:
    """Real pictures, real points: what is shown is where the camera was put."""
    rig = Rig(monkeypatch, camera_looks="ask")
    monkeypatch.undo()
    demo = resources() / "demo"
    webcam = SimulatedWebcam(demo / views, SystemClock())
    rig.devices.simulated = webcam
    rig.devices.webcam.side_effect = lambda index: webcam
    rig.model.update(light=prepare(read_environment(demo / probe)))
    rig.start()
    try:
        for put in (37.0, 50.0):
            rig.presenter.demo_turn(put)
            until(partial(_is_at, rig, put), "the heading", 0.05)
            state = rig.state
            assert state.scale.now_deg is not None
            assert abs(difference(state.scale.now_deg, put)) <= 1.0
            assert not state.live.asking
            assert state.demo_deg == whole(put)
            assert state.live.quality.startswith("Heading ")
            assert state.live.live == "webcam"
    finally:
        rig.presenter.leave()
        webcam.close()


def test_demo_steps_are_counted_from_where_the_photographer_stands(rig: Rig) -> None:
    assert rig.state.demo_deg is None
    rig.presenter.demo_step(1.0)
    webcam = SimulatedWebcam(resources() / "demo" / "location" / "views")
    rig.devices.simulated = webcam
    rig.model.update(front_deg=30.0)
    rig.presenter.demo_turn(-10.0)
    assert webcam.turn_deg == pytest.approx(20.0)
    rig.presenter.demo_step(10.0)
    assert rig.state.demo_deg == 0
