"""Trace light backwards, from a pixel through the skin to the points where it entered.

Every path starts at the camera and is followed as in Mitsuba's ``volpathmis``, with a rough
dielectric boundary, a random walk inside, and spectral weights for all three channels at once
(Miller et al., "A null-scattering path integral formulation of light transport", 2019). Where
``volpathmis`` would look up the escaping direction in an environment, this tracer records *where*
on the skin the path came out. Light enters skin equally from all directions except for a smooth
factor (the exit profile). Therefore, only the fraction that each pixel receives from each point on
the skin needs Monte Carlo paths. The light that reaches a point from each direction is computed
without them (`app.core.baking.exposure`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import Table, Tally, Watch, negate, run_lanes, unwatched
from app.core.baking.scene import MILLIMETRES_PER_UNIT, HeadMesh
from app.core.baking.skin import Skin
from app.core.base.arrays import Float32, Float64

if TYPE_CHECKING:
    from app.core.baking.exposure import Points

_MAX_EVENTS = 2000
# Below this fraction of their starting weight, paths cost more than they contribute, so Russian
# roulette ends them.
_FAINT = 0.25


@dataclass(frozen=True, slots=True)
class PathTotals:
    """Fractions of the light that the paths from some pixels have collected.

    Attributes:
        share: (pixels, V, 3) float32. Fraction of the light entering the skin at each point that
            reaches the pixel.
        lean: (pixels, V, 3, 3) float32, [..., axis, channel]. First moment, in the tangent plane,
            of the direction in which the backward path of that light leaves the skin. Oblique light
            keeps travelling under the skin, which shifts the source of a pixel's light slightly
            along the light's direction. The lean is that shift.
    """

    share: Float32
    lean: Float32


def scene_tables(
    scene: Any, head: HeadMesh, skin: Skin, points: Points, picture: int
) -> SceneTables:
    """Collect the tables for a scene from `app.core.baking.scene.build_scene`."""
    r, g, b = (t * MILLIMETRES_PER_UNIT for t in skin.extinction)
    return SceneTables(
        scene=scene,
        skin_shape=next(shape for shape in scene.shapes() if shape.id() == "skin"),
        level=Table(points.level),
        first=Table(points.first),
        table=Table(points.table),
        skin_faces=len(head.skin.faces),
        points=points.count,
        picture=picture,
        extinction=(r, g, b),
        albedo=skin.albedo,
    )


def trace_pixels(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    paths: int,
    seed: int,
    watch: Watch = unwatched,
) -> PathTotals:
    """Trace `paths` paths from each pixel to the points where the light entered the skin.

    Args:
        pixels: (n,) int32. Flat row-major pixel indices.
        paths: Paths per pixel.
    """
    rows = len(pixels) * tables.points
    shares = Shares(tables, Tally(rows), Tally(rows * 3))
    follow(tables, pixels, paths, seed, shares, watch)
    share = shares.share.sums(len(pixels), tables.points)
    lean = shares.lean.sums(len(pixels), tables.points, 3)
    share /= np.float32(paths)
    lean /= np.float32(paths)
    return PathTotals(share, lean)


def trace_profile(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    paths: int,
    seed: int,
    watch: Watch = unwatched,
) -> Float32:
    """Measure the light that leaves the skin as a function of the cosine of its exit angle.

    Args:
        pixels: (n,) int32. Flat row-major pixel indices.
        paths: Paths per pixel.

    Returns:
        (PROFILE_BINS, 3) float32. Light in each bin of the cosine between the exiting light and the
        normal, on an arbitrary scale.
    """
    profile = Profile(Tally(PROFILE_BINS))
    follow(tables, pixels, paths, seed, profile, watch)
    return profile.tally.sums(PROFILE_BINS)


def follow(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    paths: int,
    seed: int,
    finder: Finder,
    watch: Watch,
) -> None:
    """Follow all paths to their ends and report their events to `finder`."""
    import drjit as dr
    import mitsuba as mi

    numbers = Table(pixels.astype(np.uint32))
    sensor = tables.scene.sensors()[0]

    def kernel(lane: Any, rng: Any) -> tuple[Any, ...]:
        slot = lane // paths
        wavelength = rng.next_float32()
        film = _film_point(numbers.take(slot), rng, tables.picture)
        ray, _ = sensor.sample_ray(0.0, wavelength, film, mi.Point2f(0.5))
        hero = dr.minimum(mi.UInt32(rng.next_float32() * 3), 2)
        _PathWalk(tables, finder, slot, hero).run(ray, rng)
        return ()

    run_lanes(len(pixels) * paths, seed, kernel, watch)


@dataclass(frozen=True, slots=True)
class _PathWalk:
    """A random walk along one path, or along the paths of all lanes at once.

    A walk consists of free flights, encounters with surfaces, and scattering.

    Attributes:
        slot: Index of the pixel where the path started.
        hero: Channel from which the flights are sampled.
    """

    tables: SceneTables
    finder: Finder
    slot: Any
    hero: Any

    def run(self, ray: Any, rng: Any) -> None:
        """Follow the path from the camera to its end."""
        import drjit as dr
        import mitsuba as mi

        state = (
            mi.Ray3f(ray),
            rng,
            mi.Color3f(1),
            mi.Color3f(1),
            mi.Bool(False),
            mi.Bool(True),
            mi.UInt32(0),
        )
        dr.while_loop(state, lambda *s: s[5], self._step)

    def _step(
        self, ray: Any, rng: Any, weight: Any, ratio: Any, inside: Any, alive: Any, n: Any
    ) -> tuple[Any, ...]:
        """Trace one flight and handle the event at its end, where `n` counts the events."""
        import drjit as dr
        import mitsuba as mi

        extinction = _pick(mi.Color3f(self.tables.extinction), self.hero)
        flight = -dr.log(1 - rng.next_float32()) / extinction
        ray.maxt = dr.select(inside, flight, dr.inf)
        intersection = self.tables.scene.ray_intersect_preliminary(
            ray, coherent=False, active=alive
        )
        hit = intersection.is_valid() & alive
        distance = dr.select(hit, intersection.t, flight)
        scatters = inside & alive & negate(hit)
        weight, ratio = self._fly(weight, ratio, inside, alive, scatters, distance)

        escapes = alive & negate(inside) & negate(hit)
        self.finder.escaped(self.slot, ray.d, _value(weight, ratio), escapes & (n > 0))
        alive &= negate(escapes)

        lobe = rng.next_float32()
        facet = mi.Point2f(rng.next_float32(), rng.next_float32())
        sphere = mi.Point2f(rng.next_float32(), rng.next_float32())

        def meet() -> tuple[Any, ...]:
            return self._meet(ray, intersection, (lobe, facet), weight, ratio, inside, n)

        def scatter() -> tuple[Any, ...]:
            anywhere = mi.warp.square_to_uniform_sphere(sphere)
            return ray(distance), anywhere, weight, inside

        place, onward, weight, inside = dr.if_stmt((), hit, meet, scatter)
        ray.o, ray.d = place, onward
        n += 1
        brightest = dr.max(dr.abs(_value(weight, ratio)))
        keep = dr.clip(brightest / _FAINT, 0.05, 1.0)
        alive &= (rng.next_float32() < keep) & (brightest > 0) & (n < _MAX_EVENTS)
        return ray, rng, weight * dr.rcp(keep), ratio, inside, alive, n

    def _fly(
        self, weight: Any, ratio: Any, inside: Any, alive: Any, scatters: Any, distance: Any
    ) -> tuple[Any, Any]:
        """Return the weights after a flight sampled for the hero channel.

        The weights of the other channels follow from the ratios of their probability densities.
        """
        import drjit as dr
        import mitsuba as mi

        extinction, albedo = mi.Color3f(self.tables.extinction), mi.Color3f(self.tables.albedo)
        survive = dr.select(inside, dr.exp(-extinction * distance), mi.Color3f(1))
        density = dr.select(scatters, survive * extinction, survive)
        norm = dr.rcp(dr.maximum(_pick(density, self.hero), 1e-35))
        scattered = weight * density * dr.select(scatters, albedo, 1.0) * norm
        return (
            dr.select(alive, scattered, weight),
            dr.select(alive, ratio * density * norm, ratio),
        )

    def _meet(
        self,
        ray: Any,
        intersection: Any,
        chance: tuple[Any, Any],
        weight: Any,
        ratio: Any,
        inside: Any,
        n: Any,
    ) -> tuple[Any, ...]:
        """Sample the surface's own BSDF, as Mitsuba's integrator does."""
        import drjit as dr
        import mitsuba as mi

        si = intersection.compute_surface_interaction(ray, mi.RayFlags.All)
        sample, scale = si.bsdf().sample(mi.BSDFContext(), si, *chance)
        onward = si.to_world(sample.wo)
        weight = weight * mi.Color3f(scale)
        on_skin = si.shape == self.tables.skin_shape
        then_inside = dr.select(on_skin, dr.dot(onward, si.n) < 0, inside)
        normal = si.sh_frame.n
        self.finder.on_hit(
            Meeting(
                slot=self.slot,
                intersection=intersection,
                cosine=dr.abs(sample.wo.z),
                aslant=onward - normal * dr.dot(onward, normal),
                value=_value(weight, ratio),
                leaves=on_skin & inside & negate(then_inside),
                glances=negate(inside) & negate(then_inside) & (n > 0),
            )
        )
        next_ray = si.spawn_ray(onward)
        return next_ray.o, next_ray.d, weight, then_inside


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
    """Return the path's weight by the balance heuristic over the three channels."""
    import drjit as dr

    return weight * (3 * dr.rcp(ratio.x + ratio.y + ratio.z))


