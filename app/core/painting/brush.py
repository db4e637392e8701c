"""The brush: its tools, its profile, and how far a piece of path covers the canvas.

A stroke is the path of a round brush. A pixel's cover is the profile at its distance from the
path, so it does not depend on where the path was cut into pieces nor on how many events came.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.painting.canvas import Region

Float32: TypeAlias = NDArray[np.float32]
Point: TypeAlias = tuple[float, float]

LEAST_DIAMETER: Final = 2.0
"""Smallest brush, canvas pixels."""

_RESTING: Final = 1e-6  # canvas pixels: a shorter way is none, and cannot be divided by
_EDGE: Final = 1.0  # the hardest edge still fades over a pixel, or it would show steps


class Tool(StrEnum):
    """What a stroke does."""

    BRIGHTER = "brighter"
    DARKER = "darker"
    IGNORE = "ignore"
    RESTORE = "restore"


@dataclass(frozen=True, slots=True)
class Brush:
    """What is painted with.

    Attributes
    ----------
    diameter : float
        Canvas pixels.
    strength : float
        0 to 1: how far one stroke goes toward the tool's goal.
    softness : float
        0 to 1: share of the radius over which the brush fades out.
    """

    tool: Tool = Tool.BRIGHTER
    diameter: float = 64.0
    strength: float = 0.3
    softness: float = 0.7
    mirror: bool = False
    pen_pressure: bool = False

    @property
    def radius(self) -> float:
        """Canvas pixels."""
        return 0.5 * max(self.diameter, LEAST_DIAMETER)

    @property
    def full_radius(self) -> float:
        """Radius of full strength (the dashed inner ring), canvas pixels."""
        inner = (1.0 - min(max(self.softness, 0.0), 1.0)) * self.radius
        return max(min(inner, self.radius - _EDGE), 0.0)


def reach(start: Point, stop: Point, radius: float, size: int) -> Region:
    """Part of a canvas that a piece of path can touch.

    Parameters
    ----------
    start, stop : tuple of float
        Ends (x, y), canvas pixels from the upper left corner.
    radius : float
        Of the brush, canvas pixels.
    """
    (left, right), (top, bottom) = (sorted(ends) for ends in zip(start, stop, strict=True))
    return Region(
        max(int(np.floor(left - radius)), 0),
        max(int(np.floor(top - radius)), 0),
        min(int(np.ceil(right + radius)), size),
        min(int(np.ceil(bottom + radius)), size),
    )


def cover(brush: Brush, start: Point, stop: Point, region: Region) -> Float32:
    """Profile of the brush along a straight piece of path.

    Parameters
    ----------
    start, stop : tuple of float
        Ends (x, y), canvas pixels from the upper left corner; may be the same.

    Returns
    -------
    (h, w) float32
        1 within `full_radius` of the path, fading smoothly to 0 at the radius, at the centres
        of the region's pixels.
    """
    x = np.arange(region.left, region.right) + (0.5 - start[0])
    y = np.arange(region.top, region.bottom)[:, None] + (0.5 - start[1])
    dx, dy = stop[0] - start[0], stop[1] - start[1]
    length = dx * dx + dy * dy
    if length > _RESTING**2:
        along = (x * (dx / length) + y * (dy / length)).astype(np.float32)
        np.clip(along, 0.0, 1.0, out=along)
        across = x.astype(np.float32) - np.float32(dx) * along
        away = y.astype(np.float32) - np.float32(dy) * along
        distance = across * across
        distance += away * away
    else:
        distance = (x * x + y * y).astype(np.float32)
    np.sqrt(distance, out=distance)
    fade = np.float32(1.0 / (brush.radius - brush.full_radius))
    rest = np.float32(brush.radius) - distance
    rest *= fade
    np.clip(rest, 0.0, 1.0, out=rest)
    # Smoothstep: no visible ring where the fade begins and ends.
    profile: Float32 = rest * rest * (np.float32(3.0) - np.float32(2.0) * rest)
    return profile
