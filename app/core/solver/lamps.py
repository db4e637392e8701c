"""Far lamps as environments, and the single lamps of a style in a picture.

A style with several lamps can match well on the strength of one of them: half a badger is still
fairly like a badger. So the bright part of its target is also split among its lamps, and each
lamp's part is held against the dark part by weights of its own, pre-integrated like any others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64
from app.core.solver.styles import Style, StyleLamp, mirror
from app.core.solver.transport import Transport, render

if TYPE_CHECKING:
    from app.core.solver.search import SearchColours


_FINE: Final = 8  # samples per texel and direction
_FILL_POWER: Final = 0.5  # a lamp of less than half the key's power only fills; it may be missing
_LEAST_DIAMETER_DEG: Final = 2.0
_SHARPNESS: Final = 8


@dataclass(frozen=True, slots=True)
class LampMaps:
    """Pre-integrated weights of single lamps of styles.

    Attributes:
        maps: (K, Q, W) float32. Times light as the search sees it: how much brighter the lamp's
            part of the face is than the part that the style leaves dark.
        style: (K,) int32. Position of the style that each lamp belongs to.
        ratio: (K,) float64. The same over the mean of the face, in the style's target picture.
    """

    maps: Float32
    style: NDArray[np.int32]
    ratio: Float64


@dataclass(frozen=True, slots=True)
class LampWeights:
    """Weights of a single lamp of a style.

    Attributes:
        weights: (P,) float64. Mean over the lamp's part of the face minus mean over the part that
            the style leaves dark.
    """

    style: int
    lamp: StyleLamp
    weights: Float64
    ratio: float


def far_lamp(lamp: StyleLamp, shape: tuple[int, int]) -> Float64:
    """Environment of one lamp of a style, moved far away, at turn 0.

    Args:
        lamp: Its azimuth counts toward the sitter's left, against the panorama's.
        shape: (H, W) of the environment.

    Returns:
        (H, W) float64. Radiance of a round lamp of the lamp's diameter, true to area on the texel
        grid, whose radiance times solid angle sums to the lamp's power.
    """
    height, width = shape
    azimuth = 2 * np.pi * ((np.arange(width * _FINE) + 0.5) / (width * _FINE) - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height * _FINE) + 0.5) / (height * _FINE))
    at, up = np.radians(-lamp.azimuth_deg), np.radians(lamp.elevation_deg)
    cosine = np.sin(up) * np.sin(elevation)[:, None] + np.cos(up) * np.outer(
        np.cos(elevation), np.cos(azimuth - at)
    )
    radius = np.radians(max(lamp.diameter_deg, _LEAST_DIAMETER_DEG)) / 2
    power = (cosine >= np.cos(radius)) * np.cos(elevation)[:, None]
    texels = power.reshape(height, _FINE, width, _FINE).sum(axis=(1, 3))
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    solid_angle = (2 * np.pi / width) * (edges[:-1] - edges[1:])
    return np.asarray(lamp.power * texels / texels.sum() / solid_angle[:, None])


def split_lamps(
    transport: Transport,
    colours: SearchColours,
    styles: Sequence[Style],
    luminance: Float64,
    weights: Float64,
) -> LampMaps:
    """Make the maps for all styles with several lamps.

    Args:
        luminance, weights: (S, P) float64. Their target pictures on the head's pixels, and the
            weights f made of them.

    Returns:
        For each lamp that is more than a fill light in a style of several such lamps.
    """
    found = [
        _Part(one.style, one.lamp, colours.integrate(one.weights), one.ratio)
        for one in lamp_weights(transport, styles, luminance, weights)
    ]
    if transport.header.symmetric:
        found = _mirror_exact(styles, found)
    empty = np.zeros((0, colours.rows, transport.environment_shape[1]), np.float32)
    return LampMaps(
        maps=np.stack([part.map for part in found]) if found else empty,
        style=np.array([part.style for part in found], np.int32),
        ratio=np.array([part.ratio for part in found], np.float64),
    )


def lamp_weights(
    transport: Transport, styles: Sequence[Style], luminance: Float64, weights: Float64
) -> tuple[LampWeights, ...]:
    """Split the styles with several lamps among them.

    Args:
        luminance, weights: (S, P) float64. Their target pictures on the head's pixels, and the
            weights f made of them.

    Returns:
        Style by style, for each lamp that is more than a fill light among several such lamps.
    """
    found: list[LampWeights] = []
    for row, style in enumerate(styles):
        lamps = _main_lamps(style)
        if len(lamps) < 2:
            continue
        parts = _parts(transport, lamps, weights[row])
        shares = parts @ luminance[row] / luminance[row, transport.face].mean()
        # A target that does not show its own lamps gives nothing to measure by.
        if (shares > 0).all():
            found += [
                LampWeights(row, lamp, part, float(share))
                for lamp, part, share in zip(lamps, parts, shares, strict=True)
            ]
    return tuple(found)


def mirror_index(styles: Sequence[Style], style: Style) -> int | None:
    """Return the position of the style with the mirrored lamps, None where there is none."""
    wanted = sorted(mirror(style).lamps, key=_order)
    for position, other in enumerate(styles):
        if sorted(other.lamps, key=_order) == wanted:
            return position
    return None


def _order(lamp: StyleLamp) -> tuple[float, float, float]:
    return (lamp.azimuth_deg, lamp.elevation_deg, lamp.power)


@dataclass(frozen=True, slots=True)
class _Part:
    style: int
    lamp: StyleLamp
    map: Float32
    ratio: float


def _mirror_exact(styles: Sequence[Style], parts: list[_Part]) -> list[_Part]:
    """Take what rounding has left off mirror symmetry."""
    place = {(part.style, part.lamp): part for part in parts}
    exact = []
    for part in parts:
        there = mirror_index(styles, styles[part.style])
        flipped = -part.lamp.azimuth_deg if part.lamp.azimuth_deg % 180 else part.lamp.azimuth_deg
        other = place.get((-1 if there is None else there, replace(part.lamp, azimuth_deg=flipped)))
        if other is not None:
            both = 0.5 * (part.map + other.map[:, ::-1])
            part = replace(part, map=both, ratio=0.5 * (part.ratio + other.ratio))
        exact.append(part)
    return exact


def _main_lamps(style: Style) -> list[StyleLamp]:
    strongest = max(lamp.power for lamp in style.lamps)
    return [lamp for lamp in style.lamps if lamp.power >= _FILL_POWER * strongest]


def _parts(transport: Transport, lamps: Sequence[StyleLamp], weights: Float64) -> Float64:
    """(K, P) weights: mean over a lamp's bright part minus mean over the dark part."""
    shape = transport.environment_shape
    pictures = np.stack([render(transport, far_lamp(lamp, shape)) for lamp in lamps])
    pictures = np.maximum(pictures.astype(np.float64), 0.0)
    shares = pictures / np.maximum(pictures.sum(axis=0), 1e-30)
    # Where two lamps overlap the picture tells nothing of either.
    bright = np.maximum(weights, 0.0) * shares**_SHARPNESS
    dark = np.maximum(-weights, 0.0)
    bright /= np.maximum(bright.sum(axis=1, keepdims=True), 1e-30)
    return np.asarray(bright - dark / max(float(dark.sum()), 1e-30))
