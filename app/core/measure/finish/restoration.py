"""Restore the light of a clipped sun, or of a lamp measured with a light meter.

The position of a clipped sun survives in the panorama. Its solid angle is known, and its
illuminance is known to within a factor, so the disc is redrawn (after Debevec, "Rendering synthetic
objects into real scenes", 1998, and Stumpfel et al., "Direct HDR capture of the sun and sky", 2004,
who measured the sun instead).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from app.core.base.arrays import Float64, Int64
from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.sphere import direction, directions_at
from app.core.environment.environment import reduce_radiance, solid_angles
from app.core.measure.finish.lamp_detection import Light, LightGrid, upsampled
from app.core.measure.finish.remarks import LampMetered, SunRestored
from app.core.measure.finish.sun import Core, find_sun, sun_core
from app.core.measure.finish.sunlight import (
    SPREAD,
    SUN_DIAMETER_DEG,
    SkyWord,
    direct_normal_lux,
    sun_colour,
)
from app.core.measure.read.frame import MergedLight
from app.core.text import tr

_APERTURE_DEG: Final = 2.5  # half-angle of a pyrheliometer, which defines direct sunlight


@dataclass(frozen=True, slots=True)
class Restoration:
    """A restored light.

    Attributes:
        light: ID of the light, or None if nothing was restored.
        illuminance_lux, range_lux: The new illuminance and its likely range, respectively, in lux.
        disc: (N, 2) float64. Flat indices of the changed texels, and the luminance added to each of
            them.
        held_lux: Illuminance before the restoration, in lux.
    """

    merged: MergedLight = field(repr=False)
    light: str | None
    illuminance_lux: float
    range_lux: tuple[float, float]
    remark: SunRestored | LampMetered | None
    disc: Float64 = field(repr=False)
    held_lux: float


def restore(
    merged: MergedLight,
    lights: Sequence[Light],
    sky: SkyWord | Literal["leave"],
    grid: LightGrid | None = None,
) -> Restoration:
    """Restore the sun's light if one of the lights is the sun.

    The disc is drawn at the centre of the clipped area, with a solid angle of 6.8e-5 sr. All light
    within 2.5 degrees of it (the aperture of a pyrheliometer: WMO-No. 8, 2018, I.7.2.1) then sums
    to the model's direct illuminance. The glow around the disc is never reduced.
    """
    sun = find_sun(merged, lights, grid) if sky != "leave" else None
    if sun is None or sky == "leave":
        return Restoration(merged, None, 0.0, (0.0, 0.0), None, np.zeros((0, 2)), 0.0)
    core = sun_core(sun, merged)
    lux = direct_normal_lux(core.elevation_deg, sky)
    low, high = SPREAD[0] * lux, SPREAD[1] * lux
    remark = SunRestored(sun.id, core.elevation_deg, sky, lux, low, high)
    target = _SunTarget(lux, (low, high), sun_colour(core.elevation_deg, sky))
    sunlight, energy = _draw_sun(merged, core, target)
    return _restoration(merged, sun, target, sunlight, energy, remark)


def set_illuminance(merged: MergedLight, light: Light, lux: float) -> Restoration:
    """Scale a lamp to the illuminance that a light meter measured.

    Only the lamp's clipped texels are scaled, or all of its texels if none is clipped. Colours stay
    the same.

    Raises:
        ProbeError: If `lux` is not a positive number, absolute luminance is unknown, or the lamp's
            illuminance is already higher.
    """
    if not (math.isfinite(lux) and lux > 0):
        raise ProbeError(
            tr("The illuminance of lamp {id} must be a positive number of lux.", id=light.id)
        )
    if merged.cd_m2 is None:
        raise ProbeError(
            tr("A measured illuminance needs frames that record shutter, ISO and aperture."),
            tr("Set a gain in stops for the lamp instead."),
        )
    texels, weights = _texels_of(light, merged)
    height, width = merged.clipped.shape
    areas = solid_angles((height, width))[texels // width]
    light_of = luminance(merged.radiance.reshape(-1, 3)[texels]).astype(np.float64)
    facing = directions_at((height, width), texels) @ direction(
        light.azimuth_deg, light.elevation_deg
    )
    part = light_of * areas * np.maximum(facing, 0.0) * merged.cd_m2
    energy, changeable = float(part.sum()), float((part * weights).sum())
    gain = 1.0 + (lux - energy) / changeable
    if gain <= 0 or lux < 0.5 * energy:
        raise ProbeError(
            tr(
                "Lamp {id} provides at least {held:.0f} lux in these frames, more than the "
                "{lux:.0f} you entered.",
                id=light.id,
                held=energy,
                lux=lux,
            ),
            tr("Hold the light meter where the camera was, facing the lamp."),
        )
    extra_light = np.stack([texels, light_of * weights * (gain - 1.0)], axis=1)
    near = (0.9 * lux, 1.1 * lux)
    return _restoration(
        merged,
        light,
        _SunTarget(lux, near, None),
        extra_light,
        energy,
        LampMetered(light.id, lux, energy),
    )


def added_light(restoration: Restoration, shape: tuple[int, int]) -> Float64:
    """Return the added luminance, reduced to `shape`, in the panorama's unit."""
    size = restoration.merged.clipped.shape
    lone = np.zeros((size[0], size[1], 1), np.float32)
    lone.reshape(-1)[restoration.disc[:, 0].astype(np.int64)] = restoration.disc[:, 1]
    return reduce_radiance(lone, shape)[..., 0].astype(np.float64)


