"""Studio lamps as environments, with a lamp size and a lighting ratio.

The photographer chooses the lamp size and the lighting ratio. The positions of the lamps belong to
the style. Sizes are angles as seen by the sitter, so a beauty dish at one metre is as hard as a
large umbrella far away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from app.core.base.arrays import Float64
from app.core.base.errors import StyleError
from app.core.styles.style import Style, StyleLamp
from app.core.text import tr

_FINE: Final = 8  # samples per texel and direction
_LEAST_DIAMETER_DEG: Final = 2.0
_FILL_DEG: Final = 90.0  # diameter of the fill, in front at the height of the lens

SOFTNESS_DEG: Final = {"hard": 10.0, "medium": 30.0, "large": 45.0}
"""Named lamp sizes, in degrees."""

MODIFIERS_M: Final = {"dish": 0.55, "softbox": 0.6, "umbrella": 1.0, "octabox": 1.2, "window": 2.0}
"""Widths of light modifiers, in metres."""

RATIOS: Final = (2.0, 3.0, 4.0, 8.0)
"""Available lighting ratios of key plus fill to fill."""

SIZES_DEG: Final = (2.0, 90.0)
RATIO_RANGE: Final = (1.5, 32.0)
_WIDTHS: Final = ", ".join(f"{name}@1.5" for name in MODIFIERS_M)


@dataclass(frozen=True, slots=True)
class Studio:
    """Lamps in a photographer's studio. By default, each style has its own, as in the paper.

    Attributes:
        softness_deg: Diameter of every lamp as the sitter sees it, in degrees, or None to keep the
            style's own diameters.
        ratio: Incident light of the key plus the fill, divided by that of the fill alone, or None
            for no fill other than the style's own.
    """

    softness_deg: float | None = None
    ratio: float | None = None

    def __post_init__(self) -> None:
        """Raise an error if a value is impossible."""
        size, ratio = self.softness_deg, self.ratio
        if size is not None and not SIZES_DEG[0] <= size <= SIZES_DEG[1]:
            raise StyleError(
                tr("A lamp size of {size:g}° is not possible.", size=size),
                tr(
                    "Choose a size from {low:g}° to {high:g}°.", low=SIZES_DEG[0], high=SIZES_DEG[1]
                ),
            )
        if ratio is not None and not RATIO_RANGE[0] <= ratio <= RATIO_RANGE[1]:
            raise StyleError(
                tr("A lighting ratio of {ratio:g}:1 is not possible.", ratio=ratio),
                tr(
                    "Choose a ratio from {low:g}:1 to {high:g}:1.",
                    low=RATIO_RANGE[0],
                    high=RATIO_RANGE[1],
                ),
            )

    def fit_for(self, style: Style) -> Studio:
        """Return this studio without the choices that would change the style."""
        if style.signature.areas:
            return AS_PUBLISHED
        size = style.key_diameter_deg
        if size is None or self.softness_deg is None or size[0] <= self.softness_deg <= size[1]:
            return self
        return replace(self, softness_deg=None)


AS_PUBLISHED: Final = Studio()
"""Each style's own bare lamps, as in the paper."""


def parse_softness(text: str) -> float | None:
    """Parse a lamp size, given in degrees, as a name, or as a modifier and its distance.

    Returns:
        The size in degrees, or None for "paper", which keeps each style's own lamps.

    Raises:
        StyleError: If the text is not a lamp size.

    Examples:
        >>> parse_softness("medium"), parse_softness("25"), round(parse_softness("octabox@1.5"))
        (30.0, 25.0, 44)
    """
    if text == "paper":
        return None
    if text in SOFTNESS_DEG:
        return SOFTNESS_DEG[text]
    name, _, distance = text.partition("@")
    try:
        number = float(distance or name)
    except ValueError:
        number = math.nan
    if distance and name in MODIFIERS_M and 0.3 <= number <= 20.0:
        return math.degrees(2.0 * math.atan(MODIFIERS_M[name] / 2.0 / number))
    if distance or not math.isfinite(number):
        raise StyleError(
            tr("{text!r} is not a lamp size.", text=text),
            tr(
                "Use degrees, {names}, paper, or a modifier and its distance in metres: {widths}.",
                names=", ".join(SOFTNESS_DEG),
                widths=_WIDTHS,
            ),
        )
    return number


def parse_ratio(text: str) -> float | None:
    """Parse a lighting ratio, such as "4:1", or "none".

    Raises:
        StyleError: If the text is not a lighting ratio.

    Examples:
        >>> parse_ratio("4:1"), parse_ratio("none")
        (4.0, None)
    """
    if text == "none":
        return None
    try:
        ratio = float(text.removesuffix(":1"))
    except ValueError:
        ratio = math.nan
    if not math.isfinite(ratio):
        raise StyleError(
            tr("{text!r} is not a lighting ratio.", text=text),
            tr("Enter a ratio such as 4:1, or none."),
        )
    return ratio


