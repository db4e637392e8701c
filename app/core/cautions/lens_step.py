"""Find a step in brightness between the two lenses of a 360 camera.

Each lens records one hemisphere, and the hemispheres are blended along a great circle, the seam. If
one lens is brighter, the logarithm of the luminance has a step of one size along the whole seam. An
edge in the place, such as a door frame, follows the seam for only part of its length, and it is not
equally strong everywhere. Panoramas are often turned after they are stitched, so every vertical
great circle is considered, and the best one is tilted.

A circle is divided into blocks of 5 degrees. The rise of a block is the sum, over a window across
the seam, of the median derivative along the block. The median ignores edges that cross the seam, as
in Weiss 2001, "Deriving intrinsic images from image sequences". A block's noise is the median
absolute rise in windows beside the seam, on meridians of the same texture. The evidence for a step
d is the log-likelihood ratio of the rises r with noise s, averaged over two widths of the window,

    sum_k rho(r_k / s_k) - rho((r_k - d) / s_k),    rho(x) = min(x^2 / 2, 3),

where the bound limits how much one block can add. The evidence is that of the weakest half of the
circle, left, right, upper or lower, since a real step is everywhere, while a wall ends on one side
of the camera, and the edge of a roof above it. A camera's own panorama has its front lens at the
centre, so that seam starts with a bonus.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Float32, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage
from app.core.base.sphere import bounded, direction, directions

_ROWS: Final = 360
_FINE: Final = 2048  # maximum columns before the luminance is computed
_LEAST_ROWS: Final = 128  # a coarser panorama does not resolve the seam
_PER_DEGREE: Final = 2  # samples per degree across the seam; along it, there is one
_ASIDE_DEG: Final = 20  # extent of the samples on each side of the seam
_WINDOWS_DEG: Final = (3.0, 4.0)  # widths of the windows in which a block's rise is summed
_BLOCK_DEG: Final = 5  # as many samples
_POLE_DEG: Final = 10  # distance from the zenith and the nadir within which all seams meet
_GRID_DEG: Final = 2
_TILTS_DEG: Final = (-4.0, 0.0, 4.0)
_UNTURNED: Final = math.log(12.0)
_UNTURNED_DEG: Final = 4.0
_DARK: Final = 1e-3  # fraction of the median luminance that is added before the logarithm
_LEAST_LIGHT: Final = 4.0  # multiple of that fraction below which a texel does not count
_IGNORED: Final = 0.1  # maximum ignored fraction of a block's samples
_NOISE: Final = 0.1  # minimum noise of a block, in stops
_WHOLE_DEG: Final = 8.0  # width of a window that contains the whole blend
_NORMAL: Final = 1.4826  # standard deviation over median absolute deviation, if normal
_BOUND: Final = 3.0
_STEPS: Final[tuple[float, ...]] = tuple(np.arange(0.35, 1.51, 0.05).round(2).tolist())
LEAST_EVIDENCE: Final = 4.0


@dataclass(frozen=True, slots=True)
class LensStep:
    """A step between two hemispheres.

    Attributes:
        stops: How much brighter one hemisphere is than the other, in stops, positive.
        azimuth_deg, elevation_deg: Centre of the brighter hemisphere in the panorama.
        evidence: Log-likelihood ratio of the weakest half of the seam, with any bonus.
    """

    stops: float
    azimuth_deg: float
    elevation_deg: float
    evidence: float


def lens_step(radiance: FloatImage, ignored: Float32 | None = None) -> LensStep | None:
    """Return the step between the lenses of a panorama, or None if there is no certain step.

    Args:
        radiance: (H, 2 H, 3) float32. Linear radiance, on an arbitrary scale.
        ignored: (H, 2 H) float32. Fraction of each texel that was not measured, 0 to 1.
    """
    if len(radiance) < _LEAST_ROWS:
        return None
    step = likeliest_step(radiance, ignored)
    return step if step.evidence >= LEAST_EVIDENCE else None


def likeliest_step(radiance: FloatImage, ignored: Float32 | None = None) -> LensStep:
    """Return the step with the most evidence, however little that is.

    Args:
        radiance, ignored: As in `lens_step`.
    """
    planes = _planes(radiance, ignored)
    steps = (
        _step_at(planes, azimuth, tilt)
        for tilt in _TILTS_DEG
        for azimuth in range(0, 180, _GRID_DEG)
    )
    best = max(steps, key=lambda step: step.evidence)
    return replace(best, stops=_whole_step(planes, best))


def evened(radiance: FloatImage, step: LensStep) -> Float32:
    """Return a panorama, (H, W, 3) linear float32, with both hemispheres equally bright."""
    axis = direction(step.azimuth_deg, step.elevation_deg).astype(np.float32)
    side = np.sign(directions((radiance.shape[0], radiance.shape[1])) @ axis)
    return np.asarray(radiance * np.exp2(-0.5 * step.stops * side)[..., None], np.float32)


def _planes(radiance: FloatImage, ignored: Float32 | None) -> Float32:
    """Return the base-2 logarithm of the luminance and the ignored fraction, (360, 721, 2).

    The first column is repeated after the last one.
    """
    size = (2 * _ROWS, _ROWS)
    small = cv2.resize(bounded(radiance, _FINE), size, interpolation=cv2.INTER_AREA)
    light = small @ np.array(LUMINANCE_WEIGHTS, np.float32)
    dark = max(_DARK * float(np.median(light)), 1e-30)
    left_out = (light < _LEAST_LIGHT * dark).astype(np.float32)
    if ignored is not None:
        mask = cv2.resize(ignored.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        left_out = np.maximum(left_out, mask)
    planes = np.dstack((np.log2(light + np.float32(dark)), left_out))
    return np.concatenate((planes, planes[:, :1]), axis=1)


def _step_at(planes: Float32, azimuth_deg: float, elevation_deg: float) -> LensStep:
    """Return the likeliest step between the hemispheres around a direction and its opposite."""
    rise, noise = _rises(planes, azimuth_deg, elevation_deg)
    steps = np.array([*_STEPS, *(-each for each in _STEPS)])
    flat, stepped = _penalty(rise / noise), _penalty((rise - steps[:, None, None]) / noise)
    ratios = (flat - stepped).mean(axis=1)
    quarters = ratios.reshape(len(steps), 2, 2, -1).sum(axis=-1)
    sides, heights = quarters.sum(axis=2).min(axis=1), quarters.sum(axis=1).min(axis=1)
    halves = np.minimum(sides, heights)
    best = int(halves.argmax())
    ahead = steps[best] > 0.0
    bonus = _UNTURNED if abs(wrap(2.0 * azimuth_deg)) <= 2.0 * _UNTURNED_DEG else 0.0
    return LensStep(
        abs(float(steps[best])),
        wrap(azimuth_deg if ahead else azimuth_deg + 180.0),
        elevation_deg if ahead else -elevation_deg,
        float(halves[best]) + bonus,
    )


def _whole_step(planes: Float32, step: LensStep) -> float:
    """Measure a step across the whole blend, as the weighted median of the rises, in stops."""
    rise, noise = _rises(planes, step.azimuth_deg, step.elevation_deg, (_WHOLE_DEG,))
    order = np.argsort(rise[0])
    weights = np.cumsum(noise[0, order] ** -2.0)
    middle = int(np.searchsorted(weights, 0.5 * weights[-1]))
    return max(float(rise[0, order[middle]]), min(_STEPS))


def _median_of_five(rows: Float32) -> Float32:
    """Return the median along axis 1, which has 5 entries, much faster than `np.median`."""
    a, b, c, d, e = (rows[:, k] for k in range(5))
    low, high = np.minimum(a, b), np.maximum(a, b)
    left, right = np.minimum(c, d), np.maximum(c, d)
    # Neither the smallest nor the largest of the first four can be the median.
    low, high = np.maximum(low, left), np.minimum(high, right)
    return np.asarray(np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), e)))


def _penalty(deviation: Float64) -> Float64:
    return np.minimum(0.5 * deviation * deviation, _BOUND)


def _rises(
    planes: Float32,
    azimuth_deg: float,
    elevation_deg: float,
    widths_deg: tuple[float, ...] = _WINDOWS_DEG,
) -> tuple[Float64, Float64]:
    """Return the rise of each block towards a hemisphere and its noise, (windows, blocks)."""
    along, across = _seam_map(elevation_deg)
    shift = np.float32(azimuth_deg / 180.0 * _ROWS)
    columns = (along + shift) % np.float32(2 * _ROWS)
    samples = cv2.remap(planes, columns, across, cv2.INTER_LINEAR)
    blocks = samples.reshape(-1, _BLOCK_DEG, *samples.shape[1:])
    slopes = _median_of_five(np.diff(blocks[..., 0], axis=2))
    sums = np.cumsum(np.pad(slopes, ((0, 0), (1, 0))), axis=1, dtype=np.float64)
    rises, noises = [], []
    for width_deg in widths_deg:
        width = round(width_deg * _PER_DEGREE)
        windows = sums[:, width:] - sums[:, :-width]
        middle = windows.shape[1] // 2
        beside = np.abs(np.arange(windows.shape[1]) - middle) >= width
        trend = windows[:, beside].mean(axis=1)
        spread = np.median(np.abs(windows[:, beside] - trend[:, None]), axis=1)
        inside = slice(middle, middle + width + 1)
        left_out = blocks[:, :, inside, 1].mean(axis=(1, 2)) > _IGNORED
        rises.append(np.where(left_out, 0.0, windows[:, middle] - trend))
        noises.append(np.where(left_out, np.inf, np.hypot(_NORMAL * spread, _NOISE)))
    return np.stack(rises), np.stack(noises)


@lru_cache(maxsize=len(_TILTS_DEG))
def _seam_map(elevation_deg: float) -> tuple[Float32, Float32]:
    """Return the column and row of each sample beside the seam of a lens that looks to azimuth 0.

    Returns:
        Two arrays, (along, across) float32, with the right half of the seam first. Samples across
        the seam lead towards the lens.
    """
    half = np.arange(_POLE_DEG, 180 - _POLE_DEG) + 0.5
    along = np.radians(np.concatenate((half, -half)))[:, None]
    across = np.radians(np.arange(-_ASIDE_DEG, _ASIDE_DEG + 1e-9, 1.0 / _PER_DEGREE))[None]
    # right, up and forward in the coordinate system of the lens
    right = np.cos(across) * np.sin(along)
    up = np.cos(across) * np.cos(along)
    forward = np.sin(across) + np.zeros_like(along)
    tilt = math.radians(elevation_deg)
    up, forward = (
        up * math.cos(tilt) + forward * math.sin(tilt),
        forward * math.cos(tilt) - up * math.sin(tilt),
    )
    columns = (np.arctan2(right, forward) / math.pi + 1.0) * _ROWS - 0.5
    rows = (0.5 - np.arcsin(np.clip(up, -1.0, 1.0)) / math.pi) * _ROWS - 0.5
    return columns.astype(np.float32), np.clip(rows, 0.0, _ROWS - 1.0).astype(np.float32)
