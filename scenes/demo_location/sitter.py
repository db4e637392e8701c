"""The sitter: the project's head, short hair, and a body in a jumper."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scenes.demo_location.frame import EYE_HEIGHT
from scenes.demo_location.mesh import Geo
from scenes.demo_location.noise import linear

__all__ = ["body", "dressed_head"]

Floats = NDArray[np.float64]
_UNIT: Final = 0.1  # metres per unit of the head's files
_STEP: Final = 0.011
_LOW, _HIGH = np.array([-0.42, 0.0, -0.26]), np.array([0.42, 1.52, 0.26])


def dressed_head(skin: Geo, eyes: Geo, between_eyes: Floats, hair: bool = True) -> tuple[Geo, Geo]:
    """Return the head, moved so that the middle between the ears is at the probe's height.

    Returns:
        skin, eyes: In metres, the face toward +z, with vertex colours.
    """
    beside = skin.v[np.abs(skin.v[:, 1] - between_eyes[1]) < 0.5]
    ears = beside[np.abs(beside[:, 0]) > 0.97 * np.abs(beside[:, 0]).max()].mean(axis=0)
    ears[0] = 0.0
    colours, lift = _painted(skin, ears, between_eyes)
    lift = lift if hair else np.zeros_like(lift)
    v = (skin.v + lift[:, None] * skin.n - ears) * _UNIT + [0, EYE_HEIGHT, 0]
    placed = Geo(v, skin.n, skin.uv, skin.f, colours)
    ball = (eyes.v - ears) * _UNIT + [0, EYE_HEIGHT, 0]
    return placed, Geo(ball, eyes.n, eyes.uv, eyes.f, eyes.c)


def _painted(skin: Geo, ears: Floats, eyes: Floats) -> tuple[Floats, Floats]:
    """Return the albedo of skin, lips, brows and hair, and the hair's thickness in head units."""
    rng = np.random.default_rng(5)
    p = skin.v - ears - [0, 0.25, 0]
    across = np.abs(skin.v[:, 0])
    azimuth = np.degrees(np.arctan2(np.abs(p[:, 0]), p[:, 2]))
    elevation = np.degrees(np.arctan2(p[:, 1], np.hypot(p[:, 0], p[:, 2])))
    line = np.interp(azimuth, [0, 35, 58, 72, 95, 112, 135, 180], [39, 37, 24, 15, 16, 2, -34, -42])
    edge = elevation - line + rng.normal(0, 1.6, len(p))
    hair = np.clip(edge / 7, 0, 1)
    tone = linear("#c58c6c").astype(float) * np.exp(rng.normal(0, 0.02, (len(p), 1)))
    d = skin.v - eyes
    cheek = np.exp(-(((across - 0.42) / 0.22) ** 2) - ((d[:, 1] + 0.42) / 0.24) ** 2)
    nose = np.exp(-((across / 0.17) ** 2) - ((d[:, 1] + 0.4) / 0.14) ** 2) * (d[:, 2] > 0.1)
    tone = tone * (1 + (0.55 * cheek + 0.4 * nose)[:, None] * np.array([0.1, -0.22, -0.2]))
    brow = np.exp(-(((d[:, 1] - 0.2 - 0.05 * np.sin(4 * across)) / 0.045) ** 2))
    brow *= ((across > 0.1) & (across < 0.52) & (d[:, 2] > -0.6)) * rng.uniform(0.55, 1.0, len(p))
    lips = np.exp(-((across / 0.22) ** 4) - ((d[:, 1] + 0.74) / 0.075) ** 4) * (d[:, 2] > -0.1)
    dark = linear("#33241b").astype(float) * np.exp(rng.normal(0, 0.3, (len(p), 1)))
    tone = tone + (linear("#a9574f") - tone) * (0.6 * lips)[:, None]
    tone = tone + (dark - tone) * np.maximum(0.75 * brow, hair)[:, None]
    lift = hair * (0.1 + 0.1 * np.clip(edge / 30, 0, 1)) * (1 + 0.18 * rng.standard_normal(len(p)))
    return np.clip(tone, 0.01, 0.9), lift


def _capsule(
    p: Any, a: list[float], b: list[float], ra: float, rb: float, flat: float = 1.0
) -> Any:
    start, end = np.array(a), np.array(b)
    size = np.array([1, 1, flat])
    q, way = (p - start) / size, (end - start) / size
    t = np.clip(q @ way / (way @ way), 0, 1)
    return np.linalg.norm(q - t[..., None] * way, axis=-1) - (ra + (rb - ra) * t)


def _joined(distances: list[Any], blend: float) -> Any:
    total = distances[0]
    for d in distances[1:]:
        h = np.clip(0.5 + 0.5 * (total - d) / blend, 0, 1)
        total = total + (d - total) * h - blend * h * (1 - h)
    return total


