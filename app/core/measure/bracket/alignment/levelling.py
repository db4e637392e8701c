"""Level a bracket's panoramas using the tilt that the camera recorded.

GPano pose angles (Google, "Photo Sphere XMP Metadata") are a camera's heading, pitch and roll, in
that order. Pitch is the elevation of the picture's centre, and the horizon in the picture turns
counter-clockwise as roll grows, exactly as in `app.core.base.sphere.rotation`. A Ricoh Theta
records something else under the same names: its accelerometer's readings for two separate axes,
where tan pitch = front / up and tan roll = left / up for the zenith in camera coordinates. For a
tilt about one axis, the two interpretations agree. With pitch -29.0 and roll -35.8 degrees, they
are 4.7 degrees apart, and the edges in a Theta S picture with that tilt (R0010298) agree with the
second to within 0.5 degrees. Other manufacturers and programs interpret the standard differently.
So if the two interpretations differ, the picture itself may decide: its vertical edges, if it has
any, are upright in only one of them.

Heading is never applied, so the front lens stays at azimuth 0, where the photographer is. A picture
that a Ricoh camera has levelled itself (maker note 0x0007) stays as it is, whatever its pose says,
because some firmware records a tilt that it has already corrected. The tilt recorded on a
stationary tripod differs slightly from shot to shot, so all frames get the same rotation, that of
the first shot.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes, Float64
from app.core.base.sphere import angle_of, angles_of, rotation
from app.core.measure.bracket.alignment.registration import edges
from app.core.measure.bracket.remarks import Levelled
from app.core.measure.read.frame import Bracket, Frame, XmpPose

_LEVEL_DEG: Final = 0.05  # smaller angles appear as 0.0 in a note with one decimal
_DIFFERENT_DEG: Final = 0.5
_LEAN_DEG: Final = 3.0
_STEEP: Final = 0.9  # nearer to the zenith, every edge is nearly upright
_SECTORS: Final = 12
_MOST_SECTORS: Final = 6
_CLEARLY: Final = 1.25  # minimum ratio of the sums, which in woods and crowds differ by chance


@dataclass(frozen=True, slots=True)
class Levelling:
    """The levelling of a bracket.

    Attributes:
        rotation: (3, 3) float64. Rotation for `sphere.remap_frame` and `rotate_light`, or None if
            the bracket is level or its tilt is unknown.
    """

    rotation: Float64 | None = None
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    remark: Levelled | None = None


def levelling(
    bracket: Bracket,
    first_rotation: Float64 | None = None,
    picture: Bytes | None = None,
) -> Levelling:
    """Decide how to level a bracket, based on the poses and the maker notes of its frames.

    There is no rotation for pictures that are not panoramas, that record no pose or only zeros, or
    that the camera has already levelled.

    Args:
        first_rotation: (3, 3) float64. Rotation that `align` applies to the frame at `first_shot`,
            or None. The pose belongs to that frame, while the levelling is applied to the reference
            frame.
        picture: (h, w, 3) uint8. Small copy of the reference frame in encoded RGB, or None. If the
            meaning of the angles makes a difference and the copy's upright edges are clear, they
            decide the meaning. Otherwise, it depends on the camera's manufacturer.
    """
    if not bracket.panorama:
        return Levelling()
    shot = bracket.frames[first_shot(bracket)]
    pose = shot.pose
    if pose is None or max(abs(pose.pitch_deg), abs(wrap(pose.roll_deg))) < _LEVEL_DEG:
        return Levelling()
    if _corrected(shot, bracket.frames):
        remark = Levelled(shot.path.name, pose.pitch_deg, pose.roll_deg, by_camera=True)
        return Levelling(remark=remark)
    readings = _readings(pose, shot.camera)
    if first_rotation is not None:
        # Remove the heading, which would only be a small movement between two shots.
        readings = [_ahead(reading @ first_rotation.T) for reading in readings]
    matrix = readings[0] if picture is None else _most_upright(readings, picture)
    remark = Levelled(shot.path.name, pose.pitch_deg, pose.roll_deg)
    return Levelling(matrix, pose.pitch_deg, pose.roll_deg, remark)


def first_shot(bracket: Bracket) -> int:
    """Return the index of the first shot, considering only frames with a pose if there are any.

    Frames are ordered by file name, with numbers compared by value, because cameras number their
    shots but their clocks count only whole seconds.
    """
    frames = bracket.frames
    return min(range(len(frames)), key=lambda k: (frames[k].pose is None, _order(frames[k])))


def tilt_rotation(pose: XmpPose, *, gravity: bool = True) -> Float64:
    """Return the rotation, (3, 3), that levels a tilted panorama with its front at azimuth 0.

    The rotation maps directions in the tilted panorama to directions in the level one. The heading
    is not used.

    Args:
        gravity: Whether the angles are accelerometer readings for separate axes, as recorded by a
            Theta. If not, they follow the GPano standard.

    Examples:
        >>> from app.core.measure.read.frame import XmpPose
        >>> level = tilt_rotation(XmpPose(pitch_deg=-29.0, roll_deg=-35.8))
        >>> [round(float(part), 4) for part in level[1]]
        [-0.5335, 0.7397, -0.41]
    """
    pitch = pose.pitch_deg
    if gravity and abs(pitch) < 90.0:
        pitch, roll = math.radians(pitch), math.radians(pose.roll_deg)
        pitch = math.degrees(math.atan(math.tan(pitch) * abs(math.cos(roll))))
    return rotation(0.0, pitch, pose.roll_deg)


def _readings(pose: XmpPose, camera: str) -> list[Float64]:
    """Return the possible readings of the angles as rotations, likeliest first."""
    standard, gravity = tilt_rotation(pose, gravity=False), tilt_rotation(pose)
    swapped = _ahead(rotation(0.0, 0.0, pose.roll_deg) @ rotation(0.0, pose.pitch_deg))
    if "THETA" in camera.upper():
        return [gravity, standard, swapped]
    return [standard, gravity, swapped]


def _ahead(matrix: Float64) -> Float64:
    """Remove the heading from a rotation, keeping the centre column at azimuth 0."""
    return rotation(-angles_of(matrix)[0]) @ matrix


def _most_upright(readings: list[Float64], picture: Bytes) -> Float64:
    """Choose the reading that makes the picture's edges upright, or the first one by default.

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
    # Edges all around must agree, since those of a single object may lean.
    wins = int((scores[best] > scores[0]).sum())
    return readings[best if totals[best] > _CLEARLY * totals[0] and wins >= _MOST_SECTORS else 0]


def _order(frame: Frame) -> tuple[tuple[int, str], ...]:
    parts = re.findall(r"\d+|\D+", frame.path.name.casefold())
    return tuple((int(part), "") if part.isdecimal() else (-1, part) for part in parts)


def _corrected(shot: Frame, frames: Sequence[Frame]) -> bool:
    """Return whether the camera levelled a shot, judging by other frames if it is not recorded."""
    if shot.zenith_corrected is not None:
        return shot.zenith_corrected
    return any(frame.zenith_corrected for frame in frames)
