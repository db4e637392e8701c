"""Exposure, tone mapping and scaling of pictures and panoramas for display."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from app.core.base import colour
from app.core.base.arrays import Float64
from app.core.base.colour import FloatImage, smallest_channel
from app.core.base.sphere import bounded
from app.core.environment.environment import Environment

WELL: Final = (0x2B, 0x2B, 0x2B)
"""Neutral grey behind every picture, as sRGB bytes."""

_GREY_LEVEL: Final = 0.52
_WIDEST: Final = 4096
_BAND_ROWS: Final = 256


def greyed(display: FloatImage) -> FloatImage:
    """Grey out the picture of a style that is out of reach.

    Args:
        display: (H, W, 3) float32. sRGB in the range 0 to 1, on the background grey.

    Returns:
        (H, W, 3) float32. sRGB in the range 0 to 1. The background grey is unchanged.
    """
    grey = colour.luminance(display)[..., np.newaxis]
    well = np.float32(WELL[0] / 255.0)
    # Only values brighter than the background are dimmed, so that the head stays visible.
    dimmed = np.minimum(grey, well) + np.maximum(grey - well, 0.0) * _GREY_LEVEL
    return np.repeat(dimmed, 3, axis=2).astype(np.float32)


def panorama(environment: Environment, turn_deg: float, size: tuple[int, int]) -> FloatImage:
    """Render a panorama with an azimuth in the centre column.

    Args:
        environment: Light of the place. For this picture only, repaired texels are filled from
            their neighbours, since a black ring around every lamp would be distracting.
        turn_deg: Azimuth in the centre, in degrees.
        size: Number of rows and columns of the result.

    Returns:
        (rows, columns, 3) float32. sRGB in the range 0 to 1.
    """
    radiance = bounded(environment.radiance, _WIDEST)
    if environment.repairs.total:
        radiance = _filled(radiance)
    rolled = np.roll(radiance, -round(turn_deg / 360.0 * radiance.shape[1]), axis=1)
    gain = colour.panorama_exposure(colour.luminance(rolled))
    # Work in bands, since the steps take ten times the memory of their input.
    bands = np.array_split(rolled, max(len(rolled) // _BAND_ROWS, 1))
    return scaled(np.concatenate([colour.tone_map(band, gain) for band in bands]), size)


def _filled(radiance: FloatImage) -> FloatImage:
    """Replace texels that contain a zero with the mean of the lit texels around them."""
    dark = smallest_channel(radiance) <= 0.0
    weight = np.repeat(~dark[..., np.newaxis], 3, axis=2).astype(np.float32)
    around = (7, 7)
    total = cv2.boxFilter(radiance * weight, -1, around, normalize=False)
    count = cv2.boxFilter(weight, -1, around, normalize=False)
    mean = total / np.maximum(count, 1.0)
    return np.asarray(np.where(dark[..., np.newaxis], mean, radiance).astype(np.float32))


def scaled(display: FloatImage, size: tuple[int, int]) -> FloatImage:
    """Scale a picture, (h, w, 3) float32 sRGB from 0 to 1, to a size given in rows and columns."""
    rows, columns = size
    if rows <= display.shape[0]:
        resized = cv2.resize(display, (columns, rows), interpolation=cv2.INTER_AREA)
    else:
        tall = _stretched(display, rows).swapaxes(0, 1)
        resized = _stretched(tall, columns).swapaxes(0, 1)
    return np.asarray(np.clip(resized, 0.0, 1.0).astype(np.float32))


def mitchell(away: Float64) -> Float64:
    """Return the weights of the Mitchell-Netravali filter at distances in pixels.

    The filter extends over two pixels on each side, and the four weights around any position sum to
    1. It is smooth and leaves hardly any fringe, whereas OpenCV's cubic filter draws a dark line
    around every bright head.
    """
    near = (7.0 * away**3 - 12.0 * away**2 + 16.0 / 3.0) / 6.0
    far = (-7.0 / 3.0 * away**3 + 12.0 * away**2 - 20.0 * away + 32.0 / 3.0) / 6.0
    return np.where(away < 1.0, near, far)


def _stretched(picture: FloatImage, rows: int) -> FloatImage:
    """Stretch a picture to a larger number of rows."""
    count = picture.shape[0]
    where = (np.arange(rows) + 0.5) * count / rows - 0.5
    first = np.floor(where).astype(int)
    result = np.zeros((rows, *picture.shape[1:]), np.float32)
    # At every position the four weights sum to 1.
    for index in (first - 1, first, first + 1, first + 2):
        weights = mitchell(np.abs(where - index)).astype(np.float32)
        result += weights[:, np.newaxis, np.newaxis] * picture[np.clip(index, 0, count - 1)]
    return result
