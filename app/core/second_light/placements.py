"""Where a second light may be held: 64 azimuths by 9 altitudes around the middle of the head.

Floor and arm limit the placements; words say one to whoever holds the lamp.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.angles import TURNS, wrap
from app.core.base.errors import CoreError

if TYPE_CHECKING:
    from app.core.base.arrays import Bools, Float64, Int64

_LEVEL_DEG: Final = 3.0
_DISTANCE: Final = re.compile(r"(\d{1,5}(?:[.,]\d{1,6})?) *(m|cm)?")
# Up to which angle from the front each stands; "{side}" is the sitter's left or right.
_SECTORS: Final = (
    (8.0, "in front"),
    (30.0, "in front, a little {side}"),
    (60.0, "half in front, half {side}"),
    (82.0, "{side}, a little in front"),
    (98.0, "{side}"),
    (120.0, "{side}, a little behind"),
    (150.0, "half behind, half {side}"),
    (172.0, "behind, a little {side}"),
    (180.0, "behind"),
)


def placement_words(
    azimuth_deg: float,
    altitude_deg: float,
    distance_m: float | None = None,
    skin_m: float | None = None,
) -> str:
    """Say where a lamp is held.

    `azimuth_deg` and `altitude_deg`: from the middle of the head, deg, positive toward the sitter's
    left and upward.
    `skin_m`: shortest way from the lamp to the skin, metres.
    Without a full stop.

    Examples:
        >>> placement_words(105.0, 20.0, 0.3, 0.21)  # doctest: +ELLIPSIS
        "to the sitter's left (camera right), a little behind, raised 20°, 30 cm from the ...
    """
    azimuth = wrap(azimuth_deg)
    side = "left (camera right)" if azimuth > 0 else "right (camera left)"
    sector = next(words for most, words in _SECTORS if abs(azimuth) <= most)
    parts = [sector.format(side=f"to the sitter's {side}"), _height(altitude_deg)]
    if distance_m is not None:
        parts.append(f"{metres(distance_m)} from the middle of the head")
    if skin_m is not None:
        parts.append(f"about {metres(skin_m, rough=True)} from the skin")
    return ", ".join(parts)


def lux_words(lux: float) -> str:
    """Write an illuminance with two figures.

    Examples:
        >>> lux_words(213.4), lux_words(61234.0), lux_words(4.87)
        ('210 lx', '61,000 lx', '4.9 lx')
    """
    digits = 1 - math.floor(math.log10(max(lux, 1e-3)))
    value = round(lux, digits)
    return f"{value:,.0f} lx" if value == round(value) else f"{value:.{digits}f} lx"


def metres(distance_m: float, *, rough: bool = False) -> str:
    """Write a distance: in centimetres below one metre.

    Examples:
        >>> metres(0.304), metres(0.217, rough=True), metres(1.25)
        ('30 cm', '20 cm', '1.2 m')
    """
    centimetres = round(100.0 * distance_m)
    if rough and centimetres >= 10:
        centimetres = 5 * round(20.0 * distance_m)
    return f"{centimetres} cm" if centimetres < 100 else f"{centimetres / 100.0:.1f} m"


def read_metres(text: str) -> float:
    """Read a distance as somebody types it: metres, or centimetres where it says so.

    Examples:
        >>> read_metres("0.4"), read_metres("40 cm"), read_metres("1,2 m")
        (0.4, 0.4, 1.2)
    """
    found = _DISTANCE.fullmatch(text.strip().lower())
    if found is None:
        raise CoreError("This is no distance.", "Type metres, as 0.4, or centimetres, as 40 cm.")
    value = float(found[1].replace(",", "."))
    return value / 100.0 if found[2] == "cm" else value


def _height(altitude_deg: float) -> str:
    if abs(altitude_deg) < _LEVEL_DEG:
        return "at the height of the ears"
    return f"{'raised' if altitude_deg > 0 else 'lowered'} {abs(altitude_deg):.0f}°"


EAR_HEIGHT_M: Final = 1.2
"""Height of the middle of the head above the floor, of a sitter on a chair."""

_CLEAR_M: Final = 0.05  # of the floor
_SHOULDER_M: Final = (0.19, -0.27, -0.03)  # the left one, from the middle of the head
_ARM_M: Final = 0.75  # from the shoulder to what a hand holds
_BACK_M: Final = -0.35  # behind the middle of the head a hand reaches no farther
# The trunk below the neck: half its width and depth, and where it begins.
_TRUNK_M: Final = (0.21, 0.13, -0.22)


def above_floor(distance_m: float, ear_height_m: float = EAR_HEIGHT_M) -> Bools:
    """Find the placements that are not through the floor.

    Returns (576,) bool.
    """
    height: Float64 = directions()[:, 1] * distance_m
    return np.asarray(height >= _CLEAR_M - ear_height_m)


def within_arm(distance_m: float) -> Bools:
    """Find the placements to which somebody can hold a lamp for a picture of themselves.

    Returns (576,) bool: within reach of either arm, not far behind the head, and not inside the
    trunk.
    """
    places = directions() * distance_m
    shoulders = np.array([_SHOULDER_M, (-_SHOULDER_M[0], *_SHOULDER_M[1:])])
    away = np.linalg.norm(places[:, None] - shoulders, axis=2).min(axis=1)
    wide, deep, top = _TRUNK_M
    trunk = (places[:, 1] < top) & (np.hypot(places[:, 0] / wide, places[:, 2] / deep) < 1.0)
    return np.asarray((away <= _ARM_M) & (places[:, 2] >= _BACK_M) & ~trunk)


AZIMUTHS_DEG: Final[Float64] = np.arange(TURNS, dtype=np.float64) * (360.0 / TURNS)
"""(64,) deg, from in front toward the sitter's left."""

ALTITUDES_DEG: Final[Float64] = np.arange(-4, 5, dtype=np.float64) * 16.875
"""(9,) deg, from below upward; the paper's band."""

COUNT: Final = len(ALTITUDES_DEG) * len(AZIMUTHS_DEG)
"""Placements; number j = altitude index * 64 + azimuth index."""

MIRRORED: Final[Int64] = (
    np.arange(len(ALTITUDES_DEG))[:, None] * TURNS + (-np.arange(TURNS)) % TURNS
).ravel()
"""(576,) the placement on the other side of the face."""


def direction(azimuth_deg: float, altitude_deg: float) -> Float64:
    """Give the unit vector from the middle of the head, (3,), head frame."""
    azimuth, altitude = np.radians([azimuth_deg, altitude_deg])
    level = np.cos(altitude)
    return np.array([np.sin(azimuth) * level, np.sin(altitude), np.cos(azimuth) * level])


def directions() -> Float64:
    """Give the unit vectors of all placements, (576, 3), head frame."""
    return np.array([direction(*placement(number)) for number in range(COUNT)])


def placement(number: int) -> tuple[float, float]:
    """Return azimuth in (-180, 180] and altitude of a placement, deg.

    Examples:
        >>> placement(4 * 64 + 63)
        (-5.625, 0.0)
    """
    altitude, azimuth = divmod(number, TURNS)
    degrees = float(AZIMUTHS_DEG[azimuth])
    return (degrees - 360.0 if degrees > 180.0 else degrees), float(ALTITUDES_DEG[altitude])
