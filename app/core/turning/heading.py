"""The live heading: where in the panorama a camera's picture is.

Once for a place, `build_index` cuts views out of the panorama, 70 deg wide, every 40 deg and at two
elevations, and describes their points; each point is kept from the view that shows it most
squarely. A picture of the camera is then described, matched with all of them, or with those near
the last heading, and `app.core.turning.rotation` finds the rotation, knowing that the camera stands
away from where the probe stood.

A heading that cannot be trusted is `unsure`, without a number: better none than a wrong one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.angles import wrap
from app.core.errors import CoreError
from app.core.progress import Report, Token, silent
from app.core.turning import rotation
from app.core.turning.features import Features, describe, pair
from app.core.turning.views import Lens, bearings, look

if TYPE_CHECKING:
    from app.core.turning.rotation import Pose

__all__ = ["LEAST_INLIERS", "UNSURE", "Heading", "HeadingIndex", "build_index", "find_heading"]

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

LEAST_INLIERS: Final = 12
"""Fewer points in agreement may be chance."""

_EVERY_DEG: Final = 40
_VIEW_DEG: Final = 70.0
_PITCHES_DEG: Final = (17.0, -17.0)
_VIEW_SHAPE: Final = (60.0, 70.0)  # degrees, tall and wide: each view reaches over the horizon
_PER_DEG: Final = 10.0  # pixels of a view, at most
_VIEW_POINTS: Final = 900
_SEARCHING: Final = (640, 1000)  # columns of the picture, and points in it
_TRACKING: Final = (480, 700)  # as exact, and three times as quick
_SAME: Final = math.radians(1.5)
_NEAR_DEG: Final = 75.0
_WORST_DEG: Final = 1.5
_LEAST_SPREAD: Final = 0.10  # of the picture's half width, standard deviation in each direction
_LEAST_SHARE: Final = 0.16


@dataclass(frozen=True, slots=True, eq=False)
class HeadingIndex:
    """The points of a panorama, described.

    Attributes
    ----------
    descriptors : (N, 128) float32
        RootSIFT.
    bearings : (N, 3) float32
        Unit vectors in the panorama's axes.
    azimuths : (N,) float32
        Deg, ascending.
    """

    descriptors: Float32 = field(repr=False)
    bearings: Float32 = field(repr=False)
    azimuths: Float32 = field(repr=False)

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self.azimuths)

    def near(self, azimuth_deg: float, reach_deg: float) -> NDArray[np.int64]:
        """Return the indices of the points around an azimuth.

        Parameters
        ----------
        azimuth_deg, reach_deg : float
            The middle, and how far to both sides, deg.
        """
        away = np.abs((self.azimuths - azimuth_deg + 180.0) % 360.0 - 180.0)
        return np.flatnonzero(away <= reach_deg)


@dataclass(frozen=True, slots=True)
class Heading:
    """Where a camera points.

    Attributes
    ----------
    status : str
        ``found`` or ``unsure``.
    heading_deg : float or None
        Panorama azimuth of the camera's axis, deg in (-180, 180]; None when unsure.
    pitch_deg, roll_deg : float
        Up, and clockwise in the picture; deg. 0 when unsure.
    inliers : int
        Points that agree.
    confidence : float
        0 to 1.
    zoom : float
        How much larger things near the sitter are in the panorama, as angles, than in the picture;
        it shows how far behind the sitter the background is. 1 when unsure.
    """

    status: Literal["found", "unsure"]
    heading_deg: float | None
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    inliers: int = 0
    confidence: float = 0.0
    zoom: float = 1.0

    @property
    def words(self) -> str:
        """Quality in words, for beside the picture."""
        if self.status == "found":
            return f"Heading found, {self.inliers} points agree"
        return "Looking for the background"


UNSURE: Final = Heading("unsure", None)
"""Nothing was found."""


def build_index(
    panorama: Bytes, token: Token | None = None, report: Report = silent
) -> HeadingIndex:
    """Describe a panorama's points.

    Parameters
    ----------
    panorama : (H, W, 3) uint8
        Equirectangular, 2:1, sRGB as shown (`app.core.probe.display.display_panorama`); 2,048 to
        4,096 columns are best.
    token : Token, optional
        Stops it.
    report : Report, optional
        Progress.

    Returns
    -------
    HeadingIndex
        Some thousand points.

    Raises
    ------
    CoreError
        When it has next to none: a blank wall all around.
    Cancelled
    """
    per_degree = min(_PER_DEG, panorama.shape[1] / 360.0 * 1.3)
    focal = per_degree * 180.0 / math.pi
    tall, wide = (round(2 * focal * math.tan(math.radians(a) / 2)) for a in _VIEW_SHAPE)
    lens = Lens(_VIEW_DEG, (wide, tall))
    parts: list[tuple[Features, Float64]] = []
    views = [(a, p) for a in range(-180, 180, _EVERY_DEG) for p in _PITCHES_DEG]
    for done, (azimuth, pitch) in enumerate(views):
        if token is not None:
            token.check()
        report(done / len(views), "Learning the background")
        found = describe(look(panorama, float(azimuth), lens, pitch), _VIEW_POINTS)
        parts.append(_squarely_seen(found, lens, float(azimuth), pitch))
    report(1.0, "Learning the background")
    descriptors = np.concatenate([features.descriptors for features, _ in parts])
    vectors = np.concatenate([vectors for _, vectors in parts])
    if len(vectors) < 4 * LEAST_INLIERS:
        raise CoreError(
            "There is nothing in this panorama that a camera could be found by.",
            "Turn by the number of degrees, or capture it again with more light.",
        )
    azimuths = np.degrees(np.arctan2(-vectors[:, 0], vectors[:, 2]))
    order = np.argsort(azimuths)
    arrays = (descriptors[order], vectors[order], azimuths[order])
    return HeadingIndex(*(np.ascontiguousarray(a, np.float32) for a in arrays))


def find_heading(
    frame: Bytes,
    index: HeadingIndex,
    fov_deg: float,
    *,
    near_deg: float | None = None,
    sitter_deg: float = 0.0,
    mask: NDArray[np.bool_] | None = None,
) -> Heading:
    """Find where a camera points.

    Parameters
    ----------
    frame : (H, W, 3) uint8
        sRGB, not mirrored, of any size.
    index : HeadingIndex
        Of the panorama.
    fov_deg : float
        The camera's horizontal field of view, deg; 20 % off does no harm.
    near_deg : float, optional
        The last heading, deg: only what lies around it is searched, which is quicker and more
        certain. Without it, and when that fails, everything should be.
    sitter_deg : float, optional
        Where the sitter is from the axis, deg, positive to the right.
    mask : (H, W) bool, optional
        Where the background is; by default all of it, since points on the sitter match nothing.

    Returns
    -------
    Heading
    """
    if frame.ndim != 3 or min(frame.shape[:2]) < 32:
        return UNSURE
    width, points = _SEARCHING if near_deg is None else _TRACKING
    small, small_mask = _shrunk(frame, mask, width)
    features = describe(small, points, small_mask)
    chosen = np.arange(len(index)) if near_deg is None else index.near(near_deg, _NEAR_DEG)
    spots = index.bearings[chosen]
    pairs = pair(features.descriptors, index.descriptors[chosen], spots, _SAME)
    lens = Lens(fov_deg, (small.shape[1], small.shape[0]))
    rays = _rays(features.places[pairs.first], lens, sitter_deg)
    pose = rotation.fit(rays, spots[pairs.second].astype(np.float64))
    return UNSURE if pose is None else _judged(pose, rays, pairs.second, lens, sitter_deg)


def _squarely_seen(
    found: Features, lens: Lens, azimuth_deg: float, pitch_deg: float
) -> tuple[Features, Float64]:
    """Keep the points that no other view shows more squarely."""
    vectors = bearings(lens, azimuth_deg, pitch_deg, found.places.astype(np.float64))
    azimuth = np.degrees(np.arctan2(-vectors[:, 0], vectors[:, 2]))
    away = np.abs((azimuth - azimuth_deg + 180.0) % 360.0 - 180.0)
    keep = (away <= _EVERY_DEG / 2) & ((vectors[:, 1] >= 0.0) == (pitch_deg > 0.0))
    return Features(found.places[keep], found.descriptors[keep]), vectors[keep]


def _shrunk(
    frame: Bytes, mask: NDArray[np.bool_] | None, width: int
) -> tuple[Bytes, NDArray[np.bool_] | None]:
    if frame.shape[1] <= width:
        return frame, mask
    size = (width, max(round(frame.shape[0] * width / frame.shape[1]), 1))
    small = np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)
    if mask is None:
        return small, None
    shrunk = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    return small, np.asarray(shrunk, np.uint8) > 0


def _rays(places: Float32, lens: Lens, sitter_deg: float) -> Float64:
    """Picture plane of a camera turned so that the sitter is on its axis, (N, 2)."""
    x = (places[:, 0].astype(np.float64) - lens.size[0] / 2.0) / lens.focal_px
    y = (places[:, 1].astype(np.float64) - lens.size[1] / 2.0) / lens.focal_px
    angle = math.radians(sitter_deg)
    front = math.cos(angle) + x * math.sin(angle)
    side = x * math.cos(angle) - math.sin(angle)
    return np.stack([side / front, y / front], axis=1)


def _judged(
    pose: Pose, rays: Float64, found: NDArray[np.int64], lens: Lens, sitter_deg: float
) -> Heading:
    """Trust a pose, or not."""
    inside = pose.inside
    # One thing in the panorama that several points look like counts once.
    count = len(np.unique(found[inside]))
    heading, pitch, roll = pose.angles_deg
    half = lens.size[0] / 2.0 / lens.focal_px
    spread = float(rays[inside].std(axis=0).min()) / half if count > 1 else 0.0
    share = float(inside.mean())
    error = math.degrees(pose.error_rad)
    sure = count >= LEAST_INLIERS and spread >= _LEAST_SPREAD and share >= _LEAST_SHARE
    sure = sure and error <= _WORST_DEG and abs(pitch) < 35.0 and abs(roll) < 15.0
    if not sure:
        return Heading("unsure", None, inliers=count)
    confidence = (1.0 - math.exp(-count / 20.0)) * (1.0 - 0.3 * error / _WORST_DEG)
    return Heading("found", wrap(heading - sitter_deg), pitch, roll, count, confidence, pose.zoom)
