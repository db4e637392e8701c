"""Similarity between a face and the generic head under single lamps from every direction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from app.core.base.arrays import Bools, Float32, Float64, Indices
from app.core.base.sphere import directions
from app.core.faces.face_on_head import head_map

_STEP_DEG: Final = 5
_FARTHEST_DEG: Final = 130
_RISE_DEG: Final = (-45, 85)
SIZES_DEG: Final = (10.0, 40.0, 80.0)
"""Diameters of the lamps, in degrees."""

FILLS: Final = (8.0, 4.0, 2.5)
"""Ratios of key plus fill to the fill alone."""

_FILL_DEG: Final = 90.0
_ASIDE_DEG: Final = (15.0, 85.0)  # azimuths at which a key can be distinguished from a fill
_EVERY: Final = 3  # every third of the mirrored places
_AT_ONCE: Final = 256
_LEAST_SIZE_DEG: Final = 8.0  # a texel and a half
_EDGE_DEG: Final = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class LampSet:
    """Single lamps around the generic head.

    Attributes:
        ways, sizes: (n, 3) and (n,) float64. Unit vectors towards the lamps, and the diameters of
            the lamps in degrees.
        pictures, fill: (n, Q) and (Q,) float32. The skin as lit by each lamp, and by a frontal
            fill.
        pairs: (1 + F, n, M) float32. Difference between mirrored points divided by their sum, under
            each lamp alone and with each fill ratio.
        halves: (2, M) intp. The mirrored points, a subset of `HeadMap.halves`.
        aside, around: (n,) bool. Lamps that may be combined with a fill: the lamps in front, and
            the lamps in front or behind.
    """

    ways: Float64
    sizes: Float64
    pictures: Float32
    fill: Float32
    pairs: Float32
    halves: Indices
    aside: Bools
    around: Bools


def likeness_of(
    values: Float32,
    visible: Bools,
    pictures: Float32,
    fill: Float32 | None = None,
    ratios: tuple[float, ...] = (),
) -> Float64:
    """Return the correlation between a face and pictures of the head.

    Args:
        values, visible: (Q,). Luminance of the skin, and a mask of the visible pixels.
        pictures, fill: (n, Q) and (Q,). The head as lit by each lamp, and by the fill.
        ratios: Ratios of key plus fill to the fill alone.

    Returns:
        (1 + F, n) float64. The correlation without a fill, followed by that at each fill ratio.
    """
    own = np.where(visible, values - values[visible].mean(), 0).astype(np.float32)
    counts = visible.astype(np.float32)
    fill = np.zeros_like(own) if fill is None else fill
    product, total, mixed = (pictures @ np.stack([own, counts, fill * counts], axis=1)).T
    square = np.square(pictures) @ counts
    rows = []
    for share in (0.0, *(1 / (ratio - 1) for ratio in ratios)):
        sums = total + share * float(fill @ counts)
        squares = square + 2 * share * mixed + share**2 * float(fill**2 @ counts)
        size = np.sqrt(np.maximum(squares - sums**2 / counts.sum(), 0))
        rows.append((product + share * float(fill @ own)) / np.maximum(size, 1e-12))
    return np.asarray(np.stack(rows) / max(float(np.linalg.norm(own)), 1e-12), np.float64)


@lru_cache(maxsize=1)
def single_lamps() -> LampSet:
    """Light the generic head with single lamps from every direction, and with a fill."""
    head = head_map()
    azimuths = np.arange(-_FARTHEST_DEG, _FARTHEST_DEG + 1, _STEP_DEG)
    elevations = np.arange(_RISE_DEG[0], _RISE_DEG[1] + 1, _STEP_DEG)
    grid = np.meshgrid(SIZES_DEG, elevations, azimuths, indexing="ij")
    sizes, rise, across = (part.ravel().astype(np.float64) for part in grid)
    ways = _ways(across, rise)
    light = _light(np.append(ways, [[0, 0, 1]], axis=0), np.append(sizes, _FILL_DEG))
    pictures = light @ head.blurred(head.transport.luminance_basis.T)
    halves = head.halves[:, ::_EVERY]
    basis = head.blurred(head.transport.luminance_basis.T, halves.ravel())
    one, other = np.split(light @ basis, 2, axis=1)
    total = one + other
    shares = np.array([0.0, *(1 / (ratio - 1) for ratio in FILLS)], np.float32)[:, None, None]
    pairs = (one - other)[:-1] / np.maximum(total[:-1] + shares * total[-1], np.float32(1e-9))
    low, high = _ASIDE_DEG
    off = np.degrees(np.arcsin(np.minimum(np.abs(ways[:, 0]), 1)))
    return LampSet(
        ways,
        sizes,
        pictures[:-1],
        pictures[-1],
        pairs,
        halves,
        (off >= low) & (np.abs(across) <= high),
        off >= low,
    )


def _light(ways: Float64, sizes: Float64) -> Float32:
    """Return lamps of equal illuminance, expressed in the transport's basis, (n, R)."""
    transport = head_map().transport
    texels = directions(transport.environment_shape).reshape(-1, 3)
    level = np.hypot(texels[:, 0], texels[:, 2])
    values = np.empty((len(ways), len(transport.texel_basis)), np.float32)
    # Work in parts, since all lamps at once would need a hundred megabytes.
    for start in range(0, len(ways), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        size = sizes[part, None].astype(np.float32)
        apart = np.degrees(np.arccos(np.clip(ways[part].astype(np.float32) @ texels.T, -1, 1)))
        beyond = (apart - np.maximum(size, _LEAST_SIZE_DEG) / 2) / _EDGE_DEG
        light = 1 / (1 + np.exp(np.minimum(beyond, 80)))
        cap_share = 0.5 * (1 + np.cos(np.radians(size) / 2))
        light /= cap_share * (light @ level)[:, None]
        values[part] = light @ transport.texel_basis.T
    return values


def _ways(azimuth_deg: Float64, elevation_deg: Float64) -> Float64:
    """Return unit vectors in the head's frame, (n, 3)."""
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=1)
