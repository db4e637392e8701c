"""Guide paths toward the sources of a room's light."""

from __future__ import annotations

from typing import Any

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

__all__ = ["Portals", "vec"]

Floats = NDArray[np.float64]


def vec(x: Floats) -> Any:
    """Make a Mitsuba vector."""
    return mi.Vector3f(float(x[0]), float(x[1]), float(x[2]))


class Portals:
    """Sources of a room's light: openings, and patches lit by the sun.

    A plain class, since Dr.Jit would take a dataclass apart.

    Args:
        inverse: (4, 4). World to building.
        room: (2, 3). Corners of the room in building coordinates.
        targets: list of (3, 3). Corner and both edges of each rectangle, world.
        strength: Approximate brightness of each.
    """

    def __init__(self, inverse: Floats, room: Floats, targets: list[Floats], strength: list[float]):
        self.inverse = inverse
        self.room = room
        self.targets = targets
        self.strength = strength

    def inside(self, p: Any) -> Any:
        """Return which points are inside the room."""
        m = self.inverse
        found = mi.Bool(True)
        for k in range(3):
            x = float(m[k, 0]) * p.x + float(m[k, 1]) * p.y + float(m[k, 2]) * p.z + float(m[k, 3])
            found &= (x > float(self.room[0, k])) & (x < float(self.room[1, k]))
        return found

    def shares(self, p: Any, n: Any) -> list[Any]:
        """Return the probability of each rectangle at a point, from rough size and brightness."""
        found, total = [], mi.Float(0)
        for (corner, a, b), strength in zip(self.targets, self.strength, strict=True):
            normal = np.cross(a, b)
            area = float(np.linalg.norm(normal))
            way = mi.Vector3f(vec(corner + a / 2 + b / 2) - p)
            square = dr.squared_norm(way)
            way *= dr.rsqrt(square)
            seen = dr.maximum(dr.dot(n, way), 0) + 0.12
            share = strength * area * (dr.abs(dr.dot(vec(normal / area), way)) + 0.08) * seen
            found.append(share / (square + 0.3 * area))
            total += found[-1]
        return [share / total for share in found]

    def sample(self, p: Any, shares: list[Any], pick: Any, u: Any) -> Any:
        """Return the direction from `p` to a random point of one rectangle."""
        target, low = mi.Point3f(0), mi.Float(0)
        for (corner, a, b), share in zip(self.targets, shares, strict=True):
            chosen = (pick >= low) & (pick < low + share)
            point = vec(corner) + vec(a) * u.x + vec(b) * u.y
            target = dr.select(chosen, mi.Point3f(point), target)
            low += share
        return dr.normalize(mi.Vector3f(target - p))

    def pdf(self, p: Any, shares: list[Any], d: Any) -> Any:
        """Return the density of `sample` per solid angle."""
        total = mi.Float(0)
        for (corner, a, b), share in zip(self.targets, shares, strict=True):
            normal = np.cross(a, b)
            area = float(np.linalg.norm(normal))
            unit = vec(normal / area)
            cosine = dr.dot(d, unit)
            t = dr.dot(mi.Vector3f(vec(corner) - p), unit) / cosine
            away = mi.Vector3f(p + d * t - vec(corner))
            u = dr.dot(away, vec(a)) / float(a @ a)
            v = dr.dot(away, vec(b)) / float(b @ b)
            hit = (t > 1e-4) & (u > 0) & (u < 1) & (v > 0) & (v < 1)
            value = share * t * t / (area * dr.abs(cosine))
            total += dr.select(hit & (dr.abs(cosine) > 1e-6), value, 0)
        return total
