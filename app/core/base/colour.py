"""Colour and tone: luminance, the sRGB curve, exposure and tone mapping.

All internal values are linear light with Rec. 709 primaries. Only pictures that are displayed, such
as those in PNG files, pass through `tone_map`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, Final, TypeAlias, TypeVar

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.core.base.arrays import Bytes, Float32, Float64

FloatImage: TypeAlias = Float32
"""Float32 array of linear light or of display values in 0..1. The shape is stated at each use."""

_Value = TypeVar("_Value", bound=np.number[Any])

LUMINANCE_WEIGHTS: Final[tuple[float, float, float]] = (0.2126, 0.7152, 0.0722)
"""Weights of linear red, green and blue in the luminance (ITU-R BT.709-6, item 3.2).

They are defined only here. The header of a transport repeats them for readers of the file.
"""

SKIN_LEVEL: Final = 0.34
"""Linear display luminance of an evenly lit face (sRGB 0.62)."""

SHOULDER_START: Final = 0.55
"""Linear value up to which `shoulder` leaves pictures unchanged. Display white is 1."""

REC709: Final = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""The x and y chromaticities of red, green, blue and white (ITU-R BT.709-6, item 1.3)."""

FADE: Final = 2.0
"""Linear display value, above `SHOULDER_START`, at which a colour has faded halfway to white."""
_BRADFORD: Final = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
_BAND_ROWS: Final = 512
# ACES' blue and some cameras' primaries lie outside the visible colours, but not this far
_FARTHEST_XY: Final = 10.0
_LEAST_Y: Final = 1e-4
_BRIGHT_LEVEL: Final = 0.6
# Glints on the eyes are far brighter than the skin and must not decide the exposure.
_GLINT_PERCENTILE: Final = 99.0


def luminance(rgb: ArrayLike) -> FloatImage:
    """Return the luminance of linear red, green and blue.

    Args:
        rgb: array_like, (..., 3). Linear Rec. 709 radiance or picture, on any scale.

    Returns:
        Float32, (...). Luminance on the same scale.

    Raises:
        ValueError: If the last axis does not have length 3.

    Examples:
        >>> round(float(luminance([0.0, 1.0, 0.0])), 4)
        0.7152
    """
    values = np.asarray(rgb, dtype=np.float32)
    if values.ndim == 0 or values.shape[-1] != 3:
        raise ValueError(f"luminance needs three channels in the last axis, not {values.shape}")
    result: FloatImage = np.asarray(values @ np.asarray(LUMINANCE_WEIGHTS, dtype=np.float32))
    return result


def rec709_from(chromaticities: Sequence[float]) -> Float64:
    """Return the matrix that converts linear colours from other primaries to Rec. 709.

    White stays white. The primaries are converted as in SMPTE RP 177-1993, section 3.3, and the
    white points are adapted in Bradford's cone space (ICC.1:2022, annex E).

    Args:
        chromaticities: The x and y of red, green, blue and white: eight numbers in all.

    Returns:
        (3, 3) float64. The matrix, which multiplies column vectors of red, green and blue.

    Raises:
        ValueError: If the chromaticities do not define a colour space.
    """
    source, white = _xyz_from(chromaticities)
    target, target_white = _xyz_from(REC709)
    cones = np.diag((_BRADFORD @ target_white) / (_BRADFORD @ white))
    adapted = np.linalg.inv(_BRADFORD) @ cones @ _BRADFORD
    return np.asarray(np.linalg.inv(target) @ adapted @ source)


def to_rec709(light: FloatImage, chromaticities: Sequence[float]) -> None:
    """Convert linear colours, (H, W, 3), from other primaries to Rec. 709, in place."""
    matrix = rec709_from(chromaticities).T.astype(np.float32)
    for first in range(0, len(light), _BAND_ROWS):
        band = light[first : first + _BAND_ROWS]
        with np.errstate(invalid="ignore", over="ignore"):
            band[:] = band @ matrix


def _xyz_from(chromaticities: Sequence[float]) -> tuple[Float64, Float64]:
    """Return the XYZ of the primaries, one per column, and the XYZ of white, whose Y is 1."""
    xy = np.asarray(chromaticities, np.float64)
    if xy.shape != (8,) or not np.isfinite(xy).all() or np.abs(xy).max() > _FARTHEST_XY:
        raise ValueError("chromaticities must be eight plausible numbers")
    x, y = xy.reshape(4, 2).T
    if abs(y[3]) < _LEAST_Y:
        raise ValueError("white has no luminance")
    columns = np.stack([x, y, 1.0 - x - y])
    if abs(np.linalg.det(columns[:, :3])) < _LEAST_Y:
        raise ValueError("the primaries lie on a line")
    white = columns[:, 3] / y[3]
    scale = np.linalg.solve(columns[:, :3], white)
    if scale.min() <= 0.0:
        raise ValueError("white is not between the primaries")
    return columns[:, :3] * scale, white


