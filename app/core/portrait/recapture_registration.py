"""A second capture at the same spot, laid on the first by its picture.

Whoever sets a camera down again never sets it down as before. The turn between the two captures is
found from what both show, so that the azimuth where the photographer stands, and every turn marked,
stay where they are in the world.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.sphere import angle_of, angles_of, rotation
from app.core.portrait.panorama_features import features, matched
from app.core.portrait.pose import Pose, find_pose

Bytes: TypeAlias = NDArray[np.uint8]
Float64: TypeAlias = NDArray[np.float64]

# Of all pairs of the 23 places tried, none had more than five seeds; the same place with another
# exposure, noise, blur and yaw had 70 or more.
_LEAST_SEEDS: Final = 14
_LEAST_POINTS: Final = 20
_LEAST_SECTORS: Final = 4
_MOST_ERROR_DEG: Final = 1.0
_MOST_TILT_DEG: Final = 15.0
_MOST_SHIFT_DEG: Final = 7.0
_SHIFTED_DEG: Final = 0.4
_LEAST_FORWARD: Final = 0.85
_TURNED_DEG: Final = 0.5
_TILTED_DEG: Final = 1.0


@dataclass(frozen=True, slots=True)
class Registered:
    """How a second capture lies on the first.

    Attributes
    ----------
    yaw_deg : float
        How far the second camera was turned clockwise (from above) against the first, deg in
        (-180, 180]: what is at azimuth a in the second is at a + yaw in the first. 0 where it
        is not trusted.
    tilt_deg : float
        By how much it leaned differently, deg.
    error_deg : float
        Standard error, deg; infinite where nothing was found.
    shift_deg : float
        Median angle by which things moved because the camera stood elsewhere: 2 deg are some
        7 cm where walls are 2 m away.
    rotation : (3, 3) float64
        Takes directions in the second to directions in the first;
        `app.core.base.sphere.remap_frame` by it lays the second picture on the first. The identity
        where it is not trusted.
    """

    yaw_deg: float
    tilt_deg: float
    error_deg: float
    shift_deg: float
    points: int
    trusted: bool
    words: str
    rotation: Float64 = field(repr=False)

    def carried(self, azimuth_deg: float) -> float:
        """Return where an azimuth of the first capture lies in the second, deg.

        Returns
        -------
        float
            In the second panorama, in (-180, 180].
        """
        return wrap(azimuth_deg - self.yaw_deg)


def register_again(first: Bytes, second: Bytes) -> Registered:
    """Find how a second panorama of a spot lies on the first.

    Parameters
    ----------
    first, second : (h, 2 h, 3) uint8
        SRGB display panoramas of any size. Exposure and light may differ, the yaw be any, the
        tilt small, and the camera stand some centimetres off.

    Returns
    -------
    Registered
        Not trusted where the two show another place, or too little.

    Raises
    ------
    ValueError
        If one is not a panorama in bytes.
    """
    pose = find_pose(*matched(features(first), features(second)))
    if pose is None:
        return _refused(math.inf, 0, 0.0)
    yaw, _, _ = angles_of(pose.rotation)
    tilt = angle_of(rotation(-yaw) @ pose.rotation)
    if not _same_spot(pose, tilt):
        return _refused(pose.error_deg, pose.points, pose.shift_deg)
    yaw = wrap(yaw)
    return Registered(
        yaw_deg=yaw,
        tilt_deg=tilt,
        error_deg=pose.error_deg,
        shift_deg=pose.shift_deg,
        points=pose.points,
        trusted=True,
        words=_words(yaw, tilt, pose),
        rotation=pose.rotation,
    )


def _same_spot(pose: Pose, tilt_deg: float) -> bool:
    return (
        pose.seeds >= _LEAST_SEEDS
        and pose.points >= _LEAST_POINTS
        and pose.sectors >= _LEAST_SECTORS
        and pose.error_deg < _MOST_ERROR_DEG
        and tilt_deg < _MOST_TILT_DEG
        and pose.shift_deg < _MOST_SHIFT_DEG
        and (pose.shift_deg < _SHIFTED_DEG or pose.forward > _LEAST_FORWARD)
    )


def _refused(error_deg: float, points: int, shift_deg: float) -> Registered:
    words = (
        "This does not look like the same spot, so nothing was carried over. "
        "Drag the marker to where the photographer stands."
    )
    return Registered(0.0, 0.0, error_deg, shift_deg, points, False, words, np.eye(3))


def _words(yaw: float, tilt: float, pose: Pose) -> str:
    if abs(yaw) < _TURNED_DEG:
        text = "The same spot, and the camera stands as before"
    else:
        way = "clockwise" if yaw > 0 else "counter-clockwise"
        size = f"{abs(yaw):.0f}°" if abs(yaw) >= 9.95 else f"{abs(yaw):.1f}°"
        text = f"The same spot; the camera was set down {size} further {way}"
    if tilt >= _TILTED_DEG:
        text += f" and leans {tilt:.0f}° differently"
    return f"{text}. Where the photographer stands and all marks are kept."
