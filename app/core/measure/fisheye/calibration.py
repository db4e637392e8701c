"""Calibrate two fisheyes back to back from their own light.

Circles come from the rim; focal length, roll and tilt from the area beyond 90 degrees that both
lenses see. The residual is parallax, since the lenses are a few centimetres apart: it lies along
the meridians of their common axis only, and each lens takes half of it, fading out away from the
seam. The seam runs where they agree best. One gain per channel and one falloff equalise the lenses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64
from app.core.base.colour import luminance
from app.core.base.sphere import from_vector
from app.core.measure.fisheye.circles import Circles, FisheyeLens, FisheyeModel, bent
from app.core.measure.read.frame import MergedLight

# Strips along the seam: a quarter of a degree per sample, along the seam and across it.
_STEP_DEG: Final = 0.25
_AROUND: Final = 1440
_INSIDE: Final = 0.99  # of the radius
_MARGIN_DEG: Final = 0.8  # excluded rim, which is soft
_FIELDS: Final = (186.0, 190.0, 194.0, 198.0, 202.0, 206.0, 210.0)
_SEARCH: Final = 10  # samples, in both directions
_BLOCK: Final = 60  # samples: 15 degrees
_LEAST_SCORE: Final = 0.6
_LEAST_BLOCKS: Final = 6
_SPREAD_DEG: Final = 0.4  # of matches, from parallax
_TILT_DEG: Final = 0.7
_PRIOR_WEIGHT: Final = 0.3  # weight, in matches, of zero parallax where nothing is known
_ALIKE_DEG: Final = 1.25
_ROLL: Final = 10  # samples: cameras store circles in quarter turns, plus or minus this
_SIDEWAYS_DEG: Final = 0.5  # parallax has no sideways component: a larger shift is a wrong match
_FADE_DEG: Final = 30.0  # where the lenses no longer share the parallax
_MOST_GIVEN_DEG: Final = 1.5
_MOST_FALLOFF: Final = 0.5

BLEND_DEG: Final = 0.6
"""Degrees across the seam over which one lens fades into the other."""

_FRONT: Final = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
_BACK: Final = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])


@dataclass(frozen=True, slots=True)
class Pair:
    """Two calibrated lenses, front first, and their seam.

    Attributes:
        field_deg: Angle of each image circle.
        blocks: Number of positions around the seam that agreed.
        parallax: (1440,) float64. Angle between the two lenses' views of an object, degrees, around
            the seam, clockwise from the top as seen by the front lens.
        seam: (1440,) float64. Position of the seam, degrees toward the front, in the same order.
        gains: (2, 3) float64. Factors by lens and channel.
        falloff: Logarithm of a lens's light loss at 90 degrees from its axis. It is assumed to grow
            with the cube of the angle, between the square of plain optics and the effect of hoods
            and stops.
    """

    lenses: tuple[FisheyeLens, FisheyeLens]
    field_deg: float
    blocks: int = 0
    parallax: Float64 = field(default_factory=lambda: np.zeros(_AROUND), repr=False)
    seam: Float64 = field(default_factory=lambda: np.zeros(_AROUND), repr=False)
    gains: Float64 = field(default_factory=lambda: np.ones((2, 3)), repr=False)
    falloff: float = 0.0

    @property
    def measured(self) -> bool:
        """Whether enough points agreed to calibrate the lenses."""
        return self.blocks >= _LEAST_BLOCKS

    @property
    def parallax_deg(self) -> float:
        """Median parallax of the two lenses at the seam."""
        return float(np.median(np.abs(self.parallax)))


def calibrate(merged: MergedLight, circles: Circles, model: FisheyeModel) -> Pair:
    """Calibrate the lenses of an unstitched picture from its merged light."""
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
    pair = _levelled(light, merged.clipped, pair)
    return replace(pair, seam=_seam(light, pair))


def upright(pair: Pair, up_deg: float) -> Pair:
    """Rotate both lenses so that `up_deg`, clockwise from the front one's top, becomes up."""
    turn = _about_axis(math.radians(-up_deg))
    first, second = pair.lenses
    samples = round(up_deg / 360.0 * _AROUND)
    return replace(
        pair,
        lenses=(
            replace(first, axes=first.axes @ turn.T),
            replace(second, axes=second.axes @ turn.T),
        ),
        parallax=np.roll(pair.parallax, -samples),
        seam=np.roll(pair.seam, -samples),
    )