def fit_profile(profile: Float64) -> Float64:
    """Fit the exit profile with polynomials.

    Args:
        profile: (PROFILE_BINS, 3) float64. Light as a function of the cosine of the exit angle, on
            an arbitrary scale.

    Returns:
        (3, 3) float64. Coefficients a[c, m] of g_c(mu) = sum_m a[c, m] mu^(m + 1) per steradian,
        where the integral of g_c over the hemisphere is 1.
    """
    mu = (np.arange(PROFILE_BINS) + 0.5) / PROFILE_BINS
    powers = np.stack([mu, mu**2, mu**3], axis=1)
    density = profile / profile.sum(axis=0) * PROFILE_BINS / (2 * np.pi)
    coefficients = np.linalg.lstsq(powers, density, rcond=None)[0].T
    integral = 2 * np.pi * coefficients @ (1 / np.array([2.0, 3.0, 4.0]))
    return np.asarray(coefficients / integral[:, None])


def lean_scale(coefficients: Float64) -> Float64:
    """Return the factor k for which the profile times (1 + k lean . direction) has the given lean.

    Args:
        coefficients: (3, 3) float64. Coefficients from `fit_profile`.

    Returns:
        (3,) float64. 2 / (integral of g sin^2) for each channel.
    """
    squared = 2 * np.pi * coefficients @ (1 / np.array([4.0, 5.0, 6.0]))
    return np.asarray(2 / (1 - squared))


