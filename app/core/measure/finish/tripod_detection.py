"""Detect clutter below the camera in a panorama, such as a stick, a tripod or a person.

An object at the camera's own foot is detected by its difference from the ground around it. The
colours in a ring around the foot are counted in a smoothed histogram of log luminance and two log
colour ratios. Texels at the foot whose colours are rare in the ring and similar to one another are
followed outwards for as long as they are connected. A strip, a mosaic or a shadow that crosses both
the foot and the ring has common colours, so it is not suggested. A person further away from the
camera cannot be distinguished from a statue or a tree in this way and needs a manual mask.

OpenCV's stock people detector (Dalal and Triggs 2005) was tried and rejected: on 25 panoramas it
detected one of several people, along with a potted plant, a kitchen and a stone post.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np

from app.core.base import colour
from app.core.base.arrays import Bools, Bytes, Float64, Indices
from app.core.base.colour import FloatImage
from app.core.base.errors import ProbeError
from app.core.base.sphere import bounded, direction
from app.core.environment.environment import solid_angles
from app.core.measure.finish.masks import MaskSpec, draw_mask
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import Chart, azimuth_elevation
from app.core.text import tr

NADIR: Final = (0.0, -90.0)
"""Azimuth and elevation of the direction straight down, in degrees."""

_REACH_DEG: Final = 85.0
_SIDE: Final = 340
_WIDEST: Final = 768
_RING_DEG: Final = (32.0, 60.0)
_CORE_DEG: Final = 10.0
_FOOT_DEG: Final = 20.0
_SECTORS: Final = 12
_BINS: Final = 32
_STEP: Final = (0.3, 0.08, 0.08)  # stops of luminance, of red to green, of blue to green
_SPREAD: Final = 1.3  # bins
# Powers of ten by which a colour is rarer in the ring than the ring's most common one.
_RARE: Final = 1.6
_STRANGE: Final = 2.4
_LIKE_CORE: Final = 0.5
_CLEAR: Final = 0.8
_SHARP: Final = 4.0  # cells
_CERTAIN: Final = 4.0
_LEAST_SHARE: Final = 0.12
_LEAST_SR: Final = 0.004
_MOST_SR: Final = 2.6
_GROW_DEG: Final = 1.5
_NEAR_DEG: Final = 45.0


@dataclass(frozen=True, slots=True)
class Suggestion:
    """The extent of a suspected tripod or person.

    Attributes:
        reach_deg: How far the object reaches from the camera's foot, in degrees.
        azimuth_deg: Azimuth of a person, or None for a stick, a tripod or a hand.
    """

    reach_deg: float
    azimuth_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Clutter:
    """An unwanted object in the panorama.

    Attributes:
        origin: The manual mask or the suggestion.
        mask: (H, W) float32. Fraction of each panorama texel that the object covers, 0 to 1.
        confidence: Confidence from 0 to 1; always 1 for a manual mask.
    """

    origin: MaskSpec | Suggestion
    mask: FloatImage = field(repr=False)
    solid_angle_sr: float
    confidence: float


@dataclass(frozen=True, slots=True)
class _Detection:
    """A region on the chart, together with its measurements."""

    area: Bools
    inside: float
    outside: float


def suggest(merged: MergedLight, foot: tuple[float, float] = NADIR) -> tuple[Clutter, ...]:
    """Suggest a mask for the stick, tripod or person connected to the camera's foot.

    There is at most one suggestion. There is none if the ground at the foot looks like its
    surroundings or the picture is not a panorama. A suggestion comes with a confidence value, and
    it may not cover everybody in the picture.

    Args:
        foot: Azimuth and elevation of the camera's own foot, in degrees. This is the nadir unless
            the camera was tilted and the picture was levelled.
    """
    shape = (merged.radiance.shape[0], merged.radiance.shape[1])
    if shape[1] != 2 * shape[0]:
        return ()
    light = bounded(merged.radiance, _WIDEST)
    chart = Chart(foot, _REACH_DEG, _SIDE, "equidistant")
    detection = _find(_features(chart.sample(light)), chart)
    if detection is None:
        return ()
    mask = _on_panorama(detection.area, chart, shape)
    size = float(mask.sum(axis=1, dtype=np.float64) @ solid_angles(shape))
    if not _LEAST_SR <= size <= _MOST_SR:
        return ()
    sure = min((detection.inside - _RARE) / (_CERTAIN - _RARE), 1.0)
    clear = min((detection.inside - detection.outside) / (2.0 * _CLEAR), 1.0)
    confidence = round(0.3 + 0.65 * math.sqrt(max(sure, 0.0) * max(clear, 0.0)), 2)
    return (Clutter(_suggestion(detection.area, chart), mask, size, confidence),)


def foot_of(rotation: Float64 | None) -> tuple[float, float]:
    """Return the azimuth and elevation, in degrees, of a camera's foot after levelling.

    Args:
        rotation: (3, 3). Rotation that was applied to the panorama's content, or None if it was not
            rotated.
    """
    if rotation is None:
        return NADIR
    return azimuth_elevation(rotation @ np.array([0.0, -1.0, 0.0]))


def resolve(
    specs: Sequence[MaskSpec], merged: MergedLight, foot: tuple[float, float] = NADIR
) -> tuple[Clutter, ...]:
    """Draw the user's masks and create the suggestions that were requested.

    Raises:
        ProbeError: If a mask's picture cannot be read, or the light is not a full panorama.
    """
    shape = (merged.radiance.shape[0], merged.radiance.shape[1])
    if specs and shape[1] != 2 * shape[0]:
        raise ProbeError(tr("Only a full panorama, twice as wide as it is high, can be masked."))
    clutter: list[Clutter] = []
    for spec in specs:
        if spec.kind == "suggested":
            clutter += suggest(merged, foot)
            continue
        mask = draw_mask(spec, shape)
        size = float(mask.sum(axis=1, dtype=np.float64) @ solid_angles(shape))
        clutter.append(Clutter(spec, mask, size, 1.0))
    return tuple(clutter)


def union(clutter: Sequence[Clutter], shape: tuple[int, int]) -> FloatImage:
    """Return the maximum of several masks at each texel, (H, W)."""
    whole = np.zeros(shape, np.float32)
    for each in clutter:
        np.maximum(whole, each.mask, out=whole)
    return whole


def _features(light: FloatImage) -> FloatImage:
    """Return log luminance and two log colour ratios, (side, side, 3), in stops."""
    bright = colour.luminance(light)
    # Ratios of nearly black values are noise, so a fiftieth of the usual level is added.
    floor = np.float32(0.02 * max(float(np.median(bright)), 1e-12))
    red, green, blue = (light[..., k] + floor for k in range(3))
    return np.stack(
        [np.log2(bright + floor), np.log2(red / green), np.log2(blue / green)], axis=-1
    ).astype(np.float32)


def _find(features: FloatImage, chart: Chart) -> _Detection | None:
    """Follow an object outwards from the foot while its colours are rare in the surroundings."""
    away_deg = chart.distances()
    cells = _cells(features, _ring(away_deg))
    rare = _rare_in_ring(cells, away_deg)
    # A single texel is not evidence, but a shape two texels wide, like a tripod's leg, is.
    smooth = cv2.GaussianBlur(rare, (0, 0), 1.2)
    core = away_deg < _CORE_DEG
    seeds = core & (smooth > _RARE)
    if seeds.sum() < _LEAST_SHARE * core.sum():
        return None
    alike = cv2.GaussianBlur(rare - _rarity(_counts(cells, seeds))[cells], (0, 0), 1.2)
    object_like = (smooth > _STRANGE) | ((smooth > _RARE - 0.3) & (alike > _LIKE_CORE))
    area = _hanging_together(object_like & (away_deg < _REACH_DEG), seeds)
    # Farther out, walls and sky differ from the ground too, so keep only the near part's colours.
    like_near = rare - _rarity(_counts(cells, area & (away_deg < _NEAR_DEG)))[cells]
    near_or_like = (away_deg < _NEAR_DEG) | (like_near > _LIKE_CORE)
    area = _hanging_together(area & near_or_like & _same_side(area, away_deg), seeds)
    if not area.any():
        return None
    pixel = 2.0 * _REACH_DEG / _SIDE
    around = _grown(area, 6.0 / pixel) & ~_grown(area, 2.0 / pixel)
    inside = float(np.median(rare[area & (away_deg < _NEAR_DEG)]))
    outside = float(np.median(rare[around])) if around.any() else _CERTAIN
    if inside < _RARE or inside - outside < _CLEAR or _edge(features, area) < _SHARP:
        return None
    return _Detection(_grown(_without_holes(area), _GROW_DEG / pixel), inside, outside)


def _same_side(area: Bools, away_deg: FloatImage) -> Bools:
    """Limit an area far from the foot to the directions in which it also lies near the foot.

    This is necessary because the walls and the sky beyond the ground differ from the ground on
    every side.
    """
    sector = _sectors(24)
    near = area & (away_deg > _NEAR_DEG / 2.0) & (away_deg < _NEAR_DEG)
    share = np.bincount(sector[near], minlength=24) > 0.02 * max(float(near.sum()), 1.0)
    open_to = share | np.roll(share, 1) | np.roll(share, -1)
    return (away_deg < _NEAR_DEG) | open_to[sector]


def _edge(features: FloatImage, area: Bools) -> float:
    """Return the median colour step across an area's edge, in cells of the histogram.

    Ground that darkens gently towards the foot has no such step.
    """
    sides = []
    for part in (area, ~_grown(area, 3.0)):
        weight = part.astype(np.float32)
        total = cv2.GaussianBlur(features * weight[..., np.newaxis], (0, 0), 3.0)
        sides.append(total / (cv2.GaussianBlur(weight, (0, 0), 3.0) + 1e-6)[..., np.newaxis])
    rim = _grown(area, 2.0) & ~area
    steps = np.linalg.norm((sides[0] - sides[1]) / np.array(_STEP, np.float32), axis=-1)
    return float(np.median(steps[rim]))


def _sectors(count: int) -> Indices:
    """Return, for each chart pixel, the index of its sector out of `count` around the foot."""
    steps = np.arange(_SIDE) - (_SIDE - 1) / 2.0
    side = np.arctan2(steps[:, np.newaxis], steps[np.newaxis, :])
    whole: Indices = np.floor((side / (2.0 * np.pi) + 0.5) * count).astype(np.intp)
    return whole % count


def _ring(away_deg: FloatImage) -> Bools:
    return (away_deg > _RING_DEG[0]) & (away_deg < _RING_DEG[1])


def _cells(features: FloatImage, ring: Bools) -> Indices:
    """Return each texel's cell in the histogram, with the median of the ring in the middle."""
    middle = np.median(features[ring], axis=0)
    steps = (features - middle) / np.array(_STEP, np.float32) + _BINS / 2.0
    cells = np.clip(steps, 0.0, _BINS - 1).astype(np.intp)
    return np.asarray((cells[..., 0] * _BINS + cells[..., 1]) * _BINS + cells[..., 2])


