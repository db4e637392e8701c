"""Calibrate two back-to-back fisheye lenses from their own pictures.

The circles follow from the rim. The focal length, the roll and the tilt follow from the area beyond
90 degrees that both lenses see. The residual is parallax.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64
from app.core.base.colour import luminance
from app.core.base.sphere import from_vector
from app.core.measure.fisheye.blending import equalise, find_seam
from app.core.measure.fisheye.circles import Circles, FisheyeLens, FisheyeModel, bent
from app.core.measure.fisheye.lens_pair import (
    AROUND,
    STEP_DEG,
    Pair,
    about_axis,
    seam_directions,
    seam_rows,
)
from app.core.measure.read.frame import MergedLight

_INSIDE: Final = 0.99  # fraction of the radius that is used
_FIELDS: Final = (186.0, 190.0, 194.0, 198.0, 202.0, 206.0, 210.0)
_SEARCH: Final = 10  # search range in samples, in both directions
_BLOCK: Final = 60  # samples, which cover 15 degrees
_LEAST_SCORE: Final = 0.6
_SPREAD_DEG: Final = 0.4  # standard deviation of matches that parallax causes, in degrees
_TILT_DEG: Final = 0.7
_PRIOR_WEIGHT: Final = 0.3  # weight, in matches, of zero parallax where nothing is known
_ALIKE_DEG: Final = 1.25
_ROLL: Final = 10  # samples by which circles may deviate from quarter turns
_SIDEWAYS_DEG: Final = 0.5  # a larger shift is a wrong match, since parallax is never sideways
_MOST_PARALLAX_DEG: Final = 1.5

_FRONT: Final = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
_BACK: Final = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])


def calibrate(merged: MergedLight, circles: Circles, model: FisheyeModel) -> Pair:
    """Calibrate the lenses of an unstitched picture, using its merged light."""
    light = np.ascontiguousarray(merged.radiance)
    tones = _tones(light, circles)
    pair = _nominal(tones, circles, model)
    for _ in range(3):
        matches = _matches(tones, pair)
        pair = _refined(pair, matches, model)
    matches = _matches(tones, pair)
    pair = replace(
        pair,
        field_deg=_field(pair, circles, min(tones.shape)),
        blocks=len(matches.around),
        parallax=_parallax_of(matches),
    )
    pair = equalise(light, merged.clipped, pair)
    return replace(pair, seam=find_seam(light, pair))


def _tones(light: Float32, circles: Circles) -> Float32:
    """Return locally normalised log luminance, in which objects look alike through both lenses."""
    level = np.maximum(luminance(light), 0.0)
    height, width = level.shape
    side = min(height, width)
    inside = np.zeros((height, width), np.uint8)
    for x, y in circles.centres:
        at = (round(x * side - 0.5), round(y * side - 0.5))
        cv2.circle(inside, at, int(_INSIDE * circles.radius * side), 1.0, cv2.FILLED)
    mask = inside.astype(np.float32)
    floor = max(float(np.median(level[inside > 0])) * 0.05, 1e-9)
    # As fine as the strips, for circles that are about 200 degrees wide.
    sample = STEP_DEG * side / 200.0
    tones = cv2.GaussianBlur(np.log2(level + floor), (0, 0), max(0.6 * sample, 0.3)) * mask
    # The rim is not an object, so the levels are those of the area inside it.
    wide = (0, 0), max(side, 200) / 40.0
    mean = cv2.GaussianBlur(tones, *wide) / np.maximum(cv2.GaussianBlur(mask, *wide), 1e-3)
    return np.asarray((tones - mean) * mask, np.float32)


def _nominal(tones: Float32, circles: Circles, model: FisheyeModel) -> Pair:
    """Choose the field and roll for which most seam positions look alike in both lenses."""
    fields = (model.field_deg,) if model.focal is not None else _FIELDS
    pairs = []
    for field_deg in fields:
        first, second = _lens(tones, circles, model, field_deg)
        roll = _roll(_strip(tones, first), _strip(tones, second))
        pair = Pair((first, replace(second, axes=_BACK @ about_axis(roll))), field_deg)
        matches = _matches(tones, pair)
        agree = 0.0
        if len(matches.toward):
            off = np.abs(matches.toward - np.median(matches.toward)) * STEP_DEG
            # Low strips look alike more readily.
            agree = float(matches.trust[off < _ALIKE_DEG].sum()) * math.sqrt(seam_rows(field_deg))
        # Without evidence, the most likely field wins.
        pairs.append((agree, -abs(field_deg - model.field_deg), pair))
    return max(pairs, key=lambda each: each[:2])[2]


def _lens(
    tones: Float32, circles: Circles, model: FisheyeModel, field_deg: float
) -> tuple[FisheyeLens, FisheyeLens]:
    side = min(tones.shape)
    angle = np.array([math.radians(field_deg / 2.0)])
    focal = circles.radius * side / float(bent(angle, model.bends)[0])
    if model.focal is not None:
        focal = model.focal * side
    first, second = (
        FisheyeLens((x * side - 0.5, y * side - 0.5), focal, axes, model.bends)
        for (x, y), axes in zip(
            (circles.centres[model.front], circles.centres[1 - model.front]),
            (_FRONT, _BACK),
            strict=True,
        )
    )
    return first, second


def _field(pair: Pair, circles: Circles, side: int) -> float:
    """Return the angle that a circle spans, in degrees."""
    angles = np.linspace(0.0, math.radians(120.0), 2401)
    radii = np.maximum.accumulate(pair.lenses[0].radius(angles))
    return math.degrees(2.0 * float(np.interp(circles.radius * side, radii, angles)))


def _strip(picture: Float32, lens: FisheyeLens, rows: int = 12) -> Float32:
    """Return a lens's view around the seam, (2 rows + 1, 1440)."""
    x, y, _ = lens.project(seam_directions(rows))
    return np.asarray(
        cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32
    )


