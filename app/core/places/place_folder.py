"""Create, read, write and rename the folder of a place.

    ROOT/<folder>/place.json         record of the place, always replaced as a whole
    ROOT/<folder>/environment-*.exr  the light, with a new file for each new capture
    ROOT/<folder>/thumbnail.png      thumbnail for lists
    ROOT/<folder>/originals/         copies of the user's files
    ROOT/<folder>/background.points  cache of the panorama's feature points for the Turn step
    ROOT/<folder>/capture*/          sessions of captures, with the camera's own files
    ROOT/.trash/                     deleted places

``place.json`` is written last, after all files that it names are complete, so a crash at any moment
leaves either the old or the new state. It is replaced atomically, under a lock on disks that
support locks. If another process has written a version in the meantime, that version is kept as
``place.json.conflict``.

If a place does not exist or the disk fails, functions raise `PlaceError` and change nothing.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
import uuid
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from app.core.base.atomic_files import make_folder, os_errors_as
from app.core.base.errors import CoreError
from app.core.base.remarks import Remark
from app.core.environment.environment import read_environment
from app.core.places.files.originals import (
    LITTER,
    ORIGINALS,
    STAGING,
    folder_stem,
    free_names,
    sweep,
    told_by_folder,
)
from app.core.places.journal import JOURNAL
from app.core.places.place import (
    Place,
    PlaceError,
    by_the_rule_before,
    clean_name,
    clean_notes,
    clean_tags,
)
from app.core.places.remarks import (
    CopyFailed,
    CopyKept,
    FromNewer,
    JudgedAnew,
    LightFoundAgain,
    LightMissing,
    LostPart,
    PartLost,
    PlaceUnreadable,
    Unfinished,
)
from app.core.places.saved.place_json import (
    ENVIRONMENT_NAME,
    VERSION,
    place_of,
    summary_of,
    to_json,
    unreadable,
    version_of,
)
from app.core.places.saved.saved_verdict import SavedAnswer, flow_of, saved_answers
from app.core.portrait.ratio_and_glare import Flow
from app.core.solver.place_light import PlaceLight, prepare
from app.core.storage.data_lock import writing
from app.core.storage.json_file import JsonFile, keep_bad, read_json, write_json
from app.core.text import tr

State: TypeAlias = Literal["whole", "unfinished", "damaged", "newer"]

PLACE: Final = "place.json"
"""Name of the file that makes a folder a place."""

THUMBNAIL: Final = "thumbnail.png"
"""Name of the thumbnail."""

MOST_BYTES: Final = 16 << 20
"""Maximum size of a ``place.json`` that is read, in bytes."""

_MOST_THUMBNAIL: Final = 8 << 20
MERGED: Final = "environment.exr"
"""Name of the merged light in a capture's session folder."""

_CAPTURE: Final = "capture"
EARLIEST: Final = datetime(1970, 1, 1, tzinfo=UTC)
"""Time of a place whose time is unknown."""


@dataclass(frozen=True, slots=True)
class PlaceSummary:
    """A summary of a place, for use in lists."""

    folder: Path
    name: str
    made_at: datetime
    thumbnail: Path | None = None
    trouble: Remark | None = None  # problem of the place, or None if there is none
    # "unfinished": a folder with content that can be resumed. Places in every state can be opened
    # with `read_place`
    state: State = "whole"
    has_light: bool = False
    # capture folders of the place, newest last, each a session that can be resumed
    captures: tuple[Path, ...] = field(default=())
    spot: str = ""
    # the results, and the flow of the light or None if it is unknown
    answers: tuple[SavedAnswer, ...] = ()
    flow: Flow | None = None
    tags: tuple[str, ...] = ()
    notes: str = ""


def summarise(folder: Path) -> PlaceSummary | None:
    """Return the summary of the place in a folder, or None if it contains no part of a place."""
    names = _names(folder)
    file = read_json(folder / PLACE, MOST_BYTES)
    if file.state == "missing" and not any(_is_trace(name) for name in names):
        return None
    bad: list[LostPart] = []
    facts = summary_of(file.facts, bad)
    name, made_at, environment = facts["name"], facts["made_at"], facts["environment"]
    light = environment if environment in names else newest_light(folder, names)
    state, trouble = _judge(file, bad, bool(environment) and environment not in names)
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
        answers=saved_answers(file.facts),
        flow=flow_of(file.facts.get("flow")),
        tags=clean_tags(facts["tags"]),
        notes=clean_notes(facts["notes"]),
    )