SIZE_KEYS: Final = (
    "paper", "hard", "medium", "large",
    "dish@1", "softbox@1", "umbrella@1.5", "octabox@1.5", "window@3",
)  # fmt: skip
"""Available lamp sizes, in the format of `parse_softness`."""

RATIO_KEYS: Final = ("none", *(f"{ratio:g}:1" for ratio in RATIOS))
"""Available lighting ratios, in the format of `parse_ratio`."""


def choice_keys(studio: Studio) -> tuple[str, str]:
    """Format the lamp size and the lighting ratio for `parse_softness` and `parse_ratio`."""
    size, ratio = studio.softness_deg, "none" if studio.ratio is None else f"{studio.ratio:g}:1"
    same = [key for key in SIZE_KEYS if parse_softness(key) == size]
    return same[0] if same else f"{size:g}", ratio


def studio_lamps(style: Style, studio: Studio) -> tuple[StyleLamp, ...]:
    """Return the lamps of a style in a studio, fill last."""
    lamps = style.lamps
    if studio.softness_deg is not None:
        lamps = tuple(replace(lamp, diameter_deg=studio.softness_deg) for lamp in lamps)
    if studio.ratio is None:
        return lamps
    key = max(lamps, key=lambda lamp: lamp.power)
    power = key.power / (studio.ratio - 1.0)
    return (*lamps, StyleLamp(0.0, 0.0, _FILL_DEG, power, key.distance_m))


def studio_light(style: Style, studio: Studio, shape: tuple[int, int]) -> Float64:
    """Return the environment of a style in a studio, (H, W) float64 radiance at turn 0.

    The power of a lamp is the reading of an incident light meter pointed at the lamp.
    """
    radiance = np.zeros(shape)
    for lamp in studio_lamps(style, studio):
        cap = 0.5 * (1.0 + math.cos(math.radians(lamp.diameter_deg) / 2.0))
        radiance += far_lamp(lamp, shape) / cap
    return radiance


@lru_cache(maxsize=256)
def far_lamp(lamp: StyleLamp, shape: tuple[int, int]) -> Float64:
    """Return the environment of one distant lamp of a style, at turn 0.

    Args:
        lamp: The lamp. Its azimuth is positive towards the sitter's left, unlike azimuths in the
            panorama.
        shape: Shape (H, W) of the environment.

    Returns:
        (H, W) float64. Radiance of a round lamp with the given diameter, drawn on the texel grid
        with its exact area. Radiance times solid angle sums to the power of the lamp.
    """
    height, width = shape
    azimuth = 2 * np.pi * ((np.arange(width * _FINE) + 0.5) / (width * _FINE) - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height * _FINE) + 0.5) / (height * _FINE))
    at, up = np.radians(-lamp.azimuth_deg), np.radians(lamp.elevation_deg)
    radius = np.radians(max(lamp.diameter_deg, _LEAST_DIAMETER_DEG)) / 2
    # Use only the rows of texels that the lamp covers.
    near = (np.abs(elevation - up) <= radius).reshape(height, _FINE).any(axis=1)
    elevation = elevation.reshape(height, _FINE)[near].ravel()
    cosine = np.sin(up) * np.sin(elevation)[:, None] + np.cos(up) * np.outer(
        np.cos(elevation), np.cos(azimuth - at)
    )
    power = (cosine >= np.cos(radius)) * np.cos(elevation)[:, None]
    texels = np.zeros(shape)
    texels[near] = power.reshape(-1, _FINE, width, _FINE).sum(axis=(1, 3))
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    solid_angle = (2 * np.pi / width) * (edges[:-1] - edges[1:])
    radiance = lamp.power * texels / texels.sum() / solid_angle[:, None]
    radiance.flags.writeable = False
    return np.asarray(radiance)


def mirror_index(styles: Sequence[Style], style: Style) -> int | None:
    """Return the index of the style whose lamps mirror those of `style`, or None if none does."""
    target = sorted(_facts(lamp, -1.0) for lamp in style.lamps)
    for position, other in enumerate(styles):
        if sorted(_facts(lamp) for lamp in other.lamps) == target:
            return position
    return None


def mirror_rows(styles: Sequence[Style]) -> list[int]:
    """Return the index of each style's mirror image, or its own index if there is none."""
    twins = (mirror_index(styles, style) for style in styles)
    return [row if twin is None else twin for row, twin in enumerate(twins)]


def _facts(lamp: StyleLamp, side: float = 1.0) -> tuple[float, ...]:
    around = lamp.azimuth_deg if lamp.azimuth_deg == 180.0 else side * lamp.azimuth_deg
    return (around, lamp.elevation_deg, lamp.diameter_deg, lamp.power, lamp.distance_m)
