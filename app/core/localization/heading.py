"""Find a camera's heading in the panorama from its picture.

The picture's feature points are matched with those of the panorama
(`app.core.localization.features`), either with all of them or with those near the last heading.
`app.core.localization.rotation` finds the rotation, allowing for the distance between camera and
probe. This module checks the rotation against the rest of the picture, and
`app.core.localization.confidence` estimates the probability that it is right.

A heading that cannot be trusted is `unsure` and has no number, because showing no number is better
than showing a wrong one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np

from app.core.base import sphere
from app.core.base.angles import wrap
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.localization import rotation
from app.core.localization.camera_pose import CameraPrior, Matches, Stand, find_stand
from app.core.localization.confidence import LEAST_CONFIDENCE, Evidence, trust
from app.core.localization.features import (
    Features,
    HeadingIndex,
    Pairs,
    blocks_of,
    describe,
    pair,
    pair_near,
    shrunk,
    thinned,
)
from app.core.localization.heading_conversion import assumed_fov
from app.core.localization.rotation import CameraPose
from app.core.localization.views import Lens

_REACH_RAD: Final = math.radians(2.0)
_ASIDE_RAD: Final = math.radians(7.0)
_ASIDE: Final = ((0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0))
_AROUND_RAD: Final = math.radians(62.0)
_LEAST: Final = 12
_STRAY_RAD: Final = math.radians(10.0)
_SOME: Final = 4  # as if this many more agreed: with few points, two strays mean little


def support(
    rays: Float64,
    own_descriptors: Float32,
    spots: Float32,
    index_descriptors: Float32,
    pose: CameraPose,
) -> float:
    """Measure how much better a pose explains all points than neighbouring poses do.

    Args:
        rays: (N, 2) float64. All points of the picture, in its picture plane, as in
            `app.core.localization.rotation.fit`.
        own_descriptors: (N, 128) float32. Descriptors of these points, of unit length.
        spots: (M, 3) float32. Points of the panorama, as unit vectors in its coordinate system.
        index_descriptors: (M, 128) float32. Descriptors of the panorama's points.

    Returns:
        The support, in standard deviations above chance. It is about 0 for a wrong pose.
    """
    axis = pose.rotation[:, 2].astype(np.float32)
    near = np.flatnonzero(spots @ axis > math.cos(_AROUND_RAD))
    if len(near) < _LEAST or len(rays) < _LEAST:
        return 0.0
    ahead, near_spots, near_descriptors = pose.predict(rays), spots[near], index_descriptors[near]
    turns = [np.array([up * _ASIDE_RAD, right * _ASIDE_RAD, 0.0]) for up, right in _ASIDE]
    rotations = [pose.rotation, *(pose.rotation @ sphere.from_vector(turn) for turn in turns)]
    alike = np.empty((len(rotations), len(rays)), np.float32)
    for rows in blocks_of(len(rays)):
        likeness = own_descriptors[rows] @ near_descriptors.T
        for number, axes in enumerate(rotations):
            alike[number, rows] = _most_alike(ahead[rows], axes, near_spots, likeness)
    best, others = alike[0], alike[1:].max(axis=0)
    comparable = (best > 0.0) & (others > 0.0)
    count = int(comparable.sum())
    if count < _LEAST:
        return 0.0
    chance = 1.0 / (1.0 + len(_ASIDE))
    share = float((best[comparable] > others[comparable]).mean())
    return (share - chance) / math.sqrt(chance * (1.0 - chance) / count)


def strays(rays: Float64, bearings: Float64, inside: Bools, pose: CameraPose) -> float:
    """Return the fraction of certain matches near the pose's prediction that disagree with it.

    Args:
        rays: (N, 2) float64. Points in the picture plane that have a certain match.
        bearings: (N, 3) float64. Matches of these points in the panorama, as unit vectors in its
            coordinate system.
        inside: (N,) bool. Whether each point agrees with the pose.

    Returns:
        The number of disagreeing matches divided by the number of these and the agreeing points
        together, 0 to 1.
    """
    beside = np.einsum("nk,nk->n", pose.predict(rays), bearings @ pose.rotation)
    count = int((~inside & (beside > math.cos(_STRAY_RAD))).sum())
    return count / (count + int(inside.sum()) + _SOME)


def _most_alike(ahead: Float64, rotation: Float64, spots: Float32, likeness: Float32) -> Float32:
    """Return the similarity of the best match near each prediction, or -1 if there is none."""
    beside = (ahead @ rotation.T).astype(np.float32) @ spots.T > math.cos(_REACH_RAD)
    return np.asarray(np.where(beside, likeness, np.float32(-1.0)).max(axis=1), np.float32)


_LEAST_SIDE: Final = 32
_SAME: Final = math.radians(1.5)
_RATIO: Final = 0.9  # generous: the fit and the whole picture decide
_REACH: Final = math.radians(8.0)  # around the first prediction
_CLOSER_RATIO: Final = 0.85
_PARTS: Final = 16  # parts of the longer side
_MOST: Final = 6  # largest number of matches from one part
_NEAR_DEG: Final = 60.0
_CARRIER_DEG: Final = 25.0  # a person further to the side is not the holder of the camera
_CERTAIN: Final = 0.8  # ratio of a match that is seldom wrong
_STEEP: Final = 0.55  # slope of a wall: a steeper one may be seen from beside the line
_STATED: Final = 0.03  # spread of the logarithm of a lens from EXIF: rounding, stabilisation
_ABOUT: Final = 0.07  # the same for a field of view set by the user
_FIELDS: Final = (25.0, 110.0)
_FEW_DETAILS: Final = 0.4  # of the points that a picture of a furnished room has


class Effort(NamedTuple):
    """The working size of a picture, in pixels, and the maximum number of points in it."""

    pixels: int
    points: int


SEARCHING: Final = Effort(640 * 480, 1400)
"""The effort for a live picture that is searched for in the whole panorama."""

_TRACKING: Final = Effort(320 * 240, 350)  # nearly as accurate, and three times as fast

FINE: Final = Effort(1200 * 900, 2500)
"""The effort for photos, which may take longer."""


@dataclass(frozen=True, slots=True)
class Heading:
    """The heading of a camera.

    Attributes:
        heading_deg: Panorama azimuth of the camera's axis, in degrees within (-180, 180], or None
            if unsure.
        pitch_deg, roll_deg: Pitch, positive upwards, and roll, positive clockwise in the picture,
            in degrees. Both are 0 if unsure.
        inliers: Number of points that agree.
        confidence: Probability that the heading is within 3 degrees of the truth, 0 to 1.
        zoom: Angular size of objects near the sitter in the panorama divided by that in the
            picture, or 1 if unsure. It depends on the distance of the background.
        fov_deg: Horizontal field of view, in degrees, either given or estimated, or 0 if unsure.
        candidate: The most likely heading if unsure, which other pictures may confirm, or None.
        few_details: Whether the picture has little that could be recognised, like a bare wall.
    """

    status: Literal["found", "unsure"]
    heading_deg: float | None
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    inliers: int = 0
    confidence: float = 0.0
    zoom: float = 1.0
    fov_deg: float = 0.0
    candidate: Heading | None = None
    few_details: bool = False


UNSURE: Final = Heading("unsure", None)
"""The heading if there is no match."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """The features in a camera's picture.

    Attributes:
        size: Number of columns and rows of the picture that contains the features.
        fine: Whether the picture was described in full detail.
    """

    features: Features
    size: tuple[int, int]
    fine: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class HeadingMatch:
    """A pose and the evidence for it.

    Attributes:
        fov_deg: Horizontal field of view, in degrees, either given or estimated.
    """

    pose: CameraPose
    evidence: Evidence
    fov_deg: float


def find_heading(
    frame: Bytes,
    index: HeadingIndex,
    fov_deg: float | None,
    *,
    near_deg: float | None = None,
    sitter_deg: float | None = 0.0,
    mask: Bools | None = None,
    fine: bool = False,
    away: bool = False,
) -> Heading:
    """Find the heading of a camera from one of its pictures.

    Args:
        frame: (H, W, 3) uint8. Upright sRGB picture of any size, not mirrored.
        fov_deg: The camera's horizontal field of view, in degrees, or None to estimate it. An error
            of 20% does no harm.
        near_deg: The last heading, in degrees, or None to search everywhere. Searching only around
            the last heading is faster and more reliable. Search everywhere after a failure.
        sitter_deg: Angle of the sitter from the camera's axis, in degrees, positive to the right,
            or None if unknown. If the field of view is unknown, give the angle for a field of view
            of 60 degrees along the longer side.
        mask: (H, W) bool. True on the background. By default, the whole picture is used, since
            points on the sitter match nothing.
        fine: Whether to use up to a million pixels, as for photos, which may take longer.
        away: Whether the camera looks away from the sitter, like a laptop's own camera when the
            laptop is carried around the sitter. The camera is then nearer to the background than
            the probe was, and `sitter_deg` is the angle of the person holding it, who is roughly on
            the line from the sitter.
    """
    effort = _TRACKING if near_deg is not None else FINE if fine else SEARCHING
    if away and sitter_deg is not None and abs(sitter_deg) > _CARRIER_DEG:
        sitter_deg, mask = None, None
    sight = see(frame, mask, effort)
    match = compare(sight, index, fov_deg, near_deg, sitter_deg, away=away)
    few_details = len(sight.features) < _FEW_DETAILS * effort.points
    heading = replace(UNSURE if match is None else to_heading(match), few_details=few_details)
    if not away or heading.heading_deg is not None or near_deg is not None:
        return heading
    # The holder of the camera is only a hint, and may be a false detection.
    match = compare(see(frame, None, effort), index, fov_deg, away=True, sitter_deg=None)
    return heading if match is None else to_heading(match)


def see(frame: Bytes, mask: Bools | None = None, effort: Effort = SEARCHING) -> Sight:
    """Find and describe the features in a camera's picture.

    Args:
        frame: (H, W, 3) uint8. As in `find_heading`.
        mask: (H, W) bool. As in `find_heading`.
    """
    if frame.ndim != 3 or min(frame.shape[:2]) < _LEAST_SIDE:
        return Sight(describe(np.zeros((64, 64), np.uint8), 1), (64, 64))
    scale = math.sqrt(effort.pixels / (frame.shape[0] * frame.shape[1]))
    small, small_mask = shrunk(frame, scale, mask)
    size = (small.shape[1], small.shape[0])
    return Sight(describe(small, effort.points, small_mask), size, effort == FINE)


def compare(
    sight: Sight,
    index: HeadingIndex,
    fov_deg: float | None,
    near_deg: float | None = None,
    sitter_deg: float | None = 0.0,
    *,
    away: bool = False,
) -> HeadingMatch | None:
    """Find the pose that best explains a picture, whether or not it can be trusted."""
    near_rows = np.arange(len(index)) if near_deg is None else index.near(near_deg, _NEAR_DEG)
    spots, index_descriptors = index.bearings[near_rows], index.descriptors[near_rows]
    own_descriptors = sight.features.descriptors
    cell = max(sight.size) / _PARTS
    pairs = pair(own_descriptors, index_descriptors, spots, _SAME, _RATIO)
    pairs = thinned(pairs, sight.features.places, cell, _MOST)
    wide = assumed_fov(sight.size) if fov_deg is None else min(max(fov_deg, 1.0), 170.0)
    lens = Lens(wide, sight.size)
    rays = _rays(sight.features.places, lens)
    shape = max(sight.size) / min(sight.size)
    known_lens = None if fov_deg is None else _STATED if sight.fine else _ABOUT
    question = CameraPrior(known_lens, sitter_deg, away, near_deg is not None)

    def matches(pairs: Pairs) -> Matches:
        there = spots[pairs.second].astype(np.float64)
        return Matches(rays[pairs.first], there, pairs.ratio, shape)

    def rated(pairs: Pairs, stand: Stand, *, guided: bool) -> HeadingMatch:
        whole = support(stand.rays(rays), own_descriptors, spots, index_descriptors, stand.pose)
        evidence = _evidence(stand, pairs, matches(pairs), lens, question, whole)
        evidence = replace(evidence, guided=guided)
        return HeadingMatch(stand.pose, evidence, fov_deg or _field(lens, stand.factor))

    stand = find_stand(matches(pairs), question)
    if stand is None:
        return None
    # A second look takes as long as the first, so a live picture gets one only if it needs it.
    if away or question.near or not sight.fine:
        match = rated(pairs, stand, guided=not sight.fine)
        steep = question.lens_known and float(np.linalg.norm(stand.pose.plane[1:])) > _STEEP
        if away or question.near or (trust(match.evidence) >= LEAST_CONFIDENCE and not steep):
            return match
    positions = (stand.pose.predict(stand.rays(rays)) @ stand.pose.rotation.T).astype("f4")
    closer = pair_near(
        own_descriptors, index_descriptors, spots, positions, _REACH, _SAME, _CLOSER_RATIO
    )
    closer = thinned(closer, sight.features.places, cell, _MOST)
    closer_stand = find_stand(matches(closer), question, stand.pose)
    if closer_stand is None:
        return rated(pairs, stand, guided=not sight.fine)
    return rated(closer, closer_stand, guided=False)


def _evidence(
    stand: Stand, pairs: Pairs, matches: Matches, lens: Lens, question: CameraPrior, whole: float
) -> Evidence:
    pose, line, rays = stand.pose, stand.line, stand.rays(matches.rays)
    certain = pairs.ratio < _CERTAIN
    inside = pose.inside[certain]
    wide = stand.factor * max(lens.size) / 2.0 / lens.focal_px
    return Evidence(
        # A point of the panorama that matches several points counts once.
        points=len(np.unique(pairs.second[pose.inside])),
        # Count as if two more of the certain matches were undecided.
        share=(float(inside.sum()) + 1.0) / (len(inside) + 2.0),
        spread=_spread(rays[pose.inside], lens),
        support=whole,
        error_deg=stand.error_deg(question),
        # If the position is measured, the slope of the wall says nothing about it.
        tilt=0.0 if stand.confirmed else float(np.linalg.norm(pose.plane[1:])),
        zoom=1.0 / max(pose.zoom, 0.1) if question.away else pose.zoom,
        wide=None if question.lens_known else wide,
        strays=strays(rays[certain], matches.bearings[certain], inside, pose),
        gain=line.gain if line else 0.0,
        aside=line.aside if line else 0.0,
        loose_deg=math.degrees(line.loose_rad) if line else 0.0,
        flat=line.flat if line and line.loose_rad else 0.0,
        agree=line.agree if line else 0.0,
        apart_deg=sphere.angle_of(line.elsewhere.T @ pose.rotation) if line else math.inf,
        away=question.away,
    )


def to_heading(
    match: HeadingMatch, least: float = LEAST_CONFIDENCE, confidence: float | None = None
) -> Heading:
    """Return a heading if its confidence is sufficient, otherwise an unsure heading."""
    confidence = trust(match.evidence) if confidence is None else confidence
    points = match.evidence.points
    azimuth, pitch, roll = match.pose.angles_deg
    absurd = abs(pitch) > rotation.MOST_PITCH_DEG or abs(roll) > rotation.MOST_ROLL_DEG
    if absurd:
        return Heading("unsure", None, inliers=points)
    zoom, fov = match.pose.zoom, round(match.fov_deg, 2)
    heading = Heading("found", wrap(azimuth), pitch, roll, points, confidence, zoom, fov)
    if confidence >= least:
        return heading
    return Heading("unsure", None, inliers=points, confidence=confidence, candidate=heading)


def _field(lens: Lens, factor: float) -> float:
    half = factor * lens.size[0] / 2.0 / lens.focal_px
    return min(max(math.degrees(2.0 * math.atan(half)), _FIELDS[0]), _FIELDS[1])


def _spread(rays: Float64, lens: Lens) -> float:
    """Return the smallest standard deviation of points in any direction, in half widths."""
    if len(rays) < 2:
        return 0.0
    least = float(np.linalg.eigvalsh(np.cov(rays.T))[0])
    return math.sqrt(max(least, 0.0)) * lens.focal_px * 2.0 / max(lens.size)


def _rays(places: Float32, lens: Lens) -> Float64:
    """Convert pixels to points in the picture plane, (N, 2), measured right and down."""
    middle = np.array(lens.size, np.float64) / 2.0
    return np.asarray((places.astype(np.float64) - middle) / lens.focal_px)
