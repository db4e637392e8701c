"""Reproducible, tileable random fields and small colour helpers for the textures."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["cells", "fractal", "linear", "mix", "normalised", "smooth"]

Floats = NDArray[np.float32]


def linear(colour: str) -> Floats:
    """Convert ``#rrggbb`` to linear Rec. 709."""
    code = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], np.float64) / 255
    straight = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    return np.asarray(straight, np.float32)


def mix(a: Floats, b: Floats, t: Floats) -> Floats:
    """Blend colours, (3,) or (H, W, 3), by a mask, (H, W)."""
    return np.asarray(a + (b - a) * t[..., None], np.float32)


def smooth(low: float, high: float, x: Floats) -> Floats:
    """Return the smooth step from 0 at `low` to 1 at `high`."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t), np.float32)


def normalised(field: Floats) -> Floats:
    """Shift and scale a field to mean 0 and deviation 1."""
    return np.asarray((field - field.mean()) / max(float(field.std()), 1e-9), np.float32)


def fractal(
    rng: np.random.Generator,
    shape: tuple[int, int],
    coarsest: tuple[float, float] = (4, 4),
    fall: float = 0.55,
) -> Floats:
    """Return a tileable sum of octaves of smooth noise, mean 0 and deviation 1.

    Args:
        rng: Source of randomness.
        shape: Rows and columns.
        coarsest: Cells of the coarsest octave, down and across; unequal numbers give streaks.
        fall: Amplitude of an octave over that of the previous one.
    """
    total = np.zeros(shape, np.float32)
    weight, down, across = 1.0, float(coarsest[0]), float(coarsest[1])
    while down <= shape[0] / 2 or across <= shape[1] / 2:
        rows = max(1, min(round(down), shape[0]))
        columns = max(1, min(round(across), shape[1]))
        grid = rng.standard_normal((rows, columns)).astype(np.float32)
        grid = np.pad(grid, 2, mode="wrap")
        step = (shape[0] / rows, shape[1] / columns)
        x = (np.arange(shape[1], dtype=np.float32) + 0.5) / step[1] + 1.5
        y = (np.arange(shape[0], dtype=np.float32) + 0.5) / step[0] + 1.5
        across_map, down_map = np.meshgrid(x, y)
        octave = cv2.remap(grid, across_map, down_map, cv2.INTER_CUBIC)
        total += weight * octave
        weight *= fall
        down, across = 2 * down, 2 * across
    return normalised(total)


def cells(
    rng: np.random.Generator, shape: tuple[int, int], counts: tuple[int, int], jitter: float
) -> tuple[NDArray[np.int32], Floats]:
    """Return tileable irregular cells: stones, mosaic, cracks.

    Returns:
        identity: (H, W) int32. Number of each pixel's cell.
        edge: (H, W). Distance to the next cell in widths of a cell, 0 at the joint.
    """
    rows, columns = counts
    y, x = np.meshgrid(
        (np.arange(shape[0]) + 0.5) / shape[0] * rows,
        (np.arange(shape[1]) + 0.5) / shape[1] * columns,
        indexing="ij",
    )
    centre = rng.uniform(-0.5 * jitter, 0.5 * jitter, (rows, columns, 2)) + 0.5
    centre[1::2, :, 1] += 0.5
    first = np.full(shape, 1e9)
    second = np.full(shape, 1e9)
    identity = np.zeros(shape, np.int32)
    base_y, base_x = np.floor(y).astype(int), np.floor(x).astype(int)
    for dy in (-1, 0, 1):
        for dx in (-2, -1, 0, 1):
            cy, cx = base_y + dy, base_x + dx
            at = centre[cy % rows, cx % columns]
            away = np.maximum(np.abs(y - cy - at[..., 0]), np.abs(x - cx - at[..., 1])) * 0.65
            away += np.hypot(y - cy - at[..., 0], x - cx - at[..., 1]) * 0.35
            nearer = away < first
            second = np.where(nearer, first, np.minimum(second, away))
            identity = np.where(nearer, (cy % rows) * columns + cx % columns, identity)
            first = np.where(nearer, away, first)
    return identity.astype(np.int32), (second - first).astype(np.float32)
