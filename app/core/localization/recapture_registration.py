"""Align a second capture at the same spot with the first.

A camera is never put back in exactly the same position. The turn between two captures is determined
from the objects that both show, so that the azimuth of the photographer and every marked turn keep
their directions in the world.

RootSIFT features (Lowe 2004; Arandjelovic and Zisserman 2012) are detected in the equirectangular
pictures themselves. Both cameras are upright, so an object appears at about the same height in both
pictures and is stretched in the same way. Contrast is equalised first (CLAHE), which makes
differences in exposure and in the position of the sun matter little.

A rotation is found from random pairs (RANSAC, Fischler and Bolles 1981) and refined on all pairs
that roughly fit. For a camera that was moved by a few centimetres, near objects are shifted by
several degrees, which no rotation fits. Each pair of directions is still in one plane with the
direction in which the camera moved (the epipolar constraint, Longuet-Higgins 1981):
t . (a x R b) = 0. The rotation R and the direction of the move t are fitted to this constraint by
Gauss-Newton with Tukey's weights.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes, Float32, Float64, Int64
from app.core.base.sphere import angle_of, angles_of, from_vector, rotation
from app.core.localization.features import root_sift

_TRIALS: Final = 400
_SEED: Final = 1
_NEAR_DEG: Final = 3.0
_TILT_DEG: Final = 20.0
_SAME_ANGLE: Final = 0.05  # between the cosines of the angles of a pair
_APART: Final = 0.97
_WIDE_DEG: Final = (12.0, 10.0, 8.0, 8.0, 8.0, 8.0)  # windows of the refinement
_KEEP_DEG: Final = 12.0
_STEPS: Final = 25
_CLOSE_RAD: Final = 1e-6
_LEAST_SCALE_RAD: Final = math.radians(0.05)
_MOVED_DEG: Final = 1.0
_SECTORS: Final = 8


@dataclass(frozen=True, slots=True)
class PanoramaPose:
    """The rotation from the second panorama to the first, and the evidence for it."""

    rotation: Float64  # (3, 3), from directions in the second panorama to directions in the first
    error_deg: float  # standard error, in degrees: jackknife over eight sectors of the horizon
    # pairs within 3 degrees of the best pure rotation; none are expected in another place
    seeds: int
    points: int
    sectors: int
    shift_deg: float
    forward: float


def find_pose(a: Float64, b: Float64) -> PanoramaPose | None:
    """Find the rotation between two panoramas.

    Args:
        a, b: (M, 3) float64. Unit vectors to the same objects in the first and the second panorama.
            Many of the pairs may be wrong.
    """
    start = _by_trial(a, b)
    if start is None:
        return None
    rotation, seeds = start
    for window in _WIDE_DEG:
        away = _angles(a, b @ rotation.T)
        # Use the sum of angles, not of their squares, as nearly all objects are far enough away.
        weights = np.clip(1.0 - (away / (2.0 * window)) ** 2, 0.0, 1.0) ** 2 / np.maximum(away, 1.0)
        rotation = fit_rotation(a * weights[:, None], b)
    keep = _angles(a, b @ rotation.T) < _KEEP_DEG
    a, b = a[keep], b[keep]
    if len(a) < 8:
        return None
    rotation, move, weights = _epipolar(a, b, rotation)
    return _judge(a, b, rotation, move, weights, seeds)


def _by_trial(a: Float64, b: Float64) -> tuple[Float64, int] | None:
    """Return the rotation of an upright camera that fits the most pairs, and their number."""
    count = len(a)
    if count < 8:
        return None
    # Use a seed, so that the same two pictures always give the same result.
    chance = np.random.default_rng(_SEED)
    i, j = chance.integers(0, count, _TRIALS), chance.integers(0, count, _TRIALS)
    cosine = (a[i] * a[j]).sum(axis=1)
    alike = np.abs(cosine - (b[i] * b[j]).sum(axis=1)) < _SAME_ANGLE
    some = alike & (np.abs(cosine) < _APART)
    trials = _triads(a[i[some]], a[j[some]]) @ np.swapaxes(_triads(b[i[some]], b[j[some]]), 1, 2)
    trials = trials[trials[:, 1, 1] > math.cos(math.radians(_TILT_DEG))]
    if not len(trials):
        return None
    rotated = np.einsum("nij,mj->nmi", trials, b)
    hits = np.einsum("nmi,mi->nm", rotated, a) > math.cos(math.radians(_NEAR_DEG))
    counts = hits.sum(axis=1)
    best = int(counts.argmax())
    return np.asarray(trials[best], np.float64), int(counts[best])


def _triads(first: Float64, second: Float64) -> Float64:
    """Return coordinate axes built from two directions, (N, 3, 3), one axis per column."""
    across = np.cross(first, second)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    return np.stack([first, np.cross(across, first), across], axis=-1)


def _angles(a: Float64, b: Float64) -> Float64:
    """Return the angles between pairs of unit vectors, (N,), in degrees."""
    chord = np.linalg.norm(a - b, axis=1)
    return np.asarray(np.degrees(2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))), np.float64)


def fit_rotation(a: Float64, b: Float64) -> Float64:
    """Return the least-squares rotations from b to a (Kabsch 1976).

    Args:
        a, b: (..., M, 3) float64. Directions. Those in `a` may be weighted.
    """
    left, _, right = np.linalg.svd(a.swapaxes(-1, -2) @ b)
    left[..., 2] *= np.linalg.det(left @ right)[..., None]
    return np.asarray(left @ right, np.float64)


def _epipolar(a: Float64, b: Float64, rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Fit the rotation and the direction of the move, and return them with the pairs' weights."""
    normals = np.cross(a, b @ rotation.T)
    even = 1.0 / np.maximum((normals**2).sum(axis=1, keepdims=True), 1e-5)
    move = np.linalg.eigh((normals * even).T @ normals)[1][:, 0]
    for _ in range(_STEPS):
        error, weights, slopes, sides = _linear(a, b, rotation, move)
        step = _solve(slopes, error, weights)
        rotation = from_vector(step[:3]) @ rotation
        move = move + sides.T @ step[3:]
        move /= np.linalg.norm(move)
        if float(np.abs(step).max()) < _CLOSE_RAD:
            break
    return rotation, move, _linear(a, b, rotation, move)[1]


