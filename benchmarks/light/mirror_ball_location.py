"""A chrome ball in the modelled location: near walls, lamps, sun, and a person with a camera.

The ball's geometry is computed with numpy; its rays are traced by `scenes/demo_location`. Dirt on
it is lit by the place's panorama.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import mitsuba as mi  # noqa: TID253 - a module that only a rendering process imports
import numpy as np
from numpy.typing import NDArray

from app.core.base.sphere import directions
from app.core.environment.environment import reduce_radiance, solid_angles
from benchmarks.light.mirror_ball_scene import BALL_M, Shot, dirt
from scenes.demo_location.assemble import World, build_place
from scenes.demo_location.frame import CAFE, EYE_HEIGHT, SPOTS, to_world
from scenes.demo_location.tracer import first_hit, radiance

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
NAMES = {spot.name: spot for spot in (*SPOTS, CAFE)}
CHROME = np.array([0.688, 0.649, 0.687])  # Mitsuba's "Cr", at normal incidence
_ALBEDO = np.array([0.25, 0.2, 0.15])
_SAMPLES = 64
_CHUNK = 1 << 20
# A person in dark clothes behind the lens, metres: half the width, and the range of heights.
_PERSON = ((0.11, -0.11, 0.11), (0.25, -1.6, -0.2))
_CLOTHES = 0.04


class Location:
    """The place, built once."""

    def __init__(self) -> None:
        self.world = World(build_place(), None)
        self.sampler = mi.load_dict({"type": "independent"})

    def render(self, name: str, panorama: Float32, shot: Shot, seed: int) -> Float32:
        """Return the linear picture, (rows, columns, 3), cd/m2."""
        spot = NAMES[name]
        at = to_world(spot.building[0], EYE_HEIGHT, spot.building[1])
        rows, columns = shot.size
        picture = self._background(panorama, at, shot).reshape(-1, 3)
        y, x = (each.ravel() for each in np.mgrid[:rows, :columns])
        column, row, radius = shot.outline_px
        places = np.flatnonzero(np.hypot(x + 0.5 - column, y + 0.5 - row) < radius + 1.0)
        picture[places] = 0.0
        dirty = dirt(seed)[..., None], _matt(panorama)
        random = np.random.default_rng(seed)
        for number in range(_SAMPLES):
            for start in range(0, len(places), _CHUNK):
                some = places[start : start + _CHUNK]
                own = 64 * number + start // _CHUNK + 100_000 * seed
                light = self._light(at, shot, (x[some], y[some]), dirty, random, own)
                picture[some] += (light / _SAMPLES).astype(np.float32)
        return picture.reshape(rows, columns, 3)

    def _background(self, panorama: Float32, at: Float64, shot: Shot) -> Float32:
        """Return the background behind the ball, as the lens sees it."""
        rows, columns = shot.size
        y, x = (each.ravel() + 0.5 for each in np.mgrid[:rows, :columns])
        turn = _about_up(shot.azimuth_deg)
        lens, ray = shot.lens, shot.rays(x, y) @ turn.T
        origin = np.broadcast_to(at + turn @ lens, ray.shape)
        far, _, _ = first_hit(self.world.surfaces, _rays(origin, ray))
        met = np.array(far, np.float64)[:, None]
        toward = np.where(met > 0.0, turn @ lens + met * ray, ray)
        toward /= np.linalg.norm(toward, axis=1, keepdims=True)
        height, width = panorama.shape[:2]
        across = (np.arctan2(-toward[:, 0], toward[:, 2]) / (2 * np.pi) + 0.5) * width - 0.5
        down = np.arccos(np.clip(toward[:, 1], -1, 1)) / np.pi * height - 0.5
        x, y = (each.reshape(rows, columns).astype(np.float32) for each in (across, down))
        shown = cv2.remap(panorama, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        return np.asarray(shown, np.float32)

    def _light(
        self,
        at: Float64,
        shot: Shot,
        pixels: tuple[Any, Any],
        dirty: tuple[Float32, Float32],
        random: np.random.Generator,
        seed: int,
    ) -> Float64:
        """Return one sample of some pixels."""
        turn = _about_up(shot.azimuth_deg)
        jitter = random.random((2, len(pixels[0])))
        lens, ray = shot.lens, shot.rays(pixels[0] + jitter[0], pixels[1] + jitter[1])
        start = np.broadcast_to(lens, ray.shape).copy()
        weight = np.ones_like(ray)
        along = -(ray @ lens)
        inside = along**2 - (lens @ lens - BALL_M**2)
        hit = (inside > 0) & (along > 0)
        met = lens + ray[hit] * (along[hit] - np.sqrt(inside[hit]))[:, None]
        normal = met / BALL_M
        mirrored = ray[hit] - 2 * (ray[hit] * normal).sum(1, keepdims=True) * normal
        ray[hit], weight[hit], start[hit] = mirrored, CHROME, met + 1e-4 * normal
        light = self._traced(at + start @ turn.T, ray @ turn.T, seed)
        specks, matt = (_toward(normal @ turn.T, each) for each in dirty)
        dark = hit & _meets_person(start, ray, lens)
        light[dark] = _CLOTHES * float(light[hit].mean()) if dark.any() else 0.0
        light *= weight
        light[hit] = np.where(specks > 0, _ALBEDO * matt, light[hit])
        return np.asarray(light)

    def _traced(self, start: Float64, ray: Float64, seed: int) -> Float64:
        self.sampler.seed(seed, len(ray))
        rays = _rays(start, ray)
        light: Float64 = np.array(radiance(self.world.tables, self.sampler, rays), np.float64)
        return np.asarray(light.T if light.shape[0] == 3 else light)


def _toward(vectors: Float64, panorama: Float32) -> Float32:
    """Return a panorama's texels, (N, channels), in directions (N, 3)."""
    rows, columns = panorama.shape[:2]
    i = np.arccos(np.clip(vectors[:, 1], -1, 1)) / np.pi * rows
    j = (np.arctan2(-vectors[:, 0], vectors[:, 2]) / (2 * np.pi) + 0.5) * columns
    return np.asarray(
        panorama[np.minimum(i.astype(int), rows - 1), j.astype(int) % columns], np.float32
    )


