"""The effects of a phone or webcam on a picture.

In the order in which they affect light: the lens darkens the corners and blurs, exposure and white
balance scale the linear light, white clips, the sensor and its processing add noise, and JPEG
compresses. Noise is that of the finished picture, in display values, where it is about equal in
dark and bright areas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import srgb_decode, srgb_encode

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]

_MOST_EV: Final = 2.0
_WHITE: Final = (0.8, 1.25)
_MOST_BLUR_PX: Final = 1.5
_MOST_NOISE: Final = 0.04
_JPEG: Final = (50, 95)
_MOST_VIGNETTE: Final = 0.3
_STEPS: Final = 65535  # of linear light; the steepest part of the curve moves by 0.05 byte
_LEAST_BLUR_PX: Final = 0.1
_BASE: Final = 0.04  # of the picture's longer side: smaller structures are detail
_DARK: Final = np.float32(1e-3)  # of white: lower limit of the logarithm
_EDGE: Final = 0.35  # of a difference of brightness that counts as an edge, natural logarithm


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Differences of a picture from the true view.

    Attributes:
        ev: Brighter (positive) or darker, stops.
        white: Gains of red and of blue, in linear light; green is 1.
        blur_px: Standard deviation of the blur by lens and focus, pixels.
    """

    ev: float = 0.0
    white: tuple[float, float] = (1.0, 1.0)
    blur_px: float = 0.0
    noise: float = 0.0
    jpeg: int = 0
    vignette: float = 0.0


CLEAN: Final = Disturbance()
"""No disturbance."""


def random_disturbance(chance: np.random.Generator) -> Disturbance:
    """Draw a phone's disturbance, each part uniformly over its range.

    Returns:
        Exposure within 2 EV, gains 0.8 to 1.25 (uniform in their logarithm), blur to 1.5 px, noise
        to 4 %, JPEG 50 to 95, corners darker by up to 30 %.
    """
    red, blue = np.exp(chance.uniform(np.log(_WHITE[0]), np.log(_WHITE[1]), 2))
    return Disturbance(
        ev=float(chance.uniform(-_MOST_EV, _MOST_EV)),
        white=(float(red), float(blue)),
        blur_px=float(chance.uniform(0.0, _MOST_BLUR_PX)),
        noise=float(chance.uniform(0.0, _MOST_NOISE)),
        jpeg=int(chance.integers(_JPEG[0], _JPEG[1] + 1)),
        vignette=float(chance.uniform(0.0, _MOST_VIGNETTE)),
    )


def disturbed(picture: Bytes, disturbance: Disturbance, chance: np.random.Generator) -> Bytes:
    """Disturb a picture like a phone.

    Args:
        picture: (H, W, 3) uint8. The true view, sRGB.

    Returns:
        (H, W, 3) uint8. sRGB, a new array; with `CLEAN` the same values.
    """
    light = _lit(picture, disturbance)
    if disturbance.vignette > 0.0:
        light *= _corners(picture.shape[0], picture.shape[1], disturbance.vignette)[..., None]
    if disturbance.blur_px >= _LEAST_BLUR_PX:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), disturbance.blur_px), np.float32)
    np.clip(light, 0.0, 1.0, out=light)
    shown = _encoding()[(light * np.float32(_STEPS) + np.float32(0.5)).astype(np.uint16)]
    if disturbance.noise > 0.0:
        grain = chance.standard_normal(shown.shape, np.float32)
        shown = shown + grain * np.float32(disturbance.noise * 255.0)
    finished = np.clip(shown + np.float32(0.5), 0.0, 255.0).astype(np.uint8)
    return _compressed(finished, disturbance.jpeg) if disturbance.jpeg > 0 else finished


def _lit(picture: Bytes, disturbance: Disturbance) -> Float32:
    """Return linear light after exposure and white balance, not yet clipped."""
    gains = np.array([disturbance.white[0], 1.0, disturbance.white[1]]) * 2.0**disturbance.ev
    table = (_decoding()[:, None] * gains).astype(np.float32)
    planes = [table[:, channel][picture[..., channel]] for channel in range(3)]
    return np.stack(planes, axis=-1)


@lru_cache(maxsize=1)
def _decoding() -> Float32:
    """Return the linear light of each byte, (256,) float32."""
    return srgb_decode(np.arange(256) / 255.0)


@lru_cache(maxsize=1)
def _encoding() -> Float32:
    """Return display values, 0 to 255, of linear light in even steps, (65536,) float32."""
    return srgb_encode(np.arange(_STEPS + 1) / _STEPS) * np.float32(255.0)


@lru_cache(maxsize=4)
def _corners(rows: int, columns: int, vignette: float) -> Float32:
    """Return the share of light that arrives, by the squared distance to the centre, (H, W)."""
    x = (np.arange(columns) + 0.5) * 2.0 / columns - 1.0
    y = (np.arange(rows) + 0.5) * 2.0 / rows - 1.0
    span = rows**2 + columns**2
    away = (y[:, None] * rows) ** 2 / span + (x * columns) ** 2 / span
    return (1.0 - vignette * away).astype(np.float32)


def _compressed(picture: Bytes, quality: int) -> Bytes:
    bgr = np.ascontiguousarray(picture[..., ::-1])
    _, code = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR_RGB), np.uint8)


def swept(picture: Bytes, pixels: float) -> Bytes:
    """Blur a picture sideways, like a camera that turns during the exposure.

    Args:
        picture: (H, W, 3) uint8. sRGB.

    Returns:
        (H, W, 3) uint8. sRGB; the same array for a motion of less than a pixel.
    """
    wide = abs(pixels)
    if wide < 1.0:
        return picture
    reach = math.ceil((wide - 1.0) / 2.0)
    kernel = np.ones(2 * reach + 1, np.float32)
    kernel[[0, -1]] = 1.0 - (2 * reach + 1 - wide) / 2.0
    return np.asarray(cv2.filter2D(picture, -1, kernel[None] / kernel.sum()), np.uint8)


def tone_mapped(picture: Bytes, strength: float) -> Bytes:
    """Tone map a picture like a phone's night or HDR mode: shadows up, lights down, crisp details.

    Brightness is split into a smooth base, which keeps its edges, and the detail on it; the base is
    compressed, detail and colour are amplified (Durand and Dorsey, SIGGRAPH 2002).

    Args:
        picture: (H, W, 3) uint8. sRGB.

    Returns:
        (H, W, 3) uint8. sRGB, a new array.
    """
    light = srgb_decode(picture / np.float32(255.0)) + _DARK
    grey = np.asarray(light.mean(axis=2), np.float32)
    tone = np.log(grey)
    sigma = _BASE * max(picture.shape[:2]) / 4.0
    small = cv2.resize(tone, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    smooth = cv2.bilateralFilter(np.asarray(small, np.float32), -1, _EDGE, sigma)
    size = (picture.shape[1], picture.shape[0])
    base = cv2.resize(smooth, size, interpolation=cv2.INTER_LINEAR)
    middle = np.float32(np.median(base))
    shown = middle + (base - middle) * (1.0 - 0.75 * strength) + (tone - base) * (1.0 + strength)
    gain = np.exp(shown) / grey
    colour = (light / grey[..., None]) ** (1.0 + 0.3 * strength)
    mapped = np.clip(colour * (gain * grey)[..., None] - _DARK, 0.0, 1.0)
    return np.asarray(srgb_encode(mapped) * np.float32(255.0) + np.float32(0.5), np.uint8)
