"""The user's files, copied into a place; they themselves are only ever read."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import stat
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

from app.core.base.progress import Report, Token, silent
from app.core.storage.places.names import (
    free_names,
    publish,
    safe_file_name,
    sweep,
    umask,
    words_of,
)
from app.core.storage.places.place import PlaceError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    _Told = Callable[[int], None]

ORIGINALS: Final = "originals"
"""Name of the folder in a place's folder."""

_MOST_FILES: Final = 200
_MOST_BYTES: Final = 1 << 31
_MOST_TOGETHER: Final = 1 << 34
_CHUNK: Final = 1 << 20
_SPARE: Final = 64 << 20  # for the environment that is made of them


def adopt_files(
    folder: Path, paths: Sequence[Path], token: Token | None = None, report: Report = silent
) -> tuple[Path, ...]:
    """Copy files into a place's ``originals``.

    A copy gets its name once it is whole, and never that of another file; a file that is there
    already with the same content is not copied again.

    Raises
    ------
    PlaceError
        When a file cannot be read, is too large, changes while it is copied, or the disk is full.
    Cancelled
        When the token said so.
    """
    token = token or Token()
    sizes = [_size_of(path) for path in paths]
    target = folder / ORIGINALS
    _check_room(folder, sizes)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PlaceError(f"Cannot make {target}: {words_of(error)}.") from error
    sweep(target)
    together, before = max(sum(sizes), 1), 0
    copies: list[Path] = []
    for number, (path, size) in enumerate(zip(paths, sizes, strict=True), 1):
        words = f"Copying {number} of {len(paths)}"

        def told(done: int, before: int = before, words: str = words) -> None:
            token.check()
            report(min((before + done) / together, 1.0), words)

        told(0)
        copies.append(_adopt(path, size, target, told))
        before += size
    report(1.0, "Copied")
    return tuple(copies)


def _size_of(path: Path) -> int:
    try:
        about = path.stat()
    except OSError as error:
        raise PlaceError(f"{path} cannot be read: {words_of(error)}.") from error
    if not stat.S_ISREG(about.st_mode):
        raise PlaceError(f"{path} is not an ordinary file.", "Choose pictures, not folders.")
    if about.st_size > _MOST_BYTES:
        raise PlaceError(f"{path.name} is too large to be a picture ({about.st_size >> 30} GB).")
    return about.st_size


def _check_room(folder: Path, sizes: Sequence[int]) -> None:
    if len(sizes) > _MOST_FILES:
        raise PlaceError(
            f"{len(sizes)} files are too many; at most {_MOST_FILES} go into one place.",
            "Choose the frames of one bracket.",
        )
    if sum(sizes) > _MOST_TOGETHER:
        raise PlaceError("Together these files are too large for one place.")
    with contextlib.suppress(OSError):
        free = shutil.disk_usage(folder).free
        if free < sum(sizes) + _SPARE:
            raise PlaceError(
                f"There is no room for these files: {sum(sizes) >> 20} MB are needed and "
                f"{free >> 20} MB are free.",
                "Make room, or choose another folder for places in Settings.",
            )


def _adopt(path: Path, size: int, target: Path, told: _Told) -> Path:
    if path.resolve().parent == target.resolve():
        return target / path.name
    half, checksum = _copy(path, size, target, told)
    try:
        name = safe_file_name(path.name)
        stem, dot, ending = name.rpartition(".")
        for free in free_names(stem if dot else name, f"{dot}{ending}" if dot else ""):
            final = target / free
            if publish(half, final):
                return final
            if _is_same(final, size, checksum):
                return final
    except OSError as error:
        raise PlaceError(f"{path.name} was not copied: {words_of(error)}.") from error
    finally:
        _drop(half)
    raise AssertionError("free_names never ends")  # pragma: no cover


def _copy(path: Path, size: int, target: Path, told: _Told) -> tuple[Path, str]:
    """Copy to a passing name, flushed to the disk; return it with the SHA-256."""
    half: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=".adopt-", suffix=".part", dir=target)
        half = Path(name)
        with os.fdopen(handle, "wb") as out, path.open("rb") as source:
            checksum, done = _pour(source, out, size, told)
            about = os.fstat(source.fileno())
        if done == about.st_size == size:
            half.chmod(0o666 & ~umask())
            os.utime(half, ns=(about.st_atime_ns, about.st_mtime_ns))
            return half, checksum
    except OSError as error:
        _drop(half)
        raise PlaceError(
            f"{path.name} was not copied: {words_of(error)}.", "Your file is untouched."
        ) from error
    except BaseException:
        _drop(half)
        raise
    _drop(half)
    raise PlaceError(
        f"{path.name} changed while it was copied.", "Wait until it is complete, then try again."
    )


def _pour(source: BinaryIO, out: BinaryIO, size: int, told: _Told) -> tuple[str, int]:
    """Copy at most one piece more than `size`; return the SHA-256 and the bytes."""
    total = hashlib.sha256()
    done = 0
    while done <= size and (chunk := source.read(_CHUNK)):
        out.write(chunk)
        total.update(chunk)
        done += len(chunk)
        told(done)
    out.flush()
    os.fsync(out.fileno())
    return total.hexdigest(), done


def _drop(half: Path | None) -> None:
    if half is not None:
        with contextlib.suppress(OSError):
            half.unlink()


def _is_same(path: Path, size: int, checksum: str) -> bool:
    if not path.is_file() or path.stat().st_size != size:
        return False
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest() == checksum
