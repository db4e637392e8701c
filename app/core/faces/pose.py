"""Estimate the pose of a head from its landmarks and the lens."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float64
from app.core.faces.finder import Face, face_mesh

_STIFF: Final = (
    *(4, 6, 10, 33, 54, 67, 117, 119, 121, 127, 129, 132, 133, 136, 143, 147, 198, 205),
    *(263, 284, 297, 346, 348, 350, 356, 358, 361, 362, 365, 372, 376, 420, 425),
)
"""Landmarks that do not move with the lips and eyelids."""
USUAL_FOCAL: Final = 1.3
"""Focal length assumed for an unknown lens, relative to the longer side: 47 mm on 24 x 36 mm."""


@dataclass(frozen=True, slots=True)
class HeadPose:
    """The pose of a head relative to the lens, in degrees.

    Attributes:
        yaw_deg: Positive if the face is turned towards the sitter's own left, which is right in the
            picture.
        pitch_deg: Positive if the chin is raised.
        roll_deg: Positive if the head leans towards the right of the picture.
        facing_rotation: (3, 3) float64. Rotation from the head's frame to axes with x to the right
            in the picture, y up, and z towards the lens along the line from the head to the lens.
    """

    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    facing_rotation: Float64


def head_pose(face: Face, size: tuple[int, int], focal_px: float | None = None) -> HeadPose:
    """Fit the canonical face to the landmarks, as seen through the lens.

    Args:
        size: Height and width of the picture, in pixels.
        focal_px: Focal length, in pixels, or None to assume `USUAL_FOCAL`.
    """
    height, width = size
    focal = focal_px or USUAL_FOCAL * max(size)
    lens = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    stiff = list(_STIFF)
    points = face_mesh().points[stiff].astype(np.float64)
    image_points = face.landmarks[stiff, :2].astype(np.float64)
    _, turn, place = cv2.solvePnP(points, image_points, lens, None, flags=cv2.SOLVEPNP_SQPNP)
    _, turn, place = cv2.solvePnP(
        points, image_points, lens, None, turn, place, True, cv2.SOLVEPNP_ITERATIVE
    )
    rotation = np.diag([1.0, -1.0, -1.0]) @ cv2.Rodrigues(turn)[0]
    toward = np.diag([1.0, -1.0, -1.0]) @ place.ravel()
    facing_rotation = _facing(-toward / np.linalg.norm(toward)) @ rotation
    nose, up = facing_rotation[:, 2], facing_rotation[:, 1]
    return HeadPose(
        math.degrees(math.atan2(nose[0], nose[2])),
        math.degrees(math.asin(min(max(nose[1], -1.0), 1.0))),
        math.degrees(math.atan2(up[0], up[1])),
        facing_rotation,
    )


def _facing(toward: Float64) -> Float64:
    """Return the rotation, (3, 3), that points the z axis of the lens's frame from head to lens."""
    across = np.cross([0.0, 1.0, 0.0], toward)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(toward, across), toward])