def srgb_encode(linear: ArrayLike) -> FloatImage:
    """Apply the sRGB curve (IEC 61966-2-1) to linear light.

    Args:
        linear: array_like, any shape. Linear light. Values outside 0..1 are clipped.

    Returns:
        Float32, same shape. Display values in 0..1.

    Examples:
        >>> round(float(srgb_encode(0.18)), 3)
        0.461
    """
    x = np.clip(np.asarray(linear, dtype=np.float32), 0.0, 1.0)
    result: FloatImage = np.where(
        x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055
    ).astype(np.float32)
    return result


def srgb_decode(encoded: ArrayLike) -> FloatImage:
    """Invert the sRGB curve of `srgb_encode`.

    Args:
        encoded: array_like, any shape. Display values. Those outside 0..1 are clipped.

    Returns:
        Float32, same shape. Linear light in 0..1.
    """
    x = np.clip(np.asarray(encoded, dtype=np.float32), 0.0, 1.0)
    result: FloatImage = np.where(
        x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4)
    ).astype(np.float32)
    return result


_LIGHT: Final = srgb_decode(np.arange(256) / 255.0)


def srgb_light(codes: Bytes) -> FloatImage:
    """Convert 8-bit sRGB codes, in an array of any shape, to linear light, float32 in 0..1."""
    return look_up(codes, _LIGHT)


def shoulder(linear: ArrayLike) -> FloatImage:
    """Compress highlights: values up to 0.55 stay unchanged, and higher ones approach 1.

    The approach to 1 is exponential. The value and the slope are continuous, so no edge is visible
    where the shoulder starts.

    Returns:
        Float32, same shape. Linear light in 0..1, which never decreases as the input increases.

    Examples:
        >>> [round(float(value), 3) for value in shoulder([0.2, 0.55, 1.0, 100.0])]
        [0.2, 0.55, 0.834, 1.0]
    """
    x = np.maximum(np.asarray(linear, dtype=np.float32), 0.0)
    room = 1.0 - SHOULDER_START
    over = np.maximum(x - SHOULDER_START, 0.0) / room
    result: FloatImage = (np.minimum(x, SHOULDER_START) - room * np.expm1(-over)).astype(np.float32)
    return result


def face_exposure(face_luminance: ArrayLike, level: float = SKIN_LEVEL) -> float:
    """Return the gain that exposes a face for display.

    The fourth-power mean of the luminance becomes `level`. An evenly lit face is shown at `level`;
    a face with only rim light stays dark, with the rim just below white. The plain mean would
    overexpose the rim, and the maximum would follow a glint. Pictures exposed by this rule can be
    compared side by side.

    Args:
        face_luminance: array_like, any shape. Luminance of the face pixels only, on any scale.

    Returns:
        Factor by which to multiply the linear picture, or 1 if the face is black.

    Examples:
        >>> round(face_exposure([2.0, 2.0]), 3)
        0.17
    """
    values = np.asarray(face_luminance, dtype=np.float64).ravel()
    if values.size == 0:
        return 1.0
    values = np.clip(values, 0.0, np.percentile(values, _GLINT_PERCENTILE))
    top = float(values.max())
    if not np.isfinite(top) or top <= 0.0:
        return 1.0
    # Divide by the largest value first, so that very dim and very bright pictures stay in range.
    return float(level / (top * np.mean((values / top) ** 4) ** 0.25))


