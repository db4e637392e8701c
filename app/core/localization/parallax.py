"""Find the direction from a camera to the probe's position by parallax.

Each point is in the same plane as its match in the panorama and the direction from the camera to
the probe. The matches alone therefore determine the camera's rotation and that direction (D.
Nister, PAMI 2004), and they show whether it is the direction of the sitter. If the camera is on the
line through the sitter, it is. If the camera is elsewhere, it can be any direction. Both cameras
are fitted, and `Line.gain` is the number of additional points that the second one explains. A
camera at the probe's own position has no parallax, so the direction is undetermined, but it is not
needed either. The residual distortion of the lens and the motion of the hand during the sensor's
readout are further unknowns.

The camera's axes point right, down and forward. Those of the panorama are as in
`app.core.base.sphere`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import cv2
import numpy as np

from app.core.base import sphere
from app.core.base.arrays import Bools, Float32, Float64
from app.core.localization.rotation import CameraPose

_NOISE: Final = 0.0015  # radians
_STILL_NOISE: Final = 1.5  # factor for errors in any direction over errors out of a plane
_LEAST: Final = 8
_ROUNDS: Final = 7
_RIDGE: Final = 1e-3
# sine of the angle from the direction to the probe: nearer points carry little information
_NEAR: Final = 0.03
_AHEAD: Final = 0.2  # cosine: points further to the side count as behind the camera
_BEND: Final = 0.03  # of the picture plane's radius, at its square
_SKEW: Final = 0.005  # of the picture plane: 0.6 degrees from the first row to the last
_LEVEL: Final = 0.1  # radians: height of the camera relative to the probe
_ANY: Final = 1.0  # radians: for an unconstrained direction
_OPEN: Final = 0.25  # radians: for a camera that points roughly at the sitter, or away from them
_SAMPLES: Final = 1000
_SAMPLE_NOISE: Final = 0.003
_AS_FREE: Final = 0.3  # spread of an unknown lens
_BEST: Final = 3
_ALIKE_RAD: Final = 0.005
# fraction of the points without parallax, even if another distortion has to explain the rest
_UNMOVED: Final = 0.75
# in standard deviations of a known lens: a larger error is the enlargement of a flat wall
_ZOOMED: Final = 0.5
_MOST_TURN: Final = 0.3


class Aim(NamedTuple):
    """Expected direction of the probe, in radians to the right of the axis, and its spread.

    The probe is near 0 for a camera that looks at the sitter, and near pi for one that looks away.

    Attributes:
        unlikely: Cost of this assumption, in points.
    """

    angle: float
    spread: float
    unlikely: float = 0.0


class Doubts(NamedTuple):
    """The evidence against a line, as in `Line`."""

    gain: float
    aside: float
    loose_rad: float
    flat: float


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A camera on the line to the sitter.

    Attributes:
        rotation: (3, 3) float64. Rotation from the camera's axes to the panorama's axes.
        lens: (3,) float64. Logarithm of the picture plane's scale, distortion, and skew.
        probe: (2,) float64. Position of the probe in the picture plane.
        inside: (N,) bool. True for the points that agree.
        error_rad: Standard error of the heading, in radians.
        agree: Weighted number of points that agree.
        gain: Number of additional points that a camera elsewhere explains.
        aside: Cost of assuming the sitter's direction minus the cost of a camera elsewhere, in
            points, at least 0.
        loose_rad: Standard deviation of the probe's direction as determined by the points alone, in
            radians, or 0 if there is no parallax, in which case the direction does not matter.
        flat: Fraction of the agreeing points that are in one plane, 0 to 1. A camera elsewhere with
            another lens could show the same plane.
        elsewhere: (3, 3) float64. Rotation of the camera that explains most points, wherever it is.
        open_line: The same without the sitter's position: the direction of the probe is measured,
            within about 15 degrees of the axis.
    """

    rotation: Float64
    lens: Float64
    probe: Float64
    inside: Bools = field(repr=False)
    error_rad: float
    agree: float
    gain: float
    aside: float
    loose_rad: float
    flat: float
    elsewhere: Float64
    open_line: Line | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    """A rotation, a lens, the direction to the probe in the camera's axes, and their fit."""

    rotation: Float64
    lens: Float64
    way: Float64
    points: float = 0.0
    cost: float = 0.0
    agree: Float64 = field(default_factory=lambda: np.zeros(0))
    normal: Float64 = field(default_factory=lambda: np.eye(8))


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Points in the picture plane and in the panorama, and the uncertainty of the lens."""

    rays: Float64
    bearings: Float64
    scale: float

    def slopes(self, lens: Float64) -> Float64:
        """Return the derivatives of `straightened` with respect to the lens, (N, 3, 2)."""
        plain = self.rays * math.exp(lens[0])
        squared = (plain**2).sum(axis=1, keepdims=True)
        skewed = np.stack([plain[:, 1], np.zeros(len(plain))], axis=1)
        return np.stack([plain, plain * squared, skewed], axis=1)


def straightened(rays: Float64, lens: Float64) -> Float64:
    """Correct points in the picture plane, (N, 2), for the lens and the motion of the hand."""
    plain = rays * math.exp(lens[0])
    flat = plain * (1.0 + lens[1] * (plain**2).sum(axis=1, keepdims=True))
    flat[:, 0] += lens[2] * plain[:, 1]
    return np.asarray(flat)


def lined_up(
    poses: list[CameraPose],
    rays: Float64,
    bearings: Float64,
    ratio: Float32,
    aims: list[Aim],
    scale: float,
    *,
    lens_known: bool,
) -> Line | None:
    """Find the best camera on the line to the sitter, and compare it with an unconstrained camera.

    Args:
        poses: Poses from which to start.
        rays, bearings: (N, 2) and (N, 3) float64. As in `app.core.localization.rotation.fit`. They
            contain all matches, right and wrong.
        ratio: (N,) float32. Ratios of the matches, from `app.core.localization.features.pair`.
        aims: Possible directions of the probe.
        scale: Spread of the logarithm of the lens's scale.
        lens_known: Whether the lens was given rather than estimated.
    """
    ahead = bearings @ poses[0].rotation[:, 2] > _AHEAD
    if int(ahead.sum()) < _LEAST:
        return None
    pairs = _Pairs(rays[ahead], bearings[ahead], scale)
    starts = [_Solution(p.rotation, np.zeros(3), _unit(np.append(p.sitter, 1.0))) for p in poses]
    starts += _sampled(pairs, poses[0].rotation, ratio[ahead])
    free = _best([_settled(pairs, one) for one in starts])
    if _worth(free[0]) < _LEAST:
        return None
    pose_starts = starts[: len(poses)]
    best_way = max((w for aim in aims for w in _aimed(pairs, pose_starts, free, aim)), key=_worth)
    flat, mirrored = _mirrored(pairs, best_way)
    free = [*free, *(_settled(pairs, one) for one in (best_way, *mirrored))]
    most = max(free, key=_worth)
    still = max((_unmoved(pairs, one, lens_known) for one in (best_way, *free[:_BEST])), key=_worth)
    toward = math.cos(aims[0].angle) > 0.0
    zoomed = toward and lens_known and abs(float(still.lens[0])) > _ZOOMED * scale
    if not zoomed and still.points > _UNMOVED * max(best_way.points, most.points):
        # No parallax: the camera is at the probe's own position, and any distortion is not
        # parallax.
        best_way, loose, gain, aside = replace(still, way=best_way.way), 0.0, 0.0, 0.0
    else:
        unaimed = _settled(
            replace(pairs, scale=scale if lens_known else _AS_FREE), best_way, rounds=0
        ).normal
        loose = math.sqrt(max(float(np.linalg.inv(unaimed)[6, 6]), 0.0))
        aside = max(best_way.cost - most.cost, 0.0)
        gain = max(most.points - best_way.points, 0.0)
    axis = 0.0 if toward else math.pi
    open_way = max(_aimed(pairs, [], [best_way, *_best(free)], Aim(axis, _OPEN)), key=_worth)
    more = max(most.points - open_way.points, 0.0)
    open_line = _line(open_way, most, ahead, Doubts(more, 0.0, loose, flat))
    line = _line(best_way, most, ahead, Doubts(gain, aside, loose, flat))
    return replace(line, open_line=open_line)


def open_line_near(
    pose: CameraPose, rays: Float64, bearings: Float64, scale: float, *, away: bool
) -> Line | None:
    """Measure the direction of the probe, starting from a pose that is nearly right.

    Args:
        rays, bearings, scale: As in `lined_up`.
        away: Whether the camera looks away from the probe.
    """
    ahead = bearings @ pose.rotation[:, 2] > _AHEAD
    if int(ahead.sum()) < _LEAST:
        return None
    pairs = _Pairs(rays[ahead], bearings[ahead], scale)
    start = _Solution(pose.rotation, np.zeros(3), _unit(np.append(pose.sitter, 1.0)))
    way = _aimed(pairs, [start], [], Aim(math.pi if away else 0.0, _OPEN))[0]
    most = _settled(pairs, way)
    flat, _ = _mirrored(pairs, way)
    return _line(way, most, ahead, Doubts(max(most.points - way.points, 0.0), 0.0, 0.0, flat))


def _line(way: _Solution, most: _Solution, ahead: Bools, doubts: Doubts) -> Line:
    inside = np.zeros(len(ahead), bool)
    inside[ahead] = way.agree > 0.3
    error = math.sqrt(max(float(np.linalg.inv(way.normal)[1, 1]), 0.0))
    probe = way.way[:2] / _depth(way.way)
    return Line(way.rotation, way.lens, probe, inside, error, way.points, *doubts, most.rotation)


def _depth(way: Float64) -> float:
    """Return the component of a direction along the axis, kept away from 0."""
    return math.copysign(max(abs(float(way[2])), _AHEAD), float(way[2]))


def _worth(way: _Solution) -> float:
    return way.points - way.cost


def _aimed(
    pairs: _Pairs, starts: list[_Solution], free: list[_Solution], aim: Aim
) -> list[_Solution]:
    """Fit the solutions with the direction constrained to that of the sitter."""
    ways = []
    ahead = math.cos(aim.angle)
    for one in (*free, *starts):
        way = one.way if one.way[2] * ahead > 0.0 else -one.way
        if one.points == 0.0:
            level = float(way[1]) / abs(_depth(way)) * abs(ahead)
            way = _unit(np.array([math.sin(aim.angle), level, ahead]))
        solution = _settled(pairs, replace(one, way=way), aim)
        ways.append(replace(solution, cost=solution.cost + aim.unlikely))
    return ways


def _best(ways: list[_Solution]) -> list[_Solution]:
    """Choose the best solutions that differ from one another."""
    picks: list[_Solution] = []
    for one in sorted(ways, key=_worth, reverse=True):
        if all(
            sphere.angle_of(one.rotation.T @ other.rotation) > math.degrees(_ALIKE_RAD)
            for other in picks
        ):
            picks.append(one)
        if len(picks) == _BEST:
            break
    return picks


def _settled(
    pairs: _Pairs, start: _Solution, aim: Aim | None = None, rounds: int = _ROUNDS
) -> _Solution:
    """Fit by Gauss-Newton with robust weights that become progressively stricter.

    Without an aim, the sign of the direction only decides which points are in front of both
    cameras, so the better one is chosen in the end.
    """
    state = start
    for step in range(rounds + 1):
        noise = _NOISE * max(rounds - 2.0 - step, 1.0)
        miss, slopes = _out_of_plane(pairs, state)
        weights = 1.0 / (1.0 + (miss / noise) ** 2) ** 2 / noise**2
        # The constant keeps the system solvable if no point is near.
        normal = slopes.T @ (slopes * weights[:, None]) + _RIDGE * np.eye(8)
        right = -slopes.T @ (weights * miss)
        cost = 0.0
        for row, value, spread in _priors(pairs, state, aim):
            normal += np.outer(row, row) / spread**2
            right -= row * value / spread**2
            cost += (value / spread) ** 2
        if step == rounds:
            closeness = 1.0 / (1.0 + (miss / _NOISE) ** 2)
            sides = [state] if aim else [state, replace(state, way=-state.way)]
            return max(
                (_with_points(pairs, side, cost, closeness, normal) for side in sides),
                key=lambda side: side.points,
            )
        state = _add_step(state, np.asarray(np.linalg.solve(normal, right)))
    raise AssertionError


def _with_points(
    pairs: _Pairs, state: _Solution, cost: float, closeness: Float64, normal: Float64
) -> _Solution:
    agree = np.where(_in_front(pairs, state, normal), closeness, 0.0)
    return replace(state, points=float(agree.sum()), cost=cost, agree=agree, normal=normal)


def _add_step(state: _Solution, change: Float64) -> _Solution:
    turn = change[:3] * min(1.0, _MOST_TURN / max(float(np.linalg.norm(change[:3])), 1e-9))
    across, up = _beside(state.way)
    return replace(
        state,
        rotation=state.rotation @ sphere.from_vector(turn),
        lens=np.clip(state.lens + change[3:6], (-1.2, -0.15, -0.05), (1.2, 0.15, 0.05)),
        way=_unit(state.way + change[6] * across + change[7] * up),
    )


def _out_of_plane(pairs: _Pairs, state: _Solution) -> tuple[Float64, Float64]:
    """Return the points' angles from the common plane, (N,), and their derivatives, (N, 8)."""
    full, there, way = _full(pairs, state), pairs.bearings @ state.rotation, state.way
    size = _scale_of(full, there, way)[:, None]
    normal = _cross(there, way) / size
    both = _cross(full, there) / size
    by_rotation = (full * (there @ way)[:, None] - way * (full * there).sum(axis=1)[:, None]) / size
    miss = (normal * full).sum(axis=1)
    # A lens that moves points closer to the direction to the probe does not make them correct.
    reach = _cross(way, full)
    nearer = _cross(reach, way) / np.maximum((reach**2).sum(axis=1), _NEAR**2)[:, None]
    bent = np.einsum(
        "nk,nlk->nl", (normal - miss[:, None] * nearer)[:, :2], pairs.slopes(state.lens)
    )
    by_way = both @ np.stack(_beside(way), axis=1)
    return miss, np.concatenate([by_rotation, bent, by_way], axis=1)


