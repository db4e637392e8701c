"""How much light reaches each point of the skin from each column of light, found by shadow rays.

For every vertex and every column (a texel of the environment, or a lamp) the part that the vertex
can see is integrated on a jittered grid, weighted by the first powers of the cosine of incidence.
Any smooth dependence of the skin on that cosine (the exit profile of `app.core.baking.walk`) is a
combination of those moments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from app.core.baking.walk import random_lanes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.baking.columns import Columns
    from app.core.baking.points import Points

__all__ = ["MOMENTS", "expose", "shine"]

MOMENTS = 3
_OFFSET = 1e-3
_LANES = 1 << 21
_SHORT_OF_LAMP = 0.999


def expose(
    scene: Any, points: Points, columns: Columns, samples: int, seed: int
) -> NDArray[np.float32]:
    """Integrate visibility times powers of the cosine of incidence over each column.

    Parameters
    ----------
    scene : mitsuba Scene
    points : Points
    columns : Columns
    samples : int
        Shadow rays along each side of a column; their square is shot.
    seed : int

    Returns
    -------
    (MOMENTS, V, columns) float32
        ``[m]`` is the integral of L V mu^(m + 1), radiance times steradian.
    """
    import drjit as dr
    import mitsuba as mi

    total = len(points.positions)
    out = np.empty((MOMENTS, total, columns.count), np.float32)
    step = max(1, _LANES // columns.count)
    for start in range(0, total, step):
        stop = min(start + step, total)
        lanes = (stop - start) * columns.count
        index = dr.arange(mi.UInt32, lanes)
        vertex, column = index // columns.count, index % columns.count
        position = _gather3(points.positions[start:stop], vertex)
        normal = _gather3(points.normals[start:stop], vertex)
        rng = random_lanes(lanes, 31 * seed + start)
        sums = _visible_moments(scene, position, normal, column, columns, samples, rng)
        dr.eval(sums)
        for m, one in enumerate(sums):
            out[m, start:stop] = np.array(one).reshape(-1, columns.count)
    return out


def shine(
    scene: Any,
    sensor: Any,
    picture: int,
    pixels: NDArray[np.int32],
    columns: Columns,
    samples: int,
    seed: int,
) -> NDArray[np.float32]:
    """Light that the first surface a camera ray meets reflects straight from a column.

    Parameters
    ----------
    scene, sensor : mitsuba objects
    picture : int
        Pixels along one side.
    pixels : (n,) int32
        Flat row-major pixel numbers.
    columns : Columns
    samples : int
        Points in each pixel; each casts one shadow ray to every column.
    seed : int

    Returns
    -------
    (n, columns, 3) float32
        Linear Rec. 709 radiance.
    """
    import drjit as dr
    import mitsuba as mi

    lanes = len(pixels) * samples
    index = dr.arange(mi.UInt32, lanes)
    slot, part = index // samples, index % samples
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), slot)
    rng = random_lanes(lanes, seed + 77)
    film = mi.Point2f(
        (mi.Float(pixel % picture) + (mi.Float(part) + rng.next_float32()) / samples) / picture,
        (mi.Float(pixel // picture) + rng.next_float32()) / picture,
    )
    ray, _ = sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    bsdf = si.bsdf(ray)
    result = dr.zeros(mi.Float, len(pixels) * columns.count * 3)
    dr.eval(result, si, rng)
    context = mi.BSDFContext()
    base = slot * columns.count

    def body(column: Any, rng: Any) -> tuple[Any, Any]:
        direction, distance, weight = columns.sample(
            column, si.p, rng.next_float32(), rng.next_float32()
        )
        local = si.to_local(direction)
        faces = si.is_valid() & (dr.dot(direction, si.n) > 0) & (local.z > 0)
        shadow = si.spawn_ray(direction)
        shadow.maxt = distance * _SHORT_OF_LAMP
        lit = faces & ~scene.ray_test(shadow, faces)
        value = mi.Color3f(bsdf.eval(context, si, local, lit)) * (weight / samples)
        for channel, one in enumerate((value.x, value.y, value.z)):
            dr.scatter_reduce(dr.ReduceOp.Add, result, one, (base + column) * 3 + channel, lit)
        return column + 1, rng

    start = (dr.zeros(mi.UInt32, lanes), rng)
    dr.while_loop(start, lambda column, _: column < columns.count, body)
    dr.eval(result)
    return np.array(result).reshape(len(pixels), columns.count, 3)


def _gather3(table: NDArray[np.float32], index: Any) -> Any:
    import drjit as dr
    import mitsuba as mi

    return dr.gather(mi.Vector3f, mi.Float(np.ascontiguousarray(table).ravel()), index)


def _visible_moments(
    scene: Any, position: Any, normal: Any, column: Any, columns: Columns, samples: int, rng: Any
) -> list[Any]:
    """Sum weight V mu^(m + 1) over a jittered grid inside each column."""
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
        free = above & ~scene.ray_test(ray, above)
        term = dr.select(free, weight * mu / samples**2, 0)
        new = []
        for total in sums:
            new.append(total + term)
            term = term * mu
        return (k + 1, rng, *new)

    lanes = dr.width(column)
    state = (mi.UInt32(0), rng, *(dr.zeros(mi.Float, lanes) for _ in range(MOMENTS)))
    result = dr.while_loop(state, lambda k, *_: k < samples * samples, body)
    return list(result[2:])
