"""A file is written whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import pytest

from app.core.base.atomic_files import (
    atomic_write,
    atomic_write_bytes,
    atomic_write_text,
    check_target,
    open_file,
)
from app.core.base.errors import CoreError

POSIX = pytest.mark.skipif(os.name != "posix", reason="permissions and devices as on POSIX")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_writes_and_replaces(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    atomic_write_text(target, "first\n")
    atomic_write_bytes(str(target), "zweites ü\n".encode())
    assert target.read_bytes() == "zweites ü\n".encode()
    assert names(tmp_path) == ["a.txt"]


def test_temporary_file_is_beside_the_target_with_its_suffix(tmp_path: Path) -> None:
    seen: list[Path] = []

    def writer(path: Path) -> None:
        seen.append(path)
        assert path.stat().st_size == 0
        path.write_bytes(b"x")

    atomic_write(tmp_path / "picture.exr", writer)
    assert seen[0].parent == tmp_path
    assert seen[0].suffix == ".exr"
    assert seen[0].name != "picture.exr"


@pytest.mark.parametrize("error", [ValueError("no"), KeyboardInterrupt(), CoreError("No.")])
def test_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path, error: BaseException) -> None:
    target = tmp_path / "a.npz"
    target.write_bytes(b"old")

    def writer(path: Path) -> None:
        path.write_bytes(b"half of the n")
        raise error

    with pytest.raises(type(error)):
        atomic_write(target, writer)
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["a.npz"]


def test_writer_may_replace_the_temporary_file_itself(tmp_path: Path) -> None:
    # Some image libraries delete and create anew.
    def writer(path: Path) -> None:
        path.unlink()
        path.write_bytes(b"anew")

    atomic_write(tmp_path / "a.png", writer)
    assert (tmp_path / "a.png").read_bytes() == b"anew"


def test_full_disk_is_a_sentence(tmp_path: Path) -> None:
    def writer(path: Path) -> None:
        path.write_bytes(b"some")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(CoreError, match=r"Cannot write .*a\.npz: no space left"):
        atomic_write(tmp_path / "a.npz", writer)
    assert names(tmp_path) == []


def test_folder_that_takes_no_files_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_: object) -> tuple[int, str]:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr("app.core.base.atomic_files.tempfile.mkstemp", refuse)
    with pytest.raises(CoreError, match=r"Cannot write .*: read-only file system"):
        atomic_write_text(tmp_path / "a.txt", "x")


def test_nothing_at_the_target_counts_until_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"

    def writer(path: Path) -> None:
        path.write_text(str(target.exists()))

    atomic_write(target, writer)
    assert target.read_text() == "False"


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match=r"nowhere.* does not exist"):
        check_target(tmp_path / "nowhere" / "a.txt")
    with pytest.raises(CoreError, match="does not exist"):
        atomic_write_text(tmp_path / "nowhere" / "a.txt", "x")


def test_file_as_folder(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("x")
    with pytest.raises(CoreError, match="does not exist"):
        check_target(tmp_path / "plain" / "a.txt")


def test_folder_as_target(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match="it is a folder"):
        check_target(tmp_path)


def test_a_file_that_is_write_protected_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    # Whoever runs the tests may be allowed everything.
    monkeypatch.setattr(
        "app.core.base.atomic_files.os.access", lambda path, mode: Path(path) != target
    )
    with pytest.raises(CoreError, match="the file is write-protected") as caught:
        atomic_write_text(target, "new")
    assert caught.value.hint
    assert target.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_name_too_long(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match="Cannot write"):
        check_target(tmp_path / ("x" * 5000))


@POSIX
def test_device_is_refused() -> None:
    with pytest.raises(CoreError, match="not an ordinary file"):
        check_target("/dev/null")


def test_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Asked for and not tried, since root may write anywhere.
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path)
    with pytest.raises(CoreError, match=r"folder .* is not writable"):
        check_target(tmp_path / "a.txt")


def test_check_gives_the_path_back_and_creates_nothing(tmp_path: Path) -> None:
    assert check_target(str(tmp_path / "a.txt")) == tmp_path / "a.txt"
    assert names(tmp_path) == []


@POSIX
def test_permissions_are_those_of_an_ordinary_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_text("x")
    target = tmp_path / "a.txt"
    atomic_write_text(target, "x")
    assert target.stat().st_mode == plain.stat().st_mode
    target.chmod(0o640)
    atomic_write_text(target, "y")
    assert target.stat().st_mode & 0o777 == 0o640


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege on Windows")
def test_link_is_followed(tmp_path: Path) -> None:
    folder = tmp_path / "real"
    folder.mkdir()
    (folder / "a.txt").write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to(folder / "a.txt")
    atomic_write_text(link, "new")
    assert link.is_symlink()
    assert (folder / "a.txt").read_text() == "new"
    assert names(folder) == ["a.txt"]


@POSIX
@pytest.mark.timeout(20)
def test_only_ordinary_files_are_opened(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"abc")
    with open_file(tmp_path / "a") as stream:
        assert stream.read() == b"abc"
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero"), Path("/dev/null")):
        with pytest.raises(OSError, match="not an ordinary file"):
            open_file(path)
    with pytest.raises(IsADirectoryError):
        open_file(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OSError, match="symbolic links"):
        open_file(tmp_path / "loop")


@POSIX
@pytest.mark.parametrize("how", [lambda stream: stream.read(8), lambda stream: stream.read()])
def test_content_that_would_have_to_be_waited_for_is_an_error(
    how: Callable[[BinaryIO], bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As that of /proc/kmsg, which says that it is an ordinary file."""
    reading, writing = os.pipe()
    os.set_blocking(reading, False)
    with monkeypatch.context() as patch:
        patch.setattr(os, "open", lambda path, flags: reading)
        patch.setattr(stat, "S_ISREG", lambda mode: True)
        stream = open_file("kmsg")
    with stream, pytest.raises(OSError, match="not an ordinary file"):
        how(stream)
    os.close(writing)
