"""Colour and tone: luminance, the sRGB curve, and how linear pictures are shown.

Everything inside the program is linear light with Rec. 709 primaries. Only what a person looks
at (a PNG) passes through `tone_map`.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "LUMINANCE_WEIGHTS",
    "SKIN_LEVEL",
    "FloatImage",
    "face_exposure",
    "luminance",
    "panorama_exposure",
    "shoulder",
    "srgb_decode",
    "srgb_encode",
    "to_bytes",
    "tone_map",
]

FloatImage: TypeAlias = NDArray[np.float32]
"""Array of linear light or of display values in 0..1, float32; shape stated where it is used."""

LUMINANCE_WEIGHTS: Final[tuple[float, float, float]] = (0.2126, 0.7152, 0.0722)
"""Luminance of linear red, green and blue with Rec. 709 primaries (ITU-R BT.709-6, item 3.2).

This is the only place that states them; a transport's header repeats them for the reader.
"""

SKIN_LEVEL: Final = 0.34
"""Linear display luminance that an evenly lit face is exposed to (sRGB 0.62)."""

_SHOULDER_START: Final = 0.55
# Glints on the eyes are brighter than the skin by far and must not decide the exposure.
_GLINT_PERCENTILE: Final = 99.0


def luminance(rgb: ArrayLike) -> FloatImage:
    """Weigh linear red, green and blue to luminance.

    Parameters
    ----------
    rgb : array_like, (..., 3)
        Linear Rec. 709 radiance or picture, any scale.

    Returns
    -------
    NDArray[np.float32], (...)
        Luminance in the same scale.

    Raises
    ------
    ValueError
        When the last axis is not 3 long.

    Examples
    --------
    >>> round(float(luminance([0.0, 1.0, 0.0])), 4)
    0.7152
    """
    values = np.asarray(rgb, dtype=np.float32)
    if values.ndim == 0 or values.shape[-1] != 3:
        raise ValueError(f"luminance needs three channels in the last axis, not {values.shape}")
    result: FloatImage = np.asarray(values @ np.asarray(LUMINANCE_WEIGHTS, dtype=np.float32))
    return result


def srgb_encode(linear: ArrayLike) -> FloatImage:
    """Apply the sRGB curve (IEC 61966-2-1) to linear light.

    Parameters
    ----------
    linear : array_like, any shape
        Linear light; values outside 0..1 are clipped.

    Returns
    -------
    NDArray[np.float32], same shape
        Display values in 0..1.

    Examples
    --------
    >>> round(float(srgb_encode(0.18)), 3)
    0.461
    """
    x = np.clip(np.asarray(linear, dtype=np.float32), 0.0, 1.0)
    result: FloatImage = np.where(
        x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055
    ).astype(np.float32)
    return result


def srgb_decode(encoded: ArrayLike) -> FloatImage:
    """Undo `srgb_encode`.

    Parameters
    ----------
    encoded : array_like, any shape
        Display values; values outside 0..1 are clipped.

    Returns
    -------
    NDArray[np.float32], same shape
        Linear light in 0..1.
    """
    x = np.clip(np.asarray(encoded, dtype=np.float32), 0.0, 1.0)
    result: FloatImage = np.where(
        x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4)
    ).astype(np.float32)
    return result


def shoulder(linear: ArrayLike) -> FloatImage:
    """Compress highlights gently: straight up to 0.55, then an exponential approach to 1.

    Value and slope are continuous, so no edge shows where the shoulder begins.

    Parameters
    ----------
    linear : array_like, any shape
        Linear light, 1 = display white; negative values become 0.

    Returns
    -------
    NDArray[np.float32], same shape
        Linear light in 0..1, never decreasing in the input.

    Examples
    --------
    >>> [round(float(value), 3) for value in shoulder([0.2, 0.55, 1.0, 100.0])]
    [0.2, 0.55, 0.834, 1.0]
    """
    x = np.maximum(np.asarray(linear, dtype=np.float32), 0.0)
    room = 1.0 - _SHOULDER_START
    over = np.maximum(x - _SHOULDER_START, 0.0) / room
    result: FloatImage = (np.minimum(x, _SHOULDER_START) - room * np.expm1(-over)).astype(
        np.float32
    )
    return result


def face_exposure(face_luminance: ArrayLike, level: float = SKIN_LEVEL) -> float:
    """Find the gain that exposes a face for looking at it.

    The fourth-power mean of the luminance is brought to `level`: an even face comes out at
    `level`, and a face that is lit at its rim only stays dark with the rim just below white.
    A mean would bleach the rim, a maximum would follow a glint. Pictures that are exposed by
    this rule may be compared side by side.

    Parameters
    ----------
    face_luminance : array_like
        Luminance of the face pixels only, any shape and scale.
    level : float, optional
        Linear display luminance for an even face.

    Returns
    -------
    float
        Factor for the linear picture; 1 where the face is black.

    Examples
    --------
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
    # Scaled by the top first, so that very dim and very bright pictures neither vanish nor overflow.
    return float(level / (top * np.mean((values / top) ** 4) ** 0.25))


def panorama_exposure(radiance_luminance: ArrayLike, level: float = 0.20) -> float:
    """Find the gain that shows a panorama: its solid-angle-weighted middle tone at `level`.

    Parameters
    ----------
    radiance_luminance : array_like, (H, W)
        Luminance of an equirectangular panorama, any scale.
    level : float, optional
        Linear display luminance of the middle tone.

    Returns
    -------
    float
        Factor for the linear panorama; 1 where it is black.
    """
    values = np.asarray(radiance_luminance, dtype=np.float64)
    weights = np.cos(np.pi * ((np.arange(values.shape[0]) + 0.5) / values.shape[0] - 0.5))
    lit = values > 0.0
    if not lit.any():
        return 1.0
    # The middle tone is a weighted mean of the logarithms, with the blackest texels held up.
    floor = 1e-4 * np.percentile(values[lit], 95)
    logs = np.log(np.maximum(values, floor))
    middle = float(np.exp(np.average(logs.mean(axis=1), weights=weights)))
    return level / middle


def to_bytes(display: ArrayLike) -> NDArray[np.uint8]:
    """Round display values to bytes.

    Parameters
    ----------
    display : array_like, any shape
        Display values in 0..1; what lies outside is clipped.

    Returns
    -------
    NDArray[np.uint8], same shape
        0..255.
    """
    values = np.clip(np.asarray(display, dtype=np.float32), 0.0, 1.0)
    return (values * 255.0 + 0.5).astype(np.uint8)


def tone_map(linear: ArrayLike, gain: float = 1.0) -> FloatImage:
    """Turn linear light into display values: exposure, highlight shoulder, sRGB curve.

    Parameters
    ----------
    linear : array_like, any shape
        Linear Rec. 709 light.
    gain : float, optional
        Exposure, for example from `face_exposure`.

    Returns
    -------
    NDArray[np.float32], same shape
        sRGB display values in 0..1.
    """
    # In double: the product of a very large picture and a very small gain is an ordinary number.
    exposed = np.asarray(linear, dtype=np.float64) * gain
    return srgb_encode(shoulder(np.minimum(exposed, 1e4)))
