"""Remarks on merged light: lamps, clipping and corrections."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark
from app.core.measure.finish.lamp_detection import Source


class Remedy(StrEnum):
    """A way to determine the brightness of a clipped lamp."""

    SKY = "sky"  # for the sun: set the clearness of the sky
    GAIN = "gain"  # set a gain, since the camera cannot go darker
    DARKER_FRAMES = "darker frames"


Effect: TypeAlias = Literal["turn", "into reach", "out of reach"]


@dataclass(frozen=True, slots=True)
class LampClipped(Remark):
    """A lamp is clipped in every frame, which requires a remedy.

    Attributes:
        frames: Number of darker frames to shoot, 1 to 4.
        room_stops: How many stops darker the camera can go if this limits `frames`, otherwise None.
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
    """Some styles would change if the light were brighter.

    Attributes:
        soon: Whether the styles change with up to three more stops, rather than only with six or
            more.
        others: Styles that brighter light would not affect.
    """

    soon: bool
    effect: Effect
    names: tuple[str, ...]
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClippingSafe(Remark):
    """Some styles, or all of them if `every` is true, do not depend on clipped light."""

    count: int
    every: bool = False


@dataclass(frozen=True, slots=True)
class RestoredRange(Remark):
    """Some styles change within the likely range of a restored lamp, while others do not."""

    lamp: str
    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BlindMatters(Remark):
    """Doubling the light in the gaps would change some styles but not others."""

    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RoughLight(Remark):
    """Part of the light in a single photo, `share` from 0 to 1, is clipped and was estimated."""

    share: float


@dataclass(frozen=True, slots=True)
class RoughTurns(Remark):
    """The turns of some styles depend on clipped light in a single photo."""

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
    """A lamp was set to the illuminance measured with a light meter."""

    lamp: str
    lux: float
    held_lux: float


@dataclass(frozen=True, slots=True)
class LampGained(Remark):
    """A lamp was brightened or darkened by the given number of stops."""

    lamp: str
    stops: float


@dataclass(frozen=True, slots=True)
class NoClutter(Remark):
    """No clutter was detected below the camera."""


@dataclass(frozen=True, slots=True)
class CostlyChange:
    """The style that masking changes most, with its turns and the old turn's loss, 0 to 1."""

    title: str
    before_deg: float
    after_deg: float
    given_up: float


@dataclass(frozen=True, slots=True)
class MaskingChanges(Remark):
    """How filling the masked areas affects the answers.

    Attributes:
        styles: Number of styles that are within reach before or after filling.
        changed: Number of these styles whose old turn now comes at a cost.
        worst: The style that changes most, or None if none does.
        moved_deg: Largest change in a turn that comes at no cost, in degrees.
        gained, lost: Titles of the styles that come within reach and of those that go out of reach,
            respectively.
    """

    styles: int
    changed: int
    worst: CostlyChange | None
    moved_deg: float
    gained: tuple[str, ...]
    lost: tuple[str, ...]
