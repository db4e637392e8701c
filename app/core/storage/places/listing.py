"""What lists show of the places on the disk, read quickly and without ever failing."""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.core.storage.places.encoding import ENVIRONMENT_NAME, VERSION, summary_of, version_of
from app.core.storage.places.names import LITTER, free_names, told_by_folder, words_of
from app.core.storage.places.place import clean_name
from app.core.storage.settings.json_file import JsonFile, read_json

if TYPE_CHECKING:
    from collections.abc import Sequence

State: TypeAlias = Literal["whole", "unfinished", "damaged", "newer"]

PLACE: Final = "place.json"
"""Name of the file that makes a folder a place."""

THUMBNAIL: Final = "thumbnail.png"
"""Name of the small picture."""

MOST_BYTES: Final = 16 << 20
"""Largest ``place.json`` that is read."""

_MOST_THUMBNAIL: Final = 8 << 20
_CAPTURE: Final = "capture"
_SESSION: Final = "session.json"
_RECAPTURE: Final = "Open it and look, or capture here again."
_EARLIEST: Final = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class PlaceSummary:
    """What a list shows of a place.

    Attributes
    ----------
    trouble : str or None
        Why the place is not as it should be, a sentence; None when it is.
    state : {"whole", "unfinished", "damaged", "newer"}
        "unfinished": a folder that was begun, with something in it that can be gone on with.
        Each of them can be opened with `read_place`.
    captures : tuple of Path
        Folders of captures in it, the newest last; each is a session that can be gone on with.
    """

    folder: Path
    name: str
    made_at: datetime
    thumbnail: Path | None = None
    trouble: str | None = None
    state: State = "whole"
    has_light: bool = False
    captures: tuple[Path, ...] = field(default=())
    spot: str = ""


def list_places(root: Path) -> tuple[PlaceSummary, ...]:
    """List all places in a folder.

    Only small files are read; nothing that lies there makes it fail.

    Returns
    -------
    tuple of PlaceSummary
        The newest first. Damaged and unfinished ones are in it with the reason. Folders that never
        were places are left out.
    """
    try:
        with os.scandir(root) as entries:
            folders = [Path(each.path) for each in entries if _may_be_place(each)]
    except FileNotFoundError:
        return ()
    except OSError as error:
        trouble = f"The folder of places {root} cannot be read: {words_of(error)}."
        return (PlaceSummary(root, root.name, _EARLIEST, None, trouble, "damaged"),)
    found = [summary for folder in folders if (summary := summarise(folder)) is not None]
    return tuple(sorted(found, key=lambda each: (each.made_at, each.folder.name), reverse=True))


def _may_be_place(entry: os.DirEntry[str]) -> bool:
    try:
        return not entry.name.startswith(".") and entry.is_dir()
    except OSError:
        return False


def summarise(folder: Path) -> PlaceSummary | None:
    """Say of one folder what a list shows of it.

    Returns
    -------
    PlaceSummary or None
        None for a folder that holds nothing of a place.
    """
    names = _names(folder)
    file = read_json(folder / PLACE, MOST_BYTES)
    if file.state == "missing" and not any(_is_trace(name) for name in names):
        return None
    lost: list[str] = []
    name, made_at, environment = summary_of(file.facts, lost)
    light = environment if environment in names else newest_light(folder, names)
    state, trouble = _judge(file, lost, bool(environment) and environment not in names)
    spot = file.facts.get("spot")
    told_name, told_time = told_by_folder(folder.name)
    return PlaceSummary(
        folder=folder,
        name=clean_name(name or told_name),
        made_at=made_at or told_time or _folder_time(folder),
        thumbnail=_thumbnail(folder),
        trouble=trouble,
        state=state,
        has_light=bool(light),
        captures=capture_folders(folder),
        spot=spot if isinstance(spot, str) else "",
    )


def _judge(file: JsonFile, lost: Sequence[str], lightless: bool) -> tuple[State, str | None]:
    """Find the most important thing to say about a place."""
    if file.state == "missing":
        return "unfinished", "This place was begun but not finished. What was captured is kept."
    if file.state == "unreadable":
        return "damaged", f"This place cannot be read: {file.why}."
    if file.state == "damaged":
        return "damaged", f"A part of this place cannot be read: {file.why}. {_RECAPTURE}"
    if lost:
        return "damaged", f"A part of this place cannot be read: {', '.join(lost)}. {_RECAPTURE}"
    if lightless:
        return "damaged", "The light of this place is missing. Capture here again."
    if version_of(file.facts) > VERSION:
        return "newer", "This place was kept by a newer Turnlight. Update this one to see it all."
    return "whole", None


def _is_trace(name: str) -> bool:
    """Whether an entry shows that its folder was meant as a place."""
    light = re.fullmatch(ENVIRONMENT_NAME, name) is not None
    return light or name == _SESSION or name.startswith((f"{PLACE}.bak", ".place-"))


def _names(folder: Path) -> tuple[str, ...]:
    try:
        names = sorted(os.listdir(folder))
    except OSError:
        return ()
    return (*names, _SESSION) if capture_folders(folder) else tuple(names)


def newest_light(folder: Path, names: Sequence[str] | None = None) -> str:
    """Name the environment in a folder that was written last; "" where there is none."""
    names = _names(folder) if names is None else names
    lights = [name for name in names if re.fullmatch(ENVIRONMENT_NAME, name)]
    return max(lights, key=lambda name: _time_of(folder / name), default="")


def _time_of(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _folder_time(folder: Path) -> datetime:
    with contextlib.suppress(OverflowError, ValueError, OSError):
        return datetime.fromtimestamp(_time_of(folder), UTC).astimezone()
    return _EARLIEST


def _thumbnail(folder: Path) -> Path | None:
    path = folder / THUMBNAIL
    with contextlib.suppress(OSError):
        if path.is_file() and 0 < path.stat().st_size <= _MOST_THUMBNAIL:
            return path
    return None


def capture_folders(folder: Path) -> tuple[Path, ...]:
    """Return the folders of captures in a place that were begun, the oldest first.

    The place's own folder is one of them where the capture was made right in it.
    """
    try:
        names = [name for name in os.listdir(folder) if name.startswith(_CAPTURE)]
    except OSError:
        return ()
    folders = (folder, *(folder / name for name in names))
    found = [each for each in folders if (each / _SESSION).is_file()]
    return tuple(sorted(found, key=lambda path: (_time_of(path / _SESSION), path.name)))


def new_capture_folder(folder: Path) -> Path:
    """Name a folder in a place for one more capture; it is not made.

    Raises
    ------
    PlaceError
        When there are too many.
    """
    for name in free_names(_CAPTURE):
        if set(_listing(folder / name)) <= LITTER:
            return folder / name
    raise AssertionError("free_names never ends")  # pragma: no cover


def _listing(folder: Path) -> Sequence[str]:
    try:
        return os.listdir(folder)
    except FileNotFoundError:
        return ()
    except OSError:
        return ("?",)
