"""Sessions: what is remembered, what is found again, what is left alone."""

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base.errors import CoreError
from app.core.base.remarks import PlainRemark
from app.core.measure.plan.planner import Plan, PlannedShot
from app.core.measure.plan.remarks import DarkestExposure
from app.core.measure.read.frame import Exposure
from app.core.places.journal import (
    JOURNAL,
    SessionFrame,
    SessionJournal,
    journal_of,
    keepable,
    text_of,
)
from app.core.storage.json_file import Unfit
from app.devices.capture.file_integrity import jpeg_end, sha256_of, whole_picture
from app.devices.capture.session import Session
from app.devices.theta.messages import FileEntry

PLAN = Plan(
    "paper",
    tuple(PlannedShot(Exposure(s, 100.0, 2.1), e, e) for s, e in ((0.1, 0.0), (0.4, 2.0))),
    12.5,
    (DarkestExposure(-1.5),),
)
FULL = SessionJournal(
    model="RICOH THETA Z1",
    serial="00105377",
    firmware="2.10.3",
    stage="downloading",
    metered=Exposure(0.1, 100.0, 2.1),
    plan=PLAN,
    settings_to_restore={"exposureProgram": 2, "sleepDelay": 180, "_filter": "off"},
    previous_latest="http://192.168.1.1/files/abc/100RICOH/R0010014.JPG",
    command_id=41,
    group_id="13b6",
    exposed=True,
    frames=(SessionFrame("R0010015.JPG", "http://192.168.1.1/files/100RICOH/R0010015.JPG", 9),),
    started="2026-11-21T13:00:00+01:00",
    seconds={"metering": 4.5},
    warnings=(PlainRemark("The compass is off."),),
)


def entry(number: int = 15, folder: int = 100, **changes: Any) -> FileEntry:
    name = f"R00100{number}.JPG"
    url = f"http://192.168.1.1/files/{folder}RICOH/{name}"
    return replace(FileEntry(name, url, date_time="2026:06:21 12:00:05+02:00"), **changes)


def picture(seed: int = 1, shape: tuple[int, int] = (64, 128)) -> bytes:
    codes = np.random.default_rng(seed).integers(0, 255, (*shape, 3), np.uint8)
    done, data = cv2.imencode(".jpg", codes)
    assert done
    return data.tobytes()


def test_everything_in_the_journal_comes_back_from_the_disk(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "place")
    session.update(**{name: getattr(FULL, name) for name in SessionJournal.__slots__})
    assert Session.open(tmp_path / "place").journal == FULL
    assert session.journal == FULL
    assert session.unfinished


def test_a_missing_or_empty_folder_becomes_a_session(tmp_path: Path) -> None:
    for folder in (tmp_path / "new" / "deeper", tmp_path):
        if folder == tmp_path:
            (tmp_path / "new").joinpath("deeper").rename(tmp_path.parent / f"{tmp_path.name}-x")
            (tmp_path / "new").rmdir()
        session = Session.open_or_create(folder)
        assert session.originals.is_dir()
        assert not session.unfinished
        assert session.journal.started


def test_a_folder_that_holds_something_else_is_not_taken_over(tmp_path: Path) -> None:
    (tmp_path / "holiday.jpg").write_bytes(b"x")
    for make in (Session.open_or_create, Session.create, Session.open):
        with pytest.raises(CoreError, match="folder"):
            make(tmp_path)
    assert os.listdir(tmp_path) == ["holiday.jpg"]
    with pytest.raises(CoreError, match="not a folder"):
        Session.open_or_create(tmp_path / "holiday.jpg")


def test_a_session_is_not_made_twice(tmp_path: Path) -> None:
    Session.create(tmp_path / "a")
    with pytest.raises(CoreError, match="not empty"):
        Session.create(tmp_path / "a")


