"""Find a camera's rotation from points that it shares with a panorama taken at the sitter.

The camera is some distance away and looks at the position of the probe, so its picture is not just
a rotated one: objects have shifted. Its centre is on the line through the sitter, however, and a
point in the scene, the probe and the camera span a plane that contains this line. Seen along the
line to the sitter, a point therefore stays *in the same direction from the sitter* and only moves
closer to them, by the factor z / (z + d) for a point at z behind the sitter and a camera at d in
front. For the points in one plane, 1 + d / z is a linear function of the position in the picture.
The fit uses this property. Its unknowns are a rotation, that linear function, and the position in
the picture of the line to the sitter, which is known about as precisely as a detector finds a face.
Residuals across the line to the sitter count fully. Those along it hardly count, because the depth
of each point may differ from that of the plane.

The camera's axes point right, down and forward.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from app.core.base import sphere
from app.core.base.arrays import Bools, Float64, Int64

MOST_PITCH_DEG: Final = 40.0
MOST_ROLL_DEG: Final = 25.0
"""Largest roll of a camera in a portrait, in degrees."""

_AXES: Final = np.diag([-1.0, -1.0, 1.0])  # camera axes from those of a panorama, and back

_LEAST_PAIRS: Final = 6
_SPREAD: Final = 0.06  # radians: closer pairs do not determine a rotation
_BLOCK: Final = 128  # rotations tried at a time, which takes little memory
_LOOSE: Final = 0.05  # radians, about 3 degrees, for a hypothesis

_ACROSS: Final = 0.0035  # radians: noise of a point across the line to the sitter
_ALONG: Final = 0.12  # fraction of its distance from the sitter: depth that is not the plane's
_ROUNDS: Final = 12
_INSIDE: Final = 3.0  # standard deviations
_TILT_SPREAD: Final = 0.4  # of the plane, per unit of the picture plane
_AHEAD: Final = 0.2  # cosine: points further to the side count as behind the camera
_UNKNOWNS: Final = 8
_LEVEL_SPREAD: Final = 0.1  # radians: height of the camera relative to the probe


@dataclass(frozen=True, slots=True)
class Outlook:
    """Prior knowledge about a camera, before any point is compared.

    Attributes:
        sitter: Position of the line to the probe in the picture plane, x / z, positive to the
            right.
        sitter_spread: Standard deviation of `sitter`.
        zoom: Smallest and largest enlargement of the picture plane, which is 1 + d / z times the
            error of the field of view.
        likely: Most likely enlargement, and its standard deviation.
        sitter_known: Whether `sitter` was measured rather than assumed.
    """

    sitter: float = 0.0
    sitter_spread: float = 0.04
    zoom: tuple[float, float] = (0.8, 2.4)
    likely: tuple[float, float] = (1.3, 0.3)
    sitter_known: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class CameraPose:
    """The rotation of a camera.

    Attributes:
        rotation: (3, 3) float64. Rotation from the camera's axes (right, down and forward) to the
            panorama's axes.
        sitter: (2,) float64. Position of the line to the probe in the picture plane.
        plane: (3,) float64. Enlargement minus 1 in the centre of the picture, and its slopes to the
            right and down.
        inside: (N,) bool. True for the points that agree.
        error_rad: Standard error of the heading, in radians.
    """

    rotation: Float64
    sitter: Float64
    plane: Float64
    inside: Bools = field(repr=False)
    error_rad: float

    @property
    def zoom(self) -> float:
        """Angles in the panorama divided by those in the picture, at the centre of the picture."""
        return 1.0 + float(self.plane[0])

    @property
    def angles_deg(self) -> tuple[float, float, float]:
        """The heading, pitch (positive upwards) and roll (positive clockwise), in degrees."""
        return sphere.angles_of(self.rotation @ _AXES)

    def predict(self, rays: Float64) -> Float64:
        """Predict the directions of the points in `fit`, (N, 3), as unit vectors in camera axes."""
        spread = np.maximum(1.0 + self.plane[0] + rays @ self.plane[1:], 0.3)
        return unit_rays(self.sitter + (rays - self.sitter) * spread[:, None])

    def zooms(self, rays: Float64, bearings: Float64) -> Float64:
        """Return the enlargement of each point, measured from the sitter, or NaN close to them.

        Args:
            rays: (N, 2) float64. As in `fit`.
            bearings: (N, 3) float64. As in `fit`.

        Returns:
            (N,) float64. The enlargements.
        """
        there = _projected(bearings @ self.rotation)
        along, _, far = _directions(rays - self.sitter)
        reach = np.einsum("nk,nk->n", there - self.sitter, along)
        return np.where(far > _SPREAD, reach / np.maximum(far, _SPREAD), np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """The unknowns in the fit."""

    rotation: Float64
    sitter: Float64
    plane: Float64

    def moved(self, change: Float64) -> _State:
        return _State(
            self.rotation @ sphere.from_vector(change[:3]),
            self.sitter + change[6:],
            self.plane + change[3:6],
        )


def fit(
    rays: Float64,
    bearings: Float64,
    outlook: Outlook | None = None,
    tries: int = 1200,
) -> CameraPose | None:
    """Find the rotation of a camera that points at the sitter, or beside them.

    Args:
        rays: (N, 2) float64. Points in the camera's picture plane, x / z (right) and y / z (down).
        bearings: (N, 3) float64. The same points in the panorama, as unit vectors in its coordinate
            system.
        outlook: Prior knowledge. By default, the sitter is assumed to be in the centre.
        tries: Number of random pairs of points to try.

    Returns:
        The pose, or None if no rotation explains even a few of the points.
    """
    if len(rays) < _LEAST_PAIRS:
        return None
    prior = outlook or Outlook()
    # From the camera's axes to those of a camera with the sitter on its axis.
    facing = sphere.from_vector(np.array([0.0, -np.arctan(prior.sitter), 0.0]))
    pairs = np.random.default_rng(0).integers(0, len(rays), (tries, 2))
    start = _search(_rotate(rays, facing), bearings, prior.zoom, pairs)
    if start is None:
        return None
    rotation, zoom, inside = start
    sitter, plane = np.array([prior.sitter, 0.0]), np.array([zoom - 1.0, 0.0, 0.0])
    return _refine(rays, bearings, _State(rotation @ facing, sitter, plane), inside, prior)


def rescaled(
    pose: CameraPose, rays: Float64, bearings: Float64, factor: float, outlook: Outlook
) -> CameraPose | None:
    """Refine a pose after a better estimate of the lens.

    Args:
        rays: (N, 2) float64. Points in the picture plane of the old lens.
        bearings: (N, 3) float64. As in `fit`.
        factor: Scale factor of the picture plane from the old lens to the new one.
    """
    plane = np.array([pose.zoom / factor - 1.0, *(pose.plane[1:] / factor**2)])
    state = _State(pose.rotation, np.array([outlook.sitter, pose.sitter[1] * factor]), plane)
    return _refine(rays * factor, bearings, state, pose.inside, outlook)


def _rotate(rays: Float64, rotation: Float64) -> Float64:
    full = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ rotation.T
    return np.asarray(full[:, :2] / np.maximum(full[:, 2:], 0.1))


def _search(
    rays: Float64, bearings: Float64, limits: tuple[float, float], pairs: Int64
) -> tuple[Float64, float, Bools] | None:
    """Try pairs of points, each of which determines a rotation and a zoom.

    Returns:
        The best rotation of a camera that has the sitter on its axis, the zoom, and a mask of the
        points that agree.
    """
    first, second = pairs.T
    angle_between = _angle(bearings[first], bearings[second])
    zoom = np.ones(len(pairs))
    for _ in range(4):
        angle = _angle(unit_rays(rays[first], zoom), unit_rays(rays[second], zoom))
        zoom = np.clip(zoom * angle_between / np.maximum(angle, 1e-6), 0.3, 5.0)
    good = (angle_between > _SPREAD) & (zoom > limits[0]) & (zoom < limits[1])
    if not good.any():
        return None
    first, second, zoom = first[good], second[good], zoom[good]
    there = _frames(bearings[first], bearings[second])
    here = _frames(unit_rays(rays[first], zoom), unit_rays(rays[second], zoom))
    rotations = there @ here.transpose(0, 2, 1)
    upright = _upright(rotations)
    if not upright.any():
        return None
    rotations, zoom = rotations[upright], zoom[upright]
    return _best(rotations, zoom, rays, bearings)


def _best(
    rotations: Float64, zoom: Float64, rays: Float64, bearings: Float64
) -> tuple[Float64, float, Bools]:
    """Choose the rotation with the most points that agree."""
    scores = [
        np.maximum(1.0 - _away_squared(axes, zooms, rays, bearings) / _LOOSE**2, 0.0).sum(axis=1)
        for axes, zooms in (
            (rotations[start : start + _BLOCK], zoom[start : start + _BLOCK])
            for start in range(0, len(zoom), _BLOCK)
        )
    ]
    best = int(np.argmax(np.concatenate(scores)))
    only = slice(best, best + 1)
    away_squared = _away_squared(rotations[only], zoom[only], rays, bearings)[0]
    return rotations[best], float(zoom[best]), away_squared < _LOOSE**2


def _away_squared(rotations: Float64, zoom: Float64, rays: Float64, bearings: Float64) -> Float64:
    """Return the squared distances of the points, (K, N), for K rotations and zooms."""
    zoomed = unit_rays(rays[None], zoom[:, None])
    return np.asarray(2.0 - 2.0 * (zoomed * (bearings[None] @ rotations)).sum(axis=2))


def _refine(
    rays: Float64, bearings: Float64, state: _State, inside: Bools, prior: Outlook
) -> CameraPose | None:
    """Refine the fit by Gauss-Newton with robust weights."""
    weights = inside.astype(float)
    normal = np.eye(_UNKNOWNS)
    for step in range(_ROUNDS):
        rotated = bearings @ state.rotation
        ahead = rotated[:, 2] > _AHEAD
        if int((ahead & (weights > 0.05)).sum()) < _LEAST_PAIRS:
            return None
        rows, residuals = _equations(rays, rotated, state)
        row_weights = np.repeat(np.where(ahead, weights, 0.0), 2)
        normal = rows.T @ (rows * row_weights[:, None])
        right = rows.T @ (residuals * row_weights)
        mean, spread = _priors(state, prior)
        normal[3:, 3:] += np.diag(spread**-2)
        right[3:] += (mean - np.concatenate([state.plane, state.sitter])) / spread**2
        normal[:3, :3] += 1e-6 * np.eye(3)
        state = state.moved(np.linalg.solve(normal, right))
        deviation = _deviation(rays, bearings @ state.rotation, state)
        scale = max(6.0 - step, 1.5)
        weights = 1.0 / (1.0 + (deviation / scale) ** 2) ** 2
        weights[deviation > 4.0 * scale] = 0.0
    agree = _deviation(rays, bearings @ state.rotation, state) < _INSIDE
    error = float(np.sqrt(max(np.linalg.inv(normal)[1, 1], 0.0)))
    return CameraPose(state.rotation, state.sitter, state.plane, agree, error)


def _priors(state: _State, prior: Outlook) -> tuple[Float64, Float64]:
    """Return the means and deviations of the plane and the sitter, who is near the horizon."""
    level = float(np.clip(state.rotation[1, 2], -0.7, 0.7))
    horizon = level / np.sqrt(1.0 - level * level)  # up in the world is down in the picture
    mean = np.array([prior.likely[0] - 1.0, 0.0, 0.0, prior.sitter, horizon])
    tilt, height = _TILT_SPREAD, _LEVEL_SPREAD
    return mean, np.array([prior.likely[1], tilt, tilt, prior.sitter_spread, height])


def _equations(rays: Float64, rotated: Float64, state: _State) -> tuple[Float64, Float64]:
    """Linearise the fit, and return rows of (rotation, plane, sitter) and the right-hand side.

    Each point has two rows, one across and one along the line to the sitter, divided by their
    deviations.
    """
    px, py = _projected(rotated).T
    x, y = rays.T
    apart = rays - state.sitter
    more = state.plane[0] + state.plane[1] * x + state.plane[2] * y
    miss = (state.sitter + apart * (1.0 + more)[:, None]).T - np.stack([px, py])
    one, none = np.ones_like(px), np.zeros_like(px)
    # Derivatives of (px, py) with respect to a small rotation of the camera about its three axes.
    by_rotation = np.stack([[px * py, -(one + px * px), py], [one + py * py, -px * py, -px]])
    by_plane = -apart.T[:, None] * np.stack([one, x, y])[None]
    by_sitter = np.stack([[more, none], [none, more]])
    slopes = np.concatenate([by_rotation, by_plane, by_sitter], axis=1)  # (2, unknowns, N)
    along, across, far = _directions(apart)
    rows = np.empty((len(x), 2, _UNKNOWNS))
    residuals = np.empty((len(x), 2))
    for place, (way, deviation) in enumerate(
        ((across, np.full_like(far, _ACROSS)), (along, _along(far)))
    ):
        rows[:, place] = (np.einsum("nk,kcn->cn", way, slopes) / deviation).T
        residuals[:, place] = np.einsum("nk,kn->n", way, miss) / deviation
    return rows.reshape(-1, _UNKNOWNS), residuals.reshape(-1)


def _deviation(rays: Float64, rotated: Float64, state: _State) -> Float64:
    """Return the error of each point in standard deviations, or infinity behind the camera."""
    apart = rays - state.sitter
    spread = 1.0 + state.plane[0] + rays @ state.plane[1:]
    miss = _projected(rotated) - state.sitter - apart * spread[:, None]
    along, across, far = _directions(apart)
    side = np.einsum("nk,nk->n", across, miss) / _ACROSS
    line = np.einsum("nk,nk->n", along, miss) / _along(far)
    return np.where((rotated[:, 2] > _AHEAD) & (spread > 0.0), np.hypot(side, line), np.inf)


def _projected(rotated: Float64) -> Float64:
    """Project vectors in camera axes to the picture plane, (N, 2)."""
    return np.asarray(rotated[:, :2] / np.maximum(rotated[:, 2:], _AHEAD))


def _directions(apart: Float64) -> tuple[Float64, Float64, Float64]:
    """Return unit vectors away from the sitter and across, (N, 2), and the distances, (N,)."""
    far = np.linalg.norm(apart, axis=1)
    along = apart / np.maximum(far, 1e-9)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    return along, across, far


def _along(far: Float64) -> Float64:
    return np.hypot(_ACROSS, _ALONG * far)


def unit_rays(rays: Float64, zoom: Float64 | float = 1.0) -> Float64:
    """Return rays, (..., 2), as unit vectors, (..., 3), after scaling by a zoom, (...)."""
    flat = rays * np.asarray(zoom)[..., None]
    full = np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
    return np.asarray(full / np.linalg.norm(full, axis=-1, keepdims=True))


def _angle(first: Float64, second: Float64) -> Float64:
    """Return the angles between unit vectors, in radians, with precision even for small angles."""
    return np.asarray(2.0 * np.arcsin(np.clip(np.linalg.norm(first - second, axis=-1) / 2, 0, 1)))


def _frames(first: Float64, second: Float64) -> Float64:
    """Return right-handed axes from pairs of unit vectors, (K, 3, 3), one axis per column."""
    middle = first + second
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-12)
    side = np.cross(first, second)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    return np.stack([middle, side, np.cross(middle, side)], axis=2)


def _upright(rotations: Float64) -> Bools:
    """Return a mask of the cameras that are neither upside down nor aimed at the ceiling."""
    pitch = np.degrees(np.arcsin(np.clip(rotations[:, 1, 2], -1.0, 1.0)))
    roll = np.degrees(np.arctan2(-rotations[:, 1, 0], -rotations[:, 1, 1]))
    return np.asarray((np.abs(pitch) < MOST_PITCH_DEG) & (np.abs(roll) < MOST_ROLL_DEG))
