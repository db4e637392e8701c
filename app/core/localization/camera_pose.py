"""Estimate a camera's position, rotation and lens.

The pose is first fitted as if the camera were on the line to the sitter
(`app.core.localization.rotation`), with the lens that then explains the enlargement
(`lens_factor`). For a picture taken from anywhere else, the pose is then refined using the parallax
between near and far points (`app.core.localization.parallax`), which works without the position of
the sitter. `app.core.localization.confidence` rates the result.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from app.core.base import sphere
from app.core.base.arrays import Float32, Float64
from app.core.localization import rotation
from app.core.localization.confidence import MEASURED_FLAT, MEASURED_POINTS
from app.core.localization.heading_conversion import lens_factor
from app.core.localization.parallax import Aim, Line, lined_up, open_line_near, straightened
from app.core.localization.rotation import CameraPose, Outlook

_TRIES: Final = 1200
# of the picture plane, about 1 degree: how precisely a face is located
_SITTER_SPREAD: Final = 0.015
_NO_SITTER_SPREAD: Final = 0.04  # with a larger spread, the fit would move aside to explain depth
_AIM_DEG: Final = 5.0  # how far beside the sitter a camera may be aimed
_AIM_AWAY_DEG: Final = 6.5  # the same beside its holder, who is not being watched
_BESIDE_DEG: Final = 5.0
_CLEARLY: Final = 1.05  # factor by which more points must agree
_SITTER_SHARE: Final = 0.3  # fraction of the angle itself, if the lens is unknown
_ZOOM: Final = (0.8, 5.0)  # 1 + d / D, with some error in the field of view
_LIKELY: Final = (1.3, 0.3)
_ANY_ZOOM: Final = (0.5, 3.2)
_LIKELY_ANY: Final = (1.3, 0.6)
# 1 - d / D: the camera is nearer to the background than the probe was
_AWAY_ZOOM: Final = (0.2, 1.25)
_LIKELY_AWAY: Final = (0.75, 0.2)
_AWAY_ANY_ZOOM: Final = (0.2, 1.7)
_LIKELY_AWAY_ANY: Final = (0.75, 0.4)
_AWAY_SPREAD: Final = 0.1  # of the picture plane: the holder is roughly on that line
_AWAY_UNSEEN: Final = 0.2
_LENS_ERROR: Final = 0.07  # fraction of an angle, if the lens is estimated
_GUESS_SPREAD: Final = (0.12, 0.05)  # spread of an estimated lens, at first and in the second round
_UNSAID: Final = 0.4  # fraction of a sideways offset that parallax leaves undetermined
_ALIKE: Final = 2.0  # neighbouring points have related errors
_TOWARD: Final = (
    0.018,
    0.15,
)  # radians: offset of a face from the probe's position; fraction of its tangent
_SOMEBODY_ELSE: Final = 4.0
_SURE: Final = 0.01
_UNEVEN: Final = 0.12  # fraction of an enlargement: depth that is not the plane's
_SLOPE: Final = 0.4
_ROUNDS: Final = 6
# for a camera whose position is measured: least spread of the points in the picture plane, largest
# error, most points that only a camera elsewhere explains, largest distance of the probe from the
# axis, and largest difference from the line
_MEASURED_SPREAD: Final = 0.06
_MEASURED_ERROR: Final = math.radians(0.9)
_MEASURED_GAIN: Final = 4.0
_MEASURED_ASIDE: Final = 0.36  # of the picture plane, 20 degrees: the sitter is in the picture
_MEASURED_APART_DEG: Final = 2.0
_FAR_MORE: Final = 1.5  # factor of points for a larger difference
_NEAREST: Final = 6.0  # a larger enlargement would need an object too near, so the match is wrong


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """The points of a picture and their matches in the panorama.

    Attributes:
        rays: (N, 2) float64. Positions in the picture plane of the assumed lens.
        bearings: (N, 3) float64. Unit vectors in the panorama's coordinate system.
        ratio: (N,) float32. Ratios of the matches, as returned by
            `app.core.localization.features.pair`.
        shape: Length of the picture's longer side divided by that of the shorter side.
    """

    rays: Float64
    bearings: Float64
    ratio: Float32
    shape: float


@dataclass(frozen=True, slots=True)
class CameraPrior:
    """Prior knowledge about a camera.

    Attributes:
        lens: Uncertainty of the field of view, as the spread of the logarithm of its tangent, or
            None if the field of view is unknown.
        sitter_deg: Angle of the sitter from the camera's axis, in degrees, or None if unknown.
        away: Whether the camera looks away from the sitter.
        near: Whether the search is limited to the area around the last heading.
    """

    lens: float | None
    sitter_deg: float | None
    away: bool = False
    near: bool = False

    @property
    def lens_known(self) -> bool:
        """Whether the field of view is certain."""
        return self.lens is not None


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """The pose of a camera, and its lens.

    Attributes:
        lens: (3,) float64. As in `app.core.localization.parallax.Line`.
        confirmed: Whether the heading was found without assuming where the sitter is.
    """

    pose: CameraPose
    lens: Float64
    outlook: Outlook
    line: Line | None = None
    confirmed: bool = False

    @property
    def factor(self) -> float:
        """The factor by which the picture plane is larger than assumed."""
        return math.exp(float(self.lens[0]))

    def rays(self, rays: Float64) -> Float64:
        """Convert points in the picture plane, (..., 2), for use with `pose`."""
        return straightened(rays, self.lens)

    def error_deg(self, question: CameraPrior) -> float:
        """Return the standard error of the heading, in degrees, including the camera's uncertainty.

        If the lens is wrong, the background behind the sitter stays in place but the axis beside it
        moves. If the sitter's position is unknown, a sideways offset of the camera looks like a
        turn of near objects.
        """
        aside = math.degrees(math.atan(float(self.pose.sitter[0])))
        lens = 0.0 if question.lens_known else _LENS_ERROR * aside
        if self.confirmed:
            return math.hypot(_ALIKE * math.degrees(self.pose.error_rad), lens)
        aim = _AIM_AWAY_DEG if question.away else _AIM_DEG
        step = 0.0 if self.outlook.sitter_known else aim * abs(self.pose.zoom - 1.0)
        if self.line is not None:
            points = _ALIKE * math.degrees(self.line.error_rad)
            return math.hypot(points, lens, _UNSAID * step)
        return math.hypot(math.degrees(self.pose.error_rad), lens, step)


def find_stand(
    matches: Matches, question: CameraPrior, hint: CameraPose | None = None
) -> Stand | None:
    """Find the position, rotation and lens of a camera."""
    tries = _TRIES // 3 if question.near else _TRIES
    outlooks = _outlooks(question)
    poses = [rotation.fit(matches.rays, matches.bearings, o, tries) for o in outlooks]
    # A face on a poster is detected like a real one, and would be taken for the probe's position.
    agree = [0 if p is None else int(p.inside.sum()) for p in poses]
    best = len(poses) - 1 if agree[-1] > _CLEARLY * agree[0] else 0
    pose, outlook = poses[best], outlooks[best]
    if pose is None:
        return None
    stand: Stand | None = Stand(pose, np.zeros(3), outlook)
    if not question.lens_known:
        stand = _scaled(Stand(pose, np.zeros(3), outlook), matches, question)
    if stand is None:
        return None
    # Near the last heading, a visible sitter is enough to know where the camera stands.
    if question.near:
        return stand if question.sitter_deg is not None else _opened(stand, matches, question)
    others = [p for p in (*poses, hint) if p is not None and p is not pose]
    lined = _lined(stand, others, matches, question, outlooks[0])
    return _decided(stand, lined, matches, question)


def _scaled(stand: Stand, matches: Matches, question: CameraPrior) -> Stand | None:
    """Choose the most likely lens for a pose."""
    rays = stand.rays(matches.rays)
    zooms = stand.pose.zooms(rays, matches.bearings)[stand.pose.inside]
    factor = lens_factor(zooms, matches.shape, away=question.away)
    outlook = _narrowed(stand.outlook, factor, question.away)
    pose = rotation.rescaled(stand.pose, rays, matches.bearings, factor, outlook)
    if pose is None:
        return None
    return Stand(pose, stand.lens + np.array([math.log(factor), 0.0, 0.0]), outlook)


def _lined(
    stand: Stand,
    others: list[CameraPose],
    matches: Matches,
    question: CameraPrior,
    outlook: Outlook,
) -> Stand:
    """Refine a pose by parallax, then estimate the lens again if it was estimated before."""
    poses, scale = [stand.pose, *others], float(stand.lens[0])
    for spread in _GUESS_SPREAD if question.lens is None else [question.lens]:
        line = lined_up(
            poses, matches.rays * math.exp(scale), matches.bearings, matches.ratio,
            _aims(question, outlook.sitter * math.exp(scale)), spread,
            lens_known=question.lens_known,
        )  # fmt: skip
        if line is None:
            return stand
        lens = line.lens + np.array([scale, 0.0, 0.0])
        stand = _refined(line, lens, matches, stand.outlook, question)
        poses = [stand.pose]
        zooms = stand.pose.zooms(stand.rays(matches.rays), matches.bearings)[stand.pose.inside]
        factor = lens_factor(zooms, matches.shape, away=question.away)
        scale = float(stand.lens[0]) + math.log(factor)
    return stand


def _decided(first: Stand, lined: Stand, matches: Matches, question: CameraPrior) -> Stand:
    """Choose between a camera on the line to the sitter and one whose position is measured.

    If both agree, the line is more exact if the sitter is seen, and the measured position if not.

    Args:
        first: Camera before the refinement by parallax. On rendered pictures, it is more exact for
            a camera that looks away, unless the position is measured.
    """
    if lined.line is None or lined.line.open_line is None:
        return first
    own = replace(first, line=lined.line) if question.away else lined
    line = lined.line.open_line
    if not question.lens_known or not _is_determined(line, matches, away=question.away):
        return own
    agree = _alike(line, lined)
    if not agree and line.inside.sum() < _FAR_MORE * lined.pose.inside.sum():
        return own
    if agree and own.outlook.sitter_known and _alike(line, own):
        return replace(own, confirmed=True)
    free = _refined(line, line.lens, matches, first.outlook, question)
    return replace(free, confirmed=True)


def _opened(stand: Stand, matches: Matches, question: CameraPrior) -> Stand:
    """Measure where a camera stands if no sitter is visible, starting from a pose near it."""
    if question.lens is None:
        return stand
    line = open_line_near(
        stand.pose, matches.rays, matches.bearings, question.lens, away=question.away
    )
    if line is None or not _is_determined(line, matches, away=question.away):
        return stand
    measured = _refined(line, line.lens, matches, stand.outlook, question)
    return replace(measured, confirmed=True)


def _alike(line: Line, stand: Stand) -> bool:
    return sphere.angle_of(line.rotation.T @ stand.pose.rotation) <= _MEASURED_APART_DEG


def _is_determined(line: Line, matches: Matches, *, away: bool) -> bool:
    """Return whether the points alone determine the position of a camera."""
    rays = matches.rays[line.inside]
    return (
        len(rays) >= MEASURED_POINTS
        and line.gain <= _MEASURED_GAIN
        and line.flat <= MEASURED_FLAT
        and line.error_rad <= _MEASURED_ERROR
        and (away or float(np.linalg.norm(line.probe)) <= _MEASURED_ASIDE)
        and float(np.linalg.eigvalsh(np.cov(rays.T))[0]) >= _MEASURED_SPREAD**2
    )


def _aims(question: CameraPrior, sitter: float) -> list[Aim]:
    """Return the likely directions of the probe, for a person at `sitter` in the picture plane."""
    if question.away:
        # The holder of the camera is only a hint.
        angle = math.atan(sitter) if question.sitter_deg is not None else 0.0
        return [Aim(math.pi + angle, math.radians(_AIM_AWAY_DEG))]
    aim = Aim(0.0, math.radians(_AIM_DEG))
    if question.sitter_deg is None:
        return [aim]
    unsure = 0.0 if question.lens_known else _TOWARD[1] * sitter
    # The detected person may not be the sitter.
    return [
        aim._replace(unlikely=_SOMEBODY_ELSE),
        Aim(math.atan(sitter), math.hypot(_TOWARD[0], unsure)),
    ]


def _refined(
    line: Line, lens: Float64, matches: Matches, prior: Outlook, question: CameraPrior
) -> Stand:
    """Convert a line to a pose, and fit the plane that contains most of its points."""
    rays = straightened(matches.rays, lens)
    pose = CameraPose(line.rotation, line.probe, np.zeros(3), line.inside, line.error_rad)
    zooms = pose.zooms(rays, matches.bearings)
    least, most = _AWAY_ANY_ZOOM if question.away else (_ANY_ZOOM[0], _NEAREST)
    inside = line.inside & ~(zooms < least) & ~(zooms > most)
    usable = inside & np.isfinite(zooms)
    plane = _plane(rays[usable], zooms[usable])
    outlook = Outlook(float(line.probe[0]), _SURE, _ZOOM, _LIKELY, prior.sitter_known)
    return Stand(replace(pose, plane=plane, inside=inside), lens, outlook, line)


def _plane(rays: Float64, zooms: Float64) -> Float64:
    """Fit the enlargement minus 1 in the centre, and its slopes, to the points' enlargements."""
    usual = float(np.median(zooms)) if len(zooms) else 1.0
    plane = np.array([usual - 1.0, 0.0, 0.0])
    rows = np.column_stack([np.ones(len(rays)), rays])
    for _ in range(_ROUNDS):
        miss = zooms - 1.0 - rows @ plane
        weights = 1.0 / (1.0 + (miss / (_UNEVEN * usual)) ** 2) ** 2 / _UNEVEN**2
        normal = rows.T @ (rows * weights[:, None]) + np.diag([1e-3, _SLOPE**-2, _SLOPE**-2])
        right = rows.T @ (weights * (zooms - 1.0)) + np.array([1e-3 * (usual - 1.0), 0.0, 0.0])
        plane = np.asarray(np.linalg.solve(normal, right))
    return plane