PROFILE_BINS = 64


@dataclass(frozen=True, slots=True)
class SceneTables:
    """The tracer's data, including the Mitsuba scene.

    Attributes:
        picture: Side of the square picture, in pixels.
    """

    scene: Any
    skin_shape: Any
    level: Table
    first: Table
    table: Table
    skin_faces: int
    points: int
    picture: int
    extinction: tuple[float, float, float]
    albedo: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Meeting:
    """An encounter between a path and a surface, and its outcome.

    Attributes:
        slot: Index of the pixel where the path started.
        leaves: Whether the path leaves the skin.
        glances: Whether the path arrived from outside, not directly from the camera, and stays
            outside.
    """

    slot: Any
    intersection: Any
    cosine: Any
    aslant: Any
    value: Any
    leaves: Any
    glances: Any


class Finder(Protocol):
    """Records the events on the paths of a trace."""

    def on_hit(self, at: Meeting) -> None:
        """Record an encounter in which the path leaves the skin, glances off, or does neither."""
        ...

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """Record a path that left the scene after meeting at least one surface."""
        ...


@dataclass(frozen=True, slots=True)
class Shares:
    """Adds the value of each path to the points around the position where it left the skin."""

    tables: SceneTables
    share: Tally
    lean: Tally

    def on_hit(self, at: Meeting) -> None:
        """See `Finder.on_hit`."""
        # The first reflection is computed exactly (`exposure.shine`). Later ones carry half a
        # per cent of the light, and the profile treats them as light from where they occur.
        self._deposit(at, at.leaves | at.glances)

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """Ignore a path that left the scene."""

    def _deposit(self, at: Meeting, active: Any) -> None:
        """Add the path's value to the three points around the hit, and its lean to one of them."""
        import drjit as dr
        import mitsuba as mi

        intersection = at.intersection
        on_skin = intersection.shape == self.tables.skin_shape
        face = intersection.prim_index + dr.select(
            on_skin, mi.UInt32(0), mi.UInt32(self.tables.skin_faces)
        )
        level = self.tables.level.take(face, active)
        first = self.tables.first.take(face, active)
        steps = mi.Float(level)
        u, v = intersection.prim_uv.x * steps, intersection.prim_uv.y * steps
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
        nearest, most = mi.UInt32(0), mi.Float(-1)
        for part, a, b in shares:
            entry = first + b * (level + 1) + a - dr.select(b > 0, b * (b - 1) // 2, 0)
            point = self.tables.table.take(entry, active)
            self.share.add(at.slot * self.tables.points + point, at.value * part, active)
            nearest, most = dr.select(part > most, point, nearest), dr.maximum(part, most)
        for axis, component in enumerate((at.aslant.x, at.aslant.y, at.aslant.z)):
            row = (at.slot * self.tables.points + nearest) * 3 + axis
            self.lean.add(row, at.value * component, active)


@dataclass(frozen=True, slots=True)
class Profile:
    """Adds up the values of paths by the angle at which the paths left the skin."""

    tally: Tally

    def on_hit(self, at: Meeting) -> None:
        """See `Finder.on_hit`."""
        import drjit as dr
        import mitsuba as mi

        bin_ = dr.minimum(mi.UInt32(at.cosine * PROFILE_BINS), PROFILE_BINS - 1)
        self.tally.add(bin_, at.value, at.leaves)

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """Ignore a path that left the scene."""
