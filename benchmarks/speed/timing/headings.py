"""Time the live heading: a picture of the demo location, anywhere and near the last one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.localization.features import build_index, describe
from app.core.localization.heading import SEARCHING, find_heading
from app.core.measure.finish.display import display_panorama
from benchmarks.speed.timing.runner.rows import Case

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.base.progress import Token
    from app.core.localization.features import HeadingIndex

Bytes: TypeAlias = NDArray[np.uint8]
Float64: TypeAlias = NDArray[np.float64]

_VIEW: Final = "view-040-180"
_HEADING_DEG: Final = -140.0
_FOV_DEG: Final = 60.0
_SIZE: Final = (640, 480)
_SMALL: Final = (320, 240)
_TRACKED_POINTS: Final = 350
_TRIES: Final = 1200
_AGREE: Final = np.cos(np.radians(3.0))


def heading_cases(token: Token) -> Iterator[Case]:
    """Yield finding a picture of 640 x 480 in the panorama, and tracking it.

    Yields:
        ``heading.search`` (anywhere) and ``heading.track`` (near the last heading). Their limit is
        describing the picture's points by OpenCV's SIFT alone, at the size that each uses.
    """
    folder = resources() / "demo" / "location"
    panorama = display_panorama(read_environment(folder / "probe-1.exr").radiance)
    index = build_index(panorama, token)
    data = np.fromfile(folder / "views" / f"{_VIEW}.webp", np.uint8)
    shot = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR_RGB), np.uint8)
    frame = np.asarray(cv2.resize(shot, _SIZE, interpolation=cv2.INTER_CUBIC), np.uint8)
    small = np.asarray(cv2.resize(frame, _SMALL, interpolation=cv2.INTER_AREA), np.uint8)
    words = "SIFT, brute-force matching, RANSAC over 1,200 pairs in a loop"
    yield Case(
        "heading.search",
        lambda: find_heading(frame, index, _FOV_DEG),
        lambda: plain_heading(frame, index, _FOV_DEG),
        words,
        lambda: describe(frame, SEARCHING.points),
        "SIFT",
        least=2,
        budget_s=1.0,
    )
    yield Case(
        "heading.track",
        lambda: find_heading(frame, index, _FOV_DEG, near_deg=_HEADING_DEG),
        lambda: plain_heading(frame, index, _FOV_DEG),
        words,
        lambda: describe(small, _TRACKED_POINTS),
        "SIFT",
        budget_s=0.6,
        most=30,
    )


def plain_heading(frame: Bytes, index: HeadingIndex, fov_deg: float) -> float:
    """Find a heading the textbook way: as if the camera were at the probe's position.

    Args:
        frame: (H, W, 3) uint8. sRGB, not mirrored.
        fov_deg: Horizontal, deg.

    Returns:
        Panorama azimuth of the camera's axis, deg.
    """
    features = describe(frame, SEARCHING.points)
    matches = cv2.BFMatcher().knnMatch(features.descriptors, index.descriptors, k=2)
    good = [one for one, other in matches if one.distance < 0.8 * other.distance]
    height, width = frame.shape[:2]
    focal = 0.5 * width / np.tan(np.radians(0.5 * fov_deg))
    places = features.places[[one.queryIdx for one in good]]
    rays = np.column_stack(
        [(0.5 * width - places[:, 0]) / focal, (0.5 * height - places[:, 1]) / focal]
    )
    rays = np.column_stack([rays, np.ones(len(rays))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    there = index.bearings[[one.trainIdx for one in good]].astype(np.float64)
    rotation = _agreed(rays, there)
    axis = rotation @ np.array([0.0, 0.0, 1.0])
    return float(np.degrees(np.arctan2(-axis[0], axis[2])))


def _agreed(rays: Float64, there: Float64) -> Float64:
    """Return the rotation that fits most pairs of directions."""
    chance = np.random.default_rng(0)
    best, most = np.eye(3), -1
    for _ in range(_TRIES):
        chosen = chance.choice(len(rays), 2, replace=False)
        rotation = _rotation(rays[chosen], there[chosen])
        agree = int((np.einsum("nk,nk->n", rays @ rotation.T, there) > _AGREE).sum())
        if agree > most:
            best, most = rotation, agree
    inside = np.einsum("nk,nk->n", rays @ best.T, there) > _AGREE
    return _rotation(rays[inside], there[inside])


def _rotation(rays: Float64, there: Float64) -> Float64:
    """Return the rotation from directions to directions (Kabsch)."""
    u, _, vt = np.linalg.svd(there.T @ rays)
    sign = np.diag([1.0, 1.0, np.linalg.det(u @ vt)])
    result: Float64 = u @ sign @ vt
    return result
