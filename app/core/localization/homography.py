"""Homographies from pairs of points, and whether one shows what a camera in somebody's hands sees.

A homography is fitted by MAGSAC++ (D. Barath et al., CVPR 2020), then closely to the points that
agree. Eight numbers fit many absurd pictures to a few points, so it is only believed when all of
the view lies before the camera, nothing is mirrored or turned over, nothing is stretched as no turn
of a camera stretches it, and the points hold the view's corners fast.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Float64

Size: TypeAlias = tuple[int, int]
"""Columns and rows."""

LEAST_INLIERS: Final = 12
"""Fewer points in agreement may be chance."""

_REPROJECTION: Final = 0.008  # of the picture's width
_ITERATIONS: Final = 3000
_CONFIDENCE: Final = 0.999
_SCALES: Final = (0.35, 2.8)
_STRETCH: Final = 2.2  # how much more a view may be stretched one way than the other
_LEAST_SHARE: Final = 0.16
_STRETCH_SEEN: Final = 3.5  # the same at the edges of what is shown
_SCALES_SEEN: Final = (0.2, 5.0)
_LEAST_DEPTH: Final = 0.15  # of a corner, for 1 in the middle; 0 is at infinity
_MOST_ROLL_DEG: Final = 40.0
_ROUNDS: Final = 6
_WORST_CONDITION: Final = 1e12
_CORNERS_KNOWN: Final = 0.05  # of the width: standard deviation of a corner that is held fast
_LEAST_SPREAD: Final = 0.04  # of the width, standard deviation in the direction where it is least
_LEAST_OVERLAP: Final = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """How a view lies on a target.

    Attributes:
        homography: (3, 3) float64 or None. From the view's pixels to the target's, bottom right
            element 1; (0, 0) is the corner of the first pixel. None when unsure.
        overlap: Share of the target that the view covers, 0 to 1.
        turn_error_deg: float or None. Goal minus view: how far there still is to turn, positive
            clockwise, deg.
        confidence: 0 to 1.
    """

    status: Literal["found", "unsure"]
    homography: Float64 | None
    inliers: int
    overlap: float
    turn_error_deg: float | None
    confidence: float


UNSURE: Final = Alignment("unsure", None, 0, 0.0, None, 0.0)
"""Nothing was found."""


def fit_pairs(start: Float32, stop: Float32, sizes: tuple[Size, Size]) -> Alignment:
    """Fit a homography to pairs of points, wrong ones among them.

    Args:
        start, stop: (N, 2) float32. Where they are in the view and in the target, pixels.
        sizes: tuple of (columns, rows). Of view and target.
    """
    if len(start) < LEAST_INLIERS:
        return UNSURE
    width = sizes[1][0]
    solution = _fitted_homography(start, stop, width)
    if solution is None:
        return UNSURE
    matrix, inside = solution
    # Several points that all go to one place are one match.
    count = len(np.unique(np.round(stop[inside]), axis=0))
    share = float(inside.mean())
    unsure = replace(UNSURE, inliers=count)
    if not _enough(start[inside], stop[inside], count, share, width):
        return unsure
    close = _refined(matrix, start[inside], stop[inside], sizes)
    if close is None or not sound(close, *sizes):
        return unsure
    # Share of the target that is covered, by counting on a coarse grid.
    overlap = len(_back(close, _grid(sizes[1], 64), sizes[0])) / 64.0**2
    if overlap < _LEAST_OVERLAP:
        return unsure
    confidence = (1.0 - math.exp(-count / 25.0)) * min(1.0, share / 0.5)
    return Alignment("found", close, count, overlap, None, confidence)


def sound(matrix: Float64, size: Size, target: Size) -> bool:
    """Tell whether a homography shows a view as the turn of a camera in somebody's hands does.

    Args:
        matrix: (3, 3) float64. From the view's pixels to the target's.
        size, target: Columns and rows of the view and of the target.

    Returns:
        False where any of the view is mirrored, folded over or at infinity, where it is turned in
        its plane by more than 40 deg, or stretched or scaled too much: in its middle half, or
        anywhere in the target.
    """
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        return False
    width, height = size
    middle = float(matrix[2] @ [width / 2.0, height / 2.0, 1.0])
    # Depth is linear in the picture: what holds in its corners holds everywhere.
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
    # None where nothing fits, whatever the types say.
    homography = np.asarray(matrix, np.float64)
    if (
        homography.shape != (3, 3)
        or not np.isfinite(homography).all()
        or abs(homography[2, 2]) < 1e-9
    ):
        return None
    return homography / homography[2, 2], np.asarray(inside).ravel() > 0


def _enough(start: Float32, stop: Float32, count: int, share: float, width: int) -> bool:
    """Whether points are many, and spread in both directions of the plane, not along a line."""
    if count < LEAST_INLIERS or share < _LEAST_SHARE:
        return False
    spreads = [np.linalg.eigvalsh(np.cov(points.T.astype(np.float64))) for points in (start, stop)]
    least = min(float(one[0]) for one in spreads)
    return math.sqrt(max(least, 0.0)) >= _LEAST_SPREAD * width


def _refined(
    matrix: Float64, start: Float32, stop: Float32, sizes: tuple[Size, Size]
) -> Float64 | None:
    """Fit the agreeing points closely; None where they do not hold the view's corners fast.

    Gauss-Newton on the first eight elements, with weights that fall off as the residuals' own
    spread says; the error that is left is propagated to the corners.
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
    """Return how places, (N, 2), move with a homography's first eight elements: (2 N, 8)."""
    full = np.column_stack([points, np.ones(len(points))])
    depth = (full @ matrix[2])[:, None]
    place = apply_homography(matrix, points)
    none = np.zeros_like(full)
    across = np.hstack([full, none, -place[:, :1] * points]) / depth
    down = np.hstack([none, full, -place[:, 1:] * points]) / depth
    return np.vstack([across, down])


