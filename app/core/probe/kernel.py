"""Merging one band of rows of all frames: the inner loop of the merge.

Everything works on whole planes that stay in the processor's cache, by look-up tables and
products of OpenCV, which let go of the interpreter's lock: several bands run at the same time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.colour import srgb_decode, srgb_encode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.probe.decoding import Pixels
    from app.core.probe.weighting import FrameTables

__all__ = ["Band", "FrameLight", "merge_band"]

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Plane: TypeAlias = NDArray[Any]

# Below this trust a frame has no say in whether a pixel is clipped in every frame.
_TRUSTED: Final = 0.5
# Keeps a pixel at which no frame is trusted from having no weight at all; so little that a trusted
# frame that is clipped there still decides.
_LEAST_TRUST: Final = 1e-14
# The brightest code that counts as black: JPEG moves 0 by one.
_BLACK_SHARE: Final = 1.0 / 255.0
# Codes over which a channel counts as being at its end, and a pixel as clipping, for its hue.
_HUE_CODES: Final = (215.0, 248.0)
_CLIPPING_CODES: Final = (248.0, 254.0)
_FLOAT_CLIPPED: Final = 0.9995


@dataclass(frozen=True, slots=True)
class FrameLight:
    """How one frame's pixels become weights and radiance.

    Attributes
    ----------
    tables : FrameTables
        256 codes for uint8 frames, 65,536 for uint16; for float frames 65,536 places by the
        square root of the value as a share of `unit`.
    scale : float
        Radiance of a float frame's 1.
    unit : float
        Value of a float frame that its tables end at.
    clips : bool
        Whether a float frame is clipped at its unit.
    """

    tables: FrameTables
    scale: float = 1.0
    unit: float = 1.0
    clips: bool = True


@dataclass(frozen=True, slots=True)
class Band:
    """What a band of rows became.

    Attributes
    ----------
    radiance : list[NDArray[np.float32]], three of (rows, W)
        Red, green, blue.
    clipped, dark : NDArray[np.uint8] or None, (rows, W)
        255 where the pixel is clipped (black) in every frame; None where no pixel is.
    clipped_counts : list[int]
        Clipped pixels in each frame.
    """

    radiance: list[Float32] = field(repr=False)
    clipped: Bytes | None = field(repr=False)
    dark: Bytes | None = field(repr=False)
    clipped_counts: list[int]


@dataclass(slots=True)
class _Sums:
    """Weighted sums over the frames so far."""

    values: list[Float32]
    weights: list[Float32]
    clipped: Bytes | None = None
    dark: Bytes | None = None


def merge_band(
    bands: Sequence[Pixels], lights: Sequence[FrameLight], trusts: Sequence[Float32 | None]
) -> Band:
    """Merge the same rows of all frames.

    Parameters
    ----------
    bands : Sequence[Pixels], (rows, W, 3) each
        Rows of each frame, brightest first, as stored.
    lights : Sequence[FrameLight]
        Of the same frames.
    trusts : Sequence[NDArray[np.float32] or None], (rows, W) each
        Trust in each pixel, 0 to 1; None for a frame that is trusted everywhere.

    Returns
    -------
    Band
        Radiance in the lights' scale.
    """
    sums = _Sums([], [])
    counts = []
    for place, (pixels, light, trust) in enumerate(zip(bands, lights, trusts, strict=True)):
        planes = _planes(pixels)
        largest = cv2.max(cv2.max(planes[0], planes[1]), planes[2])
        smallest = cv2.min(cv2.min(planes[0], planes[1]), planes[2])
        index = _index(largest, light)
        clipped, black = _clipped(index, largest, light), _black(index)
        counts.append(0 if clipped is None else cv2.countNonZero(clipped))
        faint = _look_up(_index(smallest, light), light.tables.faint)
        if trust is not None:
            cv2.multiply(faint, np.maximum(trust, np.float32(_LEAST_TRUST)), faint)
            ignored = np.asarray((trust < _TRUSTED) * np.uint8(255))
            clipped = ignored if clipped is None else ignored | clipped
        _add(sums, planes, light, _weigh(index, faint, light), first=place == 0)
        sums.clipped = clipped if place == 0 else _both(sums.clipped, clipped)
        sums.dark = black if place == 0 else _both(sums.dark, black)
    radiance = [
        np.asarray(cv2.divide(value, weight, value), np.float32)
        for value, weight in zip(sums.values, sums.weights, strict=True)
    ]
    _keep_hue(radiance, planes, largest, light, trust)
    return Band(radiance, _or_none(sums.clipped), _or_none(sums.dark), counts)


def _weigh(index: Plane, faint: Float32, light: FrameLight) -> tuple[Float32, Float32 | None]:
    """Weight by the largest code, and by the smallest one where channels have weights of their own.

    Without a second result the first one is the whole weight of all three channels.
    """
    tables, top = light.tables, int(index.max())
    if top < tables.full:
        return faint, None
    bright = _look_up(index, tables.bright)
    if top < tables.ramp:
        cv2.multiply(bright, faint, bright)
        return bright, None
    return bright, faint


def _add(
    sums: _Sums,
    planes: Sequence[Plane],
    light: FrameLight,
    weights: tuple[Float32, Float32 | None],
    first: bool,
) -> None:
    """Add one frame, channel by channel: few planes at a time stay near the processor."""
    bright, faint = weights
    for channel, plane in enumerate(planes):
        weight = bright
        if faint is not None:
            weight = _look_up(_index(plane, light), light.tables.own)
            cv2.max(bright, weight, weight)
            cv2.multiply(weight, faint, weight)
        value = _value(plane, light, channel)
        if first:
            cv2.multiply(value, weight, value)
            sums.values.append(value)
            sums.weights.append(weight.copy() if weight is bright else weight)
        else:
            cv2.accumulateProduct(value, weight, sums.values[channel])
            cv2.accumulate(weight, sums.weights[channel])


def _planes(pixels: Pixels) -> Sequence[Plane]:
    if pixels.dtype != np.float32:
        return cv2.split(pixels)
    # Whatever a float file carries, light is finite and not negative.
    whole = np.nan_to_num(pixels, nan=0.0, posinf=1e30, neginf=0.0)
    return cv2.split(np.maximum(whole, np.float32(0.0)))


def _index(plane: Plane, light: FrameLight) -> Plane:
    """Place of each pixel in the tables."""
    if plane.dtype == np.float32:
        root = np.sqrt(np.minimum(plane * np.float32(1.0 / light.unit), np.float32(1.0)))
        return np.asarray(root * np.float32(65535.0) + np.float32(0.5)).astype(np.uint16)
    return plane


def _look_up(index: Plane, table: Float32) -> Float32:
    if index.dtype == np.uint8:
        return np.asarray(cv2.LUT(index, table))
    return table.take(index)


def _value(plane: Plane, light: FrameLight, channel: int) -> Float32:
    if plane.dtype == np.float32:
        return np.asarray(plane * np.float32(light.scale), np.float32)
    return _look_up(plane, light.tables.value[channel])


def _clipped(index: Plane, largest: Plane, light: FrameLight) -> Bytes | None:
    """Return 255 where the frame is clipped; None where no pixel is."""
    if largest.dtype == np.float32:
        plane, limit = largest, light.unit * _FLOAT_CLIPPED if light.clips else np.inf
    else:
        plane, limit = index, float(light.tables.clipped)
    return _compare(plane, limit, cv2.CMP_GE) if plane.max() >= limit else None


def _black(index: Plane) -> Bytes | None:
    """Return 255 where the frame is black; None where no pixel is."""
    limit = 1.0 if index.dtype == np.uint8 else _BLACK_SHARE * 65535.0
    return _compare(index, limit, cv2.CMP_LE) if index.min() <= limit else None


def _both(first: Bytes | None, second: Bytes | None) -> Bytes | None:
    """Return what two masks share, in the first one's place; None where one of them is empty."""
    if first is None or second is None:
        return None
    return np.asarray(cv2.bitwise_and(first, second, first), np.uint8)


