"""Copy the user's files to a place, under portable names.

The user's own files are only read. Leftovers from interrupted copies are deleted after an hour.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import stat
import tempfile
import time
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import BinaryIO, Final

from app.core.base.atomic_files import is_private, make_folder, os_errors_as, umask, words_of
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.places.place import PlaceError
from app.core.text import tr

_OnBytes = Callable[[int], None]


LITTER: Final = frozenset({".DS_Store", "Thumbs.db", "desktop.ini", ".directory"})
"""Names of files that operating systems leave in folders."""

STAGING: Final = ".new-"
"""Prefix of the name of a folder that is not a place yet."""

# Half-written files of `atomic_write` (".NAME-xxxxxxxx.END") and of `adopt_files`.
_HALF: Final = re.compile(
    r"\.(place|environment|thumbnail|background)-.+\.(json|exr|png|bak|points)"
    r"|\.adopt-[0-9a-z_]+\.part"
)
_STEM: Final = re.compile(r"(\d{4})-(\d\d)-(\d\d)-(\d\d)(\d\d)-([a-z0-9-]+)")
_OLD_S: Final = 3600.0  # seconds; no file takes an hour to write
_MOST_TRIES: Final = 10_000
_UNSAFE: Final = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')
_RESERVED: Final = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)


def folder_stem(name: str, made_at: datetime) -> str:
    """Return a portable folder name for a place.

    Examples:
        >>> from datetime import datetime
        >>> folder_stem("Café de l'Été / terrasse", datetime(2026, 5, 4, 17, 5))
        '2026-05-04-1705-cafe-de-l-ete-terrasse'
    """
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    slug = re.sub(r"[^a-z0-9]+", "-", letters).strip("-")[:48].strip("-")
    when = f"{made_at.year:04d}-{made_at:%m-%d-%H%M}"
    return f"{when}-{slug or 'place'}"


def told_by_folder(folder_name: str) -> tuple[str, datetime | None]:
    """Derive the approximate name and local time of a place from the name of its folder.

    Examples:
        >>> told_by_folder("2026-05-04-1705-cafe-terrasse")[0]
        'cafe terrasse'
    """
    match = _STEM.fullmatch(folder_name)
    if match is None:
        return folder_name, None
    with contextlib.suppress(ValueError, OverflowError, OSError):
        made_at = datetime(*(int(each) for each in match.groups()[:5])).astimezone()  # type: ignore[arg-type]
        return match[6].replace("-", " "), made_at
    return folder_name, None


def free_names(stem: str, ending: str = "") -> Iterator[str]:
    """Yield ``stem``, ``stem-2``, ``stem-3`` and so on, each with an ending, up to a limit."""
    for number in range(1, _MOST_TRIES + 1):
        yield f"{stem}{'' if number == 1 else f'-{number}'}{ending}"
    raise PlaceError(
        tr("There are too many files called {stem}{ending}.", stem=stem, ending=ending)
    )


def safe_file_name(name: str) -> str:
    """Return a portable file name with the same suffix.

    Examples:
        >>> safe_file_name("R0010:12.JPG"), safe_file_name("con.jpg"), safe_file_name(".. ")
        ('R0010_12.JPG', '_con.jpg', 'file')
    """
    clean = _UNSAFE.sub("_", name.encode("utf-8", "replace").decode("utf-8"))
    stem, dot, ending = clean.strip(". ").rpartition(".")
    if not dot:
        stem, ending = ending, ""
    # Most systems limit names to 255 bytes, and a number may still be added.
    short = stem.encode()[: 200 - len(ending[:20].encode())].decode("utf-8", "ignore").strip(". ")
    full = f"{short}{dot}{ending[:20]}" if short else ending[:20]
    if _RESERVED.fullmatch(full):
        full = f"_{full}"
    return full or "file"


def publish(half: Path, target: Path) -> bool:
    """Rename a completed file unless the new name is taken.

    Returns:
        False if the name is taken, in which case nothing has changed.
    """
    if os.path.lexists(target):
        return False
    try:
        # A link fails if the name has been taken in the meantime; renaming would not.
        os.link(half, target)
    except FileExistsError:
        return False
    except OSError:
        # USB sticks and memory cards (exFAT) do not support links.
        os.rename(half, target)
        return True
    half.unlink()
    return True


def sweep(folder: Path, now_s: float | None = None) -> None:
    """Remove temporary files that are older than an hour from a place's folder."""
    limit = (time.time() if now_s is None else now_s) - _OLD_S
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            is_staging = entry.name.startswith(STAGING)
            if not is_staging and not _HALF.fullmatch(entry.name):
                continue
            with contextlib.suppress(OSError):
                if entry.stat(follow_symlinks=False).st_mtime < limit:
                    _remove(entry, is_staging)


def _remove(entry: os.DirEntry[str], is_staging: bool) -> None:
    if not is_staging and entry.is_file(follow_symlinks=False):
        os.unlink(entry.path)
    elif is_staging and entry.is_dir(follow_symlinks=False) and _only_named(entry.path):
        shutil.rmtree(entry.path)


def _only_named(folder: str) -> bool:
    """Return whether a folder contains only the file with the name of the place."""
    return all(name.startswith(("place.json", ".place-")) for name in os.listdir(folder))