def panorama_exposure(radiance_luminance: ArrayLike, level: float = 0.20) -> float:
    """Return the gain that shows the middle tone at `level` and most of the panorama below white.

    The middle tone is the geometric mean over the sphere. The gain is lower if more than a fifth of
    the sphere would otherwise be brighter than 0.6, as with a white floor under a black ceiling.

    Args:
        radiance_luminance: array_like, (H, W). Luminance of an equirectangular panorama, on any
            scale.

    Returns:
        Factor by which to multiply the linear panorama, or 1 if the panorama is black.
    """
    # A few thousand texels are enough.
    full = np.asarray(radiance_luminance, dtype=np.float64)
    values = full[:: max(full.shape[0] // 64, 1), :: max(full.shape[1] // 128, 1)]
    elevation = np.pi * ((np.arange(values.shape[0]) + 0.5) / values.shape[0] - 0.5)
    weights = np.broadcast_to(np.cos(elevation)[:, np.newaxis], values.shape).ravel()
    tones = values.ravel()
    order = np.argsort(tones)
    share = np.cumsum(weights[order]) / weights.sum()
    bright = float(tones[order][np.searchsorted(share, 0.8)])
    top = float(tones.max())
    if top <= 0.0:
        return 1.0
    # Raise the blackest texels to this floor, and in a black place all texels except the lamps.
    floor = 1e-3 * (bright if bright > 0.0 else top)
    middle = float(np.exp(np.average(np.log(np.maximum(tones, floor)), weights=weights)))
    return min(level / middle, _BRIGHT_LEVEL / bright) if bright > 0.0 else level / middle


def to_bytes(display: ArrayLike) -> Bytes:
    """Round display values to bytes.

    Args:
        display: array_like, any shape. Display values. Those outside 0..1 are clipped.

    Returns:
        Uint8, same shape. Values in 0..255.
    """
    values = np.clip(np.asarray(display, dtype=np.float32), 0.0, 1.0)
    return (values * 255.0 + 0.5).astype(np.uint8)


def develop(rgb: ArrayLike, gain: float = 1.0) -> FloatImage:
    """Expose linear light for display and compress its highlights without a hue shift.

    The largest channel goes through `shoulder`, and the other two are scaled by the same factor.
    Far above white, the colour fades to white. Compressing each channel separately would turn
    bright skin yellow.

    Args:
        rgb: array_like, (..., 3). Linear Rec. 709 light.

    Returns:
        Float32, (..., 3). Linear display light in 0..1.
    """
    # In double precision, since a huge value times a tiny gain can be an ordinary number.
    product = np.asarray(rgb, dtype=np.float64) * gain
    exposed = np.clip(product, 0.0, 1e4).astype(np.float32)
    largest = exposed.max(axis=-1, keepdims=True)
    level = shoulder(largest)
    over = np.maximum(largest - SHOULDER_START, 0.0)
    white = over / (over + FADE)
    hue = exposed / np.maximum(largest, np.float32(1e-12))
    return np.asarray(level * (hue + (1.0 - hue) * white), dtype=np.float32)


def tone_map(rgb: ArrayLike, gain: float = 1.0) -> FloatImage:
    """Convert linear light to display values by exposure, highlight compression and the sRGB curve.

    Args:
        rgb: array_like, (..., 3). Linear Rec. 709 light.

    Returns:
        Float32, (..., 3). sRGB display values in 0..1.
    """
    return srgb_encode(develop(rgb, gain))


def largest_channel(picture: NDArray[_Value]) -> NDArray[_Value]:
    """Return the largest channel of each pixel, ten times as fast as `max` along the last axis.

    Args:
        picture: (..., 3). Any type of number.

    Returns:
        (...) of the same type.
    """
    largest = np.maximum(picture[..., 0], picture[..., 1])
    return np.asarray(np.maximum(largest, picture[..., 2], out=largest))


def smallest_channel(picture: NDArray[_Value]) -> NDArray[_Value]:
    """Return the smallest channel of each pixel.

    Args:
        picture: As in `largest_channel`.
    """
    smallest = np.minimum(picture[..., 0], picture[..., 1])
    return np.asarray(np.minimum(smallest, picture[..., 2], out=smallest))


def look_up(index: NDArray[Any], table: NDArray[Any]) -> NDArray[Any]:
    """Look up codes in a table.

    Args:
        index: uint8 or uint16, any shape. The codes.
        table: (256,) or (65536,). One entry for each code.

    Returns:
        An array with the shape of `index` and the type of `table`.
    """
    if index.dtype == np.uint8 or wide_tables():
        return np.asarray(cv2.LUT(index, table))
    return np.asarray(table.take(index))


@cache
def wide_tables() -> bool:
    """Return whether OpenCV supports 16-bit lookup tables, which version 5 introduced.

    Such tables are ten times faster than NumPy's `take`.
    """
    try:
        cv2.LUT(np.zeros((1, 1), np.uint16), np.zeros(65536, np.uint8))
    except cv2.error:
        return False
    return True
