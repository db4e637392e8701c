"""The list of places as a library: by day, with tags and notes, and picked to be compared."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from app.core.base.paths import resources
from app.core.measure.plan.planner import Plan, PlannedShot
from app.core.measure.read.frame import Exposure
from app.core.places.journal import SessionFrame
from app.core.places.place import LONGEST_NAME, LONGEST_NOTES, LONGEST_TAG, MOST_TAGS
from app.core.places.place_folder import create_place, read_place, summarise
from app.core.places.place_verdict import place_verdict, verdict_of
from app.core.portrait.ratio_and_glare import light_flow
from app.core.styles.styles import NAMES
from app.devices.capture.session import Session
from app.ui.presenters.places_list import MOST_SPOTS, PlacesListPresenter, PlacesListRow
from app.words.phrases.place_verdict import light_sentence, place_verdict_words
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.styles_screen import Table, on_time

SCENE = resources() / "demo" / "scenes" / "studio.exr"


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return on_time(Table(tmp_path, ImmediateRunner()))


def row(shelf: PlacesListPresenter, folder: Path) -> PlacesListRow:
    shelf.refresh()
    return next(one for one in shelf.resolve().rows if one.folder == folder)


def made(table: Table, tmp_path: Path, when: datetime, name: str = "Arcade") -> Path:
    return create_place(tmp_path / "places", name, when)


def test_places_stand_under_their_day(table: Table, tmp_path: Path) -> None:
    now = table.services.today()
    for days, name in ((0, "a"), (0, "b"), (1, "c"), (400, "d")):
        made(table, tmp_path, now - timedelta(days=days), name)
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    found = shelf.resolve().days
    assert [len(rows) for _, rows in found] == [2, 1, 1]
    assert [day for day, _ in found[:2]] == ["Today", "Yesterday"]
    assert found[2][0].endswith(str((now - timedelta(days=400)).year))


@pytest.mark.parametrize("is_open", [False, True])
def test_tags_and_notes_are_kept_and_can_be_undone(
    table: Table, tmp_path: Path, is_open: bool
) -> None:
    if is_open:
        table.desk.open_paths([SCENE])
        folder = table.model.place_folder
        assert folder is not None
    else:
        folder = made(table, tmp_path, table.services.today())
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    name = row(shelf, folder).name
    shelf.edit(folder, "", " north  light, brick,, Brick ", "")
    assert row(shelf, folder).tags == ("north light", "brick")
    assert row(shelf, folder).name == name
    shelf.edit(folder, "Doorway", "north light, brick", "Ask for the key.\r\nMind the step.")
    assert row(shelf, folder).name == "Doorway"
    assert row(shelf, folder).notes == "Ask for the key.\nMind the step."
    assert table.desk.keep_all()
    assert read_place(folder).tags == ("north light", "brick")
    assert read_place(folder).notes == "Ask for the key.\nMind the step."
    for words in ("key", "BRICK north"):
        assert row(shelf, folder).has(words)
    shelf.edit(folder, "Doorway", "brick", row(shelf, folder).notes)
    assert row(shelf, folder).tags == ("brick",)
    for _ in range(3):
        table.services.undo.undo()
    assert row(shelf, folder).tags == ()
    assert row(shelf, folder).notes == ""
    assert row(shelf, folder).name == name
    table.services.undo.redo()
    assert row(shelf, folder).tags == ("north light", "brick")


def test_undoing_what_was_said_of_the_open_place_is_seen_at_once(
    table: Table, tmp_path: Path
) -> None:
    table.desk.open_paths([SCENE])
    folder = table.model.place_folder
    assert folder is not None
    shelf, view = PlacesListPresenter(table.services, table.desk), MagicMock()
    shelf.attach(view)

    def shown() -> PlacesListRow:
        (only,) = view.show_state.call_args.args[0].rows
        assert isinstance(only, PlacesListRow)
        return only

    shelf.edit(folder, "Doorway", "brick", "")
    assert (shown().name, shown().tags) == ("Doorway", ("brick",))
    table.services.undo.undo()
    assert (shown().name, shown().tags) == ("studio", ())
    shelf.detach()
    view.reset_mock()
    table.services.undo.redo()
    assert not view.show_state.called


def test_nothing_said_is_no_step_to_undo(table: Table, tmp_path: Path) -> None:
    folder = made(table, tmp_path, table.services.today())
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    before = (folder / "place.json").read_bytes()
    shelf.edit(folder, " Arcade ", " , ", "")
    shelf.edit(folder, " ", "", "\0")
    assert (folder / "place.json").read_bytes() == before
    assert not table.services.undo.undo_words


def test_what_is_too_long_is_bounded(table: Table, tmp_path: Path) -> None:
    folder = made(table, tmp_path, table.services.today())
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    tags = ",".join(f"{n} " + "x" * 500 for n in range(40))
    shelf.edit(folder, "z" * 500, tags, "y" * (LONGEST_NOTES + 5))
    place = read_place(folder)
    assert len(place.name) == LONGEST_NAME
    assert len(place.tags) == MOST_TAGS
    assert max(map(len, place.tags)) == LONGEST_TAG
    assert len(place.notes) == LONGEST_NOTES
    assert row(shelf, folder).trouble  # only that nothing was measured there
    assert "Unfinished" in row(shelf, folder).detail


def test_at_most_six_are_picked_and_one_that_went_is_picked_no_more(
    table: Table, tmp_path: Path
) -> None:
    now = table.services.today()
    folders = [made(table, tmp_path, now - timedelta(hours=n), f"p{n}") for n in range(8)]
    for folder in folders:
        (folder / "environment-0.exr").write_bytes(b"light")
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    shelf.pick(folders[2])
    shelf.pick(folders[0])
    assert shelf.resolve().picks == (folders[2], folders[0])
    shelf.pick(folders[2])
    assert shelf.resolve().picks == (folders[0],)
    shelf.pick(*folders)
    assert shelf.resolve().picks == tuple(folders[:MOST_SPOTS])
    assert not shelf.resolve().can_pick
    shelf.delete(folders[1])
    shelf.refresh()
    assert folders[1] not in shelf.resolve().picks
    shelf.pick()
    assert shelf.resolve().picks == ()


def test_an_interrupted_capture_says_how_many_frames_there_are_and_is_resumed(
    table: Table, tmp_path: Path
) -> None:
    folder = made(table, tmp_path, table.services.today())
    session = Session.create(folder / "capture")
    shots = tuple(PlannedShot(Exposure(0.1, 100.0, 2.1), float(n), 0.0) for n in range(6))
    url = "http://192.168.1.1/files/R{n}.JPG"
    frames = [
        SessionFrame(
            f"R{n}.JPG", url.format(n=n), 9, local=f"R{n}.JPG", sha256="ab" * 32, done=True
        )
        for n in range(4)
    ]
    frames.append(SessionFrame("R4.JPG", url.format(n=4), 9))
    session.update(stage="downloading", plan=Plan("full", shots, 12.5, ()), frames=tuple(frames))
    shelf = PlacesListPresenter(table.services, table.desk)
    found = row(shelf, folder)
    assert found.detail == "Unfinished: 4 of 6 frames"
    assert found.unfinished is not None
    assert not found.can_compare
    resumed = MagicMock()
    table.desk.finisher = resumed
    shelf.open(folder)
    (left,) = resumed.call_args.args
    assert (left.folder, left.here, left.total) == (folder, 4, 6)


def test_row_of_a_place_has_the_verdict_that_probe_shows(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    model, folder = table.model, table.model.place_folder
    assert folder is not None
    assert model.light is not None
    shelf = PlacesListPresenter(table.services, table.desk)
    for front in (0.0, 120.0):
        table.desk.change("front", front_deg=front)
        assert table.desk.keep_all()
        verdict = place_verdict(model.results, model.light.searched, model.front_deg)
        assert verdict is not None
        assert row(shelf, folder).detail == place_verdict_words(verdict, model.results)


def test_row_of_an_older_place_has_its_styles_until_it_is_opened(
    table: Table, tmp_path: Path
) -> None:
    table.desk.open_paths([SCENE])
    model, folder = table.model, table.model.place_folder
    assert folder is not None
    assert model.light is not None
    assert table.desk.keep_all()
    shelf = PlacesListPresenter(table.services, table.desk)
    whole = row(shelf, folder).detail
    light = light_sentence(light_flow(model.light.searched, model.front_deg))
    assert whole.startswith(light)
    table.desk.close()
    file = folder / "place.json"
    facts = json.loads(file.read_text("utf-8"))
    del facts["flow"]
    file.write_text(json.dumps(facts), "utf-8")
    assert row(shelf, folder).detail == whole.removeprefix(f"{light} ")
    shelf.open(folder)
    assert table.desk.keep_all()
    assert row(shelf, folder).detail == whole


def test_row_of_a_place_without_results_has_no_verdict(table: Table, tmp_path: Path) -> None:
    folder = made(table, tmp_path, table.services.today())
    (folder / "environment-0.exr").write_bytes(b"light")
    file = folder / "place.json"
    facts = json.loads(file.read_text("utf-8")) | {"environment": "environment-0.exr"}
    file.write_text(json.dumps(facts), "utf-8")
    shelf = PlacesListPresenter(table.services, table.desk)
    assert row(shelf, folder).detail == ""
    own = {"name": "mine", "title": "Mine", "attainable": True, "match": 90.0, "grade": "yes"}
    file.write_text(json.dumps(facts | {"results": [own]}), "utf-8")
    summary = summarise(folder)
    assert summary is not None
    assert [one.name for one in summary.answers] == ["mine"]
    assert verdict_of(summary.answers, None) is None
    loop = own | {"name": NAMES[0], "title": "Loop"}
    file.write_text(json.dumps(facts | {"results": [own, loop]}), "utf-8")
    summary = summarise(folder)
    assert summary is not None
    verdict = verdict_of(summary.answers, None)
    assert verdict is not None
    assert "loop" in place_verdict_words(verdict, summary.answers)