ORIGINALS: Final = "originals"
"""Name of the folder in a place's folder that contains the originals."""

_MOST_FILES: Final = 200
_MOST_BYTES: Final = 1 << 31
_MOST_TOGETHER: Final = 1 << 34
_CHUNK: Final = 1 << 20
_SPARE: Final = 64 << 20  # bytes reserved for the environment computed from the originals


def adopt_files(
    folder: Path, paths: Sequence[Path], token: Token | None = None, report: Report = silent
) -> tuple[Path, ...]:
    """Copy files into the ``originals`` folder of a place.

    A copy gets its final name once it is complete, and never replaces another file. A file whose
    content is already in the folder is not copied again.

    Raises:
        PlaceError: If a file cannot be read, is too large or changes while it is being copied, or
            if the disk is full.
    """
    token = token or Token()
    sizes = [_size_of(path) for path in paths]
    target = folder / ORIGINALS
    _check_room(folder, sizes)
    with os_errors_as(PlaceError, tr("Cannot create {target}: {reason}."), target=target):
        make_folder(target)
    sweep(target)
    together, before = max(sum(sizes), 1), 0
    copies: list[Path] = []
    for number, (path, size) in enumerate(zip(paths, sizes, strict=True), 1):
        step = Progress(Task.COPYING, number=number, count=len(paths))

        def copied(done: int, before: int = before, step: Progress = step) -> None:
            token.check()
            report(min((before + done) / together, 1.0), step)

        copied(0)
        copies.append(_adopt(path, size, target, copied))
        before += size
    report(1.0, Progress(Task.COPIED))
    return tuple(copies)


def _size_of(path: Path) -> int:
    with os_errors_as(PlaceError, tr("{path} cannot be read: {reason}."), path=path):
        about = path.stat()
    if not stat.S_ISREG(about.st_mode):
        raise PlaceError(
            tr("{path} is not an ordinary file.", path=path), tr("Choose pictures, not folders.")
        )
    if about.st_size > _MOST_BYTES:
        raise PlaceError(
            tr(
                "{name} is too large to be a picture ({size} GB).",
                name=path.name,
                size=about.st_size >> 30,
            )
        )
    return about.st_size


def _check_room(folder: Path, sizes: Sequence[int]) -> None:
    if len(sizes) > _MOST_FILES:
        raise PlaceError(
            tr(
                "{count} files are too many. A place can hold at most {most}.",
                count=len(sizes),
                most=_MOST_FILES,
            ),
            tr("Choose the frames of one bracket."),
        )
    if sum(sizes) > _MOST_TOGETHER:
        raise PlaceError(tr("These files are too large for one place."))
    with contextlib.suppress(OSError):
        free = shutil.disk_usage(folder).free
        if free < sum(sizes) + _SPARE:
            raise PlaceError(
                tr(
                    "The disk is too full for these files: {needed} MB are needed, "
                    "but only {free} MB are free.",
                    needed=sum(sizes) >> 20,
                    free=free >> 20,
                ),
                tr("Free some space, or choose another places folder in Settings."),
            )


def _adopt(path: Path, size: int, target: Path, on_bytes: _OnBytes) -> Path:
    if path.resolve().parent == target.resolve():
        return target / path.name
    half, checksum = _copy(path, size, target, on_bytes)
    try:
        name = safe_file_name(path.name)
        stem, dot, ending = name.rpartition(".")
        with os_errors_as(PlaceError, tr("{name} was not copied: {reason}."), name=path.name):
            for free in free_names(stem if dot else name, f"{dot}{ending}" if dot else ""):
                final = target / free
                if publish(half, final) or _is_same(final, size, checksum):
                    return final
    finally:
        _drop(half)
    raise AssertionError("free_names never ends")  # pragma: no cover


def _copy(path: Path, size: int, target: Path, on_bytes: _OnBytes) -> tuple[Path, str]:
    """Copy to a temporary file, flush it to disk, and return its path and SHA-256 checksum."""
    half: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=".adopt-", suffix=".part", dir=target)
        half = Path(name)
        with os.fdopen(handle, "wb") as out, path.open("rb") as source:
            checksum, done = _pour(source, out, size, on_bytes)
            about = os.fstat(source.fileno())
        if done == about.st_size == size:
            half.chmod(0o600 if is_private(target) else 0o666 & ~umask())
            os.utime(half, ns=(about.st_atime_ns, about.st_mtime_ns))
            return half, checksum
    except OSError as error:
        _drop(half)
        raise PlaceError(
            tr("{name} was not copied: {reason}.", name=path.name, reason=words_of(error)),
            tr("Your file is unchanged."),
        ) from error
    except BaseException:
        _drop(half)
        raise
    _drop(half)
    raise PlaceError(
        tr("{name} changed while it was being copied.", name=path.name),
        tr("Wait until it is complete, then try again."),
    )


def _pour(source: BinaryIO, out: BinaryIO, size: int, on_bytes: _OnBytes) -> tuple[str, int]:
    """Copy at most one block more than `size`, and return the SHA-256 and the byte count."""
    total = hashlib.sha256()
    done = 0
    while done <= size and (chunk := source.read(_CHUNK)):
        out.write(chunk)
        total.update(chunk)
        done += len(chunk)
        on_bytes(done)
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
