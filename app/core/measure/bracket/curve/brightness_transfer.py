"""Match code values between the frames of a bracket.

A response can be recovered or checked from one relation alone: pixels with code `a` in the brighter
frame of a pair have code `b` in the darker one (the brightness transfer function of Grossberg and
Nayar, "Determining the camera response from images: what is knowable?", PAMI 2003). The relation is
estimated robustly from the joint histogram of the two frames, so moving objects do not count. If
the frames are not aligned pixel by pixel, the joint histogram is smeared, so ranks are matched
instead: the n-th brightest pixel in one frame corresponds to the n-th brightest in the other,
wherever it is (section 4 of the same paper).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Bools, Bytes, Float64, Int64

# Below the lower limit, sensor noise and rounding distort the codes. Above the upper limit, ringing
# and noise next to clipped areas do.
_LOWEST: Final = 6
_HIGHEST: Final = 248
_LOWEST_DARK: Final = 1.5
_FEWEST: Final = 3
# Frames farther apart share hardly any well-exposed area, and frames closer together provide no
# information.
_WIDEST_STOPS: Final = 6.1
_NARROWEST_STOPS: Final = 0.15
# The darker code in a well-aligned pair scatters by 1.5 to 3 with JPEG and noise, even for steep
# curves. In frames that are turned by 1 degree or more, it scatters by 4.5 to 13.
_SMEARED: Final = 3.5
# If a tenth of the picture has exactly one colour, it was filled in, like the grey that decoders
# put in place of the missing end of a file. A flat wall that is lost as well would not have been
# evidence anyway.
_FILL_SHARE: Final = 0.1
_DARK_MARK: Final = 8
# A black of code 4 or more that does not change over nearly a stop is not part of the picture. Just
# above it, codes reflect flare and grain more than light.
_RAISED: Final = 3
_TELLING_STEP: Final = 0.9
_OVER_BLACK: Final = 6
# From this code on, 0 in the darker frame means a missing part, since sRGB gives 2 even 4 stops
# down.
_NEVER_BLACK: Final = 32
_MOST_PLACES: Final = 24_000

# A row is compared with the 15 rows on either side. Codes that only a moving object has are tens of
# codes off and scatter by 15 or more. The relation itself bends by less than 6 codes and scatters
# by 1 to 3, or three times that where the curve is steep.
_BESIDE: Final = 15
_JUMP: Final = 6.0
_WIDE: Final = 4.0
_WIDE_CODES: Final = 2.0

# In a frame that clips below white, clipped codes scatter this many times more than usual. They
# cover at least this many places, and nearly all of the brighter ones.
_OPEN_ENDED: Final = 2.5
_OPEN_CODES: Final = 3.0
_OPEN_PLACES: Final = 20
_OPEN_SHARE: Final = 0.01
_NEARLY_ALL: Final = 0.8
_DARKEST_WHITE, _LIGHTEST_WHITE = 160, 240
_NO_WHITE: Final = 256

_CODES: Final = np.arange(256)
_POWERS: Final = np.stack([_CODES**0, _CODES, _CODES**2], axis=-1).astype(np.float64)


@dataclass(frozen=True, slots=True)
class CodeMatches:
    """The matching codes in pairs of frames, in R rows, one for each pair, channel and code.

    Attributes:
        bright, dark: Indices of the two frames, where 0 is the brightest frame.
        channel: 0, 1 or 2 for red, green or blue.
        code: Code in the brighter frame, 0 to 255.
        dark_code: Mean code of the same pixels in the darker frame.
        places: Number of pixels that the row is based on.
        scatter: Standard deviation of the code in the darker frame.
        turned: Pairs (brighter, darker) that were matched by rank.
        raised_black: Whether black has a code well above 0, as in film scans.
        whites: The first code of each frame that may be clipped because a local tone curve has
            darkened clipped areas, or 256 if there is none.
    """

    bright: Int64
    dark: Int64
    channel: Int64
    code: Int64
    dark_code: Float64
    places: Float64
    scatter: Float64
    turned: tuple[tuple[int, int], ...] = ()
    raised_black: bool = False
    whites: tuple[int, ...] = ()

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.code)

    def steps(self, stops: Sequence[float]) -> Float64:
        """Return each row's exposure step, (R,), in stops from the darker to the brighter frame."""
        exposure = np.asarray(stops, dtype=np.float64)
        return np.asarray(exposure[self.bright] - exposure[self.dark])

    def where(self, keep: Bools) -> CodeMatches:
        """Return only the rows for which `keep`, (R,), is true."""
        columns = ("bright", "dark", "channel", "code", "dark_code", "places", "scatter")
        return replace(self, **{name: getattr(self, name)[keep] for name in columns})


def frame_pairs(stops: Sequence[float], reach: int = 2) -> list[tuple[int, int]]:
    """List pairs of frames (brighter, darker) 0.15 to 6.1 stops apart, given decreasing `stops`."""
    return [
        (bright, dark)
        for bright in range(len(stops))
        for dark in range(bright + 1, min(bright + reach + 1, len(stops)))
        if _NARROWEST_STOPS < stops[bright] - stops[dark] <= _WIDEST_STOPS
    ]


