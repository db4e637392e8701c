"""Save a place in its own folder or in a new one, or recreate its own folder from memory."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import replace
from enum import Enum
from pathlib import Path

from app.core.base.atomic_files import make_folder, os_errors_as
from app.core.base.progress import Token
from app.core.places.files.light import store_environment
from app.core.places.files.originals import ORIGINALS, adopt_files
from app.core.places.place import OpenPlace, Place, PlaceError
from app.core.places.place_folder import PLACE, create_place, drop_merged, read_place, write_place
from app.core.solver.place_light import PlaceLight
from app.core.text import tr


class FolderState(Enum):
    """State of the folder of the open place."""

    THERE = "there"
    GONE = "gone"  # deleted, moved or renamed
    UNPLUGGED = "unplugged"  # the folder of places is missing as well
    CLOSED = "closed"  # write-protected


def folder_state(folder: Path) -> FolderState:
    """Return the state of a place's folder."""
    if not folder.parent.is_dir():
        return FolderState.UNPLUGGED
    if not (folder / PLACE).is_file():
        return FolderState.GONE
    return FolderState.THERE if os.access(folder, os.W_OK | os.X_OK) else FolderState.CLOSED


def save_place(open_place: OpenPlace, *, open_since: bool = False) -> OpenPlace:
    """Save the light and the record of a place that has a folder.

    Args:
        open_since: Whether the place has been on screen in the meantime. If so, the data in its
            folder are newer if they belong to the same measurement.

    Raises:
        PlaceError: If the disk fails.
    """
    folder, place, light = open_place.folder, open_place.place, open_place.light
    assert folder is not None
    white = place.capture.white_cd_m2 if place.capture else None
    radiance, display = light.environment.radiance, light.display
    rough = place.capture is not None and place.capture.plan == "rough"
    shares = light.environment.shares
    stored_light = store_environment(
        folder, radiance, display, white_cd_m2=white, rough=rough, shares=shares
    )
    if open_since:
        current = read_place(folder)
        place = current if current.measured_at == place.measured_at else place
    whole = replace(
        place, environment=stored_light.environment, fingerprint=stored_light.fingerprint
    )
    write_place(folder, whole)
    drop_merged(folder)
    return OpenPlace(folder, whole, light)


def save_new_place(
    places: Path, place: Place, light: PlaceLight, files: Sequence[Path], token: Token
) -> OpenPlace:
    """Save a place in a new folder, leaving nothing behind if this fails.

    Args:
        files: Originals to copy into the new folder.

    Raises:
        CoreError: If the disk fails.
    """
    folder = create_place(places, place.name, place.made_at, spot=place.spot)
    try:
        if files:
            adopt_files(folder, files, token)
        new = read_place(folder)
        return save_place(
            OpenPlace(folder, replace(place, spot=new.spot, source=new.source), light)
        )
    except BaseException:
        # The folder contains only copies, and the place could not be opened without its light.
        shutil.rmtree(folder, ignore_errors=True)
        raise


def save_again(open_place: OpenPlace) -> OpenPlace:
    """Recreate the folder of a place from memory.

    Raises:
        PlaceError: If the disk fails.
    """
    assert open_place.folder is not None
    with os_errors_as(
        PlaceError, tr("Cannot create {folder}: {reason}."), folder=open_place.folder
    ):
        make_folder(open_place.folder, private=True)
    return save_place(open_place)


def save_anywhere(open_place: OpenPlace, places: Path) -> OpenPlace:
    """Save a place wherever possible before a forced exit.

    If the place's own folder is gone, it is recreated. Otherwise, the place gets a new folder in
    `places`.

    Raises:
        CoreError, OSError: If the disk fails.
    """
    folder = open_place.folder
    if folder is not None and folder_state(folder) is FolderState.GONE:
        return save_again(open_place)
    files = open_place.files or original_files(folder)
    return save_new_place(places, open_place.place, open_place.light, files, Token())


def original_files(folder: Path | None) -> tuple[Path, ...]:
    """Return the originals of a place, or an empty tuple if they cannot be listed."""
    if folder is None:
        return ()
    try:
        return tuple(sorted(each for each in (folder / ORIGINALS).iterdir() if each.is_file()))
    except OSError:
        return ()


def with_light_of(place: Place, saved: Place) -> Place:
    """Return a copy of a place with the light of `saved`."""
    return replace(place, environment=saved.environment, fingerprint=saved.fingerprint)
