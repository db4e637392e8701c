"""The user's files in a place: copied whole, never overwritten, never touched themselves."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.base.errors import Cancelled
from app.core.base.progress import Progress, Task, Token
from app.core.places.files.originals import adopt_files, publish, safe_file_name, sweep
from app.core.places.place import PlaceError

POSIX = pytest.mark.skipif(os.name != "posix", reason="pipes and links as on POSIX")
BIG = 3 * (1 << 20) + 5


@pytest.fixture
def card(tmp_path: Path) -> Path:
    """A memory card with three pictures."""
    folder = tmp_path / "card"
    folder.mkdir()
    for number in range(3):
        path = folder / f"R{number}.JPG"
        path.write_bytes(bytes([number]) * (BIG if number == 0 else 1000))
        os.utime(path, (1_700_000_000 + number, 1_600_000_000 + number))
    return folder


@pytest.fixture
def place(tmp_path: Path) -> Path:
    folder = tmp_path / "place"
    folder.mkdir()
    return folder


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def state(folder: Path) -> list[tuple[str, bytes, int]]:
    """What must not change of the user's files."""
    return [(p.name, p.read_bytes(), p.stat().st_mtime_ns) for p in sorted(folder.iterdir())]


def test_copies_are_the_files_with_their_time(card: Path, place: Path) -> None:
    before = state(card)
    told: list[tuple[float, Progress]] = []
    paths = sorted(card.iterdir(), reverse=True)
    copies = adopt_files(place, paths, Token(), lambda share, step: told.append((share, step)))
    assert [copy.name for copy in copies] == ["R2.JPG", "R1.JPG", "R0.JPG"]
    assert state(place / "originals") == before
    assert state(card) == before
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert told[-2][1] == Progress(Task.COPYING, number=3, count=3)


def test_same_files_again_are_not_copied_again(card: Path, place: Path) -> None:
    paths = sorted(card.iterdir())
    first = adopt_files(place, paths)
    before = state(place / "originals")
    assert adopt_files(place, paths) == first
    assert adopt_files(place, first) == first
    assert state(place / "originals") == before


def test_another_file_of_the_same_name_gets_a_number(card: Path, place: Path) -> None:
    adopt_files(place, [card / "R1.JPG"])
    other = card / "sub"
    other.mkdir()
    for content in (b"\x01" * 999 + b"\x02", b"short"):
        (other / "R1.JPG").write_bytes(content)
        (copy,) = adopt_files(place, [other / "R1.JPG"])
        assert copy.read_bytes() == content
    assert names(place / "originals") == ["R1-2.JPG", "R1-3.JPG", "R1.JPG"]
    assert (place / "originals" / "R1.JPG").read_bytes() == b"\x01" * 1000


def test_empty_list_is_fine(place: Path) -> None:
    assert adopt_files(place, []) == ()


def test_stopping_keeps_what_is_whole_and_nothing_else(card: Path, place: Path) -> None:
    token = Token()

    def stop(share: float, step: Progress) -> None:
        if step == Progress(Task.COPYING, number=2, count=2) and share > 0.01:
            token.cancel()

    with pytest.raises(Cancelled):
        adopt_files(place, [card / "R1.JPG", card / "R0.JPG"], token, stop)
    assert names(place / "originals") == ["R1.JPG"]


@POSIX
@pytest.mark.parametrize("kind", ["folder", "pipe", "missing", "device"])
def test_only_ordinary_files(card: Path, place: Path, kind: str) -> None:
    odd = card / "odd"
    make: dict[str, Callable[[], Any]] = {
        "folder": odd.mkdir,
        "pipe": lambda: os.mkfifo(odd),
        "missing": lambda: None,
        "device": lambda: odd.symlink_to("/dev/zero"),
    }
    make[kind]()
    with pytest.raises(PlaceError, match="odd"):
        adopt_files(place, [card / "R1.JPG", odd])
    assert names(place) == []


