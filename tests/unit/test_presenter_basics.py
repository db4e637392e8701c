"""What all presenters stand on: events, work, undo, the model, sorting out files."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base.errors import Cancelled, CoreError
from app.core.places.intake import sort_out
from app.ui.presenters.undo_stack import Undoable, UndoStack
from app.ui.presenters.window_model import Event, Model, Step
from tests.helpers.immediate_runner import ImmediateRunner


def test_event_tells_everybody_once_and_in_order() -> None:
    event, heard = Event(), list[str]()

    def first() -> None:
        heard.append("first")

    def second() -> None:
        heard.append("second")

    event.connect(first)
    event.connect(second)
    event.connect(first)
    event.emit()
    event.disconnect(first)
    event.disconnect(first)
    event.emit()
    assert heard == ["first", "second", "second"]


def test_who_is_disconnected_by_an_earlier_callback_is_not_told() -> None:
    event, heard = Event(), list[int]()
    event.connect(lambda: event.disconnect(late))

    def late() -> None:
        heard.append(1)

    event.connect(late)
    event.emit()
    assert heard == []


def test_work_ends_in_exactly_one_way() -> None:
    runner, ends = ImmediateRunner(), list[object]()

    def stopped(token: object, report: object) -> None:
        raise Cancelled

    def failing(token: object, report: object) -> None:
        raise CoreError("No.")

    for work in (lambda token, report: 7, stopped, failing):
        runner.submit(
            "key",
            work,
            done=ends.append,
            failed=lambda error: ends.append(str(error)),
            cancelled=lambda: ends.append("cancelled"),
        )
    assert ends == [7, "cancelled", "No."]


def test_a_failure_that_nobody_takes_is_not_lost() -> None:
    def failing(token: object, report: object) -> None:
        raise CoreError("No.")

    with pytest.raises(CoreError):
        ImmediateRunner().submit("key", failing)


@given(st.lists(st.sampled_from(["push", "undo", "redo"]), max_size=40))
def test_undo_and_redo_follow_a_plain_list(steps: list[str]) -> None:
    stack, value = UndoStack(), [0]
    done, undone, count = [0], list[int](), 0

    def put(number: int) -> None:
        value[0] = number

    for step in steps:
        if step == "push":
            count += 1
            before, after = value[0], count
            put(after)
            stack.push(
                Undoable(
                    f"step {after}",
                    lambda before=before: put(before),  # type: ignore[misc]
                    lambda after=after: put(after),  # type: ignore[misc]
                )
            )
            done.append(after)
            undone.clear()
        elif step == "undo":
            stack.undo()
            if len(done) > 1:
                undone.append(done.pop())
        else:
            stack.redo()
            if undone:
                done.append(undone.pop())
        assert value[0] == done[-1]
        assert bool(stack.undo_words) == (len(done) > 1)
        assert bool(stack.redo_words) == bool(undone)


def test_undo_forgets_the_oldest_beyond_its_bytes_but_never_the_newest() -> None:
    stack = UndoStack(most_bytes=100)
    for number in range(5):
        stack.push(Undoable(str(number), lambda: None, lambda: None, size=40))
    undone = []
    while stack.undo_words:
        undone.append(stack.undo_words)
        stack.undo()
    assert undone == ["4", "3"]
    again = UndoStack(most_bytes=100)
    again.push(Undoable("huge", lambda: None, lambda: None, size=1000))
    assert again.undo_words == "huge"


def test_model_tells_once_what_really_changed() -> None:
    model, told = Model(), list[frozenset[str]]()
    model.changed.connect(told.append)
    model.update(step=Step.TURN, chosen=None)
    model.update(step=Step.TURN)
    model.update(chosen="top", needle_deg=12.0)
    assert told == [frozenset({"step"}), frozenset({"chosen", "needle_deg"})]


def test_model_has_no_other_names() -> None:
    with pytest.raises(AttributeError):
        Model().update(stepp=Step.TURN)


def test_azimuths_count_from_where_the_photographer_stands() -> None:
    model = Model()
    model.update(front_deg=170.0)
    assert model.azimuth_of(30.0) == pytest.approx(-160.0)


def touch(folder: Path, *names: str) -> list[Path]:
    folder.mkdir(exist_ok=True)
    for name in names:
        (folder / name).write_bytes(b"")
    return [folder / name for name in names]


def test_a_folder_with_photographs_is_a_bracket(tmp_path: Path) -> None:
    touch(tmp_path / "bracket", "b.JPG", "a.jpg", "notes.txt", ".hidden.jpg")
    intake = sort_out([tmp_path / "bracket"])
    assert [file.name for file in intake.files] == ["a.jpg", "b.JPG"]
    assert intake.name == "bracket"
    assert intake.environment is None


def test_an_hdr_panorama_goes_before_photographs(tmp_path: Path) -> None:
    touch(tmp_path / "place", "a.jpg", "light.hdr")
    intake = sort_out([tmp_path / "place"])
    assert intake.environment == tmp_path / "place" / "light.hdr"
    assert not intake.files


def test_a_kept_place_is_known_by_its_file(tmp_path: Path) -> None:
    touch(tmp_path / "kept", "place.json", "environment.exr")
    for given_path in (tmp_path / "kept", tmp_path / "kept" / "place.json"):
        assert sort_out([given_path]).place == tmp_path / "kept"


def test_a_film_is_taken_where_it_is_alone_or_wanted(tmp_path: Path) -> None:
    film, photo = touch(tmp_path / "turn", "turn.MOV", "a.jpg")
    assert sort_out([film]).way == "film"
    assert sort_out([film]).originals == (film,)
    assert sort_out([film, photo]).files == (photo,)
    assert sort_out([film, photo], "film").files == (film,)
    other = touch(tmp_path / "more", "b.mp4")
    with pytest.raises(CoreError, match="2 films"):
        sort_out([film, *other])


def test_photographs_are_taken_for_what_is_chosen(tmp_path: Path) -> None:
    files = touch(tmp_path / "around", *[f"{number}.jpg" for number in range(80)])
    assert sort_out(files, "photos").way == "photos"
    with pytest.raises(CoreError, match="80 photos"):
        sort_out(files, "ball")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ([], "cannot read any of these files"),
        (["a.txt"], "cannot read any of these files"),
        (["a.exr", "b.exr"], "2 panoramas"),
        ([f"{number}.jpg" for number in range(65)], "65 photos"),
    ],
)
def test_what_cannot_be_opened_is_said(tmp_path: Path, names: list[str], words: str) -> None:
    touch(tmp_path / "folder", *names)
    with pytest.raises(CoreError, match=words):
        sort_out([tmp_path / "folder"])


def test_a_file_without_spaces_gives_a_place_with_them(tmp_path: Path) -> None:
    (file,) = touch(tmp_path, "brown_photostudio_02.hdr")
    assert sort_out([file]).name == "brown photostudio 02"


def test_a_bracket_of_single_files_is_named_after_their_folder(tmp_path: Path) -> None:
    files = touch(tmp_path / "Café", "1.jpg", "2.jpg")
    assert sort_out(files).name == "Café"