def _upper(p: Any) -> Any:
    """Return the signed distance to the jumper."""
    folds = 0.0035 * np.sin(70 * p[..., 1] + 9 * np.sin(14 * p[..., 0]) + 30 * p[..., 2])
    loose = np.exp(-(((p[..., 1] - 1.02) / 0.14) ** 2))
    parts = [
        _capsule(p, [0, 1.24, -0.02], [0, 0.98, -0.005], 0.165, 0.15, 0.66),
        _capsule(p, [-0.155, 1.385, -0.035], [0.155, 1.385, -0.035], 0.062, 0.062, 1.0),
        _capsule(p, [0, 1.412, -0.03], [0, 1.33, -0.032], 0.068, 0.105, 0.95),
        _capsule(p, [0, 0.98, 0], [0, 0.86, 0], 0.155, 0.168, 0.7),
    ]
    for s in (-1, 1):
        parts.append(_capsule(p, [s * 0.185, 1.365, -0.035], [s * 0.265, 1.08, -0.05], 0.064, 0.05))
        parts.append(_capsule(p, [s * 0.265, 1.08, -0.05], [s * 0.275, 0.86, 0.05], 0.05, 0.042))
    return np.maximum(_joined(parts, 0.055) + folds * (0.4 + loose), 0.81 - p[..., 1] - folds)


def _lower(p: Any) -> Any:
    parts = [_capsule(p, [0, 0.9, 0], [0, 0.84, 0], 0.15, 0.15, 0.7)]
    for s in (-1, 1):
        parts.append(_capsule(p, [s * 0.09, 0.84, 0], [s * 0.1, 0.46, 0.02], 0.088, 0.064))
        parts.append(_capsule(p, [s * 0.1, 0.46, 0.02], [s * 0.11, 0.07, -0.01], 0.064, 0.05))
        parts.append(_capsule(p, [s * 0.11, 0.045, -0.03], [s * 0.13, 0.04, 0.14], 0.045, 0.04))
    return _joined(parts, 0.02)


def _hands(p: Any) -> Any:
    parts = []
    for s in (-1, 1):
        parts.append(
            _capsule(p, [s * 0.275, 0.86, 0.05], [s * 0.272, 0.77, 0.085], 0.03, 0.036, 1.0)
        )
        parts.append(_capsule(p, [s * 0.272, 0.77, 0.085], [s * 0.262, 0.69, 0.1], 0.032, 0.016))
    return _joined(parts, 0.02)


def body() -> dict[str, Geo]:
    """Return surfaces by material, standing at the origin and facing +z."""
    made = {"knit": _surface(_upper), "trousers": _surface(_lower)}
    made["hands"] = _surface(_hands).coloured(linear("#c58c6c"))
    return {name: geo.scaled(0.93, 1.0, 0.98) for name, geo in made.items()}


def _surface(distance: Any) -> Geo:
    """Return the zero level of a distance function, by surface nets on a regular grid."""
    axes = [np.arange(a, b, _STEP) for a, b in zip(_LOW - 0.03, _HIGH + 0.03, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    field = distance(points)
    cube = np.stack(
        [field[i : i - 1 or None, j : j - 1 or None, k : k - 1 or None]
         for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )  # fmt: skip
    crossing = (cube.min(axis=0) < 0) & (cube.max(axis=0) >= 0)
    number = np.full(crossing.shape, -1)
    number[crossing] = np.arange(int(crossing.sum()))
    where = np.argwhere(crossing)
    v = np.stack([axes[k][where[:, k]] + _STEP / 2 for k in range(3)], axis=1)
    h = 1e-3
    for _ in range(4):
        slope = np.stack(
            [distance(v + h * np.eye(3)[k]) - distance(v - h * np.eye(3)[k]) for k in range(3)],
            axis=1,
        ) / (2 * h)
        v = v - 0.8 * distance(v)[:, None] * slope / np.maximum(
            (slope**2).sum(1, keepdims=True), 0.2
        )
    n = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    f = _faces(field, number)
    uv = np.stack([np.arctan2(v[:, 0], v[:, 2] + 0.3) * 0.35, v[:, 1]], axis=1)
    return Geo(v, n, uv, f, np.full(v.shape, 0.3))


def _faces(field: Floats, number: NDArray[np.int64]) -> NDArray[np.int64]:
    found = []
    inside = field < 0
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        low, high = np.moveaxis(inside, axis, 0)[:-1], np.moveaxis(inside, axis, 0)[1:]
        edges = np.argwhere(np.moveaxis(low != high, 0, axis))
        edges = edges[(edges[:, a] > 0) & (edges[:, b] > 0)]
        limit = np.array(number.shape)
        edges = edges[(edges < limit).all(axis=1)]
        da, db = np.eye(3, dtype=int)[a], np.eye(3, dtype=int)[b]
        ring = [number[tuple((edges - s).T)] for s in (0 * da, da, da + db, db)]
        quad = np.stack(ring, axis=1)
        outward = inside[tuple(edges.T)]
        quad[~outward] = quad[~outward][:, ::-1]
        quad = quad[(quad >= 0).all(axis=1)]
        found += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return np.concatenate(found)