def test_what_a_killed_write_left_does_not_stand_in_the_way(tmp_path: Path) -> None:
    (tmp_path / ".session-abc123.json").write_text("{")
    (tmp_path / ".metering.jpg").write_bytes(b"")
    (tmp_path / "originals").mkdir()
    session = Session.open_or_create(tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["originals", JOURNAL, "thumbnails"]
    assert session.notices == ()


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"null", b"[]", b"\xff\xfe", b'{"kind": "turnlight-session"}', b"[" * 100_000],
    ids=["empty", "half", "null", "list", "no text", "no version", "deep"],
)
def test_a_damaged_journal_is_kept_aside_and_said(tmp_path: Path, content: bytes) -> None:
    session = Session.create(tmp_path / "a")
    data = picture()
    (session.originals / "20260621-120005_R0010015.JPG").write_bytes(data)
    (session.folder / JOURNAL).write_bytes(content)
    again = Session.open(session.folder)
    assert (session.folder / "session.damaged-1.json").read_bytes() == content
    assert len(again.notices) == 1
    assert "damaged" in again.notices[0]
    # The file that was there is found again by its name, and is not fetched a second time.
    assert again.local_name(entry(size=len(data))) == "20260621-120005_R0010015.JPG"
    (session.folder / JOURNAL).write_bytes(content)
    assert "session.damaged-2.json" in Session.open(session.folder).notices[0]


def test_a_journal_of_a_newer_version_is_left_alone(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    path = session.folder / JOURNAL
    facts = json.loads(path.read_text())
    facts["version"] = 2
    path.write_text(json.dumps(facts))
    before = path.read_bytes()
    with pytest.raises(CoreError, match="newer version of Turnlight"):
        Session.open(session.folder)
    assert path.read_bytes() == before


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=5,
)


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@given(field=st.sampled_from(sorted(SessionJournal.__slots__)), value=JSON)
def test_a_forged_value_is_refused_or_harmless(field: str, value: object) -> None:
    facts = json.loads(text_of(FULL))
    facts[field] = value
    try:
        journal = journal_of(json.dumps(facts))
    except Unfit:
        return
    assert journal_of(text_of(journal)) == journal


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("local", "../../private/notes"),
        ("local", "a/b.JPG"),
        ("local", ".hidden"),
        ("name", "..\\x.JPG"),
        ("url", "file:///private/notes"),
        ("url", "http://user:secret@192.168.1.1/files/x.JPG"),
        ("thumbnail", "/private/notes"),
        ("size", -1),
        ("size", True),
        ("done", True),
        ("sha256", "00"),
    ],
)
def test_a_forged_frame_is_refused(field: str, value: object) -> None:
    facts = json.loads(text_of(FULL))
    facts["frames"][0][field] = value
    with pytest.raises(Unfit):
        journal_of(json.dumps(facts))


