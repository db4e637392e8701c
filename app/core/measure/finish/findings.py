"""Find a place's lamps, windows and clipping, for use in lists and advice.

Directions are those of the panorama, as seen by a sitter who faces the photographer (azimuth 0).
The front is the photographer's side, and right is the sitter's right side.

A reopened place or a panorama from another source has no clip mask from a merge. However, if the
bracket is known, so is the level at which the darkest frame clipped. That level is sufficient,
since light at that level may have been brighter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage, largest_channel
from app.core.base.errors import ProbeError
from app.core.base.remarks import Remark
from app.core.base.sphere import bounded
from app.core.measure.bracket.merge import reference_exposure
from app.core.measure.finish.lamp_detection import Light, LightGrid, Source, find_lights, light_grid
from app.core.measure.finish.remarks import LampClipped, MaybeSun, MoreLampsClipped, Remedy
from app.core.measure.finish.sun import find_sun
from app.core.measure.read.frame import MergedLight

_STEP_EV: Final = 2.0
_MOST_FRAMES: Final = 4
_WORTH_SAYING: Final = 3
_SHAPES: Final = 0.15  # minimum fraction of a place's light that shapes a face
# Upper limits in cd/m2, for a sunlit cloud through a window and for a bare bulb.
_WINDOW_CD_M2: Final = 50_000.0
_LAMP_CD_M2: Final = 2_000_000.0
_USUAL_FRAMES: Final = {"window": 2, "lamp": 3}

# Lights are classified by position, size, and brightness relative to their surroundings.
_WINDOW_DEG: Final = (6.0, 60.0)  # range of a window's size
_WINDOW_HEIGHT_DEG: Final = (-25.0, 45.0)  # elevation range of a window's centre
_BELOW_DEG: Final = -2.0  # maximum upper edge of light entirely below the horizon
_GROUND_DEG: Final = -15.0  # maximum centre of ground, which reaches the horizon only far away
_GROUND_SIZE_DEG: Final = 10.0
_BARE: Final = 50.0  # times the mean of the sphere; a brighter area is a source, not ground
_TUBE: Final = 100.0  # times that mean; a strip this bright is a tube, not a gap in a wall
_HIGH_DEG: Final = 30.0  # a wide area centred higher is sky or ceiling
_SKY_DEG: Final = 10.0
_GLOW: Final = 5.0  # times the surroundings; a dimmer area in front of an open sky is not a window
_OPEN: Final = 5.0  # times the ground; a brighter upper hemisphere means outdoors
_SUN_DEG: Final = 2.5  # maximum size of the sun, including the picture's blur
_BLUER: Final = 1.5  # blue over red in the sky, relative to that of the sun
_HEMISPHERE_DEG: Final = 15.0
_SMALL: Final = (64, 128)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Properties of the surroundings above and below the horizon, used to name lights."""

    mean: float
    height: int
    sky_by_ground: float
    sky_blueness: float  # blue over red


def surroundings_of(merged: MergedLight, grid: LightGrid) -> Surroundings:
    """Measure the surroundings of a place."""
    height = len(grid.luminance)
    small = cv2.resize(merged.radiance, (_SMALL[1], _SMALL[0]), interpolation=cv2.INTER_AREA)
    up = np.arange(_SMALL[0]) < _SMALL[0] * (0.5 - _HEMISPHERE_DEG / 180.0)
    above, below = (np.median(part.reshape(-1, 3), axis=0) for part in (small[up], small[up[::-1]]))
    weights = np.array(LUMINANCE_WEIGHTS)
    return Surroundings(
        mean=grid.total / (4.0 * math.pi),
        height=height,
        sky_by_ground=float(above @ weights) / max(float(below @ weights), 1e-30),
        sky_blueness=float(above[2]) / max(float(above[0]), 1e-30),
    )


