"""Recognise a clipped sun and restore its light.

Even the shortest exposure of a 360 camera leaves the disc 10 to 16 stops clipped; what is left is
under a hundredth of its light. Its place survives, its solid angle and (within a factor) its
illuminance are known: so the disc is drawn again (after Debevec, "Rendering synthetic objects into
real scenes", 1998, and Stumpfel et al., "Direct HDR capture of the sun and sky", 2004, who measure
it instead). A lamp whose illuminance was measured with a light meter goes the same way.

The sun is recognised by absolute luminance and by what surrounds it. The rules are strict: a sun
that is not recognised costs some accuracy, a lamp taken for the sun spoils the place.

Illuminance: IES Calculation Procedures Committee, "Recommended practice for the calculation of
daylight availability" (RP-21), Journal of the IES 13(4), 1984, 381-392: the direct normal
illuminance is E = 127.5 klx exp(-c m), with extinction c = 0.21 for a clear and 0.80 for a partly
cloudy sky. There m = 1 / sin(elevation), which has no end at the horizon; here the relative optical
air mass is that of Kasten and Young, "Revised optical air mass tables and approximation formula",
Applied Optics 28(22), 1989, 4735-4738, which agrees with it within 1 % above 20 deg. Haze: Navvab,
Karayel, Ne'eman and Selkowitz, "Analysis of atmospheric turbidity for daylight calculations",
Energy and Buildings 6, 1984, 293-303: E = E0 exp(-a m T) with a = 0.1 / (1 + 0.0045 m) and an
illuminance turbidity T; about 2.5 in the country and 5 in industrial air (Tregenza and Sharples,
Daylight Algorithms, 1993, algorithm 1.21). T = 5 gives the c = 0.50 that stands for hazy here, and
T = 2.1 the 0.21 of the clear sky. The model is a mean over many days: single readings spread over a
factor of about 0.6 to 1.6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Float64, Indices, Int64
from app.core.base.colour import LUMINANCE_WEIGHTS, luminance
from app.core.base.errors import ProbeError
from app.core.base.sphere import direction, directions_at
from app.core.environment.environment import reduce_radiance, solid_angles
from app.core.measure.finish.lights import Light, LightGrid, light_grid, spread_of, upsampled
from app.core.measure.finish.remarks import LampMetered, SunRestored
from app.core.measure.read.frame import MergedLight
from app.core.text import tr

SkyWord: TypeAlias = Literal["clear", "hazy", "thin cloud"]

SPREAD: Final = (0.6, 1.6)
"""Factors between which the true illuminance lies around the model's, as a rule."""

SUN_SOLID_ANGLE_SR: Final = 6.8e-5
"""Solid angle of the sun's disc at its mean distance, sr (angular radius 0.00465 rad)."""

SUN_DIAMETER_DEG: Final = math.degrees(2.0 * math.sqrt(SUN_SOLID_ANGLE_SR / math.pi))
"""Diameter of that disc, deg."""

_SOLAR_CONSTANT_LUX: Final = 127_500.0
_EXTINCTION: Final[dict[SkyWord, float]] = {"clear": 0.21, "hazy": 0.50, "thin cloud": 0.80}

# Wavelengths (micrometre) that stand for the Rec. 709 primaries in the colour of sunlight.
_WAVELENGTHS: Final = (0.611, 0.549, 0.464)
_WHITE_AIR_MASS: Final = 1.5  # sunlight that a daylight white balance shows as white
_REDDEST_AIR_MASS: Final = 8.0  # beyond, three wavelengths say nothing about a colour


def air_mass(elevation_deg: float) -> float:
    """Relative optical air mass at sea level (Kasten and Young 1989, eq. 3) by apparent elevation.

    >>> round(air_mass(90.0), 3), round(air_mass(30.0), 3)
    (1.0, 1.994)
    """
    above = min(max(elevation_deg, 0.0), 90.0)
    return 1.0 / (math.sin(math.radians(above)) + 0.50572 * math.pow(above + 6.07995, -1.6364))


def direct_normal_lux(elevation_deg: float, sky: SkyWord = "clear") -> float:
    """Illuminance of direct sunlight, lux, on a surface that faces the sun.

    What the model of IES RP-21 expects in the mean, see `SPREAD`.

    >>> round(direct_normal_lux(60.0)), round(direct_normal_lux(60.0, "hazy"))
    (100061, 71602)
    """
    return _SOLAR_CONSTANT_LUX * math.exp(-_EXTINCTION[sky] * air_mass(elevation_deg))