def match_codes(samples: Bytes, stops: Sequence[float], reach: int = 2) -> CodeMatches:
    """Return the code of the darker frame for each code of the brighter one.

    Args:
        samples: (K, N, 3) uint8. Codes at the same N places in all K frames, brightest first.
        stops: Exposures in decreasing order, in stops. They only determine the pairs.

    Raises:
        ValueError: If `samples` and `stops` do not match.
    """
    if samples.ndim != 3 or samples.shape[2] != 3 or samples.dtype != np.uint8:
        raise ValueError(f"samples must be (K, N, 3) uint8, not {samples.shape} {samples.dtype}")
    if len(stops) != samples.shape[0]:
        raise ValueError(f"{samples.shape[0]} frames need as many stops, not {len(stops)}")
    samples = samples[:, :: max(1, -(-samples.shape[1] // _MOST_PLACES))]
    valid = [~_filled(frame) for frame in samples]
    black = _black_codes(samples, stops)
    least = [float(code + _OVER_BLACK) if code else _LOWEST_DARK for code in black]
    columns: list[Float64] = [np.empty((0, 7))]
    turned: list[tuple[int, int]] = []
    whites = [_NO_WHITE] * len(stops)
    for bright, dark in frame_pairs(stops, reach):
        keep = valid[bright] & valid[dark]
        joint = _joint_histograms(samples[bright][keep], samples[dark][keep])
        means = [_ridge(histogram) for histogram in joint]
        if _smeared(means):
            turned.append((bright, dark))
            means = [_by_rank(histogram) for histogram in joint]
        elif dark == bright + 1:
            whites[bright] = _white(joint[0] + joint[1] + joint[2])
        for number, mean in enumerate(means):
            rows = _continuous(_usable(*mean, least=least[number]))
            head = (bright, dark, number)
            columns.append(np.column_stack([np.tile(head, (len(rows), 1)), rows]))
    table = np.concatenate(columns)
    whole = table[:, :4].astype(np.int64)
    return CodeMatches(
        bright=whole[:, 0],
        dark=whole[:, 1],
        channel=whole[:, 2],
        code=whole[:, 3],
        dark_code=table[:, 4],
        places=table[:, 5],
        scatter=table[:, 6],
        turned=tuple(turned),
        raised_black=any(black),
        whites=tuple(whites),
    )


def _white(histogram: Int64) -> int:
    """Return the first code that scatters widely in the darker frame, or 256 if there is none."""
    places = histogram.sum(axis=1)
    low, high = _quantiles(histogram, (0.16, 0.84))
    usable = (places >= _OPEN_PLACES) & (_CODES >= _LOWEST) & (_CODES <= _HIGHEST)
    usual = usable & (_CODES < _DARKEST_WHITE)
    if not usual.any():
        return _NO_WHITE
    most = _OPEN_ENDED * float(np.median((high - low)[usual])) + _OPEN_CODES
    wide = usable & (_CODES >= _DARKEST_WHITE) & (high - low > most)
    brighter = np.cumsum((places * usable)[::-1])[::-1]
    open_ended = np.cumsum((places * wide)[::-1])[::-1]
    wide &= open_ended > np.maximum(_NEARLY_ALL * brighter, _OPEN_SHARE * places.sum())
    first = int(np.argmax(wide))
    return first if wide[first] and first <= _LIGHTEST_WHITE else _NO_WHITE


def _filled(frame: Bytes) -> Bools:
    """Return a mask, (N,), of the places where a frame has no image content.

    Such places have a pure primary colour, which marks borders (losing a lamp of that colour does
    no harm), or one exact colour that fills a tenth of the frame.
    """
    red, green, blue = frame.T
    least = np.minimum(np.minimum(red, green), blue)
    most = np.maximum(np.maximum(red, green), blue)
    marked = (least <= _DARK_MARK) & (most >= 255 - _DARK_MARK)
    return np.asarray(marked | _one_colour(frame))


def _one_colour(frame: Bytes) -> Bools:
    """Return a mask, (N,), of the places that a decoder filled with one exact colour."""
    green = frame[:, 1]
    counts = np.bincount(green, minlength=256)
    counts[:_LOWEST] = 0
    counts[_HIGHEST:] = 0
    code = int(np.argmax(counts))
    nothing = np.zeros(len(frame), dtype=bool)
    if counts[code] <= _FILL_SHARE * len(frame):
        return nothing
    there = np.flatnonzero(green == code)
    colours = frame[there].astype(np.int64)
    packed = colours[:, 0] * 256 + colours[:, 2]
    values, number = np.unique(packed, return_counts=True)
    if number.max() <= _FILL_SHARE * len(frame):
        return nothing
    nothing[there[packed == values[np.argmax(number)]]] = True
    return nothing


def _black_codes(samples: Bytes, stops: Sequence[float]) -> list[int]:
    """Return the code of black in each channel.

    The code is above 0 if there is flare, in scans, or if blacks are raised. The darkest places in
    the two darkest frames then have the same code, however far apart the frames are. If black is
    not raised, their code decreases by at least a quarter per stop.
    """
    if len(stops) < 2 or stops[-2] - stops[-1] < _TELLING_STEP:
        return [0, 0, 0]
    darkest = np.quantile(samples[-2:, ::4], 0.05, axis=1, method="nearest").astype(np.int64)
    raised = (darkest > _RAISED) & (darkest < 64) & (np.ptp(darkest, axis=0) <= 1)
    return [int(code) for code in np.where(raised.all(axis=0), darkest.max(axis=0), 0)]


def _joint_histograms(bright: Bytes, dark: Bytes) -> list[Int64]:
    """Count places by brighter code (row) and darker code (column), for each channel."""
    both = bright.astype(np.uint16) << 8 | dark
    histograms = [
        np.bincount(both[:, channel], minlength=65536).reshape(256, 256) for channel in range(3)
    ]
    for histogram in histograms:
        histogram[_NEVER_BLACK:, 0] = 0
    return histograms


def _ridge(histogram: Int64) -> tuple[Float64, Float64, Float64]:
    """Return each brighter code's mean darker code, places and scatter, without outliers.

    The mean is taken within twice the interquartile range around the median. A median alone would
    jump by whole codes, and a plain mean would follow moving objects.
    """
    rows = histogram[_LOWEST : _HIGHEST + 1]
    median, low, high = _quantiles(rows, (0.5, 0.25, 0.75))
    width = np.maximum(2.5, 2.0 * (high - low))
    near = rows * (np.abs(_CODES - median[:, np.newaxis]) <= width[:, np.newaxis])
    places, total, squares = (near.astype(np.float64) @ _POWERS).T
    some = np.maximum(places, 1.0)
    mean = total / some
    variance = np.maximum(squares / some - mean**2, 0.0)
    # Even a code that never varies has a rounding error.
    return mean, places, np.sqrt(variance + 1.0 / 12.0)


def _quantiles(rows: Int64, shares: tuple[float, ...]) -> list[Float64]:
    """Return the quantiles of each histogram row, (R,) each, interpolated within a code."""
    running = np.concatenate([[0], np.cumsum(rows)])  # cumulative counts over all rows, end to end
    first = np.arange(len(rows)) * 256
    before, count = running[first], running[first + 256] - running[first]
    results = []
    for share in shares:
        target = before + count * share
        # Rows without places find the end of an earlier row, and are left out later.
        cell = np.clip(np.searchsorted(running, target) - 1, first, first + 255)
        inside = (target - running[cell]) / np.maximum(running[cell + 1] - running[cell], 1)
        results.append(cell - first - 0.5 + inside)
    return results


def _smeared(means: list[tuple[Float64, Float64, Float64]]) -> bool:
    """Return whether the two frames of a pair are not aligned pixel by pixel."""
    scatter = np.concatenate([_usable(*mean)[:, 3] for mean in means])
    return scatter.size > 0 and float(np.median(scatter)) > _SMEARED


def _by_rank(histogram: Int64) -> tuple[Float64, Float64, Float64]:
    """Match the codes of two frames by rank, returning the same values as `_ridge`."""
    places = histogram.sum(axis=1).astype(np.float64)
    middle = np.cumsum(places) - places / 2.0
    edges = np.concatenate([[0.0], np.cumsum(histogram.sum(axis=0, dtype=np.float64))])
    rising = np.concatenate([[True], np.diff(edges) > 0.0])
    codes = np.interp(middle, edges[rising], (np.arange(257) - 0.5)[rising])
    inside = slice(_LOWEST, _HIGHEST + 1)
    return codes[inside], places[inside], np.full(_HIGHEST + 1 - _LOWEST, _SMEARED)


def _usable(
    mean: Float64, places: Float64, scatter: Float64, least: float = _LOWEST_DARK
) -> Float64:
    """Return the reliable rows (code, darker code, places, scatter), (R, 4)."""
    keep = (places >= _FEWEST) & (mean >= least)
    codes = _CODES[_LOWEST : _HIGHEST + 1]
    return np.column_stack([codes, mean, places, scatter])[keep]


def _continuous(rows: Float64) -> Float64:
    """Remove rows that lie off the curve, whose codes hardly occur except in a moving object."""
    if len(rows) <= 2 * _BESIDE:
        return rows
    rows = rows[rows[:, 3] <= _WIDE * np.median(rows[:, 3]) + _WIDE_CODES]
    around = np.pad(rows[:, 1], _BESIDE, mode="reflect", reflect_type="odd")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * _BESIDE + 1)
    off = np.abs(rows[:, 1] - np.median(windows, axis=1))
    return rows[off <= _JUMP + 3.0 * rows[:, 3] / np.sqrt(rows[:, 2])]


def reach(stops: Sequence[float]) -> int:
    """Return how many positions apart the frames of a pair may be, which is 1 in long brackets."""
    return 2 if len(stops) <= 5 else 1
