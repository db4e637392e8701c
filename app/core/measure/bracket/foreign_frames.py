"""Detect frames in a folder that do not belong to the bracket.

A camera's own HDR picture, a preview, a black picture or one of another scene may be in the same
folder and record the same exposure as one of the frames. If it is merged with the frames, it
distorts the curve and the light. Such a foreign frame can be recognised because the other frames
agree with one another, given one curve and their nominal exposures, whereas it contradicts them
over a large part of the picture at any exposure.

A frame that merely records a wrong exposure is measured (`curve.response`). Motion and slight
changes in the light cause contradictions only in places (`app.core.measure.bracket.deghosting`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.arrays import Bools, Bytes, Float64
from app.core.measure.bracket.contradiction import (
    CLIPPED,
    Predictions,
    Tolerance,
    alike,
    contradiction,
    worst,
)
from app.core.measure.bracket.curve.response import (
    Mode,
    ResponseChoice,
    Stops,
    choose_response,
    srgb_response,
)
from app.core.measure.bracket.remarks import ForeignFrame, Reason

_WIDE: Final = Tolerance(stops=0.5, codes=4.0, toe=4.0, under=1.0, over=0.6, either=True)
"""A tolerance of half a stop, so flickering light or a cloud does not exclude a frame."""

_LOUD: Final = 0.25  # fraction of the picture over which a foreign frame contradicts the others
_QUIET: Final = 0.08  # maximum fraction over which frames of one series do so
_BENT: Final = 0.45  # stops by which a foreign frame's step varies with the level
_STRAIGHT: Final = 0.2  # the same for two frames of one series
_TIMES: Final = 3.0  # factor by which a foreign frame contradicts or bends more than the others
_FITS: Final = 0.05  # maximum remaining stops if one curve fits all frames
_RESIDUAL: Final = 0.15  # maximum remaining stops if one curve fits the others
_NEIGHBOURS: Final = 4
_TRIED: Final = 6  # maximum number of frames for which a curve is recovered
_FARTHEST_STOPS: Final = 6.1
_BLACK: Final = 8
_OPEN: Final = (24, 232)  # codes that are neither black nor clipped
_LEVELS: Final = 12
_MOST_LEVELS: Final = (0.1, 0.9)
_FEWEST: Final = 60  # minimum samples of a level
_LEAST_SHARE: Final = 0.02  # minimum fraction of the pixels that a pair must share
_SAME_PLACE: Final = 0.6  # minimum rank correlation of two frames of one place
_ONE_IN: Final = 3  # at most one in this many frames is foreign


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A file that was left out of a bracket, and the reason."""

    path: Path
    reason: Reason

    @property
    def remark(self) -> ForeignFrame:
        """The remark about this file."""
        return ForeignFrame(self.path.name, self.reason)


@dataclass(frozen=True, slots=True)
class Foreign:
    """A foreign frame, given by its index in the bracket (brightest first), and the reason."""

    frame: int
    reason: Reason


