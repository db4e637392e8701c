"""Find the light of a place that keeps a picture from a style.

A shortfall compares two areas of the face. The mean of an area is linear in the light, so the share
of it that comes from any part of the place is exact. The light in the way is the part without which
the two areas would come closest to the limit of the style, or go farthest beyond it. The picture
without that light is then computed exactly, with its areas, match and grade.

The named lamps of the place come first. If none of them matters, the light is summed over regions
around the sitter. If none of these stands out either, the light comes from all around.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, NamedTuple, TypeAlias

import cv2
import numpy as np

from app.core.base.angles import TURNS, turn_of_index, wrap
from app.core.base.arrays import Bools, Float64, Floats
from app.core.base.sphere import bounded
from app.core.environment.environment import Environment, reduce_light, solid_angles
from app.core.measure.finish.findings import Findings, LampFinding
from app.core.measure.finish.lamp_detection import Source
from app.core.solver.face import AREAS, AROUND
from app.core.solver.search import curves, luminance_of
from app.core.solver.shortfall import AreaShortfall
from app.core.solver.solve import measure_alone
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import EXPLAINS, stops_of
from app.core.styles.style_pack import StylePack

NOTABLE: Final = 0.15
"""Least share of an area's light for a lamp to be named.

Without a lamp of this share, the area is a quarter of a stop darker. A smaller change is hardly
visible and not worth a flag.
"""

NOTABLE_REGION: Final = 0.3
"""Least share of an area's light for a region, or the light from all around, to be named."""

_OVER_EVEN: Final = 1.5  # times the share that the region would have in even light
_OVER_LAMP: Final = 2.0  # times the share of a lamp that changes no grade
_GAIN: Final = 0.2  # stops: a smaller move towards the limit is hardly visible
_NOTHING: Final = 1e-6  # fraction of the light below which none is left
_COLUMNS: Final = 1024  # of the panorama from which the lamps are cut
_FLOOR_DEG, _OVERHEAD_DEG = -30.0, 45.0
_HALF_SIDE_DEG: Final = 45.0

SolveAgain: TypeAlias = Callable[[Floats], StyleResult]
"""Solve the same style in other light of the same size."""


class PlaceRegion(StrEnum):
    """A region around the sitter, named as the sitter would name it."""

    FLOOR = "floor"
    OVERHEAD = "overhead"
    FRONT = "front"
    LEFT = "left"
    BEHIND = "behind"
    RIGHT = "right"
    AROUND = "all around"


_HIGH_AND_LOW: Final = {PlaceRegion.FLOOR: -90.0, PlaceRegion.OVERHEAD: 90.0}
_SIDES: Final = {
    PlaceRegion.FRONT: 0.0,
    PlaceRegion.LEFT: 90.0,
    PlaceRegion.BEHIND: 180.0,
    PlaceRegion.RIGHT: -90.0,
}


@dataclass(frozen=True, slots=True)
class LightInTheWay:
    """The light of a place that keeps a picture from a style.

    Attributes:
        what: Kind of lamp, as in the list of the place's lamps, or a region around the sitter.
        letter: Letter of the lamp in that list, or "" for a region.
        clipped: Whether the lamp is clipped, so that its share is a lower bound.
        azimuth_deg, elevation_deg: Direction of the light relative to the face at the offered turn,
            in degrees. The azimuth is positive towards the sitter's left. Both are None for light
            from all around.
        area: Area of the face that this light makes too bright, one of `AREAS`.
        share: Fraction of that area's light that comes from this light, 0 to 1.
        stops: The difference of the shortfall at the same turn without this light, or None for
            light from all around, which nothing blocks.
        blocked: Result for the style without this light, at its best turn then, or None for light
            from all around.
    """

    what: Source | PlaceRegion
    letter: str
    clipped: bool
    azimuth_deg: float | None
    elevation_deg: float | None
    area: str
    share: float
    stops: float | None = None
    blocked: StyleResult | None = None


@dataclass(frozen=True, slots=True, eq=False)
class LampLights:
    """The light of a place in the search, and the part of it that comes from each lamp.

    Attributes:
        light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance, at turn 0.
        lamps: The lamps of the place, by descending share of its light.
        parts: One array for each lamp, in the shape and unit of `light` and nowhere above it.
    """

    light: Floats = field(repr=False)
    lamps: tuple[LampFinding, ...]
    parts: tuple[Floats, ...] = field(repr=False)


