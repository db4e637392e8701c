"""Distance to the skin, and points spread over it."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from scenes.head_detail.heads import MM, Floats, Head, Ints, load


class Surface:
    """The skin as a cloud of points 0.8 mm apart with normals, for fast distance queries."""

    def __init__(self, head: Head) -> None:
        points, normals, _ = refine(head, 2)
        self._points, self._normals = points, normals
        self._tree = cKDTree(points)

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the nearest skin points (N, 3) to any points, and the normals there."""
        _, index = self._tree.query(points, workers=2)
        normal = self._normals[index]
        away = points - self._points[index]
        height = np.einsum("ij,ij->i", away, normal)
        # Slide along the tangent plane, by no more than the spacing of the cloud.
        slide = away - height[:, None] * normal
        length = np.linalg.norm(slide, axis=1, keepdims=True)
        slide *= np.minimum(1.0, 0.012 / np.maximum(length, 1e-9))
        return self._points[index] + slide, normal

    def height(self, points: Floats) -> Floats:
        """Return the signed distance to the skin, (N,), positive outside; exact near the skin."""
        foot, normal = self.nearest(points)
        height: Floats = np.einsum("ij,ij->i", points - foot, normal)
        return height

    def push_out(self, points: Floats, clearance: Floats) -> Floats:
        """Move points (N, 3) closer to the skin than `clearance` (N,) out along the normal."""
        pushed = points.copy()
        moving = np.arange(len(points))
        for _ in range(4):  # where the skin bends, the first push may end at another fold of it
            foot, normal = self.nearest(pushed[moving])
            away = pushed[moving] - foot
            lack = clearance[moving] - np.einsum("ij,ij->i", away, normal)
            # A point far from the skin may be behind the plane of its nearest point: leave those.
            short = (lack > 0.05 * MM) & (np.linalg.norm(away, axis=1) < 0.6)
            moving = moving[short]
            pushed[moving] += lack[short, None] * normal[short]
        return pushed


def refine(head: Head, levels: int) -> tuple[Floats, Floats, Ints]:
    """Return the skin with every edge halved `levels` times: vertices, normals, faces."""
    points, normals, faces = head.vertices, head.normals, head.faces
    for _ in range(levels):
        points, normals, faces = _split(points, normals, faces)
    return points, normals, faces


def _split(points: Floats, normals: Floats, faces: Ints) -> tuple[Floats, Floats, Ints]:
    """Halve every edge; new points and normals are midway."""
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges, where = np.unique(np.sort(half, axis=1), axis=0, return_inverse=True)
    ab, bc, ca = (len(points) + where.reshape(3, -1)).astype(np.int64)
    a, b, c = faces.T
    fine = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    middle = normals[edges].mean(axis=1)
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    return (
        np.concatenate([points, points[edges].mean(axis=1)]),
        np.concatenate([normals, middle]),
        np.concatenate([np.stack(face, axis=1) for face in fine]),
    )


@cache
def surface(name: str) -> Surface:
    """Return the surface of a shipped head."""
    return Surface(load(name))


def scatter(head: Head, weight: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Return points (count, 3) on the left half of the skin, with density `weight` (V,).

    Args:
        weight: Relative density at each vertex; 0 where no point is allowed.
    """
    corners = head.vertices[head.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    left = corners[:, :, 0].mean(axis=1) > 0.0
    share = area * weight[head.faces].mean(axis=1) * left
    # One draw for each equal part of the total: more even than independent draws.
    ladder = (np.arange(count) + rng.random(count)) / count
    pick = np.searchsorted(np.cumsum(share) / share.sum(), ladder).clip(0, len(share) - 1)
    u, v = np.sqrt(rng.random(count)), rng.random(count)
    mix = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    found: Floats = np.einsum("ij,ijk->ik", mix, corners[pick])
    found[:, 0] = np.abs(found[:, 0])
    return found[rng.permutation(count)]
