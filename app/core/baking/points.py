"""Where on the head light is measured: the vertices, and more points where light changes fast.

Between the points light is interpolated. On open skin the vertices are close enough; on the rim of
an eyelid, between the lips or in a nostril one corner of a face may lie in the light and the next
in the dark, so faces there get a finer grid of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.core.baking.bake_cache import Keep, no_keep
from app.core.baking.columns import TexelColumns
from app.core.baking.exposure import expose
from app.core.baking.lanes import Watch, unwatched

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.baking.scene import HeadMesh

FINE = 4
_STEEP = 0.2
_HIDDEN = 0.05
_COARSE_SKY = TexelColumns(16, 32)


@dataclass(frozen=True, slots=True)
class Points:
    """Points on skin and eyes, and the grid of points that each face has.

    Attributes
    ----------
    positions, normals : (V, 3) float32
        Scene units; unit vectors.
    level : (F,) uint32
        Grid steps along each side of a face; 1 = its corners only. Skin's faces, then eyes'.
    first : (F,) uint32
        Where a face's points begin in `table`.
    table : (K,) uint32
        Point numbers; of a face of level n, point (i, j) with i + j <= n is entry
        ``j (n + 1) - j (j - 1) / 2 + i``, at barycentric coordinates b1 = i / n, b2 = j / n.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    level: NDArray[np.uint32]
    first: NDArray[np.uint32]
    table: NDArray[np.uint32]

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.positions)


def vertex_points(head: HeadMesh) -> Points:
    """Only the vertices of skin and eyes."""
    parts = [head.skin] if head.eyes is None else [head.skin, head.eyes]
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate(
        [part.faces + np.uint32(start) for part, start in zip(parts, starts, strict=False)]
    )
    return Points(
        positions=np.concatenate([part.vertices for part in parts]),
        normals=np.concatenate([part.normals for part in parts]),
        level=np.ones(len(faces), np.uint32),
        first=np.arange(0, 3 * len(faces), 3, dtype=np.uint32),
        table=faces.astype(np.uint32).ravel(),
    )


def place_points(
    scene: Any,
    head: HeadMesh,
    seed: int,
    *,
    keep: Keep = no_keep,
    watch: Watch = unwatched,
) -> Points:
    """Vertices, and a grid of `FINE` steps on every face whose corners see unlike shares of sky."""
    coarse = vertex_points(head)
    moments = expose(scene, coarse, _COARSE_SKY, 2, seed, keep=keep, watch=watch)
    open_sky = moments[0].sum(axis=1) / np.pi
    corners = coarse.table.reshape(-1, 3)
    seen = open_sky[corners]
    steep = np.flatnonzero((np.ptp(seen, axis=1) > _STEEP) & (seen.max(axis=1) > _HIDDEN))
    return _refine(coarse, corners, steep.astype(np.int64)) if len(steep) else coarse


def _refine(coarse: Points, corners: NDArray[np.uint32], steep: NDArray[np.int64]) -> Points:
    grid = [(i, j) for j in range(FINE + 1) for i in range(FINE + 1 - j)]
    weights = np.array([[FINE - i - j, i, j] for i, j in grid], np.float32) / FINE
    positions = np.einsum("gk,fkx->fgx", weights, coarse.positions[corners[steep]])
    normals = np.einsum("gk,fkx->fgx", weights, coarse.normals[corners[steep]])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True) + np.float32(1e-20)
    level, first = coarse.level.copy(), coarse.first.copy()
    level[steep] = FINE
    begin = len(coarse.table) + np.arange(len(steep)) * len(grid)
    first[steep] = begin.astype(np.uint32)
    added = coarse.count + np.arange(len(steep) * len(grid))
    return Points(
        positions=np.concatenate([coarse.positions, positions.reshape(-1, 3)]),
        normals=np.concatenate([coarse.normals, normals.reshape(-1, 3)]),
        level=level,
        first=first,
        table=np.concatenate([coarse.table, added.astype(np.uint32)]),
    )
