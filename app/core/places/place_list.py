"""List, delete and restore the places in a folder.

A deleted place is moved as a whole to ``ROOT/.trash``. The trash is in the same folder as the
places. The move is therefore a single rename on any disk, and none of the user's folders is
mistaken for the trash. Only `empty_trash` removes anything from the trash, since the trash contains
originals.

If a place does not exist or the disk fails, functions raise `PlaceError` and change nothing.
Functions that list places never fail.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from app.core.base.atomic_files import make_folder, os_errors_as, words_of
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.places.place import PlaceError
from app.core.places.place_folder import EARLIEST, PlaceSummary, summarise
from app.core.places.remarks import FolderUnreadable
from app.core.text import tr

TRASH: Final = ".trash"
"""Name of the trash folder in the folder of places."""

_ENTRY: Final = re.compile(r"(\d{8}T\d{6}Z)--(.+?)(?:~\d+)?")
_WHEN: Final = "%Y%m%dT%H%M%SZ"
_GOING: Final = ".going-"


def list_places(root: Path) -> tuple[PlaceSummary, ...]:
    """List all places in a folder, newest first.

    Only small files are read, and their content never raises an error. Damaged and unfinished
    places are listed with a reason. Folders that were never places are left out.
    """
    try:
        with os.scandir(root) as entries:
            folders = [Path(each.path) for each in entries if _may_be_place(each)]
    except FileNotFoundError:
        return ()
    except OSError as error:
        trouble = FolderUnreadable(root, words_of(error))
        return (PlaceSummary(root, root.name, EARLIEST, None, trouble, "damaged"),)
    summaries = [summary for folder in folders if (summary := summarise(folder)) is not None]
    return tuple(sorted(summaries, key=lambda each: (each.made_at, each.folder.name), reverse=True))


def _may_be_place(entry: os.DirEntry[str]) -> bool:
    try:
        return not entry.name.startswith(".") and entry.is_dir()
    except OSError:
        return False


@dataclass(frozen=True, slots=True)
class TrashedPlace:
    """A deleted place."""

    folder: Path
    name: str
    deleted_at: datetime


def delete_place(folder: Path, now: datetime | None = None) -> Path:
    """Move a place to the trash."""
    if folder.is_symlink() or summarise(folder) is None:
        raise PlaceError(
            tr("There is no place at {folder}.", folder=folder),
            tr("It may have been deleted already."),
        )
    when = (now or datetime.now(UTC)).astimezone(UTC).strftime(_WHEN)
    trash = folder.parent / TRASH
    sentence = tr("The place was not deleted: {reason}.")
    with os_errors_as(PlaceError, sentence, tr("It is still in its folder.")):
        make_folder(trash, private=True)
        return _move(folder, trash, f"{when}--{folder.name}", "~")


def restore_place(trashed: Path) -> Path:
    """Restore a place from the trash.

    Returns:
        The place's old folder, or a folder with a number in its name if the old one is taken.
    """
    entry = _ENTRY.fullmatch(trashed.name)
    if entry is None or trashed.parent.name != TRASH or not trashed.is_dir():
        raise PlaceError(
            tr("This place is no longer in the trash."), tr("Check the list of places.")
        )
    hint = tr("Look in {trashed}.", trashed=trashed)
    with os_errors_as(PlaceError, tr("The place was not restored: {reason}."), hint):
        return _move(trashed, trashed.parent.parent, entry[2], "-")


def _move(folder: Path, target: Path, name: str, mark: str) -> Path:
    for number in range(1, 10_000):
        aside = target / (name if number == 1 else f"{name}{mark}{number}")
        if not os.path.lexists(aside):
            folder.rename(aside)
            return aside
    raise PlaceError(
        tr("There are too many places called {name} in {target}.", name=name, target=target)
    )


def list_trash(root: Path) -> tuple[TrashedPlace, ...]:
    """List the places in the trash, most recently deleted first."""
    entries = ((summarise(path), when) for when, path in sorted(_entries(root), reverse=True))
    return tuple(
        TrashedPlace(one.folder, one.name, when) for one, when in entries if one is not None
    )


def _entries(root: Path) -> list[tuple[datetime, Path]]:
    """Return the entries that `delete_place` created in the trash, ignoring all others."""
    entries = []
    with contextlib.suppress(OSError):
        for path in (root / TRASH).iterdir():
            match = _ENTRY.fullmatch(path.name)
            if match is None or path.is_symlink() or not path.is_dir():
                continue
            with contextlib.suppress(ValueError):
                entries.append((datetime.strptime(match[1], _WHEN).replace(tzinfo=UTC), path))
    return entries


def trash_size(root: Path) -> tuple[int, int]:
    """Return the number of places in the trash and their total size in bytes."""
    entries, size = _entries(root), 0
    for _, entry in entries:
        for folder, _, names in os.walk(entry):
            for name in names:
                with contextlib.suppress(OSError):
                    size += os.lstat(os.path.join(folder, name)).st_size
    return len(entries), size


def empty_trash(root: Path, token: Token, report: Report = silent) -> int:
    """Empty the trash and return the number of places deleted.

    A place is either deleted or kept as a whole. After an interruption, the leftovers are no longer
    listed, and the next call deletes them.

    Raises:
        PlaceError: If some places cannot be deleted. All others have been deleted by then.
    """
    trash, count = root / TRASH, 0
    entries = [path for _, path in sorted(_entries(root))]
    trouble: OSError | None = None
    for number, path in enumerate(entries):
        token.check()
        report(number / len(entries), Progress(Task.DELETING, _ENTRY.sub(r"\2", path.name)))
        try:
            path.rename(path.with_name(f"{_GOING}{path.name}"))
            count += 1
        except OSError as error:
            trouble = trouble or error
            continue
        trouble = _delete_rest(trash) or trouble
    trouble = _delete_rest(trash) or trouble
    if trouble is not None:
        raise PlaceError(
            tr("The trash was not emptied: {reason}.", reason=words_of(trouble)),
            tr("Check {trash}.", trash=trash),
        ) from trouble
    return count


def _delete_rest(trash: Path) -> OSError | None:
    """Delete the unlisted leftovers and return the error if some of them cannot be deleted."""
    trouble: list[OSError] = []

    def failed(_call: object, _path: object, error: Any) -> None:
        trouble.append(error[1])

    with contextlib.suppress(OSError):
        for path in [each for each in trash.iterdir() if each.name.startswith(_GOING)]:
            shutil.rmtree(path, onerror=failed)
    return trouble[0] if trouble else None