def sun_colour(elevation_deg: float, sky: SkyWord = "clear") -> Float64:
    """Colour of direct sunlight, (3,) linear Rec. 709 of luminance 1: what the air left of it.

    Rayleigh scattering by Leckner, "The spectral distribution of solar radiation at the earth's
    surface", Solar Energy 20, 1978, 143-150: 0.008735 w^-4.08 per air mass (w in micrometres);
    the rest of the extinction by particles with the exponent 1.3 of Angstrom (1929). Cloud is
    grey. White is the sun at an air mass of 1.5; red rises as the sun sinks.
    """
    waves = np.array(_WAVELENGTHS)
    particles = min(_EXTINCTION[sky], _EXTINCTION["hazy"]) - 0.1
    depth = 0.008735 * waves**-4.08 + particles * (waves / 0.555) ** -1.3
    white = 0.008735 * waves**-4.08 + (_EXTINCTION["clear"] - 0.1) * (waves / 0.555) ** -1.3
    mass = min(air_mass(elevation_deg), _REDDEST_AIR_MASS)
    light = np.exp(white * _WHITE_AIR_MASS - depth * mass)
    return np.asarray(light / (light @ np.array(LUMINANCE_WEIGHTS)), np.float64)


# What the sun looks like in the darkest frame. A lamp or window that fails any one is left alone.
_LEAST_CLIP_CD_M2: Final = 15_000.0  # half of sunlit snow: dimmer frames clip far too much
_LEAST_ELEVATION_DEG: Final = 1.5  # below, the model says nothing
_LEAST_ROUNDNESS: Final = 0.62
_ROUGH: Final = 0.5
_CLIP_OVER_SKY: Final = 4.0  # an overcast sky that clips in part is no sun
_SKY_AROUND_CD_M2: Final = 5_000.0  # a few degrees from the sun, by day
_AUREOLE: Final = 1.5  # that sky over the sky 20 degrees away
_SKY_EVENNESS: Final = 0.25
_OTHERS: Final = 0.5  # solid angle of all else that clips, of the core's
_LEAST_ALBEDO: Final = 0.05
# Radius of the clipped glow, deg, at a clip level of 30 kcd/m2; it shrinks as that rises.
_GLOW_DEG: Final = 20.0
_GLOW_CD_M2: Final = 30_000.0
_GLOW_POWER: Final = 0.6
_MOST_GLOW_DEG: Final = 5.0  # where the clip level is not known


@dataclass(frozen=True, slots=True)
class Core:
    """The clipped middle of a light, on the panorama's own texels, in degrees.

    The radius is that of the disc with the same solid angle.
    """

    azimuth_deg: float
    elevation_deg: float
    radius_deg: float
    roundness: float
    solid_angle_sr: float


def find_sun(
    merged: MergedLight, lights: Sequence[Light], grid: LightGrid | None = None
) -> Light | None:
    """Return the light that is the sun, None where there is none or more than one could be."""
    grid = light_grid(merged) if grid is None else grid
    suns = [light for light in lights if is_sun(light, merged, grid)]
    return suns[0] if len(suns) == 1 else None


def is_sun(light: Light, merged: MergedLight, grid: LightGrid | None = None) -> bool:
    """Decide whether a light is the sun, clipped, over an open sky.

    All of this must hold: it is clipped in every frame, and those reach luminances that only
    daylight clips; the clipped core is small, round and above the horizon; nothing else clips
    that compares with it; the sky just above it is bright and even, as an aureole is and a
    wall is not; the rest of the sky is far under the clip level; and the ground is as bright as
    ground under such a sun.
    """
    if not light.clipped or merged.cd_m2 is None:
        return False
    clip = merged.clip_level * merged.cd_m2
    if clip < _LEAST_CLIP_CD_M2:
        return False
    core = sun_core(light, merged)
    small = core.radius_deg <= _GLOW_DEG * (_GLOW_CD_M2 / clip) ** _GLOW_POWER
    # A disc of a few texels with its star of rays is no better known than this.
    round_enough = core.roundness >= (_LEAST_ROUNDNESS if core.radius_deg > 1.0 else _ROUGH)
    if not (small and round_enough and core.elevation_deg >= _LEAST_ELEVATION_DEG):
        return False
    grid = light_grid(merged) if grid is None else grid
    return _alone(core, grid) and _under_open_sky(core, grid, merged.cd_m2, clip)