def looked_up(
    pair: Pair, index: int, vectors: Float32, toward: Float32, around: Float32
) -> tuple[Float32, Float32, Float32]:
    """Look up directions in the picture of a lens, with half of the parallax removed.

    Args:
        index: 0 for the front lens, 1 for the other.
        vectors: (..., 3) float32. Directions in the frame of the pair.
        toward, around: (...) float32. Their position, from `about_seam`.

    Returns:
        Columns, rows, and the factor that corrects the falloff, (...) float32 each.
    """
    fade = np.clip(1.0 - np.abs(toward) / _FADE_DEG, 0.0, 1.0)
    give = np.radians(0.5 * fade * fade * (3.0 - 2.0 * fade) * around_seam(pair.parallax, around))
    sign = -1.0 if index == 0 else 1.0
    shifted = _tipped(vectors, (sign * give).astype(np.float32))
    x, y, angle = pair.lenses[index].project(shifted)
    loss = pair.falloff * (angle / np.float32(math.pi / 2.0)) ** 3
    return x, y, np.exp(loss).astype(np.float32)


def about_seam(vectors: Float32) -> tuple[Float32, Float32]:
    """Return the position of directions relative to the seam.

    Args:
        vectors: (..., 3) float32. Unit directions in the frame of the pair.

    Returns:
        (...) float32 each: degrees toward the front from the seam's plane; and samples around it,
        from the top.
    """
    toward = np.degrees(np.arcsin(np.clip(vectors[..., 2], -1.0, 1.0)))
    around = np.arctan2(-vectors[..., 0], vectors[..., 1]) * (_AROUND / (2.0 * math.pi))
    return toward.astype(np.float32), around.astype(np.float32)


def _tipped(vectors: Float32, angles: Float32) -> Float32:
    """Move directions toward the front by angles in radians."""
    flat = np.maximum(np.hypot(vectors[..., 0], vectors[..., 1]), 1e-9)
    cosine, sine = np.cos(angles), np.sin(angles)
    scale = cosine - sine * vectors[..., 2] / flat
    result = vectors * scale[..., None]
    result[..., 2] = vectors[..., 2] * cosine + flat * sine
    return np.asarray(result, np.float32)


def around_seam(curve: Float64, around: Float32) -> Float32:
    """Interpolate a periodic curve of samples around the seam.

    Args:
        curve: (n,) float64. One value per sample.
        around: float32, any shape. Positions in samples, from the top.
    """
    base = np.floor(around)
    first = base.astype(np.intp) % _AROUND
    share = (around - base).astype(np.float32)
    values = curve.astype(np.float32)
    return np.asarray(values[first] * (1.0 - share) + values[(first + 1) % _AROUND] * share)


def _tones(light: Float32, circles: Circles) -> Float32:
    """Return locally normalised log luminance, in which objects look alike in both lenses."""
    level = np.maximum(luminance(light), 0.0)
    height, width = level.shape
    side = min(height, width)
    inside = np.zeros((height, width), np.uint8)
    for x, y in circles.centres:
        at = (round(x * side - 0.5), round(y * side - 0.5))
        cv2.circle(inside, at, int(_INSIDE * circles.radius * side), 1.0, cv2.FILLED)
    mask = inside.astype(np.float32)
    floor = max(float(np.median(level[inside > 0])) * 0.05, 1e-9)
    # As fine as the strips; the circles are about 200 degrees wide.
    sample = _STEP_DEG * side / 200.0
    tones = cv2.GaussianBlur(np.log2(level + floor), (0, 0), max(0.6 * sample, 0.3)) * mask
    # The rim is not an object: levels are those of the inside.
    wide = (0, 0), max(side, 200) / 40.0
    mean = cv2.GaussianBlur(tones, *wide) / np.maximum(cv2.GaussianBlur(mask, *wide), 1e-3)
    return np.asarray((tones - mean) * mask, np.float32)


def _nominal(tones: Float32, circles: Circles, model: FisheyeModel) -> Pair:
    """Choose field and roll so that most positions around the seam look alike in both lenses."""
    fields = (model.field_deg,) if model.focal is not None else _FIELDS
    pairs = []
    for field_deg in fields:
        first, second = _lens(tones, circles, model, field_deg)
        roll = _roll(_strip(tones, first), _strip(tones, second))
        pair = Pair((first, replace(second, axes=_BACK @ _about_axis(roll))), field_deg)
        matches = _matches(tones, pair)
        agree = 0.0
        if len(matches.toward):
            off = np.abs(matches.toward - np.median(matches.toward)) * _STEP_DEG
            # Low strips look alike more easily.
            agree = float(matches.trust[off < _ALIKE_DEG].sum()) * math.sqrt(_rows(field_deg))
        # Without evidence, the likeliest field.
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


