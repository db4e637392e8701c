"""A watched folder: whole files only, brackets only, nothing changed, nothing followed."""

from __future__ import annotations

import contextlib
import functools
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import cv2
import numpy as np
import pytest

from app.commands import capture
from app.core.base.atomic_files import open_file
from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import read_header
from app.devices.clock import VirtualClock
from app.devices.errors import CaptureFailed, Unreachable
from app.devices.simulated.cameras import THETA_V, THETA_Z1, CameraModel
from app.devices.watched_folder import arrival, incoming_bracket, watch
from app.devices.watched_folder.arrival import TOO_LARGE, UNTIMED
from app.devices.watched_folder.incoming_bracket import ALONE, QUIET, SAME_EXPOSURE, IncomingBracket
from app.devices.watched_folder.watch import LINK, WatchedFolder
from benchmarks.light.shots.brackets import write_bracket

LIGHT = np.full((16, 32, 3), 200.0, np.float32)
SHUTTERS = (1 / 60, 1 / 15, 1 / 250)


def shot(
    folder: Path,
    shutters: tuple[float, ...] = SHUTTERS,
    *,
    first: int = 1,
    taken: str = "2026:06:21 12:00:00",
    camera: CameraModel = THETA_V,
    shape: tuple[int, int] = (16, 32),
) -> list[Path]:
    exposures = [Exposure(shutter, 100.0, camera.apertures[0]) for shutter in shutters]
    return write_bracket(
        folder, LIGHT, camera, exposures, first=first, date_time=taken, shape=shape, seed=first
    )


class Scenario:
    """A folder whose contents change at given times of a virtual clock."""

    def __init__(self, folder: Path, **options: Any) -> None:
        self.folder = folder
        folder.mkdir(exist_ok=True)
        self.clock = VirtualClock()
        self.token = Token()
        self.events: list[tuple[float, Callable[[], object]]] = []
        self.options = options

    def at(self, seconds: float, act: Callable[[], object]) -> Scenario:
        self.events.append((seconds, act))
        return self

    def run(self, until_s: float = 200.0) -> list[tuple[float, IncomingBracket]]:
        """Watch until a time; when each bracket came, and what it was."""
        self.events.append((until_s, self.token.cancel))
        self.events.sort(key=lambda event: event[0])
        scenario = self

        class Clock(VirtualClock):
            def sleep(self, seconds: float) -> None:
                super().sleep(seconds)
                while scenario.events and scenario.events[0][0] <= self.now():
                    scenario.events.pop(0)[1]()

        clock = Clock()
        self.watched = WatchedFolder(self.folder, clock, **self.options)
        brackets = self.watched.brackets(self.token)
        found: list[tuple[float, IncomingBracket]] = []
        with contextlib.suppress(Cancelled):
            while True:
                bracket = next(brackets)
                found.append((clock.now(), bracket))
        return found


def names(bracket: IncomingBracket) -> list[str]:
    return [path.name for path in bracket.paths]


