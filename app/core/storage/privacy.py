"""Make the user's older data private.

Places contain photos of people and the locations where the photos were taken. New folders and files
are created private (`core.base.atomic_files`). This module is for older data folders. It does not
touch links, files that belong to other users, files with a second hard link, or anything from other
programs.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from app.core.base.progress import Token
from app.core.places.place_folder import PLACE
from app.core.places.place_list import TRASH

_FOLDERS: Final = frozenset({"places", "styles", "drafts", "lamps", "heads", "locks", "logs"})
_FILES: Final = re.compile(r"\.?(settings|window|last-camera|owed-cameras)[.-].*")
_FOLDER_MODE: Final = 0o700
_FILE_MODE: Final = 0o600


def tighten(home: Path, places: Path, token: Token) -> int:
    """Remove other users' permissions from a data folder and from places stored elsewhere.

    Returns:
        The number of folders and files that were accessible to others.
    """
    if os.name != "posix":
        return 0  # on Windows, only the user has access to their profile
    count = 0
    for path in _ours(home, places):
        for entry in _walk(path):
            token.check()
            count += _close(entry)
    if _is_ours(home):
        count += _close(home)
    return count


def _ours(home: Path, places: Path) -> Iterator[Path]:
    yield from (each for each in _entries(home) if _has_our_name(each))
    if places != home / "places":
        # The user chose the folder and may keep other files in it.
        inside = _entries(places)
        yield from (each for each in inside if (each / PLACE).is_file() or each.name == TRASH)


def _is_ours(home: Path) -> bool:
    entries = _entries(home)
    return bool(entries) and all(map(_has_our_name, entries))


def _has_our_name(path: Path) -> bool:
    return path.name in _FOLDERS or _FILES.fullmatch(path.name) is not None


def _entries(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _walk(path: Path) -> Iterator[Path]:
    yield path
    if path.is_dir() and not path.is_symlink():
        for each in _entries(path):
            yield from _walk(each)


def _close(path: Path) -> bool:
    """Make a folder or file private and return whether it was accessible to others."""
    with contextlib.suppress(OSError):
        about = path.lstat()
        folder = stat.S_ISDIR(about.st_mode)
        if about.st_uid != os.getuid() or not (folder or stat.S_ISREG(about.st_mode)):
            return False
        if not folder and about.st_nlink > 1:
            return False
        mode = stat.S_IMODE(about.st_mode) & (_FOLDER_MODE if folder else _FILE_MODE)
        if mode != stat.S_IMODE(about.st_mode):
            path.chmod(mode)
            return True
    return False
