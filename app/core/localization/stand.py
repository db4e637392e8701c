"""How a camera stands and is turned, and its lens, from all that is known and from the matches.

First as if it were on the line to the sitter (`app.core.localization.rotation`), with the lens that
then explains the enlargement (`app.core.localization.field_of_view`); and for a picture that may be
anywhere, from how near things are shifted against far ones (`app.core.localization.parallax`),
which works without knowing where the sitter is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.localization import rotation
from app.core.localization.field_of_view import lens_factor
from app.core.localization.parallax import Aim, Line, lined_up, straightened
from app.core.localization.rotation import Outlook, Pose

Float64: TypeAlias = NDArray[np.float64]

_TRIES: Final = 1200
_SITTER_SPREAD: Final = 0.015  # of the picture plane, some 1 deg: how well a face is placed
_NO_SITTER_SPREAD: Final = 0.04  # more would let the fit step aside to explain depth
_AIM_DEG: Final = 5.0  # how far beside the sitter a camera is aimed
_AIM_AWAY_DEG: Final = 6.5  # how far from who carries it, whom nobody looks at meanwhile
_BESIDE_DEG: Final = 5.0
_CLEARLY: Final = 1.05  # so many times as many points
_SITTER_SHARE: Final = 0.3  # of the angle itself, where the lens is not known
_ZOOM: Final = (0.8, 2.4)  # 1 + d / D, and a field of view that is not quite what is said
_LIKELY: Final = (1.3, 0.3)
_ANY_ZOOM: Final = (0.5, 3.2)
_LIKELY_ANY: Final = (1.3, 0.6)
_AWAY_ZOOM: Final = (0.3, 1.25)  # 1 - d / D: the camera is nearer to what it sees than the probe
_LIKELY_AWAY: Final = (0.75, 0.2)
_AWAY_ANY_ZOOM: Final = (0.2, 1.7)
_LIKELY_AWAY_ANY: Final = (0.75, 0.4)
_AWAY_SPREAD: Final = 0.1  # of the picture plane: who carries it is about on that line
_AWAY_UNSEEN: Final = 0.2
_LENS_ERROR: Final = 0.07  # of an angle, where the lens is estimated
_GUESSED: Final = (0.12, 0.05)  # spread of a lens that is guessed, at first and again
_UNSAID: Final = 0.4  # of a step aside, what parallax leaves open
_ALIKE: Final = 2.0  # neighbours err together
_TOWARD: Final = (
    0.018,
    0.15,
)  # radians: a face beside the probe's place; of its tangent
_SOMEBODY_ELSE: Final = 4.0
_SURE: Final = 0.01
_UNEVEN: Final = 0.12  # of an enlargement: depth that is not the plane's
_SLOPE: Final = 0.4
_ROUNDS: Final = 6
_NEAREST: Final = 4.5  # enlarged more, a thing is too near, and a match wrong


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Points of a picture and what they look like.

    Attributes:
        rays: (N, 2) float64. In the picture plane, for the lens that is assumed.
        bearings: (N, 3) float64. In the panorama, unit vectors.
        ratio: (N,) float32. By `app.core.localization.features.pair`.
    """

    rays: Float64
    bearings: Float64
    ratio: NDArray[np.float32]
    shape: float


@dataclass(frozen=True, slots=True)
class Question:
    """What is known of a camera before.

    Attributes:
        lens: How well the field of view is known: spread of the logarithm of its tangent; None
            where nobody knows it.
        sitter_deg: Where the sitter is from the axis; None where that is not known.
    """

    lens: float | None
    sitter_deg: float | None
    away: bool = False
    near: bool = False

    @property
    def lens_known(self) -> bool:
        """Whether it is known at all."""
        return self.lens is not None


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """A camera's pose and its lens.

    Attributes:
        lens: (3,) float64. As in `app.core.localization.parallax.Line`.
    """

    pose: Pose
    lens: Float64
    outlook: Outlook
    line: Line | None = None

    @property
    def factor(self) -> float:
        """By what the picture plane is larger than was assumed."""
        return math.exp(float(self.lens[0]))

    def rays(self, rays: Float64) -> Float64:
        """Points of the picture plane as `pose` takes them."""
        return straightened(rays, self.lens)

    def error_deg(self, question: Question) -> float:
        """Return the standard error of the heading, of the points and of what is not known.

        With a wrong lens what is behind the sitter stays where it is, and the axis, beside it,
        moves; and where nobody knows where the sitter is, a step aside looks like a turn of things
        nearby.
        """
        aside = math.degrees(math.atan(float(self.pose.sitter[0])))
        lens = 0.0 if question.lens_known else _LENS_ERROR * aside
        aim = _AIM_AWAY_DEG if question.away else _AIM_DEG
        step = 0.0 if self.outlook.sitter_known else aim * abs(self.pose.zoom - 1.0)
        if self.line is not None:
            points = _ALIKE * math.degrees(self.line.error_rad)
            return math.hypot(points, lens, _UNSAID * step)
        return math.hypot(math.degrees(self.pose.error_rad), lens, step)


