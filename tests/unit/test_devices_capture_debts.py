"""What a capture could not put right on the camera, the next one puts right, from any folder."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import pytest

from app.devices.capture.session import Session
from app.devices.capture.unrestored_settings import FILE, Debts
from app.devices.errors import DeviceError
from app.devices.simulated.exchange import Reply, Request
from tests.faulty_camera.silence import NO_ANSWER
from tests.helpers.cameras import Rig
from tests.helpers.captures import (
    Weather,
    capture,
    rig,
    when,
    without_merging,
    without_waiting_for_the_disk,
)
from tests.helpers.simulated import stored


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    without_waiting_for_the_disk(monkeypatch)
    without_merging(monkeypatch)


@pytest.fixture
def debts(tmp_path: Path) -> Debts:
    return Debts(tmp_path / "home" / FILE)


def metering_pictures(made: Rig) -> list[str]:
    return [each.name for each in stored(made.camera) if each.take and each.take.program == 2]


def fail_for_good(made: Rig, debts: Debts, words: str = "startCapture") -> Weather:
    """Lose the camera in the middle, until after the end."""
    weather = Weather(made)
    when(made, words, lambda: weather.lose(1e6))
    with pytest.raises(DeviceError):
        capture(made, debts=debts).run()
    weather.lost_until = made.clock.now()
    return weather


def deaf_to(made: Rig, words: str) -> None:
    """Hear no request with these words."""
    answer = made.camera.answer

    def wrapped(request: Request) -> Reply:
        return NO_ANSWER if words in request.body.decode() else answer(request)

    made.camera.answer = wrapped  # type: ignore[method-assign]


def test_a_capture_in_another_folder_puts_back_what_the_last_one_owed(
    tmp_path: Path, debts: Debts
) -> None:
    made = rig(tmp_path)
    made.camera.store.set({"sleepDelay": 300})
    before = copy.deepcopy(made.camera.options)
    fail_for_good(made, debts)
    assert made.camera.options["sleepDelay"] == 65535
    first, made.folder = made.folder, tmp_path / "another"
    capture(made, debts=debts).run()
    assert made.camera.options == before
    assert not Session.open(first).owes
    assert debts.of(Session.open(first).journal.serial, Session.open(first)) == []


def test_without_a_link_at_the_end_the_next_contact_restores_and_deletes(
    tmp_path: Path, debts: Debts
) -> None:
    made = rig(tmp_path)
    before = copy.deepcopy(made.camera.options)
    answer = made.camera.answer
    deaf_to(made, "camera.delete")
    capture(made, debts=debts).run()
    assert len(metering_pictures(made)) == 1
    made.camera.answer = answer  # type: ignore[method-assign]
    made.folder = tmp_path / "another"
    capture(made, debts=debts).run()
    assert metering_pictures(made) == []
    assert len(made.deleted) == 2
    assert made.camera.options == before


def test_another_camera_gets_nothing_of_it(tmp_path: Path, debts: Debts) -> None:
    made = rig(tmp_path / "a")
    fail_for_good(made, debts)
    other = rig(tmp_path / "b", "Z1")
    before = copy.deepcopy(other.camera.options)
    capture(other, debts=debts).run()
    assert other.camera.options == before
    assert Session.open(made.folder).owes


def test_a_new_picture_of_the_same_name_is_not_deleted(tmp_path: Path, debts: Debts) -> None:
    made = rig(tmp_path)
    answer = made.camera.answer
    deaf_to(made, "camera.delete")
    capture(made, debts=debts).run()
    made.camera.answer = answer  # type: ignore[method-assign]
    owed = Session.open(made.folder).journal.picture_to_delete
    assert owed is not None
    # The card was emptied, and the camera counts from the beginning.
    file = next(each for each in made.camera.storage.files if each.name == owed.name)
    file.date_time = file.date_time.replace("2026", "2027")
    made.folder = tmp_path / "another"
    capture(made, debts=debts).run()
    assert owed.name in metering_pictures(made)
    assert made.deleted[-1].name != owed.name


def test_a_session_of_an_earlier_version_can_be_read(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "old")
    journal = session.folder / "session.json"
    text = journal.read_text(encoding="utf-8")
    assert '"picture_to_delete"' in text
    lines = [line for line in text.splitlines() if "picture_to_delete" not in line]
    journal.write_text("\n".join(lines), encoding="utf-8")
    assert Session.open(session.folder).journal == replace(session.journal, picture_to_delete=None)


@pytest.mark.parametrize(
    "text", ["", "no", "[]", '{"sessions": 7}', '{"sessions": [7, "x", "/nowhere", "\\u0000"]}']
)
def test_a_strange_file_is_as_none(tmp_path: Path, debts: Debts, text: str) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / FILE).write_text(text, encoding="utf-8")
    session = Session.create(tmp_path / "s")
    assert debts.of("1", session) == []
    debts.note(session)
    assert str(session.folder.resolve()) in (tmp_path / "home" / FILE).read_text(encoding="utf-8")
    debts.settle(session)
    assert str(session.folder.resolve()) not in (tmp_path / "home" / FILE).read_text("utf-8")