def _scale_of(full: Float64, there: Float64, way: Float64) -> Float64:
    """Return the divisor that converts a distance from the common plane to an angle, (N,).

    If a point is closer than usual to the direction of the probe, compared with its match, an error
    of the point turns the match further around that direction.
    """
    here, beyond = (np.linalg.norm(_cross(way, one), axis=1) for one in (full, there))
    here = np.maximum(here, _NEAR)
    larger = beyond / here
    usual = max(float(np.median(larger)), 0.1)
    return np.asarray(here * np.sqrt((1.0 + (larger / usual) ** 2) / 2.0))


def _priors(pairs: _Pairs, state: _Solution, aim: Aim | None) -> list[tuple[Float64, float, float]]:
    """Return the priors, each as a row of the unknowns, its deviation and its spread."""
    rows = []
    for number, spread in enumerate((pairs.scale, _BEND, _SKEW)):
        rows.append((np.eye(8)[3 + number], float(state.lens[number]), spread))
    across, up = _beside(state.way)
    level = state.rotation[1]
    row = np.concatenate([_cross(state.way, level), np.zeros(3), [across @ level, up @ level]])
    rows.append((row, float(level @ state.way), _LEVEL))
    if aim is None:
        return [*rows, (np.eye(8)[6], 0.0, _ANY)]
    away = math.remainder(math.atan2(state.way[0], state.way[2]) - aim.angle, math.tau)
    slope = 1.0 / max(math.hypot(state.way[0], state.way[2]), 0.3)
    return [*rows, (slope * np.eye(8)[6], away, aim.spread)]


