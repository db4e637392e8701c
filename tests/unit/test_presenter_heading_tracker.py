"""Looking at the live picture off the thread of the screens: newest first, and nothing stale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final
from unittest.mock import MagicMock

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import whole, wrap
from app.core.base.errors import Cancelled, CoreError
from app.core.base.progress import Token, silent
from app.core.faces.finder import Face
from app.core.faces.light_from_face import FaceLight
from app.core.faces.pose import HeadPose
from app.core.faces.shot_against_goal import Check
from app.core.guidance.who_moves import Mode
from app.core.localization import features
from app.core.localization.align import LikelyPose
from app.core.localization.features import HeadingIndex
from app.core.localization.heading import Heading
from app.core.localization.homography import UNSURE, Alignment, apply_homography, corners_of
from app.core.localization.live import tracking
from app.core.localization.sitter import Sitter
from app.core.portrait.head import Head
from app.core.solver.style_signature import Grade
from app.devices.clock import VirtualClock
from app.devices.webcam import WebcamFrame
from app.ui.presenters.backgrounds import Backgrounds
from app.ui.screens.turn.guidance import TAKE
from app.ui.screens.turn.live import alignment, face, heading_tracker
from app.ui.screens.turn.live.alignment import Aligner
from app.ui.screens.turn.live.heading_tracker import HeadingTracker
from app.words.guidance import NOSE_TO
from app.words.phrases.directions import nose_words
from tests.helpers.turn_rig import UNSEEN, Rig, frame_of, read_heading, read_sitter

Bytes = NDArray[np.uint8]
TARGET: Final = np.zeros((60, 80, 3), np.uint8)


@dataclass
class LaterRunner:
    """Keeps work until it is told to do it: what a thread does, without one."""

    waiting: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    ran: list[str] = field(default_factory=list)

    def submit(
        self, key: str, work: Callable[..., Any], *, title: str = "", **answers: Any
    ) -> None:
        del title
        self.waiting[key] = (work, answers)

    def cancel(self, key: str) -> None:
        held = self.waiting.pop(key, None)
        if held is not None and held[1].get("cancelled"):
            held[1]["cancelled"]()

    def running(self, key: str) -> bool:
        return key in self.waiting

    def work(self, key: str) -> None:
        """Do it, and answer."""
        work, answers = self.waiting[key]
        self.ran.append(key)
        try:
            answer = work(Token(), silent)
        except Cancelled:
            del self.waiting[key]
        except Exception as error:  # noqa: BLE001 - as a thread's pool does
            del self.waiting[key]
            answers["failed"](error)
        else:
            del self.waiting[key]
            answers.get("done", lambda _: None)(answer)


class Bench:
    """A `HeadingTracker` with pictures that say in their first pixel where they point."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.runner, self.clock, self.count = LaterRunner(), VirtualClock(10.0), 0
        self.services, self.changed = MagicMock(), MagicMock()
        self.services.runner, self.services.clock = self.runner, self.clock
        self.services.backgrounds = Backgrounds()
        self.built: list[Bytes] = []
        self.index: Any = None
        self.asked: list[float | None] = []
        self.sitter: Sitter | None = None
        patch.setattr(features, "build_index", self._build)
        patch.setattr(heading_tracker, "find_heading", self._find)
        patch.setattr(heading_tracker, "find_sitter", lambda *_: self.sitter)
        self.sight = HeadingTracker(self.services, self.changed)

    def _build(self, panorama: Bytes, *_: Any) -> object:
        self.built.append(panorama)
        if panorama.max() == 0:
            raise CoreError("There is nothing in this panorama.", "Go by it.")
        return self.index or object()

    def _find(self, picture: Bytes, index: Any, fov_deg: float | None, **how: Any) -> Heading:
        self.asked.append(how["near_deg"])
        return read_heading(picture)

    def light(self, seed: int = 1) -> Any:
        chance = np.random.default_rng(seed)
        display = chance.integers(0, 255, (64, 128, 3), np.uint8) * np.uint8(seed > 0)
        return MagicMock(display=display)

    def ready(self, seed: int = 1) -> None:
        self.sight.start()
        self.sight.learn(self.light(seed))
        self.runner.work("turn-index")

    def frame(self, heading_deg: float) -> WebcamFrame:
        self.count += 1
        return WebcamFrame(frame_of(heading_deg), self.count)

    def look(self, heading_deg: float, seconds: float = 0.06, **how: Any) -> None:
        self.clock.sleep(seconds)
        self.sight.look(self.frame(heading_deg), 60.0, **how)
        self.runner.work("turn-heading")


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(monkeypatch)