def may_be_sun(light: Light, merged: MergedLight, grid: LightGrid) -> bool:
    """Whether a light looks like the sun, as far as frames of unknown exposure can tell."""
    if not light.clipped or merged.cd_m2 is not None:
        return False
    core = sun_core(light, merged)
    looks = core.radius_deg <= _MOST_GLOW_DEG and core.roundness >= _ROUGH
    if not (looks and core.elevation_deg >= _LEAST_ELEVATION_DEG):
        return False
    return _alone(core, grid) and _under_open_sky(core, grid, None, merged.clip_level)


def sun_core(light: Light, merged: MergedLight) -> Core:
    """Measure the clipped middle of a light.

    Of the largest clipped piece, with small gaps bridged and holes filled (a resampled disc may
    have a dark ring around it).
    """
    height, width = merged.clipped.shape
    rows, columns = _window(light, merged)
    clipped = merged.clipped[rows][:, columns]
    reach = 2 * round(width / 1100.0) + 1
    is_clipped = np.ascontiguousarray(clipped > 0).astype(np.uint8)
    mask = cv2.morphologyEx(is_clipped, cv2.MORPH_CLOSE, np.ones((reach, reach), np.uint8))
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(outlines, key=lambda line: (cv2.contourArea(line), len(line)))
    piece = cv2.drawContours(np.zeros(is_clipped.shape, np.uint8), [largest], -1, 1, cv2.FILLED) > 0
    row, column = np.nonzero(piece)
    texels = (row + rows.start) * width + columns[column]
    share = np.maximum(clipped[piece], cv2.erode(piece.astype(np.uint8), np.ones((3, 3)))[piece])
    areas = solid_angles((height, width))[row + rows.start] * share
    azimuth, elevation, moment = spread_of((height, width), texels, areas)
    solid_angle = float(areas.sum())
    return Core(
        azimuth_deg=azimuth,
        elevation_deg=elevation,
        radius_deg=math.degrees(math.sqrt(solid_angle / math.pi)),
        roundness=min(1.0, solid_angle / (2.0 * np.pi) / moment),
        solid_angle_sr=solid_angle,
    )


