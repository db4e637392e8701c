"""Open files by loading a place or by creating a new one from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from app.core.base.errors import Cancelled, CoreError
from app.core.base.progress import Progress, Report, Task, Token
from app.core.measure.options import HEAD
from app.core.places.files.shots import keep_film_frames
from app.core.places.intake import Intake, sort_out
from app.core.places.load_saved import load_place
from app.core.places.place import OpenPlace, Place
from app.core.places.place_measurement import measure_intake
from app.core.places.save import save_new_place
from app.core.storage.settings import Settings
from app.core.styles.style_pack_file import load_named_pack


@dataclass(frozen=True, slots=True)
class OpenOptions:
    """Options for opening files.

    Attributes:
        places: Folder in which the folder of a new place is created.
        now: Time of the new place.
        settings: Head and lamps for new places, and how to measure photos and videos.
        name: Name of a new place, or "" to name it after its files.
        way: How to measure photos, as in the setting `measure_with`, or "" to use that setting.
        layer: Layer to read from a panorama that has several layers.
    """

    places: Path
    now: datetime
    settings: Settings
    name: str = ""
    way: str = ""
    layer: str = ""


def open_paths(
    paths: Sequence[Path],
    options: OpenOptions,
    token: Token,
    report: Report,
    unsaved: Callable[[Path], Place | None] = lambda folder: None,
) -> OpenPlace:
    """Open a place, a panorama, a bracket, a video or a folder that contains one of these.

    Args:
        unsaved: Function that takes the folder of a place and returns the place with any changes
            that are not on disk yet, or None if there are no such changes.

    Raises:
        CoreError: If there is nothing usable, or if the files cannot be read or measured.
        Cancelled: If the token is cancelled.
    """
    intake = sort_out(paths, options.way or options.settings.measure_with)
    intake = replace(intake, name=options.name or intake.name, layer=options.layer)
    if intake.place is not None:
        return load_place(intake.place, unsaved(intake.place))
    return make_place(intake, options, token, report)


def make_place(intake: Intake, options: OpenOptions, token: Token, report: Report) -> OpenPlace:
    """Measure the light in files and save it as a new place.

    A place that cannot be saved is opened anyway, with the reason as its `trouble`.

    Raises:
        CoreError: If the files cannot be read or measured.
        Cancelled: If the token is cancelled.
    """
    settings = options.settings
    measured = measure_intake(intake, settings, token, report)
    token.check()
    report(0.9, Progress(Task.SAVING_PLACE))
    # The time when the light was measured is unknown, so the place has no age.
    place = Place(
        intake.name,
        options.now,
        head=settings.head,
        location=measured.location,
        capture=measured.facts,
        studios=settings.studios,
    )
    light = measured.light
    try:
        result = save_new_place(options.places, place, light, intake.originals, token)
    except Cancelled:
        raise
    except (CoreError, OSError) as error:
        return OpenPlace(None, place, light, intake.originals, error)
    if result.folder is not None and measured.film is not None:
        results = measured.film.results(load_named_pack(HEAD))
        keep_film_frames(result.folder, measured.film, results, options.now)
    return result
