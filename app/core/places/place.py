"""A place, with its name, its light, its answers and the data about its measurement."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.base.remarks import Remark
from app.core.base.visible_text import STEERING
from app.core.cautions.caution import Caution
from app.core.portrait.ratio_and_glare import Flow
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS, Objective
from app.core.storage.json_file import (
    Facts,
    clean,
)
from app.core.styles.lamps import Studio
from app.core.styles.styles import NAMES

if TYPE_CHECKING:
    from app.core.solver.place_light import PlaceLight


Kind: TypeAlias = Literal["unknown", "indoor", "outdoor"]

LONGEST_NAME: Final = 120
LONGEST_NOTES: Final = 100_000
LONGEST_TAG: Final = 32
MOST_TAGS: Final = 12
UNNAMED: Final = "Unnamed place"


class PlaceError(CoreError):
    """A place cannot be found, read or saved."""


@dataclass(frozen=True, slots=True)
class Location:
    """The sky and the sun at a place, from which the age of its light is judged."""

    kind: Kind = "unknown"
    sun: bool | None = None  # whether the sun shines on the place, or None if unknown
    # Position of the sun in the panorama at the time of capture. The azimuth counts from the
    # panorama's centre column, positive clockwise as seen from above, and ignores
    # `Place.front_deg`.
    sun_azimuth_deg: float | None = None
    sun_elevation_deg: float | None = None
    # Position on the earth, north and east positive, or None if the camera did not record it.
    latitude_deg: float | None = None
    longitude_deg: float | None = None


@dataclass(frozen=True, slots=True)
class AnswerBasis:
    """Settings with which the results of a place were computed."""

    head: str = "generic"
    objective: Objective = "picture"
    match_limit: float = LIMITS.match
    strength_limit: float = LIMITS.strength


@dataclass(frozen=True, slots=True)
class FrameFacts:
    """Facts about one frame in the bracket."""

    file: str
    shutter_s: float
    iso: float = 0.0
    aperture: float = 0.0
    ev: float = 0.0  # relative to the metered exposure, in stops; positive is brighter
    clipped_share: float = 0.0  # fraction of the panorama that is too bright for the frame, 0 to 1


@dataclass(frozen=True, slots=True)
class CaptureFacts:
    """Facts about the measurement of the light."""

    camera: str = ""
    # "paper", "full", "files" (a bracket that was opened), "rough" (one photo), "panorama"
    # (an HDR file), "film", "ball" or "photos"
    plan: str = ""
    frames: tuple[FrameFacts, ...] = ()
    # fraction of the light's energy in clipped areas, 0 to 1, or None if not measured
    clipped_share: float | None = None
    # luminance of radiance 1, in cd/m2, or None if the scale is only relative
    white_cd_m2: float | None = None
    warnings: tuple[Remark, ...] = ()
    advice: tuple[Remark, ...] = ()
    notes: tuple[Remark, ...] = ()
    # fraction of the sphere that no picture shows, 0 to 1
    blind: float = 0.0
    cautions: tuple[Caution, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class PlaceSource:
    """The file of a place as it was read, kept to preserve entries from newer versions."""

    file_facts: Facts
    known_facts: Facts
    version: str = ""  # version of the file, as returned by `read_json`


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """The light at one spot and time, with its results.

    Texts are cleaned and angles are wrapped, so a saved place is unchanged when it is read back.

    Raises:
        ValueError: If a number is not finite or a time has no offset from UTC.
    """

    name: str
    made_at: datetime
    # file name of the environment in the place's folder; "" until light is measured
    environment: str = ""
    fingerprint: str = ""
    measured_at: datetime | None = None
    front_deg: float = 0.0  # panorama azimuth of the photographer, in degrees
    head: str = "generic"
    notes: str = ""
    tags: tuple[str, ...] = ()  # the user's labels, without duplicates
    location: Location = field(default_factory=Location)
    asked: AnswerBasis | None = None  # settings of `results`, or None if there are no results
    results: tuple[StyleResult, ...] = field(default=(), repr=False)
    # results of an earlier version of the rule, if there are any
    before: tuple[StyleResult, ...] = field(default=(), repr=False)
    # flow of the light past a sitter who faces the photographer, or None if it is unknown
    flow: Flow | None = None
    chosen: str | None = None
    # turn on display, in degrees, or None for the best turn of the chosen style
    needle_deg: float | None = None
    goal_deg: float | None = None  # turn to go to, in degrees
    capture: CaptureFacts | None = field(default=None, repr=False)
    # luminance of radiance 1 as entered by the user, in cd/m2; overrides the capture's
    said_white_cd_m2: float | None = None
    # name shared by captures of one spot at different times, or "" for a spot of its own
    spot: str = ""
    # studio lamps by style name, with "" for all other styles; by default, the paper's lamps
    studios: Mapping[str, Studio] = field(default_factory=dict)
    # permitted positions of the lens, with the background in azimuths of the panorama
    lens: LensWish = STRAIGHT
    remarks: tuple[Remark, ...] = ()
    source: PlaceSource | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        changes: dict[str, Any] = {
            "name": clean_name(self.name),
            "notes": clean_notes(self.notes),
            "tags": clean_tags(self.tags),
            "front_deg": _turn(self.front_deg),
            "needle_deg": None if self.needle_deg is None else _turn(self.needle_deg),
            "goal_deg": None if self.goal_deg is None else _turn(self.goal_deg),
        }
        for time in (self.made_at, self.measured_at):
            if time is not None and time.utcoffset() is None:
                raise ValueError("the time of a place needs its offset from UTC")
        for name, value in changes.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, eq=False)
class OpenPlace:
    """A place in memory, with its light.

    Attributes:
        folder: Folder of the place, or None if the place could not be saved.
        files: Originals that have not been copied into the place's folder yet.
        trouble: Error that prevented the place from being saved, or None.
    """

    folder: Path | None
    place: Place
    light: PlaceLight
    files: tuple[Path, ...] = ()
    trouble: Exception | None = None


def clean_name(name: str) -> str:
    """Convert the name of a place to one clean line of 1 to 120 characters.

    Examples:
        >>> clean_name("  Café   de la Paix "), clean_name("")
        ('Café de la Paix', 'Unnamed place')
    """
    spaced = " ".join(name[: 20 * LONGEST_NAME].split())
    line = clean(unicodedata.normalize("NFC", clean(spaced)))[:LONGEST_NAME]
    return " ".join(line.split()) or UNNAMED


def clean_tags(tags: Iterable[str]) -> tuple[str, ...]:
    """Reduce the tags of a place to a limited number of short ones, unique regardless of case.

    Examples:
        >>> clean_tags(["  north   light ", "", "North light", "brick"])
        ('north light', 'brick')
    """
    result: dict[str, str] = {}
    for tag in tags:
        if short := clean_name(tag[:LONGEST_NAME])[:LONGEST_TAG].strip() if tag.strip() else "":
            result.setdefault(short.casefold(), short)
    return tuple(result.values())[:MOST_TAGS]


def clean_notes(notes: str) -> str:
    """Remove control characters, except line breaks and tabs, from notes."""
    ends = notes.replace("\r\n", "\n").replace("\r", "\n")
    return "".join(c for c in ends if c in "\n\t" or ord(c) not in STEERING)


def _turn(angle_deg: float) -> float:
    if not math.isfinite(angle_deg):
        raise ValueError("an angle of a place is not a number")
    return wrap(float(angle_deg))


def by_the_rule_before(place: Place) -> bool:
    """Return whether the results of a place predate grades."""
    return any(result.name in NAMES and result.grade is None for result in place.results)
