"""Deleting places so that it can be taken back.

A deleted place lies whole in ``ROOT/.trash``: in the same folder as the others, so that moving it
is one act of the file system on whatever disk that is, and so that no folder of the user's own is
ever taken for the trash. The program never removes anything from it: originals are in there, too.
"""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from app.core.storage.places.listing import summarise
from app.core.storage.places.names import words_of
from app.core.storage.places.place import PlaceError

if TYPE_CHECKING:
    from pathlib import Path

TRASH: Final = ".trash"
"""Name of the folder in the folder of places."""

_ENTRY: Final = re.compile(r"(\d{8}T\d{6}Z)--(.+?)(?:~\d+)?")
_WHEN: Final = "%Y%m%dT%H%M%SZ"


@dataclass(frozen=True, slots=True)
class TrashedPlace:
    """A place that was deleted."""

    folder: Path
    name: str
    deleted_at: datetime


def delete_place(folder: Path, now: datetime | None = None) -> Path:
    """Move a place to the trash, whole.

    Raises
    ------
    PlaceError
        When it is not a place, or cannot be moved; then it is where it was.
    """
    if folder.is_symlink() or summarise(folder) is None:
        raise PlaceError(f"There is no place at {folder}.", "It may have been deleted already.")
    when = (now or datetime.now(UTC)).astimezone(UTC).strftime(_WHEN)
    trash = folder.parent / TRASH
    try:
        trash.mkdir(exist_ok=True)
        return _move(folder, trash, f"{when}--{folder.name}", "~")
    except OSError as error:
        raise PlaceError(
            f"The place was not deleted: {words_of(error)}.", "It is where it was."
        ) from error


def restore_place(trashed: Path) -> Path:
    """Bring a place back from the trash.

    Returns
    -------
    Path
        Its folder: the one it had, or one with a number where that is taken.

    Raises
    ------
    PlaceError
        When it is not in the trash any more, or cannot be moved.
    """
    entry = _ENTRY.fullmatch(trashed.name)
    if entry is None or trashed.parent.name != TRASH or not trashed.is_dir():
        raise PlaceError("This place is not in the trash any more.", "Look at the list of places.")
    try:
        return _move(trashed, trashed.parent.parent, entry[2], "-")
    except OSError as error:
        raise PlaceError(
            f"The place was not brought back: {words_of(error)}.", f"It is kept in {trashed}."
        ) from error


def _move(folder: Path, target: Path, name: str, mark: str) -> Path:
    for number in range(1, 10_000):
        aside = target / (name if number == 1 else f"{name}{mark}{number}")
        if os.path.lexists(aside):
            continue
        folder.rename(aside)
        return aside
    raise PlaceError(f"There are too many called {name} in {target}.")


def list_trash(root: Path) -> tuple[TrashedPlace, ...]:
    """List the deleted places that can be brought back, the last deleted first."""
    found = ((summarise(path), when) for when, path in sorted(_entries(root), reverse=True))
    return tuple(TrashedPlace(one.folder, one.name, when) for one, when in found if one is not None)


def _entries(root: Path) -> list[tuple[datetime, Path]]:
    """Find what `delete_place` put into the trash; anything else there is let alone."""
    entries = []
    with contextlib.suppress(OSError):
        for path in (root / TRASH).iterdir():
            match = _ENTRY.fullmatch(path.name)
            if match is None or path.is_symlink() or not path.is_dir():
                continue
            with contextlib.suppress(ValueError):
                entries.append((datetime.strptime(match[1], _WHEN).replace(tzinfo=UTC), path))
    return entries
