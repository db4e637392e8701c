"""The portrait's own camera, and the part of a head behind each of its pixels.

Only the left half is rendered: heads are symmetric, and the right half is its mirror image, bit for
bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from app.core.baking.exposure import Points
from app.core.baking.scene import Camera, HeadMesh, frame_head
from app.core.portrait.portrait_head import ROOM

Float32 = NDArray[np.float32]
Reals: TypeAlias = NDArray[np.floating[Any]]
Ints = NDArray[np.int64]
SHAPE = (640, 640)
_SIDE = 4
_SOME = (1, 7, 8, 14)
"""Of the 16 positions in a pixel at an edge, those that are shaded."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Directions of the portrait's pixels: slopes against the camera's axis, y up.

    Attributes:
        top: Slope of the upper edge.
        step: Slope of a pixel.
        size: Pixels along one side of the whole picture.
        yaw: Turn of the head toward its own left, radians.
    """

    origin: tuple[float, float, float]
    top: float
    step: float
    half: float
    shift: float
    size: int = SHAPE[0]
    yaw: float = 0.0

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns that are rendered: only the left half from straight in front."""
        return self.size, self.size if self.yaw else self.size // 2

    @property
    def axes(self) -> Float32:
        """Right in the picture, up, and away from the camera, (3, 3) float32."""
        right, away = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[right, 0, away], [0, 1, 0], [away, 0, -right]], np.float32)

    def slopes(self, row: Reals, column: Reals) -> tuple[Reals, Reals]:
        """Return the sideways and upward slopes of positions in the picture."""
        return (column - self.size / 2) * self.step, self.top - row * self.step

    def rays(self, row: Reals, column: Reals) -> Any:
        """Return camera rays through positions in the picture."""
        across, up = self.slopes(row, column)
        return self.look(mi.Float(across.astype(np.float32)), mi.Float(up.astype(np.float32)))

    def look(self, across: Any, up: Any) -> Any:
        """Return camera rays for some slopes."""
        right, above, away = (mi.Vector3f(*(float(part) for part in axis)) for axis in self.axes)
        way = right * across + above * up + away
        return mi.Ray3f(mi.Point3f(*self.origin), dr.normalize(way))

    def place(self, positions: Float32) -> tuple[Reals, Reals]:
        """Return the row and column of points in the head's frame."""
        right, above, away = ((positions - np.array(self.origin)) @ self.axes.T).T
        return (self.top - above / away) / self.step, right / away / self.step + self.size / 2

    def film(self, row: Reals, column: Reals) -> tuple[Reals, Reals]:
        """Return the same positions on the film of the transport's square camera, 0 to 1."""
        across, up = self.slopes(row, column)
        return 0.5 + across / (2 * self.half), 0.5 - up / (2 * self.half) - self.shift


def portrait_frame(
    head: HeadMesh, yaw_deg: float = 0.0, size: int = SHAPE[0]
) -> tuple[Frame, Camera]:
    """Frame a head: down to the end of the transport's picture, up to above the hair."""
    camera = frame_head(head, 100, yaw_deg)
    half = math.tan(math.radians(camera.fov_deg / 2))
    low = (0.5 - camera.shift - 1.0) * 2 * half
    high = low + 2 * half * ROOM
    step, yaw = (high - low) / size, math.radians(yaw_deg)
    return Frame(camera.origin, high, step, half, camera.shift, size, yaw), camera


@dataclass(frozen=True, slots=True)
class Samples:
    """Shaded points of the picture, or of its left half.

    Attributes:
        inside: (rows, half) bool. Pixels with one sample; then come those of `edge`, four each.
        coverage: (rows, half) float32. Share of each pixel that head and eyes cover.
        points: (n, 3) int64. Points of the skin around each sample, with `weights`, (n, 3).
        skin: (n,) bool. Skin, not eye.
        valid: (n,) bool. Head, not background.
    """

    inside: NDArray[np.bool_]
    edge: NDArray[np.bool_]
    coverage: Float32
    points: Ints
    weights: Float32
    normals: Float32
    positions: Float32
    skin: NDArray[np.bool_]
    valid: NDArray[np.bool_]


