"""After the shot: what is dropped is sorted, judged by the turn, kept, listed, and taken back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from app.core.base.angles import whole, wrap
from app.core.base.errors import CoreError
from app.core.faces.finder import Face
from app.core.faces.light_from_face import FaceLight
from app.core.faces.pose import HeadPose
from app.core.faces.shot_against_goal import Check
from app.core.localization.photo_location import PhotoLocation
from app.core.places.files.shots import read_shots
from app.core.portrait.head import Head
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.window_model import Step
from app.ui.screens.registry import screen
from app.ui.screens.turn.guidance import FROM_PHOTO
from app.ui.screens.turn.photos import check_job as photo_check
from app.ui.screens.turn.photos import photos
from app.ui.screens.turn.photos.photos import DROP_WORDS, REMOVED, TURN_NOT_SHOWN, TURN_UNKNOWN
from app.words.phrases.directions import key_words, ratio_words
from app.words.phrases.turns import taken_words
from app.words.why_out_of_reach import grade_words
from tests.helpers.photos import write_photo
from tests.helpers.turn_rig import Rig

PICTURE = np.full((300, 400, 3), 90, np.uint8)
POSE = HeadPose(0.0, 0.0, 0.0, np.eye(3))
KEY_AND_RATIO = f"{key_words(52.0, 40.0)}. {ratio_words(1.4, 2.0)}"
FACE = Face(np.zeros((468, 3), np.float32), 1.0)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    folder = tmp_path / "place"
    folder.mkdir()
    return folder


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    return write_photo(tmp_path / "IMG_1.jpg", PICTURE)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch, place: Path) -> Rig:
    made = Rig(monkeypatch)
    made.model.update(place_folder=place)
    made.start()
    taken_at(monkeypatch, made.goal)
    return made


def taken_at(patch: pytest.MonkeyPatch, turn: float | None, sitter: float | None = 2.0) -> None:
    """Let every photo be taken with the sitter turned so far from azimuth 0."""
    taken = PhotoLocation("unsure")
    if turn is not None:
        taken = PhotoLocation("found", wrap(turn + 180.0), wrap(turn), sitter, 60.0, 0.93)
    patch.setattr(photo_check, "locate_photo", lambda *_: taken)


def test_a_known_turn_in_a_sentence(
    rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert rig.presenter.drop_words == DROP_WORDS
    assert rig.place_controller.photo_taker is not None
    before = photo.read_bytes()
    goal = whole(rig.goal)
    taken_at(monkeypatch, goal - 3.0)
    assert rig.place_controller.photo_taker([photo])
    (row,) = rig.state.shots.rows
    best = int(rig.model.result.match) if rig.model.result else -1
    assert row.sentence == taken_words(goal - 3, goal, 0)
    assert f" of a possible {best}, " in row.detail
    assert (row.inside, row.icon, row.new, row.pictured) == (True, "check", True, True)
    assert "21 Nov, 13:03, IMG_1.jpg, match " in row.detail
    assert row.detail.endswith("heading certain")
    taken_at(monkeypatch, goal + 60.0)
    rig.presenter.open_photos([write_photo(photo.with_name("IMG_2.jpg"), PICTURE[::-1])])
    row = rig.state.shots.rows[0]
    arc = rig.state.scale.arc_deg
    assert arc is not None
    outside = goal + 60 - whole(arc[1])
    assert row.sentence == f"{outside}° too far"
    assert (row.inside, row.icon) == (False, "target")
    assert photo.read_bytes() == before
    assert [one.name for one in read_shots(place)[0]] == ["IMG_1.jpg", "IMG_2.jpg"]
    assert rig.state.shots.busy == ""


def test_a_checked_photo_leaves_the_other_panels_alone(rig: Rig, photo: Path) -> None:
    before = rig.state
    rig.presenter.open_photos([photo])
    assert rig.state.shots.rows
    assert rig.state.guidance is before.guidance
    assert rig.state.scale is before.scale


def test_mirrored_photo_is_read_as_the_place_shows(
    rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bool] = []

    def looked(picture: np.ndarray, *_: object, **_more: object) -> tuple[Face, ...]:
        seen.append(bool(picture[0, 0, 0] < picture[0, -1, 0]))
        return ()

    monkeypatch.setattr(photo_check, "find_faces", looked)
    ramp = np.repeat(np.linspace(0, 255, 400).astype(np.uint8)[None], 300, axis=0)
    write_photo(photo, np.repeat(ramp[..., None], 3, axis=2))
    mirror, kept = PhotoLocation("found", 180.0, 0.0, 0.0, 60.0, 0.93, mirrored=True), []
    assert rig.place_controller.photo_taker is not None
    for taken in (mirror, replace(mirror, mirrored=False), PhotoLocation("unsure")):
        monkeypatch.setattr(photo_check, "locate_photo", lambda *_, taken=taken: taken)
        assert rig.place_controller.photo_taker([photo])
        kept.append(read_shots(place)[0][-1].mirrored)
    rig.presenter.set_mirrored(True)
    assert rig.state.shots.mirrored
    assert rig.place_controller.photo_taker([photo])
    kept.append(read_shots(place)[0][-1].mirrored)
    assert seen == [False, True, True, False]
    assert kept == [True, False, False, True]
    assert rig.state.shots.rows[0].detail.endswith("mirrored")


def test_a_photo_in_the_light_makes_the_turn_done_until_it_is_removed(
    rig: Rig, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = rig.model

    def done() -> bool:
        return screen(Step.TURN).done(model)

    model.update(goal_deg=rig.goal)
    rig.turn_to(rig.goal + 90.0)
    taken_at(monkeypatch, rig.goal + 60.0)
    rig.presenter.open_photos([write_photo(photo.with_name("IMG_2.jpg"), PICTURE[::-1])])
    rig.tick()
    assert not done(), "taken beside the light"
    taken_at(monkeypatch, rig.goal)
    rig.presenter.open_photos([photo])
    rig.tick()
    # Wherever the camera is now: the picture is taken.
    assert done()
    rig.presenter.shots.remove(rig.state.shots.rows[0].key)
    rig.tick()
    assert not done()


def test_the_marker_moves_the_number_and_not_the_truth(rig: Rig, photo: Path) -> None:
    rig.presenter.open_photos([photo])
    assert rig.state.shots.rows[0].sentence == taken_words(96, 96, 0)
    rig.model.update(front_deg=30.0)
    assert rig.tick().shots.rows[0].sentence == taken_words(96, 96, 0)


def test_nobody_seen_is_said(rig: Rig, photo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taken_at(monkeypatch, 20.0, None)
    rig.presenter.open_photos([photo])
    row = rig.state.shots.rows[0]
    assert row.sentence.startswith("About ")
    assert row.detail.endswith("no sitter seen, assumed to be in the middle")


def test_unsure_is_said_and_nothing_is_asked(
    rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken_at(monkeypatch, None)
    rig.presenter.open_photos([photo])
    (row,) = rig.state.shots.rows
    assert row.sentence == TURN_UNKNOWN
    assert (row.icon, row.inside) == ("help", False)
    assert "%" not in row.detail
    (kept,) = read_shots(place)[0]
    assert (kept.found, kept.facing_deg, kept.match) == (False, None, None)
    rig.notify.tell.assert_not_called()
    rig.notify.tell_error.assert_not_called()


def seen(patch: pytest.MonkeyPatch, rig: Rig, **shown: Any) -> None:
    """Let the face in every photo show this, and the style have promised a key at 40 degrees."""
    light = FaceLight(POSE, 52.0, 30.0, "front", 8.0, 20.0, None, 1.4)
    shown_light = FaceLight(POSE, 40.0, 35.0, "front", ratio_stops=1.8)
    # The ratio that the Styles screen states, not the one read off its picture.
    promised = SimpleNamespace(light=shown_light, ratio_stops=2.0)
    patch.setattr(photo_check, "find_faces", lambda *_: (FACE,))
    patch.setattr(photo_check, "graded_by", lambda *_: None)
    patch.setattr(photo_check, "promise_of_place", lambda *_: promised)
    patch.setattr(photo_check, "check_face", lambda *_: Check(light, **shown))


def test_where_no_background_shows_the_face_tells_the_turn(
    rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken_at(monkeypatch, None)
    seen(monkeypatch, rig, facing_deg=wrap(rig.goal + 50.0), standing="outside", grade="soft")
    rig.presenter.open_photos([photo])
    (row,) = rig.state.shots.rows
    assert row.sentence.startswith("About ")
    assert row.sentence.endswith("too far")
    assert row.face.startswith("Butterfly ")
    assert row.face.endswith(f"{grade_words('soft', attainable=True)}. {KEY_AND_RATIO}")
    assert row.detail.endswith("turn estimated from the light on the face")
    (kept,) = read_shots(place)[0]
    assert (kept.by_face, kept.grade, kept.key_deg, kept.key_promised_deg) == (
        True,
        "soft",
        52.0,
        40.0,
    )


def test_a_face_in_the_light_is_in_the_light(
    rig: Rig, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever its likeliest turn is: no face is read to a degree."""
    taken_at(monkeypatch, None)
    arc = rig.state.scale.arc_deg
    assert arc is not None
    seen(monkeypatch, rig, facing_deg=arc[1] + 5.0, standing="inside", grade="yes")
    rig.presenter.open_photos([photo])
    assert rig.state.shots.rows[0].inside


