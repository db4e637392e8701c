"""Placements of a second light, at 64 azimuths and 9 altitudes around the head.

The floor and the length of an arm limit the possible placements.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float64, Int64

EAR_HEIGHT_M: Final = 1.2
"""Height of the centre of the head above the floor, in metres, for a sitter on a chair."""

_CLEAR_M: Final = 0.05  # above the floor
_SHOULDER_M: Final = (0.19, -0.27, -0.03)  # the left shoulder, from the middle of the head
_ARM_M: Final = 0.75  # metres from the shoulder to the object in the hand
_BACK_M: Final = -0.35  # farthest reach of a hand behind the middle of the head
# The trunk below the neck: half its width and depth, and the height of its top.
_TRUNK_M: Final = (0.21, 0.13, -0.22)


def above_floor(distance_m: float, ear_height_m: float = EAR_HEIGHT_M) -> Bools:
    """Return a mask, (576,) bool, of the placements above the floor."""
    height: Float64 = directions()[:, 1] * distance_m
    return np.asarray(height >= _CLEAR_M - ear_height_m)


def within_arm(distance_m: float) -> Bools:
    """Return a mask, (576,) bool, of the placements within the sitter's own reach.

    These placements are within reach of either arm, not far behind the head, and not inside the
    torso.
    """
    places = directions() * distance_m
    shoulders = np.array([_SHOULDER_M, (-_SHOULDER_M[0], *_SHOULDER_M[1:])])
    away = np.linalg.norm(places[:, None] - shoulders, axis=2).min(axis=1)
    wide, deep, top = _TRUNK_M
    trunk = (places[:, 1] < top) & (np.hypot(places[:, 0] / wide, places[:, 2] / deep) < 1.0)
    return np.asarray((away <= _ARM_M) & (places[:, 2] >= _BACK_M) & ~trunk)


AZIMUTHS_DEG: Final[Float64] = np.arange(TURNS, dtype=np.float64) * (360.0 / TURNS)
"""Azimuths, (64,), in degrees, from the front towards the sitter's left."""

ALTITUDES_DEG: Final[Float64] = np.arange(-4, 5, dtype=np.float64) * 16.875
"""Altitudes, (9,), in degrees, from below to above, as in the paper."""

COUNT: Final = len(ALTITUDES_DEG) * len(AZIMUTHS_DEG)
"""Number of placements. The number of a placement is altitude index * 64 + azimuth index."""

MIRRORED: Final[Int64] = (
    np.arange(len(ALTITUDES_DEG))[:, None] * TURNS + (-np.arange(TURNS)) % TURNS
).ravel()
"""Number of the placement on the opposite side of the face, for each placement, (576,)."""


def direction(azimuth_deg: float, altitude_deg: float) -> Float64:
    """Return the unit vector of a placement, (3,), in the head's frame."""
    azimuth, altitude = np.radians([azimuth_deg, altitude_deg])
    level = np.cos(altitude)
    return np.array([np.sin(azimuth) * level, np.sin(altitude), np.cos(azimuth) * level])


def directions() -> Float64:
    """Return the unit vectors of all placements, (576, 3), in the head's frame."""
    return np.array([direction(*placement(number)) for number in range(COUNT)])


def placement(number: int) -> tuple[float, float]:
    """Return the azimuth, within (-180, 180], and the altitude of a placement, in degrees.

    Examples:
        >>> placement(4 * 64 + 63)
        (-5.625, 0.0)
    """
    altitude, azimuth = divmod(number, TURNS)
    degrees = float(AZIMUTHS_DEG[azimuth])
    return (degrees - 360.0 if degrees > 180.0 else degrees), float(ALTITUDES_DEG[altitude])