def _judge(file: JsonFile, bad: Sequence[LostPart], lightless: bool) -> tuple[State, Remark | None]:
    """Return the state of a place and a remark on its most important problem."""
    if file.state == "missing":
        return "unfinished", Unfinished()
    if file.state == "unreadable":
        return "damaged", PlaceUnreadable(file.why)
    if file.state == "damaged" or bad:
        why = file.why if file.state == "damaged" else ""
        return "damaged", PartLost(why, tuple(bad), empty=not file.facts)
    if lightless:
        return "damaged", LightMissing()
    if version_of(file.facts) > VERSION:
        return "newer", FromNewer()
    return "whole", None


def _is_trace(name: str) -> bool:
    """Return whether the name of an entry shows that its folder was meant to be a place."""
    light = re.fullmatch(ENVIRONMENT_NAME, name) is not None
    return light or name == JOURNAL or name.startswith((f"{PLACE}.bak", ".place-"))


def _names(folder: Path) -> tuple[str, ...]:
    try:
        names = sorted(os.listdir(folder))
    except OSError:
        return ()
    return (*names, JOURNAL) if capture_folders(folder) else tuple(names)


def newest_light(folder: Path, names: Sequence[str] | None = None) -> str:
    """Return the name of the newest environment in a folder, or "" if there is none."""
    names = _names(folder) if names is None else names
    lights = [name for name in names if re.fullmatch(ENVIRONMENT_NAME, name)]
    return max(lights, key=lambda name: _time_of(folder / name), default="")


def light_at(where: Path) -> PlaceLight:
    """Prepare the light from the folder of a place or from a panorama.

    Raises:
        CoreError: If the light cannot be read (see `read_environment`).
    """
    light = newest_light(where)
    return prepare(read_environment(where / light if light else where))


