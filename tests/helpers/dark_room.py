"""Dark rooms with a lamp in them, whose mask is known exactly, and brackets of them.

The room is not one grey: walls of different brightness, light under a door, the lamp's bounce on
the wall that it faces, mirror images of it and highlights.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from app.core.base.sphere import directions, rotation
from app.core.environment.environment import reduce_radiance
from app.core.measure.read.frame import Exposure
from app.devices.simulated.cameras import GENERIC, CameraModel
from benchmarks.light.shots.brackets import write_bracket

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
Form = Literal["box", "disc", "ring", "softbox", "leds", "dish"]


@dataclass(frozen=True)
class Lamp:
    """A flat lamp that faces the probe.

    `half` are half of its width and height over its distance (tangents); `roll_deg` its tilt.
    """

    form: Form
    half: tuple[float, float]
    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    roll_deg: float = 0.0
    level: float = 1000.0  # cd/m2
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


def phone(distance_m: float, azimuth_deg: float = 0.0, elevation_deg: float = 0.0) -> Lamp:
    half = (0.035 / distance_m, 0.075 / distance_m)
    return Lamp("box", half, azimuth_deg, elevation_deg, level=600.0)


def coverage(lamp: Lamp, shape: tuple[int, int]) -> tuple[Bool, Float32]:
    """Where the lamp is, (H, W), and its luminance over its own level there."""
    matrix = rotation(lamp.azimuth_deg, lamp.elevation_deg, lamp.roll_deg)
    local = directions(shape) @ matrix.astype(np.float32)
    ahead = np.maximum(local[..., 2], 1e-3)
    x, y = local[..., 0] / ahead / lamp.half[0], local[..., 1] / ahead / lamp.half[1]
    radius = np.hypot(x, y)
    front = local[..., 2] > 1e-3
    flat = np.ones(shape, np.float32)
    square = front & (np.abs(x) < 1) & (np.abs(y) < 1)
    if lamp.form == "box":
        return square, flat
    if lamp.form == "disc":
        return front & (radius < 1), flat
    if lamp.form == "ring":
        return front & (radius < 1) & (radius > 0.7), flat
    if lamp.form == "softbox":  # a hot middle, edges at a third
        return square, np.exp(-1.1 * np.minimum(radius, 1.4) ** 2 / 2).astype(np.float32)
    if lamp.form == "dish":  # a bulb, and the dish around it
        return front & (radius < 1), np.where(radius < 0.25, 1.0, 0.35).astype(np.float32)
    bulbs = (np.abs((x * 8) % 2 - 1) < 0.6) & (np.abs((y * 8) % 2 - 1) < 0.6)
    return square, np.where(bulbs, 1.0, 0.45).astype(np.float32)


def room(
    lamp: Lamp,
    share: float,
    *,
    shape: tuple[int, int] = (512, 1024),
    reflections: bool = True,
    seed: int = 0,
    finer: int = 2,
) -> tuple[Float32, Bool]:
    """Light of the room, (H, W, 3) cd/m2, and where the lamp is, (H, W).

    The room's mean radiance is `share` of the lamp's mean. Drawn `finer` times as fine; with an
    odd number no texel is lamp by exactly half.
    """
    fine = (finer * shape[0], finer * shape[1])
    mask, pattern = coverage(lamp, fine)
    mean = lamp.level * float(pattern[mask].mean())
    random = np.random.default_rng(seed)
    rays = directions(fine)
    walls = np.full(fine, 1.0, np.float32)
    for _ in range(6):
        axis = random.standard_normal(3)
        axis /= np.linalg.norm(axis)
        walls += np.float32(random.uniform(0.1, 0.5)) * (rays @ axis.astype(np.float32) > 0.3)
    walls *= np.float32(share * mean / walls.mean())
    light = walls[..., None] * np.array([1.05, 1.0, 0.9], np.float32)
    if reflections:
        light += _reflected(lamp, fine, mean, random)[..., None]
    light[mask] = lamp.level * pattern[mask][:, None] * np.array(lamp.colour, np.float32)
    truth = reduce_radiance(mask[..., None].astype(np.float32), shape)[..., 0] > 0.5
    return reduce_radiance(light, shape), truth


def _reflected(
    lamp: Lamp, shape: tuple[int, int], mean: float, random: np.random.Generator
) -> Float32:
    light = np.zeros(shape, np.float32)
    # In a mirror on the other side: smaller, nearly as bright; in a window: a tenth.
    for strength, size, turn in ((0.8, 0.5, 130.0), (0.1, 0.6, -80.0)):
        half = (lamp.half[0] * size, lamp.half[1] * size)
        image = Lamp(lamp.form, half, lamp.azimuth_deg + turn, -0.5 * lamp.elevation_deg)
        where, pattern = coverage(image, shape)
        light[where] = strength * mean * pattern[where]
    rays = directions(shape)
    # Highlights on knobs and glasses; one glossy table under the lamp.
    for _ in range(12):
        axis = random.standard_normal(3)
        axis /= np.linalg.norm(axis)
        spot = rays @ axis.astype(np.float32) > np.cos(np.radians(random.uniform(0.2, 0.6)))
        light[spot] = mean * random.uniform(0.3, 1.2)
    down = np.degrees(np.arctan(lamp.half[1]))
    table = Lamp(lamp.form, lamp.half, lamp.azimuth_deg, lamp.elevation_deg - 2.0 * down - 2.0)
    if table.elevation_deg > -85.0:
        where, pattern = coverage(table, shape)
        light[where] = 0.3 * mean * pattern[where]
    # What the lamp gives the wall that it faces.
    facing = -rotation(lamp.azimuth_deg, lamp.elevation_deg)[:, 2].astype(np.float32)
    light += np.float32(0.03 * mean) * np.maximum(rays @ facing, 0.0) ** 2
    return light


def bracket(
    folder: Path,
    light: Float32,
    brightest: float,
    *,
    camera: CameraModel = GENERIC,
    stops: tuple[float, ...] = (4.0, 2.0, 0.0, -2.0),
    iso: float | None = None,
    seed: int = 0,
    **options: Any,
) -> list[Path]:
    """Write a bracket in whose darkest frame `brightest` cd/m2 are well below saturation."""
    aperture, sensitivity = min(camera.apertures), iso or camera.base_iso
    # Saturation 1.2 / factor at twice the brightest, for stop 0.
    shutter = 1.2 / (2.0 * brightest) * aperture**2 / (sensitivity / 100.0)
    exposures = [Exposure(shutter * 2.0**stop, sensitivity, aperture) for stop in stops]
    return write_bracket(folder, light, camera, exposures, seed=seed, **options)


def overlap(found: Float32, truth: Bool) -> float:
    """Intersection over union by solid angle."""
    hard = found >= 0.5
    rows = np.cos(np.pi * (0.5 - (np.arange(len(truth)) + 0.5) / len(truth)))[:, None]
    both, either = ((hard & truth) * rows).sum(), ((hard | truth) * rows).sum()
    return float(both / either)


__all__ = ["Lamp", "bracket", "coverage", "overlap", "phone", "room"]
