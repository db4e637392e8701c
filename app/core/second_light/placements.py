"""Where a second light may be held: 64 azimuths by 9 altitudes around the middle of the head."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS

Float64: TypeAlias = NDArray[np.float64]

AZIMUTHS_DEG: Final[Float64] = np.arange(TURNS, dtype=np.float64) * (360.0 / TURNS)
"""(64,) deg, from in front toward the sitter's left."""

ALTITUDES_DEG: Final[Float64] = np.arange(-4, 5, dtype=np.float64) * 16.875
"""(9,) deg, from below upward; the paper's band."""

COUNT: Final = len(ALTITUDES_DEG) * len(AZIMUTHS_DEG)
"""Placements; number j = altitude index * 64 + azimuth index."""

MIRRORED: Final[NDArray[np.int64]] = (
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

    Examples
    --------
    >>> placement(4 * 64 + 63)
    (-5.625, 0.0)
    """
    altitude, azimuth = divmod(number, TURNS)
    degrees = float(AZIMUTHS_DEG[azimuth])
    return (degrees - 360.0 if degrees > 180.0 else degrees), float(ALTITUDES_DEG[altitude])
