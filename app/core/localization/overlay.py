"""The live picture on the goal, from picture to picture: it neither trembles nor flips over.

Each picture gives a homography of its own, and each is a little different. What is steadied is
where the live picture's corners come to lie on the goal; from them follows the homography that is
shown. A picture that lies somewhere else all at once has to be seen there twice; one that cannot be
laid leaves the last one where it is for a moment, as long as the camera may still point there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.localization.homography import UNSURE, Alignment, corners_of, moved, sound
from app.core.localization.smoothing import Leash, Steady, steadied

if TYPE_CHECKING:
    from app.core.localization.homography import Size

Float64: TypeAlias = NDArray[np.float64]

_LEASH: Final = Leash(0.015, 0.10)  # widths of the goal
_STEP: Final = 0.06  # so far a corner may be from where it was, in widths,
_STEP_PER_S: Final = 0.8  # and so much more for each second since: a camera that turns
_STAYS_S: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Overlay:
    """How the live picture is shown on the goal; begin with `BARE`.

    Attributes
    ----------
    corners : Steady or None
        Of the live picture on the goal, (4, 2) in widths of the goal.
    rival : tuple of ((4, 2) float64, float) or None
        Corners that wait to be seen again, and when they were seen.
    """

    shown: Alignment = UNSURE
    corners: Steady | None = field(default=None, repr=False)
    rival: tuple[Float64, float] | None = field(default=None, repr=False)


BARE: Final = Overlay()
"""Nothing lies on the goal yet."""


def laid(before: Overlay, found: Alignment, sizes: tuple[Size, Size], now_s: float) -> Overlay:
    """Lay a picture on the goal.

    Parameters
    ----------
    sizes : tuple of (columns, rows)
        Of the picture and of the goal.
    """
    steady = before.corners
    if found.homography is None:
        stays = steady is not None and now_s - steady.time_s <= _STAYS_S
        return replace(before, rival=None) if stays else BARE
    corners = moved(found.homography, corners_of(sizes[0])) / sizes[1][0]
    if steady is None or now_s - steady.time_s > _STAYS_S:
        return Overlay(found, Steady.at(corners, now_s))
    if _near(corners, steady.measured, now_s - steady.time_s):
        return _followed(found, steadied(steady, corners, now_s, _LEASH), sizes)
    rival = before.rival
    if rival is not None and _near(corners, rival[0], now_s - rival[1]):
        return Overlay(found, Steady.at(corners, now_s))
    return replace(before, rival=(corners, now_s))


def _near(first: Float64, second: Float64, pause_s: float) -> bool:
    return float(np.abs(first - second).max()) <= _STEP + _STEP_PER_S * max(pause_s, 0.0)


def _followed(found: Alignment, steady: Steady, sizes: tuple[Size, Size]) -> Overlay:
    start = corners_of(sizes[0]).astype(np.float32)
    stop = (steady.shown * sizes[1][0]).astype(np.float32)
    matrix = np.asarray(cv2.getPerspectiveTransform(start, stop), np.float64)
    # Between two sound pictures lies a sound one, but nothing has to be taken on trust.
    if not sound(matrix, *sizes):
        return Overlay(found, Steady.at(steady.measured, steady.time_s))
    return Overlay(replace(found, homography=matrix), steady)
