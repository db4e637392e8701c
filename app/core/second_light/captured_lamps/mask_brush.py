"""A brush for correcting a lamp's mask, which is round on the sphere, not in the panorama."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np

from app.core.base.arrays import Float32

Point: TypeAlias = tuple[float, float]
"""Azimuth and elevation in the capture, in degrees."""

_APART: Final = 0.5  # maximum distance between dabs of a stroke, in radii


def stroke(alpha: Float32, points: tuple[Point, ...], radius_deg: float, is_lamp: bool) -> Float32:
    """Add or remove the area that a round brush covers from point to point.

    Args:
        alpha: (H, 2 H) float32. Fraction of each texel that the lamp covers, 0 to 1. The array is
            not changed.
        points: The path of the brush. Between points, it takes the shorter way around the sphere.
        radius_deg: Radius of the brush, in degrees, at least half a texel.
        is_lamp: Whether to add the area rather than remove it.

    Returns:
        (H, 2 H) float32. The new mask. Texels at the edge of the brush are blended.
    """
    rows, columns = alpha.shape
    step = 180.0 / rows
    radius = max(radius_deg, 0.5 * step)
    new = alpha.copy()
    height = np.radians(90.0 - step * (np.arange(rows) + 0.5))
    around = np.radians(step * (np.arange(columns) + 0.5) - 180.0)
    for azimuth, elevation in _along(points, max(_APART * radius, step)):
        # Use only the rows within the brush's reach.
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
        new[first:last] = np.maximum(part, share) if is_lamp else np.minimum(part, 1.0 - share)
    return new


def _along(points: tuple[Point, ...], step: float) -> list[Point]:
    """Return points along a stroke, at most `step` degrees apart."""
    path = [points[0]]
    for (a, e), (b, f) in pairwise(points):
        across = (b - a + 180.0) % 360.0 - 180.0
        count = max(math.ceil(math.hypot(across, f - e) / step), 1)
        path += [(a + across * k / count, e + (f - e) * k / count) for k in range(1, count + 1)]
    return path
