"""Places on disks that take nothing: shown all the same, said once, and kept elsewhere."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.base import atomic_files as files
from app.core.base.atomic_files import DiskTrouble
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_png
from app.core.base.paths import resources
from app.core.places import resume
from app.core.places.files.light import read_light
from app.core.places.place_folder import read_place
from app.core.places.place_list import list_places
from app.core.places.resume import list_unfinished
from app.core.storage.settings import Settings
from app.core.styles.styles import NAMES
from app.ui.presenters.places_list import NO_FRAMES, PlacesListPresenter
from app.ui.presenters.saving import TROUBLE_WORDS, disk_words
from app.ui.presenters.window_frame import FramePresenter
from app.ui.presenters.window_model import Step
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.styles_screen import HoldingRunner, Table, on_time

SCENE = resources() / "demo" / "scenes" / "studio.exr"


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return on_time(Table(tmp_path, ImmediateRunner()))


def refuse(patch: pytest.MonkeyPatch, below: Path, code: int) -> None:
    """Make the disk refuse whatever is flushed to a file below a folder."""
    flush = files._flush

    def full(path: Path) -> None:
        if below in path.parents:
            raise OSError(code, os.strerror(code))
        flush(path)

    patch.setattr(files, "_flush", full)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (errno.ENOSPC, "the disk is full"),
        (errno.EDQUOT, "the disk is full"),
        (errno.EROFS, "its folder is write-protected"),
        (errno.EACCES, "its folder is write-protected"),
    ],
)
def test_a_dropped_panorama_is_solved_and_shown_though_nothing_can_be_kept(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, words: str
) -> None:
    frame = FramePresenter(table.services)
    with monkeypatch.context() as patch:
        refuse(patch, tmp_path / "places", code)
        table.desk.open_paths([SCENE])
        model = table.model
        assert model.light is not None
        assert len(model.results) == len(NAMES)
        (told,) = table.told.messages
        assert told.startswith(f"“studio” is not saved: {words}.")
        assert str(tmp_path) not in told
        assert frame.resolve().status == f"This place is not saved: {words}."
        assert list_places(tmp_path / "places") == ()
        assert not table.desk.keep_all()
        # Another folder takes it, with everything that was worked out.
        table.desk.saving.folder_asker = lambda title: tmp_path / "elsewhere"
        table.told.buttons["Save elsewhere…"]()
    (kept,) = list_places(tmp_path / "elsewhere")
    assert model.place_folder == kept.folder
    assert frame.resolve().status == "Place saved."
    assert table.desk.keep_all()
    place = read_place(kept.folder)
    assert len(place.results) == len(NAMES)
    light, remarks = read_light(kept.folder, place)
    assert remarks == ()
    assert np.array_equal(light.radiance, model.light.environment.radiance)


def test_once_there_is_room_it_is_kept_where_it_belongs(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        refuse(patch, tmp_path / "places", errno.ENOSPC)
        table.desk.open_paths([SCENE])
    table.told.buttons["Try again"]()
    assert len(list_places(tmp_path / "places")) == 1
    assert table.model.unkept == ""


def test_changes_that_are_not_kept_leave_the_old_file_whole(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table.desk.open_paths([SCENE])
    folder = table.model.place_folder
    assert folder is not None
    before = (folder / "place.json").read_bytes()
    with monkeypatch.context() as patch:
        refuse(patch, folder, errno.ENOSPC)
        table.desk.change("rename", name="Another name")
        message = table.told.messages[-1]
        assert "“Another name”" in message
        assert f": {TROUBLE_WORDS[DiskTrouble.FULL]}." in message
        assert (folder / "place.json").read_bytes() == before
        assert sorted(each.name for each in folder.iterdir() if each.name.startswith(".")) == []
        assert table.model.unkept
    table.told.buttons["Try again"]()
    assert read_place(folder).name == "Another name"
    assert table.model.unkept == ""


def test_a_place_that_is_only_looked_at_is_not_written(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table.desk.open_paths([SCENE])
    folder = table.model.place_folder
    assert folder is not None
    # As on a disk that is read only: nobody has changed anything, and nothing is said.
    again = on_time(Table(tmp_path, ImmediateRunner()))
    with monkeypatch.context() as patch:
        refuse(patch, folder, errno.EROFS)
        again.desk.open_place(folder)
        assert len(again.model.results) == len(NAMES)
        assert again.told.messages == []
        again.desk.change("rename", name="Another name")
        assert "is write-protected" in again.told.messages[-1]
    again.desk.change("rename", name="studio")
    again.desk.change("rename", name="Another name")
    assert read_place(folder).name == "Another name"


def test_a_message_names_what_is_wrong_and_no_temporary_file() -> None:
    wrapped = CoreError("Cannot write /home/a/.place-x7.json.")
    wrapped.__cause__ = OSError(errno.EFBIG, "File too large")
    assert disk_words(wrapped) == TROUBLE_WORDS[DiskTrouble.FULL]
    assert disk_words(CoreError("A part of this is damaged.")) == ""


# -- unfinished ------------------------------------------------------------------------------------


def half_a_place(table: Table, tmp_path: Path) -> Path:
    """A place whose photographs were copied when the program was killed."""
    from app.core.places.files.originals import adopt_files
    from app.core.places.place_folder import create_place

    rng = np.random.default_rng(3)
    frames = []
    for number in range(3):
        frames.append(tmp_path / f"frame{number}.png")
        write_png(frames[-1], rng.integers(0, 255, (64, 128, 3), np.uint8))
    folder = create_place(tmp_path / "places", "By the window", table.services.today())
    adopt_files(folder, frames)
    return folder


def test_a_place_that_was_killed_over_its_photographs_says_so_and_can_be_deleted(
    table: Table, tmp_path: Path
) -> None:
    folder = half_a_place(table, tmp_path)
    (left,) = list_unfinished(tmp_path / "places")
    assert (left.folder, left.session, len(left.files)) == (folder, None, 3)
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    (row,) = shelf.resolve().rows
    assert row.detail == "Unfinished: 3 photos"
    assert row.trouble
    shelf.delete(folder)
    shelf.refresh()
    assert shelf.resolve().rows == ()


def test_finishing_it_merges_what_is_there(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = half_a_place(table, tmp_path)
    table.desk.open_paths([SCENE])
    light = table.model.light
    assert light is not None
    from app.core.places.place import CaptureFacts, Location
    from app.core.places.place_measurement import MeasuredLight

    asked: list[Any] = []

    def measured(intake: Any, limits: Any, token: Any, report: Any) -> Any:
        asked.extend(intake.files)
        return MeasuredLight(light, Location(), CaptureFacts(plan="files"))

    monkeypatch.setattr(resume, "measure_intake", measured)
    # Opened from a list or by its folder it says what is missing, and offers to finish it.
    table.desk.open_place(folder)
    assert table.model.place_folder != folder
    table.told.buttons["Finish it"]()
    assert table.model.place_folder == folder
    assert [path.parent.name for path in asked] == ["originals"] * 3
    assert read_place(folder).environment
    assert list_unfinished(tmp_path / "places") == ()


def test_an_empty_folder_of_a_place_can_only_be_deleted(table: Table, tmp_path: Path) -> None:
    from app.core.places.place_folder import create_place

    create_place(tmp_path / "places", "Nothing yet", table.services.today())
    shelf = PlacesListPresenter(table.services, table.desk)
    shelf.refresh()
    (row,) = shelf.resolve().rows
    assert row.detail == NO_FRAMES
    assert row.unfinished is not None
    assert not row.unfinished.can_finish
    assert list_unfinished(tmp_path / "places") == ()


# -- the start -------------------------------------------------------------------------------------


def begun(tmp_path: Path, runner: Any = None, **settings: Any) -> Table:
    table = on_time(Table(tmp_path, runner or ImmediateRunner()))
    table.model.update(settings=Settings(**settings))
    table.desk.begin(reopen=True)
    return table


def test_the_last_place_is_opened_again(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    first = table.model.place_folder
    assert first is not None
    table.desk.open_paths([SCENE])
    table.desk.open_place(first)
    last = table.model.settings.last_place
    assert last == str(first)
    assert begun(tmp_path, last_place=last).model.place_folder == first


def test_where_the_last_one_is_gone_the_newest_is_opened(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    again = begun(tmp_path, last_place=str(tmp_path / "gone"))
    assert again.model.place_folder == table.model.place_folder
    assert again.told.messages == []


def test_a_first_start_is_empty_and_says_nothing(tmp_path: Path) -> None:
    table = begun(tmp_path)
    assert (table.model.light, table.model.opening, table.told.messages) == (None, "", [])


def test_a_damaged_last_place_is_said_and_leaves_the_screen_empty(
    table: Table, tmp_path: Path
) -> None:
    table.desk.open_paths([SCENE])
    folder, place = table.model.place_folder, table.model.place
    assert folder is not None
    assert place is not None
    (folder / place.environment).write_bytes(b"not a picture")
    again = begun(tmp_path, last_place=str(folder))
    assert again.model.light is None
    assert again.model.opening == ""
    assert again.model.step is Step.PROBE
    assert len(again.told.messages) == 1


def test_while_it_is_read_the_screen_says_so(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    runner = HoldingRunner()
    runner.held.add("open")
    again = begun(tmp_path, runner, last_place=str(table.model.place_folder))
    assert again.model.opening == "the last place"
    runner.release("open")
    assert again.model.opening == ""
    assert again.model.light is not None


# -- a disk that really is full --------------------------------------------------------------------

_CHILD = """
import resource, signal, sys
from pathlib import Path
sys.path[:0] = [{root!r}]
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from tests.helpers.styles_screen import Table, on_time
from tests.helpers.immediate_runner import ImmediateRunner
home = Path({home!r})
table = on_time(Table(home, ImmediateRunner()))
# A panorama of 64 x 128 floats takes 100 kB.
resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
table.desk.open_paths([Path({scene!r})])
print(table.model.light is not None, len(table.model.results))
print(*table.told.messages, sep="\\n")
print(sorted(str(each.relative_to(home)) for each in home.rglob("*")))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
def test_a_limit_of_the_system_is_met_as_a_full_disk(tmp_path: Path) -> None:
    root, scene = Path(__file__).parents[2], tmp_path / "studio.exr"
    shutil.copy(SCENE, scene)
    home = tmp_path / "home"
    home.mkdir()
    code = _CHILD.format(root=str(root), home=str(home), scene=str(scene))
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=600, check=False
    )
    lines = done.stdout.splitlines()
    assert done.returncode == 0, done.stderr[-2000:]
    assert lines[0] == f"True {len(NAMES)}"
    assert lines[1].startswith("“studio” is not saved: the disk is full.")
    # Nothing half-written is left.
    assert lines[2] == "['places']"