def test_too_large_and_too_many_are_sentences(
    card: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (card / "huge.jpg").open("wb") as stream:
        stream.truncate((1 << 31) + 1)
    with pytest.raises(PlaceError, match="too large"):
        adopt_files(place, [card / "huge.jpg"])
    with pytest.raises(PlaceError, match="201 files are too many"):
        adopt_files(place, [card / "R1.JPG"] * 201)
    usage = shutil.disk_usage(place)._replace(free=1 << 20)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    with pytest.raises(PlaceError, match="3 MB are needed, but only 1 MB are free"):
        adopt_files(place, [card / "R0.JPG"])
    assert names(place) == []


@pytest.mark.parametrize("change", ["grows", "shrinks"])
def test_file_that_changes_meanwhile_is_not_taken(card: Path, place: Path, change: str) -> None:
    def touch(share: float, step: Progress) -> None:
        del step
        if 0.0 < share < 0.9:
            with (card / "R0.JPG").open("r+b") as stream:
                stream.truncate(BIG * 2 if change == "grows" else BIG - (1 << 20))

    with pytest.raises(PlaceError, match="changed while it was being copied"):
        adopt_files(place, [card / "R0.JPG"], Token(), touch)
    assert names(place / "originals") == []


def test_full_disk_is_a_sentence_and_leaves_nothing(
    card: Path, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    before = state(card)
    with pytest.raises(PlaceError, match=r"R1.JPG was not copied: no space left.*unchanged"):
        adopt_files(place, [card / "R1.JPG"])
    assert names(place / "originals") == []
    assert state(card) == before


def test_disk_without_links(card: Path, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_links(*_: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", no_links)
    adopt_files(place, sorted(card.iterdir()))
    (card / "R1.JPG").write_bytes(b"other")
    adopt_files(place, [card / "R1.JPG"])
    assert names(place / "originals") == ["R0.JPG", "R1-2.JPG", "R1.JPG", "R2.JPG"]


def test_publishing_never_replaces(tmp_path: Path) -> None:
    half, target = tmp_path / "half", tmp_path / "target"
    half.write_bytes(b"new")
    target.write_bytes(b"old")
    with pytest.MonkeyPatch.context() as patch:
        # Taken between the look and the act.
        patch.setattr(os.path, "lexists", lambda path: False)
        assert not publish(half, target)
    assert not publish(half, target)
    assert (half.read_bytes(), target.read_bytes()) == (b"new", b"old")


@given(st.text(max_size=300))
def test_any_name_becomes_a_safe_one(name: str) -> None:
    safe = safe_file_name(name)
    assert 1 <= len(safe.encode()) <= 230
    assert not set(safe) & set('/\\:*?"<>|\0\n')
    assert safe not in (".", "..")
    assert not safe.endswith((".", " "))
    assert safe_file_name(safe) == safe


def test_ordinary_names_stay() -> None:
    for name in ("R0010012.JPG", "Bild – 2.jpeg", "a.b.c.dng", "noending"):
        assert safe_file_name(name) == name
    assert safe_file_name("../../x.jpg") == "_.._x.jpg"


def test_sweeping_takes_old_halves_only(place: Path) -> None:
    keep = ["place.json", "place.json.bak", "environment-00.exr", ".hidden.json", "a.part"]
    old = [
        ".place-abcd1234.json",
        ".environment-00-abcd.exr",
        ".adopt-x_1.part",
        ".thumbnail-x.png",
    ]
    for name in (*keep, *old):
        (place / name).write_bytes(b"x")
        os.utime(place / name, (1000, 1000))
    staged = place / ".new-x"
    staged.mkdir()
    (staged / "place.json").write_bytes(b"x")
    full = place / ".new-y"
    full.mkdir()
    (full / "picture.jpg").write_bytes(b"x")
    for path in (staged, full):
        os.utime(path, (1000, 1000))
    sweep(place, now_s=1000 + 3599)
    assert len(names(place)) == len(keep) + len(old) + 2
    sweep(place, now_s=1000 + 3601)
    assert names(place) == sorted([*keep, ".new-y"])
