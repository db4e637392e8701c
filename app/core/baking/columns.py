"""Where light comes from while baking: the texels of an environment, or lamps near the head.

Both are lists of columns: a transport has one column for each texel, and the pictures of the
studio styles are columns of their lamps. Everything else in baking treats them alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from app.core.baking.lanes import Table
from app.core.baking.scene import MILLIMETRES_PER_UNIT
from app.core.base.arrays import Float32
from app.core.solver.styles import StyleLamp


class Columns(Protocol):
    """A list of light sources, each to be integrated over its own small area."""

    @property
    def count(self) -> int:
        """Number of columns."""
        ...

    def directions(self) -> Float32:
        """Directions of the columns' middles from between the eyes, (count, 3) float32, unit."""
        ...

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """Place (s, t) of a column, as seen from a position.

        Args:
            s, t: In [0, 1); uniform values cover the column's area evenly.

        Returns:
            weight: Radiance times solid angle (steradian) that the whole column has at the
                position, as this place of it has it.
        """
        ...


@dataclass(frozen=True, slots=True)
class TexelColumns:
    """The texels of an H x W environment at turn 0, each of radiance 1."""

    height: int
    width: int

    @property
    def count(self) -> int:
        """Number of texels."""
        return self.height * self.width

    def directions(self) -> Float32:
        """See `Columns.directions`."""
        elevation = np.pi / 2 - (np.arange(self.height) + 0.5) / self.height * np.pi
        azimuth = ((np.arange(self.width) + 0.5) / self.width - 0.5) * 2 * np.pi
        level, up = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
        shape = (self.height, self.width)
        parts = [-np.sin(azimuth) * level, np.broadcast_to(up, shape), np.cos(azimuth) * level]
        return np.stack(parts, axis=-1).reshape(-1, 3).astype(np.float32)

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """See `Columns.sample`."""
        import drjit as dr
        import mitsuba as mi

        row, place = column // self.width, column % self.width
        upper = dr.cos(mi.Float(row) * (dr.pi / self.height))
        lower = dr.cos(mi.Float(row + 1) * (dr.pi / self.height))
        up = upper + (lower - upper) * t
        azimuth = ((mi.Float(place) + s) / self.width - 0.5) * dr.two_pi
        level = dr.sqrt(dr.maximum(0, 1 - up * up))
        direction = mi.Vector3f(-dr.sin(azimuth) * level, up, dr.cos(azimuth) * level)
        return direction, dr.inf, (upper - lower) * (dr.two_pi / self.width)


class LampColumns:
    """Round flat lamps that face the point between the eyes, at finite distance.

    A lamp of power 1 gives irradiance 1 at that point on a surface that faces it.
    """

    def __init__(self, lamps: Sequence[StyleLamp], eye_point: tuple[float, float, float]) -> None:
        toward = np.array([_direction(lamp) for lamp in lamps])
        distance = np.array([lamp.distance_m * 1000 / MILLIMETRES_PER_UNIT for lamp in lamps])
        radius = distance * np.array(
            [math.tan(math.radians(lamp.diameter_deg / 2)) for lamp in lamps]
        )
        side = np.cross(toward, [0.0, 1.0, 1e-3])
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        self._directions = toward.astype(np.float32)
        self._axes = tuple(Table(axis) for axis in (toward, side, np.cross(side, toward)))
        self._centres = Table(np.array(eye_point) + toward * distance[:, None])
        self._radius = Table(radius)
        # Radiance times area, so that the weight below is irradiance-like: E = L A / d^2 = power.
        self._intensity = Table(np.array([lamp.power for lamp in lamps]) * distance**2)

    @property
    def count(self) -> int:
        """Number of lamps."""
        return len(self._directions)

    def directions(self) -> Float32:
        """See `Columns.directions`."""
        return self._directions

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """See `Columns.sample`."""
        import drjit as dr
        import mitsuba as mi

        toward, side, over = (axis.take(column) for axis in self._axes)
        disc = mi.warp.square_to_uniform_disk_concentric(mi.Point2f(s, t))
        radius = self._radius.take(column)
        place = self._centres.take(column) + (side * disc.x + over * disc.y) * radius
        offset = place - position
        squared = dr.squared_norm(offset)
        distance = dr.sqrt(squared)
        direction = offset / distance
        facing = dr.maximum(0, dr.dot(direction, toward))
        return direction, distance, self._intensity.take(column) * facing / squared


def _direction(lamp: StyleLamp) -> tuple[float, float, float]:
    azimuth, elevation = math.radians(lamp.azimuth_deg), math.radians(lamp.elevation_deg)
    level = math.cos(elevation)
    return math.sin(azimuth) * level, math.sin(elevation), math.cos(azimuth) * level
