"""Fit homographies to pairs of points, and check whether a handheld camera could cause them.

A homography is fitted by MAGSAC++ (D. Barath et al., CVPR 2020), then refined on the points that
agree. A homography has eight free numbers, which can fit many absurd views to a few points. It is
therefore accepted only if the whole view is in front of the camera, nothing is mirrored or upside
down, nothing is stretched more than a turning camera could cause, and the points determine the
corners of the view precisely.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Float64

Size: TypeAlias = tuple[int, int]
"""Number of columns and rows."""

LEAST_INLIERS: Final = 12
"""Minimum number of agreeing points. Fewer points may agree by chance."""

LEAST_OVERLAP: Final = 0.05
"""Minimum fraction of the target that the view covers."""

_REPROJECTION: Final = 0.008  # of the picture's width
_ITERATIONS: Final = 3000
_CONFIDENCE: Final = 0.999
_SCALES: Final = (0.35, 2.8)
_STRETCH: Final = 2.2  # largest ratio between a view's stretch in two directions
_LEAST_SHARE: Final = 0.16
_STRETCH_SEEN: Final = 3.5  # the same at the edges of the visible area
_SCALES_SEEN: Final = (0.2, 5.0)
_LEAST_DEPTH: Final = 0.15  # of a corner, with 1 in the middle; 0 is at infinity
_MOST_ROLL_DEG: Final = 40.0
_ROUNDS: Final = 6
_WORST_CONDITION: Final = 1e12
_CORNERS_KNOWN: Final = 0.05  # of the width: largest standard deviation of a corner
# of the width: standard deviation in the direction where it is smallest
_LEAST_SPREAD: Final = 0.04


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The alignment of a view with a target.

    Attributes:
        homography: (3, 3) float64. Maps the view's pixels to the target's, with 1 as the bottom
            right element, or None if unsure. (0, 0) is the corner of the first pixel.
        inliers: Number of points that agree.
        overlap: Fraction of the target that the view covers, 0 to 1.
        turn_error_deg: Remaining turn (goal minus view), in degrees, positive clockwise, or None if
            unsure.
        confidence: Confidence in the alignment, 0 to 1.
    """

    status: Literal["found", "unsure"]
    homography: Float64 | None
    inliers: int
    overlap: float
    turn_error_deg: float | None
    confidence: float


UNSURE: Final = Alignment("unsure", None, 0, 0.0, None, 0.0)
"""The alignment if there is no match."""


def fit_pairs(start: Float32, stop: Float32, sizes: tuple[Size, Size]) -> Alignment:
    """Fit a homography to pairs of points, some of which are wrong.

    Args:
        start, stop: (N, 2) float32. Positions in the view and in the target, in pixels.
        sizes: Columns and rows of the view, followed by those of the target.
    """
    if len(start) < LEAST_INLIERS:
        return UNSURE
    width = sizes[1][0]
    solution = _fitted_homography(start, stop, width)
    if solution is None:
        return UNSURE
    matrix, inside = solution
    # Several points that match the same position are one match.
    count = len(np.unique(np.round(stop[inside]), axis=0))
    share = float(inside.mean())
    unsure = replace(UNSURE, inliers=count)
    if not _enough(start[inside], stop[inside], count, share, width):
        return unsure
    close = _refined(matrix, start[inside], stop[inside], sizes)
    if close is None or not sound(close, *sizes):
        return unsure
    overlap = overlap_of(close, *sizes)
    if overlap < LEAST_OVERLAP:
        return unsure
    confidence = (1.0 - math.exp(-count / 25.0)) * min(1.0, share / 0.5)
    return Alignment("found", close, count, overlap, None, confidence)


def overlap_of(matrix: Float64, size: Size, target: Size) -> float:
    """Return the fraction of the target that the view covers, counted on a coarse grid."""
    return len(_back(matrix, _grid(target, 64), size)) / 64.0**2


def sound(matrix: Float64, size: Size, target: Size) -> bool:
    """Return whether a homography could result from the turn of a handheld camera.

    Args:
        matrix: (3, 3) float64. Maps the view's pixels to the target's.
        size, target: Columns and rows of the view and of the target.

    Returns:
        False if any part of the view is mirrored, folded over or at infinity, if the view is
        rotated in its plane by more than 40 degrees, or if it is stretched or scaled too much in
        its middle half or anywhere in the target.
    """
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        return False
    width, height = size
    middle = float(matrix[2] @ [width / 2.0, height / 2.0, 1.0])
    # Depth is linear in the picture: a limit that holds in its corners holds everywhere.
    corners = corners_of(size) @ matrix[2, :2] + matrix[2, 2]
    if abs(middle) < 1e-9 or (corners / middle).min() < _LEAST_DEPTH:
        return False
    steady = matrix / middle
    if np.linalg.det(steady) <= 1e-9:
        return False
    inner = _grid(size) * 0.5 + np.array(size) * 0.25
    if not _moderate(steady, inner, _SCALES, _STRETCH):
        return False
    grid_back = _back(steady, _grid(target), size)
    slopes = _slopes(steady, np.array([[width / 2.0, height / 2.0]]))[0]
    roll = math.degrees(math.atan2(slopes[1, 0] - slopes[0, 1], slopes[0, 0] + slopes[1, 1]))
    return abs(roll) <= _MOST_ROLL_DEG and _moderate(steady, grid_back, _SCALES_SEEN, _STRETCH_SEEN)


