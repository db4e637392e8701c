"""Estimate how far away the surfaces around a camera are, from its panorama alone.

The floor is a plane 1.5 m below the camera, so a direction below the horizon determines a distance.
In every column, the wall stands where the floor ends: a path of strong edges around the panorama,
found by dynamic programming as in seam carving (Avidan and Shamir, 2007). A second path above the
horizon is the upper end of the walls, from which the height of the ceiling follows. If the region
above is bluish or much brighter than the floor, it is sky, at an infinite distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Float64, Int64
from app.core.base.sphere import bounded, directions, wrapped
from app.core.environment.environment import reduce_radiance
from app.core.solver.search import luminance_of

SHAPE: Final = (128, 256)
"""Rows and columns of the estimate."""

CAMERA_HEIGHT_M: Final = 1.5

_COLUMNS: Final = 2048
_FAR_M: Final = 1e4
_FLOOR_DEG: Final = (-62.0, -0.5)  # elevations at which the floor may end
_LOWEST_TOP_DEG: Final = 0.5  # elevations at which a wall may end below the sky,
_LOWEST_CEILING_DEG: Final = 6.0  # and below a ceiling
_HIGHEST_TOP_DEG: Final = 70.0
_LOW_DEG: Final = 20.0  # the median below this elevation sets the level of luminance
_CEILING_M: Final = (2.4, 12.0)
_MOST_HIDDEN: Final = 2.0  # ratio of a wall's distance to that of an edge in front of it
_WHITE: Final = 2.0  # times the median; much brighter light counts as little more than this
_BLACK: Final = 0.02  # times the median
_LAMP: Final = 8.0  # times the median
_FEW: Final = 0.1  # fraction of the texels beside an edge that may belong to a lamp
_BLUR: Final = (9, 2.0)  # columns, and sigma
_BAND: Final = 5  # rows averaged on each side of an edge; 7 degrees
_WALL_BAND: Final = 5
_STRONGEST: Final = 0.7  # an edge stronger than this is not more likely to be the wall's
_CHANGE: Final = 0.2  # cost of a path that moves by a row from one column to the next
_MOST_CHANGE: Final = 20  # rows; a path may jump at a corner at this cost
_USUAL_M: Final = 3.0  # distance of a wall, for which there is a weak preference
_PREFERENCE: Final = (0.03, 0.7, 30.0)  # its weight, its spread in ln(metres), and its limit
_SKY_DEG: Final = 35.0
_GROUND_DEG: Final = (-75.0, -35.0)
# Logistic regression on half of the places of `benchmarks/light/near/displaced_probe.py`.
# Weights of ln(above / ground), ln(blue / red) above and ln(brightest / above), and a constant.
_SKY: Final = (1.04, 3.90, -0.89, -0.94)
_BRIGHTEST: Final = (0.95, -10.0)  # quantile of the luminance above this elevation


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceMap:
    """The surfaces around a camera.

    Attributes:
        distance: (128, 256) float64. Distance in metres; 10 km for the sky.
        normal: (128, 256, 3) float64. Unit normals in the panorama's coordinate system, of either
            sign. The sky faces the camera.
    """

    distance: Float64
    normal: Float64


def reduced(radiance: Float32) -> Float32:
    """Scale a panorama, (H, 2 H, 3), to the size of the estimate, (128, 256, 3)."""
    return reduce_radiance(bounded(radiance, _COLUMNS), SHAPE)


def estimate_surroundings(light: Float32) -> SurfaceMap:
    """Estimate the distances of all surfaces.

    Args:
        light: (128, 256, 3) float32. Panorama of a level camera, linear Rec. 709 radiance.
    """
    under_sky = _is_under_sky(light)
    features = _features(light)
    lamps = _lamps(light) if not under_sky else np.zeros(SHAPE)
    foot = _floor_end(features, lamps)
    top = _wall_top(features, lamps, _LOWEST_TOP_DEG if under_sky else _LOWEST_CEILING_DEG)
    wall = _floor_distance(foot)
    if under_sky:
        return _surfaces(wall, _FAR_M, top)
    # Furniture and lines on the floor hide the foot of a wall that reaches the ceiling behind them.
    slope = np.tan(np.radians(top))
    wall = np.maximum(wall, (_CEILING_M[0] - CAMERA_HEIGHT_M) / slope)
    above = float(np.median(wall * slope))
    wall = np.maximum(wall, np.minimum(above / slope, _MOST_HIDDEN * wall))
    return _surfaces(wall, min(CAMERA_HEIGHT_M + above, _CEILING_M[1]), None)


def _elevations() -> Float64:
    """Return the elevation of the centre of each row, (128,), in degrees."""
    return np.asarray(90.0 - (np.arange(SHAPE[0]) + 0.5) * 180.0 / SHAPE[0])


def _edge_elevations() -> Float64:
    """Return the elevation of the lower edge of each row, (128,), in degrees."""
    return np.asarray(90.0 - (np.arange(SHAPE[0]) + 1.0) * 180.0 / SHAPE[0])


def _floor_distance(elevation: Float64) -> Float64:
    """Return the horizontal distance in metres of the floor at elevations below 0 degrees."""
    return np.asarray(CAMERA_HEIGHT_M / np.tan(np.radians(-elevation)))


def _features(light: Float32) -> Float64:
    """Return log luminance and log chroma, (128, 256, 3), with highlights compressed.

    Highlights are compressed, or the edges of windows and lamps would exceed those of the walls.
    """
    luminance = luminance_of(light)
    level = float(np.median(luminance[_elevations() < _LOW_DEG])) or float(luminance.mean())
    scale = 1.0 + luminance / (_WHITE * level)
    soft = wrapped((light / scale[..., None]).astype(np.float32), 2 * _BLUR[0])
    blurred = cv2.GaussianBlur(soft, (_BLUR[0], 1), _BLUR[1])[:, 2 * _BLUR[0] : -2 * _BLUR[0]]
    black = _BLACK * level
    red, green, blue = np.moveaxis(blurred.astype(np.float64) + black, -1, 0)
    grey = luminance_of(np.asarray(blurred, np.float32)) + black
    return np.stack([np.log(grey), np.log(red / green), np.log(blue / green)], axis=-1)


def _lamps(light: Float32) -> Float64:
    """Return 1 at lamps and windows and 0 elsewhere, (128, 256).

    The lower edge of a window is stronger than the edge of the floor below it.
    """
    luminance = luminance_of(light)
    level = float(np.median(luminance[_elevations() < _LOW_DEG])) or float(luminance.mean())
    return np.asarray(luminance > _LAMP * level, np.float64)


def _means(values: Float64, above: int, below: int) -> Float64:
    """Average over some rows above and below the lower edge of each row, (128, 256, ...).

    Args:
        above, below: Number of rows on each side. Fewer are used at the poles.
    """
    sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    edge = np.arange(1, SHAPE[0] + 1)
    first, last = np.maximum(edge - above, 0), np.minimum(edge + below, SHAPE[0])
    count = np.maximum(last - first, 1).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((sums[last] - sums[first]) / count)


def _edges(features: Float64, above: int, below: int) -> Float64:
    """Return the contrast across the lower edge of each row, (128, 256).

    Args:
        above, below: Number of rows averaged on each side.
    """
    difference = _means(features, above, 0) - _means(features, 0, below)
    return np.asarray(np.linalg.norm(difference, axis=-1))


def _floor_end(features: Float64, lamps: Float64) -> Float64:
    """Return the elevation at which the floor ends in each column, (256,), in degrees."""
    edge = _edge_elevations()
    rows = np.flatnonzero((edge > _FLOOR_DEG[0]) & (edge < _FLOOR_DEG[1]))
    weight, spread, farthest = _PREFERENCE
    away = np.log(np.minimum(_floor_distance(edge[rows]), farthest) / _USUAL_M) / spread
    merit = np.minimum(_edges(features, _WALL_BAND, _BAND)[rows], _STRONGEST)
    merit *= _means(lamps, _WALL_BAND, 0)[rows] < _FEW
    return edge[rows[_best_path(merit - 0.5 * weight * (away**2)[:, None])]]


def _wall_top(features: Float64, lamps: Float64, lowest_deg: float) -> Float64:
    """Return the elevation at which the wall ends in each column, (256,), in degrees."""
    edge = _edge_elevations()
    rows = np.flatnonzero((edge > lowest_deg) & (edge < _HIGHEST_TOP_DEG))
    merit = np.minimum(_edges(features, _BAND, _WALL_BAND)[rows], _STRONGEST)
    merit *= _means(lamps, 0, _WALL_BAND)[rows] < _FEW
    return edge[rows[_best_path(merit)]]


def _best_path(merit: Float64) -> Int64:
    """Return the row in each column, (W,), of the best closed path around a panorama.

    Args:
        merit: (N, W) float64. Merit of each row in each column. Moving by a row costs `_CHANGE`.
    """
    count, width = merit.shape
    rows = np.arange(count)
    cost = _CHANGE * np.minimum(np.abs(rows[:, None] - rows), _MOST_CHANGE)
    # Twice around: the middle of the path is then independent of its open ends.
    best, steps = merit[:, 0], []
    for column in range(1, 2 * width):
        candidates = best - cost
        step = candidates.argmax(axis=1)
        best = candidates[rows, step] + merit[:, column % width]
        steps.append(step)
    path = [int(best.argmax())]
    for step in reversed(steps):
        path.append(int(step[path[-1]]))
    twice = np.array(path[::-1], np.int64)
    half = width // 2
    return np.concatenate([twice[width : width + half], twice[half:width]])


def _is_under_sky(light: Float32) -> bool:
    """Decide whether the region above is sky: brighter than the ground, bluish and even."""
    elevation, luminance = _elevations(), luminance_of(light) + 1e-6 * float(light.mean())
    is_above = elevation > _SKY_DEG
    above = float(np.median(luminance[is_above]))
    is_ground = (elevation > _GROUND_DEG[0]) & (elevation < _GROUND_DEG[1])
    brightest = float(np.quantile(luminance[elevation > _BRIGHTEST[1]], _BRIGHTEST[0]))
    red, blue = (float(np.median(light[is_above][..., each])) + 1e-3 * above for each in (0, 2))
    ratios = above / np.median(luminance[is_ground]), blue / red, brightest / above
    return bool(np.log(ratios) @ _SKY[:3] + _SKY[3] > 0.0)


def _surfaces(wall: Float64, height: float, top: Float64 | None) -> SurfaceMap:
    """Return floor, walls and ceiling.

    Args:
        wall: (256,) float64. Horizontal distance of the wall in each column, in metres.
        height: Height of the ceiling above the floor, in metres.
        top: (256,) float64. Elevation in degrees above which there is only sky, or None indoors.
    """
    ways = directions(SHAPE).astype(np.float64)
    level, up = np.hypot(ways[..., 0], ways[..., 2]), ways[..., 1]
    sides = wall / level
    planes = np.where(up < 0.0, CAMERA_HEIGHT_M, height - CAMERA_HEIGHT_M) / np.abs(up)
    is_wall: Bools = sides <= planes
    distance = np.minimum(np.minimum(sides, planes), _FAR_M)
    normal = np.zeros_like(ways)
    normal[..., 1] = ~is_wall
    normal[is_wall] = (ways * [1.0, 0.0, 1.0] / level[..., None])[is_wall]
    if top is not None:
        is_sky = _elevations()[:, None] > top
        distance[is_sky] = _FAR_M
        normal[is_sky] = ways[is_sky]
    return SurfaceMap(distance, normal)
