"""Pores and fine lines: the skin's normals at a scale of 0.1 to 1 mm.

Sheen on a smooth mesh looks like wax; on skin it breaks up into cells between furrows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scenes.head_detail.colours import lip_distance
from scenes.head_detail.heads import MM, Floats, load
from scenes.head_detail.noise import noise
from scenes.head_detail.outline import step

_STEEPEST = 0.4
_WET = 2.0
_REACH = 0.05 * MM
"""Half the step of the differences for the slope."""


def skin_bump(
    positions: Floats, normals: Floats, name: str = "generic", strength: float = 1.0
) -> NDArray[np.float32]:
    """Return the normals of the skin with pores and lines, (N, 3), of unit length.

    Args:
        positions, normals: (N, 3). Points of the smooth skin, head units.
        name: The head; on its lips the lines run up and down.
        strength: 0 returns the normals unchanged.
    """
    positions = np.asarray(positions, np.float64)
    normals = np.asarray(normals, np.float64)
    head = load(name)
    lips = step(lip_distance(head, positions), -1.0 * MM, 1.0 * MM)[:, None]
    slope = (1.0 - lips) * _slope(_skin_height, positions) * _region(head.local(positions))
    slope += lips * _slope(_lip_height, positions)
    slope -= np.einsum("ij,ij->i", slope, normals)[:, None] * normals
    # No steeper than 22 degrees, or grazing views would meet normals that face away.
    slope *= strength
    slope /= np.sqrt(1.0 + (slope**2).sum(axis=1, keepdims=True) / _STEEPEST**2)
    bent = normals - slope
    bent /= np.linalg.norm(bent, axis=1, keepdims=True)
    return bent.astype(np.float32)


def _region(local: Floats) -> Floats:
    """Return strengths, (N, 1): pores are coarse on nose and cheeks, fine around eyes and neck."""
    eyes = np.exp(-0.5 * (((local[:, 0] - 0.3) / 0.16) ** 2 + (local[:, 1] / 0.11) ** 2))
    nose = np.exp(-0.5 * ((local[:, 0] / 0.25) ** 2 + ((local[:, 1] + 0.35) / 0.3) ** 2))
    return (0.85 + 0.35 * nose - 0.35 * eyes)[:, None]


def oiliness(name: str, positions: Floats) -> Floats:
    """Return the sheen relative to usual skin, (N,): wet on lips, oily on nose and forehead."""
    head = load(name)
    local = head.local(positions)
    lips = step(lip_distance(head, positions), 0.0, 1.2 * MM)
    middle = np.exp(-0.5 * (local[:, 0] / 0.22) ** 2) * step(local[:, 1], -0.75, -0.35)
    shine: Floats = (1.0 + 0.24 * middle) * (1.0 - lips) + _WET * lips
    return shine


def _slope(height: Callable[[Floats], Floats], positions: Floats) -> Floats:
    """Return the gradient of a height field, (N, 3), by central differences."""
    slope = np.empty_like(positions)
    for axis in range(3):
        shift = np.zeros(3)
        shift[axis] = _REACH
        slope[:, axis] = (height(positions + shift) - height(positions - shift)) / (2.0 * _REACH)
    return slope


def _skin_height(points: Floats) -> Floats:
    """Return heights in head units: cells of 0.5 mm between furrows, pores, gentle waves."""
    cells = np.abs(noise(points, 1.1 * MM, 101)).clip(0.0, 0.8)
    fine = np.abs(noise(points, 0.55 * MM, 102)).clip(0.0, 0.8)
    pores = (noise(points, 0.9 * MM, 103) - 0.9).clip(0.0, None)
    waves = noise(points, 4.0 * MM, 104)
    return MM * (0.055 * cells + 0.022 * fine - 0.10 * pores + 0.06 * waves)


def _lip_height(points: Floats) -> Floats:
    lines = np.abs(noise(points, (1.0 * MM, 7.0 * MM, 7.0 * MM), 111)).clip(0.0, 1.0)
    return MM * 0.16 * lines
