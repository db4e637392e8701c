"""The directions from which light reaches a place, and faults in that light."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float64
from app.core.solver.shortfall import Cause, LightShortfall, Origin
from app.core.solver.turn_choice import Limits
from app.core.styles.style import Style, StyleLamp

_LOBE_POWER: Final = 20.0
_ELEVATIONS_DEG: Final = (-75.0, -60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
# fraction of the brightest lobe; a lamp two stops weaker does not shape a face
_MISSING: Final = 0.25
_EVEN: Final = 3.0  # brightest lobe over mean radiance of a place without a main light
_OPPOSITE_DEG: Final = 150.0
_TALL_DEG: Final = 20.0  # degrees; a style's lamp also works this much higher or lower


@dataclass(frozen=True)
class LightMap:
    """The light that reaches a place, by direction.

    Attributes:
        luminance: (H, W) float64. Environment at turn 0, at any exposure, but not entirely black.
    """

    luminance: Float64

    @cached_property
    def mean(self) -> float:
        """Mean radiance over the sphere."""
        bands = _bands(self.luminance.shape[0])
        return float((self.luminance.mean(axis=1) * bands).sum() / bands.sum())

    @cached_property
    def brightest(self) -> float:
        """Largest mean radiance of all lobes."""
        return max(float(self.ring(e).max()) for e in _ELEVATIONS_DEG)

    @cached_property
    def is_even(self) -> bool:
        """Whether the light is even."""
        return self.brightest < _EVEN * self.mean

    def ring(self, elevation_deg: float) -> Float64:
        """Return the mean radiance of lobes at an elevation, one for each texel column, (W,)."""
        height, width = self.luminance.shape
        lobe, total = _lobe(height, width, elevation_deg)
        spectrum = lobe * self._spectrum
        return np.asarray(np.fft.irfft(spectrum.sum(axis=0), n=width) / total)

    def toward(self, lamp: StyleLamp, turn_deg: float) -> float:
        """Return the mean radiance around a style's lamp at a turn."""
        width = self.luminance.shape[1]
        column = ((turn_deg - lamp.azimuth_deg) / 360.0 + 0.5) * width - 0.5
        return float(self.around(lamp)[round(column) % width])

    def around(self, lamp: StyleLamp) -> Float64:
        """Return the largest mean radiance near a lamp's elevation, for each texel column, (W,)."""
        heights = [lamp.elevation_deg + step for step in (-_TALL_DEG, 0.0, _TALL_DEG)]
        rings = [self.ring(height) for height in heights if abs(height) <= 90.0]
        return np.asarray(np.max(rings, axis=0))

    @cached_property
    def _spectrum(self) -> NDArray[np.complex128]:
        return np.fft.rfft(self.luminance, axis=1)


@lru_cache(maxsize=32)
def _lobe(
    height: int, width: int, elevation_deg: float
) -> tuple[NDArray[np.complex128], np.float64]:
    """Return the spectrum, (H, M), of the lobe at an elevation and the sum of its weights."""
    elevation = math.radians(elevation_deg)
    row = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    away = 2 * np.pi * np.arange(width) / width
    cosine = math.sin(elevation) * np.sin(row)[:, None] + math.cos(elevation) * np.outer(
        np.cos(row), np.cos(away)
    )
    lobe = np.maximum(cosine, 0.0) ** _LOBE_POWER * _bands(height)[:, None]
    # The lobe is symmetric in azimuth, so correlation and convolution are the same.
    return np.fft.rfft(lobe, axis=1), lobe.sum()


@lru_cache(maxsize=4)
def _bands(height: int) -> Float64:
    """Return the fraction of the sphere that each row covers, (H,)."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return np.asarray(edges[:-1] - edges[1:])


def light_shortfall(
    style: Style | None,
    match: float,
    strength: float,
    limits: Limits,
    light: LightMap,
    turn_deg: float,
) -> LightShortfall | None:
    """Return the fault in the light that puts a style out of reach, or None if it is within reach.

    Args:
        style: The style, or None for painted weights, which have no lamps.
        turn_deg: The chosen turn, in degrees.
    """
    if limits.are_met(match, strength):
        return None
    weak = strength < limits.strength
    if light.is_even:
        return limits.miss(Cause.EVEN, match, strength, weak=weak)
    weak = weak and match >= limits.match
    cause, origin = _cause(style, light, turn_deg, weak) if style else (Cause.NO_TURN, None)
    return limits.miss(cause, match, strength, origin, weak=weak)


def _cause(
    style: Style, light: LightMap, turn_deg: float, weak: bool
) -> tuple[Cause, Origin | None]:
    least = _MISSING * light.brightest
    absent = [lamp for lamp in style.lamps if light.around(lamp).max() < least]
    if absent and (len(style.lamps) == 1 or len(absent) == len(style.lamps)):
        return Cause.NO_LIGHT, _origin(absent[0])
    dark = [lamp for lamp in style.lamps if light.toward(lamp, turn_deg) < least]
    if len(style.lamps) == 2 and len(dark) == 1:
        if _opposite(*style.lamps):
            return Cause.ONE_SIDE, None
        return Cause.ONE_LAMP, _origin(dark[0])
    if dark and len(style.lamps) > 1:
        return Cause.APART, None
    return (Cause.FILLED if weak else Cause.SPOILED), None


def _opposite(one: StyleLamp, other: StyleLamp) -> bool:
    apart = abs(math.remainder(one.azimuth_deg - other.azimuth_deg, 360.0))
    return apart >= _OPPOSITE_DEG


def _origin(lamp: StyleLamp) -> Origin:
    side = abs(lamp.azimuth_deg)
    if lamp.elevation_deg <= -20:
        return Origin.BELOW
    if lamp.elevation_deg >= 60:
        return Origin.ABOVE
    if side >= 110:
        return Origin.BEHIND
    if side >= 60:
        return Origin.SIDE
    return Origin.HIGH_IN_FRONT if lamp.elevation_deg >= 20 else Origin.FRONT