def _counts(cells: Indices, among: Bools) -> FloatImage:
    return np.bincount(cells[among], minlength=_BINS**3).astype(np.float32)


def _rarity(counts: FloatImage) -> FloatImage:
    """Return the rarity of each cell's colour, from 0 (the most common) to 6 (absent)."""
    away = np.subtract.outer(np.arange(_BINS), np.arange(_BINS))
    kernel = np.exp(-0.5 * (away / _SPREAD) ** 2).astype(np.float32)
    cube = counts.reshape(_BINS, _BINS, _BINS)
    for _ in range(3):
        cube = np.moveaxis(np.tensordot(kernel, cube, axes=1), 0, 2)
    usual = cube.ravel() / max(float(cube.max()), 1e-30)
    return np.asarray(-np.log10(usual + 1e-6), np.float32)


def _rare_in_ring(cells: Indices, away_deg: FloatImage) -> FloatImage:
    """Return each texel's rarity in the ring, ignoring the part of the ring on the texel's side.

    A person standing on that side takes up part of the ring, so their colours would be common in
    it. The foot itself is on no side, so there the side with the greatest rarity counts.
    """
    sector = _sectors(_SECTORS)
    ring = _ring(away_deg)
    parts = np.stack([_counts(cells, ring & (sector == k)) for k in range(_SECTORS)])
    whole = parts.sum(axis=0)
    rare = np.zeros(cells.shape, np.float32)
    foot = away_deg < _FOOT_DEG
    for k in range(_SECTORS):
        near = [(k + step) % _SECTORS for step in (-1, 0, 1)]
        table = _rarity(whole - parts[near].sum(axis=0))
        own = sector == k
        rare[own] = np.maximum(rare[own], table[cells[own]])
        rare[foot] = np.maximum(rare[foot], table[cells[foot]])
    return rare