def _linear(
    a: Float64, b: Float64, rotation: Float64, move: Float64
) -> tuple[Float64, Float64, Float64, Float64]:
    """Return errors, Tukey weights, derivatives for rotation and for move, and the move's axes."""
    rotated = b @ rotation.T
    normals = np.cross(a, rotated)
    error: Float64 = normals @ move
    scale = max(1.4826 * float(np.median(np.abs(error))), _LEAST_SCALE_RAD)
    weights = np.clip(1.0 - (error / (4.685 * scale)) ** 2, 0.0, 1.0) ** 2
    by_turn = (a * rotated).sum(axis=1)[:, None] * move - (rotated @ move)[:, None] * a
    sides = np.linalg.svd(move[None])[2][1:]
    return error, weights, np.hstack([by_turn, normals @ sides.T]), sides


def _solve(slopes: Float64, error: Float64, weights: Float64) -> Float64:
    """Solve for a damped step. If there was no move, the direction of the move is arbitrary."""
    normal = (slopes * weights[:, None]).T @ slopes
    damping = 1e-6 * len(error) * np.ones(5)
    damping[3:] += 1e-3 * float(np.trace(normal[3:, 3:])) + 1e-9
    right = (slopes * weights[:, None]).T @ error
    return np.asarray(-np.linalg.solve(normal + np.diag(damping), right), np.float64)


