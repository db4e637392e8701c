"""Load a saved place, and find the place that was open last."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from app.core.base.errors import CoreError
from app.core.places.files.light import read_light
from app.core.places.place import OpenPlace, Place, PlaceError
from app.core.places.place_folder import PLACE, read_place, summarise
from app.core.places.place_list import list_places
from app.core.places.resume import UnfinishedPlace, find_unfinished
from app.core.solver.place_light import prepare


class NotFinished(PlaceError):
    """A place has no light yet but can be completed."""

    def __init__(self, error: CoreError, unfinished: UnfinishedPlace) -> None:
        super().__init__(error.message, error.hint)
        self.unfinished = unfinished


def load_place(folder: Path, unsaved: Place | None = None) -> OpenPlace:
    """Read a place and its light.

    Args:
        unsaved: The place with its latest changes, if these are not on disk yet.

    Raises:
        NotFinished: If the place has no light but has files from which the light can be computed.
        PlaceError: If the place or its light cannot be read.
    """
    place = unsaved or read_place(folder)
    try:
        environment, remarks = read_light(folder, place)
    except CoreError as error:
        summary = summarise(folder)
        unfinished = None if summary is None else find_unfinished(summary)
        if unfinished is None or not unfinished.can_finish:
            raise
        raise NotFinished(error, unfinished) from error
    place = replace(place, remarks=(*place.remarks, *remarks))
    return OpenPlace(folder, place, prepare(environment))


def last_opened(last: str, places: Path) -> Path | None:
    """Return the place that was open last, or the newest place with light if that one is gone.

    If no place has light, the result is None.
    """
    if last and (Path(last) / PLACE).is_file():
        return Path(last)
    whole = (one for one in list_places(places) if one.has_light and one.state == "whole")
    return next((one.folder for one in whole), None)