def _roll(one: Float32, two: Float32) -> float:
    """Correlate two strips all the way around and return the best quarter turn, in radians."""
    middle, core = len(one) // 2, 4
    base = one[middle - core : middle + core + 1]
    spectrum = np.conj(np.fft.rfft(base - base.mean(), axis=1))
    scores = np.zeros(4)
    for shift in range(core - middle, middle - core + 1):
        other = two[middle + shift - core : middle + shift + core + 1]
        other = other - other.mean()
        product = np.fft.irfft((np.fft.rfft(other, axis=1) * spectrum).sum(axis=0), AROUND)
        product /= math.sqrt(float((other * other).sum())) + 1e-9
        near = np.roll(product, _ROLL)[: 2 * _ROLL + 1 + 3 * AROUND // 4]
        for quarter in range(4):
            start = quarter * AROUND // 4
            scores[quarter] = max(scores[quarter], near[start : start + 2 * _ROLL + 1].max())
    return int(scores.argmax()) * math.pi / 2.0


@dataclass(frozen=True, slots=True)
class _Matches:
    """Matches around the seam: position, sideways and forward shifts in samples, and trust."""

    around: Float64
    sideways: Float64
    toward: Float64
    trust: Float64


def _matches(tones: Float32, pair: Pair) -> _Matches:
    """Match the front lens's strip with the back lens's strip, block by block."""
    rows = seam_rows(pair.field_deg)
    search = min(_SEARCH, rows - 2)
    strips = [_strip(tones, lens, rows) for lens in pair.lenses]
    one, two = (
        np.concatenate([strip[:, -_BLOCK:], strip, strip[:, :_BLOCK]], 1) for strip in strips
    )
    matches = []
    for start in range(0, AROUND, _BLOCK // 2):
        left = start + _BLOCK // 2
        template = one[search:-search, left : left + _BLOCK]
        if template.std() < 0.02:
            continue
        window = two[:, left - search : left + _BLOCK + search]
        scores = cv2.matchTemplate(window, template, cv2.TM_CCOEFF_NORMED)
        _, score, _, (x, y) = cv2.minMaxLoc(scores)
        inside = 0 < x < scores.shape[1] - 1 and 0 < y < scores.shape[0] - 1
        if score < _LEAST_SCORE or not inside:
            continue
        dx, dy = _peak(scores[y, x - 1 : x + 2]), _peak(scores[y - 1 : y + 2, x])
        matches.append(
            (
                start,
                x + dx - search,
                y + dy - search,
                ((score - _LEAST_SCORE) / (1.0 - _LEAST_SCORE)) ** 2,
            )
        )
    table = np.array(matches, np.float64).reshape(-1, 4)
    if len(table):
        astray = np.abs(table[:, 1] - np.median(table[:, 1])) * STEP_DEG
        table = table[astray < _SIDEWAYS_DEG]
    return _Matches(*table.T)


def _peak(three: NDArray[Any]) -> float:
    """Return how far the peak of the parabola through three values is from the middle, -1 to 1."""
    left, middle, right = (float(value) for value in three)
    bow = left - 2.0 * middle + right
    return 0.0 if bow >= 0.0 else max(-1.0, min(1.0, 0.5 * (left - right) / bow))


def _refined(pair: Pair, matches: _Matches, model: FisheyeModel) -> Pair:
    """Fit the focal length, roll and tilt to the matches, leaving parallax as the residual."""
    if not len(matches.around):
        return pair
    toward, sideways = (
        np.radians(matches.toward * STEP_DEG),
        np.radians(matches.sideways * STEP_DEG),
    )
    angle = matches.around * (2.0 * math.pi / AROUND)
    columns = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
    weight = matches.trust / math.radians(_SPREAD_DEG) ** 2
    # A field that a model states has a narrow prior, and tilts are small.
    likely = np.array([3.0 if model.focal is None else 0.5, _TILT_DEG, _TILT_DEG])
    prior = np.diag(np.radians(likely) ** -2.0)
    shift: NDArray[Any] = np.zeros(3)
    for _ in range(8):
        weighted = columns * weight[:, None]
        shift = np.linalg.solve(columns.T @ weighted + prior, weighted.T @ toward)
        off = np.abs(toward - columns @ shift)
        scale = max(float(np.median(off)), math.radians(0.1))
        weight = matches.trust / math.radians(_SPREAD_DEG) ** 2 / np.maximum(off / scale, 1.0)
    roll = float(np.average(sideways, weights=weight))
    return _shift(pair, shift, roll)


def _shift(pair: Pair, shift: Float64, roll: float) -> Pair:
    """Correct the misalignment: each lens's field, and half of the tilt and roll in each lens."""
    first, second = pair.lenses
    # A direction seen at 90 degrees by both lenses is at 90 degrees plus half the common shift.
    angles = np.array([math.pi / 2.0, (math.pi + shift[0]) / 2.0])
    right, bend_shift = bent(angles, first.bends)
    focal = first.focal * float(bend_shift / right)
    lean = from_vector(np.array([shift[1], shift[2], 0.0]) / 2.0)
    lenses = (
        replace(first, focal=focal, axes=first.axes @ lean.T @ about_axis(-roll / 2.0)),
        replace(second, focal=focal, axes=second.axes @ lean @ about_axis(roll / 2.0)),
    )
    return replace(pair, lenses=lenses)


def _parallax_of(matches: _Matches) -> Float64:
    """Smooth the residuals of the matches into a curve around the seam, in degrees.

    The curve is 0 where the parallax is unknown.
    """
    around = np.arange(AROUND)
    if not len(matches.around):
        return np.zeros(AROUND)
    apart = np.abs(around[:, None] - matches.around[None])
    apart = np.minimum(apart, AROUND - apart)
    near = np.exp(-0.5 * (apart / 24.0) ** 2) * matches.trust[None]
    degrees = np.clip(matches.toward * STEP_DEG, -_MOST_PARALLAX_DEG, _MOST_PARALLAX_DEG)
    return np.asarray((near @ degrees) / (near.sum(axis=1) + _PRIOR_WEIGHT))
