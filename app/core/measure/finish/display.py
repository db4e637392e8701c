"""Render panoramas for display, with marks for clipping and masks.

The tones are those of `app.core.base.colour.tone_map`, computed band by band. This is fast enough
for a panorama 2,048 pixels wide to keep up with an exposure slider. Pictures here are sRGB bytes.
"""

from __future__ import annotations

from functools import cache
from typing import Final

import cv2
import numpy as np

from app.core.base import colour
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.measure.read.resampling import wrapped_blur

WIDTH: Final = 2048
"""Number of columns in a panorama for display."""

_BAND_ROWS: Final = 32
_STEPS: Final = 32767  # fine enough that the steepest part of the sRGB curve shifts by 0.1 byte
_BRIGHTEST: Final = 1e4
_HATCH: Final = 12  # distance between lines in pixels, at 2,048 columns
_INK: Final = (0x10, 0x10, 0x10)
_PAPER: Final = (0xF5, 0xF5, 0xF5)
MASK_COLOUR: Final = (0x2E, 0x86, 0xC8)
"""The colour of masked areas, in sRGB."""


def display_gain(radiance: FloatImage, exposure_stops: float = 0.0) -> float:
    """Return the display gain for a linear panorama, (H, W, 3), including an offset in stops."""
    # Pick the few thousand texels that the rule itself would use before computing luminance.
    rows = max(radiance.shape[0] // 64, 1)
    columns = max(radiance.shape[1] // 128, 1)
    few = colour.luminance(radiance[::rows, ::columns])
    return float(colour.panorama_exposure(few) * 2.0**exposure_stops)


def display_panorama(
    radiance: FloatImage, exposure_stops: float = 0.0, width: int = WIDTH
) -> Bytes:
    """Convert a linear panorama, (H, W, 3), to sRGB, (rows, width, 3).

    The result differs by at most one step from that of `app.core.base.colour.tone_map` for the same
    texels.

    Args:
        exposure_stops: Stops by which to brighten (positive) or darken (negative) the picture,
            relative to the automatic exposure.
        width: Number of columns. The number of rows follows from the proportions.
    """
    gain = display_gain(radiance, exposure_stops)
    if radiance.shape[1] != width:
        rows = max(round(radiance.shape[0] * width / radiance.shape[1]), 1)
        method = cv2.INTER_AREA if width < radiance.shape[1] else cv2.INTER_LINEAR
        resized = cv2.resize(radiance, (width, rows), interpolation=method)
        radiance = np.asarray(resized, np.float32)
    picture = np.empty(radiance.shape, np.uint8)
    work = np.empty((6, _BAND_ROWS, radiance.shape[1]), np.float32)
    for start in range(0, radiance.shape[0], _BAND_ROWS):
        stop = min(start + _BAND_ROWS, radiance.shape[0])
        _tone_band(radiance[start:stop], gain, work[:, : stop - start], picture[start:stop])
    return picture


def clip_overlay(display: Bytes, clipped: FloatImage, width: int | None = None) -> Bytes:
    """Return a copy of a picture with the clipped areas hatched in black and white.

    The hatched marks are at least two pixels wide, so even a single clipped point is visible.

    Args:
        display: (h, w, 3) uint8. Picture in sRGB.
        clipped: (H, W), of any size with the same proportions. The clipped fraction of each texel,
            0 to 1.
    """
    picture = display.copy()
    size = (display.shape[1], display.shape[0])
    share = cv2.resize(np.asarray(clipped, np.float32), size, interpolation=cv2.INTER_AREA)
    unit = max((width or display.shape[1]) / WIDTH, 0.25)
    wide = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_odd(5 * unit), _odd(5 * unit)))
    marks = cv2.dilate((share > 0.02).astype(np.uint8), wide) > 0
    if not marks.any():
        return picture
    rows, columns = np.nonzero(marks)
    period = max(_HATCH * unit, 4.0)
    white = (rows + columns) % period < period / 2.0
    picture[rows, columns] = np.where(
        white[:, np.newaxis], np.array(_PAPER, np.uint8), np.array(_INK, np.uint8)
    )
    return picture


def mask_overlay(display: Bytes, mask: FloatImage) -> Bytes:
    """Return a copy of a picture with the mask tinted and outlined on it.

    Args:
        display: (h, w, 3) uint8. Picture in sRGB.
        mask: (H, W), of any size with the same proportions. The fraction of the light to remove, 0
            to 1.
    """
    size = (display.shape[1], display.shape[0])
    share = cv2.resize(np.asarray(mask, np.float32), size, interpolation=cv2.INTER_AREA)
    if not (share > 0.0).any():
        return display.copy()
    unit = max(display.shape[1] / WIDTH, 0.25)
    inside = (share >= 0.5).astype(np.float32)
    # The blurred mask is near one half along a line of even width at the edge.
    soft = wrapped_blur(inside, max(1.5 * unit, 1.0))
    line = np.clip(1.2 - np.abs(soft - 0.5) * 3.0, 0.0, 1.0)[..., np.newaxis]
    tint = (0.45 * np.clip(share, 0.0, 1.0))[..., np.newaxis]
    ink = np.asarray(MASK_COLOUR, np.float32)
    picture = display + tint * (ink - display)
    picture += line * (np.asarray(_PAPER, np.float32) - picture)
    return (picture + 0.5).astype(np.uint8)


def _tone_band(band: FloatImage, gain: float, work: FloatImage, out: Bytes) -> None:
    """Apply `colour.tone_map` to a few rows and write the result to `out`.

    `work` is scratch space for six planes. The largest channel determines the factors in
    out = level white + channel (level (1 - white) / largest).
    """
    planes = cv2.split(band, list(work[:3]))
    largest, over, level = work[3], work[4], work[5]
    np.maximum(planes[0], planes[1], out=largest)
    np.maximum(largest, planes[2], out=largest)
    if float(largest.max()) * gain > _BRIGHTEST:
        for plane in (*planes, largest):
            np.minimum(plane, np.float32(_BRIGHTEST / gain), out=plane)
    np.multiply(largest, np.float32(gain), out=largest)
    start, room, fade = colour.SHOULDER_START, 1.0 - colour.SHOULDER_START, colour.FADE
    np.subtract(largest, np.float32(start), out=over)
    np.maximum(over, 0.0, out=over)
    np.multiply(over, np.float32(-1.0 / room), out=level)
    cv2.exp(level, level)
    np.subtract(1.0, level, out=level)
    level *= np.float32(room)
    np.maximum(largest, np.float32(1e-12), out=largest)
    level += np.minimum(largest, np.float32(start))
    level *= np.float32(_STEPS)
    white = np.divide(over, over + np.float32(fade), out=over)
    haze = level * white
    level -= haze
    level *= np.float32(gain)
    factor = np.divide(level, largest, out=level)
    haze += np.float32(0.5)
    for plane in planes:
        plane *= factor
        plane += haze
    cv2.merge([colour.look_up(plane.astype(np.uint16), _curve()) for plane in planes], out)


@cache
def _curve() -> Bytes:
    """Return the sRGB bytes of linear light in steps of 1 / `_STEPS`."""
    steps = np.minimum(np.arange(65536) / _STEPS, 1.0)
    return colour.to_bytes(colour.srgb_encode(steps))


def _odd(size: float) -> int:
    return 2 * round(size / 2.0 - 0.5) + 1
