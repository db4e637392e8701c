"""Align handheld brackets of ordinary pictures by homographies.

Rotating a camera transforms its picture by a homography, whatever the scene, and the shift of a
hand is small compared with typical distances. Each frame is aligned with its neighbour in exposure,
and thus step by step with the middle frame, by least squares on the differences in brightness
(Lucas and Kanade, with second-order steps as in Malis, "Improving vision-based control using
efficient second-order minimization techniques", ICRA 2004). The fit is coarse to fine and robust,
so moving objects have little effect. Brightness is first matched by rank, which works with any tone
curve.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Bytes, Float32, Float64, Indices
from app.core.base.colour import largest_channel, smallest_channel
from app.core.base.remarks import Remark
from app.core.localization.homography import apply_homography as moved_by
from app.core.localization.homography import by_elements, scaled
from app.core.measure.bracket.alignment.registration import middle_frame
from app.core.measure.bracket.remarks import FramesShifted

LONGEST: Final = 1600
"""Longer side of the compared pictures in pixels. More pixels do not improve the result."""

_COARSEST: Final = 56  # shorter side at the first level, in pixels
_ROUNDS: Final = 12
_ENOUGH_PX: Final = 0.01
_OPEN: Final = (8.0, 243.0)  # codes that are neither black nor clipped
_WHOLE: Final = 0.999
_ODD: Final = 30.0  # codes beyond which a difference carries no more information
_BEST: Final = 60_000  # number of positions with the strongest gradients to compare
_FEWEST: Final = 400
# Typical motion of a hand, in halves of the longer side: shift, turn and the remaining perspective
# (tilt). Lenses and rolling shutters add a little scale and shear.
_SHIFT, _TURN, _SCALE, _SHEAR, _TILT = 0.1, 0.02, 0.003, 0.002, 0.005
_LEAST_PX: Final = 0.4  # smaller shifts, in pixels, are not worth resampling
_BETTER: Final = 0.95  # maximum fraction of the differences that may remain after moving a frame
_LEAST_MIDDLE_PX: Final = 0.5
_FARTHEST: Final = 0.08  # maximum shift as a fraction of the longer side
# Noise is correlated between neighbouring pixels, so errors are three times as large.
_NEIGHBOURS: Final = 9.0


@dataclass(frozen=True, slots=True)
class Lay:
    """A homography that aligns a picture with the reference.

    Attributes:
        homography: (3, 3) float64. Maps pixels of the reference to those of the frame.
        shift_px: Largest shift among the corners and the middle, in pixels of the full frames.
        error_px: Standard error of the shift, also in pixels of the full frames.
        trusted: Whether the frames could be compared.
        needed: Whether the bracket was shot handheld and the shift exceeds its standard error.
    """

    homography: Float64 = field(repr=False)
    shift_px: float
    error_px: float
    trusted: bool
    needed: bool = False


def warp(pixels: NDArray[Any], homography: Float64) -> NDArray[Any]:
    """Warp a frame by `Lay.homography`, repeating its edge pixels outside the frame.

    Args:
        pixels: (H, W) or (H, W, C). Encoded uint8 or uint16, or linear float32.
        homography: (3, 3) float64. Maps pixels of the result to those of the frame.

    Returns:
        The warped frame, with the same shape and dtype.
    """
    height, width = pixels.shape[:2]
    coded = pixels.dtype != np.float32
    warped = cv2.warpPerspective(
        pixels,
        homography,
        (width, height),
        # With cubic interpolation, linear light would overshoot strongly next to lamps.
        flags=(cv2.INTER_CUBIC if coded else cv2.INTER_LINEAR) | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(warped)


def visibility(
    proxies: Sequence[Bytes], moves: Sequence[Float64 | None], full: tuple[int, int]
) -> list[Float32 | None]:
    """Return the visible area of each moved frame, at the proxies' size.

    Args:
        proxies: Small encoded copies of the frames, (h, w, 3) uint8 each.
        moves: Homography of each frame, (3, 3) float64 in pixels of the full frames, or None for a
            frame that is not moved.
        full: Rows and columns of the full frames.

    Returns:
        One mask per frame, (h, w) float32 of 1 or 0, or None for a frame that is entirely visible.
        Areas that no frame shows count as visible.
    """
    masks: list[Float32 | None] = []
    for proxy, move in zip(proxies, moves, strict=True):
        small = (proxy.shape[0], proxy.shape[1])
        mask = 1.0 - blank(proxy).astype(np.float32)
        if move is not None:
            scale = np.diag([small[1] / full[1], small[0] / full[0], 1.0])
            way = scale @ move @ np.linalg.inv(scale)
            mask = warp(mask, way) * _inside(move, full, small)
        masks.append(None if mask.min() >= 1.0 else (mask > 0.999).astype(np.float32))
    some = [mask for mask in masks if mask is not None]
    if len(some) == len(masks):  # areas that no frame shows may stay as they are
        nowhere = np.maximum.reduce(some) == 0.0
        for mask in some:
            mask[nowhere] = 1.0
    return masks


def _inside(homography: Float64, full: tuple[int, int], small: tuple[int, int]) -> Float32:
    """Return a mask of the area where a moved frame has pixels."""
    rows = (np.arange(small[0]) + 0.5) * (full[0] / small[0]) - 0.5
    columns = (np.arange(small[1]) + 0.5) * (full[1] / small[1]) - 0.5
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    x, y = moved_by(homography, places).T.reshape(2, *small)
    # Leave out a margin of one small pixel, since the mask is interpolated between small pixels.
    edge_y, edge_x = full[0] / small[0], full[1] / small[1]
    inside = (x >= edge_x) & (x <= full[1] - 1 - edge_x) & (y >= edge_y)
    return np.asarray(inside & (y <= full[0] - 1 - edge_y), np.float32)


def blank(picture: Bytes) -> Bools:
    """Return a mask, (h, w), of borders that a program has filled with one pure primary colour."""
    low, high = smallest_channel(picture), largest_channel(picture)
    flat = cv2.dilate(((low < 24) & (high > 231)).astype(np.uint8), np.ones((3, 3), np.uint8))
    sure = (low <= 8) & (high >= 247)
    _, labels = cv2.connectedComponents(np.pad(flat, 1), connectivity=8)
    labels = np.asarray(labels)[1:-1, 1:-1]
    edges = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    rims = np.intersect1d(edges[edges > 0], labels[sure])
    return np.asarray(np.isin(labels, rims))


def reference_of(pictures: Sequence[Bytes]) -> int:
    """Return the index of the reference frame, which is the middle one if that is well exposed.

    Args:
        pictures: Encoded pictures, (h, w, 3) uint8 each, brightest first.
    """
    return middle_frame([float(_open(picture).mean()) for picture in pictures])


def remarks(lays: Sequence[Lay], names: Sequence[str]) -> tuple[Remark, ...]:
    """Report which frames were moved."""
    moved = [(name, lay.shift_px) for name, lay in zip(names, lays, strict=True) if lay.needed]
    return (FramesShifted(*zip(*moved, strict=True)),) if moved else ()


def lay_on_each_other(
    pictures: Sequence[Bytes], stops: Sequence[float], reference: int, scale: float
) -> tuple[Lay, ...]:
    """Return the homography that aligns each picture with the reference.

    Args:
        pictures: Encoded pictures, (h, w, 3) uint8 each, all scaled down by the same factor to at
            most `LONGEST` pixels.
        stops: Exposures of the pictures, in stops.
        reference: Index of the reference.
        scale: Number of pixels in a full frame per pixel in a picture.
    """
    order = sorted(range(len(pictures)), key=lambda k: stops[k])
    place = order.index(reference)
    ways: dict[int, tuple[Float64, float]] = {reference: (np.eye(3), 0.0)}
    with ThreadPoolExecutor(2) as pool:
        pyramids = list(pool.map(_pyramid, pictures))

        def onward(side: Sequence[int]) -> None:
            """Align each frame with the nearest previous one that could be aligned."""
            near = reference
            for index in side:
                matrix, error = _between(pyramids[near], pyramids[index])
                first, before = ways[near]
                ways[index] = matrix @ first, math.hypot(error, before)
                near = index if math.isfinite(error) else near

        list(pool.map(onward, (order[place + 1 :], order[:place][::-1])))
    shape = (pictures[0].shape[0], pictures[0].shape[1])
    lays = [_lay(*ways[index], shape, scale) for index in range(len(pictures))]
    # A hand never turns about the middle of every picture. Warped scans of film seem to, and
    # whoever made the scans has aligned them as well as possible.
    middles = [scale * float(_shifts(ways[index][0], shape)[-1]) for index in range(len(lays))]
    if max(m for lay, m in zip(lays, middles, strict=True) if lay.trusted) < _LEAST_MIDDLE_PX:
        return tuple(lays)
    return tuple(
        replace(lay, needed=lay.trusted and lay.shift_px > max(_LEAST_PX, 3.0 * lay.error_px))
        for lay in lays
    )


def _lay(matrix: Float64, error: float, shape: tuple[int, int], scale: float) -> Lay:
    """Convert a fit to pixels of the full frames and judge its quality."""
    enlarge = np.array(
        [[scale, 0.0, 0.5 * scale - 0.5], [0.0, scale, 0.5 * scale - 0.5], [0, 0, 1]]
    )
    full = enlarge @ matrix @ np.linalg.inv(enlarge)
    shift = float(_shifts(matrix, shape).max())
    trusted = math.isfinite(error) and shift < _FARTHEST * max(shape)
    return Lay(scaled(full), shift * scale, error * scale, trusted)


def _precision(free: bool) -> Float64:
    """Return the quadratic form, (8, 8), that penalises unlikely values of the eight unknowns."""
    rows = np.zeros((8, 8))
    rows[0, [0, 4]] = rows[1, [0, 4]] = rows[2, [1, 3]] = rows[3, [1, 3]] = 0.5
    rows[1, 4], rows[2, 1] = -0.5, -0.5
    rows[4, 2] = rows[5, 5] = rows[6, 6] = rows[7, 7] = 1.0
    rest = 1.0 if free else 0.01
    likely = [_SCALE, _SHEAR, _TURN / rest, _SHEAR, _SHIFT / rest, _SHIFT / rest, _TILT, _TILT]
    scaled = rows / (rest * np.array(likely))[:, None]
    return np.asarray(scaled.T @ scaled)


def _shifts(matrix: Float64, shape: tuple[int, int]) -> Float64:
    """Return the shifts of the corners and of the middle, in pixels."""
    places = np.array([[0, 0], [0, 1], [1, 0], [1, 1], [0.5, 0.5]]) * shape[::-1]
    return np.asarray(np.linalg.norm(moved_by(matrix, places) - places, axis=1))


def _pyramid(picture: Bytes) -> list[Bytes]:
    """Return greyscale pictures, smallest first, in which pure blue (from borders) turns white."""
    grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)
    red, green, blue = cv2.split(picture)
    grey[(np.asarray(blue) > 247) & (np.maximum(red, green) < 8)] = 255
    levels = [np.asarray(cv2.GaussianBlur(grey, (0, 0), 0.7), np.uint8)]
    while min(levels[0].shape) >= 2 * _COARSEST:
        levels.insert(0, np.asarray(cv2.pyrDown(levels[0]), np.uint8))
    return levels


def _between(first: list[Bytes], second: list[Bytes]) -> tuple[Float64, float]:
    """Return the homography from one picture to another, and its standard error in pixels."""
    matrix, error = np.eye(3), math.inf
    one = alike = other = first[-1]
    # Scales to pictures twice as large, with pixel centres at integers.
    up = np.diag([2.0, 2.0, 1.0])
    for number, (one, other) in enumerate(zip(first, second, strict=True)):
        matrix = up @ matrix @ np.linalg.inv(up) if number else matrix
        prior = _precision(number >= len(first) - 2)
        alike = np.asarray(cv2.LUT(other, _by_rank(other, one)), np.uint8)
        matrix, error = _fit(one, alike, other, matrix, prior)
    if not math.isfinite(error):
        return np.eye(3), math.inf
    if not _better(one, alike, other, matrix):
        return np.eye(3), error
    return matrix, error


def _better(one: Bytes, alike: Bytes, other: Bytes, matrix: Float64) -> bool:
    """Return whether moving the frame reduces the mean difference at edges, ignoring outliers."""
    target = one.astype(np.float32)
    slope = _slope(target)
    results = []
    for way in (np.eye(3), matrix):
        warped, visible = _warp(alike, other, way)
        results.append((np.abs(target - warped), _open(one) & (visible > _WHOLE)))
    picked = _telling(slope, results[0][1] & results[1][1])
    if picked.size < _FEWEST:
        return False
    before, after = (np.minimum(off.ravel()[picked], _ODD).mean() for off, _ in results)
    return bool(after < _BETTER * before)


def _by_rank(codes: Bytes, as_in: Bytes) -> Bytes:
    """Return the table, (256,), that matches one picture's histogram to another's."""
    own = np.bincount(codes.ravel(), minlength=256).astype(np.float64)
    rank_target = np.cumsum(np.bincount(as_in.ravel(), minlength=256)).astype(np.float64)
    middle = np.cumsum(own) - 0.5 * own
    rising = np.concatenate([[True], np.diff(rank_target) > 0.0])
    table = np.interp(middle, rank_target[rising], np.arange(256.0)[rising])
    return np.asarray(np.clip(np.rint(table), 0, 255), np.uint8)


def _fit(
    one: Bytes, alike: Bytes, other: Bytes, start: Float64, prior: Float64
) -> tuple[Float64, float]:
    """Fit a homography by least squares at one pyramid level."""
    height, width = one.shape
    half = 0.5 * max(width, height)
    unit = np.array(
        [[1 / half, 0, -0.5 * width / half], [0, 1 / half, -0.5 * height / half], [0, 0, 1]]
    )
    target = one.astype(np.float32)
    still = _slope(target)
    matrix, spread = start, np.eye(8)
    for _ in range(_ROUNDS):
        warped, visible = _warp(alike, other, matrix)
        inside = _open(one) & (visible > _WHOLE)
        slope = np.float32(0.5) * (still + _slope(warped))
        picked = _telling(slope, inside)
        if picked.size < _FEWEST:
            return start, math.inf
        so_far = (scaled(unit @ matrix @ np.linalg.inv(unit)) - np.eye(3)).ravel()[:8]
        step, spread = _step(target - warped, slope, picked, unit, (prior, so_far))
        # The step moves positions in the reference, and those in the frame follow.
        change = np.append(step, 0.0).reshape(3, 3) + np.eye(3)
        change = np.linalg.inv(unit) @ change @ unit
        matrix = scaled(matrix @ change)
        if _shifts(change, (height, width)).max() < _ENOUGH_PX:
            break
    return matrix, half * _corner_error(spread, width / height)


def _slope(picture: Float32) -> Float32:
    """Return the change per pixel, to the right and downwards, (2, h, w)."""
    down, right = np.gradient(picture)
    return np.asarray(np.stack([np.asarray(right), np.asarray(down)]), np.float32)


def _open(codes: Bytes) -> Bools:
    """Return a mask of codes that are neither black nor clipped."""
    return np.asarray((codes > _OPEN[0]) & (codes < _OPEN[1]))


def _warp(alike: Bytes, other: Bytes, matrix: Float64) -> tuple[Float32, Float32]:
    """Return a frame with the reference's brightness and position, and a mask of its open codes."""
    height, width = other.shape
    there, visible = (
        cv2.warpPerspective(
            plane.astype(np.float32),
            matrix,
            (width, height),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        for plane in (alike, _open(other))
    )
    return np.asarray(there, np.float32), np.asarray(visible, np.float32)


def _telling(slope: Float32, inside: Bools) -> Indices:
    """Return the positions with the steepest gradients."""
    strength = np.where(inside, np.abs(slope[0]) + np.abs(slope[1]), 0.0)
    strength[[0, -1]], strength[:, [0, -1]] = 0.0, 0.0
    flat = strength.ravel()
    count = int(np.count_nonzero(flat > 1.0))
    if count > _BEST:
        limit = np.partition(flat[flat > 1.0], count - _BEST)[count - _BEST]
        return np.flatnonzero(flat >= limit)
    return np.flatnonzero(flat > 1.0)


def _step(
    difference: Float32,
    slope: Float32,
    picked: Indices,
    unit: Float64,
    belief: tuple[Float64, Float64],
) -> tuple[Float64, Float64]:
    """Return one robust Gauss-Newton step, (8,) in unit coordinates, and its covariance."""
    rows, columns = np.divmod(picked, difference.shape[1])
    x = unit[0, 0] * columns + unit[0, 2]
    y = unit[1, 1] * rows + unit[1, 2]
    gx = slope[0].ravel()[picked] / unit[0, 0]
    gy = slope[1].ravel()[picked] / unit[1, 1]
    along = x * gx + y * gy
    design = np.stack([x * gx, y * gx, gx, x * gy, y * gy, gy, -x * along, -y * along], axis=1)
    off = difference.ravel()[picked].astype(np.float64)
    noise = max(1.4826 * float(np.median(np.abs(off))), 0.5)
    weight = 1.0 / (1.0 + np.square(off / (2.0 * noise)))
    weighted = design.T * weight
    precision, so_far = belief
    prior = precision * noise**2 * _NEIGHBOURS
    normal = weighted @ design + prior
    step = np.linalg.solve(normal, weighted @ off - prior @ so_far)
    return step, np.linalg.inv(normal) * noise**2 * _NEIGHBOURS


def _corner_error(spread: Float64, aspect: float) -> float:
    """Return the largest standard error among the corner positions, in unit coordinates."""
    sides = np.array([min(aspect, 1.0), min(1.0 / aspect, 1.0)])
    rows = by_elements(np.eye(3), sides * [[1, 1], [-1, 1], [1, -1], [-1, -1]])
    variances = np.einsum("ni,ij,nj->n", rows, spread, rows).reshape(2, -1).sum(axis=0)
    return math.sqrt(float(variances.max()))
