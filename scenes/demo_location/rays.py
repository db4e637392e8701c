"""Camera rays: panoramas with fewer samples toward the poles, and the photographer's views."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np

from scenes.demo_location.frame import VIEW_FOV, Stand, view_pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["panorama_rays", "rows_of_pass", "view_rays"]


def rows_of_pass(height: int, number: int) -> NDArray[np.int64]:
    """Return the rows that a pass samples: all near the horizon, every third at the poles."""
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    share = np.maximum(np.cos(elevation), 0.34)
    # Every row has a different phase, so that a pass is not striped.
    phase = (np.arange(height) * 0.618034) % 1.0
    return np.flatnonzero(np.floor((number + 1) * share + phase) > np.floor(number * share + phase))


def panorama_rays(
    position: NDArray[np.float64], shape: tuple[int, int], rows: NDArray[np.int64], sampler: Any
) -> Any:
    """Return one ray through a random point of every texel of `rows`."""
    height, width = shape
    index = dr.arange(mi.UInt32, len(rows) * width)
    row = dr.gather(mi.UInt32, mi.UInt32(rows.astype(np.uint32)), index // width)
    jitter = sampler.next_2d()
    u = (mi.Float(index % width) + jitter.x) / width
    v = (mi.Float(row) + jitter.y) / height
    a, e = 2 * np.pi * (u - 0.5), np.pi * (0.5 - v)
    d = mi.Vector3f(-dr.sin(a) * dr.cos(e), dr.sin(e), dr.cos(a) * dr.cos(e))
    return mi.Ray3f(mi.Point3f(*[float(x) for x in position]), d)


def view_rays(
    stand: Stand, turn: float, distance: float, size: tuple[int, int], jitter: Any
) -> tuple[Any, Any]:
    """Return one ray for every pixel of a view, and depth along the axis per metre of the ray."""
    position, rotation = view_pose(stand, turn, distance)
    width, height = size
    focal = width / 2 / np.tan(np.radians(VIEW_FOV / 2))
    index = dr.arange(mi.UInt32, width * height)
    x = (mi.Float(index % width) + jitter.x - width / 2) / focal
    y = (mi.Float(index // width) + jitter.y - height / 2) / focal
    right, down, ahead = (mi.Vector3f(*[float(k) for k in row]) for row in rotation)
    d = dr.normalize(right * x + down * y + ahead)
    return mi.Ray3f(mi.Point3f(*[float(k) for k in position]), d), dr.dot(d, ahead)