def tree(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {
        path.name: (path.read_bytes(), path.stat().st_mtime_ns)
        for path in folder.iterdir()
        if path.is_file()
    }


def speeds(bracket: IncomingBracket) -> list[int]:
    found = [read_header(path).shutter_s for path in bracket.paths]
    return [round(1 / shutter_s) for shutter_s in found if shutter_s]


def test_a_bracket_comes_whole_and_in_the_order_of_shooting(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    scenario = Scenario(folder).at(5.0, lambda: shot(folder))
    ((when, bracket),) = scenario.run()
    assert names(bracket) == ["R0010001.JPG", "R0010002.JPG", "R0010003.JPG"]
    assert speeds(bracket) == [60, 15, 250]
    assert bracket.reasons == (QUIET.format(seconds=20),)
    # still for 2 s, then quiet for 20 s, and the steps of looking
    assert 5.0 + 2.0 + 20.0 <= when <= 5.0 + 2.0 + 20.0 + 1.5
    assert tuple(scenario.watched._notes) == ()


def test_times_are_chosen(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    scenario = Scenario(folder, quiet_s=6.0, still_s=0.5).at(5.0, lambda: shot(folder))
    ((when, bracket),) = scenario.run()
    assert 11.5 <= when <= 13.0
    assert bracket.reasons == (QUIET.format(seconds=6),)


def test_originals_are_only_read(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    before: dict[str, tuple[bytes, int]] = {}

    def come() -> None:
        shot(folder)
        for path in folder.iterdir():
            path.chmod(0o444)
        before.update(tree(folder))

    assert len(Scenario(folder).at(1.0, come).run()) == 1
    assert tree(folder) == before
    assert len(before) == 3


def test_frames_that_come_one_by_one_are_one_bracket(tmp_path: Path) -> None:
    folder, store = tmp_path / "in", tmp_path / "store"
    files = shot(store)
    scenario = Scenario(folder)
    for k, file in enumerate(files):
        scenario.at(3.0 + 15.0 * k, functools.partial(shutil.copy2, file, folder))
    ((when, bracket),) = scenario.run()
    assert len(bracket.paths) == 3
    assert when >= 33.0 + 22.0


def test_two_brackets_in_a_row(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    scenario = Scenario(folder)
    scenario.at(1.0, lambda: shot(folder))
    scenario.at(60.0, lambda: shot(folder, first=4, taken="2026:06:21 12:01:00"))
    (_, one), (_, two) = scenario.run()
    assert names(one) == ["R0010001.JPG", "R0010002.JPG", "R0010003.JPG"]
    assert names(two) == ["R0010004.JPG", "R0010005.JPG", "R0010006.JPG"]


def test_two_brackets_at_once_are_told_apart_by_repeated_exposures(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        shot(folder)
        shot(folder, first=4, taken="2026:06:21 12:00:12")  # within the quiet time

    (_, one), (_, two) = Scenario(folder).at(1.0, come).run()
    assert names(one) == ["R0010001.JPG", "R0010002.JPG", "R0010003.JPG"]
    assert names(two) == ["R0010004.JPG", "R0010005.JPG", "R0010006.JPG"]
    assert one.reasons == (SAME_EXPOSURE.format(name="R0010004.JPG", other="R0010001.JPG"),)


def test_two_brackets_at_once_are_told_apart_by_the_time_between_them(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        shot(folder)
        shot(folder, (1 / 50, 1 / 12, 1 / 200), first=4, taken="2026:06:21 12:05:00")

    (_, one), (_, two) = Scenario(folder).at(1.0, come).run()
    assert len(one.paths) == len(two.paths) == 3
    assert "and the other frames were taken" in one.reasons[0]


def test_long_exposures_are_no_gap(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    # 60 s of exposure, and as long again for the dark picture, lie between the time stamps.
    scenario = Scenario(folder).at(1.0, lambda: shot(folder, (15.0, 60.0, 4.0)))
    ((_, bracket),) = scenario.run()
    assert len(bracket.paths) == 3


def test_cameras_and_sizes_are_kept_apart(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        shot(folder)
        shot(folder, first=10, camera=THETA_Z1)
        shot(folder, first=20, shape=(32, 64))
        shot(folder, (1 / 30,), first=30, shape=(8, 16))

    scenario = Scenario(folder).at(1.0, come)
    found = [names(bracket) for _, bracket in scenario.run()]
    assert sorted(found) == [
        ["R0010001.JPG", "R0010002.JPG", "R0010003.JPG"],
        ["R0010010.JPG", "R0010011.JPG", "R0010012.JPG"],
        ["R0010020.JPG", "R0010021.JPG", "R0010022.JPG"],
    ]
    assert tuple(scenario.watched._notes) == (ALONE.format(name="R0010030.JPG"),)


def test_equal_exposures_are_no_bracket(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    scenario = Scenario(folder).at(1.0, lambda: shot(folder, (1 / 60, 1 / 60, 1 / 60)))
    assert scenario.run() == []
    assert len(tuple(scenario.watched._notes)) == 3


def test_a_copy_does_not_split_a_bracket(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        first = shot(folder)[0]
        shutil.copy2(first, folder / "R0010001 copy.JPG")

    scenario = Scenario(folder).at(1.0, come)
    ((_, bracket),) = scenario.run()
    assert len(bracket.paths) == 3
    (note,) = tuple(scenario.watched._notes)
    assert "is a copy of" in note


def test_a_partial_file_is_waited_for(tmp_path: Path) -> None:
    folder, store = tmp_path / "in", tmp_path / "store"
    files = shot(store)
    data = files[2].read_bytes()
    last = folder / files[2].name
    scenario = Scenario(folder)
    scenario.at(1.0, lambda: [shutil.copy2(file, folder) for file in files[:2]])
    for k in range(1, 60):  # a slow link: a minute for one file
        scenario.at(1.0 + k, functools.partial(last.write_bytes, data[: len(data) * k // 60]))
    scenario.at(61.0, lambda: last.write_bytes(data))
    ((when, bracket),) = scenario.run()
    assert len(bracket.paths) == 3
    assert when >= 61.0 + 2.0 + 20.0
    assert tuple(scenario.watched._notes) == ()


def test_a_file_that_stays_cut_off_is_said_and_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        last = shot(folder)[-1]
        last.write_bytes(last.read_bytes()[:-40])

    scenario = Scenario(folder).at(1.0, come)
    ((_, bracket),) = scenario.run()
    assert names(bracket) == ["R0010001.JPG", "R0010002.JPG"]
    (note,) = tuple(scenario.watched._notes)
    assert note.startswith("R0010003.JPG is damaged or incomplete")


def test_a_stalled_copy_that_goes_on_is_taken_after_all(tmp_path: Path) -> None:
    folder, store = tmp_path / "in", tmp_path / "store"
    files = shot(store)
    data = files[2].read_bytes()
    last = folder / files[2].name
    scenario = Scenario(folder)
    scenario.at(1.0, lambda: [shutil.copy2(file, folder) for file in files[:2]])
    scenario.at(2.0, lambda: last.write_bytes(data[:300]))
    scenario.at(15.0, lambda: last.write_bytes(data))
    ((_, bracket),) = scenario.run()
    assert len(bracket.paths) == 3


def test_a_file_that_grows_for_ever_does_not_hold_a_bracket_for_ever(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    endless = folder / "endless.jpg"

    def grow() -> None:
        with endless.open("ab") as stream:
            stream.write(b"\xff\xd8\xff" + b"x" * 100)

    scenario = Scenario(folder).at(1.0, lambda: shot(folder))
    for k in range(400):
        scenario.at(1.0 + k, grow)
    ((when, bracket),) = scenario.run(390.0)
    assert len(bracket.paths) == 3
    assert when < 200.0


def test_a_file_that_changes_is_taken_as_it_is_then(tmp_path: Path) -> None:
    folder, store = tmp_path / "in", tmp_path / "store"
    shot(store, first=3, shutters=(1 / 1000,), taken="2026:06:21 12:00:08")
    scenario = Scenario(folder).at(1.0, lambda: shot(folder))
    scenario.at(10.0, lambda: shutil.copy(store / "R0010003.JPG", folder))
    ((_, bracket),) = scenario.run()
    assert speeds(bracket) == [60, 15, 1000]


def test_a_file_that_is_removed_is_forgotten(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    scenario = Scenario(folder).at(1.0, lambda: shot(folder))
    scenario.at(10.0, (folder / "R0010002.JPG").unlink)
    ((_, bracket),) = scenario.run()
    assert names(bracket) == ["R0010001.JPG", "R0010003.JPG"]


def test_what_was_there_before_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    shot(folder)
    scenario = Scenario(folder)
    scenario.at(5.0, lambda: shot(folder, first=4, taken="2026:06:21 13:00:00"))
    ((_, bracket),) = scenario.run()
    assert names(bracket) == ["R0010004.JPG", "R0010005.JPG", "R0010006.JPG"]
    (note,) = scenario.watched._notes
    assert note.startswith("3 files ")


def test_other_formats_count_when_they_can_be_read_to_the_end(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        noise = np.random.default_rng(1).integers(0, 255, (64, 128, 3), np.uint8)
        good, data = cv2.imencode(".png", noise)
        assert good
        (folder / "whole.png").write_bytes(data.tobytes())
        (folder / "cut.png").write_bytes(data.tobytes()[:-2000])

    scenario = Scenario(folder).at(1.0, come)
    assert scenario.run() == []
    cut, whole = sorted(scenario.watched._notes)
    assert cut.startswith("cut.png is damaged or incomplete")
    assert whole == UNTIMED.format(name="whole.png")


def test_hostile_and_foreign_names(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        (source,) = shot(tmp_path / "store", (1 / 500,))
        for name in (
            ".hidden.jpg",
            "._R0010001.JPG",
            "R0010009.JPG.part",
            "~R0010009.JPG",
            "R0010009.jpg~",
            "R0010009.JPG.crdownload",
            "evil\x1b[2J.jpg",
            "two\nlines.jpg",
            os.fsdecode(b"\xff\xfe.jpg"),
            "movie.mp4",
            "raw.DNG",
            "README",
        ):
            shutil.copy2(source, folder / name)
        (folder / "empty.jpg").write_bytes(b"")
        (folder / "text.jpg").write_text("no picture", "utf-8")
        (folder / "folder.jpg").mkdir()
        shot(folder / "folder.jpg")
        shot(folder / "sub")
        shot(folder)

    scenario = Scenario(folder).at(1.0, come)
    ((_, bracket),) = scenario.run()
    assert names(bracket) == ["R0010001.JPG", "R0010002.JPG", "R0010003.JPG"]
    notes = tuple(scenario.watched._notes)
    assert all(note.isprintable() for note in notes)
    text = "\n".join(notes)
    for word in (".mp4", ".dng", "empty.jpg is empty", "text.jpg is not", "control"):
        assert word in text, word
    for word in ("hidden", "part", "crdownload", "README", "sub"):
        assert word not in text, word


@pytest.mark.skipif(os.name != "posix", reason="links and pipes as POSIX has them")
def test_links_and_pipes_are_not_followed(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    (secret,) = shot(tmp_path / "elsewhere", (1 / 500,))

    def come() -> None:
        shot(folder)
        (folder / "link.jpg").symlink_to(secret)
        (folder / "dangling.jpg").symlink_to(tmp_path / "nothing")
        (folder / "loop.jpg").symlink_to(folder / "loop.jpg")
        os.mkfifo(folder / "pipe.jpg")

    scenario = Scenario(folder).at(1.0, come)
    ((_, bracket),) = scenario.run()
    assert len(bracket.paths) == 3
    assert sorted(scenario.watched._notes) == [
        LINK.format(name=name) for name in ("dangling.jpg", "link.jpg", "loop.jpg")
    ]


@pytest.mark.skipif(os.name != "posix", reason="permissions as POSIX has them")
def test_a_file_that_may_not_be_read_is_taken_when_it_may(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "in"
    shut = folder / "R0010003.JPG"

    # The superuser may read everything, so the refusal is made here as well.
    def opened(path: Path) -> BinaryIO:
        if path == shut and not shut.stat().st_mode & 0o400:
            raise PermissionError(13, "Permission denied", str(path))
        return open_file(path)

    monkeypatch.setattr("app.devices.watched_folder.arrival.open_file", opened)
    scenario = Scenario(folder).at(1.0, lambda: shot(folder)).at(1.0, lambda: shut.chmod(0))
    scenario.at(12.0, lambda: shut.chmod(0o644))
    ((_, bracket),) = scenario.run()
    assert len(bracket.paths) == 3
    (note,) = scenario.watched._notes
    assert note.startswith("R0010003.JPG ")
    assert "permission denied" in note


def test_a_folder_that_is_missing_or_none(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("x", "utf-8")
    for place in (tmp_path / "nothing", file):
        with pytest.raises(Unreachable, match="cannot be read") as caught:
            WatchedFolder(place, VirtualClock())
        assert caught.value.code == "no-folder"


def test_a_folder_that_is_gone_for_a_while_is_waited_for(tmp_path: Path) -> None:
    folder, away = tmp_path / "in", tmp_path / "away"
    scenario = Scenario(folder)
    scenario.at(5.0, lambda: folder.rename(away))
    scenario.at(25.0, lambda: away.rename(folder))
    scenario.at(26.0, lambda: shot(folder))
    assert len(scenario.run()) == 1


def test_a_folder_that_stays_away_ends_the_watch(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    clock = VirtualClock()
    watched = WatchedFolder(folder, clock)
    folder.rmdir()
    with pytest.raises(Unreachable, match="cable or card"):
        next(watched.brackets())
    assert 30.0 < clock.now() < 32.0


def test_too_many_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "MAX_FILES", 3)
    for k in range(4):
        (tmp_path / f"{k}.txt").touch()
    with pytest.raises(CaptureFailed, match="more than 3 files"):
        WatchedFolder(tmp_path, VirtualClock())


def test_a_file_too_large_for_a_picture_is_never_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "in"
    monkeypatch.setattr(arrival, "MAX_BYTES", 1000)
    scenario = Scenario(folder).at(1.0, lambda: (folder / "huge.jpg").write_bytes(b"x" * 1001))
    assert scenario.run(20.0) == []
    assert tuple(scenario.watched._notes) == (TOO_LARGE.format(name="huge.jpg"),)


def test_a_flood_of_notes_is_bounded(tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        for k in range(300):
            (folder / f"{k}.jpg").write_text("x", "utf-8")

    scenario = Scenario(folder).at(1.0, come)
    assert scenario.run(20.0) == []
    assert len(tuple(scenario.watched._notes)) == 200


def test_more_frames_than_a_bracket_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(incoming_bracket, "MAX_FRAMES", 3)
    folder = tmp_path / "in"
    scenario = Scenario(folder)
    scenario.at(1.0, lambda: shot(folder, tuple(2.0**-k for k in range(5))))
    assert [len(bracket.paths) for _, bracket in scenario.run()] == [3, 2]


@pytest.mark.parametrize("start", ["IMG_", "²"])
def test_numbers_in_names_are_counted_not_spelled(start: str, tmp_path: Path) -> None:
    folder = tmp_path / "in"

    def come() -> None:
        for k, file in enumerate(shot(tmp_path / "store")):
            data = file.read_bytes().replace(b"2026:06:21 12:00:", b"0000:00:00 00:00:")
            (folder / f"{start}{9 + k}.jpg").write_bytes(data)
            os.utime(folder / f"{start}{9 + k}.jpg", (1e9, 1e9))

    ((_, bracket),) = Scenario(folder).at(1.0, come).run()
    assert names(bracket) == [f"{start}{9 + k}.jpg" for k in range(3)]


def test_poll_gives_each_picture_once(tmp_path: Path) -> None:
    clock = VirtualClock()
    watched = WatchedFolder(tmp_path, clock)
    shot(tmp_path)

    def polls() -> Iterator[int]:
        for _ in range(8):
            yield len(watched.poll())
            clock.sleep(1.0)

    assert list(polls()) == [0, 0, 3, 0, 0, 0, 0, 0]


def test_cancelling_before_anything(tmp_path: Path) -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        next(WatchedFolder(tmp_path, VirtualClock()).brackets(token))


def test_what_is_passed_over_is_said_at_once_and_once(tmp_path: Path) -> None:
    (tmp_path / "old.jpg").write_bytes(b"x")
    said: list[str] = []
    watched = WatchedFolder(tmp_path, VirtualClock(), say=said.append)
    (note,) = said
    assert note.startswith("1 file ")
    (tmp_path / "new.cr3").write_bytes(b"x")
    for _ in range(2):
        watched.poll()
    assert len(said) == 2
    assert said[1].startswith("Files ending in .cr3 are skipped")
    assert tuple(said) == tuple(watched._notes)


def test_the_command_says_what_it_passes_over_while_it_waits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said: list[str] = []

    class Clock(VirtualClock):
        def sleep(self, seconds: float) -> None:
            super().sleep(seconds)
            (tmp_path / "new.cr3").write_bytes(b"x")
            said.append(capsys.readouterr().err)
            if self.now() > 5.0:
                token.cancel()

    token = Token()
    monkeypatch.setattr(capture, "SystemClock", Clock)
    with pytest.raises(Cancelled):
        capture._next_bracket(tmp_path, token)
    assert "Waiting for photos" in said[0]
    assert "".join(said).count(".cr3 are skipped") == 1