def find_stand(matches: Matches, question: Question, hint: Pose | None = None) -> Stand | None:
    """Find how a camera stands."""
    tries = _TRIES // 3 if question.near else _TRIES
    outlooks = _outlooks(question)
    poses = [rotation.fit(matches.rays, matches.bearings, o, tries) for o in outlooks]
    # A face on a poster is found like one of flesh, and would be taken for the place of the probe.
    agree = [0 if p is None else int(p.inside.sum()) for p in poses]
    best = len(poses) - 1 if agree[-1] > _CLEARLY * agree[0] else 0
    pose, outlook = poses[best], outlooks[best]
    if pose is None:
        return None
    stand: Stand | None = Stand(pose, np.zeros(3), outlook)
    if not question.lens_known:
        stand = _scaled(Stand(pose, np.zeros(3), outlook), matches, question)
    # Near the last heading the search has looked; who carries a camera is a hint, no line.
    if stand is None or question.near or question.away:
        return stand
    others = [p for p in (*poses, hint) if p is not None and p is not pose]
    return _lined(stand, others, matches, question, outlooks[0])


def _scaled(stand: Stand, matches: Matches, question: Question) -> Stand | None:
    """Take the lens that is likeliest for a pose."""
    rays = stand.rays(matches.rays)
    zooms = stand.pose.zooms(rays, matches.bearings)[stand.pose.inside]
    factor = lens_factor(zooms, matches.shape, away=question.away)
    outlook = _narrowed(stand.outlook, factor, question.away)
    pose = rotation.rescaled(stand.pose, rays, matches.bearings, factor, outlook)
    if pose is None:
        return None
    return Stand(pose, stand.lens + np.array([math.log(factor), 0.0, 0.0]), outlook)


def _lined(
    stand: Stand, others: list[Pose], matches: Matches, question: Question, told: Outlook
) -> Stand:
    """Refine by parallax; where the lens is guessed, guess it again from there."""
    poses, scale = [stand.pose, *others], float(stand.lens[0])
    for spread in _GUESSED if question.lens is None else [question.lens]:
        aims = [Aim(0.0, math.radians(_AIM_DEG))]
        if question.sitter_deg is not None:
            # Who was found may be somebody else.
            aims = [aims[0]._replace(unlikely=_SOMEBODY_ELSE)]
            sitter = told.sitter * math.exp(scale)
            unsure = 0.0 if question.lens_known else _TOWARD[1] * sitter
            aims.append(Aim(math.atan(sitter), math.hypot(_TOWARD[0], unsure)))
        line = lined_up(
            poses, matches.rays * math.exp(scale), matches.bearings, matches.ratio, aims, spread,
            known=question.lens_known,
        )  # fmt: skip
        if line is None:
            return stand
        stand = _refined(line, line.lens + np.array([scale, 0.0, 0.0]), matches, stand.outlook)
        poses = [stand.pose]
        zooms = stand.pose.zooms(stand.rays(matches.rays), matches.bearings)[stand.pose.inside]
        scale = float(stand.lens[0]) + math.log(lens_factor(zooms, matches.shape))
    return stand


def _refined(line: Line, lens: Float64, matches: Matches, known: Outlook) -> Stand:
    """Take over a line, and fit the plane that its points are about in."""
    rays = straightened(matches.rays, lens)
    pose = Pose(line.rotation, line.probe, np.zeros(3), line.inside, line.error_rad)
    zooms = pose.zooms(rays, matches.bearings)
    inside = line.inside & ~(zooms < _ANY_ZOOM[0]) & ~(zooms > _NEAREST)
    said = inside & np.isfinite(zooms)
    plane = _plane(rays[said], zooms[said])
    outlook = Outlook(float(line.probe[0]), _SURE, _ZOOM, _LIKELY, known.sitter_known)
    return Stand(replace(pose, plane=plane, inside=inside), lens, outlook, line)


def _plane(rays: Float64, zooms: Float64) -> Float64:
    """Fit enlargement less 1 in the middle, and its slopes, to that of points."""
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


def _outlooks(question: Question) -> list[Outlook]:
    told = _outlook(question, question.sitter_deg)
    aside = question.sitter_deg
    if question.away or aside is None or abs(aside) < _BESIDE_DEG:
        return [told]
    return [told, _outlook(question, None)]


def _outlook(question: Question, sitter_deg: float | None) -> Outlook:
    sitter = math.tan(math.radians(min(max(sitter_deg or 0.0, -60.0), 60.0)))
    spread = _SITTER_SPREAD if sitter_deg is not None else _NO_SITTER_SPREAD
    known, away = sitter_deg is not None, question.away
    if away:
        spread = _AWAY_SPREAD if known else _AWAY_UNSEEN
    if question.lens_known:
        limits = (_AWAY_ZOOM, _LIKELY_AWAY) if away else (_ZOOM, _LIKELY)
        return Outlook(sitter, spread, *limits, known)
    spread = math.hypot(spread, _SITTER_SHARE * sitter)
    limits = (_AWAY_ANY_ZOOM, _LIKELY_AWAY_ANY) if away else (_ANY_ZOOM, _LIKELY_ANY)
    return Outlook(sitter, spread, *limits, known)


def _narrowed(outlook: Outlook, factor: float, away: bool) -> Outlook:
    """Say what is known of a camera once its lens is."""
    limits = (_AWAY_ZOOM, _LIKELY_AWAY) if away else (_ZOOM, _LIKELY)
    sitter, spread = outlook.sitter * factor, outlook.sitter_spread * factor
    if away and outlook.sitter_known:
        spread = math.hypot(_AWAY_SPREAD, _LENS_ERROR * sitter)
    return Outlook(sitter, spread, *limits, outlook.sitter_known)
