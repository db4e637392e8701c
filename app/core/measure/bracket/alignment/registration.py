"""Estimate the rotation between two panoramas.

Two frames are compared on the sphere by locating feature points of the brighter frame (local maxima
of its gradient) in the darker one. Three rotation parameters are fitted by inverse compositional
Gauss-Newton steps (Baker and Matthews 2004, "Lucas-Kanade 20 years on"), coarse to fine, with
Tukey's weights. The relation between the code values of the two frames does not come from the
exposure tags or an assumed curve. It is measured at the same points, as the median of one frame's
codes for each code of the other (the comparagram of Mann and Picard 1995). As a result, wrong tags,
tone curves and clipping do not look like motion, and moving objects are outvoted.

The uncertainty is a jackknife estimate over 24 equal parts of the sphere, so a rotation is not
trusted if the parts disagree on it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float32, Float64, Floats, Indices, Numbers
from app.core.base.sphere import angle_of, from_vector, positions

# Area means are not compared if their brightest channel has at least this code.
_CLIPPED: Final = 248
_BLACK: Final = 4
# Minimum usable area of a reference frame, relative to the most usable frame.
_MIDDLE_SHARE: Final = 0.6
_COARSE: Final = 84  # columns of the coarsest size
_BINS: Final = 32
_STEPS: Final = 8
_CLOSE_RAD: Final = (2e-3, 4e-4, 5e-5)  # size of the step that ends the search, coarse to fine
_NEAR_DEG: Final = 0.3  # maximum distance of the finest level's start from the coarsest result
_NUDGE_RAD: Final = math.radians(1.0)
_STARTS_RAD: Final = math.radians(5.0)
_LEAST_POINTS: Final = 150
_MOST_DEG: Final = 20.0
_TRUSTED_DEG: Final = 0.08
# Divided by the root of the number of points, since errors in nearly black frames are not
# independent.
_FLOOR_DEG: Final = 0.8
_TRUSTED_CONTRAST: Final = 1.15
_PARTS: Final = 8
_LEAST_SEEN: Final = 40
_MOST_SEEN: Final = 12_000
# Maximum invalid fraction of a coarse pixel, out of 255.
_FEW_BAD: Final = 25
_POLAR: Final = 0.25  # minimum cosine of elevation


@dataclass(frozen=True, slots=True)
class Level:
    """One frame at one size.

    Codes are valid where they are not clipped, black or filled in.

    Attributes:
        codes: (h, w) float32. Smoothed codes.
        valid: (h, w) uint8. 255 where a code is valid, otherwise 0.
    """

    codes: Float32
    valid: Bytes


@dataclass(frozen=True, slots=True)
class _Places:
    """Feature points of a frame: their directions, codes and change in code under rotation."""

    vectors: Float32
    codes: Float32
    slopes: Float32
    weights: Float32


@dataclass(frozen=True, slots=True)
class _Match:
    """The points of one frame that are visible in another, and the errors in their codes."""

    use: Indices
    error: Float32
    gain: Float32
    misfit: float


@dataclass(frozen=True, slots=True)
class Fit:
    """A rotation, (3, 3), from directions in one frame to those in another, and its evidence.

    Attributes:
        error_deg: Standard error in degrees (jackknife, plus a part that falls with the number of
            points), or infinity if nothing could be compared.
        contrast: How many times worse the frames fit when rotated by one degree.
    """

    rotation: Float64
    error_deg: float = math.inf
    points: int = 0
    contrast: float = 0.0

    @property
    def trusted(self) -> bool:
        """Whether the frames overlap enough and their parts agree."""
        return (
            self.points >= _LEAST_POINTS
            and self.error_deg < _TRUSTED_DEG
            and self.contrast > _TRUSTED_CONTRAST
            and angle_of(self.rotation) < _MOST_DEG
        )

    @property
    def inverse(self) -> Fit:
        """The same fit, with the two frames exchanged."""
        return replace(self, rotation=np.ascontiguousarray(self.rotation.T))


def register(bright: list[Level], dark: list[Level]) -> Fit:
    """Return the small rotation from the longer exposure to the shorter one.

    The search starts from no rotation first, then from rotations in every direction.

    Args:
        bright, dark: Results of `pyramid`.
    """
    coarse = _places(bright[0])
    start, _ = _search(coarse, dark[0], np.eye(3), _CLOSE_RAD[0])
    fit = _refine(bright, dark, start)
    if fit.trusted or fit.points < _LEAST_POINTS:
        return fit
    starts = [
        _search(coarse, dark[0], from_vector(_STARTS_RAD * np.array(axis)), _CLOSE_RAD[0])
        for axis in itertools.product((-1.0, 0.0, 1.0), repeat=3)
        if any(axis)
    ]
    start, _ = min(starts, key=lambda item: item[1])
    again = _refine(bright, dark, start)
    return again if again.trusted else fit


def _refine(bright: list[Level], dark: list[Level], rotation: Float64) -> Fit:
    """Refine a rotation up to the finest size and judge the fit there."""
    if angle_of(rotation) > _NEAR_DEG:
        rotation, _ = _search(_places(bright[1]), dark[1], rotation, _CLOSE_RAD[1])
    places = _places(bright[2])
    rotation, misfit = _search(places, dark[2], rotation, _CLOSE_RAD[2])
    match = _match(places, dark[2], rotation)
    if match is None:
        return Fit(rotation)
    points = int((_weights(match) > 0.25).sum())
    contrast = _contrast(places, dark[2], rotation, misfit)
    error = math.hypot(_error_deg(places, match), _FLOOR_DEG / math.sqrt(max(points, 1)))
    return Fit(rotation, error, points, contrast)


def _search(
    places: _Places, level: Level, rotation: Float64, close: float
) -> tuple[Float64, float]:
    """Refine a rotation at one size by Gauss-Newton and return it with the remaining misfit."""
    misfit = math.inf
    for _ in range(_STEPS):
        match = _match(places, level, rotation)
        if match is None:
            return rotation, math.inf
        misfit = match.misfit
        slopes = places.slopes[match.use] * match.gain[:, None]
        weighted = slopes * (_weights(match) * places.weights[match.use])[:, None]
        step = _solve(weighted.T @ slopes, weighted.T @ match.error)
        rotation = rotation @ from_vector(step)
        if np.linalg.norm(step) < close:
            break
    return rotation, misfit


def _match(places: _Places, level: Level, rotation: Float64) -> _Match | None:
    """Locate feature points in another frame, or return None if too few are visible."""
    shape = level.codes.shape
    if places.codes.size < _LEAST_SEEN:
        return None
    columns, rows = positions(places.vectors @ rotation.T.astype(np.float32), shape)
    rows = np.clip(rows, 0, shape[0] - 1)
    wrap = cv2.BORDER_WRAP
    good = cv2.remap(level.valid, columns, rows, cv2.INTER_NEAREST, borderMode=wrap)
    use = np.nonzero(good.ravel() > 0)[0]
    if use.size < _LEAST_SEEN:
        return None
    other_codes = cv2.remap(level.codes, columns, rows, cv2.INTER_LINEAR, borderMode=wrap).ravel()[
        use
    ]
    prediction, gain = _transfer(places.codes[use], other_codes)
    error = other_codes - prediction
    return _Match(use, error, gain, 1.4826 * float(np.median(np.abs(error))))


def _weights(match: _Match) -> Float32:
    """Return Tukey's biweight of the errors, with a scale of at least half a code value."""
    scale = 4.685 * max(match.misfit, 0.5)
    return np.asarray(np.clip(1.0 - (match.error / scale) ** 2, 0.0, 1.0) ** 2, np.float32)


