"""What is kept of a place: its light, what was asked of it, and what came out."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.solver.lamps import Studio
from app.core.solver.turn_choice import LIMITS, Objective
from app.core.storage.json_file import Facts, clean
from app.core.text import tr

if TYPE_CHECKING:
    from app.core.solver.solve import StyleResult

Kind: TypeAlias = Literal["unknown", "indoor", "outdoor"]

LONGEST_NAME: Final = 120
LONGEST_NOTES: Final = 100_000
LONGEST_TAG: Final = 32
MOST_TAGS: Final = 12
UNNAMED: Final = tr("Unnamed place")


class PlaceError(CoreError):
    """A place cannot be found, read or kept."""


@dataclass(frozen=True, slots=True)
class Location:
    """What is over the place, for the age of the light."""

    kind: Kind = "unknown"
    sun: bool | None = None  # whether the sun shines on the place; None where it is not known
    # sun_azimuth_deg, sun_elevation_deg: where the sun stood in the panorama when it was captured;
    # azimuth from the panorama's own centre column, positive clockwise from above, whatever
    # `Place.front_deg` is
    sun_azimuth_deg: float | None = None
    sun_elevation_deg: float | None = None
    # latitude_deg, longitude_deg: on the earth, north and east positive; None where the camera
    # does not know
    latitude_deg: float | None = None
    longitude_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Asked:
    """What the results of a place were asked with."""

    head: str = "generic"
    objective: Objective = "picture"
    match_limit: float = LIMITS.match
    strength_limit: float = LIMITS.strength


@dataclass(frozen=True, slots=True)
class FrameFacts:
    """One frame of the bracket."""

    file: str
    shutter_s: float
    iso: float = 0.0
    aperture: float = 0.0
    ev: float = 0.0  # relative to the metered exposure, stops; positive is brighter
    clipped_share: float = 0.0  # share of the panorama that is too bright for the frame, 0 to 1


@dataclass(frozen=True, slots=True)
class CaptureFacts:
    """How the light was measured."""

    camera: str = ""
    # "paper", "full", "files" (a bracket that was opened) or "panorama" (an HDR file)
    plan: str = ""
    frames: tuple[FrameFacts, ...] = ()
    # share of the light's energy in clipped areas, 0 to 1; None where it was not measured
    clipped_share: float | None = None
    # luminance of radiance 1, cd/m2; None where the scale is only relative
    white_cd_m2: float | None = None
    warnings: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A place's file as it was read, so that what a newer version wrote there is not lost."""

    found: Facts
    known: Facts


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """One place and time.

    Texts are cleaned of what a file or a screen cannot hold, and angles are wrapped, so that what
    is in memory is what will be read again.

    Raises ValueError when a number is not finite, or a time has no offset from UTC.
    """

    name: str
    made_at: datetime
    # name of the environment in the place's folder, as `store_environment` gave it; "" while no
    # light was measured
    environment: str = ""
    fingerprint: str = ""
    measured_at: datetime | None = None
    front_deg: float = 0.0  # panorama azimuth at which the photographer stands, deg
    head: str = "generic"
    notes: str = ""
    tags: tuple[str, ...] = ()  # labels of the user's own, each at most once
    location: Location = field(default_factory=Location)
    asked: Asked | None = None  # what `results` were asked with; None where there are none
    results: tuple[StyleResult, ...] = field(default=(), repr=False)
    # what it was answered by an earlier rule, if it was
    before: tuple[StyleResult, ...] = field(default=(), repr=False)
    chosen: str | None = None
    # turn that is looked at, deg; None = the best of the chosen style
    needle_deg: float | None = None
    goal_deg: float | None = None  # turn that is gone to, deg
    capture: CaptureFacts | None = field(default=None, repr=False)
    # luminance of radiance 1 as the user has stated it, cd/m2; it counts before the capture's
    said_white_cd_m2: float | None = None
    # the same for captures of the same spot at different times; "" for a spot of its own
    spot: str = ""
    # lamps by the name of a style, for all others by ""; as in the paper where neither is there
    studios: Mapping[str, Studio] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    source: Source | None = field(default=None, repr=False)

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


def clean_name(name: str) -> str:
    """Make any text the name of a place: one line of at most 120 letters, never empty.

    Examples:
        >>> clean_name("  Café   de la Paix "), clean_name("")
        ('Café de la Paix', 'Unnamed place')
    """
    spaced = " ".join(name[: 20 * LONGEST_NAME].split())
    line = clean(unicodedata.normalize("NFC", clean(spaced)))[:LONGEST_NAME]
    return " ".join(line.split()) or UNNAMED


def clean_tags(tags: Iterable[str]) -> tuple[str, ...]:
    """Make any texts the tags of a place: short, each once in whatever case, and not too many.

    Examples:
        >>> clean_tags(["  north   light ", "", "North light", "brick"])
        ('north light', 'brick')
    """
    found: dict[str, str] = {}
    for tag in tags:
        if short := clean_name(tag[:LONGEST_NAME])[:LONGEST_TAG].strip() if tag.strip() else "":
            found.setdefault(short.casefold(), short)
    return tuple(found.values())[:MOST_TAGS]


def clean_notes(notes: str) -> str:
    """Drop what a text cannot hold; lines and tabs stay."""
    ends = notes.replace("\r\n", "\n").replace("\r", "\n")
    return "".join(c for c in ends if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cs"))


def _turn(angle_deg: float) -> float:
    if not math.isfinite(angle_deg):
        raise ValueError("an angle of a place is not a number")
    return wrap(float(angle_deg))
