"""Hairs as curves: their arrays, and how they grow along the skin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.head_detail.heads import Floats
from scenes.head_detail.surface import Surface

Heading = Callable[[Floats, Floats, Floats, float], Floats]


@dataclass(frozen=True, slots=True)
class Strands:
    """Hairs from root to tip.

    Attributes:
        points: (N, K, 3) float32. Points on each curve, head units.
        radii: (N,) float32. Radius near the root, head units; `taper` narrows it to the tip.
    """

    points: NDArray[np.float32]
    radii: NDArray[np.float32]


def taper(count: int, tip: float = 0.35) -> Floats:
    """Return the factors on a strand's radius from root to tip, (count,)."""
    along = np.linspace(0.0, 1.0, count)
    shape: Floats = 1.0 - (1.0 - tip) * along**2
    return shape


def both_sides(points: Floats, radii: Floats) -> Strands:
    """Return strands of the left half with their mirror images."""
    mirrored = points * np.array([-1.0, 1.0, 1.0])
    return Strands(
        np.concatenate([points, mirrored]).astype(np.float32),
        np.concatenate([radii, radii]).astype(np.float32),
    )


def unit(vectors: Floats) -> Floats:
    """Return vectors (..., 3) of length 1."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    short: Floats = vectors / np.maximum(length, 1e-9)
    return short


def along_skin(vectors: Floats, normals: Floats) -> Floats:
    """Return the part of vectors (N, 3) that is tangent to the skin, of unit length."""
    return unit(vectors - np.einsum("ij,ij->i", vectors, normals)[:, None] * normals)


def grow(
    roots: Floats,
    lengths: Floats,
    count: int,
    direction: Heading,
    skin: Surface,
    clearance: Callable[[float], Floats | float],
) -> Floats:
    """Grow strands (N, count, 3) step by step, keeping them off the skin.

    Args:
        roots: (N, 3). On the skin.
        lengths: (N,). Head units.
        direction: Returns each strand's direction for points (N, 3), skin normals below (N, 3),
            heights above the skin (N,) and the progress in [0, 1].
        clearance: Returns the least distance to the skin for the progress.
    """
    points = np.empty((len(roots), count, 3))
    points[:, 0] = roots
    step = (lengths / (count - 1))[:, None]
    for k in range(1, count):
        done = k / (count - 1)
        foot, normal = skin.nearest(points[:, k - 1])
        height = np.einsum("ij,ij->i", points[:, k - 1] - foot, normal)
        heading = unit(direction(points[:, k - 1], normal, height, done))
        least = np.broadcast_to(np.asarray(clearance(done), np.float64), (len(roots),))
        points[:, k] = skin.push_out(points[:, k - 1] + step * heading, least)
    return points
