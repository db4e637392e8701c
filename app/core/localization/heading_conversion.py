"""Convert between a camera's heading and the sitter's turn.

A camera that looks at the sitter, with its axis at panorama azimuth h, sees the sitter's face at
a horizontal angle s from that axis. The line from the camera through the sitter then points to h
+ s, the background behind the sitter. The sitter faces the camera, in the opposite direction: turn
= h + s - 180, minus the azimuth of the photographer at turn 0.

A laptop's own camera looks at the person in front of the screen. When the photographer carries the
laptop around the sitter, the camera points away from the sitter, in the direction that the sitter
faces: turn = h. When the photographer is the sitter, the camera does look at the sitter.

The field of view of a camera may be unknown. An object can look larger in the panorama than in the
picture for two reasons. Either the lens is wider than assumed, which enlarges everything by the
same factor, or the camera is further away than the probe was, which enlarges near objects more than
far ones and never shrinks any. If all points are enlarged equally, the cause is therefore the lens.
Otherwise, the farthest points decide, since their distances from the probe and from the camera are
nearly the same. How close they are is unknown. The most likely lens is therefore chosen, because
phones and cameras have only a few lenses.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Float64
from app.core.guidance.who_moves import Mode

ASSUMED_DEG: Final = 60.0
"""Field of view assumed along the longer side of a picture, in degrees."""

_ALIKE: Final = 0.0045  # standard deviation of the factors at the probe's own position
_FARTHEST: Final = 0.10  # fraction of the points that count as far away
_ENLARGEMENT: Final = (
    0.20,
    0.10,
)  # logarithm of the enlargement that these still have: mean and spread
_LENSES: Final = (  # focal length for a frame of 36 x 24 mm, and fraction of all pictures, %
    (26.0, 26), (24.0, 20), (28.0, 16), (23.0, 7), (35.0, 10), (50.0, 13), (13.0, 5), (77.0, 5),
    (31.0, 5), (70.0, 2),
)  # fmt: skip
_SAME_LENS: Final = 0.025  # spread of the logarithm of a lens: rounding, distortion, stabilisation
_OTHER_LENS: Final = 0.05  # density of all other lenses
_FRAME_MM: Final = math.hypot(36.0, 24.0)
_LEFT_AWAY: Final = 0.25  # shrinkage of a wall 7 m away, seen from 1.5 m closer
_FEWEST: Final = 8
_WITHIN: Final = (0.4, 3.5)  # range of lens and parallax together


def assumed_fov(size: tuple[int, int]) -> float:
    """Return the assumed horizontal field of view of a picture, in degrees.

    Args:
        size: Number of columns and rows of the upright picture.
    """
    half = math.tan(math.radians(ASSUMED_DEG) / 2.0) * size[0] / max(size)
    return math.degrees(2.0 * math.atan(half))


def lens_factor(zooms: Float64, shape: float = 4.0 / 3.0, *, away: bool = False) -> float:
    """Return the factor by which a lens is wider than assumed, measured in the picture plane.

    Args:
        zooms: (N,) float64. Enlargement of each point, or NaN where it is undefined.
        shape: Length of the picture's longer side divided by that of the shorter side.
        away: Whether the camera looks away from the sitter. The camera is then nearer to the
            background than the probe was, so near objects look smaller in the panorama, and none
            look larger.
    """
    plausible = zooms[(zooms > _WITHIN[0]) & (zooms < _WITHIN[1])]
    if len(plausible) < _FEWEST:
        return 1.0
    low, middle, high = np.quantile(plausible, [0.25, 0.5, 0.75])
    if away:
        return float(np.quantile(plausible, 1.0 - _FARTHEST)) * (1.0 + _LEFT_AWAY)
    spread = (high - low) / 1.35 / middle
    if spread < _ALIKE:
        return float(middle)
    share = min((spread - _ALIKE) / _ALIKE, 1.0)
    far = _likely_lens(float(np.quantile(plausible, _FARTHEST)), shape)
    return float(math.exp((1.0 - share) * math.log(middle) + share * math.log(far)))


def _likely_lens(farthest: float, shape: float) -> float:
    """Return the most likely lens factor, given the enlargement of the farthest points."""
    enlargement = np.linspace(0.0, 0.8, 401)
    mean, spread = _ENLARGEMENT
    tangents = math.log(farthest * math.tan(math.radians(ASSUMED_DEG) / 2.0)) - enlargement
    density = np.full_like(enlargement, _OTHER_LENS)
    for focal, count in _LENSES:
        expected_log = math.log(_FRAME_MM / 2.0 / focal * shape / math.hypot(shape, 1.0))
        away = (tangents - expected_log) / _SAME_LENS
        density += count / 100.0 * np.exp(-0.5 * away**2) / (_SAME_LENS * math.sqrt(math.tau))
    best = int(np.argmax(np.log(density) - 0.5 * ((enlargement - mean) / spread) ** 2))
    return farthest * math.exp(-float(enlargement[best]))


CAMERA_M: Final = 1.5
"""Default distance from the sitter to the camera, in metres, as for a head-and-shoulders portrait.
"""

BACKGROUND_M: Final = 5.0
"""Distance assumed from the sitter to the background, in metres, as in a large room.

