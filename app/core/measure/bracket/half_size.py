"""Merge frames at half size, decoding bright frames at half size and dark ones in full.

A panorama is scaled down after the merge anyway, and a JPEG decoder can compute means of four codes
with half the work. Such a mean loses two things: the light of four pixels is more than the light of
their mean code (because the response is convex), and a clipped pixel disappears among dark ones. A
darker frame that is decoded in full, the **anchor**, reveals both. Where g is the response and z
are the anchor's four codes, the merged light is multiplied by

    mean(g(z)) / g(mean(z))

which for a power law does not depend on the exposure. No frame is taken to be darker than the
brightest of the anchor's four pixels would be in that frame. If only the anchor counts, the product
is exactly the mean light of its four pixels.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes, Float32, Float64, Floats
from app.core.base.colour import look_up
from app.core.base.errors import ProbeError
from app.core.base.progress import Token
from app.core.measure.bracket.merge_band import (
    TRUSTED,
    Band,
    Sums,
    black_pixels,
    clipped_count,
    distrust,
    hue_rises,
    spent_pixels,
    weigh,
)
from app.core.measure.bracket.weighting import FrameLight
from app.core.measure.read.decoding import (
    READ_ROWS,
    FileRows,
    Pixels,
    needs_whole_decode,
    row_bands,
)
from app.core.measure.read.frame import Frame

_TAIL: Final = 64  # number of bytes at the end in which to search for a JPEG's end marker
# Largest step at which an anchor still resolves detail at the upper end of a frame's range, where
# the anchor's codes are about 70.
_REACH_STOPS: Final = 4.1
# Codes by which a pixel must exceed the mean of its group of four to count as hidden, and the
# allowance for noise in an anchor's code.
_STANDS_OUT: Final = 8
_CODE_NOISE: Final = 2
# Light of this code is added to numerator and denominator, so that noise in black does not count.
_DARK_CODE: Final = 3
# Keeps quotients of two blacks finite, in units of a frame's saturation.
_BLACK_LIGHT: Final = 1e-7


def anchors(stops: Sequence[float]) -> tuple[bool, ...]:
    """Return which frames to decode in full: the darkest, and any too far from another anchor.

    >>> anchors([2.0, 0.0, -2.0]), anchors([2.0, 0.0, -2.0, -4.0, -6.0])
    ((False, False, True), (False, True, False, False, True))
    """
    is_anchor = [False] * len(stops)
    lowest = -np.inf
    for index in sorted(range(len(stops)), key=lambda k: stops[k]):
        if stops[index] - lowest > _REACH_STOPS:
            is_anchor[index], lowest = True, stops[index]
    return tuple(is_anchor)


def halvable(frame: Frame) -> bool:
    """Return whether a frame can be decoded at half size because it is a plain, complete JPEG."""
    if frame.kind != "uint8" or frame.shape[0] % 2 or frame.shape[1] % 2:
        return False
    with contextlib.suppress(OSError), frame.path.open("rb") as stream:
        # The file is read as a whole, so its size must not exceed that of its pixels.
        if os.fstat(stream.fileno()).st_size > frame.decoded_bytes:
            return False
        if stream.read(3) != b"\xff\xd8\xff" or needs_whole_decode(frame.path):
            return False
        stream.seek(-_TAIL, os.SEEK_END)
        return stream.read().rstrip(b"\0").endswith(b"\xff\xd9")
    return False


def is_whole(frame: Frame, token: Token) -> bool:
    """Return whether a frame's file can be decoded to the end without an error."""
    with contextlib.closing(FileRows(frame)) as source:
        try:
            for start, stop in row_bands(frame.shape[0], READ_ROWS):
                token.check()
                source.rows(start, stop)
        except ProbeError:
            return False
    return True


@dataclass(frozen=True, slots=True)
class AnchorTables:
    """Tables for an anchor's full-size pixels, indexed by two neighbouring codes as 16 bits.

    Attributes:
        exact: (3, 65536) float32. A quarter of the sum of the two codes' radiances, plus half the
            radiance of `_DARK_CODE`.
        codes: (3, 65536) uint16. Sum of the two codes as they would be in the brightest frame that
            the anchor serves if that frame never clipped. The unit is chosen so that four times the
            maximum fits in 16 bits. The codes follow the response's power law, extended beyond its
            straight foot.
        mean: (3, 65536) float32. Radiance of the mean of four such codes, indexed by their sum.
    """

    exact: Float32 = field(repr=False)
    codes: NDArray[np.uint16] = field(repr=False)
    mean: Float32 = field(repr=False)


@dataclass(frozen=True, slots=True)
class HalfLight:
    """Tables that convert a frame's pixels to weights and radiance at half size.

    Attributes:
        anchor: Index of the frame's anchor.
        reach: (256,) uint8. Minimum code in this frame for each code of the brightest of the
            anchor's four pixels.
    """

    light: FrameLight
    anchor: int
    reach: Bytes = field(repr=False)
    anchor_tables: AnchorTables | None = None


