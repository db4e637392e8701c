"""What there is to report of merged light: lamps, what is clipped, what was put right."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark
from app.core.measure.finish.lights import Source


class Remedy(StrEnum):
    """What makes a clipped lamp known."""

    SKY = "sky"  # of the sun: how clear it is
    GAIN = "gain"  # the camera is at its darkest
    DARKER_FRAMES = "darker frames"


Effect: TypeAlias = Literal["turn", "into reach", "out of reach"]


@dataclass(frozen=True, slots=True)
class LampClipped(Remark):
    """A lamp that is clipped in every frame, and what to do about it.

    Attributes:
        frames: How many darker frames to shoot, 1 to 4.
        room_stops: How much darker the camera can go where that limits `frames`; else None.
    """

    lamp: str
    source: Source
    azimuth_deg: float
    elevation_deg: float
    remedy: Remedy
    frames: int = 1
    room_stops: float | None = None


@dataclass(frozen=True, slots=True)
class MaybeSun(Remark):
    """A clipped lamp that would be the sun, if the exposure of the frames were known."""

    lamp: str
    azimuth_deg: float
    elevation_deg: float


@dataclass(frozen=True, slots=True)
class MoreLampsClipped(Remark):
    """How many smaller lamps are clipped, too."""

    count: int


@dataclass(frozen=True, slots=True)
class ClippingMatters(Remark):
    """The styles that more light, of up to three stops or of six and more, has an effect on.

    Attributes:
        others: The styles that it has none on.
    """

    soon: bool
    effect: Effect
    names: tuple[str, ...]
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClippingSafe(Remark):
    """How many styles do not depend on what is clipped; all of them where `every`."""

    count: int
    every: bool = False


@dataclass(frozen=True, slots=True)
class RestoredRange(Remark):
    """The styles that change within the likely range of a restored lamp, and the others."""

    lamp: str
    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BlindMatters(Remark):
    """The styles that twice as much light would change where nothing was seen, and the others."""

    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RoughLight(Remark):
    """The share of the light of one photo, 0 to 1, that is a guess, since it is clipped."""

    share: float


@dataclass(frozen=True, slots=True)
class RoughTurns(Remark):
    """The styles whose turn depends on what is clipped in one photo."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SunRestored(Remark):
    """The sun was given the light that it has under a sky at its height."""

    lamp: str
    elevation_deg: float
    sky: Literal["clear", "hazy", "thin cloud"]
    lux: float
    low_lux: float
    high_lux: float


@dataclass(frozen=True, slots=True)
class LampMetered(Remark):
    """A lamp was given the illuminance that a light meter read."""

    lamp: str
    lux: float
    held_lux: float


@dataclass(frozen=True, slots=True)
class LampGained(Remark):
    """A lamp was made brighter by so many stops, or darker."""

    lamp: str
    stops: float


@dataclass(frozen=True, slots=True)
class NoClutter(Remark):
    """Nothing that should not be there was found below the camera."""


@dataclass(frozen=True, slots=True)
class CostlyChange:
    """The style that masking changes most, its turns, and what the old one gives up, 0 to 1."""

    title: str
    before_deg: float
    after_deg: float
    given_up: float


@dataclass(frozen=True, slots=True)
class MaskingChanges(Remark):
    """How the answers change where what is masked is filled.

    Attributes:
        styles: How many are in reach, before or after.
        changed: How many of their turns change at a cost.
        worst: The one that changes most.
        moved_deg: The most that a turn moves without any cost.
        gained, lost: Titles of styles that come into reach and out of it.
    """

    styles: int
    changed: int
    worst: CostlyChange | None
    moved_deg: float
    gained: tuple[str, ...]
    lost: tuple[str, ...]
