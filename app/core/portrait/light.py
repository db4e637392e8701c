"""The light of a place, prepared for portraits: soft light, lamps with sharp shadows, and sheen.

Everything here is computed once for each place. A turn only shifts columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Float64, Floats, Indices
from app.core.base.colour import luminance
from app.core.base.sphere import wrapped
from app.core.measure.finish.lamp_detection import components
from app.core.styles.style import StyleLamp

ROWS: Final = 24
"""Number of rows in the soft light's grid, which has fewer columns towards the poles."""
COLUMNS: Final = 48
_LEAST_COLUMNS: Final = 6
_FINE: Final = (128, 256)
_BRIGHT: Final = 6.0
"""Minimum brightness of a lamp, relative to the mean brightness of the sky."""
_SHARE: Final = 0.01
"""Minimum fraction of the total light that a lamp must provide."""
_LARGEST: Final = np.pi * math.radians(6.0) ** 2
"""Largest size of a lamp: 6 degrees in radius. Larger lamps make soft edges on a face anyway."""
_WIDEST: Final = math.radians(11.0)
"""Radius of a studio lamp up to which nodes know how much of the lamp is visible."""
_LEAST_RADIUS: Final = 0.0046
SHARP: Final = 8
"""Number of lamps with sharp shadows; all others are part of the soft light."""
GLINTS: Final = 4
"""Number of lamps whose reflections on skin are computed individually."""
ROUGHNESS: Final = 0.3
_BLURS: Final = (ROUGHNESS / 2, ROUGHNESS)
"""Roughness of the sheen. At grazing angles, its lobe is narrower than from directly above."""
_CORNEA: Final = 0.04
"""Roughness of the tear film, including the angle that a pixel covers on the curved cornea."""
SHEEN: Final = (64, 128)
"""Number of rows and columns of the light blurred by the skin's sheen."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """A small bright light in the panorama.

    Attributes:
        azimuth, elevation, radius: Direction and angular radius, in radians, at turn 0.
        flux: (3,) float32. Radiance multiplied by solid angle.
    """

    azimuth: float
    elevation: float
    radius: float
    flux: Float32 = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class PortraitLight:
    """The light of a place, prepared for portraits.

    Attributes:
        rows: (ROWS, w + 1, 3) float32. Light in the grid's rows without the first `SHARP` lamps,
            cumulative along the azimuth, per steradian.
        lamps: The lamps, brightest first.
        sheen: (h, w + 2, 6) float32. The light without the first `GLINTS` lamps, blurred by the
            skin, at grazing angles and from directly above. It is padded on each side with a column
            from the opposite end.
        panorama: (h, w + 2, 3) float32. The light for reflections in the eyes, including lamps,
            padded in the same way.
    """

    rows: Float32 = field(repr=False)
    lamps: tuple[Lamp, ...]
    sheen: Float32 = field(repr=False)
    panorama: Float32 = field(repr=False)


def portrait_light(panorama: Floats) -> PortraitLight:
    """Prepare a panorama for portraits.

    Args:
        panorama: (H, W, 3) float. Linear Rec. 709 radiance at turn 0.
    """
    whole = np.asarray(panorama, np.float32)
    fine = _resized(whole, _FINE)
    lamps = _lamps(fine, whole)
    rest, sheen = (_without(fine, lamps[:count]) for count in (SHARP, GLINTS))
    return _prepare(rest, sheen, fine, [lamp for lamp, _ in lamps])


def _prepare(rest: Float32, sheen: Float32, fine: Float32, lamps: list[Lamp]) -> PortraitLight:
    skin = np.concatenate([blurred(sheen, one) for one in _BLURS], axis=2)
    eye = blurred(fine, _CORNEA, tails=True)
    return PortraitLight(_summed_rows(rest), tuple(lamps), wrapped(skin, 1), wrapped(eye, 1))


def _without(fine: Float32, lamps: Iterable[tuple[Lamp, Bools]]) -> Float32:
    rest = fine.copy()
    for _, where in lamps:
        rest[where] = 0
    return rest


def lamps_light(lamps: Iterable[StyleLamp]) -> PortraitLight:
    """Prepare distant studio lamps for portraits, converting large lamps to soft light."""
    kept_lamps, rest = [], np.zeros((*_FINE, 3), np.float32)
    for lamp in lamps:
        radius = max(math.radians(lamp.diameter_deg / 2), _LEAST_RADIUS)
        # A style's azimuth increases towards the sitter's left, a panorama's towards the right.
        at = math.radians(-lamp.azimuth_deg), math.radians(lamp.elevation_deg)
        one = Lamp(*at, radius, np.full(3, lamp.power, np.float32))
        if radius <= _WIDEST:
            kept_lamps.append(one)
        else:
            _lay(rest, one)
    panorama = rest.copy()
    for one in kept_lamps:
        _lay(panorama, one)
    return _prepare(rest, rest, panorama, kept_lamps)


def _lay(panorama: Float32, lamp: Lamp) -> None:
    """Draw a lamp as a disc of at least one texel in a panorama for reflections in the eyes."""
    rows, columns = panorama.shape[:2]
    up = (np.pi / 2 - (np.arange(rows) + 0.5) / rows * np.pi)[:, None]
    round_ = ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * np.pi - lamp.azimuth
    cosine = np.sin(up) * math.sin(lamp.elevation)
    cosine = cosine + np.cos(up) * math.cos(lamp.elevation) * np.cos(round_)
    where = cosine >= min(math.cos(lamp.radius), float(cosine.max()))
    panorama[where] += lamp.flux / _solid_angles(rows, columns)[where].sum()


@lru_cache(maxsize=1)
def grid() -> tuple[Float64, Float64, Float64, Float64]:
    """Return the row, azimuth, width and solid angle for each of the soft light's cells, (G,) each.

    The azimuths and widths are in radians, the solid angles in steradians.
    """
    edges = np.pi / 2 - np.arange(ROWS + 1) * np.pi / ROWS
    counts = [
        max(_LEAST_COLUMNS, 2 * round(COLUMNS / 2 * math.cos((a + b) / 2)))
        for a, b in pairwise(edges)
    ]
    row = np.repeat(np.arange(ROWS), counts).astype(float)
    width = 2 * np.pi / np.repeat(counts, counts)
    azimuth = np.concatenate([((np.arange(n) + 0.5) / n - 0.5) * 2 * np.pi for n in counts])
    band = np.sin(edges[:-1]) - np.sin(edges[1:])
    return row, azimuth, width, band[row.astype(int)] * width


@lru_cache(maxsize=1)
def mirrored_cells() -> Indices:
    """Return the index of each cell's mirror image, (G,)."""
    row, azimuth, _, _ = grid()
    return np.lexsort((-azimuth, row))