def _rows(field_deg: float) -> int:
    """Return the number of samples on each side of the seam that both lenses see."""
    return max(int((field_deg / 2.0 - 90.0 - _MARGIN_DEG) / _STEP_DEG), 4)


def _grid(rows: int) -> Float32:
    """Return directions of a strip, (2 rows + 1, 1440, 3): from the back toward the front."""
    toward = np.radians(np.arange(-rows, rows + 1) * _STEP_DEG)[:, None]
    around = (np.arange(_AROUND) * (2.0 * math.pi / _AROUND))[None]
    level = np.cos(toward)
    parts = (-np.sin(around) * level, np.cos(around) * level, np.sin(toward) + 0.0 * around)
    return np.stack(parts, axis=-1).astype(np.float32)


def _strip(picture: Float32, lens: FisheyeLens, rows: int = 12) -> Float32:
    """Return a lens's view around the seam, (2 rows + 1, 1440)."""
    x, y, _ = lens.project(_grid(rows))
    return np.asarray(
        cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32
    )


def _roll(one: Float32, two: Float32) -> float:
    """Correlate two strips all around; return the quarter turn of the best agreement, radians."""
    middle, core = len(one) // 2, 4
    base = one[middle - core : middle + core + 1]
    spectrum = np.conj(np.fft.rfft(base - base.mean(), axis=1))
    scores = np.zeros(4)
    for shift in range(core - middle, middle - core + 1):
        other = two[middle + shift - core : middle + shift + core + 1]
        other = other - other.mean()
        product = np.fft.irfft((np.fft.rfft(other, axis=1) * spectrum).sum(axis=0), _AROUND)
        product /= math.sqrt(float((other * other).sum())) + 1e-9
        near = np.roll(product, _ROLL)[: 2 * _ROLL + 1 + 3 * _AROUND // 4]
        for quarter in range(4):
            start = quarter * _AROUND // 4
            scores[quarter] = max(scores[quarter], near[start : start + 2 * _ROLL + 1].max())
    return int(scores.argmax()) * math.pi / 2.0


def _about_axis(angle: float) -> Float64:
    """Return the rotation about the front axis, radians, clockwise as seen by the front lens."""
    return from_vector(np.array([0.0, 0.0, angle]))


@dataclass(frozen=True, slots=True)
class _Matches:
    """Matches around the seam: sample, shift around and toward the front in samples, trust."""

    around: Float64
    sideways: Float64
    toward: Float64
    trust: Float64


def _matches(tones: Float32, pair: Pair) -> _Matches:
    """Match the front lens's strip with the back lens's, block by block."""
    rows = _rows(pair.field_deg)
    search = min(_SEARCH, rows - 2)
    strips = [_strip(tones, lens, rows) for lens in pair.lenses]
    one, two = (
        np.concatenate([strip[:, -_BLOCK:], strip, strip[:, :_BLOCK]], 1) for strip in strips
    )
    matches = []
    for start in range(0, _AROUND, _BLOCK // 2):
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
        astray = np.abs(table[:, 1] - np.median(table[:, 1])) * _STEP_DEG
        table = table[astray < _SIDEWAYS_DEG]
    return _Matches(*table.T)


def _peak(three: NDArray[Any]) -> float:
    """Return the offset of the peak of a parabola through three values, -1 to 1."""
    left, middle, right = (float(value) for value in three)
    bow = left - 2.0 * middle + right
    return 0.0 if bow >= 0.0 else max(-1.0, min(1.0, 0.5 * (left - right) / bow))


def _refined(pair: Pair, matches: _Matches, model: FisheyeModel) -> Pair:
    """Fit focal length, roll and tilt to matches; the residual is parallax."""
    if not len(matches.around):
        return pair
    toward, sideways = (
        np.radians(matches.toward * _STEP_DEG),
        np.radians(matches.sideways * _STEP_DEG),
    )
    angle = matches.around * (2.0 * math.pi / _AROUND)
    columns = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
    weight = matches.trust / math.radians(_SPREAD_DEG) ** 2
    # Fields stated by a model have narrow priors; tilts are small.
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
    """Correct the misalignment: the field in both lenses, half of tilt and roll in each."""
    first, second = pair.lenses
    # A direction that both lenses see at 90 degrees is at 90 degrees plus half of the common shift.
    angles = np.array([math.pi / 2.0, (math.pi + shift[0]) / 2.0])
    right, bend_shift = bent(angles, first.bends)
    focal = first.focal * float(bend_shift / right)
    lean = from_vector(np.array([shift[1], shift[2], 0.0]) / 2.0)
    lenses = (
        replace(first, focal=focal, axes=first.axes @ lean.T @ _about_axis(-roll / 2.0)),
        replace(second, focal=focal, axes=second.axes @ lean @ _about_axis(roll / 2.0)),
    )
    return replace(pair, lenses=lenses)


def _parallax_of(matches: _Matches) -> Float64:
    """Smooth the residuals of the matches into a curve around the seam, degrees.

    The curve is 0 where nothing is known.
    """
    around = np.arange(_AROUND)
    if not len(matches.around):
        return np.zeros(_AROUND)
    apart = np.abs(around[:, None] - matches.around[None])
    apart = np.minimum(apart, _AROUND - apart)
    near = np.exp(-0.5 * (apart / 24.0) ** 2) * matches.trust[None]
    degrees = np.clip(matches.toward * _STEP_DEG, -_MOST_GIVEN_DEG, _MOST_GIVEN_DEG)
    return np.asarray((near @ degrees) / (near.sum(axis=1) + _PRIOR_WEIGHT))


def _levelled(light: Float32, clipped: Float32, pair: Pair) -> Pair:
    """Measure the relative brightness of the lenses per channel, and their falloff."""
    one, two, toward = _overlap(np.dstack([light, clipped]), pair)
    valid = (one[..., 3] < 0.01) & (two[..., 3] < 0.01)
    level = float(np.median(one[..., :3]))
    valid &= (one[..., :3].min(axis=-1) > 0.02 * level) & (two[..., :3].min(axis=-1) > 0.02 * level)
    if valid.sum() < 500:
        return pair
    ratio = np.log(one[..., :3][valid] / two[..., :3][valid])
    place = np.broadcast_to(np.radians(toward)[:, None], valid.shape)[valid]
    mean = ratio.mean(axis=1)
    slope, weight = 0.0, np.ones(len(place))
    for _ in range(10):
        centre = float(np.average(mean, weights=weight))
        slope = float((weight * place * (mean - centre)).sum() / (weight * place * place).sum())
        off = np.abs(mean - centre - slope * place)
        weight = 1.0 / np.maximum(off / max(float(np.median(off)), 0.01), 1.0) ** 2
    gains = [float(np.average(ratio[:, c], weights=weight)) for c in range(3)]
    # Both lose exp(-falloff (t / 90 deg)^3): toward the front one loses less, the other more.
    falloff = slope * math.pi / 12.0
    half = np.array(gains) / 2.0
    return replace(
        pair,
        gains=np.stack([np.exp(-half), np.exp(half)]),
        falloff=min(max(falloff, 0.0), _MOST_FALLOFF),
    )


def _overlap(picture: Float32, pair: Pair) -> tuple[Float32, Float32, Float64]:
    """Return each lens's view of the overlap, (rows, 1440, channels), and the rows' degrees."""
    rows = _rows(pair.field_deg)
    grid = _grid(rows)
    toward, around = about_seam(grid)
    strips = []
    for index in range(2):
        x, y, _ = looked_up(pair, index, grid, toward, around)
        strip = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        strips.append(np.asarray(strip, np.float32))
    return strips[0], strips[1], np.asarray(np.arange(-rows, rows + 1) * _STEP_DEG, np.float64)


def _seam(light: Float32, pair: Pair) -> Float64:
    """Find the path along which both lenses agree best: dynamic programming, twice around."""
    one, two, toward = _overlap(light, pair)
    one, two = one * pair.gains[0].astype(np.float32), two * pair.gains[1].astype(np.float32)
    floor = 0.02 * float(np.median(one)) + 1e-9
    cost = np.abs(np.log(one + floor) - np.log(two + floor)).max(axis=-1)
    cost = cv2.GaussianBlur(cost, (5, 5), 0) + 0.01 + 0.004 * np.abs(toward)[:, None]
    edge = round(BLEND_DEG / _STEP_DEG)
    cost[:edge] = cost[-edge:] = 1e3
    total, back = cost[:, 0].copy(), np.zeros((2 * _AROUND, len(cost)), np.int8)
    for column in range(1, 2 * _AROUND):
        padded = np.pad(total, 1, constant_values=np.inf)
        ways = np.stack([padded[:-2] + 0.02, padded[1:-1], padded[2:] + 0.02])
        back[column] = ways.argmin(axis=0) - 1
        total = ways.min(axis=0) + cost[:, column % _AROUND]
    place, path = int(total.argmin()), np.zeros(2 * _AROUND)
    for column in range(2 * _AROUND - 1, -1, -1):
        path[column] = toward[place]
        place += int(back[column, place])
    half = _AROUND // 2
    middle = path[half : half + _AROUND]
    return np.asarray(np.roll(middle, half))