def _judge(
    a: Float64, b: Float64, rotation: Float64, move: Float64, weights: Float64, seeds: int
) -> PanoramaPose:
    agree = weights > 0.25
    rotated = b @ rotation.T
    away = _angles(a, rotated)
    far = agree & (away > _MOVED_DEG)
    along = ((a - rotated) @ move)[far] > 0
    share = float(along.mean()) if along.size else 1.0
    sector = (np.arctan2(-a[:, 0], a[:, 2]) / (2.0 * np.pi) + 0.5) * _SECTORS
    part = np.clip(sector.astype(np.int64), 0, _SECTORS - 1)
    return PanoramaPose(
        rotation=rotation,
        error_deg=_error_deg(a, b, rotation, move, part),
        seeds=seeds,
        points=int(agree.sum()),
        sectors=len(np.unique(part[agree])),
        shift_deg=float(np.median(away[agree])) if agree.any() else math.inf,
        forward=max(share, 1.0 - share),
    )


def _error_deg(a: Float64, b: Float64, rotation: Float64, move: Float64, part: Int64) -> float:
    """Return the jackknife error over the non-empty sectors, in degrees."""
    error, weights, slopes, _ = _linear(a, b, rotation, move)
    sectors = [k for k in range(_SECTORS) if bool((weights[part == k] > 0.25).any())]
    if len(sectors) < 3:
        return math.inf
    steps = np.stack(
        [_solve(slopes[part != k], error[part != k], weights[part != k])[:3] for k in sectors]
    )
    spread = steps - steps.mean(axis=0)
    count = len(sectors)
    variance = (count - 1) / count * float((spread**2).sum())
    return math.degrees(math.sqrt(variance))


_SIZE: Final = (512, 1024)
_PAD: Final = 64
_ROWS: Final = (80, 402)  # from 62 degrees up to 51 down: beyond, pictures are too distorted
_MOST: Final = 2000
_RATIO: Final = 0.85


@dataclass(frozen=True, slots=True)
class PanoramaFeatures:
    """The feature points of a panorama."""

    vectors: Float64  # (N, 3), unit vectors in the panorama axes of `app.core.base.sphere`
    descriptors: Float32  # (N, 128), RootSIFT, of length 1


def features(picture: Bytes) -> PanoramaFeatures:
    """Find the features in a panorama.

    Args:
        picture: (h, 2 h, 3) uint8. sRGB picture of any size. It is searched at 1024 x 512.
    """
    shape = picture.shape
    if picture.dtype != np.uint8 or len(shape) != 3 or shape[2] != 3 or shape[1] != 2 * shape[0]:
        raise ValueError(f"a panorama is (h, 2 h, 3) bytes, not {shape} {picture.dtype}")
    height, width = _SIZE
    method = cv2.INTER_AREA if shape[0] >= height else cv2.INTER_CUBIC
    small = cv2.resize(picture, (width, height), interpolation=method)
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)
    wide = cv2.copyMakeBorder(grey, 0, 0, _PAD, _PAD, cv2.BORDER_WRAP)
    even = cv2.createCLAHE(3.0, (8, 16)).apply(wide)
    mask = np.zeros(even.shape, np.uint8)
    mask[_ROWS[0] : _ROWS[1], _PAD:-_PAD] = 255
    places, descriptors = root_sift(np.asarray(even, np.uint8), _MOST, mask)
    at = places.astype(np.float64)
    azimuth = 2.0 * np.pi * ((at[:, 0] - _PAD + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (at[:, 1] + 0.5) / height)
    level = np.cos(elevation)
    vectors = np.stack(
        [-np.sin(azimuth) * level, np.sin(elevation), np.cos(azimuth) * level], axis=1
    )
    return PanoramaFeatures(vectors, descriptors)


def matched(first: PanoramaFeatures, second: PanoramaFeatures) -> tuple[Float64, Float64]:
    """Match the features of two panoramas, keeping only pairs that are each other's best match.

    Returns:
        Two arrays, (M, 3) float64, with unit vectors to the same objects in the first and the
        second panorama.
    """
    if len(first.vectors) < 2 or len(second.vectors) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3))
    likeness = first.descriptors @ second.descriptors.T
    two = np.argpartition(-likeness, 1, axis=1)[:, :2]
    values = np.take_along_axis(likeness, two, axis=1)
    order = np.argsort(-values, axis=1)
    two, values = np.take_along_axis(two, order, 1), np.take_along_axis(values, order, 1)
    distance = np.sqrt(np.maximum(2.0 - 2.0 * values, 0.0))
    best = two[:, 0]
    good = distance[:, 0] < _RATIO * distance[:, 1]
    good &= likeness.argmax(axis=0)[best] == np.arange(len(best))
    return first.vectors[good], second.vectors[best[good]]