def lamp_lights(environment: Environment, findings: Findings, light: Floats) -> LampLights:
    """Reduce each lamp of a place to the size of the light in the search.

    Args:
        light: (H, W, 3) or (H, W) float. The environment as the search uses it.
    """
    if findings.map is None:
        return LampLights(light, (), ())
    radiance = bounded(environment.radiance, _COLUMNS)
    size, shape = radiance.shape[1::-1], (light.shape[0], light.shape[1])
    where = cv2.resize(findings.map, size, interpolation=cv2.INTER_NEAREST)
    parts: list[Floats] = []
    for number in range(len(findings.lamps)):
        alone = reduce_light(radiance * (where == number)[..., None], shape)
        part = luminance_of(alone) if light.ndim == 2 else alone
        parts.append(np.minimum(part, light))
    return LampLights(light, findings.lamps, tuple(parts))


def find_light_in_the_way(
    pack: StylePack, lights: LampLights, style: str, result: StyleResult, again: SolveAgain
) -> LightInTheWay | None:
    """Return the light that keeps a style soft or out of reach, or None if no light does.

    Args:
        style: Name of the style in the pack.
        result: Result for the style in this light, at any front.
        again: Function that solves the style in other light, with the same wishes and front.
    """
    shortfall = result.shortfall
    if not isinstance(shortfall, AreaShortfall):
        return None
    below = shortfall.value_stops < shortfall.limit_stops
    area, other = (shortfall.bright, shortfall.dark)[:: -1 if below else 1]
    if AREAS.index(area) in range(len(AREAS))[AROUND]:
        # The brightness around the head is no sum over lights.
        return None
    picture = _Picture(pack, lights.light, pack.index(style), result.turn_index, shortfall)
    shares = _AreaShares.at(picture, area, other)
    around = shares.around()
    single = shares.best(_lamp_parts(lights, picture.nose_deg)) or shares.best(shares.regions())
    if single is None:
        return around
    part, stops = single
    share = shares.of(part.light)[0]
    way = part.in_the_way(area, share, stops, again(lights.light - part.light))
    assert way.blocked is not None
    broad = around is not None and around.share > _OVER_LAMP * share
    return around if broad and way.blocked.rank <= result.rank else way


class _Part(NamedTuple):
    """A part of the light. `least` is the smallest share of an area's light that is named."""

    what: Source | PlaceRegion
    letter: str
    clipped: bool
    azimuth_deg: float
    elevation_deg: float
    least: float
    light: Floats

    def in_the_way(
        self, area: str, share: float, stops: float, blocked: StyleResult
    ) -> LightInTheWay:
        direction = self.azimuth_deg, self.elevation_deg
        return LightInTheWay(
            self.what, self.letter, self.clipped, *direction, area, share, stops, blocked
        )


@dataclass(frozen=True, slots=True)
class _Picture:
    """The picture at the offered turn, for one style."""

    pack: StylePack
    light: Floats
    row: int
    at: int
    shortfall: AreaShortfall

    @property
    def nose_deg(self) -> float:
        """Azimuth in the panorama that the face points to, in degrees."""
        return turn_of_index(self.at)

    def measured_in(self, light: Floats) -> tuple[float, float]:
        """Return the difference of the shortfall, in stops, and the match in other light."""
        curve_set = curves(self.pack.tables, self.pack.project(light))
        match = measure_alone(self.pack, curve_set).match[self.row, self.at]
        stops = stops_of(curve_set.others[: len(AREAS), self.at, None])[:, 0]
        bright, dark = (AREAS.index(n) for n in (self.shortfall.bright, self.shortfall.dark))
        return float(stops[bright] - stops[dark]), float(match)