def soft_light(light: PortraitLight, turn_deg: float) -> Float32:
    """Return the mean radiance of each cell in the grid at a turn, (G, 3)."""
    row, azimuth, width, _ = grid()
    columns = light.rows.shape[1] - 1
    place = row.astype(np.intp)

    def summed(to: Float64) -> Float64:
        turns, part = np.divmod((to + math.radians(turn_deg)) / (2 * np.pi) + 0.5, 1.0)
        at = part * columns
        low = np.minimum(at.astype(np.intp), columns - 1)
        share = (at - low)[:, None]
        before, after = light.rows[place, low], light.rows[place, low + 1]
        return np.asarray(
            before + share * (after - before) + turns[:, None] * light.rows[place, -1]
        )

    total = summed(azimuth + width / 2) - summed(azimuth - width / 2)
    return np.asarray(total / (width[:, None] / (2 * np.pi)), np.float32)


def _resized(panorama: Float32, shape: tuple[int, int]) -> Float32:
    smaller = panorama.shape[0] > shape[0]
    way = cv2.INTER_AREA if smaller else cv2.INTER_NEAREST
    return np.asarray(cv2.resize(panorama, shape[::-1], interpolation=way), np.float32)


def _solid_angles(rows: int, columns: int) -> Float64:
    edges = np.cos(np.arange(rows + 1) * np.pi / rows)
    return np.repeat(((edges[:-1] - edges[1:]) * 2 * np.pi / columns)[:, None], columns, axis=1)


def _lamps(fine: Float32, whole: Float32) -> list[tuple[Lamp, Bools]]:
    """Find the lamps in a panorama, with a mask of each lamp, brightest first.

    The search proceeds from the brightest lamp downwards, so that the sun is found within its own
    glow.
    """
    solid = _solid_angles(*fine.shape[:2])
    lamps: list[tuple[Lamp, Bools]] = []
    grey = luminance(fine).astype(np.float64)
    total = float((grey * solid).sum())
    least = _BRIGHT * total / (4 * np.pi)
    steps = math.ceil(math.log2(grey.max() / least)) if total > 0 else 0
    for level in (least * 2.0**step for step in range(steps - 1, -1, -1)):
        label, count = components(grey > level)
        wider, _ = components(grey > level / 4)
        shares = np.bincount(label.ravel(), (grey * solid).ravel(), count + 1) / total
        sizes = np.bincount(wider.ravel(), solid.ravel())
        # A spot with too little light is not a lamp even with its soft edge.
        for number in np.flatnonzero(shares[1:] >= _SHARE / 2) + 1:
            spot = label == number
            around = int(wider[spot].max())
            # Include the soft edge, unless that is a bright wall.
            where = wider == around if sizes[around] <= _LARGEST else spot
            share = float((grey[where] * solid[where]).sum()) / total
            if share >= _SHARE and solid[where].sum() <= _LARGEST:
                lamps.append((_lamp(whole, where), where))
                grey[where] = 0
    lamps.sort(key=lambda one: -float(one[0].flux.sum()))
    return lamps