def foreign_frames(
    proxies: Sequence[Bytes], samples: Bytes, choice: ResponseChoice, stops: Stops, mode: Mode
) -> tuple[Foreign, ...]:
    """Return the frames that do not belong to the series.

    No frames are returned if there are fewer than three, or if the others do not agree with one
    another.

    Args:
        proxies: Thumbnails of all frames, (h, w, 3) uint8 each, aligned, brightest first.
        samples: (K, N, 3) uint8. Samples of the same frames.
        choice: Response chosen for these frames.
        stops: Nominal exposures, in stops.
    """
    rest, foreign = list(range(len(proxies))), list[Foreign]()
    pictures = [np.ascontiguousarray(proxy) for proxy in proxies]
    while len(rest) >= 3 and len(foreign) < max(len(pictures) // _ONE_IN, 1):
        series = _FrameSeries(pictures, samples, stops, tuple(rest), choice)
        if series.whole and series.greatest_oddness <= 1.0:
            break
        trials = _trials(series, mode)
        if not trials:
            break
        _, number, choice = max(trials, key=lambda trial: trial[0])
        foreign.append(Foreign(number, _reason(pictures, number, rest)))
        rest.remove(number)
    return tuple(sorted(foreign, key=lambda each: each.frame))


def _trials(series: _FrameSeries, mode: Mode) -> list[tuple[float, int, ResponseChoice]]:
    """Leave out each frame in turn, and return those that contradict the others if these agree.

    A curve is recovered only if sRGB fits none of the sets of remaining frames. In long brackets,
    this is done only for the likeliest frames.

    Returns:
        For each of these frames, the size of the contradiction, the frame's index and the response
        chosen for the others.
    """
    plain = replace(series, choice=replace(series.choice, response=srgb_response()))
    likely = sorted(series.frames, key=lambda number: -plain.oddness(number))
    trials: list[tuple[float, int, ResponseChoice]] = []
    ways: tuple[tuple[Mode, list[int]], ...] = (("srgb", likely), (mode, likely[:_TRIED]))
    for way, numbers in ways:
        if trials:
            break
        for number in numbers:
            others = tuple(each for each in series.frames if each != number)
            picked, stops = series.samples[list(others)], [series.stops[k] for k in others]
            rest = replace(series, frames=others, choice=choose_response(picked, stops, way))
            if rest.sound and rest.excludes(number):
                trials.append((rest.oddness(number), number, rest.choice))
    return trials


@dataclass(frozen=True, slots=True)
class _FrameSeries:
    """Some frames of a bracket with one curve, used to judge how well they and others fit.

    Attributes:
        pictures, samples, stops: Thumbnails, samples and nominal exposures of all frames.
        frames: Indices of the frames in the series.
        choice: Response chosen for `frames` only.
    """

    pictures: Sequence[Bytes]
    samples: Bytes
    stops: Stops
    frames: tuple[int, ...]
    choice: ResponseChoice

    @property
    def table(self) -> Float64:
        """One curve for all frames, (3, 256), or the middle frame's curve if each has its own."""
        table = self.choice.response.table
        return table if table.ndim == 2 else table[len(table) // 2]

    @property
    def whole(self) -> bool:
        """Whether one curve fits the frames with the exposures recorded in their files."""
        if self.choice.tag_errors or self.choice.response.table.ndim > 2:
            return False
        if self.choice.response.name == "sRGB":
            return self.choice.check.agrees
        return self.choice.response.residual_stops < _FITS

    @property
    def sound(self) -> bool:
        """Whether the frames agree, which is always true of two frames with an unknown curve."""
        choice = self.choice
        if not choice.check.possible or choice.tag_errors or choice.response.table.ndim > 2:
            return False
        if choice.response.name == "sRGB":
            agrees = choice.check.agrees
        else:
            agrees = len(self.frames) > 2 and choice.response.residual_stops < _RESIDUAL
        return agrees and all(max(self._pair(*pair)) <= 1.0 for pair in pairwise(self.frames))

    @property
    def greatest_oddness(self) -> float:
        """The largest oddness among the frames, with each pair judged once."""
        pairs = {frame: self._pairs(frame) for frame in self.frames}
        oddness = {pair: max(self._pair(*pair)) for pair in {*chain(*pairs.values())}}
        return max(_median([oddness[pair] for pair in some]) for some in pairs.values())

    def oddness(self, frame: int) -> float:
        """Return how strongly a frame contradicts its neighbours. A value above 1 is unusual."""
        return _median([max(self._pair(*pair)) for pair in self._pairs(frame)])

    def _pairs(self, frame: int) -> list[tuple[int, int]]:
        """Return a frame paired with each of its neighbours, the brighter one first."""
        return [(min(frame, other), max(frame, other)) for other in self._near(frame)]

    def excludes(self, frame: int) -> bool:
        """Return whether a frame outside the series contradicts the series at any exposure."""
        near = self._near(frame)
        if not near:
            return False
        bent = float(np.median([self._bend(*sorted((frame, other))) for other in near]))
        usual = max(self._bend(*pair) for pair in pairwise(self.frames))
        if bent >= max(_BENT, _TIMES * usual):
            return True
        own = {self.stops[frame], self._exposure(frame, near)}
        shares = [np.median([self._share(frame, other, stop) for other in near]) for stop in own]
        quiet = max(
            self._share(one, other, self._stop(one)) for one, other in pairwise(self.frames)
        )
        return bool(min(shares) >= max(_LOUD, _TIMES * quiet))

    def _pair(self, bright: int, dark: int) -> tuple[float, float]:
        """Return the bend and the contradiction of two frames, relative to the usual values."""
        share = self._share(bright, dark, self._stop(bright))
        return self._bend(bright, dark) / _STRAIGHT, share / _QUIET

    def _stop(self, frame: int) -> float:
        """Return the exposure of a frame in stops, corrected if it belongs to the series."""
        if frame in self.frames:
            return self.choice.stops[self.frames.index(frame)]
        return self.stops[frame]

    def _near(self, frame: int) -> list[int]:
        apart = {
            other: abs(self._stop(other) - self.stops[frame])
            for other in self.frames
            if other != frame
        }
        near = [k for k in sorted(apart, key=lambda k: apart[k]) if apart[k] <= _FARTHEST_STOPS]
        return near[:_NEIGHBOURS]

    def _steps(self, bright: int, dark: int) -> tuple[Float64, Float64]:
        """Return the codes of the brighter frame's samples and the stops between the two frames."""
        logs = np.log2(np.maximum(self.table, 1e-9))
        codes, steps = [], []
        for channel in range(3):
            first, second = self.samples[bright, :, channel], self.samples[dark, :, channel]
            both = (first > _OPEN[0]) & (first < _OPEN[1])
            both &= (second > _OPEN[0]) & (second < _OPEN[1])
            codes.append(first[both].astype(np.float64))
            steps.append(logs[channel][first[both]] - logs[channel][second[both]])
        return np.concatenate(codes), np.concatenate(steps)

    def _bend(self, bright: int, dark: int) -> float:
        """Return by how many stops the step between two frames varies with the level."""
        codes, steps = self._steps(bright, dark)
        levels = (codes - _OPEN[0]) * _LEVELS // (_OPEN[1] - _OPEN[0])
        parts = [steps[levels == level] for level in range(_LEVELS)]
        medians = [float(np.median(part)) for part in parts if part.size >= _FEWEST]
        if len(medians) < 3:
            return 0.0
        low, high = np.quantile(medians, _MOST_LEVELS)
        return float(high - low)

    def _exposure(self, frame: int, near: Sequence[int]) -> float:
        """Return the exposure of a frame in stops, as measured against its neighbours."""
        levels = []
        for other in near:
            _, steps = self._steps(frame, other)
            if steps.size >= _FEWEST:
                levels.append(self._stop(other) + float(np.median(steps)))
        return float(np.median(levels)) if levels else self.stops[frame]

    def _share(self, one: int, other: int, stop: float) -> float:
        """Return the fraction of the picture in which two frames cannot show the same scene.

        Args:
            stop: Exposure of the first frame, in stops.
        """
        first, second = self.pictures[one], self.pictures[other]
        pair = (stop, self._stop(other))
        if pair[0] < pair[1]:
            first, second, pair = second, first, (pair[1], pair[0])
        usable = _usable(first, second)
        count = np.count_nonzero(usable)
        if count < _LEAST_SHARE * usable.size:
            return 0.0
        prediction = Predictions(self.table, pair).between(0, 1, _WIDE)
        return (
            float(np.count_nonzero((contradiction(first, second, prediction) > 0) & usable)) / count
        )


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else 0.0


def _usable(bright: Bytes, dark: Bytes) -> Bools:
    """Return a mask of pixels that are neither black in both frames nor clipped in both."""
    black = (worst(bright) <= _BLACK) & (worst(dark) <= _BLACK)
    # In the inverted picture, the smallest channel is the largest.
    white = (worst(~bright) <= 255 - CLIPPED) & (worst(~dark) <= 255 - CLIPPED)
    return np.asarray(~(black | white))


def _reason(pictures: Sequence[Bytes], frame: int, rest: Sequence[int]) -> Reason:
    codes = worst(pictures[frame])
    if float(np.quantile(codes, 0.99)) <= _BLACK:
        return Reason.BLACK
    others = (pictures[number] for number in rest if number != frame)
    if max(alike((pictures[frame], other)) for other in others) < _SAME_PLACE:
        return Reason.OTHER_SCENE
    return Reason.TONE_MAPPED