In the demo place, the median distance behind the sitter is 4 to 6 m indoors and 10 to 17 m in the
court.
"""

_WIDEST_DEG: Final = 160.0


class Looks(StrEnum):
    """The subject of a camera: the sitter, or the person holding the camera."""

    SITTER = "sitter"
    PHOTOGRAPHER = "photographer"


def sees_sitter(looks: Looks, mode: Mode) -> bool:
    """Return whether a camera sees the sitter. In a selfie, the photographer is the sitter."""
    return looks is Looks.SITTER or mode is Mode.SELFIE


def turn_of_heading(
    heading_deg: float,
    *,
    looks: Looks = Looks.SITTER,
    mode: Mode = Mode.WALK,
    sitter_deg: float = 0.0,
    front_deg: float = 0.0,
) -> float:
    """Return the turn that corresponds to a camera's heading.

    Args:
        heading_deg: Panorama azimuth of the camera's axis, in degrees.
        sitter_deg: Angle of the sitter's face from the axis, in degrees, positive to the right in
            the unmirrored picture. Ignored if the camera does not see the sitter.
        front_deg: Panorama azimuth of the photographer at turn 0, in degrees.

    Returns:
        The turn, in degrees within (-180, 180].

    Examples:
        >>> turn_of_heading(180.0), turn_of_heading(-90.0), turn_of_heading(170.0, sitter_deg=20.0)
        (0.0, 90.0, 10.0)
        >>> turn_of_heading(30.0, looks=Looks.PHOTOGRAPHER)
        30.0
    """
    if sees_sitter(looks, mode):
        return wrap(heading_deg + sitter_deg - 180.0 - front_deg)
    return wrap(heading_deg - front_deg)


def heading_of_turn(
    turn_deg: float,
    *,
    looks: Looks = Looks.SITTER,
    mode: Mode = Mode.WALK,
    sitter_deg: float = 0.0,
    front_deg: float = 0.0,
) -> float:
    """Return the heading at a turn. This is the inverse of `turn_of_heading`.

    Args:
        turn_deg: Turn, in degrees, positive clockwise.

    Returns:
        The panorama azimuth, in degrees within (-180, 180].
    """
    if sees_sitter(looks, mode):
        return wrap(turn_deg + 180.0 - sitter_deg + front_deg)
    return wrap(turn_deg + front_deg)


def background_azimuth(turn_deg: float, front_deg: float = 0.0) -> float:
    """Return the panorama azimuth of the background behind the sitter, in (-180, 180] degrees.

    Args:
        turn_deg: Turn, in degrees, positive clockwise.
        front_deg: Panorama azimuth of the photographer at turn 0, in degrees.
    """
    return wrap(turn_deg + 180.0 + front_deg)


def offset_angle(column: float, width: int, fov_deg: float) -> float:
    """Return the horizontal angle of a picture column from the camera's axis, in degrees.

    Args:
        column: Position from the left edge, in pixels. The centre of the first pixel is at 0.5.
        width: Number of columns of the picture.
        fov_deg: Horizontal field of view, in degrees within (0, 180).
    """
    share = 2.0 * column / width - 1.0
    return math.degrees(math.atan(share * math.tan(math.radians(fov_deg) / 2.0)))


def widened_fov(
    fov_deg: float,
    camera_m: float = CAMERA_M,
    background_m: float = BACKGROUND_M,
    *,
    sees_the_sitter: bool = True,
) -> float:
    """Return the field of view in the panorama, in degrees, that fills a camera's field of view.

    The probe was at the position of the sitter. The camera is at distance d in front of it, and its
    background is a plane at distance D behind the sitter, perpendicular to the axis. A point in
    that plane at x from the axis is at angle b from the camera, where tan b = x / (D + d), and at
    angle a from the probe, where tan a = x / D. Hence tan a = tan b (D + d) / D: the camera's
    picture is a *wider* crop of the panorama. As both are perspective pictures of one plane, they
    differ only in scale. A camera that looks away from the sitter is closer to its background by d,
    so the factor is (D - d) / D.

    Args:
        fov_deg: The camera's horizontal field of view, in degrees within (0, 180).
        camera_m: Distance d from the sitter's head to the camera, in metres.
        background_m: Distance D from the sitter's head to the background, in metres. It is usually
            unknown, so the default is `BACKGROUND_M`. Infinity leaves the field of view unchanged.
        sees_the_sitter: Whether the camera looks at the sitter.

    Returns:
        The horizontal field of view in the panorama, in degrees, at most 160.

    Examples:
        >>> round(widened_fov(60.0, 1.5, 5.0), 1), widened_fov(60.0, 0.0)
        (73.8, 60.0)
    """
    if camera_m == 0.0 or math.isinf(background_m):
        return min(fov_deg, _WIDEST_DEG)
    away = camera_m if sees_the_sitter else -min(camera_m, 0.8 * background_m)
    factor = (background_m + away) / background_m
    half = math.atan(math.tan(math.radians(fov_deg) / 2.0) * factor)
    return min(2.0 * math.degrees(half), _WIDEST_DEG)
