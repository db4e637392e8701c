"""Recognising the sun among the lights of a place.

Everything is judged on absolute luminance and on what surrounds the light. The rules are strict:
a sun that is not recognised costs some accuracy, a lamp taken for the sun spoils the place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.base.sphere import direction, directions_at
from app.core.hdr.lights import light_grid, spread_of
from app.core.hdr.sky import direct_normal_lux
from app.core.solver.environment import solid_angles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Indices
    from app.core.hdr.frame import Merged
    from app.core.hdr.lights import Light, LightGrid


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
    merged: Merged, lights: Sequence[Light], grid: LightGrid | None = None
) -> Light | None:
    """Return the light that is the sun, None where there is none or more than one could be."""
    grid = light_grid(merged) if grid is None else grid
    found = [light for light in lights if is_sun(light, merged, grid)]
    return found[0] if len(found) == 1 else None


def is_sun(light: Light, merged: Merged, grid: LightGrid | None = None) -> bool:
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


def may_be_sun(light: Light, merged: Merged, grid: LightGrid) -> bool:
    """Whether a light looks like the sun, as far as frames of unknown exposure can tell."""
    if not light.clipped or merged.cd_m2 is not None:
        return False
    core = sun_core(light, merged)
    looks = core.radius_deg <= _MOST_GLOW_DEG and core.roundness >= _ROUGH
    if not (looks and core.elevation_deg >= _LEAST_ELEVATION_DEG):
        return False
    return _alone(core, grid) and _under_open_sky(core, grid, None, merged.clip_level)


def sun_core(light: Light, merged: Merged) -> Core:
    """Measure the clipped middle of a light.

    Of the largest clipped piece, with small gaps bridged and holes filled (a resampled disc may
    have a dark ring around it).
    """
    height, width = merged.clipped.shape
    rows, columns = _window(light, merged)
    clipped = merged.clipped[rows][:, columns]
    reach = 2 * round(width / 1100.0) + 1
    lost = np.ascontiguousarray(clipped > 0).astype(np.uint8)
    mask = cv2.morphologyEx(lost, cv2.MORPH_CLOSE, np.ones((reach, reach), np.uint8))
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(outlines, key=lambda line: (cv2.contourArea(line), len(line)))
    piece = cv2.drawContours(np.zeros(lost.shape, np.uint8), [largest], -1, 1, cv2.FILLED) > 0
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
    lost = np.flatnonzero(grid.clipped > 0)
    sun = direction(core.azimuth_deg, core.elevation_deg)
    near = np.cos(np.radians(core.radius_deg + 10.0))
    elsewhere = directions_at((height, width), lost) @ sun < near
    others = float(grid.solid_angle.ravel()[lost[elsewhere] // width].sum())
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
    lost, up = grid.clipped.ravel() > 0, directions[:, 1]
    around = (away > core.radius_deg + 1.0) & (away < core.radius_deg + 5.0)
    above = around & (up > sun[1]) & ~lost
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


def _window(light: Light, merged: Merged) -> tuple[slice, Indices]:
    """Rows and (wrapped) columns of the panorama that hold a light, with a margin."""
    height, width = merged.clipped.shape
    grid_width = min(width, 512)
    step = width / grid_width
    row, column = np.divmod(light.texels, grid_width)
    used = np.unique(column)
    gaps = np.diff(np.append(used, used[0] + grid_width))
    widest = int(np.argmax(gaps))
    first = int(used[(widest + 1) % len(used)])
    count = grid_width - int(gaps[widest]) + 1
    start, stop = math.floor((first - 1) * step), math.ceil((first + count + 1) * step)
    stop = min(stop, start + width)
    rows = slice(
        max(math.floor((int(row.min()) - 1) * step), 0),
        min(math.ceil((int(row.max()) + 2) * step), height),
    )
    return rows, np.arange(start, stop) % width
