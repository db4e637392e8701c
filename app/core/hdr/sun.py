"""The sun, which no exposure holds: recognising it, and putting its light back.

Even the shortest exposure of a 360 camera leaves the disc 10 to 16 stops clipped; what is left
is under a hundredth of its light. Its place survives, its solid angle and (within a factor) its
illuminance are known: so the disc is drawn anew (after Debevec, "Rendering synthetic objects
into real scenes", 1998, and Stumpfel et al., "Direct HDR capture of the sun and sky", 2004, who
measure it instead). A lamp whose illuminance was measured with a light meter goes the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.sphere import direction, directions_at
from app.core.hdr.lights import upsampled
from app.core.hdr.sky import (
    SPREAD,
    SUN_DIAMETER_DEG,
    SkyWord,
    direct_normal_lux,
    sun_colour,
)
from app.core.hdr.sun_finder import Core, find_sun, is_sun, sun_core
from app.core.solver.environment import reduce_radiance, solid_angles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Float64, Int64
    from app.core.hdr.frame import Merged
    from app.core.hdr.lights import Light, LightGrid

__all__ = [
    "Core",
    "Restoration",
    "added_light",
    "find_sun",
    "is_sun",
    "restore",
    "set_illuminance",
    "sun_core",
]


_APERTURE_DEG: Final = 2.5  # half-angle of a pyrheliometer: what counts as direct sunlight


@dataclass(frozen=True, slots=True)
class Restoration:
    """A light put back, and what was done; `light` is its id, None where nothing was.

    `disc`, (N, 2) float64, has flat indices of the texels that were given light, and how much
    luminance each.
    """

    merged: Merged = field(repr=False)
    light: str | None
    illuminance_lux: float
    range_lux: tuple[float, float]
    sentence: str
    disc: Float64 = field(repr=False)
    held_lux: float


def restore(
    merged: Merged,
    lights: Sequence[Light],
    sky: SkyWord | Literal["leave"],
    grid: LightGrid | None = None,
) -> Restoration:
    """Put the sun's light back, if one of the lights is the sun.

    The disc lies at the centre of what is clipped, with a solid angle of 6.8e-5 sr. What lies
    within 2.5 deg of it (the aperture of a pyrheliometer: WMO-No. 8, 2018, I.7.2.1) sums to the
    model's direct illuminance; nothing is taken away from the glow around.
    """
    sun = find_sun(merged, lights, grid) if sky != "leave" else None
    if sun is None or sky == "leave":
        reason = "The sun was left as it is." if sky == "leave" else "No clipped sun was found."
        return _nothing(merged, reason)
    core = sun_core(sun, merged)
    lux = direct_normal_lux(core.elevation_deg, sky)
    low, high = SPREAD[0] * lux, SPREAD[1] * lux
    under = {"clear": "a clear sky", "hazy": "haze", "thin cloud": "thin cloud"}[sky]
    sentence = (
        f"The sun (lamp {sun.id}, {core.elevation_deg:.0f}° high) is clipped in every frame. "
        f"It was given the {_klx(lux)} klx that it has at that height under {under} "
        f"(IES RP-21); {_klx(low)} to {_klx(high)} klx are likely."
    )
    wanted = _Wanted(lux, (low, high), sun_colour(core.elevation_deg, sky))
    added, held = _draw_sun(merged, core, wanted)
    return _restored(merged, sun, wanted, added, held, sentence)


def set_illuminance(merged: Merged, light: Light, lux: float) -> Restoration:
    """Give a lamp the illuminance in lux that a light meter measured.

    What is clipped of the lamp (or all of it, where nothing is) sums to that illuminance; its
    colour is that of its texels. ProbeError if `lux` is not a positive number, absolute
    luminance is not known, or the lamp already holds more.
    """
    if not (math.isfinite(lux) and lux > 0):
        raise ProbeError(f"The illuminance of lamp {light.id} must be a positive number of lux.")
    if merged.cd_m2 is None:
        raise ProbeError(
            "A measured illuminance needs frames with shutter, ISO and aperture.",
            "Give the lamp a gain in stops instead.",
        )
    texels, weights = _texels_of(light, merged)
    height, width = merged.clipped.shape
    areas = solid_angles((height, width))[texels // width]
    light_of = luminance(merged.radiance.reshape(-1, 3)[texels]).astype(np.float64)
    facing = directions_at((height, width), texels) @ direction(
        light.azimuth_deg, light.elevation_deg
    )
    part = light_of * areas * np.maximum(facing, 0.0) * merged.cd_m2
    held, changeable = float(part.sum()), float((part * weights).sum())
    gain = 1.0 + (lux - held) / changeable
    if gain <= 0 or lux < 0.5 * held:
        raise ProbeError(
            f"Lamp {light.id} gives at least {held:.0f} lux in these frames, not {lux:.0f}.",
            "Hold the meter where the camera stood, facing the lamp.",
        )
    sentence = f"Lamp {light.id} was given the {lux:.0f} lux measured; the frames hold {held:.0f}."
    added = np.stack([texels, light_of * weights * (gain - 1.0)], axis=1)
    near = (0.9 * lux, 1.1 * lux)
    return _restored(merged, light, _Wanted(lux, near, None), added, held, sentence)


def added_light(restoration: Restoration, shape: tuple[int, int]) -> Float64:
    """Reduce what a restoration added: luminance, (rows, columns), in the panorama's unit."""
    size = restoration.merged.clipped.shape
    lone = np.zeros((size[0], size[1], 1), np.float32)
    lone.reshape(-1)[restoration.disc[:, 0].astype(np.int64)] = restoration.disc[:, 1]
    return reduce_radiance(lone, shape)[..., 0].astype(np.float64)


