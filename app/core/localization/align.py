"""Align the live view with the goal view, using the best-fitting homography.

Both are perspective pictures of the place behind the sitter, one taken by the probe and one by the
camera. Points are matched as for the live heading, and a homography is fitted to them
(`app.core.localization.homography`). A homography is exact only for a plane. If the scene has more
depth, it is the best fit, and the area behind the sitter, which determines the turn, is
interpolated from its surroundings.

The live heading (`app.core.localization.heading`) is more accurate, covers the whole panorama and
provides the numbers on screen. The homography is used only for the overlay. If there is a heading,
it predicts where each point of the view is in the goal view, and only points near that position
are matched. If they determine no homography but confirm the prediction, the prediction is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import cv2
import numpy as np

from app.core.base import sphere
from app.core.base.angles import difference
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.localization.features import Features, Pairs, describe, pair, pair_near, shrunk
from app.core.localization.heading_conversion import offset_angle
from app.core.localization.homography import (
    LEAST_INLIERS,
    LEAST_OVERLAP,
    UNSURE,
    Alignment,
    Size,
    apply_homography,
    corners_of,
    fit_pairs,
    overlap_of,
    scaled,
    sound,
)
from app.core.localization.live.temporal_filters import Leash, Steady, steadied
from app.core.localization.rotation import unit_rays
from app.core.localization.views import Lens

_LEASH: Final = Leash(0.015, 0.10)  # in widths of the goal
_STEP: Final = 0.06  # how far a corner may move between pictures, in widths of the goal,
_STEP_PER_S: Final = 0.8  # and how much more per second in between, for a camera that turns
_STAYS_S: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class SteadyOverlay:
    """The overlay of the live picture on the goal, starting with `BARE`.

    Attributes:
        alignment: The last alignment.
        corners: Corners of the live picture on the goal, (4, 2), in widths of the goal, or None if
            the picture is not aligned.
        rival: Corners far from the previous ones, (4, 2), in widths of the goal, and their time in
            seconds. They are used once a second picture confirms them.
    """

    alignment: Alignment = UNSURE
    corners: Steady | None = field(default=None, repr=False)
    rival: tuple[Float64, float] | None = field(default=None, repr=False)


BARE: Final = SteadyOverlay()
"""The overlay before the first picture."""


def steady_overlay(
    before: SteadyOverlay, alignment: Alignment, sizes: tuple[Size, Size], now_s: float
) -> SteadyOverlay:
    """Update the overlay with the alignment of a new picture.

    Args:
        sizes: Columns and rows of the picture, followed by those of the goal.
        now_s: Time of the picture, in seconds from any origin.
    """
    steady = before.corners
    if alignment.homography is None:
        stays = steady is not None and now_s - steady.time_s <= _STAYS_S
        return replace(before, rival=None) if stays else BARE
    corners = apply_homography(alignment.homography, corners_of(sizes[0])) / sizes[1][0]
    if steady is None or now_s - steady.time_s > _STAYS_S:
        return SteadyOverlay(alignment, Steady.at(corners, now_s))
    if _near(corners, steady.measured, now_s - steady.time_s):
        return _followed(alignment, steadied(steady, corners, now_s, _LEASH), sizes)
    rival = before.rival
    if rival is not None and _near(corners, rival[0], now_s - rival[1]):
        return SteadyOverlay(alignment, Steady.at(corners, now_s))
    return replace(before, rival=(corners, now_s))


def _near(first: Float64, second: Float64, pause_s: float) -> bool:
    return float(np.abs(first - second).max()) <= _STEP + _STEP_PER_S * max(pause_s, 0.0)


def _followed(alignment: Alignment, steady: Steady, sizes: tuple[Size, Size]) -> SteadyOverlay:
    start = corners_of(sizes[0]).astype(np.float32)
    stop = (steady.position * sizes[1][0]).astype(np.float32)
    matrix = np.asarray(cv2.getPerspectiveTransform(start, stop), np.float64)
    # A blend of two valid alignments should be valid too, but check it.
    if not sound(matrix, *sizes):
        return SteadyOverlay(alignment, Steady.at(steady.measured, steady.time_s))
    return SteadyOverlay(replace(alignment, homography=matrix), steady)


_POINTS: Final = 1500
_WIDTH: Final = 720
_PIXELS: Final = 720 * 1280
_RATIO: Final = 0.8
_REACH_RAD: Final = math.radians(6.0)  # around the predicted position
_SAME_RAD: Final = math.radians(0.3)
_CLOSER_RATIO: Final = 0.85
_ALIKE_DEG: Final = 2.0
_LEAST_SHARE: Final = 0.25  # of the points near their predicted position; by chance, it is 0.1
_CLOSE: Final = 0.03  # of the width: a point that is where the heading predicts it
_CAMERA_AXES: Final = np.diag([-1.0, -1.0, 1.0])  # right, down, forward, in panorama axes


@dataclass(frozen=True, slots=True)
class LikelyPose:
    """The pose of a view according to its heading.

    Attributes:
        to_goal_deg: Azimuth of the goal minus the heading, in degrees.
        pitch_deg, roll_deg, zoom: As in `app.core.localization.heading.Heading`.
    """

    to_goal_deg: float
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    zoom: float = 1.0


def align(
    target: Bytes,
    view: Bytes,
    *,
    fov_deg: float = 60.0,
    sitter_deg: float = 0.0,
    view_fov_deg: float | None = None,
    mask: Bools | None = None,
    pose: LikelyPose | None = None,
) -> Alignment:
    """Find the homography that maps a view to a target.

    Args:
        target: (H, W, 3) uint8. The intended view in sRGB, with the goal in the centre.
        view: (h, w, 3) uint8. The current view in sRGB, not mirrored.
        fov_deg: Horizontal field of view of the target in the panorama, in degrees, as in the lens
            returned by `app.core.localization.views.goal_lens`.
        sitter_deg: Angle from the view's axis to the sitter, in degrees, positive to the right.
        view_fov_deg: Horizontal field of view of the camera, in degrees. It matters only if the
            sitter is off the axis. By default, it is equal to that of the target.
        mask: (h, w) bool. True where the view shows background. By default, everything except the
            usual position of a sitter (`sitter_mask`) is used, or everything if too few points
            remain.
        pose: Likely pose of the view, or None to search everywhere.

    Returns:
        The alignment. It is ``unsure`` if too few points agree, or if the view would be mirrored,
        folded, or stretched more than a turning camera could cause.
    """
    if min(*target.shape[:2], *view.shape[:2]) < 32:
        return UNSURE
    masks = [mask] if mask is not None else [sitter_mask(view.shape[:2]), None]
    best = UNSURE
    for where in masks:
        angles = (fov_deg, sitter_deg, view_fov_deg or fov_deg)
        alignment = _aligned(target, view, where, angles, pose)
        if alignment.status == "found":
            return alignment
        best = max(best, alignment, key=lambda one: one.inliers)
    return best


def sitter_mask(shape: tuple[int, ...]) -> Bools:
    """Return a mask of the usual background: everything except a central head and shoulders.

    Args:
        shape: Number of rows and columns of the mask.

    Returns:
        (rows, columns) bool. False on the sitter.
    """
    rows, columns = shape[0], shape[1]
    y, x = np.mgrid[:rows, :columns]
    across = (x + 0.5 - columns / 2.0) / rows  # in heights, whatever the picture's proportions
    down = (y + 0.5) / rows
    head = (across / 0.13) ** 2 + ((down - 0.5) / 0.22) ** 2 < 1.0
    body = (np.abs(across) < 0.24) & (down > 0.68)
    return np.asarray(~(head | body))


def laid_over(target: Bytes, view: Bytes, homography: Float64 | None, opacity: float) -> Bytes:
    """Blend a view over a target with a given opacity.

    Args:
        target: (H, W, 3) uint8. sRGB.
        view: (h, w, 3) uint8. sRGB.
        homography: (3, 3) float64. As in `Alignment`, or None to fit the frame of the view to that
            of the target.
        opacity: Opacity of the view, 0 to 1.

    Returns:
        (H, W, 3) uint8. sRGB. Only the target is visible where the view does not reach.
    """
    size = (target.shape[1], target.shape[0])
    if homography is None:
        scale = np.diag([size[0] / view.shape[1], size[1] / view.shape[0], 1.0])
        homography = np.asarray(scale, np.float64)
    half = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    # OpenCV's pixels have their centres at whole numbers
    centred = np.linalg.inv(half) @ homography @ half
    warped = cv2.warpPerspective(view, centred, size, flags=cv2.INTER_LINEAR)
    full = np.full(view.shape[:2], 255, np.uint8)
    there = cv2.warpPerspective(full, centred, size, flags=cv2.INTER_LINEAR)
    share = (there.astype(np.float32) * np.float32(min(max(opacity, 0.0), 1.0) / 255.0))[..., None]
    mixed = target + share * (warped.astype(np.float32) - target)
    return (mixed + np.float32(0.5)).astype(np.uint8)


def _aligned(
    target: Bytes,
    view: Bytes,
    mask: Bools | None,
    angles: tuple[float, float, float],
    pose: LikelyPose | None,
) -> Alignment:
    small_target, _ = shrunk(target, _scale(target))
    small_view, small_mask = shrunk(view, _scale(view), mask)
    there = describe(small_target, _POINTS)
    here = describe(small_view, _POINTS, small_mask)
    sizes = (_size(small_view), _size(small_target))
    predicted = None if pose is None else _predicted(pose, sizes, angles)
    if predicted is None:
        pairs = pair(here.descriptors, there.descriptors, there.places, 3.0, _RATIO)
    else:
        pairs = _pairs_near(here, there, predicted, Lens(angles[0], sizes[1]))
    start, stop = here.places[pairs.first], there.places[pairs.second]
    alignment = fit_pairs(start, stop, sizes)
    if predicted is not None and not _turns_alike(alignment.homography, predicted, sizes, angles):
        alignment = _as_predicted(predicted, start, stop, sizes)
    if alignment.homography is None:
        return alignment
    error = _turn_error(alignment.homography, sizes, angles)
    # Sides are whole numbers of pixels, so the two scales of a picture differ slightly.
    (columns, rows), (view_columns, view_rows) = (
        (small.shape[1] / whole.shape[1], small.shape[0] / whole.shape[0])
        for small, whole in ((small_target, target), (small_view, view))
    )
    whole = np.diag([1 / columns, 1 / rows, 1.0]) @ alignment.homography
    whole = whole @ np.diag([view_columns, view_rows, 1.0])
    return replace(alignment, homography=scaled(whole), turn_error_deg=error)


def _predicted(
    pose: LikelyPose, sizes: tuple[Size, Size], angles: tuple[float, float, float]
) -> Float64:
    """Return the homography from view to target of a background in one plane."""
    fov, sitter, view_fov = angles
    # Seen from the probe, everything is larger by the zoom, measured from the sitter at eye height.
    middle = np.array([math.tan(math.radians(sitter)), math.tan(math.radians(pose.pitch_deg))])
    enlarged = np.diag([pose.zoom, pose.zoom, 1.0])
    enlarged[:2, 2] = middle * (1.0 - pose.zoom)
    turn = sphere.rotation(-pose.to_goal_deg, pose.pitch_deg, pose.roll_deg)
    turn = _CAMERA_AXES @ turn @ _CAMERA_AXES
    view, target = _matrix(Lens(view_fov, sizes[0])), _matrix(Lens(fov, sizes[1]))
    return scaled(target @ turn @ enlarged @ np.linalg.inv(view))


def _matrix(lens: Lens) -> Float64:
    """Return the matrix that projects rays to the right, down and forward to pixels."""
    columns, rows = lens.size
    focal = lens.focal_px
    return np.array([[focal, 0.0, columns / 2.0], [0.0, focal, rows / 2.0], [0.0, 0.0, 1.0]])


def _pairs_near(here: Features, there: Features, predicted: Float64, lens: Lens) -> Pairs:
    """Match the points of a view with points of the target near their predicted position."""
    spots, positions = (
        unit_rays((places - np.array(lens.size) / 2.0) / lens.focal_px).astype(np.float32)
        for places in (there.places, apply_homography(predicted, here.places.astype(np.float64)))
    )
    return pair_near(
        here.descriptors,
        there.descriptors,
        spots,
        positions,
        _REACH_RAD,
        _SAME_RAD,
        _CLOSER_RATIO,
    )


def _as_predicted(
    predicted: Float64, start: Float32, stop: Float32, sizes: tuple[Size, Size]
) -> Alignment:
    """Return the predicted alignment, if enough points are where it expects them."""
    miss = np.linalg.norm(apply_homography(predicted, start.astype(np.float64)) - stop, axis=1)
    count = int((miss < _CLOSE * sizes[1][0]).sum())
    overlap = overlap_of(predicted, *sizes)
    few = count < LEAST_INLIERS or count < _LEAST_SHARE * len(miss)
    if few or overlap < LEAST_OVERLAP or not sound(predicted, *sizes):
        return replace(UNSURE, inliers=count)
    return Alignment("found", predicted, count, overlap, None, 1.0 - math.exp(-count / 25.0))


def _turns_alike(
    matrix: Float64 | None,
    predicted: Float64,
    sizes: tuple[Size, Size],
    angles: tuple[float, float, float],
) -> bool:
    """Return whether a homography agrees with the heading, which is more accurate."""
    if matrix is None:
        return False
    first, second = (_turn_error(one, sizes, angles) for one in (matrix, predicted))
    return abs(difference(first, second)) <= _ALIKE_DEG


def _turn_error(
    matrix: Float64, sizes: tuple[Size, Size], angles: tuple[float, float, float]
) -> float:
    """Return the turn from view to goal, in degrees, at the background behind the sitter."""
    fov, sitter, view_fov = angles
    size, width = sizes[0], sizes[1][0]
    lens = Lens(view_fov, size)
    column = size[0] / 2.0 + math.tan(math.radians(sitter)) * lens.focal_px
    place = matrix @ np.array([column, size[1] / 2.0, 1.0])
    return -offset_angle(float(place[0] / place[2]), width, fov)


def _size(picture: Bytes) -> Size:
    return picture.shape[1], picture.shape[0]


def _scale(picture: Bytes) -> float:
    """Return the scale factor that shrinks a picture to the working size."""
    columns, rows = _size(picture)
    return min(_WIDTH / columns, math.sqrt(_PIXELS / (columns * rows)), 1.0)
