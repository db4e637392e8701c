"""Lock the user's folders against concurrent writes.

The operating system holds a lock and releases it when the process ends, however that happens. There
is therefore nothing to recover after a kill, a power cut or the reuse of a process ID. Some network
folders and read-only disks do not support locks. There, `app.core.storage.json_file.write_json`
compares versions instead.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.atomic_files import make_folder
from app.core.base.paths import user_data

if TYPE_CHECKING:
    from filelock import BaseFileLock

WINDOW_LOCK: Final = "window.lock"
"""Name of the file, in a data folder, that the open window locks."""

LOCKS: Final = "locks"
"""Name of the folder, in a data folder, that contains the files locked during writes."""

_PATIENCE_S: Final = 5.0


class Owner(Enum):
    """The owner of the lock on a data folder."""

    US = "us"
    ANOTHER_PROCESS = "another process"
    NOBODY = "nobody"  # the file system has no locks, or is not writable


@dataclass(frozen=True, slots=True)
class WindowLock:
    """A lock that lets only one window use a data folder."""

    owner: Owner
    _lock: BaseFileLock | None = field(default=None, repr=False)

    def release(self) -> None:
        """Release the lock."""
        if self._lock is not None:
            self._lock.release()


def lock_window(home: Path) -> WindowLock:
    """Try to lock a data folder for one window, creating the folder if it is missing."""
    path = home / WINDOW_LOCK
    try:
        make_folder(home, private=True)
        lock = _file_lock(path, 0.0)
        _acquire(lock)
    except TimeoutError:
        # FileLock also times out if it cannot create the file.
        is_locked = os.path.lexists(path)
        return WindowLock(Owner.ANOTHER_PROCESS if is_locked else Owner.NOBODY)
    except (OSError, NotImplementedError):
        return WindowLock(Owner.NOBODY)
    return WindowLock(Owner.US, lock)


@contextlib.contextmanager
def writing(folder: Path) -> Iterator[bool]:
    """Lock a folder for writing, with a reentrant lock.

    Yields:
        Whether other processes are locked out. They are not if the folder does not support locks,
        or if another process does not finish within seconds. In that case, the caller compares its
        version with that of the file.
    """
    lock = None
    with contextlib.suppress(OSError, NotImplementedError):
        # The lock file is elsewhere, since the user may keep other files in the folder.
        locks, name = user_data() / LOCKS, os.path.realpath(folder)
        make_folder(locks, private=True)
        digest = hashlib.sha256(os.fsencode(name)).hexdigest()[:32]
        candidate = _file_lock(locks / f"{digest}.lock", _PATIENCE_S)
        _acquire(candidate)
        lock = candidate
    try:
        yield lock is not None
    finally:
        if lock is not None:
            lock.release()


def _file_lock(path: Path, timeout_s: float) -> BaseFileLock:
    # Slow to import, and not every command writes.
    from filelock import FileLock

    one = timeout_s > 0.0  # the window's lock is released by whichever thread ends the window
    return FileLock(path, timeout=timeout_s, mode=0o600, is_singleton=one, thread_local=one)


def _acquire(lock: BaseFileLock) -> None:
    with warnings.catch_warnings():
        # Missing locks on a network folder need no warning.
        warnings.simplefilter("ignore")
        lock.acquire()
