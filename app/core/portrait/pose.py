"""The rotation between two panoramas from pairs of directions, also where the camera has moved.

A rotation is found by random pairs (RANSAC, Fischler and Bolles 1981) and refined to all that is
roughly in place. Set down elsewhere by some centimetres, a camera sees near things shifted by
several degrees, and no rotation fits them; but each pair of directions still lies in one plane
with the way the camera moved (the epipolar constraint, Longuet-Higgins 1981): t . (a x R b) = 0.
Rotation R and direction of the move t are fitted to that by Gauss-Newton steps with Tukey's
weights.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.sphere import from_vector

Float64: TypeAlias = NDArray[np.float64]

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
class Pose:
    """A rotation from the second panorama to the first, and what speaks for it.

    Attributes
    ----------
    rotation : (3, 3) float64
        Takes directions in the second panorama to directions in the first.
    error_deg : float
        Standard error, deg: jackknife over eight sectors of the horizon.
    seeds : int
        Pairs within 3 deg of the best pure rotation: none can be expected elsewhere.
    """

    rotation: Float64
    error_deg: float
    seeds: int
    points: int
    sectors: int
    shift_deg: float
    forward: float


def find_pose(a: Float64, b: Float64) -> Pose | None:
    """Find the rotation between two panoramas.

    Parameters
    ----------
    a, b : (M, 3) float64
        Unit vectors to the same things in the first and in the second panorama; many may be
        wrong.
    """
    start = _by_trial(a, b)
    if start is None:
        return None
    rotation, seeds = start
    for window in _WIDE_DEG:
        away = _angles(a, b @ rotation.T)
        # The sum of angles rather than of their squares: nearly all things are far enough away.
        weights = np.clip(1.0 - (away / (2.0 * window)) ** 2, 0.0, 1.0) ** 2 / np.maximum(away, 1.0)
        rotation = _fitted(a, b, weights)
    keep = _angles(a, b @ rotation.T) < _KEEP_DEG
    a, b = a[keep], b[keep]
    if len(a) < 8:
        return None
    rotation, move, weights = _epipolar(a, b, rotation)
    return _judged(a, b, rotation, move, weights, seeds)


def _by_trial(a: Float64, b: Float64) -> tuple[Float64, int] | None:
    """Rotation of an upright camera that puts most pairs in place, and how many."""
    count = len(a)
    if count < 8:
        return None
    # Chance that repeats: the same two pictures always give the same answer.
    chance = np.random.default_rng(_SEED)
    i, j = chance.integers(0, count, _TRIALS), chance.integers(0, count, _TRIALS)
    cosine = (a[i] * a[j]).sum(axis=1)
    alike = np.abs(cosine - (b[i] * b[j]).sum(axis=1)) < _SAME_ANGLE
    some = alike & (np.abs(cosine) < _APART)
    trials = _triads(a[i[some]], a[j[some]]) @ np.swapaxes(_triads(b[i[some]], b[j[some]]), 1, 2)
    trials = trials[trials[:, 1, 1] > math.cos(math.radians(_TILT_DEG))]
    if not len(trials):
        return None
    turned = np.einsum("nij,mj->nmi", trials, b)
    hits = np.einsum("nmi,mi->nm", turned, a) > math.cos(math.radians(_NEAR_DEG))
    counts = hits.sum(axis=1)
    best = int(counts.argmax())
    return np.asarray(trials[best], np.float64), int(counts[best])


def _triads(first: Float64, second: Float64) -> Float64:
    """(N, 3, 3) axes made of two directions, one column each."""
    across = np.cross(first, second)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    return np.stack([first, np.cross(across, first), across], axis=-1)


def _angles(a: Float64, b: Float64) -> Float64:
    """(N,) angles between unit vectors, deg."""
    chord = np.linalg.norm(a - b, axis=1)
    return np.asarray(np.degrees(2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))), np.float64)


def _fitted(a: Float64, b: Float64, weights: Float64) -> Float64:
    """Weighted least-squares rotation from b to a (Kabsch 1976)."""
    left, _, right = np.linalg.svd((a * weights[:, None]).T @ b)
    proper = np.diag([1.0, 1.0, float(np.linalg.det(left @ right))])
    return np.asarray(left @ proper @ right, np.float64)


def _epipolar(a: Float64, b: Float64, rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Fit rotation and direction of the move; with them the weights of the pairs."""
    normals = np.cross(a, b @ rotation.T)
    even = 1.0 / np.maximum((normals**2).sum(axis=1, keepdims=True), 1e-5)
    move = np.linalg.eigh((normals * even).T @ normals)[1][:, 0]
    for _ in range(_STEPS):
        error, weights, slopes, sides = _linear(a, b, rotation, move)
        step = _solved(slopes, error, weights)
        rotation = from_vector(step[:3]) @ rotation
        move = move + sides.T @ step[3:]
        move /= np.linalg.norm(move)
        if float(np.abs(step).max()) < _CLOSE_RAD:
            break
    return rotation, move, _linear(a, b, rotation, move)[1]