def _hanging_together(area: Bools, seeds: Bools) -> Bools:
    """Return the parts of an area that contain enough seeds, closing gaps of a degree or two."""
    joint = cv2.morphologyEx(area.astype(np.uint8), cv2.MORPH_CLOSE, _disc(2.0))
    _, labels = cv2.connectedComponents(joint, connectivity=8)
    counts = np.bincount(labels[seeds & (joint > 0)], minlength=int(labels.max()) + 1)
    counts[0] = 0
    large = np.nonzero(counts >= max(0.1 * counts.sum(), 1.0))[0]
    return np.isin(labels, large)


def _without_holes(area: Bools) -> Bools:
    outlines, _ = cv2.findContours(area.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros(area.shape, np.uint8)
    cv2.drawContours(filled, outlines, -1, (1,), cv2.FILLED)
    return filled > 0


def _grown(area: Bools, pixels: float) -> Bools:
    return cv2.dilate(area.astype(np.uint8), _disc(pixels)) > 0


def _disc(radius: float) -> Bytes:
    side = 2 * round(radius) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)), np.uint8)


def _on_panorama(area: Bools, chart: Chart, shape: tuple[int, int]) -> FloatImage:
    mask = np.zeros(shape, np.float32)
    picture = area.astype(np.float32)
    for start in range(0, shape[0], 64):
        rows = slice(start, min(start + 64, shape[0]))
        top, low = 90.0 - start / shape[0] * 180.0, 90.0 - rows.stop / shape[0] * 180.0
        if max(low - chart.centre[1], chart.centre[1] - top) > 1.5 * chart.reach_deg:
            continue
        column, row = chart.place(shape, rows)
        mask[rows] = cv2.remap(picture, column, row, cv2.INTER_LINEAR, borderValue=(0.0,))
    return mask


def _suggestion(area: Bools, chart: Chart) -> Suggestion:
    """Measure the reach of a region, and its azimuth if the region is a person."""
    away = chart.distances()[area]
    far = float(np.percentile(away, 98.0))
    if far < _NEAR_DEG:
        return Suggestion(far)
    rows, columns = np.nonzero(area & (chart.distances() > _NEAR_DEG / 2.0))
    right, up, _ = chart.axes
    side = float((columns - (_SIDE - 1) / 2.0).mean()) * right
    side = side + float(((_SIDE - 1) / 2.0 - rows).mean()) * up
    azimuth = azimuth_elevation(side + 1e-9 * direction(*chart.centre))[0]
    return Suggestion(far, azimuth)
