"""Far lamps as environments, and the share of each lamp of a style in a picture.

A style with several lamps can match well on the strength of one of them: half a badger is still
fairly like a badger. So its lamps are also measured one by one, by fitting the lamps' own
pictures to the picture at hand. That fit is linear in the light, hence one more pre-integrated
map per lamp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.transport import preintegrate, render

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.styles import Style, StyleLamp
    from app.core.transport import Transport

__all__ = ["LampMaps", "far_lamp", "fit_lamps"]

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_FINE: Final = 8  # samples per texel and direction
_FILL_POWER: Final = 0.5  # a lamp of less than half the key's power only fills; it may be missing
_LEAST_DIAMETER_DEG: Final = 2.0


@dataclass(frozen=True, slots=True)
class LampMaps:
    """Pre-integrated maps that measure single lamps of styles.

    Attributes
    ----------
    maps : (K, H, W) float32
        Times an environment: how much of the lamp's own picture is in the face's picture.
    style : (K,) int32
        Position of the style that each lamp belongs to.
    ratio : (K,) float64
        The measure over the mean of the face in the style's target picture.
    """

    maps: Float32
    style: NDArray[np.int32]
    ratio: Float64


def far_lamp(lamp: StyleLamp, shape: tuple[int, int]) -> Float64:
    """Environment of one lamp of a style, moved far away, at turn 0.

    Parameters
    ----------
    lamp : StyleLamp
        Its azimuth counts toward the sitter's left, against the panorama's.
    shape : tuple of int
        (H, W) of the environment.

    Returns
    -------
    (H, W) float64
        Radiance of a round lamp of the lamp's diameter, true to area on the texel grid, whose
        radiance times solid angle sums to the lamp's power.
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
    radiance: Float64 = lamp.power * texels / texels.sum() / solid_angle[:, None]
    return radiance


def fit_lamps(transport: Transport, styles: Sequence[Style], luminance: Float64) -> LampMaps:
    """Make the maps for all styles with several lamps.

    Parameters
    ----------
    transport : Transport
        Of the head.
    styles : sequence of Style
        S styles.
    luminance : (S, P) float64
        Their target pictures on the head's pixels.

    Returns
    -------
    LampMaps
        For each lamp that is more than a fill light in a style of several such lamps.
    """
    maps: list[Float32] = []
    rows: list[int] = []
    ratios: list[float] = []
    face = transport.face
    for row, style in enumerate(styles):
        lamps = _main_lamps(style)
        if len(lamps) < 2:
            continue
        duals = _duals(transport, lamps)
        shares = duals @ luminance[row] / luminance[row, face].mean()
        if (shares <= 0).any():
            continue  # the target does not show its own lamps; there is nothing to measure by
        maps += [preintegrate(transport, dual) for dual in duals]
        rows += [row] * len(lamps)
        ratios += shares.tolist()
    empty = np.zeros((0, *transport.environment_shape), np.float32)
    return LampMaps(
        maps=np.stack(maps) if maps else empty,
        style=np.array(rows, np.int32),
        ratio=np.array(ratios, np.float64),
    )


def _main_lamps(style: Style) -> list[StyleLamp]:
    strongest = max(lamp.power for lamp in style.lamps)
    return [lamp for lamp in style.lamps if lamp.power >= _FILL_POWER * strongest]


def _duals(transport: Transport, lamps: Sequence[StyleLamp]) -> Float64:
    """(K, P) weights whose sums with a picture are the least-squares shares of the lamps."""
    face = transport.face
    pictures = np.stack(
        [render(transport, far_lamp(lamp, transport.environment_shape)) for lamp in lamps]
    ).astype(np.float64)
    pictures -= pictures[:, face].mean(axis=1, keepdims=True)
    pictures[:, ~face] = 0.0
    duals: Float64 = np.linalg.solve(pictures @ pictures.T, pictures)
    return duals
