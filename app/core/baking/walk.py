"""Tracing light backwards: from a pixel through the skin to the points where light came in.

Every path starts at the camera and is followed as Mitsuba's ``volpathmis`` would follow it: rough
dielectric boundary, random walk inside, spectral weights kept for all three channels at once
(Miller et al., "A null-scattering path integral formulation of light transport", 2019). Where
``volpathmis`` would look the escaping direction up in an environment, this tracer records *where*
on the skin the path came out. Light enters skin from every direction alike but for a smooth factor
(the exit profile), so that the share each pixel takes from each point of the skin is all that has
to be found by chance; how much light reaches a point from each direction is found without any
(`app.core.baking.exposure`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.core.baking.scene import MILLIMETRES_PER_UNIT, HeadMesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.baking.points import Points
    from app.core.baking.skin import Skin

__all__ = [
    "PROFILE_BINS",
    "Gathered",
    "SceneTables",
    "fit_profile",
    "lean_scale",
    "scene_tables",
    "trace_pixels",
    "trace_plainly",
]

PROFILE_BINS = 64
_MAX_EVENTS = 2000
# Below this share of what set out, paths end by chance; fainter ones are not worth their time.
_FAINT = 0.25


@dataclass(frozen=True, slots=True)
class SceneTables:
    """What the tracer needs beside the Mitsuba scene.

    Attributes
    ----------
    scene, sensor : mitsuba objects
    skin_shape : mitsuba ShapePtr
        To tell the skin from the eyes.
    level, first, table : drjit UInt32
        The grid of points of each face; see `app.core.baking.points.Points`.
    skin_faces, points : int
        Number of faces of the skin; number of points on skin and eyes together.
    picture : int
        Pixels along one side.
    extinction, albedo : tuple of float
        Of the medium, per scene unit.
    """

    scene: Any
    sensor: Any
    skin_shape: Any
    level: Any
    first: Any
    table: Any
    skin_faces: int
    points: int
    picture: int
    extinction: tuple[float, float, float]
    albedo: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Gathered:
    """What the paths of some pixels found.

    Attributes
    ----------
    share : (pixels, V, 3) float32
        How much of the light that enters the skin at a point reaches the pixel.
    lean : (pixels, V, 3, 3) float32
        First moment of the direction in which that light leaves along the backward path, in the
        tangent plane: [..., axis, channel]. Light that comes in aslant travels on under the skin,
        so what a pixel sees is a little shifted along the light; this is that shift.
    profile : (PROFILE_BINS, 3) float64
        Light that left the skin, by cosine of its angle to the normal.
    """

    share: NDArray[np.float32]
    lean: NDArray[np.float32]
    profile: NDArray[np.float64]


def scene_tables(
    scene: Any, head: HeadMesh, skin: Skin, points: Points, picture: int
) -> SceneTables:
    """Collect the tables of a scene made by `app.core.baking.scene.build_scene`."""
    import mitsuba as mi

    shapes = scene.shapes()
    skin_shape = next(shape for shape in shapes if shape.id() == "skin")
    r, g, b = (t * MILLIMETRES_PER_UNIT for t in skin.extinction)
    return SceneTables(
        scene=scene,
        sensor=scene.sensors()[0],
        skin_shape=mi.ShapePtr(skin_shape),
        level=mi.UInt32(points.level),
        first=mi.UInt32(points.first),
        table=mi.UInt32(points.table),
        skin_faces=len(head.skin.faces),
        points=points.count,
        picture=picture,
        extinction=(r, g, b),
        albedo=skin.albedo,
    )


def trace_pixels(tables: SceneTables, pixels: NDArray[np.int32], paths: int, seed: int) -> Gathered:
    """Follow `paths` paths from each of some pixels to the places where light came in.

    Parameters
    ----------
    tables : SceneTables
    pixels : (n,) int32
        Flat row-major pixel numbers.
    paths : int
        Paths per pixel.
    seed : int

    Returns
    -------
    Gathered
        Averages over the paths.
    """
    import drjit as dr
    import mitsuba as mi

    share = dr.zeros(mi.Float, len(pixels) * tables.points * 3)
    lean = dr.zeros(mi.Float, len(pixels) * tables.points * 9)
    profile = dr.zeros(mi.Float, PROFILE_BINS * 3)
    _follow(tables, pixels, paths, seed, share=share, lean=lean, profile=profile)
    return Gathered(
        _mean(share, paths, (len(pixels), tables.points, 3)),
        _mean(lean, paths, (len(pixels), tables.points, 3, 3)),
        np.array(profile, np.float64).reshape(PROFILE_BINS, 3),
    )


def trace_plainly(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    paths: int,
    seed: int,
    environment: tuple[int, int],
) -> NDArray[np.float32]:
    """Transport of some pixels by plain backward path tracing: unbiased, and noisy.

    The paths are those of `trace_pixels`; each adds its weight to the texel it escapes to. This is
    the reference that the product form is tested against.

    Returns
    -------
    (pixels, H * W, 3) float32
    """
    import drjit as dr
    import mitsuba as mi

    texels = environment[0] * environment[1]
    strays = dr.zeros(mi.Float, len(pixels) * texels * 3)
    _follow(tables, pixels, paths, seed, strays=strays, environment=environment)
    return _mean(strays, paths, (len(pixels), texels, 3))


def _follow(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    paths: int,
    seed: int,
    *,
    share: Any = None,
    lean: Any = None,
    profile: Any = None,
    strays: Any = None,
    environment: tuple[int, int] = (0, 0),
) -> None:
    """Run all paths to their ends, adding what they find to the arrays that are given."""
    import drjit as dr
    import mitsuba as mi

    lanes = len(pixels) * paths
    slot = dr.arange(mi.UInt32, lanes) // paths
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), slot)
    rng = random_lanes(lanes, seed)
    rays, _ = tables.sensor.sample_ray(
        0.0, rng.next_float32(), _film_point(pixel, rng, tables.picture), mi.Point2f(0.5)
    )
    hero = dr.minimum(mi.UInt32(rng.next_float32() * 3), 2)
    extinction, albedo = mi.Color3f(tables.extinction), mi.Color3f(tables.albedo)
    context = mi.BSDFContext()

    def body(
        ray: Any, rng: Any, weight: Any, ratio: Any, inside: Any, alive: Any, n: Any
    ) -> tuple[Any, ...]:
        # Free flight in the hero channel; the other channels follow by their pdf ratios.
        flight = -dr.log(1 - rng.next_float32()) / _pick(extinction, hero)
        ray.maxt = dr.select(inside, flight, dr.inf)
        found = tables.scene.ray_intersect_preliminary(ray, coherent=False, active=alive)
        hit = found.is_valid() & alive
        travelled = dr.select(hit, found.t, flight)
        survive = dr.select(inside, dr.exp(-extinction * travelled), mi.Color3f(1))
        scatters = inside & alive & ~hit
        density = dr.select(scatters, survive * extinction, survive)
        norm = dr.rcp(dr.maximum(_pick(density, hero), 1e-35))
        weight = dr.select(
            alive, weight * density * dr.select(scatters, albedo, 1.0) * norm, weight
        )
        ratio = dr.select(alive, ratio * density * norm, ratio)

        escapes = alive & ~inside & ~hit
        if strays is not None:
            texel = _texel_of(ray.d, environment)
            place = slot * (environment[0] * environment[1]) + texel
            _add(strays, place, _value(weight, ratio), escapes & (n > 0))
        alive &= ~escapes

        # Boundary: let the surface's own BSDF decide, as Mitsuba's integrator does.
        si = found.compute_surface_interaction(ray, mi.RayFlags.All, hit)
        sample, scale = si.bsdf(ray).sample(
            context,
            si,
            rng.next_float32(),
            mi.Point2f(rng.next_float32(), rng.next_float32()),
            hit,
        )
        onward = si.to_world(sample.wo)
        weight = dr.select(hit, weight * mi.Color3f(scale), weight)
        on_skin = hit & (si.shape == tables.skin_shape)
        then_inside = dr.select(on_skin, dr.dot(onward, si.n) < 0, inside)
        value = _value(weight, ratio)
        leaves = on_skin & inside & ~then_inside
        if strays is None:
            # The camera's own first reflection is done exactly (`exposure.shine`). Later ones hold
            # half a per cent of the light: they count as light from their place, by the profile.
            glances = hit & ~inside & ~then_inside & (n > 0)
            normal = si.sh_frame.n
            aslant = onward - normal * dr.dot(onward, normal)
            _deposit(tables, found, slot, (share, lean), value, aslant, leaves | glances)
            bin_ = mi.UInt32(dr.abs(sample.wo.z) * PROFILE_BINS)
            _add(profile, dr.minimum(bin_, PROFILE_BINS - 1), value, leaves)
        inside = dr.select(on_skin, then_inside, inside)

        scattered = mi.warp.square_to_uniform_sphere(
            mi.Point2f(rng.next_float32(), rng.next_float32())
        )
        next_hit = si.spawn_ray(onward)
        ray.o = dr.select(hit, next_hit.o, ray.o + ray.d * travelled)
        ray.d = dr.select(hit, onward, scattered)
        n += 1
        brightest = dr.max(dr.abs(value))
        keep = dr.clip(brightest / _FAINT, 0.05, 1.0)
        alive &= (rng.next_float32() < keep) & (brightest > 0) & (n < _MAX_EVENTS)
        weight *= dr.rcp(keep)
        return ray, rng, weight, ratio, inside, alive, n

    state = (
        mi.Ray3f(rays),
        rng,
        mi.Color3f(1),
        mi.Color3f(1),
        mi.Bool(False),
        mi.Bool(True),
        mi.UInt32(0),
    )
    dr.while_loop(state, lambda *s: s[5], body)
    dr.eval([array for array in (share, lean, profile, strays) if array is not None])


def random_lanes(lanes: int, seed: int) -> Any:
    """Independent random numbers for each lane, scrambled as Mitsuba's own samplers do.

    Generators that differ in their starting state alone are correlated between seeds.
    """
    import drjit as dr
    import mitsuba as mi

    one, two = mi.sample_tea_32(mi.UInt32(seed % 2**32), dr.arange(mi.UInt32, lanes))
    return mi.PCG32(size=lanes, initstate=mi.UInt64(one), initseq=mi.UInt64(two))


def _mean(total: Any, paths: int, shape: tuple[int, ...]) -> NDArray[np.float32]:
    array: NDArray[np.float32] = np.array(total).reshape(shape)
    array /= np.float32(paths)
    return array


def _film_point(pixel: Any, rng: Any, picture: int) -> Any:
    import mitsuba as mi

    column, row = pixel % picture, pixel // picture
    return mi.Point2f(
        (mi.Float(column) + rng.next_float32()) / picture,
        (mi.Float(row) + rng.next_float32()) / picture,
    )


def _pick(colour: Any, channel: Any) -> Any:
    import drjit as dr

    return dr.select(channel == 0, colour.x, dr.select(channel == 1, colour.y, colour.z))


def _value(weight: Any, ratio: Any) -> Any:
    """Balance heuristic over the three channels that could have been the hero."""
    import drjit as dr

    return weight * (3 * dr.rcp(ratio.x + ratio.y + ratio.z))


def _add(target: Any, index: Any, value: Any, active: Any) -> None:
    import drjit as dr

    for channel, part in enumerate((value.x, value.y, value.z)):
        dr.scatter_reduce(dr.ReduceOp.Add, target, part, index * 3 + channel, active)


def _texel_of(direction: Any, environment: tuple[int, int]) -> Any:
    """Texel that a direction in the head frame belongs to, at turn 0."""
    import drjit as dr
    import mitsuba as mi

    height, width = environment
    u = 0.5 + dr.atan2(-direction.x, direction.z) / dr.two_pi
    v = dr.acos(dr.clip(direction.y, -1, 1)) / dr.pi
    row = dr.minimum(mi.UInt32(v * height), height - 1)
    return row * width + dr.minimum(mi.UInt32(u * width), width - 1)


def _deposit(
    tables: SceneTables,
    found: Any,
    slot: Any,
    targets: tuple[Any, Any],
    value: Any,
    aslant: Any,
    active: Any,
) -> None:
    """Share a value among the three points around the place that was hit, its lean to one."""
    import drjit as dr
    import mitsuba as mi

    on_skin = found.shape == tables.skin_shape
    face = found.prim_index + dr.select(on_skin, mi.UInt32(0), mi.UInt32(tables.skin_faces))
    level = dr.gather(mi.UInt32, tables.level, face, active)
    first = dr.gather(mi.UInt32, tables.first, face, active)
    steps = mi.Float(level)
    u, v = found.prim_uv.x * steps, found.prim_uv.y * steps
    i = dr.minimum(mi.UInt32(dr.maximum(u, 0)), level - 1)
    j = dr.minimum(mi.UInt32(dr.maximum(v, 0)), level - 1 - i)
    s, t = u - mi.Float(i), v - mi.Float(j)
    upper = s + t > 1
    shares = (
        (
            dr.select(upper, s + t - 1, 1 - s - t),
            i + dr.select(upper, 1, 0),
            j + dr.select(upper, 1, 0),
        ),
        (dr.select(upper, 1 - t, s), i + 1, j),
        (dr.select(upper, 1 - s, t), i, j + 1),
    )
    share, lean = targets
    nearest, most = mi.UInt32(0), mi.Float(-1)
    for part, a, b in shares:
        entry = first + b * (level + 1) + a - dr.select(b > 0, b * (b - 1) // 2, 0)
        point = dr.gather(mi.UInt32, tables.table, entry, active)
        _add(share, slot * tables.points + point, value * part, active)
        nearest, most = dr.select(part > most, point, nearest), dr.maximum(part, most)
    for axis, component in enumerate((aslant.x, aslant.y, aslant.z)):
        place = (slot * tables.points + nearest) * 3 + axis
        _add(lean, place, value * component, active)


def fit_profile(profile: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit the exit profile by polynomials.

    Parameters
    ----------
    profile : (PROFILE_BINS, 3) float64
        Light by cosine of the exit angle, any scale.

    Returns
    -------
    (3, 3) float64
        Coefficients a[c, m] of g_c(mu) = sum_m a[c, m] mu^(m + 1) per steradian, with
        the integral of g_c over the hemisphere = 1.
    """
    mu = (np.arange(PROFILE_BINS) + 0.5) / PROFILE_BINS
    powers = np.stack([mu, mu**2, mu**3], axis=1)
    density = profile / profile.sum(axis=0) * PROFILE_BINS / (2 * np.pi)
    coefficients = np.linalg.lstsq(powers, density, rcond=None)[0].T
    integral = 2 * np.pi * coefficients @ (1 / np.array([2.0, 3.0, 4.0]))
    fitted: NDArray[np.float64] = coefficients / integral[:, None]
    return fitted


def lean_scale(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Factor that makes a profile times (1 + factor lean . direction) have that lean.

    Parameters
    ----------
    coefficients : (3, 3) float64
        From `fit_profile`.

    Returns
    -------
    (3,) float64
        2 / (integral of g sin^2) for each channel.
    """
    squared = 2 * np.pi * coefficients @ (1 / np.array([4.0, 5.0, 6.0]))
    return np.asarray(2 / (1 - squared))
