"""A pinhole camera in the modelled place: from its pixels to the world and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from benchmarks.heading.scripted_turn.scene_files import SKY_M

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PinholeCamera:
    """A pinhole camera in the world.

    Attributes:
        position: (3,) float64. In the world, metres.
        rotation: (3, 3) float64. From the world to the camera's axes; see
            `benchmarks.heading.scripted_turn.scene_files.level_pose`.
        focal_px: Focal length, pixels.
        size: Columns and rows.
    """

    position: Float64
    rotation: Float64
    focal_px: float
    size: tuple[int, int]

    def smaller(self, by: float) -> PinholeCamera:
        """Return the camera with fewer pixels; the edges stay within half of one."""
        columns, rows = (max(round(n / by), 8) for n in self.size)
        focal = self.focal_px * columns / self.size[0]
        return replace(self, focal_px=focal, size=(columns, rows))

    def turned_round(self) -> PinholeCamera:
        """Return a camera at the same position and tilt that looks the other way."""
        return replace(self, rotation=self.rotation @ np.diag([-1.0, 1.0, -1.0]))

    def rays(self) -> Float32:
        """Return rays through pixel centres, in camera axes, of depth 1, (3, H W) float32."""
        columns, rows = self.size
        x = (np.arange(columns) + 0.5 - columns / 2.0) / self.focal_px
        y = (np.arange(rows) + 0.5 - rows / 2.0)[:, None] / self.focal_px
        grid = [np.asarray(g, np.float32).ravel() for g in np.broadcast_arrays(x, y)]
        return np.stack([*grid, np.ones(columns * rows, np.float32)])

    def seen(self, points: Float32) -> tuple[Float32, Float32, Float32]:
        """Project points of the world, (3, N): column, row, inverse depth."""
        turned = self.rotation.astype(np.float32)
        shift = (self.rotation @ self.position).astype(np.float32)[:, None]
        x, y, z = turned @ points - shift
        inverse = np.where(z > 0.05, 1.0 / np.maximum(z, np.float32(0.05)), np.float32(0.0))
        scale = inverse * np.float32(self.focal_px)
        half = (np.float32(self.size[0] / 2.0), np.float32(self.size[1] / 2.0))
        return x * scale + half[0], y * scale + half[1], inverse

    def world(self, rays: Float32, inverse: Float32) -> Float32:
        """Return positions in the world, (3, N), of `rays` with known inverse depth, 1/m."""
        back = self.rotation.T.astype(np.float32)
        points = back @ (rays / np.maximum(inverse, np.float32(1.0 / SKY_M)))
        return np.asarray(points + self.position.astype(np.float32)[:, None], np.float32)