def half_lights(lights: Sequence[FrameLight], whole: Sequence[bool]) -> tuple[HalfLight, ...]:
    """Prepare the tables for the frames, in order from the brightest to the darkest.

    Args:
        whole: Whether each frame is decoded in full, as an anchor.
    """
    raw = [light.tables.value for light in lights]
    # Radiance of the codes of each frame, never 0.
    values = [np.maximum(one, np.float32(_BLACK_LIGHT) * one.max()) for one in raw]
    wholes = [place for place, one in enumerate(whole) if one]
    anchor = [min(wholes, key=lambda k: (k < at, abs(k - at))) for at in range(len(lights))]
    return tuple(
        HalfLight(
            replace(light, tables=replace(light.tables, value=values[at])),
            anchor[at],
            _reach(values[at], values[anchor[at]], own=whole[at]),
            _anchor_tables(values[at], values[anchor.index(at)]) if whole[at] else None,
        )
        for at, light in enumerate(lights)
    )


def _anchor_tables(values: Float32, brightest: Float32) -> AnchorTables:
    """Return an anchor's tables, given its radiance and that of the brightest frame it serves."""
    unit = float(brightest.max())
    step = float(_code(values.max() / unit)) / 16383.0
    codes = np.rint(_code(values / unit) / step).astype(np.uint16)
    means = np.arange(65536) * (step / 4.0)
    # Radiance is exact at the anchor's codes, and between two of them follows the curve.
    mean = [unit * np.interp(means, _code(row / unit), row / unit) for row in values]
    exact = values / np.float32(4.0) + values[:, _DARK_CODE, None] / np.float32(4.0)
    return AnchorTables(_pairs(exact), _pairs(codes), np.array(mean, np.float32))


def _pairs(table: NDArray[Any]) -> NDArray[Any]:
    """Add the entries for two codes, (3, 65536), indexed by both as 16 bits in either order."""
    return np.asarray((table[:, :, None] + table[:, None, :]).reshape(3, -1))


def _code(light: Floats | float) -> Float64:
    """Return the sRGB code (IEC 61966-2-1), continued beyond the curve's ends."""
    linear = np.asarray(light, np.float64)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def _reach(values: Float32, anchor: Float32, own: bool) -> Bytes:
    """Return `HalfLight.reach`, given the radiance of the codes in both frames, (3, 256) each."""
    if own:
        return np.arange(256, dtype=np.uint8)
    indices = [np.searchsorted(values[c], anchor[c]) for c in range(3)]
    codes = np.minimum(np.max(indices, axis=0), 255)
    return np.concatenate([np.zeros(_CODE_NOISE), codes[:-_CODE_NOISE]]).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class _BandReading:
    """One frame's data for a band, at half size.

    Attributes:
        smooth: Light corresponding to the mean codes.
        exact: Mean light of an anchor's four pixels, plus the light of `_DARK_CODE`.
    """

    planes: Sequence[Any]
    largest: Bytes
    hidden: Bytes | None
    clipped: Bytes | None
    count: int
    smooth: Sequence[Float32]
    exact: Sequence[Float32] | None = None


def merge_halved(
    bands: Sequence[Pixels], lights: Sequence[HalfLight], trusts: Sequence[Float32 | None]
) -> Band:
    """Merge the same rows of all frames at half size.

    `Band.clipped` is at half size and gives fractions of the area in units of 1/255.

    Args:
        bands: The rows of each frame, brightest first, (rows, W, 3) uint8, or (2 rows, 2 W, 3) for
            an anchor.
        trusts: The trust map of each frame, (rows, W) float32, or None, as for
            `merge_band.merge_band`.
    """
    peaks: dict[int, Bytes] = {}
    views: dict[int, _BandReading] = {}
    last = len(bands) - 1
    for place, half in enumerate(lights):
        if half.anchor_tables is not None:
            peaks[place], views[place] = _anchor(
                bands[place], half.light, half.anchor_tables, place == last
            )
    sums, detail = Sums(), _Detail(alone=len(views) == 1)
    counts = []
    for place, (half, trust) in enumerate(zip(lights, trusts, strict=True)):
        light = half.light
        view = views.get(place) or _half(bands[place], half, peaks[half.anchor])
        counts.append(view.count)
        clipped = view.clipped
        red, green, blue = view.planes
        faint = look_up(cv2.min(cv2.min(red, green), blue), light.tables.faint)
        if trust is not None:
            clipped = distrust(faint, clipped, trust)
        weights = weigh(view.largest, faint, light)
        for channel, (plane, smooth) in enumerate(zip(view.planes, view.smooth, strict=True)):
            index = plane if view.hidden is None else cv2.max(plane, view.hidden)
            weight = weights.of(index)
            if view.exact is not None:
                dark = np.float32(light.tables.value[channel, _DARK_CODE])
                detail.add(channel, smooth + dark, view.exact[channel], weight, trust)
            sums.add(channel, smooth, weight, keep=weights.shared)
        sums.mark(clipped, black_pixels(view.largest), first=place == 0)
    radiance = [
        np.asarray(cv2.multiply(light, factor, light), np.float32)
        for light, factor in zip(sums.means(), detail.factors(), strict=True)
    ]
    return sums.band(radiance, counts)


