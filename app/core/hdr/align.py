"""Laying a bracket's panoramas on each other, and levelling them by the tilt the camera recorded.

Each frame is compared with a reference frame, or with its neighbour where the two share too little
(`app.core.hdr.registration`). Frames that lie on each other are left exactly as they are; so are
frames that cannot be compared: no correction is better than a wrong one.

GPano pose angles (Google, "Photo Sphere XMP Metadata") are a camera's heading, pitch and roll in
this order: pitch is the elevation of the picture's centre, and the horizon in the picture turns
counter-clockwise as roll grows. That is `app.core.base.sphere.rotation` word for word. A Ricoh
Theta writes something else under the same names: what its accelerometer says about two axes on
their own, tan pitch = front / up and tan roll = left / up of the zenith in the camera's axes. About
one axis the two are the same; with pitch -29.0 and roll -35.8 deg they are 4.7 deg apart, and the
edges in a Theta S picture tilted like that (R0010298) agree with the second within 0.5 deg. Since
other makers and programs read the standard differently, the picture itself may decide where the
readings differ: its vertical edges, where it has any, are upright under one of them only.

Heading is never applied: the front lens stays at azimuth 0, where the photographer stands. What a
Ricoh camera has levelled itself (maker note 0x0007) is left alone whatever its pose says: some
firmware writes a tilt that it has corrected already. The tilt recorded on a still tripod differs a
little from shot to shot, hence one rotation for all frames, that of the first shot.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes, Float64
from app.core.base.sphere import angle_of, angles_of, rotation
from app.core.hdr.frame import Bracket, Frame, Pose
from app.core.hdr.registration import (
    Fit,
    Level,
    edges,
    middle_frame,
    pyramid,
    register,
    usable_share,
)
from app.core.text import tr

_LEAST_DEG: Final = 0.05  # less than a pixel of a 5376 x 2688 frame: resampling would cost more
_FAR_STOPS: Final = 7.0  # frames further apart share next to nothing
_MANY_POINTS: Final = 500
_STRANGE_DEG: Final = 0.3


@dataclass(frozen=True, slots=True)
class Alignment:
    """How one frame has to be rotated to lie on the reference frame.

    `rotation`, (3, 3) float64 for `sphere.remap_frame`, is None where the frame is left as it
    is: `angle_deg` is too small, or `trusted` is False because the frames could not be
    compared. `residual_deg` is the standard error, infinite where nothing could be compared.
    """

    rotation: Float64 | None
    angle_deg: float
    residual_deg: float
    points: int
    trusted: bool


_ALONE: Final = Alignment(None, 0.0, math.inf, 0, trusted=False)


def reference_of(frames: Sequence[Bytes]) -> int:
    """Choose the frame that the others are laid on: the middle one if it is well exposed.

    Of the frames, (h, w, 3) uint8 in the order of exposure, the one nearest to the middle that
    has at least 60 % as many usable pixels, by solid angle, as the best one.
    """
    return middle_frame([usable_share(pyramid(frame)) for frame in frames])


def estimate(frames: Sequence[Bytes], stops: Sequence[float]) -> tuple[Alignment, ...]:
    """Find the small rotations that lay a bracket's panoramas on the reference frame.

    `frames`, (h, w, 3) uint8, are area means, about 672 x 336, of coded RGB. Frames of other
    proportions are left alone: their angle of view is not known. So are frames that lie on the
    reference already, or cannot be compared.
    """
    count = len(frames)
    if count < 2 or frames[0].shape[1] != 2 * frames[0].shape[0]:
        return (_ALONE,) * count
    # One after another: threads of such small pictures wait for each other longer than they save.
    pyramids = [pyramid(frame) for frame in frames]
    middle = middle_frame([usable_share(levels) for levels in pyramids])
    others = [index for index in range(count) if index != middle]
    near = [k for k in others if abs(stops[k] - stops[middle]) <= _FAR_STOPS]
    direct = {k: _between(middle, k, pyramids, stops) for k in near}
    fits: dict[int, Fit] = {middle: Fit(np.eye(3), error_deg=0.0)}
    for index in sorted(others, key=lambda k: (abs(stops[k] - stops[middle]), k)):
        fit = direct.get(index, Fit(np.eye(3)))
        fits[index] = fit if fit.trusted else _through(index, middle, fit, fits, pyramids, stops)
    return tuple(_alignment(fits[index], index == middle) for index in range(count))


def sentences(alignments: Sequence[Alignment], names: Sequence[str]) -> tuple[str, ...]:
    """Say what was done about frames that do not lie on each other.

    Nothing where every frame that can be compared lies where it should: frames too dark to be
    compared are no reason to worry then.
    """
    moved = [k for k, a in enumerate(alignments) if a.rotation is not None]
    blind = [k for k, a in enumerate(alignments) if not a.trusted]
    strange = [
        k
        for k in blind
        if alignments[k].points > _MANY_POINTS and alignments[k].residual_deg > _STRANGE_DEG
    ]
    words = []
    if moved:
        listed = ", ".join(f"{names[k]} by {alignments[k].angle_deg:.2f}°" for k in moved)
        words.append(tr("Rotated to lie on the other frames: {listed}.", listed=listed))
    if strange:
        listed = ", ".join(names[k] for k in strange)
        words.append(
            tr(
                "No small rotation lays this on the other frames, left as shot: {listed}.",
                listed=listed,
            )
        )
    dark = [k for k in blind if k not in strange]
    if moved and dark:
        listed = ", ".join(names[k] for k in dark)
        words.append(
            tr(
                "Shares too little with the other frames to be aligned, left as shot: {listed}.",
                listed=listed,
            )
        )
    return tuple(words)


def _alignment(fit: Fit, reference: bool) -> Alignment:
    """Decide whether a rotation is applied."""
    if reference:
        return Alignment(None, 0.0, 0.0, fit.points, trusted=True)
    angle = angle_of(fit.rotation)
    idle = not fit.trusted or angle < max(_LEAST_DEG, 3.0 * fit.error_deg)
    rotation = None if idle else np.ascontiguousarray(fit.rotation.T)
    return Alignment(rotation, angle, fit.error_deg, fit.points, fit.trusted)


def _through(
    index: int,
    middle: int,
    fit: Fit,
    fits: dict[int, Fit],
    pyramids: Sequence[list[Level]],
    stops: Sequence[float],
) -> Fit:
    """Fit a frame by way of the nearest frame that is fitted, where its direct fit is no good."""
    apart = abs(stops[index] - stops[middle])
    others = [k for k in fits if k != middle and fits[k].trusted]
    if not others:
        return fit
    near = min(others, key=lambda k: abs(stops[k] - stops[index]))
    if abs(stops[near] - stops[index]) > min(_FAR_STOPS, apart):
        return fit
    link, first = _between(near, index, pyramids, stops), fits[near]
    # An aligned frame on the way hands on exactly that.
    way = first.rotation if _alignment(first, False).rotation is not None else np.eye(3)
    error = math.hypot(link.error_deg, first.error_deg)
    return replace(link, rotation=link.rotation @ way, error_deg=error)


def _between(
    first: int, second: int, pyramids: Sequence[list[Level]], stops: Sequence[float]
) -> Fit:
    """Fit the rotation from one frame to another, looking from the brighter one."""
    if stops[first] >= stops[second]:
        return register(pyramids[first], pyramids[second])
    return register(pyramids[second], pyramids[first]).turned


_LEVEL_DEG: Final = 0.05  # what a note with one decimal shows as 0.0
_DIFFERENT_DEG: Final = 0.5
_LEAN_DEG: Final = 3.0
_STEEP: Final = 0.9  # nearer to the zenith every edge is nearly upright
_SECTORS: Final = 12
_MOST_SECTORS: Final = 6
_CLEARLY: Final = 1.25  # in woods and crowds the sums differ by chance


@dataclass(frozen=True, slots=True)
class Levelling:
    """What has to be done to a bracket so that up is up.

    `rotation`, (3, 3) float64 for `sphere.remap_frame` and `rotate_light`, is None if the
    bracket is level or its tilt unknown.
    """

    rotation: Float64 | None = None
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    note: str = ""


def levelling(
    bracket: Bracket,
    first_rotation: Float64 | None = None,
    picture: Bytes | None = None,
) -> Levelling:
    """Decide how a bracket is levelled, by its frames' poses and maker notes.

    `first_rotation`, (3, 3), is what `align` does to the frame at `first_shot`: the pose is
    that frame's, while the levelling acts on the reference frame. `picture`, (h, w, 3) uint8,
    is a small copy of the reference frame, coded RGB: it decides what the angles mean where
    that makes a difference and its upright edges are clear. Otherwise the camera's maker does.
    No rotation for pictures that are not panoramas, state no pose or none but 0, or that the
    camera has levelled.
    """
    if not bracket.panorama:
        return Levelling()
    shot = bracket.frames[first_shot(bracket)]
    pose = shot.pose
    if pose is None or max(abs(pose.pitch_deg), abs(wrap(pose.roll_deg))) < _LEVEL_DEG:
        return Levelling()
    if _corrected(shot, bracket.frames):
        return Levelling(
            note=tr(
                "{name} states a tilt ({tilt}), but the camera has levelled the picture "
                "itself; it is left as it is.",
                name=shot.path.name,
                tilt=_tilt(pose),
            )
        )
    readings = _readings(pose, shot.camera)
    if first_rotation is not None:
        # Their heading would be that of a small movement between two shots.
        readings = [_ahead(reading @ first_rotation.T) for reading in readings]
    matrix = readings[0] if picture is None else _most_upright(readings, picture)
    note = tr("Levelled: the camera was tilted ({tilt}).", tilt=_tilt(pose))
    return Levelling(matrix, pose.pitch_deg, pose.roll_deg, note)


def first_shot(bracket: Bracket) -> int:
    """Return which frame was shot first, of those that state a pose where any does.

    By file name, numbers by value: cameras number their shots, and their clocks tick in seconds.
    """
    frames = bracket.frames
    return min(range(len(frames)), key=lambda k: (frames[k].pose is None, _order(frames[k])))


def tilt_rotation(pose: Pose, *, gravity: bool = True) -> Float64:
    """Return the rotation, (3, 3), that levels a tilted panorama, front lens at azimuth 0.

    It takes directions in the tilted panorama to directions in the level one. `gravity` says
    that the angles are those of the accelerometer on each axis alone, as a Theta writes them;
    otherwise they are those of the GPano standard. Heading is not used.

    >>> from app.core.hdr.frame import Pose
    >>> level = tilt_rotation(Pose(pitch_deg=-29.0, roll_deg=-35.8))
    >>> [round(float(part), 4) for part in level[1]]
    [-0.5335, 0.7397, -0.41]
    """
    pitch = pose.pitch_deg
    if gravity and abs(pitch) < 90.0:
        pitch, roll = math.radians(pitch), math.radians(pose.roll_deg)
        pitch = math.degrees(math.atan(math.tan(pitch) * abs(math.cos(roll))))
    return rotation(0.0, pitch, pose.roll_deg)


def _readings(pose: Pose, camera: str) -> list[Float64]:
    """List what the angles can mean, the likeliest first."""
    standard, gravity = tilt_rotation(pose, gravity=False), tilt_rotation(pose)
    swapped = _ahead(rotation(0.0, 0.0, pose.roll_deg) @ rotation(0.0, pose.pitch_deg))
    if "THETA" in camera.upper():
        return [gravity, standard, swapped]
    return [standard, gravity, swapped]


def _ahead(matrix: Float64) -> Float64:
    """Take the heading out of a rotation: the centre column stays at azimuth 0."""
    return rotation(-angles_of(matrix)[0]) @ matrix


def _most_upright(readings: list[Float64], picture: Bytes) -> Float64:
    """Choose the reading under which the picture's edges stand upright; the first where none does.

    An edge lies on a great circle, whose normal is the direction of its gradient on the sphere.
    """
    if max(angle_of(reading @ readings[0].T) for reading in readings) < _DIFFERENT_DEG:
        return readings[0]
    vectors, normals, strengths = edges(picture)
    sector = (np.arctan2(vectors[:, 0], vectors[:, 2]) / (2.0 * np.pi) + 0.5) * _SECTORS
    place = np.clip(sector.astype(np.int64), 0, _SECTORS - 1)
    scores = []
    for reading in readings:
        up = reading[1]
        off = normals @ up / math.sin(math.radians(_LEAN_DEG))
        upright = np.clip(1.0 - off**2, 0.0, 1.0) * (np.abs(vectors @ up) < _STEEP)
        scores.append(np.bincount(place, upright * strengths, _SECTORS))
    totals = [float(score.sum()) for score in scores]
    best = int(np.argmax(totals))
    # Edges all around must agree: those of a single thing may lean as they like.
    wins = int((scores[best] > scores[0]).sum())
    return readings[best if totals[best] > _CLEARLY * totals[0] and wins >= _MOST_SECTORS else 0]


def _order(frame: Frame) -> tuple[tuple[int, str], ...]:
    parts = re.findall(r"\d+|\D+", frame.path.name.casefold())
    return tuple((int(part), "") if part.isdecimal() else (-1, part) for part in parts)


def _corrected(shot: Frame, frames: Sequence[Frame]) -> bool:
    """Whether the camera levelled a frame, or says so of another one where it is silent here."""
    if shot.zenith_corrected is not None:
        return shot.zenith_corrected
    return any(frame.zenith_corrected for frame in frames)


def _tilt(pose: Pose) -> str:
    return tr(
        "pitch {pitch_deg:+.1f}°, roll {roll_deg:+.1f}°",
        pitch_deg=pose.pitch_deg,
        roll_deg=pose.roll_deg,
    )