@pytest.mark.parametrize("looks", ["aside", "at the lens"])
def test_a_photo_from_beside_the_nose_is_judged_by_the_nose(
    looks: str, rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Taken from where the lens belongs; who looks into it all the same is not in the light."""
    monkeypatch.setattr(Head, "turned", lambda head, yaw: head)
    rig.model.update(results=tuple(replace(one, yaw_deg=30.0) for one in rig.model.results))
    taken_at(monkeypatch, rig.goal)
    nose = rig.goal - 30.0 if looks == "aside" else rig.goal
    seen(monkeypatch, rig, facing_deg=wrap(nose), standing="inside", grade="yes")
    rig.presenter.open_photos([photo])
    (row,) = rig.state.shots.rows
    arc = rig.state.scale.arc_deg
    assert arc is not None
    assert row.sentence == (
        taken_words(96, 96, 0)
        if looks == "aside"
        else f"{whole(rig.goal) + 30 - whole(arc[1])}° too far"
    )
    (kept,) = read_shots(place)[0]
    assert kept.goal_facing_deg == pytest.approx(wrap(rig.goal))


def test_a_face_that_tells_no_turn_shows_its_light_all_the_same(
    rig: Rig, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken_at(monkeypatch, None)
    seen(monkeypatch, rig)
    rig.presenter.open_photos([photo])
    (row,) = rig.state.shots.rows
    assert row.sentence == TURN_NOT_SHOWN
    assert row.face == KEY_AND_RATIO


def test_a_head_turned_aside_counts_with_the_background(
    rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The nose decides, not the lens."""
    taken_at(monkeypatch, rig.goal)
    seen(monkeypatch, rig, facing_deg=wrap(rig.goal - 15.0), standing="inside")
    rig.presenter.open_photos([photo])
    (kept,) = read_shots(place)[0]
    assert not kept.by_face
    assert kept.facing_deg == pytest.approx(wrap(rig.goal - 15.0))


def test_the_last_two_of_a_style_stand_side_by_side(
    rig: Rig, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.presenter.open_photos([photo])
    assert rig.state.shots.before is None
    taken_at(monkeypatch, rig.goal + 60.0)
    rig.presenter.open_photos([write_photo(photo.with_name("IMG_2.jpg"), PICTURE[::-1])])
    state = rig.state.shots
    assert state.before is not None
    assert state.after is not None
    assert (state.before.name, state.after.name) == ("IMG_1.jpg", "IMG_2.jpg")


def test_photos_that_come_into_a_folder_are_checked(
    rig: Rig, photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was there before is left alone."""
    looks: list[list[Path]] = [[], [photo]]

    class Folder:
        def __init__(self, folder: Path, _clock: object) -> None:
            assert folder == tmp_path

        def poll(self) -> list[Any]:
            if not looks:
                raise CoreError("The folder is gone.")
            return [SimpleNamespace(path=path) for path in looks.pop(0)]

    monkeypatch.setattr(photos, "WatchedFolder", Folder)
    monkeypatch.setattr(photos, "wait", lambda *_: None)
    rig.presenter.shots.watch(tmp_path)
    assert [row.name for row in rig.state.shots.rows] == ["IMG_1.jpg"]
    assert "gone" in str(rig.notify.tell_error.call_args)


def test_a_blank_room_is_unsure(rig: Rig, photo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def blank(*_: object) -> None:
        raise CoreError("There is nothing in this panorama.")

    rig.presenter._tracker.index = None
    monkeypatch.setattr(photo_check, "build_index", blank)
    rig.presenter.open_photos([photo])
    assert rig.state.shots.rows[0].icon == "help"


def test_removed_undone_and_done_again(rig: Rig, photo: Path, place: Path) -> None:
    rig.presenter.open_photos([photo, write_photo(photo.with_name("IMG_2.jpg"), PICTURE[::-1])])
    names = [row.name for row in rig.state.shots.rows]
    assert names == ["IMG_2.jpg", "IMG_1.jpg"]
    rig.presenter.shots.remove(rig.state.shots.rows[1].key)
    assert [row.name for row in rig.state.shots.rows] == ["IMG_2.jpg"]
    assert [one.name for one in read_shots(place)[0]] == ["IMG_2.jpg"]
    message, told = rig.notify.tell.call_args[0][0], rig.notify.tell.call_args[1]
    assert message == REMOVED.format(name="IMG_1.jpg")
    assert photo.is_file()
    rig.services.undo.undo()
    assert [row.name for row in rig.state.shots.rows] == names
    assert rig.state.shots.rows[1].pictured
    rig.services.undo.redo()
    assert len(read_shots(place)[0]) == 1
    told["actions"][0][1]()
    assert [row.name for row in rig.state.shots.rows] == names
    assert len(read_shots(place)[0]) == 2


def test_the_place_opened_again_has_them(
    rig: Rig, photo: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.presenter.open_photos([photo, write_photo(photo.with_name("IMG_2.jpg"), PICTURE[::-1])])
    rig.presenter.shots.remove(rig.state.shots.rows[0].key)
    sentence = rig.state.shots.rows[0].sentence
    rig.model.update(place_folder=None)
    assert rig.state.shots.rows == ()
    rig.presenter.leave()
    assert rig.place_controller.photo_taker is None
    again = Rig(monkeypatch)
    again.model.update(place_folder=place)
    again.start()
    (row,) = again.state.shots.rows
    assert (row.name, row.sentence, row.new, row.pictured) == ("IMG_1.jpg", sentence, False, True)
    # Nobody can ask for the removed one any more.
    assert [each.name for each in (place / "shots" / "originals").iterdir()] == ["IMG_1.jpg"]


def test_a_panorama_is_opened_as_a_place(rig: Rig, photo: Path, tmp_path: Path) -> None:
    wide = tmp_path / "R0010001.jpg"
    assert cv2.imwrite(str(wide), np.zeros((512, 1024, 3), np.uint8))
    assert rig.presenter.shots.take([wide])
    rig.place_controller.open_as_place.assert_called_once_with((wide,))
    rig.place_controller.open_as_place.reset_mock()
    assert rig.presenter.shots.take([photo, wide])
    rig.place_controller.open_as_place.assert_called_once_with((photo, wide))
    assert rig.state.shots.rows == ()
    for other in ("studio.exr", "notes.txt", "folder"):
        assert not rig.presenter.shots.take([tmp_path / other])
    assert not rig.presenter.shots.take([])
    assert not rig.presenter.shots.take([photo] * 21)


def test_without_a_place_or_a_goal_nothing_is_taken(rig: Rig, photo: Path) -> None:
    rig.model.update(chosen=None, goal_deg=None)
    assert not rig.presenter.shots.take([photo])
    rig.presenter.open_photos([photo])
    rig.place_controller.open_paths.assert_called_once_with([photo])
    rig.model.update(place_folder=None)
    assert not rig.presenter.shots.take([photo])


def test_what_is_no_picture_is_told_and_nothing_is_kept(
    rig: Rig, tmp_path: Path, place: Path
) -> None:
    bad = tmp_path / "bad.jpg"
    bad.write_bytes(b"\xff\xd8\xff\xe0 cut off")
    assert rig.presenter.shots.take([bad])
    assert "damaged" in str(rig.notify.tell_error.call_args[0][0])
    assert rig.state.shots.busy == ""
    assert rig.state.shots.rows == ()
    assert list(place.iterdir()) == []


def test_a_place_left_meanwhile_keeps_its_photo(
    rig: Rig, photo: Path, place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other"
    other.mkdir()

    def slow(*_: object) -> PhotoLocation:
        rig.model.update(place_folder=other)
        return PhotoLocation("unsure")

    monkeypatch.setattr(photo_check, "locate_photo", slow)
    rig.presenter.open_photos([photo])
    assert rig.state.shots.rows == ()
    assert len(read_shots(place)[0]) == 1
    assert read_shots(other) == ((), ())


@pytest.mark.parametrize("webcams", [0, 1])
def test_turn_again_leads_back_to_the_guidance_with_the_same_goal(
    monkeypatch: pytest.MonkeyPatch, place: Path, photo: Path, webcams: int
) -> None:
    rig = Rig(monkeypatch, webcams=webcams)
    rig.model.update(place_folder=place)
    rig.start()
    goal, style = rig.goal, rig.model.chosen
    rig.model.update(goal_deg=wrap(goal + 1.0))
    taken_at(monkeypatch, goal + 61.0)
    rig.presenter.open_photos([photo])
    row = rig.state.shots.rows[0]
    assert (row.again, row.new) == (True, True)
    # Meanwhile another style was looked at.
    other = next(one.name for one in rig.model.results if one.name != style)
    rig.model.choose(other)
    rig.presenter.turn_again()
    assert rig.model.chosen == style
    assert rig.goal == pytest.approx(wrap(goal + 1.0), abs=0.01)
    assert not rig.state.shots.rows[0].new, "its degrees would contradict those of the guidance"
    shown = rig.tick().guidance
    if webcams:
        shown = rig.turn_to(goal - 20.0).guidance
        assert (shown.number, shown.direction) == (21, "clockwise")
    else:
        assert (shown.number, shown.direction) == (60, "counter-clockwise")
        assert shown.pill == FROM_PHOTO
        rig.presenter.leave()
        rig.presenter.enter()
        assert rig.tick().guidance.number == abs(whole(goal + 1.0))


def test_esc_goes_back_where_one_came_from(rig: Rig) -> None:
    for step in (Step.PROBE, Step.STYLES, Step.LIGHT):
        rig.model.update(step=step)
        rig.model.update(step=Step.TURN)
        rig.presenter.back()
        assert rig.model.step == step
    rig.model.update(step=Step.TURN)
    rig.turn_to(20.0)
    rig.presenter.alignment.toggle()
    rig.presenter.back()
    assert (rig.model.step, rig.tick().alignment.on) == (Step.TURN, False)


def test_a_dropped_photo_goes_to_whoever_takes_photos(rig: Rig, photo: Path) -> None:
    place_controller = PlaceController(rig.services)
    given: list[object] = []
    opened: list[object] = []
    place_controller.open_as_place = opened.append  # type: ignore[method-assign, assignment]

    def take(paths: Sequence[Path]) -> bool:
        given.append(paths)
        return paths[0] == photo

    place_controller.photo_taker = take
    place_controller.open_paths([photo])
    assert (given, opened) == ([[photo]], [])
    place_controller.open_paths([photo.with_suffix(".exr")])
    place_controller.photo_taker = None
    place_controller.open_paths([photo])
    assert opened == [[photo.with_suffix(".exr")], [photo]]
