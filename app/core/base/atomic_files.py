"""Write files atomically, and open untrusted files safely."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import stat
import tempfile
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from typing import Any, Final

from app.core.base.errors import CoreError
from app.core.base.paths import user_data
from app.core.text import tr

_NO_ROOM: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_LOCKED: Final = frozenset({errno.EROFS, errno.EACCES, errno.EPERM})
_BLOCK: Final = 1 << 20  # bytes
_PLACE: Final = "place.json"
_DEEPEST: Final = 4  # folder levels inside a place
# Each flag exists only on some systems. Opening a pipe must not wait for its writer.
_NO_WAIT: Final = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


def open_file(path: Path | str) -> io.BufferedReader:
    """Open a regular file for reading, refusing pipes and devices, which could block or never end.

    Reading a system file that has no content yet, such as /proc/kmsg, also raises `OSError`.

    Raises:
        OSError: If the file cannot be opened, or is a folder, pipe, socket or device.
    """
    handle = os.open(path, os.O_RDONLY | _NO_WAIT)
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return io.BufferedReader(_Readable(handle, "rb"))
    os.close(handle)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    raise _no_file(os.fspath(path))


class _Readable(io.FileIO):
    """A file that raises `OSError` instead of waiting for content."""

    def readinto(self, buffer: Any, /) -> int:
        count = super().readinto(buffer)
        if count is None:
            raise _no_file(None)
        return count

    def readall(self) -> bytes:
        data = super().readall()
        if data is None:
            raise _no_file(None)
        return data


def _no_file(name: str | bytes | None) -> OSError:
    return OSError(errno.EINVAL, tr("it is not an ordinary file"), name)


def check_target(path: Path | str) -> Path:
    """Check that a file can be written, before minutes are spent computing its content.

    Raises:
        CoreError: If the path is a folder, a device or a write-protected file, or if its folder is
            missing or not writable.
    """
    target = Path(path)
    folder = target.parent
    with os_errors_as(CoreError, tr("Cannot write {target}: {reason}."), target=target):
        try:
            mode = target.stat().st_mode
        except (FileNotFoundError, NotADirectoryError):
            mode = stat.S_IFREG
    if stat.S_ISDIR(mode):
        raise CoreError(
            tr("Cannot write {target}: it is a folder.", target=target), tr("Add a file name.")
        )
    if not stat.S_ISREG(mode):
        raise CoreError(
            tr("Cannot write {target}: it is not an ordinary file.", target=target),
            tr("Choose another file name."),
        )
    if not folder.is_dir():
        raise CoreError(
            tr(
                "Cannot write {target}: the folder {folder} does not exist.",
                target=target,
                folder=folder,
            ),
            tr("Create the folder first."),
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise CoreError(
            tr(
                "Cannot write {target}: the folder {folder} is not writable.",
                target=target,
                folder=folder,
            ),
            tr("Choose another folder."),
        ) from PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    if target.exists() and not os.access(target, os.W_OK):
        # The folder would allow the file to be replaced, but somebody has write-protected the file.
        raise CoreError(
            tr("Cannot write {target}: the file is write-protected.", target=target),
            tr("Choose another name."),
        )
    return target


def is_private(path: Path | str) -> bool:
    """Return whether a path must be private since the data folder or a saved place contains it."""
    full = Path(os.path.realpath(path))
    if full.is_relative_to(os.path.realpath(user_data())):
        return True
    return any((each / _PLACE).is_file() for each in (full, *full.parents)[: _DEEPEST + 1])


def make_folder(folder: Path, *, private: bool | None = None) -> None:
    """Create a folder and its missing parents, leaving existing folders unchanged.

    Args:
        private: Whether only the user may open the folder, or None to follow `is_private`.

    Raises:
        OSError: If the folder cannot be created.
    """
    missing = []
    for each in (folder, *folder.parents):
        if each.exists():
            break
        missing.append(each)
    for each in reversed(missing):
        own = is_private(each) if private is None or each != folder else private
        each.mkdir(0o700 if own else 0o777, exist_ok=True)
        if own:
            each.chmod(0o700)  # regardless of the umask
    if not missing:
        folder.mkdir(exist_ok=True)


def file_opener(path: str, flags: int) -> int:
    """Open a file, with owner-only permissions if it is private.

    Pass this function to `open` as its `opener`.
    """
    return os.open(path, flags, 0o600 if is_private(path) else 0o666)


def atomic_write(
    path: Path | str, writer: Callable[[Path], object], *, private: bool | None = None
) -> None:
    """Write a file atomically: a failure never leaves a partial file.

    `writer` fills a temporary file in the same folder, which is then flushed to disk and renamed
    to `path`. If anything fails, the temporary file is removed and the old file is left untouched.

    Args:
        writer: Function that receives the path of an empty temporary file. The file has the same
            suffix as `path`, because image libraries choose the format from the suffix.
        private: Whether only the user may read the file, or None to follow `is_private`.

    Raises:
        CoreError: If the folder is missing or not writable, or the disk is full or disconnected.
    """
    target = check_target(path)
    own = is_private(target) if private is None else private
    temporary = _temporary_beside(target, private=own)
    try:
        writer(temporary)
        _flush(temporary)
        # Follow a link, so that its target is replaced rather than the link.
        os.replace(temporary, target.resolve())
    except OSError as error:
        raise _write_error(target, error) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()
    flush_folder(target.parent)


def atomic_write_bytes(path: Path | str, data: bytes, *, private: bool | None = None) -> None:
    """Atomically write bytes, with the same options and errors as `atomic_write`."""
    atomic_write(path, lambda temporary: temporary.write_bytes(data), private=private)


def atomic_write_text(path: Path | str, text: str) -> None:
    r"""Atomically write text as UTF-8 with ``\n`` line endings.

    Raises:
        CoreError: If the file cannot be written (see `atomic_write`).
    """
    # File names may contain bytes that are not text.
    atomic_write_bytes(path, text.encode("utf-8", "backslashreplace"))


def words_of(error: OSError | ValueError) -> str:
    """Return the operating system's message for an error."""
    reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return reason.rstrip(".").lower()