class _Detail:
    """The ratio of the true light to the light of the mean codes, as revealed by the anchors."""

    def __init__(self, alone: bool) -> None:
        self.exact, self.smooth = Sums(), Sums()
        self._alone = alone

    def add(
        self, channel: int, smooth: Float32, exact: Float32, weight: Float32, trust: Float32 | None
    ) -> None:
        """Add the data of an anchor, except where it is not trusted."""
        if trust is not None:
            exact = np.where(trust < TRUSTED, smooth, exact)
        if self._alone:  # The weight would cancel out.
            self.exact.values.append(exact)
            self.smooth.values.append(smooth)
            return
        self.exact.add(channel, exact, weight, keep=True)
        self.smooth.add(channel, smooth, weight, keep=True)

    def factors(self) -> list[Float32]:
        """Return the factor for each of the three channels."""
        return [
            np.asarray(cv2.divide(exact, smooth, exact), np.float32)
            for exact, smooth in zip(self.exact.values, self.smooth.values, strict=True)
        ]


def _half(pixels: Pixels, half: HalfLight, peak: Bytes) -> _BandReading:
    """Read a frame that is decoded at half size."""
    planes = cv2.split(pixels)
    light = half.light
    largest, hidden = _with_hidden(planes, np.asarray(cv2.LUT(peak, half.reach)))
    clipped, count = (
        spent_pixels(largest, largest, light),
        4 * clipped_count(largest, largest, light),
    )
    if count and hidden is not None:
        # If some of four pixels are hidden, on average two of them clip.
        count -= 2 * clipped_count(hidden, hidden, light)
    smooth = [look_up(plane, light.tables.value[c]) for c, plane in enumerate(planes)]
    return _BandReading(planes, largest, hidden, clipped, count, smooth)


def _anchor(
    pixels: Pixels, light: FrameLight, tables: AnchorTables, darkest: bool
) -> tuple[Bytes, _BandReading]:
    """Return the largest code in every four pixels of a frame decoded in full, and the reading."""
    full: Sequence[Any] = cv2.split(pixels)
    brightest = np.asarray(cv2.max(cv2.max(full[0], full[1]), full[2]), np.uint8)
    exact = [_of_four(plane, table) for plane, table in zip(full, tables.exact, strict=True)]
    if darkest:
        _keep_hue_of_four(exact, full, brightest, light)
    sums = [_of_four(plane, table) for plane, table in zip(full, tables.codes, strict=True)]
    planes, peak = [_halved(plane) for plane in full], _peak(brightest)
    largest, hidden = _with_hidden(planes, peak)
    mask = spent_pixels(brightest, brightest, light)
    view = _BandReading(
        planes,
        largest,
        hidden,
        None if mask is None else _halved(mask),
        clipped_count(brightest, brightest, light),
        [look_up(plane, table) for plane, table in zip(sums, tables.mean, strict=True)],
        exact,
    )
    return peak, view


def _of_four(plane: Bytes, pairs: NDArray[Any]) -> NDArray[Any]:
    """Sum a table over each group of four pixels, with one look-up for every two pixels."""
    two = look_up(plane.view(np.uint16), pairs)
    return np.asarray(cv2.add(two[::2], two[1::2]))


def _keep_hue_of_four(
    exact: Sequence[Float32], full: Sequence[Bytes], brightest: Bytes, light: FrameLight
) -> None:
    """Apply the effect of `keep_hue` on each of four pixels to the mean of the four."""
    near, rises = hue_rises(full, brightest, light)
    row, column = np.divmod(near, brightest.shape[1])
    place = row // 2 * (brightest.shape[1] // 2) + column // 2
    for plane, rise in zip(exact, rises, strict=True):
        # Use one flat index, with which NumPy adds ten times as fast.
        np.add.at(plane.reshape(-1), place, rise / np.float32(4.0))


def _halved(plane: NDArray[Any]) -> NDArray[Any]:
    """Return the mean of each group of four pixels."""
    size = (plane.shape[1] // 2, plane.shape[0] // 2)
    return np.asarray(cv2.resize(plane, size, interpolation=cv2.INTER_AREA))


def _peak(largest: Bytes) -> Bytes:
    """Return the maximum of each group of four pixels."""
    rows = np.maximum(largest[::2], largest[1::2]).view(np.uint16)
    return np.asarray(np.maximum(rows & 255, rows >> 8), np.uint8)


def _with_hidden(planes: Sequence[Any], reach: Bytes) -> tuple[Bytes, Bytes | None]:
    """Return the largest codes, and a mask of the groups of four that hide a brighter pixel.

    The largest codes are raised in these groups. The mask is None if there are no such groups.
    """
    largest = np.asarray(cv2.max(cv2.max(planes[0], planes[1]), planes[2]), np.uint8)
    stands_out = cv2.compare(cv2.subtract(reach, largest), _STANDS_OUT, cv2.CMP_GT)  # type: ignore[call-overload]
    if not cv2.countNonZero(stands_out):
        return largest, None
    hidden = np.asarray(cv2.bitwise_and(reach, stands_out), np.uint8)
    return np.asarray(cv2.max(largest, hidden), np.uint8), hidden
