"""The place behind the head, out of focus as a portrait lens leaves it."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import FloatImage
from app.core.localization.heading_conversion import BACKGROUND_M
from app.core.solver.portraits import Framing
from app.core.solver.transport import TransportHeader

LENS_M: Final = 0.085
"""Focal length, metres: the usual one for portraits."""
F_NUMBER: Final = 2.0
_EYE_LEVEL: Final = 0.412
"""Where the horizon is, from the top of a transport's picture; heads differ by a hundredth."""
_FINE: Final = 6  # radius of the blur where it is worked out, pixels


def blur_px(slope: float, distance_m: float) -> float:
    """Diameter of the disc that a point of the background becomes, pixels.

    Light of a point b behind what is in focus comes to a lens of aperture A = f / N in a cone that
    is A b / (s + b) wide at the sitter, s from the lens, by similar triangles (H. M. Merklinger,
    The INs and OUTs of Focus, 1992, calls it the disk of confusion).

    Args:
        slope: Tangent of the angle that one pixel covers.
        distance_m: From the lens to the sitter, s.
    """
    wide_m = LENS_M / F_NUMBER * BACKGROUND_M / (distance_m + BACKGROUND_M)
    return wide_m / (distance_m * slope)


def background(
    panorama: FloatImage, facing_deg: float, frame: Framing, camera: TransportHeader
) -> Float32:
    """Show the place behind a sitter, as much of it as a framed picture of the head looks at.

    Behind the sitter is azimuth facing + 180, and what the panorama has to the right of that is at
    the right. The picture has the perspective of the head's own camera: it is the middle third of
    what an 85 mm lens sees on an upright frame of 24 x 36 mm, 8 of 24 degrees. That camera stands
    in front of the probe's place, so it sees more of the panorama than its own angle: see
    `widened_fov` in `app.core.localization.heading_conversion`, here for the same `BACKGROUND_M`.
    Lamps become discs, as all is linear; it is blurred while it is small, and then enlarged.

    Args:
        panorama: (H, 2 H, 3) float32. Linear radiance.
        facing_deg: Azimuth in it that the sitter faces, deg.

    Returns:
        (h, w, 3) float32. Linear, in the panorama's unit.
    """
    side = frame.picture / frame.room
    slope = 2.0 * math.tan(math.radians(camera.fov_deg) / 2.0) / side * frame.step
    blur = blur_px(slope, camera.distance_m)
    fine = max(blur / (2 * _FINE), 1.0)
    down, across = (
        (np.arange(-_FINE, count + _FINE) + 0.5) * whole / count
        for whole, count in ((each, math.ceil(each / fine)) for each in frame.size)
    )
    level = ((frame.room - 1.0 + _EYE_LEVEL) * side - frame.top) / frame.step
    middle = (0.5 * frame.picture - frame.left) / frame.step
    wide = slope * (camera.distance_m + BACKGROUND_M) / BACKGROUND_M
    right, up = (across - middle) * wide, ((level - down) * wide)[:, np.newaxis]
    azimuth = np.degrees(np.arctan(right)) + facing_deg + 180.0
    elevation = np.degrees(np.arctan(up / np.hypot(right, 1.0)))
    height, width = panorama.shape[:2]
    row = ((0.5 - elevation / 180.0) * height - 0.5).astype(np.float32)
    column = ((azimuth / 360.0 + 0.5) % 1.0 * width - 0.5).astype(np.float32)
    columns = np.ascontiguousarray(np.broadcast_to(column, row.shape))
    taken = cv2.remap(panorama, columns, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    blurred = cv2.filter2D(taken, -1, _disc(round(blur / fine / 2, 2)))
    inside = blurred[_FINE:-_FINE, _FINE:-_FINE]
    return np.asarray(cv2.resize(inside, frame.size[::-1], interpolation=cv2.INTER_LINEAR))


@lru_cache(maxsize=8)
def _disc(radius: float) -> Float32:
    """A disc of sum 1 with a soft edge."""
    along = np.arange(-_FINE, _FINE + 1)
    away = np.hypot(along, along[:, np.newaxis])
    disc = np.clip(radius + 0.5 - away, 0.0, 1.0)
    return np.asarray(disc / disc.sum(), np.float32)
