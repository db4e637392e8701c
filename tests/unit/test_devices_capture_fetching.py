"""Bringing frames over when some of them cannot be had, on virtual time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from app.devices.capture import fetching
from app.devices.capture.reconnection import Contact
from app.devices.capture.session import Session
from app.devices.errors import DeviceError, DownloadFailed
from app.words.remarks import sentences
from tests.helpers.cameras import Rig
from tests.helpers.captures import rig, without_merging, without_waiting_for_the_disk
from tests.helpers.simulated import stored


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    without_waiting_for_the_disk(monkeypatch)
    without_merging(monkeypatch)


@pytest.fixture
def reconnected(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """When the camera was looked for as if the link had broken, before its settings went back."""
    times: list[float] = []

    def reconnect(contact: Contact) -> None:
        if contact.token is not None:
            times.append(contact.clock.now())

    monkeypatch.setattr(Contact, "reconnect", reconnect)
    return times


def spoil(made: Rig, *places: int, cut: bool = False) -> None:
    """Damage files of the bracket on the camera's own storage."""
    for place in places:
        file = stored(made.camera)[place]
        half = len(file.data) // 2
        file._renditions["file"] = file.data[:half] + bytes(0 if cut else len(file.data) - half)


def before_fetching(monkeypatch: pytest.MonkeyPatch, act: Callable[[], None]) -> None:
    def instead(*args: Any) -> dict[str, Path]:
        act()
        return {}

    monkeypatch.setattr(fetching, "fetch_thumbnails", instead)


@pytest.mark.parametrize("cut", [False, True])
def test_a_damaged_file_does_not_keep_the_others_from_being_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reconnected: list[float], cut: bool
) -> None:
    made = rig(tmp_path, "A1")
    before_fetching(monkeypatch, lambda: spoil(made, 1, cut=cut))
    result = made.shoot("full")
    shots = len(result.plan.shots)
    name = stored(made.camera)[1].name
    frames = Session.open(made.folder).journal.frames
    assert [frame.name for frame in frames if not frame.done] == [name]
    assert len(frames) == shots
    assert len(result.frames) == shots - 1
    assert all(path.exists() for path in result.frames)
    words = f"{name} could not be downloaded; only {shots - 1} of {shots} exposures"
    assert any(line.startswith(words) for line in sentences(result.warnings))
    assert not reconnected


def test_a_picture_that_only_decoding_finds_damaged_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rig(tmp_path, "A1")

    def scratch() -> None:
        file = stored(made.camera)[2]
        place = file.data.index(b"\xff\xc0") + 5  # its height
        file._renditions["file"] = file.data[:place] + b"\x20\x00" + file.data[place + 2 :]

    before_fetching(monkeypatch, scratch)
    result = made.shoot("full")
    assert len(result.frames) == len(result.plan.shots) - 1
    assert list((made.folder / "originals").glob("*.damaged"))


def test_too_few_whole_files_are_a_failure_but_all_were_fetched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rig(tmp_path)
    before_fetching(monkeypatch, lambda: spoil(made, 0))
    with pytest.raises(DownloadFailed, match="damaged"):
        made.shoot()
    assert [frame.done for frame in Session.open(made.folder).journal.frames] == [
        False,
        True,
        True,
    ]


def test_a_file_that_is_gone_from_the_camera_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rig(tmp_path, "A1")
    before_fetching(monkeypatch, lambda: made.camera.storage.files.__delitem__(0))
    result = made.shoot("full")
    assert len(result.frames) == len(result.plan.shots) - 1


@pytest.mark.parametrize("code", ["disk-full", "disk"])
def test_a_full_disk_is_no_lost_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reconnected: list[float], code: str
) -> None:
    tried: list[object] = []

    def full(client: object, entry: object, *rest: Any, **how: Any) -> Path:
        tried.append(entry)
        raise DownloadFailed("The disk is full.", "Make room.", code)

    monkeypatch.setattr(fetching, "fetch_file", full)
    made = rig(tmp_path)
    with pytest.raises(DownloadFailed, match="disk is full"):
        made.shoot()
    assert len(tried) == 1
    assert not reconnected


@pytest.mark.parametrize(("code", "files"), [("interrupted", 1), ("bad-answers", 3)])
def test_a_link_that_does_not_last_is_tried_again(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    reconnected: list[float],
    code: str,
    files: int,
) -> None:
    def broken(client: object, entry: object, *rest: Any, **how: Any) -> Path:
        raise DownloadFailed("It broke.", "Stay near.", code)

    monkeypatch.setattr(fetching, "fetch_file", broken)
    made = rig(tmp_path)
    with pytest.raises(DeviceError, match="It broke"):
        made.shoot()
    assert len(reconnected) == 2 * files