def _outlooks(question: CameraPrior) -> list[Outlook]:
    outlook = _outlook(question, question.sitter_deg)
    aside = question.sitter_deg
    if question.away or aside is None or abs(aside) < _BESIDE_DEG:
        return [outlook]
    return [outlook, _outlook(question, None)]


def _outlook(question: CameraPrior, sitter_deg: float | None) -> Outlook:
    sitter = math.tan(math.radians(min(max(sitter_deg or 0.0, -60.0), 60.0)))
    spread = _SITTER_SPREAD if sitter_deg is not None else _NO_SITTER_SPREAD
    sitter_known, away = sitter_deg is not None, question.away
    if away:
        spread = _AWAY_SPREAD if sitter_known else _AWAY_UNSEEN
    if question.lens_known:
        limits = (_AWAY_ZOOM, _LIKELY_AWAY) if away else (_ZOOM, _LIKELY)
        return Outlook(sitter, spread, *limits, sitter_known)
    spread = math.hypot(spread, _SITTER_SHARE * sitter)
    limits = (_AWAY_ANY_ZOOM, _LIKELY_AWAY_ANY) if away else (_ANY_ZOOM, _LIKELY_ANY)
    return Outlook(sitter, spread, *limits, sitter_known)


def _narrowed(outlook: Outlook, factor: float, away: bool) -> Outlook:
    """Narrow down the prior knowledge about a camera, given its lens."""
    limits = (_AWAY_ZOOM, _LIKELY_AWAY) if away else (_ZOOM, _LIKELY)
    sitter, spread = outlook.sitter * factor, outlook.sitter_spread * factor
    if away and outlook.sitter_known:
        spread = math.hypot(_AWAY_SPREAD, _LENS_ERROR * sitter)
    return Outlook(sitter, spread, *limits, outlook.sitter_known)
