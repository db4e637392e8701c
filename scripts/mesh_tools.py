"""Mesh operations of ``build_heads.py``: subdivide, cut, mirror, normals, PLY.

Positions are in units of 10 cm in the head frame; faces are counter-clockwise from outside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pathlib import Path

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MERGE = 1e-9  # units: positions closer than this to the mirror plane lie on it


def loop_subdivide(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """One step of Loop's scheme (Loop 1987) on a closed mesh.

    Args:
        vertices: (V, 3) float64. Positions, any unit.
        faces: (F, 3) int32. Triangles; every edge has two of them.

    Returns:
        (V + E, 3) float64 and (4 F, 3) int32: moved old vertices first, then one per edge.
    """
    count = len(vertices)
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    across = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
    edges, inverse, uses = np.unique(
        np.sort(half, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    inverse = inverse.ravel()
    if np.any(uses != 2):
        message = "loop_subdivide needs a closed mesh: an edge has not two faces"
        raise ValueError(message)
    opposite = np.zeros((len(edges), 3))
    np.add.at(opposite, inverse, vertices[across])
    odd = 0.375 * (vertices[edges[:, 0]] + vertices[edges[:, 1]]) + 0.125 * opposite

    ring = np.zeros_like(vertices)
    np.add.at(ring, edges[:, 0], vertices[edges[:, 1]])
    np.add.at(ring, edges[:, 1], vertices[edges[:, 0]])
    valence = np.bincount(edges.ravel(), minlength=count).astype(np.float64)
    beta = (40.0 - (2.0 * np.cos(2.0 * np.pi / valence) + 3.0) ** 2) / (64.0 * valence)
    even = vertices * (1.0 - valence * beta)[:, None] + ring * beta[:, None]

    n = len(faces)
    ab, bc, ca = (count + inverse[i * n : (i + 1) * n] for i in range(3))
    a, b, c = faces.T
    split = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    fine = np.concatenate([np.stack(t, axis=1) for t in split])
    return np.concatenate([even, odd]), fine.astype(np.int32)


def compact(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Drop vertices that no face uses, keeping their order."""
    used, inverse = np.unique(faces, return_inverse=True)
    return vertices[used], inverse.reshape(-1, 3).astype(np.int32)


def _fan_hub(rim: Floats) -> Floats:
    """Point (3,) from which a flat fan over the rim (n, 2, 3) does not fold over itself.

    It is the mean of the rim or, where shoulders make the rim concave, the nearest point before
    or behind it that works, in steps of 5 mm.
    """
    mean = rim.reshape(-1, 3).mean(axis=0)
    for step in range(41):
        for sign in (-1.0, 1.0):
            hub: Floats = mean + np.array([0.0, 0.0, sign * 0.05 * step])
            p, q = rim[:, 0] - hub, rim[:, 1] - hub
            if np.all(q[:, 2] * p[:, 0] - q[:, 0] * p[:, 2] < -1e-9):
                return hub
    message = "no point sees the whole rim of the cut"
    raise ValueError(message)


def cut_and_cap(vertices: Floats, faces: Ints, height: float) -> tuple[Floats, Ints]:
    """Keep what lies above ``height`` and close the neck with a flat fan.

    Args:
        vertices: (V, 3) float64. Closed mesh; no vertex lies exactly at ``height``.
        faces: (F, 3) int32. Counter-clockwise seen from outside.
        height: Units of 10 cm.

    Returns:
        Vertices (V', 3) and faces (F', 3) of the closed part; the fan's hub is the last vertex.
    """
    up = vertices[:, 1] > height
    inside = up[faces].sum(axis=1)
    points = list(vertices)
    made: dict[tuple[int, int], int] = {}

    def crossing(high: int, low: int) -> int:
        if (high, low) not in made:
            a, b = vertices[high], vertices[low]
            p = a + (b - a) * ((a[1] - height) / (a[1] - b[1]))
            p[1] = height
            made[high, low] = len(points)
            points.append(p)
        return made[high, low]

    result: list[tuple[int, int, int]] = [tuple(f) for f in faces[inside == 3].tolist()]
    rim: list[tuple[int, int]] = []
    for face in faces[(inside == 1) | (inside == 2)].tolist():
        tip_up = sum(bool(up[i]) for i in face) == 1  # the corner that stands alone is above
        k = next(i for i in range(3) if bool(up[face[i]]) == tip_up)
        a, b, c = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
        if tip_up:
            p, q = crossing(a, b), crossing(a, c)
            result.append((a, p, q))
            rim.append((p, q))
            continue
        p, q = crossing(b, a), crossing(c, a)  # a is below; the quad is p, b, c, q
        rim.append((q, p))
        # the shorter diagonal: a choice that a mirrored quad makes in the mirrored way
        if np.linalg.norm(points[p] - points[c]) <= np.linalg.norm(points[q] - points[b]):
            result += [(p, b, c), (p, c, q)]
        else:
            result += [(p, b, q), (b, c, q)]
    hub = len(points)
    points.append(_fan_hub(np.array([[points[i] for i in pair] for pair in rim])))
    result += [(q, p, hub) for p, q in rim]
    return compact(np.array(points), np.array(result, dtype=np.int32))


