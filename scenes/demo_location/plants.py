"""Leaves, pots, trees and climbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.demo_location.mesh import Geo, lathe, tube
from scenes.demo_location.noise import linear

if TYPE_CHECKING:
    from scenes.demo_location.place import Place

__all__ = ["climber", "leaves", "pot", "potted", "tree"]

Floats = NDArray[np.float64]
_GREENS = ("#4f6b2e", "#5d7c37", "#3f5a2a", "#71893f", "#486b3a", "#8a9a4e")
_BARK = linear("#6a5644")
_OLIVE = ("#7d8a63", "#6b7a55", "#909b78", "#59694a")


def leaves(
    rng: np.random.Generator,
    centres: Floats,
    length: float,
    width: float,
    lean: ArrayLike = (0.0, 0.3, 0.0),
    colours: tuple[str, ...] = _GREENS,
) -> Geo:
    """Return one folded leaf of four triangles at each centre, (N, 3), visible from both sides."""
    count = len(centres)
    along = rng.standard_normal((count, 3)) + np.asarray(lean, float)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, rng.standard_normal((count, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, along)
    size = np.exp(rng.normal(0, 0.28, (count, 1)))
    a, s, h = along * length * size, side * width / 2 * size, up * width * 0.22 * size
    tip, middle = a, 0.5 * a + 0.3 * h
    corners = np.stack(
        [0 * a, 0.28 * a + 0.9 * s + h, 0.62 * a + s + h, tip - 0.4 * h,
         0.62 * a - s + h, 0.28 * a - 0.9 * s + h, middle], axis=1,
    ) + centres[:, None]  # fmt: skip
    ring = [(6, k, (k + 1) % 6) for k in range(6)]
    first = np.arange(count)[:, None, None] * 7
    f = (first + np.array(ring)[None]).reshape(-1, 3)
    right = np.cross(a, s + h)
    left = np.cross(s - h, a) * -1
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    left = -np.cross(-s + h, a)
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    left *= np.sign(np.einsum("ij,ij->i", left, right))[:, None]
    mean = right + left
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    n = np.stack([mean, right, right, mean, left, left, mean], axis=1).reshape(-1, 3)
    n *= np.where(np.einsum("ij,ij->i", n, np.repeat(up, 7, axis=0)) < 0, -1, 1)[:, None]
    palette = np.stack([linear(c) for c in colours])
    c = palette[rng.integers(0, len(palette), count)] * np.exp(rng.normal(0, 0.2, (count, 1)))
    uv = np.zeros((count * 7, 2))
    return Geo(corners.reshape(-1, 3), n, uv, f, np.repeat(np.clip(c, 0.01, 0.6), 7, axis=0))


def _blob(rng: np.random.Generator, count: int, centre: ArrayLike, size: ArrayLike) -> Floats:
    p = rng.standard_normal((count, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    p *= rng.uniform(0.45, 1.05, (count, 1)) ** 0.6
    return np.asarray(np.asarray(centre, float) + p * np.asarray(size, float))


def pot(radius: float, height: float) -> Geo:
    """Return a terracotta pot with a rim and soil."""
    r, h = radius, height
    profile = [
        (0.01, 0), (0.66 * r, 0), (0.7 * r, 0.02), (0.93 * r, 0.8 * h), (0.94 * r, 0.81 * h),
        (1.06 * r, 0.82 * h), (1.08 * r, 0.84 * h), (1.08 * r, 0.98 * h), (1.05 * r, h),
        (0.97 * r, h), (0.95 * r, 0.97 * h), (0.92 * r, 0.9 * h), (0.01, 0.9 * h),
    ]  # fmt: skip
    return lathe(profile, 36)


def potted(place: Place, at: ArrayLike, radius: float, height: float, kind: str) -> None:
    """Add a potted plant: ``bush``, ``olive``, ``broad``, ``grass`` or ``flowers``."""
    x, y, z = (float(v) for v in np.asarray(at, float))
    rng = place.rng
    made = place.fresh()
    h = 1.7 * radius
    made.add("terracotta", pot(radius, h), shuffle=True)
    r = radius
    if kind == "olive":
        _stem(made, h, height * 0.6, 0.03)
        for _ in range(7):
            c = rng.normal(0, 0.22 * height / 2, 3) + np.array([0, h + 0.75 * height, 0])
            made.add(
                "leaf",
                leaves(
                    rng, _blob(rng, 260, c, (0.3, 0.26, 0.3)), 0.065, 0.016, (0, 0.6, 0), _OLIVE
                ),
            )
    elif kind == "broad":
        for _ in range(16):
            away = rng.normal(0, 0.45 * height / 2, 3)
            tip = np.array([away[0], h + height * rng.uniform(0.45, 1.0), away[2]])
            path = np.array(
                [[0, 0.8 * h, 0], [0.3 * tip[0], 0.6 * tip[1] + 0.2, 0.3 * tip[2]], tip]
            )
            made.add("leaf", tube(path, 0.007, 6).coloured(linear("#55703a")))
            made.add(
                "leaf", leaves(rng, tip[None], 0.34, 0.24, 3 * away / (np.linalg.norm(away) + 0.01))
            )
    elif kind == "grass":
        base = _blob(rng, 240, (0, h, 0), (0.6 * r, 0.02, 0.6 * r))
        made.add(
            "leaf", leaves(rng, base, height, 0.02, (0, 2.6, 0), ("#7f8f55", "#9aa065", "#6a8048"))
        )
    else:
        for _ in range(5):
            c = rng.normal(0, 0.5 * r, 3) * [1, 0.3, 1] + [0, h + 0.5 * height, 0]
            size = (1.1 * r, 0.5 * height, 1.1 * r)
            made.add("leaf", leaves(rng, _blob(rng, 300, c, size), 0.07, 0.045))
            if kind == "flowers":
                c = c + np.array([0, 0.12 * height, 0])
                red = ("#c8455a", "#d9738a", "#b8334a", "#e0b0b8")
                made.add("leaf", leaves(rng, _blob(rng, 70, c, size), 0.05, 0.05, (0, 1, 0), red))
    place.placed(made, float(rng.uniform(0, 360)), (x, y, z))


def _stem(place: Place, low: float, height: float, radius: float) -> None:
    k = np.linspace(0, 1, 7)
    bend = 0.07 * np.sin(3 * k)
    path = np.stack([bend, low * 0.8 + height * k, 0.5 * bend**2], axis=1)
    place.add("bark", tube(path, radius * (1.15 - 0.5 * k), 9).coloured(_BARK))


def tree(place: Place, at: ArrayLike, height: float, spread: float, count: int) -> None:
    """Add a broad tree: trunk, limbs and clouds of leaves."""
    x, y, z = (float(v) for v in np.asarray(at, float))
    rng = place.rng
    made = place.fresh()
    k = np.linspace(0, 1, 9)
    trunk = np.stack([0.12 * np.sin(4 * k), 0.55 * height * k, 0.1 * np.cos(3 * k)], axis=1)
    made.add("bark", tube(trunk, 0.03 * height * (1.25 - 0.6 * k), 14).coloured(_BARK))
    for limb in range(13):
        a = 2 * np.pi * (limb * 0.618)
        out = spread * rng.uniform(0.35, 0.95)
        tip = np.array([out * np.cos(a), height * rng.uniform(0.55, 1.0), out * np.sin(a)])
        start = trunk[int(rng.integers(4, 9))]
        bow = (start + tip) / 2 + [0, 0.08 * height, 0]
        t = k[:, None]
        path = (1 - t) ** 2 * start + 2 * t * (1 - t) * bow + t**2 * tip
        made.add("bark", tube(path, 0.012 * height * (1.1 - 0.9 * k), 8).coloured(_BARK))
        size = spread * rng.uniform(0.28, 0.5)
        points = _blob(rng, count // 13, tip, (size, 0.7 * size, size))
        made.add("leaf", leaves(rng, points, 0.13, 0.085, (0, -0.2, 0)))
    place.placed(made, float(rng.uniform(0, 360)), (x, y, z))


def climber(place: Place, width: float, height: float, count: int) -> Place:
    """Return ivy on a wall facing +z, growing from the lower left over `width` x `height`."""
    rng = place.rng
    made = place.fresh()
    points: list[Floats] = []
    for _ in range(26):
        x, y = rng.uniform(0, 0.5 * width), 0.0
        heading = rng.uniform(0.9, 2.0)
        path: list[list[float]] = []
        while 0 <= y < height * rng.uniform(0.8, 1.1) and 0 <= x < width and len(path) < 200:
            path.append([x, y, 0.03])
            heading += rng.normal(0, 0.22) + 0.04 * (1.5 - heading)
            x, y = x + 0.09 * np.cos(heading), y + 0.09 * np.sin(heading)
        if len(path) > 4:
            made.add("bark", tube(np.array(path), 0.012, 6).coloured(_BARK))
            points.append(np.array(path))
    stems = np.concatenate(points)
    chosen = stems[rng.integers(0, len(stems), count)]
    chosen = chosen + rng.normal(0, 1, (count, 3)) * [0.2, 0.2, 0.025] + [0, 0, 0.06]
    made.add("leaf", leaves(rng, chosen, 0.11, 0.1, (0, -0.6, 0.9)))
    return made
