"""Reading a place that was kept, and making one of files: work for other threads."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.errors import Cancelled, CoreError
from app.core.second_light.scale import stated_white
from app.core.solver.environment import read_environment
from app.core.solver.place_light import PlaceLight, prepare
from app.core.solver.style_pack import load_named_pack
from app.core.storage.places.light import read_light, store_environment
from app.core.storage.places.originals import adopt_files
from app.core.storage.places.place import CaptureFacts, Location, Place, PlaceError
from app.core.storage.places.store import (
    PLACE,
    create_place,
    list_places,
    read_place,
    summarise,
    write_place,
)
from app.ui.presenters.input_sorting import Intake
from app.ui.presenters.place_from_probe import capture_facts, location_of, merged_light
from app.ui.presenters.unfinished import left_over

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from app.core.base.progress import Report, Token
    from app.core.solver.reach import Limits
    from app.core.storage.settings import Settings
    from app.ui.presenters.unfinished import Unfinished

_HEAD: Final = "generic"


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A place that has been read or made.

    Attributes
    ----------
    folder : Path or None
        Of the place; None where it could not be kept.
    """

    folder: Path | None
    place: Place
    light: PlaceLight
    files: tuple[Path, ...] = ()
    trouble: Exception | None = None


class NotFinished(PlaceError):
    """A place has no light yet, and can be finished."""

    def __init__(self, error: CoreError, left: Unfinished) -> None:
        super().__init__(error.message, error.hint)
        self.left = left


def read_kept(folder: Path, unkept: Place | None) -> Opened:
    """Read a place.

    Raises
    ------
    NotFinished
        When it has no light, and something to make it of.
    PlaceError
        When it or its light cannot be read.
    """
    place = unkept or read_place(folder)
    try:
        environment, remarks = read_light(folder, place)
    except CoreError as error:
        summary = summarise(folder)
        left = None if summary is None else left_over(summary)
        if left is None or not left.can_finish:
            raise
        raise NotFinished(error, left) from error
    place = replace(place, remarks=(*place.remarks, *remarks))
    return Opened(folder, place, prepare(environment))


def kept_anew(opened: Opened, *, open_since: bool = False) -> Opened:
    """Keep the light of a place that has a folder, and what is known of it.

    Raises
    ------
    PlaceError
        When the disk refuses.
    """
    folder, place, light = opened.folder, opened.place, opened.light
    assert folder is not None
    white = place.capture.white_cd_m2 if place.capture else None
    radiance, display = light.environment.radiance, light.display
    stored = store_environment(folder, radiance, display, white_cd_m2=white)
    if open_since:
        found = read_place(folder)
        place = found if found.measured_at == place.measured_at else place
    whole = replace(place, environment=stored.environment, fingerprint=stored.fingerprint)
    write_place(folder, whole)
    return Opened(folder, whole, light)


def kept_in(
    places: Path, place: Place, light: PlaceLight, files: Sequence[Path], token: Token
) -> Opened:
    """Keep a place in a new folder; one that cannot be finished leaves nothing.

    Raises
    ------
    CoreError
        When the disk refuses.
    """
    folder = create_place(places, place.name, place.made_at, spot=place.spot)
    try:
        if files:
            adopt_files(folder, files, token)
        kept = read_place(folder)
        return kept_anew(Opened(folder, replace(place, spot=kept.spot, source=kept.source), light))
    except BaseException:
        # All that is in it are copies; without its light it could not be opened.
        shutil.rmtree(folder, ignore_errors=True)
        raise


def take_anew(
    intake: Intake,
    places: Path,
    now: datetime,
    settings: Settings,
    token: Token,
    report: Report,
) -> Opened:
    """Make a place of a panorama or a bracket; where it cannot be kept it is there all the same.

    Raises
    ------
    CoreError
        When the files cannot be read or measured.
    Cancelled
        When the token was cancelled.
    """
    light, location, facts = _measured(intake, settings.limits, token, report)
    token.check()
    report(0.9, "Saving the place")
    # When the light of files was measured nobody knows: their place has no age.
    place = Place(intake.name, now, head=settings.head, location=location, capture=facts)
    try:
        return kept_in(places, place, light, intake.frames, token)
    except Cancelled:
        raise
    except (CoreError, OSError) as error:
        return Opened(None, place, light, intake.frames, error)


def last_opened(last: str, places: Path) -> Path | None:
    """Find the place that was open last; where that is not known, the newest that has light."""
    if last and (Path(last) / PLACE).is_file():
        return Path(last)
    whole = (one for one in list_places(places) if one.has_light and one.state == "whole")
    return next((one.folder for one in whole), None)


def finish_files(left: Unfinished, limits: Limits, token: Token, report: Report) -> Opened:
    """Merge the photographs that are in the folder of an unfinished place.

    Raises
    ------
    CoreError
        When they cannot be merged, or the disk refuses.
    Cancelled
        When the token was cancelled.
    """
    intake = Intake(left.name, frames=left.files)
    light, location, facts = _measured(intake, limits, token, report)
    place = replace(read_place(left.folder), location=location, capture=facts)
    return kept_anew(Opened(left.folder, place, light))


def _measured(
    intake: Intake, limits: Limits, token: Token, report: Report
) -> tuple[PlaceLight, Location, CaptureFacts]:
    if intake.environment is not None:
        report(0.1, f"Reading {intake.environment.name}")
        light = prepare(read_environment(intake.environment))
        white = stated_white(intake.environment)
        return light, Location(), CaptureFacts(plan="panorama", white_cd_m2=white)
    from app.core.hdr.finish import MergeOptions
    from app.core.hdr.pipeline import measure

    pack, wishes = load_named_pack(_HEAD), MergeOptions(limits=limits)
    probe = measure(intake.frames, pack, wishes, token=token, report=report)
    return merged_light(probe, intake.name), location_of(probe), capture_facts(probe, "", "files")