def _in_front(pairs: _Pairs, state: _Solution, normal: Float64) -> Bools:
    """Return a mask of points in front of both cameras, or with too little parallax to tell."""
    full, there, way = _full(pairs, state), pairs.bearings @ state.rotation, state.way
    length = np.linalg.norm(full, axis=1)
    shift = _cross(full, there)
    lens = math.sqrt(max(float(np.linalg.inv(normal)[3, 3]), 0.0))
    slack = (4.0 * _NOISE) ** 2 + (2.5 * lens * np.sqrt(length**2 - 1.0) / length**2) ** 2
    small = (shift**2).sum(axis=1) / length**2 < slack
    before = (shift * _cross(way, there)).sum(axis=1) > 0.0
    behind = (shift * _cross(way, full)).sum(axis=1) > 0.0
    return np.asarray(small | (before & behind))


def _unmoved(pairs: _Pairs, start: _Solution, lens_known: bool) -> _Solution:
    """Fit a camera at the probe's own position."""
    state, noise = start, _NOISE * _STILL_NOISE
    wide = np.array([pairs.scale if lens_known else _AS_FREE, _BEND, _SKEW])
    for step in range(_ROUNDS + 1):
        loose = noise * max(_ROUNDS - 2.0 - step, 1.0)
        flat, there = straightened(pairs.rays, state.lens), pairs.bearings @ state.rotation
        x, y = (there[:, :2] / np.maximum(there[:, 2:], _AHEAD)).T
        # converts a step in the plane to an angle
        small = 1.0 / (1.0 + (pairs.rays**2).sum(axis=1))
        miss = (flat - np.stack([x, y], axis=1)) * small[:, None]
        by_rotation = np.stack([-x * y, 1.0 + x * x, -y, -1.0 - y * y, x * y, x], axis=1)
        slopes = np.concatenate(
            [by_rotation.reshape(-1, 2, 3), pairs.slopes(state.lens).transpose(0, 2, 1)], axis=2
        )
        slopes *= small[:, None, None]
        agree = 1.0 / (1.0 + (miss**2).sum(axis=1) / loose**2)
        rows, weights = slopes.reshape(-1, 6), np.repeat((agree / loose) ** 2, 2)
        normal = rows.T @ (rows * weights[:, None]) + 1e-3 * np.eye(6)
        normal[3:, 3:] += np.diag(wide**-2)
        if step == _ROUNDS:
            cost = float(((state.lens / wide) ** 2).sum())
            return replace(state, points=float(agree.sum()), cost=cost, agree=agree, normal=normal)
        right = -rows.T @ (weights * miss.reshape(-1))
        right[3:] -= state.lens / wide**2
        state = _add_step(state, np.append(np.linalg.solve(normal, right), [0.0, 0.0]))
    raise AssertionError


