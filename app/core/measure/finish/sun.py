"""Recognise a clipped sun by its luminance and its surroundings.

Even the shortest exposure of a 360 camera clips the sun's disc by 10 to 16 stops, which leaves less
than a hundredth of the disc's light. The rules are strict, because an unrecognised sun costs some
accuracy, but a lamp mistaken for the sun spoils the measurement.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Indices
from app.core.base.sphere import direction, directions_at
from app.core.environment.environment import solid_angles
from app.core.measure.finish.lamp_detection import Light, LightGrid, light_grid, spread_of
from app.core.measure.finish.sunlight import direct_normal_lux
from app.core.measure.read.frame import MergedLight

# Criteria for the sun in the darkest frame, all of which must hold.
_LEAST_CLIP_CD_M2: Final = 15_000.0  # half of sunlit snow; below this, far too much clips
_LEAST_ELEVATION_DEG: Final = 1.5  # the model of sunlight does not hold below this
_LEAST_ROUNDNESS: Final = 0.62
_ROUGH: Final = 0.5
_CLIP_OVER_SKY: Final = 4.0  # an overcast sky that clips in part is not the sun
_SKY_AROUND_CD_M2: Final = 5_000.0  # sky a few degrees from the sun, by day
_AUREOLE: Final = 1.5  # ratio of that sky to the sky 20 degrees away
_SKY_EVENNESS: Final = 0.25
_OTHERS: Final = 0.5  # maximum solid angle of all else that clips, relative to the core
_LEAST_ALBEDO: Final = 0.05
# Radius of the clipped glow in degrees at a clip level of 30 kcd/m2, shrinking as the level rises.
_GLOW_DEG: Final = 20.0
_GLOW_CD_M2: Final = 30_000.0
_GLOW_POWER: Final = 0.6
_MOST_GLOW_DEG: Final = 5.0  # if the clip level is unknown


@dataclass(frozen=True, slots=True)
class Core:
    """The clipped middle of a light, at full resolution.

    Its radius is that of a disc with the same solid angle.
    """

    azimuth_deg: float
    elevation_deg: float
    radius_deg: float
    roundness: float
    solid_angle_sr: float


def find_sun(
    merged: MergedLight, lights: Sequence[Light], grid: LightGrid | None = None
) -> Light | None:
    """Return the light that is the sun, or None if no light, or more than one, could be the sun."""
    grid = light_grid(merged) if grid is None else grid
    suns = [light for light in lights if is_sun(light, merged, grid)]
    return suns[0] if len(suns) == 1 else None


def is_sun(light: Light, merged: MergedLight, grid: LightGrid | None = None) -> bool:
    """Decide whether a light is a clipped sun in an open sky.

    All of the following must hold. The light is clipped in every frame, at a luminance that only
    daylight reaches. The clipped core is small, round and above the horizon, and nothing else of
    that size is clipped. The sky just above the core is bright and even, which is true of an
    aureole but not of a wall. The rest of the sky is far below the clip level, and the ground is as
    bright as sunlit ground.
    """
    if not light.clipped or merged.cd_m2 is None:
        return False
    clip = merged.clip_level * merged.cd_m2
    if clip < _LEAST_CLIP_CD_M2:
        return False
    core = sun_core(light, merged)
    small = core.radius_deg <= _GLOW_DEG * (_GLOW_CD_M2 / clip) ** _GLOW_POWER
    # A disc of only a few texels, with its star of rays, is less round.
    round_enough = core.roundness >= (_LEAST_ROUNDNESS if core.radius_deg > 1.0 else _ROUGH)
    if not (small and round_enough and core.elevation_deg >= _LEAST_ELEVATION_DEG):
        return False
    grid = light_grid(merged) if grid is None else grid
    return _alone(core, grid) and _under_open_sky(core, grid, merged.cd_m2, clip)


def may_be_sun(light: Light, merged: MergedLight, grid: LightGrid) -> bool:
    """Decide whether a light might be the sun when the exposure of the frames is unknown."""
    if not light.clipped or merged.cd_m2 is not None:
        return False
    core = sun_core(light, merged)
    looks = core.radius_deg <= _MOST_GLOW_DEG and core.roundness >= _ROUGH
    if not (looks and core.elevation_deg >= _LEAST_ELEVATION_DEG):
        return False
    return _alone(core, grid) and _under_open_sky(core, grid, None, merged.clip_level)


def sun_core(light: Light, merged: MergedLight) -> Core:
    """Measure the largest clipped area of a light, bridging gaps and filling holes.

    A resampled disc may have a dark ring around it.
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
    """Return whether nothing else as large as the core is clipped."""
    height, width = grid.luminance.shape
    texels = np.flatnonzero(grid.clipped > 0)
    sun = direction(core.azimuth_deg, core.elevation_deg)
    near = np.cos(np.radians(core.radius_deg + 10.0))
    elsewhere = directions_at((height, width), texels) @ sun < near
    others = float(grid.solid_angle.ravel()[texels[elsewhere] // width].sum())
    return others <= _OTHERS * core.solid_angle_sr


def _under_open_sky(core: Core, grid: LightGrid, cd_m2: float | None, clip: float) -> bool:
    """Return whether a clipped core is surrounded by sky, above ground that the core lights.

    If the exposure is unknown, only criteria that do not depend on the exposure are checked.
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
    """Return the panorama's rows and (wrapped) columns around a light, including a margin."""
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