def seen_at(scene: Any, frame: Frame, row: Any, column: Any) -> dict[str, NDArray[Any]]:
    """Return the surface behind the middle of a pixel, or any other position in the picture."""
    ray = frame.rays(row, column)
    found = scene.ray_intersect_preliminary(ray)
    si = found.compute_surface_interaction(ray, mi.RayFlags.All)
    skin = next(shape for shape in scene.shapes() if shape.id() == "skin")
    return {
        "valid": np.array(si.is_valid()),
        "skin": np.array(si.shape == skin),
        "face": np.array(found.prim_index).astype(np.int64),
        "uv": np.array(found.prim_uv).T,
        "normal": np.array(si.sh_frame.n).T,
        "place": np.array(si.p).T,
    }


def look(scene: Any, head: HeadMesh, frame: Frame, points: Points) -> Samples:
    """Find the surface behind the pixels; see `Frame.shape`."""
    rows, half = frame.shape
    sub = (np.arange(_SIDE) + 0.5) / _SIDE
    r, c, down, across = np.meshgrid(np.arange(rows), np.arange(half), sub, sub, indexing="ij")
    fine = seen_at(scene, frame, (r + down).ravel(), (c + across).ravel())
    fine = {k: v.reshape(rows, half, _SIDE**2, *v.shape[1:]) for k, v in fine.items()}
    count = fine["valid"].sum(axis=2)
    coverage = (count / _SIDE**2).astype(np.float32)
    depth = np.where(fine["valid"], fine["place"] @ frame.axes[2], np.nan)
    with np.errstate(all="ignore"):
        spread = np.nanmax(depth, 2) - np.nanmin(depth, 2)
    bent = np.linalg.norm((fine["normal"] * fine["valid"][..., None]).sum(2), axis=-1)
    mixed = (fine["valid"] & fine["skin"]).sum(2) % _SIDE**2 != 0
    rough = mixed | (spread > 0.15) | (bent < 0.9 * count)
    edge = (count > 0) & ((count < _SIDE**2) | rough)
    inside = (count == _SIDE**2) & ~edge
    middle = np.nonzero(inside)
    centre = seen_at(scene, frame, *(np.asarray(m, np.float64) + 0.5 for m in middle))
    some = {k: v[edge][:, _SOME].reshape(-1, *v.shape[3:]) for k, v in fine.items()}
    both = {k: np.concatenate([centre[k], some[k]]) for k in centre}
    corners, weights = around(points, len(head.skin.faces), both)
    return Samples(
        inside,
        edge,
        coverage,
        corners,
        weights,
        both["normal"].astype(np.float32),
        both["place"].astype(np.float32),
        both["skin"],
        both["valid"],
    )


def around(points: Points, faces: int, seen: dict[str, NDArray[Any]]) -> tuple[Ints, Float32]:
    """Return the three points around positions on the mesh, and their weights, as in `Shares`."""
    valid = seen["valid"]
    face = np.where(valid, seen["face"] + np.where(seen["skin"], 0, faces), 0)
    level, first = points.level[face].astype(np.int64), points.first[face].astype(np.int64)
    uv = np.where(valid[:, None], seen["uv"], 0.3)
    u, v = uv[:, 0] * level, uv[:, 1] * level
    i = np.clip(u.astype(np.int64), 0, level - 1)
    j = np.clip(v.astype(np.int64), 0, level - 1 - i)
    s, t = u - i, v - j
    upper = s + t > 1
    weights = np.stack(
        [
            np.where(upper, s + t - 1, 1 - s - t),
            np.where(upper, 1 - t, s),
            np.where(upper, 1 - s, t),
        ],
        axis=1,
    )
    entries = [
        first + b * (level + 1) + a - np.where(b > 0, b * (b - 1) // 2, 0)
        for a, b in ((i + upper, j + upper), (i + 1, j), (i, j + 1))
    ]
    corners = points.table[np.stack(entries, axis=1)].astype(np.int64)
    return corners, np.clip(weights, 0, 1).astype(np.float32)