@dataclass(frozen=True, slots=True)
class _SunTarget:
    """Illuminance of a restored light, its range and its colour, or None for the texels' own."""

    lux: float
    near: tuple[float, float]
    colour: Float64 | None


def _draw_sun(merged: MergedLight, core: Core, target: _SunTarget) -> tuple[Float64, float]:
    """Return the disc's texels with the luminance to add, (N, 2), and the previous illuminance."""
    assert merged.cd_m2 is not None
    height, width = merged.clipped.shape
    texels, share = _disc((height, width), core)
    near, _ = _disc((height, width), core, 2.0 * _APERTURE_DEG)
    areas = solid_angles((height, width))
    energy = luminance(merged.radiance.reshape(-1, 3)[near]) * areas[near // width]
    lux = float(energy.sum(dtype=np.float64)) * merged.cd_m2
    missing = max(target.lux - lux, 0.0) / merged.cd_m2
    return np.stack([texels, missing * share / areas[texels // width]], axis=1), lux


def _restoration(
    merged: MergedLight,
    light: Light,
    target: _SunTarget,
    extra_light: Float64,
    energy: float,
    remark: SunRestored | LampMetered,
) -> Restoration:
    """Add luminance to a light's texels, after which the light no longer counts as clipped."""
    radiance, clipped = merged.radiance.copy(), merged.clipped.copy()
    flat, texels = radiance.reshape(-1, 3), extra_light[:, 0].astype(np.int64)
    if target.colour is None:
        before = np.maximum(luminance(flat[texels]), 1e-30)[:, None]
        flat[texels] += flat[texels] / before * extra_light[:, 1:].astype(np.float32)
    else:
        flat[texels] += (extra_light[:, 1:] * target.colour).astype(np.float32)
    lamp_texels, _ = _texels_of(light, merged)
    clipped.reshape(-1)[lamp_texels] = 0.0
    result = replace(merged, radiance=radiance, clipped=clipped)
    return Restoration(result, light.id, target.lux, target.near, remark, extra_light, energy)


def _texels_of(light: Light, merged: MergedLight) -> tuple[Int64, Float64]:
    """Return a light's texels in the panorama and the fraction of each that may be brightened."""
    mask = upsampled(light, merged.clipped.shape)
    if light.clipped:
        mask &= merged.clipped > 0
    texels = np.flatnonzero(mask)
    weights = merged.clipped.reshape(-1)[texels] if light.clipped else np.ones(len(texels))
    return texels, weights.astype(np.float64)


def _disc(
    shape: tuple[int, int], core: Core, diameter_deg: float = SUN_DIAMETER_DEG
) -> tuple[Int64, Float64]:
    """Return the texels that a disc covers and each texel's fraction of the disc, summing to 1."""
    height, width = shape
    fine = max(1, round(32 * SUN_DIAMETER_DEG / diameter_deg))
    step = 180.0 / height
    reach = diameter_deg / 2.0
    rows = np.arange(
        max(math.floor((90.0 - core.elevation_deg - reach) / step), 0),
        min(math.ceil((90.0 - core.elevation_deg + reach) / step), height),
    )
    least = math.cos(math.radians(min(abs(core.elevation_deg) + reach, 89.9)))
    half = min(math.ceil(reach / step / least) + 1, width // 2)
    middle = math.floor((core.azimuth_deg / 360.0 + 0.5) * width)
    columns = np.arange(middle - half, middle + half + (half < width // 2))
    parts = (np.arange(fine) + 0.5) / fine
    elevation = np.radians(90.0 - step * (rows[:, None] + parts).ravel())
    azimuth = np.radians(360.0 * ((columns[:, None] + parts).ravel() / width - 0.5))
    sun_up, sun_at = math.radians(core.elevation_deg), math.radians(core.azimuth_deg)
    cosine = math.sin(sun_up) * np.sin(elevation)[:, None] + math.cos(sun_up) * np.outer(
        np.cos(elevation), np.cos(azimuth - sun_at)
    )
    inside = (cosine >= math.cos(math.radians(reach))) * np.cos(elevation)[:, None]
    coverage = inside.reshape(len(rows), fine, len(columns), fine).sum(axis=(1, 3))
    row, column = np.nonzero(coverage)
    share = coverage[row, column]
    return rows[row] * width + columns[column] % width, share / share.sum()
