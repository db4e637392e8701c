"""Compute how much light reaches each point on the skin from each column, using shadow rays.

For every vertex and every column (a texel of the environment, or a lamp), the visible part of the
column is integrated on a jittered grid, weighted by the first powers of the cosine of incidence.
Any smooth dependence of the skin on that cosine (such as the profile in `core.baking.random_walk`)
is a combination of these moments.

The camera rays that determine a head's shape are also traced here. They find the position on the
skin behind each pixel, the pixels that the head covers, and the head's outlines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.baking.bake_cache import Keep, no_keep
from app.core.baking.kernel_lanes import (
    Table,
    Tally,
    Watch,
    at_once,
    negate,
    part_of,
    run_lanes,
    unwatched,
)
from app.core.baking.light_sources import Columns, TexelColumns
from app.core.baking.scene import MILLIMETRES_PER_UNIT, HeadMesh, head_middle
from app.core.base.arrays import Bools, Float32, Float64, Int64
from app.core.solver.head_shape import HeadShape

FINE = 4
_STEEP = 0.2
_HIDDEN = 0.05
_COARSE_SKY = TexelColumns(16, 32)


@dataclass(frozen=True, slots=True)
class Points:
    """Points on the skin and the eyes, and the grid of points on each face.

    Attributes:
        positions, normals: (V, 3) float32. Positions in scene units, and unit normals.
        level: (F,) uint32. Number of grid steps along each side of a face, where 1 means corners
            only. The faces of the skin come first, then those of the eyes.
        first: (F,) uint32. Index in `table` of each face's first point.
        table: (K,) uint32. Indices of points. In a face of level n, point (i, j) with i + j <= n is
            entry ``j (n + 1) - j (j - 1) / 2 + i``, with the barycentric coordinates
            b1 = i / n and b2 = j / n.
    """

    positions: Float32
    normals: Float32
    level: NDArray[np.uint32]
    first: NDArray[np.uint32]
    table: NDArray[np.uint32]

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.positions)


def vertex_points(head: HeadMesh) -> Points:
    """Return the vertices of the skin and the eyes as points, without grids."""
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
    """Return the vertices, with a grid of points added on each face where needed.

    A grid is needed where the visible sky varies sharply across the face. The grid has `FINE` steps
    along each side.
    """
    coarse = vertex_points(head)
    moments = expose(scene, coarse, _COARSE_SKY, 2, seed, keep=keep, watch=watch)
    open_sky = moments[0].sum(axis=1) / np.pi
    corners = coarse.table.reshape(-1, 3)
    visibility = open_sky[corners]
    steep = np.flatnonzero(
        (np.ptp(visibility, axis=1) > _STEEP) & (visibility.max(axis=1) > _HIDDEN)
    )
    return _refine(coarse, corners, steep.astype(np.int64)) if len(steep) else coarse


def _refine(coarse: Points, corners: NDArray[np.uint32], steep: Int64) -> Points:
    grid = [(i, j) for j in range(FINE + 1) for i in range(FINE + 1 - j)]
    weights = np.array([[FINE - i - j, i, j] for i, j in grid], np.float32) / FINE
    positions = np.einsum("gk,fkx->fgx", weights, coarse.positions[corners[steep]])
    normals = np.einsum("gk,fkx->fgx", weights, coarse.normals[corners[steep]])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True) + np.float32(1e-20)
    level, first = coarse.level.copy(), coarse.first.copy()
    level[steep] = FINE
    begin = len(coarse.table) + np.arange(len(steep)) * len(grid)
    first[steep] = begin.astype(np.uint32)
    extra = coarse.count + np.arange(len(steep) * len(grid))
    return Points(
        positions=np.concatenate([coarse.positions, positions.reshape(-1, 3)]),
        normals=np.concatenate([coarse.normals, normals.reshape(-1, 3)]),
        level=level,
        first=first,
        table=np.concatenate([coarse.table, extra.astype(np.uint32)]),
    )


MOMENTS = 3
_OFFSET = 1e-3
_LANES = 1 << 21
_SHORT_OF_LAMP = 0.999


def expose(
    scene: Any,
    points: Points,
    columns: Columns,
    samples: int,
    seed: int,
    *,
    keep: Keep = no_keep,
    watch: Watch = unwatched,
) -> Float32:
    """Integrate visibility times powers of the cosine of incidence over each column.

    Args:
        samples: Number of shadow rays along each side of a column. Each pair of a point and a
            column is tested with `samples` squared rays.

    Returns:
        (MOMENTS, V, columns) float32. ``[m]`` is the integral of L V mu^(m + 1), in radiance times
        steradians.
    """
    out = np.empty((MOMENTS, points.count, columns.count), np.float32)
    step = max(1, at_once(_LANES) // columns.count)
    for start in range(0, points.count, step):
        stop = min(start + step, points.count)

        def piece(start: int = start, stop: int = stop) -> Float32:
            return _expose_some(
                scene,
                (points.positions[start:stop], points.normals[start:stop]),
                columns,
                samples,
                31 * seed + start,
                part_of(watch, start / points.count, stop / points.count),
            )

        out[:, start:stop] = keep(str(start), (MOMENTS, stop - start, columns.count), piece)
    return out


def _expose_some(
    scene: Any,
    places: tuple[Float32, Float32],
    columns: Columns,
    samples: int,
    seed: int,
    watch: Watch,
) -> Float32:
    """Integrate the moments at the given points, with one lane for each point and column.

    Args:
        places: Positions and normals of the points.

    Returns:
        (MOMENTS, n, columns) float32.
    """
    positions, normals = map(Table, places)

    def kernel(lane: Any, rng: Any) -> tuple[Any, ...]:
        place, column = lane // columns.count, lane % columns.count
        position, normal = positions.take(place), normals.take(place)
        return _visible_moments(scene, position, normal, column, columns, samples, rng)

    moments = run_lanes(len(places[0]) * columns.count, seed, kernel, watch)
    return np.stack(moments).reshape(MOMENTS, -1, columns.count)


def _visible_moments(
    scene: Any, position: Any, normal: Any, column: Any, columns: Columns, samples: int, rng: Any
) -> tuple[Any, ...]:
    """Sum the weight times V mu^(m + 1) over a jittered grid inside each column."""
    import drjit as dr
    import mitsuba as mi

    origin = position + normal * _OFFSET

    def body(k: Any, rng: Any, *sums: Any) -> tuple[Any, ...]:
        direction, distance, weight = columns.sample(
            column,
            origin,
            (mi.Float(k % samples) + rng.next_float32()) / samples,
            (mi.Float(k // samples) + rng.next_float32()) / samples,
        )
        mu = dr.dot(direction, normal)
        above = mu > 0
        ray = mi.Ray3f(origin, direction)
        ray.maxt = distance * _SHORT_OF_LAMP
        free = above & negate(scene.ray_test(ray, above))
        term = dr.select(free, weight * mu / samples**2, 0)
        new = []
        for total in sums:
            new.append(total + term)
            term = term * mu
        return (k + 1, rng, *new)

    state = (mi.UInt32(0), rng, *(mi.Float(0) for _ in range(MOMENTS)))
    result = dr.while_loop(state, lambda k, *_: k < samples * samples, body)
    return tuple(result[2:])


def shine(
    scene: Any,
    picture: int,
    pixels: NDArray[np.int32],
    columns: Columns,
    samples: int,
    seed: int,
    watch: Watch = unwatched,
) -> Float32:
    """Trace the light from each column that the first visible surface reflects directly.

    Args:
        picture: Side of the square picture, in pixels.
        pixels: (n,) int32. Flat row-major pixel indices.
        samples: Number of points in each pixel. Each point casts one shadow ray towards every
            column.

    Returns:
        (n, columns, 3) float32. Linear Rec. 709 radiance.
    """
    import drjit as dr
    import mitsuba as mi

    numbers = Table(pixels.astype(np.uint32))
    light = Tally(len(pixels) * columns.count)
    sensor = scene.sensors()[0]

    def kernel(lane: Any, rng: Any) -> tuple[Any, ...]:
        slot, part = lane // samples, lane % samples
        pixel = numbers.take(slot)
        film = mi.Point2f(
            (mi.Float(pixel % picture) + (mi.Float(part) + rng.next_float32()) / samples) / picture,
            (mi.Float(pixel // picture) + rng.next_float32()) / picture,
        )
        ray, _ = sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
        si = scene.ray_intersect(ray)
        dr.eval(si, rng)  # so that the loop's kernel contains only the shadow rays

        def add(column: Any, value: Any, active: Any) -> None:
            light.add(slot * columns.count + column, value / samples, active)

        _reflect(scene, si, columns, rng, add)
        return ()

    run_lanes(len(pixels) * samples, seed + 77, kernel, watch)
    return light.sums(len(pixels), columns.count)


def _reflect(
    scene: Any, si: Any, columns: Columns, rng: Any, add: Callable[[Any, Any, Any], None]
) -> None:
    """Call ``add(column, colour, mask)`` with the light that a point reflects from each column."""
    import drjit as dr
    import mitsuba as mi

    context = mi.BSDFContext()

    def body(column: Any, rng: Any) -> tuple[Any, Any]:
        direction, distance, weight = columns.sample(
            column, si.p, rng.next_float32(), rng.next_float32()
        )
        local = si.to_local(direction)
        faces = (dr.dot(direction, si.n) > 0) & (local.z > 0)
        shadow = si.spawn_ray(direction)
        shadow.maxt = distance * _SHORT_OF_LAMP
        visible = faces & negate(scene.ray_test(shadow, faces))
        value = mi.Color3f(si.bsdf().eval(context, si, local, visible)) * weight
        add(column, value, visible)
        return column + 1, rng

    def more(column: Any, _rng: Any) -> Any:
        return si.is_valid() & (column < columns.count)

    dr.while_loop((mi.UInt32(0), rng), more, body)


_STEPS: Final = 16  # rays along each side of a pixel
_THIN_M: Final = 0.006
_DOTS_PER_M: Final = 2000
_SMOOTH_M: Final = 0.0005
_CHIN_UNITS: Final = 1.25  # skin farther below the eyes counts as neck


def look_at_shape(head: HeadMesh, scene: Any, pixels: NDArray[np.int32], size: int) -> HeadShape:
    """Find the position on the head that each pixel of its picture shows.

    Args:
        pixels: (P,) int32. Flat row-major indices of the pixels that the head covers.
        size: Side of the square picture, in pixels.
    """
    middle = head_middle(head)
    metres = MILLIMETRES_PER_UNIT / 1000.0
    sums, hits = _visibility(scene, size)
    if head.symmetric:
        sums, hits = sums + sums[:, ::-1] * [-1.0, 1.0, 1.0], hits + hits[:, ::-1]
    places = (sums / np.maximum(hits, 1.0)[..., None] - middle) * metres
    skin = (head.skin.vertices - middle) * metres
    faces = head.skin.faces.astype(np.int64)
    parts = [skin] if head.eyes is None else [skin, (head.eyes.vertices - middle) * metres]
    return HeadShape(
        head=head.name,
        pixels=pixels,
        positions=places.reshape(-1, 3)[pixels].astype(np.float32),
        skin=_thinned(np.concatenate(parts)).astype(np.float32),
        above=_outline(skin[:, [0, 2]], faces[_above_neck(head, faces)]),
        side=_outline(skin[:, [2, 1]], faces),
        eye_point=((np.array(head.eye_point) - middle) * metres).astype(np.float32),
    )


def look_from(head: HeadMesh, scene: Any, size: int) -> tuple[Float32, Float32]:
    """Find the coverage of each pixel and the position on the head that it shows, for any camera.

    Returns:
        coverage: (N * N,) float32. Fraction of each pixel that the head covers.
        positions: (N * N, 3) float32. Mean visible position, as in `HeadShape`.
    """
    sums, hits = _visibility(scene, size)
    metres = MILLIMETRES_PER_UNIT / 1000.0
    places = (sums / np.maximum(hits, 1.0)[..., None] - head_middle(head)) * metres
    skin_cover = np.asarray(hits / _STEPS**2, np.float32).ravel()
    return skin_cover, places.reshape(-1, 3).astype(np.float32)


def head_coverage(scene: Any, size: int, watch: Watch = unwatched) -> Float32:
    """Measure the fraction of each pixel that the head covers, (N * N,), on a symmetric grid."""
    return np.asarray(_visibility(scene, size, watch)[1] / _STEPS**2, np.float32).ravel()


def _visibility(scene: Any, size: int, watch: Watch = unwatched) -> tuple[Float64, Float64]:
    """Return the sum of the points that each pixel's rays hit, (N, N, 3), and the hit count."""
    import drjit as dr
    import mitsuba as mi

    side = size * _STEPS
    sensor = scene.sensors()[0]

    def kernel(lane: Any, _rng: Any) -> tuple[Any, ...]:
        column, row = mi.Float(lane % side), mi.Float(lane // side)
        film = mi.Point2f((column + 0.5) / side, (row + 0.5) / side)
        ray, _ = sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
        surface = scene.ray_intersect_preliminary(ray)
        hit = surface.is_valid()
        place = ray(dr.select(hit, surface.t, 0.0))
        visible = dr.select(hit, mi.Float(1), mi.Float(0))
        return visible, place.x * visible, place.y * visible, place.z * visible

    sums = np.stack(run_lanes(side * side, 0, kernel, watch)).astype(np.float64)
    blocks = sums.reshape(4, size, _STEPS, size, _STEPS).sum(axis=(2, 4))
    return np.moveaxis(blocks[1:], 0, -1), blocks[0]


def _thinned(points: Float64) -> Float64:
    """Keep one point per grid cell, which is enough to measure distances."""
    _, first = np.unique(np.floor(points / _THIN_M).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(first)]


def _above_neck(head: HeadMesh, faces: Int64) -> Bools:
    heights = head.skin.vertices[:, 1][faces].min(axis=1)
    return np.asarray(heights > head.eye_point[1] - _CHIN_UNITS)


def _outline(points: Float64, faces: Int64) -> Float32:
    """Return the closed outline of a mesh's shadow, (n, 2), in metres, counter-clockwise."""
    start = points.min(axis=0) - 0.01
    dots = (points - start) * _DOTS_PER_M
    wide, tall = np.ceil(dots.max(axis=0) + 0.01 * _DOTS_PER_M).astype(int)
    shadow = np.zeros((tall, wide), np.uint8)
    for triangle in np.round(dots[faces]).astype(np.int32):
        cv2.fillConvexPoly(shadow, triangle, 255)
    contours, _ = cv2.findContours(shadow, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    longest = max(contours, key=cv2.contourArea)
    smooth = cv2.approxPolyDP(longest, _SMOOTH_M * _DOTS_PER_M, True)[:, 0].astype(np.float64)
    # OpenCV's y points down, so clockwise in OpenCV is counter-clockwise here.
    if cv2.contourArea(smooth.astype(np.float32), True) < 0:
        smooth = smooth[::-1]
    return np.asarray(smooth / _DOTS_PER_M + start, np.float32)
