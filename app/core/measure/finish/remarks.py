"""Remarks about merged light: lamps, clipping and corrections."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark
from app.core.measure.finish.lamp_detection import Source


class Remedy(StrEnum):
    """A way to determine a clipped lamp's brightness."""

    SKY = "sky"  # for the sun: set the clearness of the sky
    GAIN = "gain"  # set a gain, since the camera cannot go darker
    DARKER_FRAMES = "darker frames"


Effect: TypeAlias = Literal["turn", "into reach", "out of reach"]


@dataclass(frozen=True, slots=True)
class LampClipped(Remark):
    """A lamp is clipped in every frame, which calls for a remedy.

    Attributes:
        frames: Number of darker frames to shoot, 1 to 4.
        room_stops: How many stops darker the camera can go if that limits `frames`, otherwise None.
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
    """A clipped lamp would count as the sun if the exposure of the frames were known."""

    lamp: str
    azimuth_deg: float
    elevation_deg: float


@dataclass(frozen=True, slots=True)
class MoreLampsClipped(Remark):
    """Some smaller lamps are also clipped."""

    count: int


@dataclass(frozen=True, slots=True)
class ClippingMatters(Remark):
    """Some styles would change in brighter light.

    Attributes:
        soon: Whether they change with up to three more stops, rather than with six or more.
        others: Styles that brighter light does not affect.
    """

    soon: bool
    effect: Effect
    names: tuple[str, ...]
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClippingSafe(Remark):
    """Some styles do not depend on clipped light, or none does (`every`)."""

    count: int
    every: bool = False


@dataclass(frozen=True, slots=True)
class RestoredRange(Remark):
    """Some styles change within the likely range of a restored lamp, and others do not."""

    lamp: str
    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BlindMatters(Remark):
    """Twice as much light in the gaps would change some styles, but not the others."""

    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RoughLight(Remark):
    """Part of the light in a single photo, `share` from 0 to 1, is clipped and was estimated."""

    share: float


@dataclass(frozen=True, slots=True)
class RoughTurns(Remark):
    """The turn of some styles depends on clipped light in a single photo."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SunRestored(Remark):
    """The sun was set to the usual illuminance for its elevation and the stated sky."""

    lamp: str
    elevation_deg: float
    sky: Literal["clear", "hazy", "thin cloud"]
    lux: float
    low_lux: float
    high_lux: float


@dataclass(frozen=True, slots=True)
class LampMetered(Remark):
    """A lamp was set to the illuminance that a light meter measured."""

    lamp: str
    lux: float
    held_lux: float


@dataclass(frozen=True, slots=True)
class LampGained(Remark):
    """A lamp was brightened or darkened by a number of stops."""

    lamp: str
    stops: float


@dataclass(frozen=True, slots=True)
class NoClutter(Remark):
    """No clutter was detected below the camera."""


@dataclass(frozen=True, slots=True)
class CostlyChange:
    """The style that masking changes most, with its turns and the loss at the old turn, 0 to 1."""

    title: str
    before_deg: float
    after_deg: float
    given_up: float


@dataclass(frozen=True, slots=True)
class MaskingChanges(Remark):
    """The effect of filling the masked areas on the answers.

    Attributes:
        styles: Number of styles within reach before or after filling.
        changed: Number of these styles whose turn changes at a cost.
        worst: The style that changes most, or None if none does.
        moved_deg: Largest change of a turn without a cost, in degrees.
        gained, lost: Titles of the styles that come within reach, and of those that go out of
            reach.
    """

    styles: int
    changed: int
    worst: CostlyChange | None
    moved_deg: float
    gained: tuple[str, ...]
    lost: tuple[str, ...]
