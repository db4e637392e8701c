"""Smooth noise in space, the same on the left and the right of the head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def _hash(cell: NDArray[np.int64], seed: int) -> Floats:
    """Return a number in [-1, 1] for every lattice point (..., 3), by integer hashing."""
    key = cell[..., 0] * 73856093 ^ cell[..., 1] * 19349663 ^ cell[..., 2] * 83492791
    mixed = (key ^ (seed * 2654435761)).astype(np.uint64) & np.uint64(0xFFFFFFFF)
    for shift, factor in ((16, 0x45D9F3B), (16, 0x45D9F3B), (16, 1)):
        mixed = ((mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)) & np.uint64(0xFFFFFFFF)
    unit: Floats = mixed.astype(np.float64) / 2.0**31 - 1.0
    return unit


def _value_noise(points: Floats, seed: int) -> Floats:
    """Return interpolated random values of the unit lattice at points (N, 3), about [-1, 1]."""
    floor = np.floor(points)
    cell, part = floor.astype(np.int64), points - floor
    weight = part * part * part * (part * (part * 6.0 - 15.0) + 10.0)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        step = np.array(corner)
        share = np.where(step == 1, weight, 1.0 - weight).prod(axis=1)
        total += share * _hash(cell + step, seed)
    return total


def noise(points: Floats, size: float | tuple[float, float, float], seed: int) -> Floats:
    """Return noise of unit deviation, (N,): the smooth mean of a point and its mirror image.

    Args:
        points: (N, 3) float64. Any unit.
        size: Width of a blob in the same unit, or one width per axis.
    """
    scaled = points / np.asarray(size) + 0.37
    other = points * np.array([-1.0, 1.0, 1.0]) / np.asarray(size) + 0.37
    # Lattice values have a deviation of 1/sqrt(3); points in between have less.
    both: Floats = (_value_noise(scaled, seed) + _value_noise(other, seed)) * (1.9 / 2.0**0.5)
    return both


def fractal(points: Floats, size: float, seed: int, octaves: int = 3) -> Floats:
    """Return the sum of noises of halving size and weight, of about unit deviation."""
    total = np.zeros(len(points))
    for k in range(octaves):
        total += noise(points, size / 2.0**k, seed + k) * 0.5**k
    total /= np.sqrt(sum(0.25**k for k in range(octaves)))
    return total