@contextlib.contextmanager
def os_errors_as(
    kind: Callable[[str, str], Exception], sentence: str, hint: str = "", **values: object
) -> Iterator[None]:
    """Convert an `OSError` or `ValueError` raised in the block to one of the program's own errors.

    `sentence` is already translated but not yet formatted. `values` fill its placeholders, and
    {reason} is replaced with the system's message.

    Examples:
        >>> with os_errors_as(CoreError, tr("There is no {name}: {reason}."), name="x"):
        ...     open("/no/such/file")
        Traceback (most recent call last):
        app.core.base.errors.CoreError: There is no x: no such file or directory.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        raise kind(sentence.format(**values, reason=words_of(error)), hint) from error


class DiskTrouble(Enum):
    """The reason why a file could not be written."""

    FULL = "full"
    LOCKED = "locked"  # read-only, or no permission to write


def disk_trouble(error: BaseException) -> DiskTrouble | None:
    """Return the disk problem that caused an error, or None if the disk was not the cause."""
    codes = {one.errno for one in _causes(error) if isinstance(one, OSError)}
    if codes & _NO_ROOM:
        return DiskTrouble.FULL
    return DiskTrouble.LOCKED if codes & _LOCKED else None


def write_trouble(path: Path, size: int) -> OSError | None:
    """Append `size` bytes to a file and return the system's error, or None if there is none.

    An image library may report a failure without the system's error code. This function finds the
    reason.
    """
    block = bytes(min(size, _BLOCK))
    try:
        with path.open("ab") as stream:
            for _ in range(0, size, _BLOCK):
                stream.write(block)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        return error
    return None


def is_full(error: BaseException) -> bool:
    """Return whether a full disk caused an error."""
    return disk_trouble(error) is DiskTrouble.FULL


def _causes(error: BaseException) -> Iterator[BaseException]:
    here: BaseException | None = error
    for _ in range(10):
        if here is None:
            return
        yield here
        here = here.__cause__


def _write_error(target: Path, error: OSError) -> CoreError:
    hint = tr("Free some space, or choose another folder.") if error.errno in _NO_ROOM else ""
    return CoreError(
        tr("Cannot write {target}: {reason}.", target=target, reason=words_of(error)), hint
    )


def _temporary_beside(target: Path, *, private: bool) -> Path:
    """Create an empty file next to the target, with the permissions that the target will have."""
    folder = target.resolve().parent
    # Image libraries accept only names that are text.
    stem = target.stem[:40].encode("utf-8", "replace").decode()
    try:
        handle, name = tempfile.mkstemp(prefix=f".{stem}-", suffix=target.suffix, dir=folder)
        os.close(handle)
        temporary = Path(name)
        # mkstemp makes the file private, but most results need ordinary permissions.
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~umask()
        temporary.chmod(mode & 0o600 | 0o600 if private else mode)
    except OSError as error:
        raise _write_error(target, error) from error
    return temporary


def umask() -> int:
    """Return the umask of the process."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _flush(path: Path) -> None:
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())


def flush_folder(folder: Path) -> None:
    """Flush a rename to disk, except on Windows, where a folder cannot be opened."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