def _time_of(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _folder_time(folder: Path) -> datetime:
    with contextlib.suppress(OverflowError, ValueError, OSError):
        return datetime.fromtimestamp(_time_of(folder), UTC).astimezone()
    return EARLIEST


def _thumbnail(folder: Path) -> Path | None:
    path = folder / THUMBNAIL
    with contextlib.suppress(OSError):
        if path.is_file() and 0 < path.stat().st_size <= _MOST_THUMBNAIL:
            return path
    return None


def capture_folders(folder: Path) -> tuple[Path, ...]:
    """Return the capture folders of a place, oldest first.

    The place's own folder is included if a capture was made directly in it.
    """
    try:
        names = [name for name in os.listdir(folder) if name.startswith(_CAPTURE)]
    except OSError:
        return ()
    folders = (folder, *(folder / name for name in names))
    captures = [each for each in folders if (each / JOURNAL).is_file()]
    return tuple(sorted(captures, key=lambda path: (_time_of(path / JOURNAL), path.name)))


def new_capture_folder(folder: Path) -> Path:
    """Return a free name for a capture folder, without creating it.

    Raises:
        PlaceError: If there are too many capture folders.
    """
    folders = (folder / name for name in free_names(_CAPTURE))
    return next(each for each in folders if set(_listing(each)) <= LITTER)


def _listing(folder: Path) -> Sequence[str]:
    try:
        return os.listdir(folder)
    except FileNotFoundError:
        return ()
    except OSError:
        return ("?",)


def drop_merged(folder: Path) -> None:
    """Remove the merged light from capture folders, since the place itself contains it.

    The light is removed only if the camera's own files are there and can be merged again.
    """
    for session in capture_folders(folder):
        with contextlib.suppress(OSError):
            if session != folder and any((session / ORIGINALS).iterdir()):
                (session / MERGED).unlink(missing_ok=True)


def create_place(root: Path, name: str, made_at: datetime, *, spot: str = "") -> Path:
    """Create the folder of a new place.

    The folder appears either complete, with its ``place.json``, or not at all.

    Returns:
        The new folder, a child of `root`, with a name that is valid on all systems.
    """
    place = Place(name, made_at, spot=spot or uuid.uuid4().hex)
    sentence = tr("Cannot create a place in {root}: {reason}.")
    hint = tr("Choose another places folder in Settings.")
    with os_errors_as(PlaceError, sentence, hint, root=root):
        make_folder(root, private=True)
        sweep(root)
        staging = Path(tempfile.mkdtemp(prefix=STAGING, dir=root))
        try:
            staging.chmod(0o700)  # regardless of the umask
            write_place(staging, place)
            for folder_name in free_names(folder_stem(place.name, made_at)):
                if _move(staging, root / folder_name):
                    return root / folder_name
        finally:
            _drop(staging)
    raise AssertionError("free_names never ends")  # pragma: no cover


def _move(staging: Path, target: Path) -> bool:
    if os.path.lexists(target):
        return False
    try:
        staging.rename(target)
    except OSError:
        # Another process created it in the meantime; anything else is an error.
        if os.path.lexists(target):
            return False
        raise
    return True


def _drop(staging: Path) -> None:
    with contextlib.suppress(OSError):
        (staging / PLACE).unlink(missing_ok=True)
        staging.rmdir()


def write_place(folder: Path, place: Place) -> Path | None:
    """Write the record of a place atomically.

    Returns:
        The path of the version that another process has written since the place was read, or None
        if there is no such version.

    Raises:
        PlaceError: If the disk fails, or if the record could not be read back. In that case, the
            file is unchanged.
    """
    facts = to_json(place)
    bad = unreadable(place)
    if bad:
        raise PlaceError(
            tr(
                "“{name}” was not saved: {parts} cannot be written.",
                name=place.name,
                parts=", ".join(each.name for each in bad),
            )
        )
    sweep(folder)
    base = "" if place.source is None else place.source.version
    try:
        # No other process knows the folder of a new place yet.
        with _alone_in(folder) if base else contextlib.nullcontext():
            return write_json(folder / PLACE, facts, MOST_BYTES, base)
    except CoreError as error:
        raise PlaceError(
            tr("“{name}” was not saved. {message}", name=place.name, message=error.message),
            tr("The last saved version is unchanged. Free some space or choose another folder."),
        ) from error


def _alone_in(folder: Path) -> AbstractContextManager[bool]:
    """Keep other processes from writing places in the same folder."""
    root = folder.parent
    return writing(root) if root.is_dir() else contextlib.nullcontext(False)


def read_place(folder: Path) -> Place:
    """Read the record of a place, using defaults for damaged parts.

    `Place.remarks` reports the losses. A damaged file is kept as ``place.json.bak`` before it is
    replaced. If ``place.json`` is missing, the name, time and light are derived from the folder.
    """
    if not folder.is_dir():
        raise PlaceError(
            tr("There is no place at {folder}.", folder=folder),
            tr("It may have been moved or deleted."),
        )
    summary = summarise(folder)
    if summary is None:
        raise PlaceError(
            tr("{folder} is not a place.", folder=folder), tr("Choose one from the list.")
        )
    file = read_json(folder / PLACE, MOST_BYTES)
    if file.state == "unreadable":
        raise PlaceError(
            tr("“{name}” cannot be read: {why}.", name=summary.name, why=file.why),
            tr("Check {folder}.", folder=folder),
        )
    bad: list[LostPart] = []
    place = place_of(file.facts, bad, summary.name, summary.made_at)
    if place.source is not None:
        place = replace(place, source=replace(place.source, version=file.version))
    remarks = _remarks(folder, file, bad)
    if not place.environment and (file.state != "whole" or bad):
        light = newest_light(folder)
        place = replace(place, environment=light)
        if light:
            remarks.append(LightFoundAgain(light))
    if by_the_rule_before(place):
        place = replace(place, before=place.results)
        remarks.append(JudgedAnew())
    return replace(place, remarks=tuple(remarks))


def _remarks(folder: Path, file: JsonFile, bad_parts: Sequence[LostPart]) -> list[Remark]:
    remarks: list[Remark] = []
    bad = file.state == "damaged" or bool(bad_parts)
    newer = version_of(file.facts) > VERSION
    if file.state == "missing":
        remarks.append(Unfinished())
    if bad:
        remarks.append(PartLost(file.why, tuple(bad_parts), empty=not file.facts))
    if newer:
        remarks.append(FromNewer())
    if bad or newer:
        copy = keep_bad(folder / PLACE, MOST_BYTES)
        if copy is None:
            remarks.append(CopyFailed(PLACE))
        elif bad:
            remarks.append(CopyKept(copy.name))
    return remarks


def change_place(folder: Path, **changes: Any) -> Place:
    """Change fields of a saved place without renaming its folder."""
    with _alone_in(folder):
        place = replace(read_place(folder), **changes)
        write_place(folder, place)
    return place
