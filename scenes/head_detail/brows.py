"""Eyebrows: their position, density and direction of growth."""

from __future__ import annotations

import numpy as np

from scenes.head_detail.heads import MM, Floats, Head, load
from scenes.head_detail.outline import step
from scenes.head_detail.strands import Strands, along_skin, both_sides, grow, unit
from scenes.head_detail.surface import scatter, surface

# The middle line of the left brow, from its inner end to its tail: offsets from the eye in
# `Head.local`, and half the brow's height there, generic millimetres.
_MIDDLE_X = np.array([-0.175, -0.12, -0.04, 0.04, 0.11, 0.17, 0.225])
_MIDDLE_Y = np.array([0.197, 0.207, 0.225, 0.240, 0.241, 0.222, 0.190])
_HALF = np.array([3.6, 4.2, 4.0, 3.5, 2.9, 2.1, 1.2]) * MM


def _place(head: Head, positions: Floats) -> tuple[Floats, Floats]:
    """Return positions along the brow (0 inner end, 1 tail) and across it (-1 lower, 1 upper)."""
    local = head.local(positions)
    x = local[:, 0] - head.eye[0] / head.scale
    middle = np.interp(x, _MIDDLE_X, _MIDDLE_Y)
    half = np.interp(x, _MIDDLE_X, _HALF)
    along = (x - _MIDDLE_X[0]) / (_MIDDLE_X[-1] - _MIDDLE_X[0])
    across = (local[:, 1] - middle) / half
    across[local[:, 2] < -0.3] = 9.0
    return along, across


def brow_weight(head: Head, positions: Floats) -> Floats:
    """Return the density of the brow's hairs, (N,), 0 to 1, fading at edge and inner end."""
    along, across = _place(head, positions)
    inside = 1.0 - step(np.abs(across), 0.3, 1.25)
    # The lower edge is the sharper one.
    inside *= 1.0 - 0.35 * step(across, 0.0, 1.0)
    return inside * step(along, -0.10, 0.26) * (1.0 - 0.8 * step(along, 0.7, 1.03)) * (along < 1.04)


def brows(name: str, count: int = 460) -> Strands:
    """Return both eyebrows, `count` hairs each."""
    head, skin = load(name), surface(name)
    rng = np.random.default_rng(401)
    # The skin's vertices are too coarse for the edge: scatter widely, then keep by density.
    wide = (brow_weight(head, head.vertices) > 0.0).astype(np.float64)
    wide = np.maximum(wide, _margin(head))
    spots = scatter(head, wide, 12 * count, rng)
    weight = brow_weight(head, spots)
    roots, _ = skin.nearest(spots[rng.random(len(spots)) < weight][:count])
    along, across = _place(head, roots)
    lengths = np.interp(along, [0.0, 0.15, 0.6, 1.0], [6.0, 9.0, 9.5, 6.0]) * MM * head.scale
    lengths *= rng.uniform(0.7, 1.1, len(roots))
    angle = _angle(along, across) + rng.normal(0.0, 12.0, len(roots))
    lean = rng.uniform(0.22, 0.42, len(roots))

    def direction(points: Floats, normals: Floats, _: Floats, done: float) -> Floats:
        turned = np.radians(angle - 22.0 * done * step(along, 0.0, 0.4))
        flat = np.stack([np.cos(turned), np.sin(turned), np.zeros(len(points))], axis=1)
        return unit(along_skin(flat, normals) + (lean * (1.0 - 1.1 * done))[:, None] * normals)

    points = grow(roots, lengths, 8, direction, skin, lambda done: 0.25 * MM * min(1.0, 3 * done))
    return both_sides(points, rng.uniform(0.030, 0.050, len(points)) * MM)


def _margin(head: Head) -> Floats:
    along, across = _place(head, head.vertices)
    return ((along > -0.2) & (along < 1.2) & (np.abs(across) < 2.2)).astype(np.float64)


def _angle(along: Floats, across: Floats) -> Floats:
    """Return directions in degrees, seen from the front: 0 outward, 90 up.

    Hairs are upright at the inner end, then outward; above the middle line they lean down, below it
    up, so that both meet there; the tail runs outward and down.
    """
    middle = np.interp(
        along, [0.0, 0.1, 0.25, 0.5, 0.75, 1.0], [86.0, 68.0, 38.0, 16.0, -8.0, -28.0]
    )
    meet = np.interp(along, [0.0, 0.2, 0.5, 1.0], [6.0, 16.0, 24.0, 12.0])
    angle: Floats = middle - meet * across.clip(-1.0, 1.0)
    return angle