def _nothing(merged: Merged, sentence: str) -> Restoration:
    return Restoration(merged, None, 0.0, (0.0, 0.0), sentence, np.zeros((0, 2)), 0.0)


@dataclass(frozen=True, slots=True)
class _Wanted:
    """Illuminance to be reached, its range, and its colour (None: of the texels)."""

    lux: float
    near: tuple[float, float]
    colour: Float64 | None


def _draw_sun(merged: Merged, core: Core, wanted: _Wanted) -> tuple[Float64, float]:
    """Return the disc's texels with the luminance to be added, and the lux already there."""
    assert merged.cd_m2 is not None
    height, width = merged.clipped.shape
    texels, share = _disc((height, width), core)
    near, _ = _disc((height, width), core, 2.0 * _APERTURE_DEG)
    areas = solid_angles((height, width))
    held = luminance(merged.radiance.reshape(-1, 3)[near]) * areas[near // width]
    lux = float(held.sum(dtype=np.float64)) * merged.cd_m2
    missing = max(wanted.lux - lux, 0.0) / merged.cd_m2
    return np.stack([texels, missing * share / areas[texels // width]], axis=1), lux


def _restored(
    merged: Merged, light: Light, wanted: _Wanted, added: Float64, held: float, sentence: str
) -> Restoration:
    """Add luminance to texels; what is clipped of the light counts as known from now on."""
    radiance, clipped = merged.radiance.copy(), merged.clipped.copy()
    flat, texels = radiance.reshape(-1, 3), added[:, 0].astype(np.int64)
    if wanted.colour is None:
        before = np.maximum(luminance(flat[texels]), 1e-30)[:, None]
        flat[texels] += flat[texels] / before * added[:, 1:].astype(np.float32)
    else:
        flat[texels] += (added[:, 1:] * wanted.colour).astype(np.float32)
    known, _ = _texels_of(light, merged)
    clipped.reshape(-1)[known] = 0.0
    done = replace(merged, radiance=radiance, clipped=clipped)
    return Restoration(done, light.id, wanted.lux, wanted.near, sentence, added, held)


def _texels_of(light: Light, merged: Merged) -> tuple[Int64, Float64]:
    """Return a light's texels on the panorama, and how much of each may be brightened."""
    mask = upsampled(light, merged.clipped.shape)
    if light.clipped:
        mask &= merged.clipped > 0
    texels = np.flatnonzero(mask)
    weights = merged.clipped.reshape(-1)[texels] if light.clipped else np.ones(len(texels))
    return texels, weights.astype(np.float64)


def _disc(
    shape: tuple[int, int], core: Core, diameter_deg: float = SUN_DIAMETER_DEG
) -> tuple[Int64, Float64]:
    """Texels that a disc covers, and the share of the disc in each (sum 1)."""
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
    covered = inside.reshape(len(rows), fine, len(columns), fine).sum(axis=(1, 3))
    row, column = np.nonzero(covered)
    share = covered[row, column]
    return rows[row] * width + columns[column] % width, share / share.sum()


def _klx(lux: float) -> str:
    return f"{lux / 1000.0:.0f}" if lux >= 10_000 else f"{lux / 1000.0:.2g}"
