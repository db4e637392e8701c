"""Settings on the disk: kept, and read field by field whatever became of the file."""

from __future__ import annotations

import errno
import json
import os
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given
from hypothesis import settings as limits
from hypothesis import strategies as st

from app.core.storage.json_file import carry_unknown, dump, read_json
from app.core.storage.settings import TABLE, Settings, SettingsError, SettingsNote
from app.core.storage.settings_file import read_settings, write_settings
from app.words.settings import note_words
from tests.unit.test_settings_table import values_of

POSIX = pytest.mark.skipif(os.name != "posix", reason="permissions and pipes as on POSIX")
SHARED = limits(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
CHANGED = (
    Settings()
    .with_("theme", "light")
    .with_("text_scale", 1.3)
    .with_("sitter_name", "Zoë")
    .with_("webcam", 2)
    .with_("sounds", False)
)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "settings.json"


def test_missing_file_means_as_it_came(file: Path) -> None:
    assert read_settings(file) == (Settings(), ())
    assert names(file.parent) == []


@SHARED
@given(st.data())
def test_round_trip_is_exact_and_sparse(file: Path, data: st.DataObject) -> None:
    kept = Settings(
        **{each.key: data.draw(values_of(each)) for each in TABLE}  # type: ignore[arg-type]
    )
    write_settings(file, kept)
    assert read_settings(file) == (kept, ())
    facts = json.loads(file.read_text("utf-8"))
    different = {each.key for each in TABLE if kept.value(each.key) != each.default}
    assert set(facts) == different | {"format_version"}
    assert names(file.parent) == ["settings.json"]


def test_makes_its_folder(tmp_path: Path) -> None:
    write_settings(tmp_path / "a" / "b" / "settings.json", CHANGED)
    assert read_settings(tmp_path / "a" / "b" / "settings.json")[0] == CHANGED


def test_bad_fields_are_put_right_one_by_one(file: Path) -> None:
    facts = {"theme": "purple", "text_scale": 1.5, "webcam": "two", "volume": float("nan")}
    before = json.dumps(facts).encode()
    file.write_bytes(before)
    settings, notes = read_settings(file)
    assert settings == Settings().with_("text_scale", 1.5)
    assert len(notes) == 4
    assert [note.entry.key for note in notes if note.entry] == ["theme", "webcam", "volume"]
    assert "“Theme” must be one of: " in note_words(notes[0])
    assert "Dark" in note_words(notes[0])
    assert notes[3] == SettingsNote(copy=file.parent / "settings.json.bak")
    assert (file.parent / "settings.json.bak").read_bytes() == before


def test_bad_file_is_kept_once_and_never_overwritten(file: Path) -> None:
    for number, content in enumerate([b"{no", b"{no", b"[1]", b"{no"]):
        file.write_bytes(content)
        _, notes = read_settings(file)
        wanted = "settings.json.bak-2" if content == b"[1]" else "settings.json.bak"
        assert notes[-1] == SettingsNote(copy=file.parent / wanted), number
    kept = {name: (file.parent / name).read_bytes() for name in names(file.parent)}
    del kept["settings.json"]
    assert kept == {"settings.json.bak": b"{no", "settings.json.bak-2": b"[1]"}


def test_bad_file_stays_until_settings_are_written(file: Path) -> None:
    file.write_bytes(b"{no")
    read_settings(file)
    assert file.read_bytes() == b"{no"
    write_settings(file, CHANGED)
    assert read_settings(file) == (CHANGED, ())
    assert (file.parent / "settings.json.bak").read_bytes() == b"{no"


@pytest.mark.parametrize("cut", range(1, 90, 4))
def test_cut_off_file_means_defaults_and_a_sentence(file: Path, cut: int) -> None:
    write_settings(file, CHANGED)
    whole = file.read_bytes()
    file.write_bytes(whole[:-cut])
    settings, notes = read_settings(file)
    # The last line end alone is no loss.
    if cut == 1:
        assert (settings, notes) == (CHANGED, ())
    else:
        assert settings == Settings()
        # A cut through a letter of two bytes leaves something that is not text.
        said = note_words(notes[0])
        assert re.fullmatch(r"The settings could not be used: it is .*\. Using default.*", said)
        assert notes[1:] == (SettingsNote(copy=file.parent / "settings.json.bak"),)
        assert (file.parent / "settings.json.bak").read_bytes() == whole[:-cut]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "it is empty"),
        (b"\0" * 4096, "it is empty"),
        (b"[]", "it has the wrong content"),
        (b"\xff\xfe{\0", "it is not plain text"),
        (b"[" * 100_000, "nested too deeply"),
        (b" " * (2 << 20), "far too large"),
    ],
    ids=["empty", "zeros", "list", "utf-16", "deep", "huge"],
)
def test_file_that_is_something_else_is_a_sentence(file: Path, content: bytes, words: str) -> None:
    file.write_bytes(content)
    settings, notes = read_settings(file)
    assert settings == Settings()
    assert words in notes[0].why
    assert "settings.json.bak" in names(file.parent)
    write_settings(file, CHANGED)
    assert read_settings(file) == (CHANGED, ())


