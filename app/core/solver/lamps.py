"""Far lamps as environments, and which styles are mirror images of each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from app.core.base.arrays import Float64
from app.core.solver.styles import Style, StyleLamp, mirror

_FINE: Final = 8  # samples per texel and direction
_LEAST_DIAMETER_DEG: Final = 2.0


def far_lamp(lamp: StyleLamp, shape: tuple[int, int]) -> Float64:
    """Environment of one lamp of a style, moved far away, at turn 0.

    Args:
        lamp: Its azimuth counts toward the sitter's left, against the panorama's.
        shape: (H, W) of the environment.

    Returns:
        (H, W) float64. Radiance of a round lamp of the lamp's diameter, true to area on the texel
        grid, whose radiance times solid angle sums to the lamp's power.
    """
    height, width = shape
    azimuth = 2 * np.pi * ((np.arange(width * _FINE) + 0.5) / (width * _FINE) - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height * _FINE) + 0.5) / (height * _FINE))
    at, up = np.radians(-lamp.azimuth_deg), np.radians(lamp.elevation_deg)
    cosine = np.sin(up) * np.sin(elevation)[:, None] + np.cos(up) * np.outer(
        np.cos(elevation), np.cos(azimuth - at)
    )
    radius = np.radians(max(lamp.diameter_deg, _LEAST_DIAMETER_DEG)) / 2
    power = (cosine >= np.cos(radius)) * np.cos(elevation)[:, None]
    texels = power.reshape(height, _FINE, width, _FINE).sum(axis=(1, 3))
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    solid_angle = (2 * np.pi / width) * (edges[:-1] - edges[1:])
    return np.asarray(lamp.power * texels / texels.sum() / solid_angle[:, None])


def mirror_index(styles: Sequence[Style], style: Style) -> int | None:
    """Return the position of the style with the mirrored lamps, None where there is none."""
    wanted = sorted(mirror(style).lamps, key=_order)
    for position, other in enumerate(styles):
        if sorted(other.lamps, key=_order) == wanted:
            return position
    return None


def _order(lamp: StyleLamp) -> tuple[float, float, float]:
    return (lamp.azimuth_deg, lamp.elevation_deg, lamp.power)
