"""Merge one band of rows from all frames. This is the inner loop of the merge.

All operations work on whole planes that fit in the cache. OpenCV's look-up tables and products
release the interpreter's lock, so several bands can be merged in parallel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes, Float32, Indices
from app.core.base.colour import look_up, srgb_decode, srgb_encode
from app.core.measure.bracket.weighting import FrameLight
from app.core.measure.read.decoding import Pixels

Plane: TypeAlias = NDArray[Any]

TRUSTED: Final = 0.5
"""Trust below which a frame does not affect whether a pixel counts as clipped in every frame."""

# Weight for a pixel at which no frame is trusted, so small that a trusted frame still decides even
# if it is clipped there.
_LEAST_TRUST: Final = 1e-14
# The brightest code that counts as black, since JPEG changes 0 by one.
_BLACK_SHARE: Final = 1.0 / 255.0
# Codes over which a channel counts as near its end, and a pixel as clipping, for keeping its hue.
_HUE_CODES: Final = (215.0, 248.0)
_CLIPPING_CODES: Final = (248.0, 254.0)
_FLOAT_CLIPPED: Final = 0.9995
# Maximum fraction of pixels near clipping that are weighted separately.
_FEW: Final = 1.0 / 16.0
_FADED: Final = 8.0  # multiple of the level from which lifting black adds less than 0.005%


@dataclass(frozen=True, slots=True)
class Band:
    """A band of merged rows.

    Attributes:
        radiance: Red, green and blue, (rows, W) float32 each.
        clipped, dark: (rows, W) uint8. Masks that are 255 where a pixel is clipped or black,
            respectively, in every frame, or None if there is no such pixel.
        clipped_counts: Number of clipped pixels in each frame.
    """

    radiance: list[Float32] = field(repr=False)
    clipped: Bytes | None = field(repr=False)
    dark: Bytes | None = field(repr=False)
    clipped_counts: list[int]


@dataclass(slots=True)
class Sums:
    """Weighted sums over frames, and masks of pixels that are clipped or black in every frame."""

    values: list[Float32] = field(default_factory=list)
    weights: list[Float32] = field(default_factory=list)
    clipped: Bytes | None = None
    dark: Bytes | None = None

    def add(self, channel: int, value: Float32, weight: Float32, keep: bool) -> None:
        """Add a channel of a frame, leaving both planes unchanged if `keep` is true."""
        if channel < len(self.values):
            cv2.accumulateProduct(value, weight, self.values[channel])
            cv2.accumulate(weight, self.weights[channel])
            return
        product = cv2.multiply(value, weight) if keep else cv2.multiply(value, weight, value)
        self.values.append(np.asarray(product, np.float32))
        self.weights.append(weight.copy() if keep else weight)

    def mark(self, clipped: Bytes | None, dark: Bytes | None, first: bool) -> None:
        """Intersect the masks with those of a frame, or start with the masks of the first frame."""
        self.clipped = clipped if first else _both(self.clipped, clipped)
        self.dark = dark if first else _both(self.dark, dark)

    def means(self) -> list[Float32]:
        """Return the weighted means of the channels, overwriting the sums."""
        return [
            np.asarray(cv2.divide(value, weight, value), np.float32)
            for value, weight in zip(self.values, self.weights, strict=True)
        ]

    def band(self, radiance: list[Float32], counts: list[int]) -> Band:
        """Return the band with these masks and the given radiance."""
        return Band(radiance, _or_none(self.clipped), _or_none(self.dark), counts)


def merge_band(
    bands: Sequence[Pixels], lights: Sequence[FrameLight], trusts: Sequence[Float32 | None]
) -> Band:
    """Merge the same rows of all frames, brightest first.

    Args:
        bands: The rows of each frame, (rows, W, 3) each, as stored.
        trusts: Trust map of each frame, (rows, W) float32, 0 to 1, or None for a frame that is
            trusted everywhere.
    """
    sums = Sums()
    counts = []
    for place, (pixels, light, trust) in enumerate(zip(bands, lights, trusts, strict=True)):
        planes = _planes(pixels)
        largest = cv2.max(cv2.max(planes[0], planes[1]), planes[2])
        smallest = cv2.min(cv2.min(planes[0], planes[1]), planes[2])
        index = _index(largest, light)
        counts.append(clipped_count(index, largest, light))
        clipped, black = spent_pixels(index, largest, light), black_pixels(index)
        faint = look_up(_index(smallest, light), light.tables.faint)
        if trust is not None:
            clipped = distrust(faint, clipped, trust)
        weights = weigh(index, faint, light)
        # Work channel by channel, so that the few planes in use stay in the cache.
        for channel, plane in enumerate(planes):
            weight = weights.of(_index(plane, light))
            sums.add(channel, _value(plane, light, channel), weight, keep=weights.shared)
        sums.mark(clipped, black, first=place == 0)
    radiance = sums.means()
    keep_hue(radiance, planes, largest, light, trust)
    return sums.band(radiance, counts)


def distrust(faint: Float32, clipped: Bytes | None, trust: Float32) -> Bytes:
    """Weight a frame's pixels by trust, counting untrusted pixels as clipped.

    Args:
        faint: (rows, W) float32. Weights of the pixels, which are multiplied in place.
        clipped: (rows, W) uint8. 255 where the frame is clipped, or None if it is clipped nowhere.
        trust: (rows, W) float32. Trust in the frame, 0 to 1.

    Returns:
        (rows, W) uint8. 255 where the frame is clipped or not trusted.
    """
    cv2.multiply(faint, np.maximum(trust, np.float32(_LEAST_TRUST)), faint)
    ignored = np.asarray((trust < TRUSTED) * np.uint8(255))
    return ignored if clipped is None else ignored | clipped


@dataclass(frozen=True, slots=True)
class Weights:
    """The weights of a frame's pixels.

    `whole` applies to all three channels, except near clipping, where each channel has its own
    weight. The pixels near clipping are at the flat positions `near`, or everywhere if `near` is
    None.
    """

    light: FrameLight
    whole: Float32 = field(repr=False)
    near: Indices | None = field(repr=False)
    bright: Float32 = field(repr=False)
    faint: Float32 = field(repr=False)

    @property
    def shared(self) -> bool:
        """Whether all channels have the same weights."""
        return self.near is not None and not self.near.size

    def of(self, index: Plane) -> Float32:
        """Return the weight of a channel according to its own codes."""
        if self.shared:
            return self.whole
        if self.near is not None:
            weight = self.whole.copy()
            own = self.light.tables.own.take(index.take(self.near))
            weight.ravel()[self.near] = np.maximum(own, self.bright) * self.faint
            return weight
        weight = look_up(index, self.light.tables.own)
        cv2.max(self.bright, weight, weight)
        cv2.multiply(weight, self.faint, weight)
        return weight


def weigh(index: Plane, faint: Float32, light: FrameLight) -> Weights:
    """Return the pixels' weights, based on their largest and smallest codes.

    Args:
        index: (rows, W). Largest code of the three channels.
        faint: (rows, W) float32. Weights according to the smallest code of the three channels.
    """
    tables, none = light.tables, np.empty(0, np.intp)
    top = int(index.max())
    if top < tables.full:
        return Weights(light, faint, none, faint, faint)
    near = np.flatnonzero(index >= tables.full)
    if near.size < _FEW * index.size:
        bright = tables.bright.take(index.take(near))
        return Weights(light, faint, near, bright, faint.take(near))
    bright = look_up(index, tables.bright)
    if top < tables.ramp:
        cv2.multiply(bright, faint, bright)
        return Weights(light, bright, none, bright, faint)
    return Weights(light, bright, None, bright, faint)


def _planes(pixels: Pixels) -> Sequence[Plane]:
    if pixels.dtype != np.float32:
        return cv2.split(pixels)
    # Make the light finite and non-negative, whatever a float file contains.
    whole = np.nan_to_num(pixels, nan=0.0, posinf=1e30, neginf=0.0)
    return cv2.split(np.maximum(whole, np.float32(0.0)))


def _index(plane: Plane, light: FrameLight) -> Plane:
    """Return the index of each pixel in the tables."""
    if plane.dtype == np.float32:
        root = np.sqrt(np.minimum(plane * np.float32(1.0 / light.unit), np.float32(1.0)))
        return np.asarray(root * np.float32(65535.0) + np.float32(0.5)).astype(np.uint16)
    return plane


def _value(plane: Plane, light: FrameLight, channel: int) -> Float32:
    if plane.dtype == np.float32:
        return np.asarray(plane * np.float32(light.scale), np.float32)
    return look_up(plane, light.tables.value[channel])


def clipped_count(index: Plane, largest: Plane, light: FrameLight) -> int:
    """Return the number of pixels that a frame clips."""
    mask = _at_end(index, largest, light, light.tables.clipped)
    return 0 if mask is None else cv2.countNonZero(mask)


def spent_pixels(index: Plane, largest: Plane, light: FrameLight) -> Bytes | None:
    """Return a mask, (rows, W) uint8, of pixels that may be clipped (255), or None if empty."""
    return _at_end(index, largest, light, light.tables.spent)


def _at_end(index: Plane, largest: Plane, light: FrameLight, code: int) -> Bytes | None:
    if largest.dtype == np.float32:
        plane, limit = largest, light.unit * _FLOAT_CLIPPED if light.clips else np.inf
    else:
        plane, limit = index, float(code)
    return _compare(plane, limit, cv2.CMP_GE) if plane.max() >= limit else None


def black_pixels(index: Plane) -> Bytes | None:
    """Return a mask, (rows, W) uint8, of black pixels (255), or None if empty."""
    limit = 1.0 if index.dtype == np.uint8 else _BLACK_SHARE * 65535.0
    return _compare(index, limit, cv2.CMP_LE) if index.min() <= limit else None


def _both(first: Bytes | None, second: Bytes | None) -> Bytes | None:
    """Intersect two masks, overwriting the first, or return None if either is empty."""
    if first is None or second is None:
        return None
    return np.asarray(cv2.min(first, second, first), np.uint8)


def _compare(plane: Plane, limit: float, operation: int) -> Bytes:
    # OpenCV's type hints do not allow a number as the second operand.
    return np.asarray(cv2.compare(plane, limit, operation))  # type: ignore[call-overload]


def _or_none(mask: Bytes | None) -> Bytes | None:
    return mask if mask is not None and cv2.countNonZero(mask) else None


def keep_hue(
    radiance: Sequence[Float32],
    planes: Sequence[Plane],
    largest: Plane,
    light: FrameLight,
    trust: Float32 | None,
) -> None:
    """Preserve the hue of lamps where the darkest frame clips.

    A channel that is about to clip carries little more information than a clipped one. Without this
    step, a white lamp with codes 255, 244, 255 would be magenta. Channels are only ever raised, and
    not at all at code 215 or below. A red lamp therefore stays red, and every value remains a lower
    bound.
    """
    near, rises = hue_rises(planes, largest, light, radiance)
    for plane, rise in zip(radiance, rises, strict=True):
        if trust is not None:
            rise *= trust.take(near) >= TRUSTED
        plane.ravel()[near] += rise


def hue_rises(
    planes: Sequence[Plane],
    largest: Plane,
    light: FrameLight,
    radiance: Sequence[Float32] | None = None,
) -> tuple[Indices, list[Float32]]:
    """Return the flat indices of the pixels that `keep_hue` changes, and the rise in each channel.

    Args:
        radiance: Light to raise, or None to raise the frame's own light.
    """
    limit = _raw(_CLIPPING_CODES[0], largest, light)
    if largest.max() < limit:
        return np.empty(0, np.intp), [np.empty(0, np.float32)] * len(planes)
    # Use booleans, since NumPy finds true values in them ten times as fast as in bytes.
    near = np.flatnonzero(largest >= limit)
    codes = [plane.take(near) for plane in planes]
    if radiance is None:
        there = [_value(own, light, channel) for channel, own in enumerate(codes)]
    else:
        there = [plane.take(near) for plane in radiance]
    most = np.maximum(np.maximum(there[0], there[1]), there[2])
    strength = _share(largest.take(near), light, _CLIPPING_CODES)
    shares = [strength * _share(own, light, _HUE_CODES) for own in codes]
    return near, [
        np.asarray(share * (most - value), np.float32)
        for share, value in zip(shares, there, strict=True)
    ]


def lift_black(radiance: Sequence[NDArray[Any]], level: float) -> None:
    """Fade light to the floor of the brightest frame.

    Glare in the lens and the foot of the tone curve hide light below this floor. There, the ratios
    between the channels are only noise, which is visible as coloured speckle. Light well above the
    floor is left unchanged.
    """
    for plane in radiance:
        near = np.flatnonzero(plane < np.float32(_FADED * level))
        if near.size:
            share = plane.take(near) * np.float32(1.0 / level)
            plane.ravel()[near] = np.logaddexp(np.float32(0.0), share) * np.float32(level)


def _codes(values: Plane, light: FrameLight) -> Float32:
    """Convert stored values to codes from 0 to 255."""
    if values.dtype == np.float32:
        codes = srgb_encode(values * np.float32(1.0 / light.unit))
        return np.asarray(codes * np.float32(255.0), np.float32)
    return values * np.float32(1.0 / 257.0)


def _raw(code: float, plane: Plane, light: FrameLight) -> float:
    """Return the stored value for a code from 0 to 255."""
    if plane.dtype == np.float32:
        return light.unit * float(srgb_decode(code / 255.0)) if light.clips else float("inf")
    return round(code if plane.dtype == np.uint8 else 257.0 * code)


def _share(values: Plane, light: FrameLight, limits: tuple[float, float]) -> Float32:
    """Evaluate, at the stored values, a ramp from 0 to 1 between two codes."""
    if values.dtype != np.uint8:
        return _smooth(_codes(values, light), limits)
    return _smooth(np.arange(256, dtype=np.float32), limits).take(values)


def _smooth(codes: Float32, limits: tuple[float, float]) -> Float32:
    """Return a smooth ramp from 0 to 1 between two codes."""
    share = np.clip((codes - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share), np.float32)
