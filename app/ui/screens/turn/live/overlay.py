"""The live picture in its well, alone or over the goal."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float64
from app.core.guidance.who_moves import Mode
from app.core.localization.align import laid_over
from app.ui.screens.turn.goal import TARGET_WIDTH, mirrored


class LiveOverlay(NamedTuple):
    """The goal picture underneath the live picture.

    Attributes:
        goal: The goal picture, (h, w, 3) uint8 sRGB, at the size of the well and not mirrored.
        homography: (3, 3) float64 matrix that maps pixels of the live picture to pixels of a target
            `TARGET_WIDTH` pixels wide, or None while the two are not aligned.
        opacity: Opacity of the live picture or, in a split, the fraction of the width that it takes
            up, from 0 to 1.
        split: Whether Live is on the left and Goal on the right.
    """

    goal: Bytes
    homography: Float64 | None
    opacity: float
    split: bool = False


def live_picture(
    picture: Bytes, size: tuple[int, int], mode: Mode, overlay: LiveOverlay | None = None
) -> Bytes:
    """Fit the live picture to the width of its well, cropping it at the top and bottom.

    Args:
        picture: The picture as the camera sees it, (H, W, 3) uint8 sRGB.
        size: Rows and columns of the well.

    Returns:
        The fitted picture, (rows, columns, 3) uint8 sRGB.
    """
    rows, columns = size
    high = max(round(picture.shape[0] * columns / picture.shape[1]), 1)
    method = cv2.INTER_AREA if columns < picture.shape[1] else cv2.INTER_LINEAR
    small = np.asarray(cv2.resize(picture, (columns, high), interpolation=method), np.uint8)
    scale = columns / picture.shape[1]
    if overlay is None:
        return mirrored(_fitted(small, rows), mode)
    if not overlay.split:
        return mirrored(_over(small, overlay, scale), mode)
    result = mirrored(_over(small, overlay._replace(opacity=1.0), scale), mode).copy()
    cut = round(overlay.opacity * result.shape[1])
    result[:, cut:] = mirrored(overlay.goal, mode)[:, cut:]
    result[:, max(cut - 1, 0) : cut + 1] = 255
    return result


def _over(small: Bytes, overlay: LiveOverlay, scale: float) -> Bytes:
    columns = overlay.goal.shape[1]
    if overlay.homography is None:
        return laid_over(overlay.goal, _fitted(small, overlay.goal.shape[0]), None, overlay.opacity)
    share = columns / TARGET_WIDTH
    to_well = np.diag([share, share, 1.0]) @ overlay.homography @ np.diag([1 / scale, 1 / scale, 1])
    return laid_over(overlay.goal, small, np.asarray(to_well, np.float64), overlay.opacity)


def _fitted(picture: Bytes, rows: int) -> Bytes:
    """Crop a picture to its middle rows, or pad a shorter picture by repeating its edge rows."""
    high = picture.shape[0]
    if high >= rows:
        top = (high - rows) // 2
        return np.ascontiguousarray(picture[top : top + rows])
    above = (rows - high) // 2
    return np.pad(picture, ((above, rows - high - above), (0, 0), (0, 0)), mode="edge")
