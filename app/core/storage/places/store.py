"""The places on the disk: making, listing, reading, writing, renaming.

    ROOT/<folder>/place.json         what is known of the place; only ever replaced as a whole
    ROOT/<folder>/environment-*.exr  the light; a new capture gets a new file
    ROOT/<folder>/thumbnail.png      for lists
    ROOT/<folder>/originals/         copies of the user's files
    ROOT/<folder>/capture*/          sessions of captures with the camera's own files
    ROOT/.trash/                     deleted places

``place.json`` is the point of no return: other files are whole before it names them, so a crash at
any moment leaves the place as it was or as it was to be. It is replaced in one act, so two
processes that write at once leave the file of one of them, whole; no lock is needed for that.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import uuid
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from app.core.base.errors import CoreError
from app.core.storage.places.encoding import VERSION, place_of, to_json, unreadable, version_of
from app.core.storage.places.listing import MOST_BYTES, PLACE, newest_light, summarise
from app.core.storage.places.names import STAGED, folder_stem, free_names, sweep, umask, words_of
from app.core.storage.places.place import Place, PlaceError
from app.core.storage.settings.json_file import JsonFile, keep_bad, read_json, write_json

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime


def create_place(root: Path, name: str, made_at: datetime, *, spot: str = "") -> Path:
    """Make a folder for a new place.

    It appears whole, with its ``place.json`` in it, or not at all.

    Returns
    -------
    Path
        The new folder, a child of `root`, whose name any system takes.

    Raises
    ------
    PlaceError
        When the folder cannot be made.
    """
    place = Place(name, made_at, spot=spot or uuid.uuid4().hex)
    staged: Path | None = None
    try:
        root.mkdir(parents=True, exist_ok=True)
        sweep(root)
        staged = Path(tempfile.mkdtemp(prefix=STAGED, dir=root))
        staged.chmod(0o777 & ~umask())
        write_place(staged, place)
        for folder_name in free_names(folder_stem(place.name, made_at)):
            if _moved(staged, root / folder_name):
                return root / folder_name
    except OSError as error:
        raise PlaceError(
            f"Cannot make a place in {root}: {words_of(error)}.",
            "Choose another folder for places in Settings.",
        ) from error
    finally:
        _drop(staged)
    raise AssertionError("free_names never ends")  # pragma: no cover


def _moved(staged: Path, target: Path) -> bool:
    if os.path.lexists(target):
        return False
    try:
        staged.rename(target)
    except OSError:
        # Somebody made it in between; anything else is an error.
        if os.path.lexists(target):
            return False
        raise
    return True


def _drop(staged: Path | None) -> None:
    if staged is not None:
        with contextlib.suppress(OSError):
            (staged / PLACE).unlink(missing_ok=True)
            staged.rmdir()


def write_place(folder: Path, place: Place) -> None:
    """Keep what is known of a place, whole or not at all.

    Raises
    ------
    PlaceError
        When the disk refuses, or something could not be read again; the file is as it was.
    """
    facts = to_json(place)
    lost = unreadable(place)
    if lost:
        raise PlaceError(f"“{place.name}” was not kept: {', '.join(lost)} cannot be.")
    sweep(folder)
    try:
        write_json(folder / PLACE, facts, MOST_BYTES)
    except CoreError as error:
        raise PlaceError(
            f"“{place.name}” was not kept. {error.message}",
            "What was kept before is untouched; make room or choose another folder.",
        ) from error


def read_place(folder: Path) -> Place:
    """Read what is known of a place, as much of it as there is.

    Returns
    -------
    Place
        `Place.remarks` says what was lost. A damaged file is kept as ``place.json.bak`` before
        anything replaces it. Where ``place.json`` is missing, name, time and light are taken from
        the folder.

    Raises
    ------
    PlaceError
        When there is no such folder, or it was never a place, or the system does not let it be
        read.
    """
    if not folder.is_dir():
        raise PlaceError(f"There is no place at {folder}.", "It may have been moved or deleted.")
    summary = summarise(folder)
    if summary is None:
        raise PlaceError(f"{folder} is not a place.", "Choose one from the list.")
    file = read_json(folder / PLACE, MOST_BYTES)
    if file.state == "unreadable":
        raise PlaceError(f"“{summary.name}” cannot be read: {file.why}.", f"Look at {folder}.")
    lost: list[str] = []
    place = place_of(file.facts, lost, summary.name, summary.made_at)
    remarks = _remarks(folder, file, lost)
    if not place.environment and (file.state != "whole" or lost):
        light = newest_light(folder)
        place = replace(place, environment=light)
        if light:
            remarks.append(f"Its light was found again in {light}.")
    return replace(place, remarks=tuple(remarks))


def _remarks(folder: Path, file: JsonFile, lost: Sequence[str]) -> list[str]:
    remarks = []
    bad = file.state == "damaged" or bool(lost)
    newer = version_of(file.facts) > VERSION
    if file.state == "missing":
        remarks.append("This place was begun but not finished; it can be gone on with.")
    if bad:
        gone = list(dict.fromkeys([*(f"“{name}”" for name in file.lost), *lost]))
        why = f": {file.why}" if file.why else ""
        named = f" Lost: {', '.join(gone)}." if gone else ""
        whole = "" if file.facts else " Only the files in its folder are left."
        remarks.append(f"A part of this place could not be read{why}.{named}{whole}")
    if newer:
        remarks.append("A newer Turnlight kept this place; what this one does not know is kept.")
    if bad or newer:
        kept = keep_bad(folder / PLACE, MOST_BYTES)
        if kept is None:
            remarks.append(f"The file as it was could not be copied; it is still {PLACE}.")
        elif bad:
            remarks.append(f"The file as it was is kept as {kept.name}.")
    return remarks


def rename_place(folder: Path, name: str) -> Place:
    """Give a place another name; its folder keeps its own.

    Raises
    ------
    PlaceError
        As `read_place` and `write_place`.
    """
    place = replace(read_place(folder), name=name)
    write_place(folder, place)
    return place
