"""The background of a portrait, blurred as with a portrait lens."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import FloatImage
from app.core.localization.heading_conversion import BACKGROUND_M
from app.core.portrait.exposure import background_exposure
from app.core.portrait.gallery_portraits import Framing, framing
from app.core.solver.transport import TransportHeader

LENS_M: Final = 0.085  # focal length
F_NUMBER: Final = 2.0
# Position of the horizon, from the top of a transport's picture; heads differ by a hundredth.
_EYE_LEVEL: Final = 0.412
_VIEW: Final = (80, 64)  # rows and columns of the view of a background that is measured
_CLEAR: Final = 0.05  # coverage below which a pixel shows the background alone
_FINE: Final = 6  # radius of the blur at its working resolution, in pixels


def blur_px(slope: float, distance_m: float) -> float:
    """Return the diameter of the background's blur disc, in pixels.

    Light from a point at distance b behind the focus plane, which is at distance s from the lens,
    converges in a cone to an aperture A = f / N. By similar triangles, the cone is A b / (s + b)
    wide at the focus plane (the disk of confusion of H. M. Merklinger, The INs and OUTs of Focus,
    1992).
    """
    wide_m = LENS_M / F_NUMBER * BACKGROUND_M / (distance_m + BACKGROUND_M)
    return wide_m / (distance_m * slope)


def background(
    panorama: FloatImage, facing_deg: float, frame: Framing, camera: TransportHeader
) -> Float32:
    """Render the blurred background of a sitter, (h, w, 3), in linear light.

    The background has the perspective of the head's own camera. It is therefore the middle third of
    the lens's view on an upright frame of 24 x 36 mm: 8 of 24 degrees. That camera is in front of
    the probe's position, so its view covers more of the panorama (see `widened_fov` in
    `heading_conversion`). Lamps become discs because the light is linear. The blur is applied at a
    reduced size, and the result is enlarged.

    Args:
        panorama: (H, W, 3). Linear radiance.
        facing_deg: Azimuth that the sitter faces, in degrees.
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
    strip = cv2.remap(panorama, columns, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    blurred = cv2.filter2D(strip, -1, _disc(round(blur / fine / 2, 2)))
    inside = blurred[_FINE:-_FINE, _FINE:-_FINE]
    return np.asarray(cv2.resize(inside, frame.size[::-1], interpolation=cv2.INTER_LINEAR))


def background_gain(
    panorama: FloatImage, facing_deg: float, coverage: FloatImage, camera: TransportHeader
) -> float | None:
    """Return the gain that exposes a picture for its background, or None if that is black.

    Args:
        panorama, facing_deg: As in `background`.
        coverage: (N, N) float32. Fraction of each pixel that the head covers.
    """
    frame = framing(camera.picture, _VIEW)
    view = background(panorama, facing_deg, frame, camera)
    return background_exposure(view[frame.of(coverage[np.newaxis])[0].T < _CLEAR])


@lru_cache(maxsize=8)
def _disc(radius: float) -> Float32:
    """Return a disc with a soft edge whose values sum to 1."""
    along = np.arange(-_FINE, _FINE + 1)
    away = np.hypot(along, along[:, np.newaxis])
    disc = np.clip(radius + 0.5 - away, 0.0, 1.0)
    return np.asarray(disc / disc.sum(), np.float32)