def _alone(core: Core, grid: LightGrid) -> bool:
    """Whether nothing else that compares with the core is clipped."""
    height, width = grid.luminance.shape
    texels = np.flatnonzero(grid.clipped > 0)
    sun = direction(core.azimuth_deg, core.elevation_deg)
    near = np.cos(np.radians(core.radius_deg + 10.0))
    elsewhere = directions_at((height, width), texels) @ sun < near
    others = float(grid.solid_angle.ravel()[texels[elsewhere] // width].sum())
    return others <= _OTHERS * core.solid_angle_sr


def _under_open_sky(core: Core, grid: LightGrid, cd_m2: float | None, clip: float) -> bool:
    """Whether what is around a clipped core is sky with one sun, and ground that it lights.

    Where the exposure is not known only what does not depend on it is asked.
    """
    shape = grid.luminance.shape[0], grid.luminance.shape[1]
    every = np.arange(shape[0] * shape[1])
    directions = directions_at(shape, every)
    sun = direction(core.azimuth_deg, core.elevation_deg)
    away = np.degrees(np.arccos(np.clip(directions @ sun, -1.0, 1.0)))
    bright = grid.luminance.ravel().astype(np.float64) * (cd_m2 or 1.0)
    areas = np.broadcast_to(grid.solid_angle, shape).ravel()
    is_clipped, up = grid.clipped.ravel() > 0, directions[:, 1]
    around = (away > core.radius_deg + 1.0) & (away < core.radius_deg + 5.0)
    above = around & (up > sun[1]) & ~is_clipped
    if not above.any():
        return False
    sky = bright[above]
    least = 0.0 if cd_m2 is None else _SKY_AROUND_CD_M2
    even = np.percentile(sky, 25.0) >= max(_SKY_EVENNESS * sky.mean(), least)
    far = (away > core.radius_deg + 15.0) & (away < core.radius_deg + 25.0) & (up > sun[1] - 0.1)
    if not even or np.median(sky) < _AUREOLE * np.median(bright[far]):
        return False
    dim = bool(_CLIP_OVER_SKY * np.median(bright[up > 0.0]) <= clip)
    if cd_m2 is None:
        return dim
    open_sky = (up > 0.0) & (away > core.radius_deg)
    from_sky = float((bright * areas * up)[open_sky].sum())
    from_sun = direct_normal_lux(core.elevation_deg) * sun[1]
    ground = float((bright * areas * -up)[up < 0.0].sum())
    return dim and ground >= _LEAST_ALBEDO * (from_sky + from_sun)


def _window(light: Light, merged: MergedLight) -> tuple[slice, Indices]:
    """Rows and (wrapped) columns of the panorama that hold a light, with a margin."""
    height, width = merged.clipped.shape
    grid_width = min(width, 512)
    step = width / grid_width
    row, column = np.divmod(light.texels, grid_width)
    columns = np.unique(column)
    gaps = np.diff(np.append(columns, columns[0] + grid_width))
    widest = int(np.argmax(gaps))
    first = int(columns[(widest + 1) % len(columns)])
    count = grid_width - int(gaps[widest]) + 1
    start, stop = math.floor((first - 1) * step), math.ceil((first + count + 1) * step)
    stop = min(stop, start + width)
    rows = slice(
        max(math.floor((int(row.min()) - 1) * step), 0),
        min(math.ceil((int(row.max()) + 2) * step), height),
    )
    return rows, np.arange(start, stop) % width


_APERTURE_DEG: Final = 2.5  # half-angle of a pyrheliometer: what counts as direct sunlight


@dataclass(frozen=True, slots=True)
class Restoration:
    """A light put back, and what was done; `light` is its id, None if nothing was done.

    `disc`, (N, 2) float64, has flat indices of the texels that were given light, and how much
    luminance each.
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
    """Put the sun's light back, if one of the lights is the sun.

    The disc lies at the centre of what is clipped, with a solid angle of 6.8e-5 sr. What lies
    within 2.5 deg of it (the aperture of a pyrheliometer: WMO-No. 8, 2018, I.7.2.1) sums to the
    model's direct illuminance; nothing is taken away from the glow around.
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
    """Give a lamp the illuminance in lux that a light meter measured.

    What is clipped of the lamp (or all of it, where nothing is) sums to that illuminance; its
    colour is that of its texels. ProbeError if `lux` is not a positive number, absolute
    luminance is not known, or the lamp already holds more.
    """
    if not (math.isfinite(lux) and lux > 0):
        raise ProbeError(
            tr("The illuminance of lamp {id} must be a positive number of lux.", id=light.id)
        )
    if merged.cd_m2 is None:
        raise ProbeError(
            tr("A measured illuminance needs frames with shutter, ISO and aperture."),
            tr("Give the lamp a gain in stops instead."),
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
                "Lamp {id} gives at least {held:.0f} lux in these frames, not {lux:.0f}.",
                id=light.id,
                held=energy,
                lux=lux,
            ),
            tr("Hold the meter where the camera stood, facing the lamp."),
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
    """Reduce what a restoration added: luminance, (rows, columns), in the panorama's unit."""
    size = restoration.merged.clipped.shape
    lone = np.zeros((size[0], size[1], 1), np.float32)
    lone.reshape(-1)[restoration.disc[:, 0].astype(np.int64)] = restoration.disc[:, 1]
    return reduce_radiance(lone, shape)[..., 0].astype(np.float64)


@dataclass(frozen=True, slots=True)
class _SunTarget:
    """Illuminance to be reached, its range, and its colour (None: of the texels)."""

    lux: float
    near: tuple[float, float]
    colour: Float64 | None


def _draw_sun(merged: MergedLight, core: Core, target: _SunTarget) -> tuple[Float64, float]:
    """Return the disc's texels with the luminance to be added, and the lux already there."""
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
    """Add luminance to texels; what is clipped of the light counts as known from now on."""
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
    coverage = inside.reshape(len(rows), fine, len(columns), fine).sum(axis=(1, 3))
    row, column = np.nonzero(coverage)
    share = coverage[row, column]
    return rows[row] * width + columns[column] % width, share / share.sum()
