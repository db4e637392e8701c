"""Where a lamp can be held: not through the floor, and no farther than an arm reaches."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.second_light.placements import directions

Mask: TypeAlias = NDArray[np.bool_]
Float64: TypeAlias = NDArray[np.float64]

EAR_HEIGHT_M: Final = 1.2
"""Height of the middle of the head above the floor, of a sitter on a chair."""

_CLEAR_M: Final = 0.05  # of the floor
_SHOULDER_M: Final = (0.19, -0.27, -0.03)  # the left one, from the middle of the head
_ARM_M: Final = 0.75  # from the shoulder to what a hand holds
_BACK_M: Final = -0.35  # behind the middle of the head a hand reaches no farther
# The trunk below the neck: half its width and depth, and where it begins.
_TRUNK_M: Final = (0.21, 0.13, -0.22)


def above_floor(distance_m: float, ear_height_m: float = EAR_HEIGHT_M) -> Mask:
    """Find the placements that are not through the floor.

    Parameters
    ----------
    distance_m : float
        From the middle of the head to the lamp, metres.
    ear_height_m : float, optional
        Of the middle of the head above the floor, metres.

    Returns
    -------
    (576,) bool
    """
    height: Float64 = directions()[:, 1] * distance_m
    return np.asarray(height >= _CLEAR_M - ear_height_m)


def within_arm(distance_m: float) -> Mask:
    """Find the placements to which somebody can hold a lamp for a picture of themselves.

    Parameters
    ----------
    distance_m : float
        From the middle of the head to the lamp, metres.

    Returns
    -------
    (576,) bool
        Within reach of either arm, not far behind the head, and not inside the trunk.
    """
    places = directions() * distance_m
    shoulders = np.array([_SHOULDER_M, (-_SHOULDER_M[0], *_SHOULDER_M[1:])])
    away = np.linalg.norm(places[:, None] - shoulders, axis=2).min(axis=1)
    wide, deep, top = _TRUNK_M
    trunk = (places[:, 1] < top) & (np.hypot(places[:, 0] / wide, places[:, 2] / deep) < 1.0)
    return np.asarray((away <= _ARM_M) & (places[:, 2] >= _BACK_M) & ~trunk)