def apply_homography(matrix: Float64, points: Float64) -> Float64:
    """Return where a homography takes points.

    Args:
        matrix: (3, 3) float64. The homography.
        points: (N, 2) float64. In front of it.

    Returns:
        (N, 2) float64.
    """
    full = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(full[:, :2] / full[:, 2:], np.float64)


def _slopes(matrix: Float64, points: Float64) -> Float64:
    """Return a homography's derivatives at points (N, 2) before the camera: (N, 2, 2)."""
    depth = points @ matrix[2, :2] + matrix[2, 2]
    rows = matrix[:2, :2] - apply_homography(matrix, points)[:, :, None] * matrix[2, :2]
    return np.asarray(rows / depth[:, None, None], np.float64)


def _moderate(
    matrix: Float64, points: Float64, scales: tuple[float, float], stretch: float
) -> bool:
    """Whether nothing around some points is scaled or stretched too much."""
    if len(points) == 0:
        return True
    large, small = np.linalg.svd(_slopes(matrix, points), compute_uv=False).T
    mean = np.sqrt(large * small)
    inside = (mean > scales[0]) & (mean < scales[1]) & (large < stretch * small)
    return bool(inside.all())


def corners_of(size: Size) -> Float64:
    """Return a picture's corners, (4, 2) pixels: clockwise from the top left.

    Args:
        size: Columns and rows.
    """
    width, height = size
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])


def _grid(size: Size, count: int = 9) -> Float64:
    """Return places evenly spread over a picture, (count², 2)."""
    step = (np.arange(count) + 0.5) / count
    x, y = np.meshgrid(step * size[0], step * size[1])
    return np.column_stack([x.ravel(), y.ravel()])


def _back(matrix: Float64, places: Float64, size: Size) -> Float64:
    """Return where in the view places of the target are, those that are in it."""
    full = np.column_stack([places, np.ones(len(places))]) @ np.linalg.inv(matrix).T
    ahead = full[:, 2] > 1e-9
    points = full[ahead, :2] / full[ahead, 2:]
    inside = ((points >= 0.0) & (points <= np.array(size))).all(axis=1)
    return np.asarray(points[inside], np.float64)


def scaled(matrix: Float64) -> Float64:
    """Return the same homography with 1 at the bottom right.

    Args:
        matrix: (3, 3) float64. One that takes the pixel (0, 0) somewhere.
    """
    return np.asarray(matrix / matrix[2, 2], np.float64)
