"""Triangle meshes with normals, texture coordinates and colours, and shapes made of them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Geo",
    "box",
    "grid",
    "joined",
    "lathe",
    "panel",
    "quads",
    "swept",
    "tube",
    "wall",
]

Floats = NDArray[np.float64]
_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class Geo:
    """A triangle mesh.

    Attributes:
        v, n: (N, 3). Positions in metres and unit normals.
        uv: (N, 2). Texture coordinates; in metres unless a texture is fitted.
        f: (M, 3) int. Triangles, counter-clockwise from outside.
        c: (N, 3). Vertex colours, linear.
    """

    v: Floats
    n: Floats
    uv: Floats
    f: NDArray[np.int64]
    c: Floats

    def moved(self, x: float, y: float, z: float) -> Geo:
        """Return the mesh shifted by metres."""
        return replace(self, v=self.v + np.array([x, y, z]))

    def turned(self, degrees: float, axis: str = "y") -> Geo:
        """Return the mesh rotated about an axis through the origin."""
        a = np.radians(degrees)
        i, j = {"y": (2, 0), "x": (1, 2), "z": (0, 1)}[axis]
        matrix = np.eye(3)
        matrix[i, i] = matrix[j, j] = np.cos(a)
        matrix[i, j], matrix[j, i] = -np.sin(a), np.sin(a)
        return replace(self, v=self.v @ matrix.T, n=self.n @ matrix.T)

    def scaled(self, x: float, y: float, z: float) -> Geo:
        """Return the mesh stretched along the axes."""
        size = np.array([x, y, z])
        n = self.n / size
        return replace(self, v=self.v * size, n=n / np.linalg.norm(n, axis=1, keepdims=True))

    def coloured(self, colour: ArrayLike) -> Geo:
        """Return the mesh in one colour."""
        return replace(self, c=np.broadcast_to(np.asarray(colour, float), self.v.shape).copy())

    def mapped(self, shift: ArrayLike, scale: float = 1.0) -> Geo:
        """Return the mesh with shifted and scaled texture coordinates."""
        return replace(self, uv=self.uv * scale + np.asarray(shift, float))


def joined(parts: list[Geo]) -> Geo:
    """Join meshes into one."""
    starts = np.cumsum([0] + [len(part.v) for part in parts[:-1]])
    return Geo(
        np.concatenate([p.v for p in parts]),
        np.concatenate([p.n for p in parts]),
        np.concatenate([p.uv for p in parts]),
        np.concatenate([p.f + s for p, s in zip(parts, starts, strict=True)]),
        np.concatenate([p.c for p in parts]),
    )


def _projected(v: Floats, n: Floats, grain: str | None) -> Floats:
    """Return texture coordinates on the wall that contains each point, u along the grain."""
    main = np.abs(n + np.array([1e-6, 2e-6, 0.0])).argmax(axis=1)
    u = np.choose(main, [v[:, 2], v[:, 0], v[:, 0]])
    w = np.choose(main, [v[:, 1], v[:, 2], v[:, 1]])
    if grain is not None:
        along = v[:, _AXES[grain]]
        rest = [v[:, i] for i in range(3) if i != _AXES[grain]]
        across = np.where(main == next(i for i in range(3) if i != _AXES[grain]), rest[1], rest[0])
        u, w = along, across
    return np.stack([u, w], axis=1)


def quads(corners: ArrayLike, grain: str | None = None) -> Geo:
    """Return flat quads, (M, 4, 3), counter-clockwise from outside, textured in metres."""
    p = np.asarray(corners, float).reshape(-1, 4, 3)
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    length = np.linalg.norm(normal, axis=1)
    p, normal = p[length > 1e-12], normal[length > 1e-12]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    v, n = p.reshape(-1, 3), np.repeat(normal, 4, axis=0)
    first = np.arange(len(p))[:, None] * 4
    f = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return Geo(v, n, _projected(v, n, grain), f, np.full(v.shape, 0.5))


def panel(corners: ArrayLike, low: ArrayLike = (0, 0), high: ArrayLike = (1, 1)) -> Geo:
    """Return one quad (bottom left, bottom right, top right, top left) with a picture."""
    made = quads(corners)
    (u0, v0), (u1, v1) = np.asarray(low, float), np.asarray(high, float)
    return replace(made, uv=np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]]))


def box(
    x: tuple[float, float],
    y: tuple[float, float],
    z: tuple[float, float],
    bevel: float = 0.006,
    grain: str | None = None,
) -> Geo:
    """Return a block with bevelled edges between two corners."""
    low, high = np.array([x[0], y[0], z[0]]), np.array([x[1], y[1], z[1]])
    centre, half = (low + high) / 2, (high - low) / 2
    b = min(bevel, 0.45 * float(half.min()))
    faces: list[Floats] = []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1, 1):
            ring = []
            for a, c in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = np.zeros(3)
                p[axis] = side * half[axis]
                p[i], p[j] = a * (half[i] - b), c * (half[j] - b)
                ring.append(p)
            faces.append(np.array(ring if side > 0 else ring[::-1]))
    faces += _bevels(half, b)
    corners = np.array(faces) + centre
    made = quads(corners, grain)
    return _outward(made, centre)


def _bevels(half: Floats, b: float) -> list[Floats]:
    """Return edge strips and corner triangles (as quads with a doubled corner) of a box."""
    faces = []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for a in (-1, 1):
            for c in (-1, 1):
                strip = []
                for end, first in ((-1, True), (-1, False), (1, False), (1, True)):
                    p = np.zeros(3)
                    p[axis] = end * (half[axis] - b)
                    p[i] = a * (half[i] - (0 if first else b))
                    p[j] = c * (half[j] - (b if first else 0))
                    strip.append(p)
                faces.append(np.array(strip))
    for sx in (-1, 1):
        for sy in (-1, 1):
            for sz in (-1, 1):
                s = np.array([sx, sy, sz], float)
                tips = [s * (half - b + b * np.eye(3)[k]) for k in range(3)]
                faces.append(np.array([tips[0], tips[1], tips[2], tips[2]]))
    return faces


def _outward(geo: Geo, centre: Floats) -> Geo:
    """Flip the faces of a convex mesh that point inward."""
    flip = np.einsum("ij,ij->i", geo.n, geo.v - centre) < 0
    f = geo.f.copy()
    inward = flip[f[:, 0]]
    f[inward] = f[inward][:, ::-1]
    return replace(geo, n=np.where(flip[:, None], -geo.n, geo.n), f=f)


def grid(points: Floats, uv: Floats | None = None, closed: bool = False) -> Geo:
    """Return a smooth surface through an (R, C, 3) grid; its normal is right by down."""
    p = np.asarray(points, float)
    rows, columns = p.shape[:2]
    down = np.gradient(p, axis=0)
    if closed:
        across = (np.roll(p, -1, 1) - np.roll(p, 1, 1)) / 2
        across[:, 0] = across[:, -1] = (p[:, 1] - p[:, -2]) / 2
    else:
        across = np.gradient(p, axis=1)
    n = np.cross(across, down)
    n /= np.maximum(np.linalg.norm(n, axis=2, keepdims=True), 1e-12)
    if uv is None:
        s = np.cumsum(np.linalg.norm(np.diff(p, axis=1, prepend=p[:, :1]), axis=2), axis=1)
        t = np.cumsum(np.linalg.norm(np.diff(p, axis=0, prepend=p[:1]), axis=2), axis=0)
        uv = np.stack([s, t], axis=2)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    f = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    v = p.reshape(-1, 3)
    return Geo(v, n.reshape(-1, 3), uv.reshape(-1, 2), f, np.full(v.shape, 0.5))


def lathe(profile: ArrayLike, segments: int = 40, crease: float = 35.0) -> Geo:
    """Return the surface of revolution of (radius, height), bottom to top, about the y axis."""
    points = np.asarray(profile, float)
    runs, start = [], 0
    steps = np.diff(points, axis=0)
    angle = np.degrees(np.arctan2(steps[:, 1], steps[:, 0]))
    for i in range(1, len(steps)):
        if abs((angle[i] - angle[i - 1] + 180) % 360 - 180) > crease:
            runs.append(points[start : i + 1])
            start = i
    runs.append(points[start:])
    around = np.linspace(0, 2 * np.pi, segments + 1)
    parts = []
    for run in runs:
        r, y = run[:, 0][:, None], run[:, 1][:, None]
        surface = np.stack(
            [r * np.cos(around), np.broadcast_to(y, (len(run), segments + 1)), r * np.sin(around)],
            axis=2,
        )
        length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(run, axis=0), axis=1))])
        uv = np.stack(
            np.broadcast_arrays(around * max(float(r.max()), 0.02), length[:, None]), axis=2
        )
        parts.append(grid(surface, uv, closed=True))
    made = joined(parts)
    return _flipped(made)


def _flipped(geo: Geo) -> Geo:
    return replace(geo, n=-geo.n, f=geo.f[:, ::-1])


def tube(path: ArrayLike, radius: ArrayLike, segments: int = 10) -> Geo:
    """Return a round bar along a path, (K, 3), with one radius or K radii."""
    around = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.stack([np.cos(around), np.sin(around)], axis=1)
    return swept(path, ring, radius)


def swept(path: ArrayLike, section: Floats, scale: ArrayLike = 1.0) -> Geo:
    """Return a smooth sweep of a closed section, (S, 2), along a path, (K, 3)."""
    p = np.asarray(path, float)
    size = np.broadcast_to(np.asarray(scale, float), (len(p),))
    tangent = np.gradient(p, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(tangent[0]).argmin()]
    side = np.cross(tangent[0], helper)
    sides = []
    for t in tangent:
        side = side - t * (side @ t)
        side = side / np.linalg.norm(side)
        sides.append(side)
    a = np.array(sides)
    b = np.cross(tangent, a)
    surface = p[:, None] + size[:, None, None] * (
        section[None, :, :1] * a[:, None] + section[None, :, 1:] * b[:, None]
    )
    return grid(surface, closed=True)


def wall(
    length: float,
    height: float,
    thick: float,
    openings: list[tuple[float, float, float, float, float]],
) -> tuple[Geo, Geo, Geo]:
    """Return a wall from (0, 0, 0) along x with openings, outside at z = `thick`, inside at z = 0.

    Args:
        length, height, thick: Metres.
        openings: list of (x0, x1, y0, y1, rise). `rise` is the height of the segmental arch above
            y1 (0 for a straight lintel).
    """
    cuts = {0.0, length}
    for x0, x1, _, _, rise in openings:
        cuts.update(np.linspace(x0, x1, 25 if rise else 2).tolist())
    xs = sorted(cuts)
    face, reveal = [], []
    for a, b in itertools.pairwise(xs):
        opening = next((o for o in openings if o[0] <= (a + b) / 2 <= o[1]), None)
        if opening is None:
            face.append([[a, 0, 0], [b, 0, 0], [b, height, 0], [a, height, 0]])
            continue
        y0 = opening[2]
        ta, tb = _arch(opening, a), _arch(opening, b)
        face.append([[a, 0, 0], [b, 0, 0], [b, y0, 0], [a, y0, 0]])
        face.append([[a, ta, 0], [b, tb, 0], [b, height, 0], [a, height, 0]])
        reveal.append([[a, ta, 0], [b, tb, 0], [b, tb, thick], [a, ta, thick]])
        reveal.append([[a, y0, thick], [b, y0, thick], [b, y0, 0], [a, y0, 0]])
    for x0, x1, y0, _, _ in openings:
        top = _arch((x0, x1, y0, *openings[[o[0] for o in openings].index(x0)][3:]), x0)
        reveal.append([[x0, y0, 0], [x0, top, 0], [x0, top, thick], [x0, y0, thick]])
        reveal.append([[x1, y0, thick], [x1, top, thick], [x1, top, 0], [x1, y0, 0]])
    outside = np.array(face, float)
    inside = outside[:, ::-1].copy()
    outside[..., 2] = thick
    return quads(inside), quads(outside), quads(np.array(reveal, float).reshape(-1, 4, 3)[:, ::-1])


def _arch(opening: tuple[float, float, float, float, float], x: float) -> float:
    x0, x1, _, y1, rise = opening
    if rise <= 0:
        return y1
    half = (x1 - x0) / 2
    radius = (half * half + rise * rise) / (2 * rise)
    away = min(half, abs(x - (x0 + x1) / 2))
    return y1 + float(np.sqrt(radius * radius - away * away)) - (radius - rise)