def learning(bench: Bench) -> bool:
    return bench.sight.learning


def shown_by(aligner: Aligner) -> Alignment | None:
    return aligner.alignment


def test_nothing_is_known_before_the_first_picture(bench: Bench) -> None:
    assert bench.sight.track is None
    bench.sight.start()
    bench.sight.learn(bench.light())
    assert bench.sight.learning
    bench.sight.look(bench.frame(10.0), 60.0)
    assert not bench.runner.running("turn-heading")
    bench.runner.work("turn-index")
    assert bench.sight.index is not None
    assert not learning(bench)
    bench.changed.assert_called()


def test_a_picture_is_tracked(bench: Bench) -> None:
    bench.ready()
    bench.look(10.0)
    track = bench.sight.track
    assert track is not None
    assert (track.status, track.heading_deg, track.fov_deg) == ("tracking", 10.0, 60.0)
    assert track.raw is not None
    assert (track.raw.status, track.raw.heading_deg, track.raw.inliers) == ("found", 10.0, 142)
    bench.look(12.0)
    assert bench.asked == [None, 10.0], "the second is looked for near the first"


def test_one_at_a_time_and_the_newest_next(bench: Bench) -> None:
    bench.ready()
    bench.sight.look(bench.frame(0.0), 60.0)
    for step in range(20):
        bench.sight.look(bench.frame(float(step)), 60.0)
    bench.runner.work("turn-heading")
    assert not bench.runner.waiting, "nothing is queued"
    newest = bench.frame(3.0)
    bench.clock.sleep(0.06)
    bench.sight.look(newest, 60.0)
    bench.runner.work("turn-heading")
    assert bench.sight.track is not None
    assert bench.sight.track.raw is not None
    assert bench.sight.track.raw.heading_deg == 3.0
    assert bench.runner.ran.count("turn-heading") == 2
    bench.sight.look(newest, 60.0)
    assert not bench.runner.waiting, "the very same picture says nothing new"


def test_the_thread_of_the_screens_does_none_of_the_work(bench: Bench) -> None:
    bench.ready()
    bench.sight.look(bench.frame(0.0), 60.0)
    assert bench.asked == []
    assert bench.sight.track is None


def test_a_jump_is_looked_at_again_even_in_the_same_picture(bench: Bench) -> None:
    bench.ready()
    bench.look(0.0)
    bench.clock.sleep(0.06)
    frame = bench.frame(120.0)
    bench.sight.look(frame, 60.0)
    bench.runner.work("turn-heading")
    assert bench.sight.track is not None
    assert bench.sight.track.heading_deg is None
    bench.sight.look(frame, 60.0)
    bench.runner.work("turn-heading")
    assert bench.sight.track.heading_deg == 120.0


def test_what_was_begun_before_is_of_no_use_after(bench: Bench) -> None:
    bench.ready()
    bench.sight.look(bench.frame(10.0), 60.0)
    bench.sight.forget()
    bench.runner.work("turn-heading")
    assert bench.sight.track is None, "that was another camera"
    bench.sight.look(bench.frame(10.0), 60.0)
    bench.sight.stop()
    assert not bench.runner.running("turn-heading")
    assert bench.sight.track is None
    bench.sight.look(bench.frame(10.0), 60.0)
    assert not bench.runner.waiting, "it looks at nothing any more"


