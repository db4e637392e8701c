"""The head in the demo location itself: with near light, bounces and occlusion.

A panorama describes the light at one point from far away. Here every point of the skin gets its own
light: rays start at the skin, inside the modelled place, with the sitter's body in it. The response
of the skin comes from the bake (`app.core.baking`): the share of each point's light in each pixel,
and the surface's own reflection.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from app.core.baking.exposure import Points, place_points
from app.core.baking.random_walk import (
    PROFILE_BINS,
    fit_profile,
    lean_scale,
    scene_tables,
    trace_pixels,
    trace_profile,
)
from app.core.baking.scene import Camera, HeadMesh, build_scene
from app.core.baking.skin import find_skin
from benchmarks.truth.stock import ROOT, generic_head
from scenes.demo_location.assemble import World, build_place, sitter_parts
from scenes.demo_location.frame import CAFE, EYE_HEIGHT, SPOTS, Spot, to_world
from scenes.demo_location.tracer import radiance

if TYPE_CHECKING:
    from app.core.baking.random_walk import SceneTables

__all__ = ["CAFE", "SPOTS", "Portrait", "Sitting", "Spot", "portrait", "through_skin"]

Float32 = NDArray[np.float32]
METRES: Final = 0.1  # metres per unit of the head's scene
_OFFSET: Final = 1e-4  # metres above the skin, as in the bake
_GUIDED: Final = 0.6  # of the rays indoors go through openings
_LANES: Final = 1 << 19
_PARTS: Final = 12  # channels by (light, and its three moments of direction)
_FAR: Final = 1e6
_BATCH: Final = 96  # pixels traced at once


@dataclass(frozen=True, slots=True)
class Portrait:
    """The head's scene and the bake's data about its skin, for any light.

    Attributes:
        pixels: (P,) int32. Flat row-major numbers of the pixels that show the head.
        profile: (3, 3) float64. Exit profile, see `fit_profile`.
    """

    scene: Any
    camera: Camera
    points: Points
    tables: SceneTables
    pixels: NDArray[np.int32]
    profile: NDArray[np.float64]


def portrait(pixels: NDArray[np.int32], seed: int = 3) -> Portrait:
    """Prepare the generic head with medium skin, for the given pixels of 100 x 100."""
    head, camera = generic_head()
    skin = find_skin("medium")
    scene = build_scene(head, skin, camera)
    points = place_points(scene, head, seed)
    tables = scene_tables(scene, head, skin, points, camera.size)
    some = pixels[:: max(1, len(pixels) // 600)]
    bins = np.zeros((PROFILE_BINS, 3))
    for start in range(0, len(some), _BATCH):
        bins += trace_profile(tables, some[start : start + _BATCH], 512, seed + 999 + start)
    return Portrait(scene, camera, points, tables, pixels, fit_profile(bins))


class Sitting:
    """The sitter at a spot of the demo location, and the light at each point.

    Args:
        kind: Construction and lighting of the place.
    """

    def __init__(self, spot: Spot, kind: type[World] = World) -> None:
        parts = sitter_parts(ROOT / "resources" / "heads", hair=False)
        self._world = kind(build_place(), parts)
        faces = len(self._world.f)
        self._head_from = faces - len(parts["skin"].f) - len(parts["eyes"].f)
        self._at = to_world(spot.building[0], EYE_HEIGHT, spot.building[1])
        self._ears = _middle_of(generic_head()[0], parts)
        self._sampler = mi.load_dict({"type": "independent"})
        self._rotation = np.eye(3)

    @property
    def surroundings(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return all but the head: vertices in the head's frame and unit, (V, 3), faces, (M, 3)."""
        world = self._world
        places = (world.v.astype(np.float64) - self._at) @ self._rotation / METRES + self._ears
        return places, np.asarray(world.f[: self._head_from], np.int64)

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Return the rotation from the head's axes to the world's."""
        return self._rotation

    @property
    def world(self) -> World:
        """Return the place with the sitter in it."""
        return self._world

    def turn(self, degrees: float) -> None:
        """Turn the sitter to an azimuth."""
        self._world.turn(degrees, (float(self._at[0]), float(self._at[2])))
        a = np.radians(degrees)
        self._rotation = np.array(
            [[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]]
        )

    def entering(
        self, portrait: Portrait, chosen: NDArray[np.int64], samples: int, seed: int
    ) -> Float32:
        """Return the light entering the skin at some points, with its moments of direction.

        Returns:
            (n, 3, 4) float32. By channel: the integral of L g(mu), then of L g(mu) times the
            direction (head frame).
        """
        step = max(1, _LANES // samples)
        out = np.empty((len(chosen), 3, 4), np.float32)
        for start in range(0, len(chosen), step):
            some = chosen[start : start + step]
            places = self._placed(portrait.points.positions[some])
            normals = portrait.points.normals[some] @ self._rotation.T
            found = self._moments(places, normals, portrait.profile, samples, seed + start)
            out[start : start + step] = found
        return out

    def reflected(self, portrait: Portrait, samples: int, seed: int) -> Float32:
        """Return the surface's own reflection in each pixel, (P, 3) linear radiance."""
        step = max(1, _LANES // samples)
        return np.concatenate(
            [
                self._glints(portrait, portrait.pixels[start : start + step], samples, seed + start)
                for start in range(0, len(portrait.pixels), step)
            ]
        )

    def _placed(self, positions: Float32) -> NDArray[np.float64]:
        inside = (positions - self._ears) * METRES
        return np.asarray(inside @ self._rotation.T + self._at)

    def _moments(
        self,
        places: NDArray[np.float64],
        normals: NDArray[np.float64],
        profile: NDArray[np.float64],
        samples: int,
        seed: int,
    ) -> Float32:
        lanes = len(places) * samples
        index = dr.arange(mi.UInt32, lanes) // samples
        p, n = (_gather(values, index) for values in (places, normals))
        p += n * _OFFSET
        self._sampler.seed(seed, lanes)
        found = [self._lamp(p, n), self._sun(p), self._else(p, n)]
        sums = [mi.Float(0) for _ in range(_PARTS)]
        for way, colour in found:
            mu = dr.maximum(dr.dot(way, n), 0)
            toward = self._headward(way)
            for channel in range(3):
                a, b, c = (float(x) for x in profile[channel])
                value = colour[channel] * (mu * (a + mu * (b + mu * c)))
                for part, factor in enumerate((1.0, toward.x, toward.y, toward.z)):
                    sums[4 * channel + part] += value * factor
        dr.eval(*sums)
        parts = [np.array(one).reshape(-1, samples).mean(axis=1) for one in sums]
        return np.stack(parts, axis=1).reshape(-1, 3, 4).astype(np.float32)

    def _glints(
        self, portrait: Portrait, pixels: NDArray[np.int32], samples: int, seed: int
    ) -> Float32:
        lanes, size = len(pixels) * samples, portrait.camera.size
        pixel = dr.gather(
            mi.UInt32,
            mi.UInt32(pixels.astype(np.uint32)),
            dr.arange(mi.UInt32, lanes) // samples,
        )
        self._sampler.seed(seed + 77, lanes)
        u = self._sampler.next_2d()
        film = mi.Point2f(
            (mi.Float(pixel % size) + u.x) / size, (mi.Float(pixel // size) + u.y) / size
        )
        ray, _ = portrait.scene.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
        si = portrait.scene.ray_intersect(ray)
        p = self._world_point(si.p)
        n = self._worldward(si.n)
        p += n * _OFFSET
        context, bsdf, valid = mi.BSDFContext(), si.bsdf(), si.is_valid()
        context.type_mask = mi.BSDFFlags.Reflection
        total = mi.Color3f(0)
        for way, colour in (self._lamp(p, n), self._sun(p)):
            local = si.to_local(self._headward(way))
            lit = valid & (dr.dot(way, n) > 0) & (local.z > 0)
            total += dr.select(lit, mi.Color3f(bsdf.eval(context, si, local, lit)) * colour, 0)
        chance, facet = self._sampler.next_1d(), self._sampler.next_2d()
        sample, scale = bsdf.sample(context, si, chance, facet, valid)
        way = self._worldward(si.to_world(sample.wo))
        lit = valid & (sample.wo.z > 0) & (dr.dot(way, n) > 0) & (dr.max(scale) > 0)
        total += dr.select(lit, mi.Color3f(scale) * self._along(p, way, lit), 0)
        dr.eval(total)
        colours = np.array(total, np.float32).T.reshape(-1, samples, 3)
        return np.asarray(colours.mean(axis=1), np.float32)

    def _lamp(self, p: Any, n: Any) -> tuple[Any, Any]:
        """Return a direction to one of the ball lamps, and radiance over density."""
        pick, u = self._sampler.next_1d(), self._sampler.next_2d()
        way, far, density, glow = self._world.lights.sample_lamp(p, n, pick, u)
        useful = (density > 0) & (dr.dot(way, n) > 0)
        blocked = self._world.scene.ray_test(mi.Ray3f(p, way, far, 0, []), False, useful)
        return way, dr.select(useful & ~blocked, glow / density, 0)

    def _sun(self, p: Any) -> tuple[Any, Any]:
        lights = self._world.lights
        way = lights.sample_sun(self._sampler.next_2d())
        blocked = self._world.scene.ray_test(mi.Ray3f(p, way, _FAR, 0, []))
        return way, dr.select(blocked, 0, lights.sun_radiance / lights.sun_density)

    def _else(self, p: Any, n: Any) -> tuple[Any, Any]:
        """Return any direction, and its light without sun and ball lamps, over density."""
        portals, sampler = self._world.portals, self._sampler
        room, shares = portals.inside(p), portals.shares(p, n)
        through = room & (sampler.next_1d() < _GUIDED)
        out = portals.sample(p, shares, sampler.next_1d(), sampler.next_2d())
        flat = mi.Frame3f(n).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
        way = dr.select(through, out, flat)
        mu = dr.dot(way, n)
        density = dr.maximum(mu, 0) * dr.inv_pi
        guided = (1 - _GUIDED) * density + _GUIDED * portals.pdf(p, shares, way)
        density = dr.select(room, guided, density)
        useful = (mu > 0) & (density > 1e-9)
        light = self._along(p, way, useful)
        return way, dr.select(useful, light / density, 0)

    def _along(self, p: Any, way: Any, useful: Any) -> Any:
        """Return radiance along a ray, without the sun's disc, the ball lamps and the head itself.

        Light from the head to itself is traced by `trace_pixels`.
        """
        world, ray = self._world, mi.Ray3f(p, way)
        first = world.surfaces.meet(ray, mi.Point2f(0.5), False, useful)
        found = world.scene.ray_intersect_preliminary(ray, False, useful)
        own = found.is_valid() & (found.prim_index >= self._head_from)
        light = radiance(world.tables, self._sampler, ray)
        _, disc = world.lights.escaped(way)
        light -= dr.select(first["valid"], dr.select(first["ball"], first["glow"], 0), disc)
        return dr.select(useful & ~own, light, 0)

    def _headward(self, way: Any) -> Any:
        return _turned(self._rotation.T, way)

    def _worldward(self, way: Any) -> Any:
        return _turned(self._rotation, way)

    def _world_point(self, p: Any) -> Any:
        x, y, z = (float(v) for v in self._ears)
        moved = _turned(self._rotation, (mi.Vector3f(p) - mi.Vector3f(x, y, z)) * METRES)
        return mi.Point3f(moved + mi.Vector3f(*[float(v) for v in self._at]))


def through_skin(portrait: Portrait, entering: Float32, paths: int, seed: int) -> Float32:
    """Return pictures for given light entering the skin.

    Args:
        entering: (V, 3, 4, K) float32. From `Sitting.entering`, for K lights.
        paths: Random walks from each pixel.

    Returns:
        (P, 3, K) float32.
    """
    out = np.empty((len(portrait.pixels), 3, entering.shape[3]), np.float32)
    scale = lean_scale(portrait.profile).astype(np.float32)
    for start in range(0, len(portrait.pixels), _BATCH):
        pixels = portrait.pixels[start : start + _BATCH]
        gathered = trace_pixels(portrait.tables, pixels, paths, seed * 1_000_003 + start)
        used = np.flatnonzero(gathered.share.any(axis=(0, 2)))
        share, lean = gathered.share[:, used], gathered.lean[:, used]
        for channel in range(3):
            light = entering[used, channel]
            total = share[:, :, channel] @ light[:, 0]
            for axis in range(3):
                total += (lean[:, :, axis, channel] @ light[:, 1 + axis]) * scale[channel]
            out[start : start + len(pixels), channel] = total
    return out


def _middle_of(head: HeadMesh, parts: dict[str, Any]) -> NDArray[np.float64]:
    """Return the point of the head's scene above the spot at the probe's height."""
    placed = np.asarray(parts["skin"].v) - [0, EYE_HEIGHT, 0]
    middle = np.median(head.skin.vertices - placed / METRES, axis=0)
    if np.abs(head.skin.vertices - placed / METRES - middle).max() > 1e-3:
        raise ValueError("the place's head is not the baked one")
    return np.asarray(middle, float)


def _gather(values: NDArray[Any], index: Any) -> Any:
    flat = mi.Float(np.ascontiguousarray(values, np.float32).ravel())
    return dr.gather(mi.Vector3f, flat, index)


def _turned(matrix: NDArray[np.float64], v: Any) -> Any:
    rows = [[float(x) for x in row] for row in matrix]
    return mi.Vector3f(*[row[0] * v.x + row[1] * v.y + row[2] * v.z for row in rows])
