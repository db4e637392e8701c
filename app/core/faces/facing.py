"""Estimate the direction in which a face looks, at a place whose light is known.

The head is rendered in the light of the place at 128 turns, in the pose of the face. A real face
differs from the head in colour and shape. For the difference between the two halves of the face,
this deviation is smaller than for their sum. Both deviations vary smoothly across pixels, so the
residual is weighted as a Gaussian process (Rasmussen and Williams, Gaussian Processes for Machine
Learning, 2006, eq. 2.30).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.angles import arc_width, wrap
from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.sphere import directions, positions
from app.core.faces.face_on_head import head_map
from app.core.faces.light_from_face import FRONTAL_DEG, usual_pose
from app.core.faces.pose import HeadPose
from app.core.solver.search import luminance_of

Standing: TypeAlias = Literal["inside", "outside", "unsure"]

WIDE_DEG: Final = 40.0
"""Width, in degrees, of the widest arc for which a face's angle to the goal is reported.

Across a wider arc, the light hardly changes.
"""

_TURNS: Final = 128
_FLOOR: Final = 0.05  # fraction of the 90th percentile; darker values carry no information
_BRIGHT: Final = 90
_LEAST_SEEN: Final = 0.5
# Standard deviations of log luminance between faces: the part that is independent per pixel, then
# correlated parts with their sizes in pixels.
_DIFFERENCE: Final = (0.12, ((0.1, 4.0),))
_SUM: Final = (0.15, ((0.2, 4.0), (0.3, 20.0)))
_MOST_UNLIKE: Final = 5.0  # mean square of the residual; it is below 4.2 for 97% of people
_TRUST: Final = 20.0  # factor from mean cost to log likelihood: pixels are not independent
_NEAR_DEG: Final = 15.0
_LEAST_NEAR: Final = 0.5  # minimum fraction of the likelihood near a reliable estimate
_MARGIN_DEG: Final = 4.0  # possible error in the direction of a face outside an arc
_MOST_OUTSIDE: Final = 0.02
_MOST_INSIDE: Final = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class FacingEstimate:
    """The direction in which a face looks.

    Attributes:
        azimuth_deg: Most likely azimuth in the panorama, in degrees.
        azimuths: (128,) float64. Azimuths of the turns, in degrees.
        likelihood: (128,) float64. The likelihood of each of `azimuths`. Their sum is 1.
    """

    azimuth_deg: float
    azimuths: Float64
    likelihood: Float64

    def share(self, middle_deg: float, within_deg: float) -> float:
        """Return the likelihood that the direction is within a given angle of an azimuth."""
        near = np.abs(_wrapped(self.azimuths - middle_deg)) <= within_deg
        return float(self.likelihood[near].sum())

    @property
    def sure(self) -> bool:
        """Whether the estimate is reliable enough to show as a number."""
        return self.share(self.azimuth_deg, _NEAR_DEG) >= _LEAST_NEAR


def find_facing(
    grey: Float32, visible: Bools, pose: HeadPose, light: Floats
) -> FacingEstimate | None:
    """Find the direction in which a face looks, from the light on it.

    Args:
        grey, visible: Results of `on_head`.
        light: (H, W, 3) float. Linear Rec. 709 radiance at the place, in panorama coordinates.

    Returns:
        The estimate, or None if too little of the face is visible or if the light on it fits no
        direction at this place.
    """
    right, left = head_map().halves
    both = visible[right] & visible[left]
    if both.mean() < _LEAST_SEEN:
        return None
    difference, total = _logs(grey[None, right], grey[None, left], both)
    one, other = np.split(_light_on_head(light, pose) @ _basis(), 2, axis=1)
    differences, totals = _logs(one, other, both)
    parts = ((differences - difference, _DIFFERENCE), (totals - total, _SUM))
    cost = sum(np.square(rest @ _whitening(*how)).mean(axis=1) for rest, how in parts)
    best = int(np.argmin(cost))
    if cost[best] > _MOST_UNLIKE:
        return None
    before, least, after = (float(cost[(best + step) % _TURNS]) for step in (-1, 0, 1))
    between = 0.5 * (before - after) / max(before - 2 * least + after, 1e-12)
    # A face that is hardly turned counts as facing the lens, as in `read_light`.
    aside = pose.yaw_deg if abs(pose.yaw_deg) >= FRONTAL_DEG else 0.0
    azimuths = np.arange(_TURNS) * 360 / _TURNS - aside
    # The worse the best fit, the less significant a difference in cost.
    likelihood = np.exp(_TRUST * (least - cost) / max(least, 1.0))
    azimuth = (best + between) * 360 / _TURNS - aside
    return FacingEstimate(wrap(azimuth), _wrapped(azimuths), likelihood / likelihood.sum())


def standing(facing: FacingEstimate, arc_deg: tuple[float, float]) -> Standing:
    """Return whether a face looks into a clockwise arc (from, to), or "unsure" if unclear."""
    half = arc_width(arc_deg) / 2
    middle = arc_deg[0] + half
    if abs(wrap(facing.azimuth_deg - middle)) <= half + _MARGIN_DEG:
        outside = 1 - facing.share(middle, half + _NEAR_DEG)
        return "inside" if outside <= _MOST_OUTSIDE else "unsure"
    inside = facing.share(middle, half + _MARGIN_DEG)
    is_certain = facing.sure and inside <= _MOST_INSIDE and 2 * half <= WIDE_DEG
    return "outside" if is_certain else "unsure"


def _wrapped(angles: Float64) -> Float64:
    return np.asarray((angles + 180) % 360 - 180)


def _logs(right: Float32, left: Float32, both: Bools) -> tuple[Float64, Float64]:
    """Return the log differences and log sums of the halves, (n, M) each, with 0 where hidden."""
    bright = np.percentile(np.concatenate([right[:, both], left[:, both]], axis=1), _BRIGHT, axis=1)
    scale = np.maximum(bright, 1e-12)[:, None]
    one, other = (np.log(np.maximum(half / scale, 0) + _FLOOR) for half in (right, left))
    total = one + other
    total -= total[:, both].mean(axis=1, keepdims=True)
    return (one - other) * both, total * both


@lru_cache(maxsize=2)
def _whitening(alone: float, alike: tuple[tuple[float, float], ...]) -> Float64:
    """Return the matrix, (M, M), that makes the residuals independent, each with variance 1."""
    places = np.stack(np.divmod(head_map().halves[0], head_map().side), axis=1).astype(np.float64)
    apart = np.square(places[:, None] - places[None]).sum(axis=2)
    covariance = alone**2 * np.eye(len(places))
    for size, reach in alike:
        covariance += size**2 * np.exp(-apart / (2 * reach**2))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)).T)


@lru_cache(maxsize=1)
def _basis() -> Float32:
    """Return the light on both halves for each row of the transport's basis, (R, 2 M)."""
    head = head_map()
    return head.blurred(head.transport.luminance_basis.T, head.halves.ravel())


def _light_on_head(light: Floats, pose: HeadPose) -> Float32:
    """Return the place's light in the transport's basis, (128, R), with one row for each turn."""
    transport = head_map().transport
    shape = rows, columns = transport.environment_shape
    to_usual = (pose.facing_rotation @ usual_pose().facing_rotation.T).T.astype(np.float32)
    across, down = positions(directions(shape).reshape(-1, 3) @ to_usual, shape)
    turns = np.arange(_TURNS)[:, None] * columns / _TURNS
    across = np.asarray((across + turns) % columns, np.float32)
    down = np.broadcast_to(np.clip(down, 0, rows - 1), across.shape)
    grey = luminance_of(light).astype(np.float32)
    env = cv2.remap(grey, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(env @ transport.texel_basis.T, np.float32)
