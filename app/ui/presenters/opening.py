"""Reading a place that was kept, and making one of files: work for other threads."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.core.environment import read_environment
from app.core.light_here import LightHere, prepare
from app.core.pack import load_named_pack
from app.core.places import (
    CaptureFacts,
    Location,
    Place,
    adopt_files,
    create_place,
    read_light,
    read_place,
    store_environment,
    write_place,
)
from app.core.second_light.scale import stated_white
from app.ui.presenters.measuring import capture_facts, location_of, merged_light

if TYPE_CHECKING:
    from datetime import datetime
    from pathlib import Path

    from app.core.progress import Report, Token
    from app.ui.presenters.intake import Intake

__all__ = ["Opened", "kept_anew", "read_kept", "take_anew"]

_HEAD: Final = "generic"


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A place that has been read or made.

    Attributes
    ----------
    folder : Path
        Of the place.
    place : Place
        What is known of it.
    light : LightHere
        Its light.
    """

    folder: Path
    place: Place
    light: LightHere


def read_kept(folder: Path, unkept: Place | None) -> Opened:
    """Read a place.

    Parameters
    ----------
    folder : Path
        Of the place.
    unkept : Place or None
        What is known of it and not yet on the disk.

    Returns
    -------
    Opened

    Raises
    ------
    PlaceError
        When it or its light cannot be read.
    """
    place = unkept or read_place(folder)
    environment, remarks = read_light(folder, place)
    place = replace(place, remarks=(*place.remarks, *remarks))
    return Opened(folder, place, prepare(environment))


def kept_anew(folder: Path, place: Place, light: LightHere) -> Opened:
    """Keep a place with a new light.

    Parameters
    ----------
    folder : Path
        Of the place.
    place : Place
        What is known of it.
    light : LightHere
        What was measured.

    Returns
    -------
    Opened

    Raises
    ------
    PlaceError
        When the disk refuses.
    """
    white = place.capture.white_cd_m2 if place.capture else None
    radiance, display = light.environment.radiance, light.display
    stored = store_environment(folder, radiance, display, white_cd_m2=white)
    whole = replace(place, environment=stored.environment, fingerprint=stored.fingerprint)
    write_place(folder, whole)
    return Opened(folder, whole, light)


def take_anew(
    intake: Intake, places: Path, now: datetime, head: str, token: Token, report: Report
) -> Opened:
    """Make a place of a panorama or a bracket; one that cannot be finished leaves nothing.

    Parameters
    ----------
    intake : Intake
        No place that was kept.
    places : Path
        Folder of the places.
    now : datetime
        With its zone.
    head : str
        Who is lit there.
    token : Token
        Stops it.
    report : Report

    Returns
    -------
    Opened

    Raises
    ------
    CoreError
        When the files cannot be read or measured, or the place cannot be kept.
    Cancelled
        When the token was cancelled.
    """
    light, location, facts = _measured(intake, token, report)
    token.check()
    report(0.9, "Saving the place")
    folder = create_place(places, intake.name, now)
    try:
        if intake.frames:
            adopt_files(folder, intake.frames, token)
        # When the light of files was measured nobody knows: their place has no age.
        place = replace(read_place(folder), head=head, location=location, capture=facts)
        return kept_anew(folder, place, light)
    except BaseException:
        # All that is in it are copies; without its light it could not be opened.
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _measured(
    intake: Intake, token: Token, report: Report
) -> tuple[LightHere, Location, CaptureFacts]:
    if intake.environment is not None:
        report(0.1, f"Reading {intake.environment.name}")
        light = prepare(read_environment(intake.environment))
        white = stated_white(intake.environment)
        return light, Location(), CaptureFacts(plan="panorama", white_cd_m2=white)
    from app.core.probe.probe import measure

    probe = measure(intake.frames, load_named_pack(_HEAD), token=token, report=report)
    return merged_light(probe, intake.name), location_of(probe), capture_facts(probe, "", "files")