def _sampled(pairs: _Pairs, rotation: Float64, ratio: Float32) -> list[_Solution]:
    """Find cameras at any position, from random samples of five reliable points."""
    there = pairs.bearings @ rotation
    rows = np.flatnonzero((there[:, 2] > 1.5 * _AHEAD) & (ratio < 0.8))
    if len(rows) < _LEAST:
        return []
    rows = rows[np.argsort(ratio[rows])]
    here = np.ascontiguousarray(pairs.rays[rows])
    flat = np.ascontiguousarray(there[rows, :2] / there[rows, 2:])
    ways = []
    for method in (cv2.RANSAC, cv2.USAC_ACCURATE):
        cv2.setRNGSeed(0)
        essential, _ = cv2.findEssentialMat(
            here, flat, np.eye(3), method=method,
            prob=0.99, threshold=_SAMPLE_NOISE, maxIters=_SAMPLES,
        )  # fmt: skip
        for number in range(0, 0 if np.ndim(essential) != 2 else min(len(essential), 9), 3):
            one, other, step = cv2.decomposeEssentialMat(essential[number : number + 3])
            relative = np.asarray(one if np.trace(one) > np.trace(other) else other, np.float64)
            way = _unit(relative.T @ np.asarray(step, np.float64)[:, 0])
            ways.append(_Solution(rotation @ relative, np.zeros(3), way))
    return ways


