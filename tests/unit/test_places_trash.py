"""Deleted places can be brought back, whole."""

from __future__ import annotations

import errno
import os
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Progress, Token
from app.core.places.place import PlaceError
from app.core.places.place_folder import create_place, read_place
from app.core.places.place_list import (
    delete_place,
    empty_trash,
    list_places,
    list_trash,
    restore_place,
    trash_size,
)

NOW = datetime(2026, 6, 21, 12, 5, tzinfo=UTC)
POSIX = pytest.mark.skipif(os.name != "posix", reason="permissions and links as on POSIX")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "places"


@pytest.fixture
def folder(root: Path) -> Path:
    folder = create_place(root, "Court", NOW)
    (folder / "originals").mkdir()
    (folder / "originals" / "R1.JPG").write_bytes(b"picture")
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_undo_brings_everything_back(root: Path, folder: Path) -> None:
    before = contents(folder)
    trashed = delete_place(folder, NOW)
    assert list_places(root) == ()
    assert [each.name for each in list_trash(root)] == ["Court"]
    assert not folder.exists()
    assert restore_place(trashed) == folder
    assert contents(folder) == before
    assert [each.folder for each in list_places(root)] == [folder]
    assert list_trash(root) == ()


def test_same_place_can_be_deleted_again_and_again(root: Path) -> None:
    trashed = [delete_place(create_place(root, "Court", NOW), NOW) for _ in range(3)]
    assert len(set(trashed)) == 3
    assert [restore_place(each).name[16:] for each in trashed] == ["court", "court-2", "court-3"]
    assert len(list_places(root)) == 3


def test_restoring_does_not_replace_a_new_place(root: Path, folder: Path) -> None:
    trashed = delete_place(folder, NOW)
    newer = create_place(root, "Court", NOW)
    assert newer == folder
    back = restore_place(trashed)
    assert back.name == f"{folder.name}-2"
    assert contents(back)["originals/R1.JPG"] == b"picture"
    assert set(contents(newer)) == {"place.json"}


def test_damaged_places_can_be_deleted_and_brought_back(root: Path, folder: Path) -> None:
    (folder / "place.json").write_bytes(b"{")
    trashed = delete_place(folder)
    assert read_place(restore_place(trashed)).remarks


@POSIX
def test_deletes_nothing_but_places(root: Path, folder: Path) -> None:
    (root / "holiday").mkdir()
    (root / "holiday" / "beach.jpg").write_bytes(b"x")
    (root / "link").symlink_to(folder)
    for wrong in (root / "holiday", root / "link", root / "gone"):
        with pytest.raises(PlaceError, match="no place"):
            delete_place(wrong)
    assert (root / "holiday" / "beach.jpg").exists()
    assert folder.exists()


def test_only_what_is_in_the_trash_is_restored(root: Path, folder: Path) -> None:
    for wrong in (folder, root / ".trash" / "20260621T120500Z--x", root / ".trash"):
        with pytest.raises(PlaceError, match="no longer in the trash"):
            restore_place(wrong)
    trashed = delete_place(folder)
    restore_place(trashed)
    with pytest.raises(PlaceError, match="no longer in the trash"):
        restore_place(trashed)


def test_last_deleted_is_listed_first(root: Path) -> None:
    for number, name in enumerate(["a", "b", "c"]):
        delete_place(create_place(root, name, NOW), NOW + timedelta(minutes=(number * 2) % 3))
    assert [each.name for each in list_trash(root)] == ["b", "c", "a"]


def test_move_that_fails_is_a_sentence(
    root: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def busy(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "rename", busy)
    with pytest.raises(
        PlaceError, match=r"not deleted: permission denied\. It is still in its folder"
    ):
        delete_place(folder)
    monkeypatch.undo()
    trashed = delete_place(folder)
    monkeypatch.setattr(os, "rename", busy)
    with pytest.raises(PlaceError, match="not restored"):
        restore_place(trashed)
    assert trashed.exists()


def test_an_emptied_trash_is_empty(root: Path, folder: Path, tmp_path: Path) -> None:
    outside = tmp_path / "mine.jpg"
    outside.write_bytes(b"a photo of the user's own")
    (folder / "originals" / "link.jpg").symlink_to(outside)
    other = create_place(root, "Hall", NOW)
    (root / ".trash").mkdir(exist_ok=True)
    (root / ".trash" / "notes.txt").write_text("not ours")
    assert trash_size(root) == (0, 0)
    delete_place(folder, NOW)
    delete_place(create_place(root, "Court", NOW), NOW)
    count, size = trash_size(root)
    assert count == 2
    assert size > len(b"picture")
    reports: list[Progress] = []
    assert empty_trash(root, Token(), lambda share, words: reports.append(words)) == 2
    assert list_trash(root) == ()
    assert trash_size(root) == (0, 0)
    assert os.listdir(root / ".trash") == ["notes.txt"]
    assert outside.exists()
    assert [each.folder for each in list_places(root)] == [other]
    assert len(reports) == 2


def test_emptying_can_be_stopped_and_leaves_whole_places(root: Path) -> None:
    for _ in range(3):
        delete_place(create_place(root, "Court", NOW), NOW)
    token = Token()
    with pytest.raises(Cancelled):
        empty_trash(root, token, lambda share, words: token.cancel())
    left = list_trash(root)
    assert len(left) == 2
    assert restore_place(left[0].folder).is_dir()
    assert empty_trash(root, Token()) == 1


def test_what_cannot_be_deleted_is_told_and_the_rest_goes(
    root: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stuck = delete_place(folder, NOW)
    delete_place(create_place(root, "Hall", NOW), NOW)
    rename = Path.rename

    def refuse(path: Path, target: Path) -> Path:
        if path == stuck:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(PlaceError, match="not emptied: permission denied"):
        empty_trash(root, Token())
    assert [each.folder for each in list_trash(root)] == [stuck]
