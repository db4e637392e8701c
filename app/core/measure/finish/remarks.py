"""Remarks about merged light: lamps, clipping and corrections."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark
from app.core.measure.finish.lamp_detection import Source


class Remedy(StrEnum):
    """Ways to determine a clipped lamp's brightness."""

    SKY = "sky"  # for the sun, set the clearness of the sky
    GAIN = "gain"  # the camera is at its darkest
    DARKER_FRAMES = "darker frames"


Effect: TypeAlias = Literal["turn", "into reach", "out of reach"]


@dataclass(frozen=True, slots=True)
class LampClipped(Remark):
    """A lamp that is clipped in every frame, and the advice for it.

    Attributes:
        frames: Number of darker frames to shoot, 1 to 4.
        room_stops: How much darker the camera can go if that limits `frames`; else None.
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
    """A clipped lamp that would be the sun if the exposure of the frames were known."""

    lamp: str
    azimuth_deg: float
    elevation_deg: float


@dataclass(frozen=True, slots=True)
class MoreLampsClipped(Remark):
    """Number of smaller lamps that are also clipped."""

    count: int


@dataclass(frozen=True, slots=True)
class ClippingMatters(Remark):
    """Styles affected by more light: up to three stops more (`soon`), or six and more.

    Attributes:
        others: Styles that it does not affect.
    """

    soon: bool
    effect: Effect
    names: tuple[str, ...]
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClippingSafe(Remark):
    """Number of styles that do not depend on clipped light; with `every`, all of them."""

    count: int
    every: bool = False


@dataclass(frozen=True, slots=True)
class RestoredRange(Remark):
    """Styles that change within the likely range of a restored lamp, and the others."""

    lamp: str
    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BlindMatters(Remark):
    """Styles that twice as much light in the gaps would change, and the others."""

    names: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RoughLight(Remark):
    """Fraction of the light of a single photo, 0 to 1, that is estimated because it is clipped."""

    share: float


@dataclass(frozen=True, slots=True)
class RoughTurns(Remark):
    """Styles whose turn depends on clipped light in a single photo."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SunRestored(Remark):
    """The sun was given its illuminance for its elevation and the stated sky."""

    lamp: str
    elevation_deg: float
    sky: Literal["clear", "hazy", "thin cloud"]
    lux: float
    low_lux: float
    high_lux: float


@dataclass(frozen=True, slots=True)
class LampMetered(Remark):
    """A lamp was set to the illuminance of a light meter reading."""

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
    """Effect of filling the masked areas on the answers.

    Attributes:
        styles: Number of styles in reach, before or after.
        changed: Number of them whose turn changes at a cost.
        worst: The style that changes most.
        moved_deg: Largest change of a turn without a cost.
        gained, lost: Titles of styles that come into reach and go out of it.
    """

    styles: int
    changed: int
    worst: CostlyChange | None
    moved_deg: float
    gained: tuple[str, ...]
    lost: tuple[str, ...]
