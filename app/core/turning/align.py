"""Laying the live view over the goal view: the best homography, and what it says about the turn.

Both are perspective pictures of the place behind the sitter, one from the probe, one from the
camera. Points are matched as for the live heading, and a homography is fitted by MAGSAC++
(D. Barath et al., CVPR 2020). It is right for a plane only; with more depth it is the best fit, and
what is behind the sitter, which decides the turn, is interpolated from what is around them.

The live heading (`app.core.turning.heading`) is more exact, knows the whole panorama, and is what
the numbers come from. The homography is what the overlay needs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.turning.features import describe, pair
from app.core.turning.headings import offset_angle
from app.core.turning.views import Lens

__all__ = ["LEAST_INLIERS", "Alignment", "align", "laid_over", "sitter_mask"]

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

LEAST_INLIERS: Final = 12
"""Fewer points in agreement may be chance."""

_POINTS: Final = 1500
_WIDTH: Final = 720
_RATIO: Final = 0.8
_REPROJECTION: Final = 0.008  # of the picture's width
_ITERATIONS: Final = 3000
_CONFIDENCE: Final = 0.999
_SCALES: Final = (0.35, 2.8)
_STRETCH: Final = 2.2  # how much more a view may be stretched one way than the other
_LEAST_SHARE: Final = 0.16
_LEAST_SPREAD: Final = 0.06  # of the width, standard deviation in each direction
_LEAST_OVERLAP: Final = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """How a view lies on a target.

    Attributes
    ----------
    status : str
        ``found`` or ``unsure``.
    homography : (3, 3) float64 or None
        From the view's pixels to the target's, bottom right element 1; (0, 0) is the corner of the
        first pixel. None when unsure.
    inliers : int
        Points that agree.
    overlap : float
        Share of the target that the view covers, 0 to 1.
    turn_error_deg : float or None
        Goal minus view: how far there still is to turn, positive clockwise, deg.
    confidence : float
        0 to 1.
    """

    status: Literal["found", "unsure"]
    homography: Float64 | None
    inliers: int
    overlap: float
    turn_error_deg: float | None
    confidence: float


def align(
    target: Bytes,
    view: Bytes,
    *,
    fov_deg: float = 60.0,
    sitter_deg: float = 0.0,
    view_fov_deg: float | None = None,
    mask: Mask | None = None,
) -> Alignment:
    """Find the homography that lays a view over a target.

    Parameters
    ----------
    target : (H, W, 3) uint8
        sRGB; what the camera should see, with the goal in its middle.
    view : (h, w, 3) uint8
        sRGB; what it sees, not mirrored.
    fov_deg : float, optional
        Horizontal field of view of the target, in the panorama's frame, deg: that of
        `app.core.turning.views.goal_lens`.
    sitter_deg : float, optional
        Where the sitter is in the view, from its axis, deg, positive to the right.
    view_fov_deg : float, optional
        Horizontal field of view of the camera, deg; needed only where the sitter is off the axis.
        The target's by default.
    mask : (h, w) bool, optional
        Where the view shows background. By default all but the usual place of a sitter
        (`sitter_mask`), if that leaves enough, else everything.

    Returns
    -------
    Alignment
        ``unsure`` where too few points agree, or the view would be mirrored, folded, or stretched
        as no turn of a camera stretches it.
    """
    if min(*target.shape[:2], *view.shape[:2]) < 32:
        return _unsure(0)
    masks = [mask] if mask is not None else [sitter_mask(view.shape[:2]), None]
    best = _unsure(0)
    for where in masks:
        found = _aligned(target, view, where, (fov_deg, sitter_deg, view_fov_deg or fov_deg))
        if found.status == "found":
            return found
        best = max(best, found, key=lambda one: one.inliers)
    return best


def sitter_mask(shape: tuple[int, ...]) -> Mask:
    """Return where the background usually is: all but a head and shoulders in the middle.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns.

    Returns
    -------
    (rows, columns) bool
        False on the sitter.
    """
    rows, columns = shape[0], shape[1]
    y, x = np.mgrid[:rows, :columns]
    across = (x + 0.5 - columns / 2.0) / rows  # in heights, whatever the picture's proportions
    down = (y + 0.5) / rows
    head = (across / 0.13) ** 2 + ((down - 0.5) / 0.22) ** 2 < 1.0
    body = (np.abs(across) < 0.24) & (down > 0.68)
    return np.asarray(~(head | body))


def laid_over(target: Bytes, view: Bytes, homography: Float64 | None, opacity: float) -> Bytes:
    """Blend a view over a target.

    Parameters
    ----------
    target : (H, W, 3) uint8
        sRGB.
    view : (h, w, 3) uint8
        sRGB.
    homography : (3, 3) float64 or None
        As in `Alignment`; None fits the view's frame to the target's.
    opacity : float
        Of the view, 0 to 1.

    Returns
    -------
    (H, W, 3) uint8
        The target where the view does not reach.
    """
    size = (target.shape[1], target.shape[0])
    if homography is None:
        scale = np.diag([size[0] / view.shape[1], size[1] / view.shape[0], 1.0])
        homography = np.asarray(scale, np.float64)
    half = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    centred = np.linalg.inv(half) @ homography @ half  # OpenCV's pixels have their middle at (0, 0)
    moved = cv2.warpPerspective(view, centred, size, flags=cv2.INTER_LINEAR)
    full = np.full(view.shape[:2], 255, np.uint8)
    there = cv2.warpPerspective(full, centred, size, flags=cv2.INTER_LINEAR)
    share = (there.astype(np.float32) * np.float32(min(max(opacity, 0.0), 1.0) / 255.0))[..., None]
    mixed = target + share * (moved.astype(np.float32) - target)
    return (mixed + np.float32(0.5)).astype(np.uint8)


def _aligned(
    target: Bytes, view: Bytes, mask: Mask | None, angles: tuple[float, float, float]
) -> Alignment:
    small_target, target_scale = _shrunk(target)
    small_view, view_scale = _shrunk(view)
    small_mask = None if mask is None else _fitted(mask, small_view.shape)
    there = describe(small_target, _POINTS)
    here = describe(small_view, _POINTS, small_mask)
    pairs = pair(here.descriptors, there.descriptors, there.places, 3.0, _RATIO)
    if len(pairs.first) < LEAST_INLIERS:
        return _unsure(0)
    start, stop = here.places[pairs.first], there.places[pairs.second]
    found = _fitted_homography(start, stop, small_target.shape[1])
    if found is None:
        return _unsure(0)
    matrix, inside = found
    # Several points that all go to one place are one match.
    count = len(np.unique(np.round(stop[inside]), axis=0))
    share = float(inside.mean())
    if not _enough(start[inside], stop[inside], count, share, small_target.shape[1]):
        return _unsure(count)
    size = (small_view.shape[1], small_view.shape[0])
    overlap = _overlap(matrix, size, (small_target.shape[1], small_target.shape[0]))
    if not _plausible(matrix, size) or overlap < _LEAST_OVERLAP:
        return _unsure(count)
    error = _turn_error(matrix, size, small_target.shape[1], angles)
    whole = np.diag([1 / target_scale, 1 / target_scale, 1.0]) @ matrix
    whole = whole @ np.diag([view_scale, view_scale, 1.0])
    confidence = (1.0 - math.exp(-count / 25.0)) * min(1.0, share / 0.5)
    homography = np.asarray(whole / whole[2, 2], np.float64)
    return Alignment("found", homography, count, overlap, error, confidence)


def _fitted_homography(start: Float32, stop: Float32, width: int) -> tuple[Float64, Mask] | None:
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
    found = np.asarray(matrix, np.float64)
    if found.shape != (3, 3) or not np.isfinite(found).all() or abs(found[2, 2]) < 1e-9:
        return None
    return found / found[2, 2], np.asarray(inside).ravel() > 0


def _enough(start: Float32, stop: Float32, count: int, share: float, width: int) -> bool:
    if count < LEAST_INLIERS or share < _LEAST_SHARE:
        return False
    spread = min(float(start.std(axis=0).min()), float(stop.std(axis=0).min()))
    return spread >= _LEAST_SPREAD * width


def _plausible(matrix: Float64, size: tuple[int, int]) -> bool:
    """Whether the view's middle part is neither mirrored nor folded nor stretched too much."""
    for across in (0.25, 0.5, 0.75):
        for down in (0.25, 0.5, 0.75):
            slopes = _slopes(matrix, across * size[0], down * size[1])
            if slopes is None:
                return False
            large, small = np.linalg.svd(slopes, compute_uv=False)
            mean = math.sqrt(float(large * small))
            if np.linalg.det(slopes) <= 0.0 or not _SCALES[0] < mean < _SCALES[1]:
                return False
            if large > _STRETCH * small:
                return False
    return True