# Of all pairs of the 23 test places, none had more than five seeds; the same place with another
# exposure, noise, blur and yaw had 70 or more.
_LEAST_SEEDS: Final = 14
_LEAST_POINTS: Final = 20
_LEAST_SECTORS: Final = 4
_MOST_ERROR_DEG: Final = 1.0
_MOST_TILT_DEG: Final = 15.0
_MOST_SHIFT_DEG: Final = 7.0
_SHIFTED_DEG: Final = 0.4
_LEAST_FORWARD: Final = 0.85
_TURNED_DEG: Final = 0.5
_TILTED_DEG: Final = 1.0


@dataclass(frozen=True, slots=True)
class Registration:
    """The alignment of a second capture with the first."""

    # clockwise turn (from above) of the second camera relative to the first, in degrees within
    # (-180, 180]: azimuth a in the second is a + yaw in the first; 0 if not trusted
    yaw_deg: float
    tilt_deg: float  # difference in lean, in degrees
    error_deg: float  # standard error, in degrees; infinite if nothing was found
    # median angle by which objects moved because of the camera's new position: 2 degrees are about
    # 7 cm with walls 2 m away
    shift_deg: float
    points: int
    trusted: bool
    # (3, 3), from directions in the second to directions in the first. With it,
    # `app.core.base.sphere.remap_frame` aligns the second picture with the first. It is the
    # identity if not trusted
    rotation: Float64 = field(repr=False)

    @property
    def turned(self) -> bool:
        """Whether the camera was turned by more than the measurement error."""
        return abs(self.yaw_deg) >= _TURNED_DEG

    @property
    def tilted(self) -> bool:
        """Whether the camera's tilt differed by more than the measurement error."""
        return self.tilt_deg >= _TILTED_DEG

    def carried(self, azimuth_deg: float) -> float:
        """Convert an azimuth in the first capture to one in the second, in (-180, 180] degrees."""
        return wrap(azimuth_deg - self.yaw_deg)


def register_again(first: Bytes, second: Bytes) -> Registration:
    """Align a second panorama of a spot with the first.

    The result is not trusted if the two panoramas show different places or share too few objects.

    Args:
        first, second: (h, 2 h, 3) uint8. sRGB display panoramas of any size. Their exposure, light
            and yaw may differ, their tilt must be small, and the camera may have moved by a few
            centimetres.
    """
    pose = find_pose(*matched(features(first), features(second)))
    if pose is None:
        return _refusal(math.inf, 0, 0.0)
    yaw, _, _ = angles_of(pose.rotation)
    tilt = angle_of(rotation(-yaw) @ pose.rotation)
    if not _same_spot(pose, tilt):
        return _refusal(pose.error_deg, pose.points, pose.shift_deg)
    yaw = wrap(yaw)
    return Registration(
        yaw_deg=yaw,
        tilt_deg=tilt,
        error_deg=pose.error_deg,
        shift_deg=pose.shift_deg,
        points=pose.points,
        trusted=True,
        rotation=pose.rotation,
    )


def _same_spot(pose: PanoramaPose, tilt_deg: float) -> bool:
    return (
        pose.seeds >= _LEAST_SEEDS
        and pose.points >= _LEAST_POINTS
        and pose.sectors >= _LEAST_SECTORS
        and pose.error_deg < _MOST_ERROR_DEG
        and tilt_deg < _MOST_TILT_DEG
        and pose.shift_deg < _MOST_SHIFT_DEG
        and (pose.shift_deg < _SHIFTED_DEG or pose.forward > _LEAST_FORWARD)
    )


def _refusal(error_deg: float, points: int, shift_deg: float) -> Registration:
    return Registration(0.0, 0.0, error_deg, shift_deg, points, False, np.eye(3))
