"""The area of the head where hair grows."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter1d

from scenes.head_detail.heads import MM, Floats, Head, load
from scenes.head_detail.noise import fractal
from scenes.head_detail.outline import resample, signed_distance, step

_ROUND = 0.75
"""Radius on which the head is unrolled, generic units."""


def unroll(head: Head, positions: Floats) -> Floats:
    """Return points as (distance around the head from mid-forehead, height above the eyes)."""
    local = head.local(positions)
    middle = head.local(head.ear)[:, 2].mean() + 0.12
    angle = np.arctan2(local[:, 0], local[:, 2] - middle)
    return np.stack([_ROUND * angle, local[:, 1]], axis=1)


@cache
def _outline(name: str) -> Floats:
    """Return the border of the hair, unrolled, from the middle of the forehead to the nape."""
    head = load(name)
    ear = unroll(head, head.ear)
    front, back = ear[:, 0].min(), ear[:, 0].max()
    top, bottom = ear[:, 1].max(), ear[:, 1].min()
    corners = np.array(
        [
            (0.0, 0.665),
            (0.16, 0.670),
            (0.33, 0.665),
            (0.46, 0.625),
            (0.545, 0.53),
            (0.60, 0.40),
            (0.665, 0.27),
            (front - 0.13, 0.16),
            (front - 0.085, 0.02),
            (front - 0.075, bottom + 0.24),
            (front - 0.005, bottom + 0.24),
            (front + 0.0, 0.0),
            (front + 0.05, top + 0.02),
            (0.5 * (front + back), top + 0.07),
            (back - 0.05, top + 0.02),
            (back + 0.05, 0.5 * (top + bottom)),
            (back + 0.07, bottom + 0.04),
            (back + 0.22, bottom - 0.08),
            (back + 0.5, bottom - 0.14),
            (_ROUND * np.pi, bottom - 0.12),
        ]
    )
    line = resample(corners, 240)
    return np.asarray(gaussian_filter1d(line, 3.0, axis=0, mode="nearest"))


def inside(head: Head, positions: Floats) -> Floats:
    """Return the distance to the hairline in generic units, (N,), positive where hair grows."""
    line = _outline(head.name)
    beyond = [[9.0, line[-1, 1]], [9.0, 9.0], [0.0, 9.0]]
    closed = np.concatenate([[[0.0, line[0, 1]]], line, beyond])
    distance = signed_distance(unroll(head, positions), closed)
    # Not a straight edge: it varies by a few millimetres.
    wandering: Floats = distance + 0.018 * fractal(positions, 9.0 * MM, 501)
    return wandering


def on_ear(head: Head, positions: Floats) -> Floats:
    """Return 1 for points on the ears, 0 elsewhere, (N,)."""
    local, ear = head.local(positions), head.local(head.ear)
    low, high = ear.min(axis=0), ear.max(axis=0)
    within = np.all((local[:, 1:] > low[1:] - 0.01) & (local[:, 1:] < high[1:] + 0.01), axis=1)
    ears: Floats = (within & (local[:, 0] > low[0] + 0.035)).astype(np.float64)
    return ears


def hair_weight(head: Head, positions: Floats, soft: float = 0.07) -> Floats:
    """Return the density of the hair, (N,), 0 outside the hairline to 1 at `soft` inside."""
    weight: Floats = step(inside(head, positions), -0.01, soft) * (1.0 - on_ear(head, positions))
    return weight