def _fitted_homography(start: Float32, stop: Float32, width: int) -> tuple[Float64, Bools] | None:
    try:
        matrix, inside = cv2.findHomography(
            start,
            stop,
            cv2.USAC_MAGSAC,
            _REPROJECTION * width,
            maxIters=_ITERATIONS,
            confidence=_CONFIDENCE,
        )
    except cv2.error:  # points on one line
        return None
    # None if nothing fits, despite the type stubs.
    homography = np.asarray(matrix, np.float64)
    if (
        homography.shape != (3, 3)
        or not np.isfinite(homography).all()
        or abs(homography[2, 2]) < 1e-9
    ):
        return None
    return homography / homography[2, 2], np.asarray(inside).ravel() > 0


def _enough(start: Float32, stop: Float32, count: int, share: float, width: int) -> bool:
    """Return whether there are enough points, spread in both directions and not along a line."""
    if count < LEAST_INLIERS or share < _LEAST_SHARE:
        return False
    spreads = [np.linalg.eigvalsh(np.cov(points.T.astype(np.float64))) for points in (start, stop)]
    least = min(float(one[0]) for one in spreads)
    return math.sqrt(max(least, 0.0)) >= _LEAST_SPREAD * width


def _refined(
    matrix: Float64, start: Float32, stop: Float32, sizes: tuple[Size, Size]
) -> Float64 | None:
    """Refine the fit to the agreeing points, or return None if the corners remain uncertain.

    The first eight elements are fitted by Gauss-Newton, with weights that depend on the spread of
    the residuals. The remaining error is propagated to the corners.
    """
    width = float(sizes[1][0])
    unit = np.diag([1.0 / width, 1.0 / width, 1.0])
    now = scaled(unit @ matrix @ np.linalg.inv(unit))
    points, places = start.astype(np.float64) / width, stop.astype(np.float64) / width
    noise, inverse = 0.0, np.eye(8)
    for _ in range(_ROUNDS):
        rows, miss = by_elements(now, points), places - apply_homography(now, points)
        away = np.linalg.norm(miss, axis=1)
        noise = max(1.5 * float(np.median(away)), 0.5 / width)
        weights = 1.0 / (1.0 + (away / noise) ** 2) ** 2
        weighted = rows * np.tile(weights, 2)[:, None]
        normal = weighted.T @ rows
        if not np.isfinite(normal).all() or np.linalg.cond(normal) > _WORST_CONDITION:
            return None
        inverse = np.linalg.inv(normal)
        change = inverse @ (weighted.T @ miss.T.ravel())
        now = now + np.append(change, 0.0).reshape(3, 3)
    at_corners = by_elements(now, corners_of(sizes[0]) / width)
    variance = np.einsum("ni,ij,nj->n", at_corners, inverse * noise**2, at_corners)
    if not math.sqrt(max(float(variance.max()), 0.0)) <= _CORNERS_KNOWN:
        return None
    return scaled(np.linalg.inv(unit) @ now @ unit)


def by_elements(matrix: Float64, points: Float64) -> Float64:
    """Return the mapped points' derivatives, (2 N, 8), with respect to the first eight elements."""
    full = np.column_stack([points, np.ones(len(points))])
    depth = (full @ matrix[2])[:, None]
    place = apply_homography(matrix, points)
    none = np.zeros_like(full)
    across = np.hstack([full, none, -place[:, :1] * points]) / depth
    down = np.hstack([none, full, -place[:, 1:] * points]) / depth
    return np.vstack([across, down])


def apply_homography(matrix: Float64, points: Float64) -> Float64:
    """Apply a homography to points.

    Args:
        matrix: (3, 3) float64. The homography.
        points: (N, 2) float64. Points in front of the camera.

    Returns:
        (N, 2) float64. The mapped points.
    """
    full = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(full[:, :2] / full[:, 2:], np.float64)


def _slopes(matrix: Float64, points: Float64) -> Float64:
    """Return a homography's derivatives, (N, 2, 2), at points, (N, 2), in front of the camera."""
    depth = points @ matrix[2, :2] + matrix[2, 2]
    rows = matrix[:2, :2] - apply_homography(matrix, points)[:, :, None] * matrix[2, :2]
    return np.asarray(rows / depth[:, None, None], np.float64)


def _moderate(
    matrix: Float64, points: Float64, scales: tuple[float, float], stretch: float
) -> bool:
    """Return whether the scale and the stretch around the given points are within limits."""
    if len(points) == 0:
        return True
    large, small = np.linalg.svd(_slopes(matrix, points), compute_uv=False).T
    mean = np.sqrt(large * small)
    inside = (mean > scales[0]) & (mean < scales[1]) & (large < stretch * small)
    return bool(inside.all())


def corners_of(size: Size) -> Float64:
    """Return the corners of a picture in pixels, (4, 2), clockwise from the top left.

    Args:
        size: Number of columns and rows of the picture.
    """
    width, height = size
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])


def _grid(size: Size, count: int = 9) -> Float64:
    """Return points that are evenly spread over a picture, (count², 2)."""
    step = (np.arange(count) + 0.5) / count
    x, y = np.meshgrid(step * size[0], step * size[1])
    return np.column_stack([x.ravel(), y.ravel()])


def _back(matrix: Float64, places: Float64, size: Size) -> Float64:
    """Map positions in the target back to the view, and return those inside the view."""
    full = np.column_stack([places, np.ones(len(places))]) @ np.linalg.inv(matrix).T
    ahead = full[:, 2] > 1e-9
    points = full[ahead, :2] / full[ahead, 2:]
    inside = ((points >= 0.0) & (points <= np.array(size))).all(axis=1)
    return np.asarray(points[inside], np.float64)


def scaled(matrix: Float64) -> Float64:
    """Return the same homography with 1 as its bottom right element.

    Args:
        matrix: (3, 3) float64. Maps pixel (0, 0) to a finite position.
    """
    return np.asarray(matrix / matrix[2, 2], np.float64)
