"""Eyelashes: long, curved upper ones, and short, thin lower ones."""

from __future__ import annotations

import numpy as np

from scenes.head_detail.heads import MM, Floats, Head, load
from scenes.head_detail.outline import smooth
from scenes.head_detail.strands import Strands, both_sides, unit
from scenes.head_detail.surface import surface

_POINTS = 9


def lashes(name: str, upper: int = 120, lower: int = 62) -> Strands:
    """Return the lashes of both eyes, with `upper` and `lower` lashes per lid."""
    head = load(name)
    rng = np.random.default_rng(402)
    skin = surface(name)
    over = _row(head, head.upper_lashes, upper, rng, up=True)
    under = _row(head, head.lower_lashes, lower, rng, up=False)
    thick = np.concatenate([rng.uniform(0.060, 0.080, upper), rng.uniform(0.030, 0.042, lower)])
    points = np.concatenate([over, under])
    # The first point is in the skin; the others must not touch a fold of the lids.
    free = points[:, 1:].reshape(-1, 3)
    points[:, 1:] = skin.push_out(free, np.full(len(free), 0.15 * MM)).reshape(points[:, 1:].shape)
    return both_sides(points, thick * MM)


def _row(head: Head, line: Floats, count: int, rng: np.random.Generator, *, up: bool) -> Floats:
    """Return one lid's lashes, (count, K, 3), fanning out and bunched in small groups."""
    fine = smooth(line, 400, 12.0)
    along = np.sort(rng.uniform(0.05 if up else 0.12, 0.99, count))
    roots = fine[(along * 399).astype(int)]
    roots = roots + rng.normal(0.0, 0.12 * MM, roots.shape)
    outward = unit(roots - head.eye)
    # Away from the eyeball, mostly forward, and fanned to the sides by the root's position.
    fan = (along - 0.45)[:, None] * np.array([1.5, 0.0, 0.0]) + rng.normal(0.0, 0.10, (count, 1))
    bunch = 0.10 * np.sin(along * (31.0 if up else 17.0) * np.pi)
    fan[:, 0] += bunch
    start = unit(outward + np.array([0.0, -0.42 if up else 0.15, 0.45]) + 0.6 * fan)
    lift = np.array([0.0, 1.0 if up else -0.75, 0.1])
    longest = (8.2 if up else 4.8) * MM * head.scale
    shape = np.interp(along, [0.0, 0.3, 0.7, 0.9, 1.0], [0.45, 0.8, 1.0, 1.0, 0.75])
    lengths = longest * shape * rng.uniform(0.75, 1.08, count)
    points = np.empty((count, _POINTS, 3))
    points[:, 0] = roots
    for k in range(1, _POINTS):
        done = (k - 1) / (_POINTS - 2)
        heading = unit(start + (1.35 if up else 0.8) * done * (lift + 0.4 * fan))
        points[:, k] = points[:, k - 1] + (lengths / (_POINTS - 1))[:, None] * heading
    return points