def mirror_exact(vertices: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Make positions exactly symmetric about x = 0.

    Returns:
        (V, 3) float64 positions and (V,) index of each vertex's mirror image (itself on the plane).
    """
    plane = np.abs(vertices[:, 0]) < _MERGE
    result = vertices.copy()
    result[plane, 0] = 0.0
    side = np.sign(result[:, 0])
    partner = np.arange(len(result))
    left, right = np.flatnonzero(side > 0), np.flatnonzero(side < 0)
    if len(left) != len(right):
        message = "the mesh has not as many vertices on the left as on the right"
        raise ValueError(message)
    key = np.column_stack([np.abs(result[:, 0]), result[:, 1], result[:, 2]]).round(6)
    left = left[np.lexsort(key[left].T)]
    right = right[np.lexsort(key[right].T)]
    flip = np.array([-1.0, 1.0, 1.0])
    if np.abs(result[left] * flip - result[right]).max() > 1e-6:
        message = "the mesh is not symmetric"
        raise ValueError(message)
    result[right] = result[left] * flip
    partner[left], partner[right] = right, left
    return result, partner


def vertex_normals(vertices: Floats, faces: Ints, partner: NDArray[np.intp]) -> Floats:
    """Angle-weighted unit normals (Thürmer & Wüthrich 1998), exactly mirror-symmetric.

    The fan that closes the neck does not tilt the normals of the rim: the neck is shaded as if
    it went on below the cut. Its hub points straight down.
    """
    hub = len(vertices) - 1
    corner = vertices[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal[np.any(faces == hub, axis=1)] = 0.0
    result = np.zeros_like(vertices)
    for k in range(3):
        a = corner[:, (k + 1) % 3] - corner[:, k]
        b = corner[:, (k + 2) % 3] - corner[:, k]
        cosine = (a * b).sum(axis=1) / (np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        np.add.at(result, faces[:, k], normal * angle[:, None])
    result[hub] = (0.0, -1.0, 0.0)
    result += result[partner] * np.array([-1.0, 1.0, 1.0])
    unit: Floats = result / np.linalg.norm(result, axis=1, keepdims=True)
    return unit


def write_ply(
    path: Path, vertices: Floats, normals: Floats, faces: Ints, colours: Floats | None = None
) -> None:
    """Write a binary little-endian PLY: float32 x y z nx ny nz [r g b], int32 triangles."""
    names = ["x", "y", "z", "nx", "ny", "nz"]
    columns = [vertices, normals]
    if colours is not None:
        names += ["r", "g", "b"]  # Mitsuba exposes these three as mesh attribute vertex_color
        columns.append(colours)
    table = np.concatenate(columns, axis=1).astype("<f4") + np.float32(0.0)  # no negative zeros
    rows = np.empty(len(faces), dtype=[("n", "u1"), ("v", "<i4", (3,))])
    rows["n"], rows["v"] = 3, faces
    header = ["ply", "format binary_little_endian 1.0"]
    header.append("comment Turnlight, from the MakeHuman base mesh, CC0 1.0")
    header += [f"element vertex {len(table)}", *(f"property float {n}" for n in names)]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    path.write_bytes(("\n".join(header) + "\n").encode("ascii") + table.tobytes() + rows.tobytes())