def _compare(plane: Plane, limit: float, operation: int) -> Bytes:
    # The type hints of OpenCV do not know that the second operand may be a number.
    return np.asarray(cv2.compare(plane, limit, operation))  # type: ignore[call-overload]


def _or_none(mask: Bytes | None) -> Bytes | None:
    return mask if mask is not None and cv2.countNonZero(mask) else None


def _keep_hue(
    radiance: list[Float32],
    planes: Sequence[Plane],
    largest: Plane,
    light: FrameLight,
    trust: Float32 | None,
) -> None:
    """Draw channels near their end towards the largest one where the darkest frame clips.

    A channel that is about to clip says little more than one that does: without this a white lamp
    whose codes are 255, 244, 255 would be magenta. Channels are only ever raised, by nothing at
    code 215 and below, so that a lamp which is red stays red, and every value stays a lower bound.
    """
    # Bools, among which what is true is found ten times as fast as among bytes.
    near = np.flatnonzero(largest >= _raw(_CLIPPING_CODES[0], largest, light))
    if not near.size:
        return
    strength = _smooth(_codes(largest.take(near), light), _CLIPPING_CODES)
    if trust is not None:
        strength *= trust.take(near) >= _TRUSTED
    light_there = [plane.take(near) for plane in radiance]
    most = np.maximum(np.maximum(light_there[0], light_there[1]), light_there[2])
    for plane, own, there in zip(radiance, planes, light_there, strict=True):
        share = strength * _smooth(_codes(own.take(near), light), _HUE_CODES)
        plane.ravel()[near] = there + share * (most - there)


def _codes(values: Plane, light: FrameLight) -> Float32:
    """Bring values as stored to codes of 0 to 255."""
    if values.dtype == np.float32:
        codes = srgb_encode(values * np.float32(1.0 / light.unit))
        return np.asarray(codes * np.float32(255.0), np.float32)
    return values * np.float32(1.0 if values.dtype == np.uint8 else 1.0 / 257.0)


def _raw(code: float, plane: Plane, light: FrameLight) -> float:
    """Return the value as stored of a code of 0 to 255."""
    if plane.dtype == np.float32:
        return light.unit * float(srgb_decode(code / 255.0)) if light.clips else float("inf")
    return round(code if plane.dtype == np.uint8 else 257.0 * code)


def _smooth(codes: Float32, limits: tuple[float, float]) -> Float32:
    """Rise from 0 to 1 between two codes, without corners."""
    share = np.clip((codes - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share), np.float32)