def test_a_place_deleted_while_open_is_told_and_saved_again(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    model, saving = table.model, table.desk.saving
    folder, light = model.place_folder, model.light
    assert folder is not None
    assert light is not None
    saving.look()
    assert table.told.messages == []
    shutil.rmtree(folder)
    saving.look()
    saving.look()
    (told,) = table.told.messages
    assert told.startswith("“studio” is open but not on the disk")
    assert FramePresenter(table.services).resolve().status.startswith("This place is not saved")
    # Nothing has changed since it was read, and still it is not saved.
    assert not table.desk.keep_all()
    table.desk.change("rename", name="Another name")
    table.told.buttons["Save again"]()
    assert model.unkept == ""
    assert table.desk.keep_all()
    place = read_place(folder)
    assert (place.name, len(place.results), place.remarks) == ("Another name", len(NAMES), ())
    assert np.array_equal(read_light(folder, place)[0].radiance, light.environment.radiance)


def test_a_disk_that_is_unplugged_and_comes_back(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    folder = table.model.place_folder
    assert folder is not None
    folder.parent.rename(tmp_path / "unplugged")
    table.desk.change("rename", name="Another name")
    assert "Connect the disk and try again" in table.told.messages[-1]
    assert str(folder.parent) in table.told.messages[-1]
    assert not folder.parent.exists()
    (tmp_path / "unplugged").rename(folder.parent)
    table.desk.saving.look()
    assert table.model.unkept == ""
    assert read_place(folder).name == "Another name"


def test_a_forced_end_saves_a_place_whose_folder_is_gone(table: Table, tmp_path: Path) -> None:
    table.desk.open_paths([SCENE])
    folder = table.model.place_folder
    assert folder is not None
    shutil.rmtree(folder)
    assert not table.desk.keep_all()
    assert table.desk.saving.rescue()
    assert len(read_place(folder).results) == len(NAMES)
