"""A brush for a lamp's mask: round on the sphere, whatever the panorama does to its shape."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Float32: TypeAlias = NDArray[np.float32]
Point: TypeAlias = tuple[float, float]
"""Azimuth and elevation in the capture, deg."""

_APART: Final = 0.5  # of the radius: dabs of a stroke lie no farther from each other


def stroke(alpha: Float32, points: tuple[Point, ...], radius_deg: float, lit: bool) -> Float32:
    """Draw with the brush from point to point, the shorter way around; see `dab`.

    Parameters
    ----------
    alpha : NDArray[np.float32], (H, 2 H)
        Not changed.
    radius_deg : float
        Of the brush, deg.
    """
    rows, columns = alpha.shape
    step = 180.0 / rows
    radius = max(radius_deg, 0.5 * step)
    new = alpha.copy()
    height = np.radians(90.0 - step * (np.arange(rows) + 0.5))
    around = np.radians(step * (np.arange(columns) + 0.5) - 180.0)
    for azimuth, elevation in _along(points, max(_APART * radius, step)):
        # Only the rows that it can reach.
        first = max(math.floor((90.0 - elevation - radius) / step) - 1, 0)
        last = min(math.ceil((90.0 - elevation + radius) / step) + 1, rows)
        if first >= last:
            continue
        across, middle = np.cos(around - math.radians(azimuth)), math.radians(elevation)
        near = np.outer(math.cos(middle) * np.cos(height[first:last]), across)
        near += (math.sin(middle) * np.sin(height[first:last]))[:, None]
        away = np.degrees(np.arccos(np.clip(near, -1.0, 1.0)))
        share = np.clip((radius - away) / step + 0.5, 0.0, 1.0).astype(np.float32)
        part = new[first:last]
        new[first:last] = np.maximum(part, share) if lit else np.minimum(part, 1.0 - share)
    return new


def _along(points: tuple[Point, ...], step: float) -> list[Point]:
    """Points of a stroke, none farther than `step` from the next, deg."""
    found = [points[0]]
    for (a, e), (b, f) in pairwise(points):
        across = (b - a + 180.0) % 360.0 - 180.0
        count = max(math.ceil(math.hypot(across, f - e) / step), 1)
        found += [(a + across * k / count, e + (f - e) * k / count) for k in range(1, count + 1)]
    return found