def _matt(panorama: Float32) -> Float32:
    """Return the light of a white matt ball by its normals, (64, 128, 3)."""
    small = reduce_radiance(panorama, (64, 128)).reshape(-1, 3)
    ways = directions((64, 128)).reshape(-1, 3)
    areas = np.repeat(solid_angles((64, 128)), 128)[:, None].astype(np.float32)
    lit = np.maximum(ways @ ways.T, 0.0) @ (areas * small) / np.float32(np.pi)
    return np.asarray(lit.reshape(64, 128, 3), np.float32)


def _rays(start: Float64, ray: Float64) -> Any:
    origin, way = (np.ascontiguousarray(each.T, np.float32) for each in (start, ray))
    return mi.Ray3f(mi.Point3f(origin), mi.Vector3f(way))


def _about_up(azimuth_deg: float) -> Float64:
    """Return the rotation from +Z to an azimuth."""
    a = math.radians(azimuth_deg)
    return np.array([[math.cos(a), 0, -math.sin(a)], [0, 1, 0], [math.sin(a), 0, math.cos(a)]])


def _meets_person(start: Float64, ray: Float64, lens: Float64) -> NDArray[np.bool_]:
    """Return whether rays of the ball hit the person who is 12 cm behind the lens."""
    far = (lens[2] + 0.12 - start[:, 2]) / np.where(ray[:, 2] > 1e-6, ray[:, 2], np.inf)
    x, y = (start[:, k] + far * ray[:, k] - (lens[1] if k == 1 else 0.0) for k in (0, 1))
    met = np.zeros(len(ray), bool)
    for half, low, high in _PERSON:
        met |= (np.abs(x) < half) & (y > low) & (y < high)
    return met & (ray[:, 2] > 1e-6)