def _transfer(codes: Float32, other_codes: Numbers) -> tuple[Float32, Float32]:
    """Measure how one frame's codes appear in another, as a value and a slope for each point."""
    bins = (codes * (_BINS / 256.0)).astype(np.int64)
    order = np.argsort(bins * 256.0 + other_codes)
    counts = np.bincount(bins, minlength=_BINS)
    starts = np.cumsum(counts) - counts
    full_bins = np.nonzero(counts >= 8)[0]
    if full_bins.size < 2:
        return np.full_like(codes, np.median(other_codes)), np.ones_like(codes)
    centre = np.bincount(bins, codes, _BINS)[full_bins] / counts[full_bins]
    middle = other_codes[order[starts[full_bins] + counts[full_bins] // 2]].astype(np.float64)
    middle = np.maximum.accumulate(middle)
    value = np.interp(codes, centre, middle)
    steps = np.diff(middle) / np.diff(centre)
    gain = np.interp(codes, (centre[1:] + centre[:-1]) / 2.0, steps)
    return value.astype(np.float32), gain.astype(np.float32)


def _solve(normal: Floats, right: Floats) -> Float64:
    """Return the Gauss-Newton step, slightly damped where the sums do not determine it."""
    damping = 1e-6 * float(np.trace(normal)) + 1e-9
    return np.asarray(-np.linalg.solve(normal + damping * np.eye(3), right), np.float64)


def _error_deg(places: _Places, match: _Match) -> float:
    """Return a rotation's standard error, from a jackknife over 3 x 8 equal parts of the sphere."""
    slopes = places.slopes[match.use] * match.gain[:, None]
    weighted = slopes * (_weights(match) * places.weights[match.use])[:, None]
    vectors = places.vectors[match.use]
    around = (np.arctan2(vectors[:, 0], vectors[:, 2]) / (2.0 * np.pi) + 0.5) * _PARTS
    part = np.clip((vectors[:, 1] + 1.0) * 1.5, 0, 2).astype(np.int64) * _PARTS
    part += np.clip(around, 0, _PARTS - 1).astype(np.int64)
    own = [part == k for k in range(3 * _PARTS)]
    normals = np.stack([weighted[k].T @ slopes[k] for k in own]).astype(np.float64)
    rights = np.stack([weighted[k].T @ match.error[k] for k in own]).astype(np.float64)
    full_bins = np.nonzero(np.trace(normals, axis1=1, axis2=2) > 0)[0]
    if full_bins.size < 4:
        return math.inf
    without = np.stack(
        [_solve(normals.sum(0) - normals[k], rights.sum(0) - rights[k]) for k in full_bins]
    )
    spread = without - without.mean(axis=0)
    variance = (full_bins.size - 1) / full_bins.size * float((spread**2).sum())
    return math.degrees(math.sqrt(variance))


def _contrast(places: _Places, level: Level, rotation: Float64, misfit: float) -> float:
    """Return how much worse the frames fit when rotated by one degree."""
    some = slice(None, None, max(places.codes.size // 1500, 1))
    few = _Places(
        places.vectors[some], places.codes[some], places.slopes[some], places.weights[some]
    )
    worse = math.inf
    for axis, sign in itertools.product(range(3), (-1.0, 1.0)):
        trial = _match(few, level, rotation @ from_vector(sign * _NUDGE_RAD * np.eye(3)[axis]))
        if trial is not None:
            worse = min(worse, trial.misfit / max(misfit, 1e-3))
    return worse


def pyramid(frame: Bytes) -> list[Level]:
    """Prepare a frame at three sizes, which are about 84, w / 2 and w columns wide.

    Args:
        frame: (h, w, 3) uint8. Small equirectangular copy, consisting of area means of encoded RGB.
    """
    codes = np.asarray(cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY), np.uint8)
    red, green, blue = cv2.split(frame)
    top = np.asarray(cv2.max(cv2.max(red, green), blue))
    # Neighbours of a clipped pixel include parts of it in their averages.
    bad = cv2.dilate((top >= _CLIPPED).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    bad |= codes <= _BLACK
    # No real picture is perfectly uniform over 5 x 5 area means, so such a part is missing.
    block = np.ones((5, 5), np.uint8)
    bad |= np.asarray(cv2.dilate(codes, block)) == np.asarray(cv2.erode(codes, block))
    flags = np.where(bad, np.uint8(255), np.uint8(0))
    height, width = codes.shape
    levels = []
    for factor in (max(width // _COARSE, 1), 2, 1):
        size = (width // factor, height // factor)
        small = cv2.resize(codes, size, interpolation=cv2.INTER_AREA)
        share = np.asarray(cv2.resize(flags, size, interpolation=cv2.INTER_AREA))
        valid = np.where(share <= _FEW_BAD, np.uint8(255), np.uint8(0))
        levels.append(Level(_smooth(small.astype(np.float32)), valid))
    return levels


def _smooth(codes: Float32) -> Float32:
    """Blur codes slightly, also across the edge, to keep gradients valid over a whole pixel."""
    wide = cv2.copyMakeBorder(codes, 0, 0, 2, 2, cv2.BORDER_WRAP)
    return np.ascontiguousarray(cv2.GaussianBlur(wide, (3, 3), 0.7)[:, 2:-2])


def edges(picture: Bytes) -> tuple[Float32, Float32, Float32]:
    """Find the edges in an encoded RGB panorama, (h, w, 3) uint8, as parts of great circles.

    Returns:
        Directions of points on edges away from the poles, (N, 3) float32; unit normals of the
        edges' great circles there, (N, 3) float32; and weights, (N,) float32. Strong edges count
        more, and those near the poles, where pixels are crowded, count less.
    """
    places = _places(pyramid(picture)[2])
    # A rotation about an axis on the edge's great circle moves the picture across the edge, and the
    # gradient itself is the normal.
    gradients = np.cross(places.slopes, places.vectors)
    sizes = np.linalg.norm(gradients, axis=1)
    # In codes per pixel at the equator. Above about twenty, all edges are equally good.
    strengths = np.minimum(sizes * np.float32(2.0 * np.pi / picture.shape[1]), 20.0)
    normals = gradients / np.maximum(sizes, np.float32(1e-9))[:, None]
    return places.vectors, normals, np.asarray(strengths * places.weights, np.float32)


def _places(level: Level) -> _Places:
    """Choose the feature points of a frame, away from the poles."""
    height, width = level.codes.shape
    wide = cv2.copyMakeBorder(level.codes, 0, 0, 1, 1, cv2.BORDER_WRAP)
    across = np.ascontiguousarray(cv2.Scharr(wide, cv2.CV_32F, 1, 0, scale=1 / 32)[:, 1:-1])
    down = np.ascontiguousarray(cv2.Scharr(wide, cv2.CV_32F, 0, 1, scale=1 / 32)[:, 1:-1])
    elevation = np.pi * (0.5 - (np.arange(height, dtype=np.float32) + 0.5) / height)
    narrow = np.cos(elevation)[:, None]
    size = cv2.magnitude(across / narrow, down)
    sharp = (size > 1.0) & (level.valid > 0) & (narrow > _POLAR)
    if width > 2 * _COARSE:
        sharp &= size >= cv2.dilate(size, np.ones((3, 3), np.uint8))
    row, column = np.nonzero(sharp)
    some = slice(None, None, row.size // _MOST_SEEN + 1)
    row, column = row[some], column[some]
    angle = 2.0 * np.pi * ((column + 0.5) / width - 0.5)
    cosine, sine = np.cos(elevation)[row], np.sin(elevation)[row]
    vectors = np.stack([-np.sin(angle) * cosine, sine, np.cos(angle) * cosine], axis=1)
    slopes = _slopes(vectors, across[row, column], down[row, column], (height, width))
    return _Places(
        vectors.astype(np.float32), level.codes[row, column], slopes, cosine.astype(np.float32)
    )


def _slopes(vectors: Float64, across: Numbers, down: Numbers, shape: tuple[int, int]) -> Float32:
    """Return the change in code value per radian of rotation about each axis, (N, 3)."""
    x, y, z = vectors.T
    level = np.hypot(x, z)
    per_east = across * (shape[1] / (2.0 * np.pi)) / level
    per_north = down * (-shape[0] / np.pi)
    # Direction x gradient, with east (-z, 0, x) / level and north (-x y, level^2, -z y) / level.
    gx = (-z * per_east - x * y * per_north) / level
    gy = level * per_north
    gz = (x * per_east - z * y * per_north) / level
    return np.stack([y * gz - z * gy, z * gx - x * gz, x * gy - y * gx], axis=1).astype(np.float32)


def middle_frame(shares: Sequence[float]) -> int:
    """Choose the frame nearest to the middle among those nearly as usable as the best frame."""
    middle = (len(shares) - 1) / 2.0
    fit_for_it = [k for k, share in enumerate(shares) if share >= _MIDDLE_SHARE * max(shares)]
    return min(fit_for_it, key=lambda k: (abs(k - middle), -shares[k]))


def usable_share(levels: list[Level]) -> float:
    """Return the fraction of the sphere where a frame is neither clipped nor black."""
    valid = levels[0].valid > 0
    elevation = np.pi * (0.5 - (np.arange(valid.shape[0]) + 0.5) / valid.shape[0])
    return float(np.average(valid.mean(axis=1), weights=np.cos(elevation)))