def test_passwords_never_get_into_a_journal(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    with pytest.raises(ValueError, match="not allowed"):
        session.update(settings_to_restore={"_password": "12345678"})
    frame = SessionFrame("R.JPG", "http://me:secret@192.168.1.1/R.JPG")
    with pytest.raises(ValueError, match="pattern"):
        session.update(frames=(frame,))
    assert "12345678" not in (session.folder / JOURNAL).read_text()
    assert session.journal.frames == ()


def test_texts_of_a_camera_are_cleaned(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    session.update(
        model="THETA\x1b[31m\n",
        serial="9" * 9000,
        warnings=[PlainRemark("\ud800 bad"), PlainRemark("\x00")],
    )
    assert session.journal.model == "THETA?[31m?"
    assert len(session.journal.serial) == 1000
    assert session.journal.warnings == (PlainRemark("? bad"), PlainRemark("?"))
    session.warn(PlainRemark("once"))
    session.warn(PlainRemark("once"))
    assert session.journal.warnings.count(PlainRemark("once")) == 1
    assert Session.open(session.folder).journal == session.journal


def test_local_names_hold_date_and_name_and_never_meet(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    assert session.local_name(entry()) == "20260621-120005_R0010015.JPG"
    assert session.local_name(entry(date_time="")) == "undated_R0010015.JPG"
    assert session.local_name(entry(date_time="2026:13:41 25:00:00")) == "undated_R0010015.JPG"
    frames = session.set_frames([entry(), entry(folder=101), entry(name="r0010015.jpg", url=URL)])
    assert [frame.local for frame in frames] == [
        "20260621-120005_R0010015.JPG",
        "20260621-120005_R0010015-2.JPG",
        "20260621-120005_r0010015-3.jpg",
    ]
    assert session.local_name(entry(folder=101)) == frames[1].local


URL = "http://192.168.1.1/files/x.jpg"


@pytest.mark.parametrize(
    "name", ["../../evil.JPG", "a/b\\c:d.JPG", "..", "con", "é\x00.JPG", "a" * 300]
)
def test_local_names_stay_in_the_folder(tmp_path: Path, name: str) -> None:
    session = Session.create(tmp_path / "a")
    local = session.local_name(entry(name=name))
    assert (session.originals / local).resolve().parent == session.originals.resolve()
    assert len(local) < 100
    assert local.startswith("20260621-120005_")


def test_a_strange_file_of_the_same_name_is_not_taken_for_ours(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    (session.originals / "20260621-120005_R0010015.JPG").write_bytes(b"mine")
    assert session.local_name(entry(size=4)) == "20260621-120005_R0010015-2.JPG"


def test_opening_takes_stock_of_the_files(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    frames = session.set_frames([entry(11), entry(12), entry(13), entry(14)])
    done, lost, unknown, broken = (session.path_of(frame) for frame in frames)
    for path, seed in ((done, 1), (lost, 2), (unknown, 3), (broken, 4)):
        path.write_bytes(picture(seed))
    for frame in (frames[0], frames[1], frames[3]):
        session.finish_frame(frame.url)
    lost.unlink()
    broken.write_bytes(picture(4)[:500])
    part = done.with_name("x.part")
    part.write_bytes(b"half")
    again = Session.open(session.folder)
    assert [frame.done for frame in again.journal.frames] == [True, False, True, False]
    assert again.journal.frames[2].sha256 == sha256_of(unknown)
    assert again.journal.frames[1].sha256 == ""
    assert "damaged" in again.notices[0]
    assert (session.originals / f"{broken.name}.damaged-1").exists()
    assert part.exists()


def test_a_refused_write_leaves_the_old_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = Session.create(tmp_path / "a")
    session.update(stage="exposing")
    before = (session.folder / JOURNAL).read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.core.base.atomic_files.os.replace", full)
    with pytest.raises(CoreError, match="no space left"):
        session.update(stage="downloading")
    assert session.journal.stage == "exposing"
    assert (session.folder / JOURNAL).read_bytes() == before


def test_set_frames_keeps_what_is_known(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    first = session.set_frames([entry(11, size=7)])[0]
    session.path_of(first).write_bytes(picture())
    session.finish_frame(first.url)
    second, again = session.set_frames([entry(12), entry(11, size=8)])
    assert (again.done, again.local, again.size) == (True, first.local, 8)
    assert not second.done


def test_frames_are_known_again_when_the_camera_has_another_address(tmp_path: Path) -> None:
    session = Session.create(tmp_path / "a")
    first = session.set_frames([entry(11)])[0]
    session.path_of(first).write_bytes(picture())
    session.finish_frame(first.url)
    moved = replace(entry(11), url="http://10.0.0.7:8080/" + first.url.split("/", 3)[3])
    assert session.local_name(moved) == first.local
    (again,) = session.set_frames([moved])
    assert (again.done, again.local, again.url) == (True, first.local, moved.url)


@pytest.mark.parametrize("value", ["off\n", [1] * 1000, {"a\n": 1}, {"a": float("inf")}])
def test_settings_that_cannot_be_kept_are_left_out(tmp_path: Path, value: Any) -> None:
    kept = keepable({"sleepDelay": 300, "offDelay": value, "password": "x"})
    assert kept == {"sleepDelay": 300}
    Session.create(tmp_path / "a").update(settings_to_restore=kept)


def test_the_end_of_a_jpeg_is_found() -> None:
    data = picture()
    assert jpeg_end(data) == len(data)
    assert jpeg_end(data + b"garbage\xff\xd9") == len(data)
    for broken in (b"", data[:-1], data[:3], data[: len(data) // 2], b"x" + data, data[:20]):
        assert jpeg_end(broken) is None


def test_a_jpeg_with_a_hole_under_a_good_structure_is_not_whole(tmp_path: Path) -> None:
    data = picture(shape=(128, 256))
    path = tmp_path / "a.JPG"
    path.write_bytes(data)
    assert whole_picture(path)
    path.write_bytes(data[: len(data) // 2] + b"\xff\xd9")
    assert not whole_picture(path)
    assert not whole_picture(tmp_path / "missing.JPG")
