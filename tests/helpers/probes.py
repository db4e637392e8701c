"""Merged panoramas with known lamps, for tests of the light probe."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from app.core.base.sphere import direction, directions_at
from app.core.measure.read.frame import MergedLight

Float32 = NDArray[np.float32]


def away_deg(shape: tuple[int, int], azimuth_deg: float, elevation_deg: float) -> Float32:
    """(H, W) angle of every texel from a direction, deg."""
    every = directions_at(shape, np.arange(shape[0] * shape[1]))
    cosine = np.clip(every @ direction(azimuth_deg, elevation_deg), -1.0, 1.0)
    return np.degrees(np.arccos(cosine)).reshape(shape).astype(np.float32)


def place(
    lamps: list[tuple[float, float, float, float]],
    shape: tuple[int, int] = (256, 512),
    fill: float = 0.1,
) -> Float32:
    """(H, W, 3) grey light: round lamps (azimuth, elevation, diameter, radiance) over a fill."""
    radiance = np.full(shape, fill, np.float32)
    for azimuth, elevation, diameter, value in lamps:
        radiance[away_deg(shape, azimuth, elevation) <= diameter / 2.0] = value
    return np.repeat(radiance[..., None], 3, axis=2)


def clip(radiance: Float32, level: float = math.inf, cd_m2: float | None = None) -> MergedLight:
    """What a perfect merge holds of a scene whose darkest frame clips at a level."""
    lost = (radiance.max(axis=2) >= level).astype(np.float32)
    return MergedLight(
        radiance=np.minimum(radiance, np.float32(level)),
        clipped=lost,
        dark=np.zeros_like(lost),
        reference_ev=0.0,
        clip_level=level if math.isfinite(level) else float(radiance.max()) * 2.0,
        cd_m2=cd_m2,
    )


def sunny_place(
    elevation_deg: float = 40.0,
    azimuth_deg: float = 60.0,
    lux: float = 90_000.0,
    shape: tuple[int, int] = (512, 1024),
) -> Float32:
    """(H, W, 3) luminance, cd/m2, of an open place: blue sky with aureole, sun, lit ground."""
    away = away_deg(shape, azimuth_deg, elevation_deg)
    sky = 3_000.0 + 60_000.0 * np.exp(-away / 4.0) + 9_000.0 * np.exp(-away / 15.0)
    up = np.arange(shape[0])[:, None] < shape[0] // 2
    ground = 0.2 * (lux * math.sin(math.radians(elevation_deg)) + 15_000.0) / math.pi
    light = np.where(up, sky, ground)
    disc = away <= 0.4
    areas = (math.pi / shape[0]) ** 2 * math.cos(math.radians(elevation_deg))
    light[disc] = lux / (np.count_nonzero(disc) * areas)
    return np.repeat(light.astype(np.float32)[..., None], 3, axis=2)