def _mirrored(pairs: _Pairs, way: _Solution) -> tuple[float, list[_Solution]]:
    """Return the fraction of the points in one plane, and other cameras that explain that plane."""
    inside = way.agree > 0.3
    there = pairs.bearings[inside] @ way.rotation
    here = straightened(pairs.rays, way.lens)[inside]
    ahead = there[:, 2] > _AHEAD
    if int(ahead.sum()) < _LEAST:
        return 0.0, []
    cv2.setRNGSeed(0)
    flat = there[ahead, :2] / there[ahead, 2:]
    homography, in_plane = cv2.findHomography(here[ahead], flat, cv2.RANSAC, 2.0 * _SAMPLE_NOISE)
    if np.ndim(homography) != 2:
        return 0.0, []
    _, turns, steps, _ = cv2.decomposeHomographyMat(homography, np.eye(3))
    ways = []
    for relative, step in zip(turns, steps, strict=True):
        if np.trace(relative) > 1.0 and float(np.linalg.norm(step)) > 1e-6:
            along = _unit(relative.T @ np.asarray(step, np.float64)[:, 0])
            ways.append(_Solution(way.rotation @ relative, way.lens, along))
    return float(np.mean(in_plane)), ways


def _full(pairs: _Pairs, state: _Solution) -> Float64:
    flat = straightened(pairs.rays, state.lens)
    return np.concatenate([flat, np.ones((len(flat), 1))], axis=1)


def _beside(way: Float64) -> tuple[Float64, Float64]:
    """Return two axes perpendicular to a direction: one pointing right, one pointing up or down."""
    across = _unit(np.array([way[2], 0.0, -way[0]]))
    return across, _cross(way, across)


def _cross(first: Float64, second: Float64) -> Float64:
    """Return the cross products of vectors, (..., 3), five times as fast as `numpy.cross`."""
    a, b, c = first[..., 0], first[..., 1], first[..., 2]
    x, y, z = second[..., 0], second[..., 1], second[..., 2]
    product = np.empty(np.broadcast_shapes(first.shape, second.shape))
    product[..., 0] = b * z - c * y
    product[..., 1] = c * x - a * z
    product[..., 2] = a * y - b * x
    return product


def _unit(vector: Float64) -> Float64:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))
