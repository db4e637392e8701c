"""Names on the disk: folders for places, files beside each other, and what killed writes left."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import time
import unicodedata
from datetime import datetime
from typing import TYPE_CHECKING, Final

from app.core.storage.places.place import PlaceError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

LITTER: Final = frozenset({".DS_Store", "Thumbs.db", "desktop.ini", ".directory"})
"""What systems leave in folders by themselves."""

STAGED: Final = ".new-"
"""How the name of a folder begins that is not a place yet."""

# Half-written files: of `atomic_write` (".NAME-xxxxxxxx.END") and of `adopt_files`.
_HALF: Final = re.compile(
    r"\.(place|environment|thumbnail)-.+\.(json|exr|png|bak)|\.adopt-[0-9a-z_]+\.part"
)
_STEM: Final = re.compile(r"(\d{4})-(\d\d)-(\d\d)-(\d\d)(\d\d)-([a-z0-9-]+)")
_OLD_S: Final = 3600.0  # nobody writes one file for an hour
_MOST_TRIES: Final = 10_000
_UNSAFE: Final = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')
_RESERVED: Final = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)


def folder_stem(name: str, made_at: datetime) -> str:
    """Make a folder's name of a place's name that any system takes.

    Examples
    --------
    >>> from datetime import datetime
    >>> folder_stem("Café de l'Été / terrasse", datetime(2026, 5, 4, 17, 5))
    '2026-05-04-1705-cafe-de-l-ete-terrasse'
    """
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    slug = re.sub(r"[^a-z0-9]+", "-", letters).strip("-")[:48].strip("-")
    when = f"{made_at.year:04d}-{made_at:%m-%d-%H%M}"
    return f"{when}-{slug or 'place'}"


def told_by_folder(folder_name: str) -> tuple[str, datetime | None]:
    """Read back what a folder's name says of its place: roughly the name, and the local time.

    Examples
    --------
    >>> told_by_folder("2026-05-04-1705-cafe-terrasse")[0]
    'cafe terrasse'
    """
    found = _STEM.fullmatch(folder_name)
    if found is None:
        return folder_name, None
    with contextlib.suppress(ValueError, OverflowError, OSError):
        made_at = datetime(*(int(each) for each in found.groups()[:5])).astimezone()  # type: ignore[arg-type]
        return found[6].replace("-", " "), made_at
    return folder_name, None


def free_names(stem: str, ending: str = "") -> Iterator[str]:
    """Yield ``stem``, ``stem-2``, ``stem-3`` ... with an ending, up to a limit.

    Raises
    ------
    PlaceError
        After ten thousand of them.
    """
    for number in range(1, _MOST_TRIES + 1):
        yield f"{stem}{'' if number == 1 else f'-{number}'}{ending}"
    raise PlaceError(f"There are too many called {stem}{ending}.")


def safe_file_name(name: str) -> str:
    """Make any name one that every system takes, with its ending kept.

    Examples
    --------
    >>> safe_file_name("R0010:12.JPG"), safe_file_name("con.jpg"), safe_file_name(".. ")
    ('R0010_12.JPG', '_con.jpg', 'file')
    """
    clean = _UNSAFE.sub("_", name.encode("utf-8", "replace").decode("utf-8"))
    stem, dot, ending = clean.strip(". ").rpartition(".")
    if not dot:
        stem, ending = ending, ""
    # 255 bytes are the limit nearly everywhere; a number may still be added.
    short = stem.encode()[: 200 - len(ending[:20].encode())].decode("utf-8", "ignore").strip(". ")
    full = f"{short}{dot}{ending[:20]}" if short else ending[:20]
    if _RESERVED.fullmatch(full):
        full = f"_{full}"
    return full or "file"


def publish(half: Path, target: Path) -> bool:
    """Give a whole file its name, unless something has that name already.

    Returns
    -------
    bool
        False when the name is taken; then nothing has changed.
    """
    if os.path.lexists(target):
        return False
    try:
        # Fails where the name has been taken in between, which renaming would not.
        os.link(half, target)
    except FileExistsError:
        return False
    except OSError:
        # Sticks and cards (exFAT) know no links.
        os.rename(half, target)
        return True
    half.unlink()
    return True


def sweep(folder: Path, now_s: float | None = None) -> None:
    """Remove what killed writes left in a place's folder an hour ago or longer."""
    limit = (time.time() if now_s is None else now_s) - _OLD_S
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            staged = entry.name.startswith(STAGED)
            if not staged and not _HALF.fullmatch(entry.name):
                continue
            with contextlib.suppress(OSError):
                if entry.stat(follow_symlinks=False).st_mtime < limit:
                    _remove(entry, staged)


def _remove(entry: os.DirEntry[str], staged: bool) -> None:
    if not staged and entry.is_file(follow_symlinks=False):
        os.unlink(entry.path)
    elif staged and entry.is_dir(follow_symlinks=False) and _only_named(entry.path):
        shutil.rmtree(entry.path)


def _only_named(folder: str) -> bool:
    """Whether there is nothing but the file that was to say what the place is called."""
    return all(name.startswith(("place.json", ".place-")) for name in os.listdir(folder))


def umask() -> int:
    """Return which permissions new files and folders do not get."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def words_of(error: OSError) -> str:
    """Return the system's own words for what went wrong."""
    return (error.strerror or str(error) or type(error).__name__).rstrip(".").lower()