@POSIX
def test_pipe_is_not_waited_for(file: Path) -> None:
    os.mkfifo(file)
    settings, notes = read_settings(file)
    assert settings == Settings()
    assert "not an ordinary file" in notes[0].why


def test_editor_with_a_byte_order_mark_is_fine(file: Path) -> None:
    file.write_bytes(b"\xef\xbb\xbf" + b'{"theme": "light"}')
    assert read_settings(file) == (Settings().with_("theme", "light"), ())


@SHARED
@given(st.binary(max_size=200), st.integers(0, 400), st.integers(0, 40))
@example(b'"', 30, 0)
def test_no_damage_makes_it_fail(file: Path, patch: bytes, where: int, cut: int) -> None:
    write_settings(file, CHANGED)
    whole = file.read_bytes()
    where %= len(whole)
    damaged = whole[:where] + patch + whole[where + cut :]
    file.write_bytes(damaged)
    settings, notes = read_settings(file)
    try:
        same = json.loads(damaged) == json.loads(whole)
    except ValueError:
        # What was damaged is told of, and kept.
        assert notes
        kept = [path for path in file.parent.iterdir() if ".bak" in path.name]
        assert damaged in [path.read_bytes() for path in kept]
    else:
        assert not same or (settings == CHANGED and not notes)
    for path in file.parent.iterdir():
        path.unlink()


def test_paper_mode_of_earlier_versions_is_read(file: Path) -> None:
    file.write_text('{"objective": "paper", "quality_limit": 60.0}', encoding="utf-8")
    settings, notes = read_settings(file)
    assert (settings.paper_mode, notes) == (True, ())
    write_settings(file, settings, settings)
    kept = json.loads(file.read_text(encoding="utf-8"))
    assert kept == {"format_version": 1, "paper_mode": True, "quality_limit": 60.0}
    file.write_text('{"objective": "picture"}', encoding="utf-8")
    assert read_settings(file) == (Settings(), ())


def test_what_a_newer_version_wrote_is_written_back(file: Path) -> None:
    facts: dict[str, Any] = {"format_version": 1, "theme": "light", "lens": {"k": [1.5, None]}}
    file.write_text(json.dumps(facts), "utf-8")
    settings, notes = read_settings(file)
    assert notes == ()
    write_settings(file, settings.with_("theme", "contrast").with_("volume", 5.0))
    facts |= {"theme": "contrast", "volume": 5.0}
    assert json.loads(file.read_text("utf-8")) == facts


def test_odd_things_of_a_newer_version_can_be_written_back(file: Path) -> None:
    file.write_text(
        '{"a": NaN, "b": "\\ud800", "c": 1e999, "d": 123456789012345678901234}', "utf-8"
    )
    settings, notes = read_settings(file)
    assert notes == ()
    write_settings(file, settings)
    again = json.loads(file.read_bytes())
    assert again["a"] is None
    assert again["b"] == "\ud800"
    assert again["d"] == float(123456789012345678901234)


def test_full_disk_is_a_sentence_and_the_file_is_as_it_was(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_settings(file, CHANGED)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(SettingsError, match=r"not saved.*no space left.*until you quit"):
        write_settings(file, Settings())
    monkeypatch.undo()
    assert read_settings(file) == (CHANGED, ())
    assert names(file.parent) == ["settings.json"]


def test_folder_that_is_a_file_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"")
    with pytest.raises(SettingsError, match="not saved"):
        write_settings(tmp_path / "a" / "settings.json", CHANGED)
    assert read_settings(tmp_path / "a" / "settings.json") == (Settings(), ())


@POSIX
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads all")
def test_file_without_permission_is_a_sentence(file: Path) -> None:
    write_settings(file, CHANGED)
    file.chmod(0)
    settings, notes = read_settings(file)
    assert settings == Settings()
    assert "permission denied" in notes[0].why


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**15), 10**15)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=12,
)
OBJECTS = st.dictionaries(st.text(max_size=8), JSON, max_size=5)


@SHARED
@given(OBJECTS)
def test_any_object_comes_back(file: Path, facts: dict[str, Any]) -> None:
    file.write_bytes(dump(facts))
    read = read_json(file, 1 << 20)
    assert read.state == "whole"
    assert read.facts == facts


@pytest.mark.slow
@given(OBJECTS, OBJECTS, OBJECTS)
def test_unknown_entries_survive_and_ours_win(
    ours: dict[str, Any], before: dict[str, Any], theirs: dict[str, Any]
) -> None:
    others = {f"new {name}": value for name, value in theirs.items()}
    found = before | others
    merged = carry_unknown(ours, before, found)
    assert {name: merged[name] for name in others} == others
    assert set(merged) == set(ours) | set(others)
    for name, value in ours.items():
        if not isinstance(value, dict):
            assert merged[name] == value
    assert carry_unknown(before, before, found) == found