def test_a_picture_that_cannot_be_worked_on(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    bench.ready()
    bench.look(10.0)
    monkeypatch.setattr(heading_tracker, "find_heading", MagicMock(side_effect=ValueError))
    bench.look(11.0)
    track = bench.sight.track
    assert track is not None
    assert (track.status, track.heading_deg) == ("searching", None)
    monkeypatch.setattr(heading_tracker, "find_heading", read_heading)
    bench.look(11.0)
    assert bench.sight.track is not None
    assert bench.sight.track.status == "tracking"


def test_a_picture_without_a_heading(bench: Bench) -> None:
    bench.ready()
    bench.look(10.0)
    bench.look(UNSEEN)
    assert bench.sight.track is not None
    assert bench.sight.track.heading_deg is None


def test_the_sitter_makes_the_turn(bench: Bench) -> None:
    bench.ready()
    bench.sitter = Sitter(0.75, 16.1, (0.7, 0.3, 0.8, 0.5))
    bench.look(100.0)
    assert bench.sight.track is not None
    assert bench.sight.track.turn_deg() == pytest.approx(100.0 + 16.1 - 180.0, abs=0.05)
    bench.sight.forget()
    bench.look(100.0, sees_sitter=False)
    assert bench.sight.track is not None
    assert bench.sight.track.turn_deg() == pytest.approx(-80.0)


def test_a_camera_left_behind_is_passed_on(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float | None] = []
    real = tracking.track

    def track(*words: Any, **how: Any) -> Any:
        asked.append(how["asked_deg"])
        return real(*words, **how)

    monkeypatch.setattr(heading_tracker, "track", track)
    bench.ready()
    bench.look(0.0)
    bench.look(0.0, asked_deg=40.0)
    assert asked == [None, 40.0]


# -- the panorama's points -------------------------------------------------------------------------


def test_a_place_is_learnt_once(bench: Bench) -> None:
    bench.ready(1)
    first = bench.sight.index
    bench.ready(2)
    assert bench.sight.index is not first
    bench.sight.learn(bench.light(1))
    assert bench.sight.index is first, "the same place, opened again"
    assert not bench.sight.learning
    assert len(bench.built) == 2
    for seed in (3, 4, 5):
        bench.ready(seed)
    bench.sight.learn(bench.light(1))
    assert bench.sight.learning, "only some are kept"


def test_what_was_learnt_stays_with_the_place(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another start of the program finds it there: nothing is described a second time."""
    light = bench.light(1)
    bench.sight.start()
    bench.sight.learn(light, tmp_path)
    bench.index = HeadingIndex(
        np.ones((64, 128), np.float32), np.ones((64, 3), np.float32), np.zeros(64, np.float32)
    )
    bench.runner.work("turn-index")
    bench.runner.work("turn-index-keep")
    later = Bench(monkeypatch)
    later.sight.start()
    later.sight.learn(light, tmp_path)
    later.runner.work("turn-index")
    assert later.built == []
    assert later.sight.index is not None
    assert np.array_equal(later.sight.index.descriptors, bench.index.descriptors)
    # Another light at the same place is another panorama.
    later.sight.learn(bench.light(2), tmp_path)
    later.runner.work("turn-index")
    assert len(later.built) == 1


def test_what_was_learnt_before_the_place_was_saved_is_kept_when_it_is(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[Path] = []
    monkeypatch.setattr(heading_tracker, "keep_index", lambda folder, *_: kept.append(folder))
    light = bench.light(1)
    bench.sight.start()
    bench.sight.learn(light)
    bench.runner.work("turn-index")
    assert not bench.runner.running("turn-index-keep")
    bench.sight.learn(light, tmp_path)
    bench.runner.work("turn-index-keep")
    bench.sight.learn(light, tmp_path)
    assert not bench.runner.running("turn-index-keep")
    assert (kept, len(bench.built)) == ([tmp_path], 1)


def test_an_answer_for_another_place_is_not_taken(bench: Bench) -> None:
    bench.sight.start()
    bench.sight.learn(bench.light(1))
    held = bench.runner.waiting["turn-index"]
    bench.sight.learn(bench.light(2))
    held[1]["done"](object())
    assert bench.sight.learning
    bench.runner.work("turn-index")
    assert bench.sight.index is not None


def test_a_blank_panorama(bench: Bench) -> None:
    bench.ready(0)
    assert isinstance(bench.sight.error, CoreError)
    assert not bench.sight.learning
    bench.ready(1)
    assert bench.sight.error is None


def test_learning_that_fails_or_is_stopped(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(features, "build_index", MagicMock(side_effect=ValueError))
    bench.ready(1)
    assert isinstance(bench.sight.error, CoreError)
    bench.services.notify.tell_error.assert_called_once()
    bench.sight.learn(bench.light(2))
    bench.runner.cancel("turn-index")
    assert "not learnt" in str(bench.sight.error)
    assert not bench.sight.learning


# -- the overlay -----------------------------------------------------------------------------------


def shifted(x: float) -> Alignment:
    matrix = np.array([[1.0, 0.0, x], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return Alignment("found", matrix, 60, 0.8, 2.0, 0.9)


class Table:
    """An `Aligner` whose answers a test decides on."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.runner, self.clock = LaterRunner(), VirtualClock(10.0)
        services = MagicMock()
        services.runner, services.clock = self.runner, self.clock
        self.answer: Alignment = shifted(0.0)
        self.sitter: Sitter | None = None
        self.asked: list[dict[str, Any]] = []
        patch.setattr(alignment, "align", self._align)
        patch.setattr(alignment, "find_sitter", lambda *_: self.sitter)
        self.aligner = Aligner(services, MagicMock())

    def _align(self, target: Bytes, view: Bytes, **how: Any) -> Alignment:
        self.asked.append(how)
        return self.answer

    def look(self, target: Bytes = TARGET) -> Alignment | None:
        self.clock.sleep(0.1)
        self.aligner.look(np.zeros((60, 80, 3), np.uint8), target, (70.0, 60.0))
        self.runner.work("turn-align")
        return self.aligner.alignment

    def corner(self) -> float:
        found = self.aligner.alignment
        assert found is not None
        assert found.homography is not None
        return float(apply_homography(found.homography, corners_of((80, 60)))[0, 0])


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> Table:
    table = Table(monkeypatch)
    table.aligner.switch(on=True)
    return table


def test_the_overlay_is_steadied(table: Table) -> None:
    table.look()
    table.answer = shifted(0.8)
    table.look()
    assert 0.0 < table.corner() < 0.4
    table.answer = shifted(30.0)
    table.look()
    assert table.corner() < 0.4, "a jump has to be seen twice"
    table.look()
    assert table.corner() == pytest.approx(30.0)


def test_another_goal_begins_afresh(table: Table) -> None:
    table.look()
    table.answer = shifted(30.0)
    table.look(TARGET.copy())
    assert table.corner() == pytest.approx(30.0)


def test_the_sitter_is_masked(table: Table) -> None:
    table.look()
    assert "mask" in table.asked[-1]
    assert table.asked[-1].get("mask") is None
    table.sitter = Sitter(0.75, 16.1, (0.7, 0.3, 0.8, 0.5))
    table.look()
    mask = table.asked[-1]["mask"]
    assert not mask[24, 60]
    assert mask[24, 5]
    assert table.asked[-1]["sitter_deg"] == 16.1


def test_the_overlay_ends(table: Table) -> None:
    table.look()
    table.answer = UNSURE
    for _ in range(7):
        table.look()
    assert table.aligner.alignment is not None
    assert table.aligner.alignment.homography is None
    table.aligner.look(np.zeros((60, 80, 3), np.uint8), TARGET, (70.0, 60.0))
    table.aligner.switch(on=False)
    assert shown_by(table.aligner) is None
    assert not table.runner.waiting
    table.aligner.look(np.zeros((60, 80, 3), np.uint8), TARGET, (70.0, 60.0))
    assert not table.runner.waiting


def test_a_picture_that_cannot_be_laid(table: Table, monkeypatch: pytest.MonkeyPatch) -> None:
    table.look()
    monkeypatch.setattr(alignment, "align", MagicMock(side_effect=ValueError))
    table.look()
    assert table.aligner.alignment is UNSURE
    monkeypatch.setattr(alignment, "find_sitter", MagicMock(side_effect=CoreError("Gone.")))
    monkeypatch.setattr(alignment, "align", table._align)
    table.look()
    assert table.corner() == 0.0


# -- the sitter's face -----------------------------------------------------------------------------


@pytest.fixture
def faces(monkeypatch: pytest.MonkeyPatch) -> list[Check]:
    """What is read of a face; the last one again and again."""
    found = [shown(0.0, "soft", 71.6)]
    monkeypatch.setattr(heading_tracker, "find_sitter", with_face(200.0))
    monkeypatch.setattr(face, "find_faces", lambda *_, **__: (LARGE,))
    monkeypatch.setattr(face, "graded_by", lambda *_: None)
    monkeypatch.setattr(face, "promise_of_place", lambda *_: MagicMock())
    monkeypatch.setattr(face, "check_face", lambda *_, **__: found[-1])
    return found


def shown(yaw_deg: float, grade: Grade | None, match: float | None) -> Check:
    light = FaceLight(HeadPose(yaw_deg, 0.0, 0.0, np.eye(3)))
    return Check(light, 60.0, "inside", grade=grade, match=match)


def face_of(side: float) -> Face:
    marks = np.zeros((468, 3), np.float32)
    marks[1, :2] = side
    return Face(marks, 1.0)


LARGE = face_of(200.0)


def with_face(side: float) -> Callable[..., Sitter | None]:
    def read(picture: Bytes, fov_deg: float, *_: Any) -> Sitter | None:
        found = read_sitter(picture, fov_deg)
        return None if found is None else replace(found, face=face_of(side))

    return read


def test_the_live_face_says_how_far_it_shows_the_style(
    monkeypatch: pytest.MonkeyPatch, faces: list[Check]
) -> None:
    rig = face_rig(monkeypatch)
    assert rig.turn_to(20.0).style.face == "Live face 71: soft"
    faces.append(shown(0.0, "yes", 88.0))
    assert rig.turn_to(60.0).style.face == "Live face 88: yes"


def test_it_is_read_four_times_a_second_at_most(
    monkeypatch: pytest.MonkeyPatch, faces: list[Check]
) -> None:
    rig, read = face_rig(monkeypatch), MagicMock(return_value=faces[0])
    rig.turn_to(20.0)
    monkeypatch.setattr(face, "check_face", read)
    for _ in range(50):
        rig.webcam.send(frame_of(-160.0))
        rig.tick()
    assert 6 <= read.call_count <= 9


@pytest.mark.parametrize("yaw", [-30.0, 25.0])
def test_a_sitter_who_looks_away_is_noticed(
    yaw: float, monkeypatch: pytest.MonkeyPatch, faces: list[Check]
) -> None:
    faces.append(shown(yaw, "yes", 88.0))
    rig = face_rig(monkeypatch)
    assert rig.turn_to(20.0).style.face == f"Head turned {abs(yaw):.0f}° away"


@pytest.fixture
def aside(monkeypatch: pytest.MonkeyPatch, faces: list[Check]) -> Rig:
    """A style that is seen from beside the nose: by 30 deg towards the sitter's right."""
    monkeypatch.setattr(Head, "turned", lambda head, yaw: head)
    rig = face_rig(monkeypatch)
    turned = tuple(replace(one, yaw_deg=30.0) for one in rig.model.results)
    rig.model.update(results=turned)
    return rig


def test_live_the_face_says_how_far_the_nose_is_off(aside: Rig, faces: list[Check]) -> None:
    faces.append(shown(18.0, "soft", 71.0))
    state = aside.turn_to(aside.goal)
    column = state.guidance
    assert (column.number, column.sign, column.direction, column.inside) == (
        12,
        "counter-clockwise",
        NOSE_TO[Mode.WALK][0],
        False,
    )
    assert column.announced == f"{nose_words(12.0)}."
    # The head is where it should be looked for, so it is no head that is turned away.
    assert state.style.face == "Live face 71: soft"
    goal = wrap(aside.goal)
    assert state.plan.nose_deg == pytest.approx(wrap(whole(goal) - 18.0))
    faces.append(shown(28.0, "yes", 88.0))
    held = aside.turn_to(aside.goal).guidance
    assert (held.direction, held.company, held.inside) == (
        TAKE,
        f"{nose_words(0.0)}.",
        True,
    )


def test_the_turn_is_not_done_while_the_nose_is_off(aside: Rig, faces: list[Check]) -> None:
    aside.model.update(goal_deg=aside.goal)
    faces.append(shown(10.0, "soft", 71.0))
    aside.turn_to(aside.goal)
    assert aside.model.reached is None
    faces.append(shown(30.0, "yes", 88.0))
    aside.turn_to(aside.goal)
    assert aside.model.reached == aside.model.aim


def test_a_new_number_of_the_nose_is_told_in_some_seconds(aside: Rig, faces: list[Check]) -> None:
    told: list[str] = []
    faces.append(shown(0.0, "soft", 71.0))
    aside.turn_to(aside.goal)
    for step in range(60):
        faces.append(shown(step / 3.0, "soft", 71.0))
        aside.webcam.send(frame_of(wrap(aside.goal + 180.0)))
        one = aside.tick(1, 0.25).guidance.announced
        if told[-1:] != [one]:
            told.append(one)
    assert 4 <= len(told) <= 6
    assert all(one.startswith("Nose ") for one in told)


def test_a_face_is_held_against_where_its_nose_is_to_point(
    aside: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    promised = MagicMock()
    monkeypatch.setattr(face, "promise_of_place", promised)
    aside.turn_to(20.0)
    result = aside.model.result
    assert result is not None
    goal, arc = promised.call_args[0][1:3]
    assert goal == pytest.approx(wrap(aside.goal - 30.0))
    assert arc == pytest.approx([end - 30.0 for end in result.arc_deg])


@pytest.mark.parametrize("trouble", ["small", "lost", "painted", "left", "photographer"])
def test_without_a_face_that_can_be_read_nothing_is_said(
    trouble: str, monkeypatch: pytest.MonkeyPatch, faces: list[Check]
) -> None:
    looks = "me" if trouble == "photographer" else "sitter"
    rig = face_rig(monkeypatch, camera_looks=looks)
    if trouble == "small":
        monkeypatch.setattr(heading_tracker, "find_sitter", with_face(60.0))
    if trouble == "painted":
        faces.append(shown(0.0, None, None))
    state = rig.turn_to(20.0)
    if trouble == "lost":
        for _ in range(80):
            state = rig.lose()
    if trouble == "left":
        rig.presenter.leave()
        rig.presenter.enter()
        state = rig.state
    assert state.style.face == ""


def face_rig(patch: pytest.MonkeyPatch, **settings: Any) -> Rig:
    before = vars(heading_tracker)["find_sitter"]
    made = Rig(patch, **settings)
    patch.setattr(heading_tracker, "find_sitter", before)
    made.start()
    return made


def test_the_overlay_starts_from_the_heading(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, poses = Rig(monkeypatch), list[LikelyPose | None]()

    def align(*_: Any, pose: LikelyPose | None, **__: Any) -> Alignment:
        poses.append(pose)
        return UNSURE

    monkeypatch.setattr(alignment, "align", align)
    rig.start()
    rig.turn_to(20.0)
    rig.presenter.alignment.toggle()
    rig.tick(3)
    assert poses
    assert poses[-1] is not None
    assert poses[-1].to_goal_deg == pytest.approx(rig.goal - 20.0, abs=1.0)
    rig.lose()
    rig.tick(30)
    assert poses[-1] is None