def source_of(light: Light, place: Surroundings, blueness: float, alone: bool) -> Source:
    """Classify a light.

    Args:
        blueness: Ratio of blue to red in the light.
        alone: Whether this light provides most of the light that comes from lamps in the place.
    """
    width = 2 * place.height
    top = 90.0 - 180.0 * float(light.texels.min() // width) / place.height
    bottom = 90.0 - 180.0 * float(light.texels.max() // width + 1) / place.height
    size, up, outdoors = light.diameter_deg, light.elevation_deg, place.sky_by_ground >= _OPEN
    # relative to the mean over the sphere
    brightness = light.share * 4.0 * math.pi / light.solid_angle_sr
    if alone and size <= _SUN_DEG and up > 0.0 and place.sky_blueness > _BLUER * blueness:
        return "sun"
    compact = size <= 3.0 or light.roundness >= 0.5 or brightness >= _TUBE
    if size <= 12.0 and compact:
        return "lamp"
    if top <= _BELOW_DEG:
        ground = up <= _GROUND_DEG and size >= _GROUND_SIZE_DEG and brightness < _BARE
        return "ground" if ground else "area"
    contrast = brightness * place.mean / max(light.surround, 1e-30)
    if outdoors and bottom > 0.0 and up >= _SKY_DEG and contrast < _GLOW:
        return "sky"
    low, high = _WINDOW_HEIGHT_DEG
    middling = _WINDOW_DEG[0] <= size <= _WINDOW_DEG[1] and low <= up <= high
    if middling and light.roundness >= 0.4:
        return "window"
    if up > _HIGH_DEG:
        return "sky" if outdoors else "above"
    return "wall"


def sources_of(
    merged: MergedLight,
    lights: Sequence[Light],
    sun: Light | None = None,
    grid: LightGrid | None = None,
) -> tuple[Source, ...]:
    """Classify the lights in a place. `sun` is the light already identified as the sun, if any."""
    grid = light_grid(merged) if grid is None else grid
    place, total = surroundings_of(merged, grid), sum(light.share for light in lights)
    sun_id = None if sun is None else sun.id
    sources: list[Source] = []
    for light in lights:
        alone = sun_id is None and 2.0 * light.share > total
        colour = _colour(merged.radiance, light, grid)
        source = source_of(light, place, colour, alone)
        sources.append("sun" if light.id == sun_id else source)
    return tuple(sources)


def _colour(radiance: FloatImage, light: Light, grid: LightGrid) -> float:
    """Return the ratio of blue to red in the middle of a light."""
    rows, columns = radiance.shape[:2]
    height, width = grid.luminance.shape
    row, column = np.divmod(light.texels, width)
    down = rows // height
    best = int(np.argmax(grid.luminance.ravel()[light.texels]))
    top, left = int(row[best]) * rows // height, int(column[best]) * columns // width
    red, _, blue = radiance[top : top + down, left : left + down].reshape(-1, 3).mean(axis=0)
    return float(blue) / max(float(red), 1e-30)


def darker_frames(light: Light, merged: MergedLight, kind: str) -> int:
    """Estimate how many more frames, each 2 EV darker, are needed to capture a clipped light.

    If absolute luminance is known, the number follows from the upper limit for lights of this kind.
    Otherwise, it is based on experience.
    """
    lamp = kind == "lamp" or light.diameter_deg <= 12.0
    if merged.cd_m2 is None:
        return _USUAL_FRAMES["lamp" if lamp else "window"]
    reach = (_LAMP_CD_M2 if lamp else _WINDOW_CD_M2) / (merged.clip_level * merged.cd_m2)
    return min(max(math.ceil(math.log2(max(reach, 1.0)) / _STEP_EV), 1), _MOST_FRAMES)


def advise(
    merged: MergedLight,
    lights: Sequence[Light],
    sun: Light | None,
    room_stops: float | None,
    maybe: str = "",
) -> tuple[Remark, ...]:
    """Return the advice from a clip audit, or an empty tuple if nothing is clipped.

    Args:
        room_stops: How many stops below its darkest frame the camera can go, or None if unknown.
        maybe: ID of the lamp that would count as the sun if the exposure of the frames were known,
            or "" if there is none.
    """
    clipped = [light for light in lights if light.clipped]
    if not clipped:
        return ()
    names = sources_of(merged, lights, sun)
    names_by_id = {light.id: name for light, name in zip(lights, names, strict=True)}
    lines: list[Remark] = [
        MaybeSun(light.id, light.azimuth_deg, light.elevation_deg)
        if light.id == maybe
        else _about(light, merged, names_by_id[light.id], sun, room_stops)
        for light in clipped[:_WORTH_SAYING]
    ]
    if sun is not None and sun not in clipped[:_WORTH_SAYING]:
        lines.append(_about(sun, merged, "sun", sun, room_stops))
    rest = len(clipped) - len(lines)
    if rest > 0:
        lines.append(MoreLampsClipped(rest))
    return tuple(lines)


def _about(
    light: Light, merged: MergedLight, kind: Source, sun: Light | None, room_stops: float | None
) -> LampClipped:
    about = LampClipped(light.id, kind, light.azimuth_deg, light.elevation_deg, Remedy.SKY)
    if sun is not None and light.id == sun.id:
        return about
    if room_stops is not None and room_stops < 0.5:
        return replace(about, remedy=Remedy.GAIN)
    count, room = darker_frames(light, merged, kind), None
    if room_stops is not None and room_stops < _STEP_EV * count - 1.0:
        count, room = max(round(room_stops / _STEP_EV), 1), room_stops
    return replace(about, remedy=Remedy.DARKER_FRAMES, frames=count, room_stops=room)


# fraction of the clip level that allows for the second highest code and rounding in files
_NEAR: Final = 0.985
_MASK_COLUMNS: Final = 1024  # columns of the mask; partly covered texels count as visible
_LEAST_SHARE: Final = 0.0005


@dataclass(frozen=True, slots=True)
class LampFinding:
    """A lamp, a window or the sun, as it appears in lists.

    Attributes:
        kind: Kind of source, from `source_of`.
        azimuth_deg, elevation_deg: Centre of the light, in degrees.
        diameter_deg: Diameter of the disc with the same solid angle, in degrees.
        share: Fraction of the place's light, 0 to 1. This is a lower bound if the lamp is clipped.
    """

    letter: str
    kind: Source
    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    share: float
    clipped: bool


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """The lamps and the clipping in a place.

    Attributes:
        clipped: (512, 1024) float32. Clipped fraction of each texel, or None if no clipping is
            known.
        map: (h, w) int8. Index of each texel's lamp, or -1 where there is none.
    """

    lamps: tuple[LampFinding, ...] = ()
    clipped: Float32 | None = field(default=None, repr=False)
    map: NDArray[np.int8] | None = field(default=None, repr=False)

    def at(
        self, azimuth_deg: float, elevation_deg: float, near_deg: float = 2.0
    ) -> LampFinding | None:
        """Return the lamp in or near a direction of the panorama, or None if there is none."""
        if self.map is None:
            return None
        height, width = self.map.shape
        row = int((0.5 - elevation_deg / 180.0) * height)
        column = int((0.5 + azimuth_deg / 360.0) * width)
        reach = round(near_deg / 180.0 * height)
        # Texels narrow towards the poles.
        aside = min(round(reach / max(math.cos(math.radians(elevation_deg)), 0.05)), width // 2)
        rows = slice(max(row - reach, 0), min(row + reach + 1, height))
        across = np.arange(column - aside, column + aside + 1) % width
        around = self.map[rows][:, across].ravel()
        here = int(self.map[min(max(row, 0), height - 1), column % width])
        if here < 0:
            there = around[around >= 0]
            here = int(np.bincount(there).argmax()) if there.size else -1
        return None if here < 0 else self.lamps[here]

    @property
    def clipped_lamps(self) -> tuple[LampFinding, ...]:
        """The clipped lamps, in descending order of their share of the light."""
        return tuple(lamp for lamp in self.lamps if lamp.clipped)

    @property
    def light(self) -> str:
        """The main kind of light: "sun", "lamp", "lamps", "window" or "soft"."""
        shares = dict.fromkeys(("sun", "lamp", "window"), 0.0)
        for lamp in self.lamps:
            if lamp.kind in shares:
                shares[lamp.kind] += lamp.share
        kind = max(shares, key=lambda name: shares[name])
        if shares[kind] < _SHAPES:
            return "soft"
        main = max(lamp.share for lamp in self.lamps if lamp.kind == kind)
        return "lamps" if kind == "lamp" and main < 0.5 * shares[kind] else kind


def clip_level(stops: Sequence[float]) -> float | None:
    """Return the radiance at which a bracket's darkest frame clips, or None without frames.

    Args:
        stops: True exposures in stops, relative to any common exposure.

    Returns:
        The radiance, in the unit of the bracket's merged light.

    >>> clip_level([2.0, 0.0, -2.0])
    4.0
    """
    if not stops:
        return None
    return float(2.0 ** (reference_exposure(stops) - min(stops)))


def clipped_share(radiance: FloatImage, level: float | None) -> Float32:
    """Return a mask, (H, W), of the clipped texels in a panorama, (H, W, 3).

    Args:
        level: Result of `clip_level`, or None if nothing is clipped. Texels whose largest channel
            reaches this level are clipped.
    """
    if level is None:
        return np.zeros(radiance.shape[:2], np.float32)
    return np.asarray(largest_channel(radiance) >= _NEAR * level, np.float32)


def find(
    radiance: FloatImage,
    level: float | None = None,
    cd_m2: float | None = None,
    clipped: Float32 | None = None,
) -> Findings:
    """Find the lamps and the clipping in a place, (H, 2 H, 3) in linear Rec. 709.

    Args:
        level: Radiance at which the light clips (see `clip_level`), or None if unknown.
        cd_m2: Luminance of a radiance of 1, in cd/m2, or None if unknown.
        clipped: (H, 2 H) float32. Clipped fraction of each texel, or None if unknown.
    """
    clipping = clipped_share(radiance, level) if clipped is None else clipped
    merged = MergedLight(
        radiance=radiance,
        clipped=clipping,
        dark=np.zeros_like(clipping),
        reference_ev=0.0,
        clip_level=level or 2.0 * float(radiance.max()),
        cd_m2=cd_m2,
    )
    try:
        grid = light_grid(merged)
        lights = find_lights(merged, grid)
    except ProbeError:
        return Findings()
    sources = sources_of(merged, lights, find_sun(merged, lights, grid), grid)
    lamps: list[LampFinding] = []
    where = np.full(grid.luminance.size, -1, np.int8)
    for light, source in zip(lights, sources, strict=True):
        if light.share >= _LEAST_SHARE:
            where[light.texels] = len(lamps)
            numbers = light.azimuth_deg, light.elevation_deg, light.diameter_deg
            lamps.append(LampFinding(light.id, source, *numbers, light.share, light.clipped))
    clipped = bounded(clipping, _MASK_COLUMNS) if clipping.any() else None
    return Findings(tuple(lamps), clipped, where.reshape(grid.luminance.shape))
