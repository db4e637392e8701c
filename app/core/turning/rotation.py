"""Where a camera points, from points it shares with a panorama that was taken where the sitter is.

The camera stands some way off and looks at the place where the probe stood. So it is not a mere
rotation: what it sees has moved. But its centre lies on the line through the sitter, and a point of
the scene, the probe and the camera span a plane that contains this line; seen along the line to the
sitter, a point therefore stays *in the same direction from the sitter* and only comes nearer to
them, by the factor z / (z + d) for a point z behind the sitter and a camera d in front. For the
points of one plane 1 + d / z is a linear function of the place in the picture. The fit knows this:
six unknowns, a rotation and that linear function, from residuals that are trusted across the line
to the sitter and hardly along it, where the depth of each point may differ from the plane's.

Axes of the camera are right, down, front.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core import sphere

__all__ = ["Pose", "fit"]

Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

_AXES: Final = np.diag([-1.0, -1.0, 1.0])  # camera axes from those of a panorama, and back

_TRIES: Final = 700
_LEAST_PAIRS: Final = 6
_ZOOM: Final = (0.8, 2.4)  # the panorama's angles over the camera's: 1 + d / D, and a wrong field
_SPREAD: Final = 0.06  # radians: closer pairs fix no rotation
_LOOSE: Final = 0.05  # radians, about 3 deg, of a hypothesis
_MOST_PITCH_DEG: Final = 35.0
_MOST_ROLL_DEG: Final = 15.0

_ACROSS: Final = 0.0035  # radians: noise of a point across the line to the sitter
_ALONG: Final = 0.12  # of its distance from the sitter: depth that is not the plane's
_ROUNDS: Final = 12
_INSIDE: Final = 3.0  # standard deviations
_PLANE_MEAN: Final = np.array([0.3, 0.0, 0.0])
_PLANE_SPREAD: Final = np.array([0.3, 0.4, 0.4])


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """How a camera is turned.

    Attributes
    ----------
    rotation : (3, 3) float64
        From the camera's axes (right, down, front) to the panorama's.
    inside : (N,) bool
        Points that agree.
    error_rad : float
        Standard error of the heading, from the residuals.
    zoom : float
        Angles in the panorama over those in the picture, near the sitter: 1 + d / D, and whatever
        the field of view is wrong by.
    """

    rotation: Float64
    inside: Mask
    error_rad: float
    zoom: float

    @property
    def angles_deg(self) -> tuple[float, float, float]:
        """Heading, pitch up and roll clockwise, deg."""
        return sphere.angles_of(self.rotation @ _AXES)


def fit(rays: Float64, bearings: Float64, seed: int = 0) -> Pose | None:
    """Find the rotation of a camera that looks at the sitter.

    Parameters
    ----------
    rays : (N, 2) float64
        Points in the camera's picture plane, x / z and y / z (right and down), the sitter at 0, 0.
    bearings : (N, 3) float64
        The same points in the panorama, unit vectors in its axes.
    seed : int, optional
        Of the random samples; the same input always gives the same result.

    Returns
    -------
    Pose or None
        None where no rotation explains even a few of them.
    """
    if len(rays) < _LEAST_PAIRS:
        return None
    start = _search(rays, bearings, np.random.default_rng(seed))
    if start is None:
        return None
    rotation, inside = start
    return _refine(rays, bearings, rotation, inside)


def _search(
    rays: Float64, bearings: Float64, chance: np.random.Generator
) -> tuple[Float64, Mask] | None:
    """Try pairs of points: two of them fix a rotation and a zoom."""
    pairs = chance.integers(0, len(rays), (_TRIES, 2))
    first, second = pairs.T
    seen = _angle(bearings[first], bearings[second])
    zoom = np.ones(len(pairs))
    for _ in range(3):
        angle = _angle(_unit(rays[first], zoom), _unit(rays[second], zoom))
        zoom = np.clip(zoom * seen / np.maximum(angle, 1e-6), 0.3, 5.0)
    good = (seen > _SPREAD) & (zoom > _ZOOM[0]) & (zoom < _ZOOM[1])
    if not good.any():
        return None
    first, second, zoom = first[good], second[good], zoom[good]
    there = _frames(bearings[first], bearings[second])
    here = _frames(_unit(rays[first], zoom), _unit(rays[second], zoom))
    rotations = there @ here.transpose(0, 2, 1)
    upright = _upright(rotations)
    if not upright.any():
        return None
    rotations, zoom = rotations[upright], zoom[upright]
    zoomed = _unit(rays[None], zoom[:, None])
    seen_there = np.einsum("kij,knj->kni", rotations, zoomed)
    away = np.linalg.norm(seen_there - bearings[None], axis=2)
    scores = np.maximum(1.0 - (away / _LOOSE) ** 2, 0.0).sum(axis=1)
    best = int(np.argmax(scores))
    return rotations[best], away[best] < _LOOSE


def _refine(rays: Float64, bearings: Float64, rotation: Float64, inside: Mask) -> Pose | None:
    """Gauss-Newton with weights that fall off for points that do not agree."""
    plane = _PLANE_MEAN.copy()
    weights = inside.astype(float)
    normal = np.eye(6)
    for step in range(_ROUNDS):
        turned = bearings @ rotation
        ahead = turned[:, 2] > 0.2
        if int((ahead & (weights > 0.05)).sum()) < _LEAST_PAIRS:
            return None
        rows, left = _equations(rays, turned, plane)
        held = np.repeat(np.where(ahead, weights, 0.0), 2)
        normal = rows.T @ (rows * held[:, None])
        right = rows.T @ (left * held)
        normal[3:, 3:] += np.diag(_PLANE_SPREAD**-2)
        right[3:] += (_PLANE_MEAN - plane) / _PLANE_SPREAD**2
        normal[:3, :3] += 1e-6 * np.eye(3)
        change = np.linalg.solve(normal, right)
        rotation = rotation @ sphere.from_vector(change[:3])
        plane = plane + change[3:]
        deviation = _deviation(rays, bearings @ rotation, plane)
        scale = max(6.0 - step, 1.5)
        weights = 1.0 / (1.0 + (deviation / scale) ** 2) ** 2
        weights[deviation > 4.0 * scale] = 0.0
    agree = _deviation(rays, bearings @ rotation, plane) < _INSIDE
    error = float(np.sqrt(max(np.linalg.inv(normal)[1, 1], 0.0)))
    return Pose(rotation, agree, error, 1.0 + float(plane[0]))


def _equations(rays: Float64, turned: Float64, plane: Float64) -> tuple[Float64, Float64]:
    """Linearise: rows of unknowns (three of the rotation, three of the plane), and right side.

    Two rows a point, across and along the line to the sitter, each divided by its deviation.
    """
    depth = np.maximum(turned[:, 2], 0.2)
    px, py = turned[:, 0] / depth, turned[:, 1] / depth
    x, y = rays.T
    spread = 1.0 + plane[0] + plane[1] * x + plane[2] * y
    miss = np.stack([x * spread - px, y * spread - py])
    one = np.ones_like(px)
    # Derivatives of (px, py) by a small rotation of the camera about its three axes.
    by_rotation = np.stack([[px * py, -(one + px * px), py], [one + py * py, -px * py, -px]])
    by_plane = np.stack([[-x, -x * x, -x * y], [-y, -x * y, -y * y]])
    slopes = np.concatenate([by_rotation, by_plane], axis=1)  # (2, 6, N)
    along, across, far = _directions(rays)
    rows = np.empty((len(x), 2, 6))
    left = np.empty((len(x), 2))
    for place, (way, deviation) in enumerate(
        ((across, np.full_like(far, _ACROSS)), (along, _along(far)))
    ):
        rows[:, place] = (np.einsum("nk,kcn->cn", way, slopes) / deviation).T
        left[:, place] = np.einsum("nk,kn->n", way, miss) / deviation
    return rows.reshape(-1, 6), left.reshape(-1)


def _deviation(rays: Float64, turned: Float64, plane: Float64) -> Float64:
    """How many standard deviations each point is off; infinite behind the camera."""
    depth = np.maximum(turned[:, 2], 0.2)
    there = turned[:, :2] / depth[:, None]
    spread = 1.0 + plane[0] + rays @ plane[1:]
    miss = there - rays * spread[:, None]
    along, across, far = _directions(rays)
    side = np.einsum("nk,nk->n", across, miss) / _ACROSS
    line = np.einsum("nk,nk->n", along, miss) / _along(far)
    return np.where(turned[:, 2] > 0.2, np.hypot(side, line), np.inf)


def _directions(rays: Float64) -> tuple[Float64, Float64, Float64]:
    """Return unit vectors outward from the sitter and across, (N, 2); distances, (N,)."""
    far = np.linalg.norm(rays, axis=1)
    along = rays / np.maximum(far, 1e-9)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    return along, across, far


def _along(far: Float64) -> Float64:
    return np.hypot(_ACROSS, _ALONG * far)


def _unit(rays: Float64, zoom: Float64) -> Float64:
    """Rays (..., 2) zoomed by (...) as unit vectors, (..., 3)."""
    flat = rays * zoom[..., None]
    full = np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
    return np.asarray(full / np.linalg.norm(full, axis=-1, keepdims=True))


def _angle(first: Float64, second: Float64) -> Float64:
    """Angles between unit vectors, radians, precise for small ones."""
    return np.asarray(2.0 * np.arcsin(np.clip(np.linalg.norm(first - second, axis=-1) / 2, 0, 1)))


def _frames(first: Float64, second: Float64) -> Float64:
    """Right-handed axes from pairs of unit vectors, (K, 3, 3), one axis a column."""
    middle = first + second
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-12)
    side = np.cross(first, second)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    return np.stack([middle, side, np.cross(middle, side)], axis=2)


def _upright(rotations: Float64) -> Mask:
    """Which of the cameras a person might hold: nobody films upside down or at the ceiling."""
    pitch = np.degrees(np.arcsin(np.clip(rotations[:, 1, 2], -1.0, 1.0)))
    roll = np.degrees(np.arctan2(-rotations[:, 1, 0], -rotations[:, 1, 1]))
    return np.asarray((np.abs(pitch) < _MOST_PITCH_DEG) & (np.abs(roll) < _MOST_ROLL_DEG))
