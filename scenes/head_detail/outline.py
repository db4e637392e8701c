"""Smooth outlines on the face, seen from the front, and the signed distance to them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d

from scenes.head_detail.heads import Floats


def resample(line: Floats, count: int) -> Floats:
    """Return a polyline (N, D) as `count` points evenly spaced along it."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, column) for column in line.T], axis=1)


def smooth(line: Floats, count: int, width: float) -> Floats:
    """Resample a line, then blur it along `width` of its points, keeping the ends in place."""
    fine = resample(line, count)
    blurred: Floats = gaussian_filter1d(fine, width, axis=0, mode="nearest")
    # The blur pulls the ends inwards: undo each end's shift, fading along the line.
    fade = np.exp(-np.arange(count) / (3.0 * width))[:, None]
    blurred += fade * (fine[0] - blurred[0]) + fade[::-1] * (fine[-1] - blurred[-1])
    return blurred


def signed_distance(points: Floats, half: Floats) -> Floats:
    """Return the distance of points (N, 2) to an outline, (N,), positive inside.

    Args:
        points: x >= 0, as the outline is the same on both sides.
        half: (M, 2). Right half of the outline, between its points at x = 0.
    """
    squared, inside = np.full(len(points), np.inf), np.zeros(len(points), bool)
    for a, b in pairwise(half):
        edge = b - a
        part = ((points - a) @ edge / max(float(edge @ edge), 1e-12)).clip(0.0, 1.0)
        gap = points - a - part[:, None] * edge
        squared = np.minimum(squared, np.einsum("ij,ij->i", gap, gap))
        crosses = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
        if abs(edge[1]) > 1e-12:
            at = a[0] + (points[:, 1] - a[1]) / edge[1] * edge[0]
            inside ^= crosses & (points[:, 0] < at)
    distance: Floats = np.sqrt(squared) * np.where(inside, 1.0, -1.0)
    return distance


def step(value: Floats, low: Floats | float, high: Floats | float) -> Floats:
    """Return the smooth step from 0 at `low` to 1 at `high`."""
    t = ((value - low) / (high - low)).clip(0.0, 1.0)
    smooth_t: Floats = t * t * (3.0 - 2.0 * t)
    return smooth_t