def _slopes(matrix: Float64, x: float, y: float) -> Float64 | None:
    """Return a homography's derivative at a point, (2, 2); None where that is at infinity."""
    u, v, w = matrix @ np.array([x, y, 1.0])
    if w < 0.2:
        return None
    rows = (matrix[:2, :2] - np.outer([u / w, v / w], matrix[2, :2])) / w
    return np.asarray(rows, np.float64)


def _overlap(matrix: Float64, size: tuple[int, int], target: tuple[int, int]) -> float:
    """Share of the target that is covered, by counting on a coarse grid."""
    y, x = np.mgrid[:64, :64]
    grid = np.stack([(x + 0.5) / 64 * target[0], (y + 0.5) / 64 * target[1], np.ones((64, 64))])
    back = np.linalg.inv(matrix) @ grid.reshape(3, -1)
    ahead = back[2] * np.sign(np.linalg.det(matrix)) > 1e-9
    depth = np.where(ahead, back[2], 1.0)
    inside = ahead & (back[0] / depth >= 0) & (back[0] / depth <= size[0])
    inside &= (back[1] / depth >= 0) & (back[1] / depth <= size[1])
    return float(inside.mean())


def _turn_error(
    matrix: Float64, size: tuple[int, int], width: int, angles: tuple[float, float, float]
) -> float:
    """Goal minus view: what is behind the sitter in the view, against the target's middle."""
    fov, sitter, view_fov = angles
    lens = Lens(view_fov, size)
    column = size[0] / 2.0 + math.tan(math.radians(sitter)) * lens.focal_px
    place = matrix @ np.array([column, size[1] / 2.0, 1.0])
    return -offset_angle(float(place[0] / place[2]), width, fov)


def _unsure(inliers: int) -> Alignment:
    return Alignment("unsure", None, inliers, 0.0, None, 0.0)


def _shrunk(picture: Bytes) -> tuple[Bytes, float]:
    """Bring a picture to at most `_WIDTH` columns; and by which factor."""
    scale = min(_WIDTH / picture.shape[1], 1.0)
    if scale == 1.0:
        return picture, 1.0
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8), scale


def _fitted(mask: Mask, shape: tuple[int, ...]) -> Mask:
    size = (shape[1], shape[0])
    small = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    return np.asarray(small, np.uint8) > 0