@dataclass(frozen=True, slots=True)
class _AreaShares:
    """How much of the light on two areas comes from each texel.

    Attributes:
        picture: The picture whose areas are compared.
        area: Name of the area that is too bright.
        weights: (2, H, W, 3) or (2, H, W) float64. The product with the light, summed, is the mean
            of the area that is too bright and of the area that it is compared with.
        totals: The sums for the whole light. The second is 0 for an area around the head.
    """

    picture: _Picture
    area: str
    weights: Float64
    totals: Float64

    @classmethod
    def at(cls, picture: _Picture, area: str, other: str) -> _AreaShares:
        pack, light = picture.pack, picture.light
        height, width = pack.header.environment
        rows = pack.area_rows[[AREAS.index(area), AREAS.index(other)]].astype(np.float64)
        weights = rows[:, :height]
        if light.ndim == 3:
            tint = np.einsum("nkw,kh->nhw", rows[:, height:], pack.mixtures)
            parts = zip((weights, tint), pack.mixing, strict=True)
            weights = np.sum([part[..., None] * mixing for part, mixing in parts], axis=0)
        weights = np.roll(weights, picture.at * width // TURNS, axis=2)
        return cls(picture, area, weights, _sums(weights, light))

    def of(self, light: Floats) -> tuple[float, float]:
        """Return the shares of the two areas' light that come from a part of it."""
        part = _sums(self.weights, light) / np.maximum(self.totals, 1e-30)
        return float(part[0]), float(part[1])

    def gain(self, light: Floats) -> float:
        """Return how far the difference moves towards its limit without a part, in stops."""
        own, other = np.maximum(1.0 - np.array(self.of(light)), _NOTHING)
        return float(np.log2(other / own))

    def regions(self) -> Iterator[_Part]:
        """Yield the light of each region, to be named if it exceeds that of an even place."""
        light = self.picture.light
        even = np.ones_like(light)
        for region, mask in _region_masks(light.shape[:2], self.picture.nose_deg).items():
            here = mask if light.ndim == 2 else mask[..., None]
            usual, whole = _sums(self.weights, even * here)[0], _sums(self.weights, even)[0]
            least = max(NOTABLE_REGION, _OVER_EVEN * float(usual / whole))
            direction = _SIDES.get(region, 0.0), _HIGH_AND_LOW.get(region, 0.0)
            yield _Part(region, "", False, *direction, least, np.where(here, light, 0.0))

    def best(self, parts: Iterator[_Part]) -> tuple[_Part, float] | None:
        """Return the part that matters most, and the difference without it, or None.

        A part without which the picture resembles the style less is not in the way: it is the light
        that gives the style.
        """
        notable = [
            (gain, part)
            for part in parts
            if self.of(part.light)[0] >= part.least
            and (gain := self.gain(part.light)) >= _GAIN
            and _some(self.picture.light - part.light, self.picture.light)
        ]
        if not notable:
            return None
        shortfall = self.picture.shortfall
        _, match = self.picture.measured_in(self.picture.light)
        for _, part in sorted(notable, key=lambda each: -each[0]):
            stops, match_then = self.picture.measured_in(self.picture.light - part.light)
            change = stops - shortfall.value_stops
            towards = change if shortfall.value_stops < shortfall.limit_stops else -change
            if towards >= _GAIN and match_then >= match - EXPLAINS:
                return part, stops
        return None

    def around(self) -> LightInTheWay | None:
        """Return the light from all around if it is notable, or None.

        It is the part of the light that does not exceed the median luminance of the sphere.
        """
        luminance = luminance_of(self.picture.light)
        share = np.minimum(1.0, _median(luminance) / np.maximum(luminance, 1e-30))
        light = self.picture.light * (share if self.picture.light.ndim == 2 else share[..., None])
        own = self.of(light)[0]
        even = not _some(self.picture.light - light, self.picture.light)
        if own < NOTABLE_REGION or not (even or self.gain(light) >= _GAIN):
            return None
        return LightInTheWay(PlaceRegion.AROUND, "", False, None, None, self.area, own)


def _lamp_parts(lights: LampLights, nose_deg: float) -> Iterator[_Part]:
    for lamp, part in zip(lights.lamps, lights.parts, strict=True):
        direction = wrap(nose_deg - lamp.azimuth_deg), lamp.elevation_deg
        yield _Part(lamp.kind, lamp.letter, lamp.clipped, *direction, NOTABLE, part)


def _region_masks(shape: tuple[int, int], nose_deg: float) -> dict[PlaceRegion, Bools]:
    """Return a mask, (H, W), of each region around a sitter who faces an azimuth, in degrees."""
    height, width = shape
    elevation = 90.0 - 180.0 * (np.arange(height)[:, None] + 0.5) / height
    azimuth = nose_deg - 360.0 * ((np.arange(width) + 0.5) / width - 0.5)
    low, high = elevation < _FLOOR_DEG, elevation > _OVERHEAD_DEG
    everywhere = np.ones(shape, bool)
    masks = {PlaceRegion.FLOOR: low & everywhere, PlaceRegion.OVERHEAD: high & everywhere}
    for region, middle in _SIDES.items():
        away = np.abs((azimuth - middle + 180.0) % 360.0 - 180.0)
        masks[region] = ~low & ~high & (away <= _HALF_SIDE_DEG)
    return masks


def _sums(weights: Float64, light: Floats) -> Float64:
    return np.asarray((weights * light).reshape(len(weights), -1).sum(axis=1))


def _some(rest: Floats, light: Floats) -> bool:
    """Return whether a rest of the light is more than the rounding of its subtraction."""
    return float(rest.max()) > _NOTHING * float(light.max())


def _median(luminance: Float64) -> float:
    """Return the median luminance of the sphere, weighted by solid angle."""
    height, width = luminance.shape
    areas = np.repeat(solid_angles((height, width)), width)
    order = np.argsort(luminance, axis=None)
    below = np.cumsum(areas[order])
    return float(luminance.ravel()[order][np.searchsorted(below, 0.5 * below[-1])])