def _lamp(whole: Float32, where: Bools) -> Lamp:
    # Use the panorama itself, since half a degree matters in grazing light.
    fine = whole if whole.shape[0] > where.shape[0] else _resized(whole, _FINE)
    rows, columns = fine.shape[:2]
    grown = cv2.resize(where.view(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST)
    where = grown > 0
    solid = _solid_angles(rows, columns)
    row, column = np.nonzero(where)
    up = np.pi / 2 - (row + 0.5) / rows * np.pi
    round_ = ((column + 0.5) / columns - 0.5) * 2 * np.pi
    colour = fine[where] * solid[where][:, None]
    weight = luminance(colour)
    level = np.cos(up) * weight
    x, y, z = (
        float(v.sum())
        for v in (level * np.sin(round_), np.sin(up) * weight, level * np.cos(round_))
    )
    # The lamp is as wide as its light: a sun that fills part of a texel is smaller than the texel.
    size = float(weight.sum() ** 2 / (weight**2 / solid[where]).sum())
    radius = math.sqrt(size / np.pi)
    if len(row) <= 2:
        radius = min(radius, _LEAST_RADIUS)
    return Lamp(
        math.atan2(x, z),
        math.atan2(y, math.hypot(x, z)),
        max(radius, _LEAST_RADIUS),
        np.asarray(colour.sum(axis=0), np.float32),
    )


def _summed_rows(rest: Float32) -> Float32:
    rows, columns = rest.shape[:2]
    edges = np.linspace(0, rows, ROWS + 1)
    overlap = np.clip(
        np.minimum(edges[1:, None], np.arange(1, rows + 1))
        - np.maximum(edges[:-1, None], np.arange(rows)),
        0,
        1,
    )
    overlap = overlap * _solid_angles(rows, columns)[:, 0]
    mean = np.einsum("gr,rck->gck", overlap / overlap.sum(axis=1, keepdims=True), rest)
    sums = np.cumsum(mean, axis=1) / columns
    return np.asarray(np.concatenate([np.zeros_like(sums[:, :1]), sums], axis=1), np.float32)


def blurred(rest: Float32, roughness: float, *, tails: bool = False) -> Float32:
    """Blur a panorama with the reflection lobe of a rough surface.

    The lobe is that of a surface seen from directly above, as in Karis, Real Shading in Unreal
    Engine 4, SIGGRAPH 2013, with Beckmann's distribution of facets or, with long tails, GGX.

    Args:
        rest: (H, 2 H, 3) float32. Linear radiance.

    Returns:
        (h, w, 3) float32 in the size `SHEEN`, without negative values.
    """
    spectrum = np.fft.rfft(_resized(rest, SHEEN), axis=1)
    mixed = np.einsum("mij,jmc->imc", _lobe(roughness, tails), spectrum)
    # Rounding alone would make some values slightly negative.
    return np.maximum(np.fft.irfft(mixed, SHEEN[1], axis=1), 0).astype(np.float32)


@lru_cache(maxsize=4)
def _lobe(roughness: float, tails: bool) -> Float64:
    """Return the matrix that mixes a panorama's rows at each azimuth frequency, (M, rows, rows)."""
    rows, columns = SHEEN
    up = np.pi / 2 - (np.arange(rows) + 0.5) * np.pi / rows
    apart = np.arange(columns) * 2 * np.pi / columns
    level = np.cos(up)[:, None, None] * np.cos(up)[None, :, None] * np.cos(apart)
    cosine = np.clip(np.sin(up)[:, None, None] * np.sin(up)[None, :, None] + level, -1, 1)
    half = np.maximum((1 + cosine) / 2, 1e-6)  # squared cosine of the facet's angle
    if tails:
        facets = 1 / (half * (roughness**2 - 1) + 1) ** 2
    else:
        facets = np.exp(-(1 - half) / half / roughness**2) / half**2
    weight = facets * np.maximum(cosine, 0) * _solid_angles(rows, columns)[:, 0][None, :, None]
    weight /= weight.sum(axis=(1, 2), keepdims=True)
    return np.asarray(np.fft.rfft(weight, axis=2).real.transpose(2, 0, 1))