def _linear(
    a: Float64, b: Float64, rotation: Float64, move: Float64
) -> tuple[Float64, Float64, Float64, Float64]:
    """Errors, Tukey weights, slopes by rotation and move, and the two directions of the move."""
    turned = b @ rotation.T
    normals = np.cross(a, turned)
    error: Float64 = normals @ move
    scale = max(1.4826 * float(np.median(np.abs(error))), _LEAST_SCALE_RAD)
    weights = np.clip(1.0 - (error / (4.685 * scale)) ** 2, 0.0, 1.0) ** 2
    by_turn = (a * turned).sum(axis=1)[:, None] * move - (turned @ move)[:, None] * a
    sides = np.linalg.svd(move[None])[2][1:]
    return error, weights, np.hstack([by_turn, normals @ sides.T]), sides


def _solved(slopes: Float64, error: Float64, weights: Float64) -> Float64:
    """Damped step: where nothing moved, the direction of the move is anybody's guess."""
    normal = (slopes * weights[:, None]).T @ slopes
    damping = 1e-6 * len(error) * np.ones(5)
    damping[3:] += 1e-3 * float(np.trace(normal[3:, 3:])) + 1e-9
    right = (slopes * weights[:, None]).T @ error
    return np.asarray(-np.linalg.solve(normal + np.diag(damping), right), np.float64)


def _judged(
    a: Float64, b: Float64, rotation: Float64, move: Float64, weights: Float64, seeds: int
) -> Pose:
    agree = weights > 0.25
    turned = b @ rotation.T
    away = _angles(a, turned)
    far = agree & (away > _MOVED_DEG)
    along = ((a - turned) @ move)[far] > 0
    share = float(along.mean()) if along.size else 1.0
    sector = (np.arctan2(-a[:, 0], a[:, 2]) / (2.0 * np.pi) + 0.5) * _SECTORS
    part = np.clip(sector.astype(np.int64), 0, _SECTORS - 1)
    return Pose(
        rotation=rotation,
        error_deg=_error_deg(a, b, rotation, move, part),
        seeds=seeds,
        points=int(agree.sum()),
        sectors=len(np.unique(part[agree])),
        shift_deg=float(np.median(away[agree])) if agree.any() else math.inf,
        forward=max(share, 1.0 - share),
    )


def _error_deg(
    a: Float64, b: Float64, rotation: Float64, move: Float64, part: NDArray[np.int64]
) -> float:
    """Jackknife over the sectors that hold anything."""
    error, weights, slopes, _ = _linear(a, b, rotation, move)
    filled = [k for k in range(_SECTORS) if bool((weights[part == k] > 0.25).any())]
    if len(filled) < 3:
        return math.inf
    steps = np.stack(
        [_solved(slopes[part != k], error[part != k], weights[part != k])[:3] for k in filled]
    )
    spread = steps - steps.mean(axis=0)
    count = len(filled)
    variance = (count - 1) / count * float((spread**2).sum())
    return math.degrees(math.sqrt(variance))
