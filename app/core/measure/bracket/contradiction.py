"""Whether two frames of a bracket can be of the same thing, pixel by pixel.

Through the camera's response a code of one frame says which codes a brighter frame can have there.
Frames are compared as they are coded, which makes clipped and black codes inequalities by
themselves: what is clipped in the darker frame must be clipped in the brighter one, and what is
black in the brighter one must be black in the darker one. Predicting one frame of a bracket from
another is how Grosch (Fast and Robust High Dynamic Range Image Generation with Camera and Object
Movement, VMV 2006) and Gallo et al. (Artifact-free High Dynamic Range Imaging, ICCP 2009) find what
moved; the tolerances here are those of area means of JPEG pictures.

`disagreeing` finds damaged files. Damage in the coded data of a JPEG goes unnoticed where it still
decodes: from there on blocks are missing or too many, so that the rest of the picture is displaced
sideways, and its colours are off by a constant. What moved, or changed its light, does neither over
the whole width. So strips of rows of two frames are laid on each other at every sideways shift
(circular correlation, which needs no response), and their codes are compared with what the
exposures allow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.measure.bracket.weighting import clipped_code
from app.core.text import tr

_OPEN: Final = (20, 235)  # codes that say how much light there is

CLIPPED: Final = 243
"""A mean of codes over an area that contains nothing but clipped pixels is above this."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far frames may differ that show the same, in stops and codes.

    Proxies are means of coded values, and the curve from one exposure to a brighter one is
    concave. So the brighter frame's mean lies under the prediction wherever the averaged area
    is not even (Jensen's inequality), and hardly ever over it. Measured on 20 scenes, 99.9 % of
    the pixels lie under by no more than 0.66 of the codes' range among the neighbours. `under`
    and `over` are shares of that contrast; the latter is for edges that are not quite aligned.
    `toe` adds codes near black, where noise is cut off.
    """

    stops: float
    codes: float
    toe: float
    under: float
    over: float
    either: bool


LOOSE: Final = Tolerance(stops=0.17, codes=2.5, toe=2.0, under=1.0, over=0.5, either=True)
"""What frames of a still scene do not exceed."""

CLOSE: Final = Tolerance(stops=0.09, codes=2.0, toe=1.5, under=0.6, over=0.3, either=False)
"""What they rarely exceed: for places where something is known to have moved."""

EDGE: Final = Tolerance(stops=0.09, codes=2.0, toe=1.5, under=0.05, over=0.05, either=False)
"""For the pixels next to those: what is left of them at the edge of something that moved."""


@dataclass(frozen=True, slots=True)
class _Prediction:
    """Codes (1, 256, 3) of a brighter frame for each code of a darker one."""

    low: Bytes
    middle: Bytes
    high: Bytes
    tolerance: Tolerance


class Predictions:
    """Predictions between any two frames of a bracket, made when they are needed.

    `table`, (3, 256) or (K, 3, 256) float64, is the linear light of each code, monotone, in all
    frames or in each; `stops` their exposures.
    """

    def __init__(self, table: Float64, stops: Sequence[float], slack: float = 0.0) -> None:
        ramp = np.arange(256) * 1e-9  # flat parts of a table still need an inverse
        rising = np.maximum.accumulate(np.asarray(table, np.float64), axis=-1)
        rising = rising / rising[..., -1:] + ramp
        self._tables = rising if rising.ndim == 3 else np.stack([rising] * len(stops))
        self._alike = rising.ndim == 2
        self.stops = tuple(stops)
        self._slack = slack
        # White that a local tone curve has darkened counts as clipped from there on.
        self._clipped = [CLIPPED - (254 - clipped_code(one)) for one in self._tables]
        self._made: dict[tuple[float, int, int, Tolerance], _Prediction] = {}

    def between(self, bright: int, dark: int, tolerance: Tolerance) -> _Prediction:
        """Predict frame `bright` from frame `dark`; the first frame is 0, the brightest."""
        step = round(self.stops[bright] - self.stops[dark], 6)
        key = (step, 0, 0, tolerance) if self._alike else (step, bright, dark, tolerance)
        if key not in self._made:
            wider = replace(tolerance, stops=tolerance.stops + self._slack)
            clipped = self._clipped[bright], self._clipped[dark]
            tables = self._tables[bright], self._tables[dark]
            self._made[key] = _predict(*tables, step, wider, clipped)
        return self._made[key]

    def apart(self, bright: Bytes, dark: Bytes, index: int) -> Float64:
        """Measure stops from frame `index` to the next where both are well exposed, any channel."""
        logs = np.log2(np.maximum(self._tables, 1e-9)) - np.asarray(self.stops)[:, None, None]
        parts = []
        for channel in range(3):
            first, second = bright[..., channel], dark[..., channel]
            both = (first > _OPEN[0]) & (first < _OPEN[1])
            both &= (second > _OPEN[0]) & (second < _OPEN[1])
            there = logs[index, channel][first[both]] - logs[index + 1, channel][second[both]]
            parts.append(there)
        return np.concatenate(parts)

    def as_seen(self, frame: Bytes, source: int, target: int) -> Bytes:
        """Say what one frame shows in the codes of another one."""
        step = self.stops[target] - self.stops[source]
        codes = np.arange(256.0)
        table = np.stack(
            [
                _brighter(dark, bright, codes, step)
                for dark, bright in zip(self._tables[source], self._tables[target], strict=True)
            ],
            axis=-1,
        )
        return np.asarray(cv2.LUT(frame, _table(table)), np.uint8)


def contradiction(bright: Bytes, dark: Bytes, expected: _Prediction) -> Bytes:
    """Say by how many codes two frames, (h, w, 3) area means, cannot be of the same thing, (h, w).

    Of the worst channel, beyond its tolerance; 0 where the frames agree.
    """
    tolerance = expected.tolerance
    under = cv2.subtract(cv2.LUT(dark, expected.low), bright)
    over = cv2.subtract(bright, cv2.LUT(dark, expected.high))
    shared = cv2.max if tolerance.either else cv2.min
    contrast = shared(_contrast(bright), _contrast(cv2.LUT(dark, expected.middle)))
    under = cv2.subtract(under, cv2.convertScaleAbs(contrast, alpha=tolerance.under))
    over = cv2.subtract(over, cv2.convertScaleAbs(contrast, alpha=tolerance.over))
    return worst(cv2.max(under, over))


def worst(pixels: Any) -> Bytes:
    """Return the largest channel of each pixel, (h, w).

    OpenCV takes a fraction of the time that numpy takes along so short an axis.
    """
    red, green, blue = cv2.split(pixels)
    return np.asarray(cv2.max(cv2.max(red, green), blue), np.uint8)


def _predict(
    brights: Float64, darks: Float64, step: float, tolerance: Tolerance, clipped: tuple[int, int]
) -> _Prediction:
    """Lowest, likeliest and highest code after `step` more stops, for each code.

    `clipped` is the mean of codes from which on the brighter and the darker frame are clipped.
    """
    codes = np.arange(256.0)
    slack = tolerance.codes + tolerance.toe * np.exp(-codes / 16.0)
    low, middle, high = np.empty((3, 256, 3))
    for channel, (bright, dark) in enumerate(zip(brights, darks, strict=True)):
        low[:, channel] = _brighter(dark, bright, codes - slack, step - tolerance.stops)
        middle[:, channel] = _brighter(dark, bright, codes, step)
        high[:, channel] = _brighter(dark, bright, codes + slack, step + tolerance.stops)
    # What ought to be clipped may be anything above the clipping limit, and so may what a frame
    # that is itself clipped predicts.
    low = np.minimum(low - tolerance.codes, clipped[0])
    high += tolerance.codes
    high[(high >= clipped[0]) | (codes[:, None] >= clipped[1])] = 255.0
    return _Prediction(_table(np.floor(low)), _table(middle), _table(np.ceil(high)), tolerance)


def _brighter(dark: Float64, bright: Float64, codes: Float64, stops: float) -> Float64:
    """Codes that so many stops more would make of these, by each frame's curve."""
    light = np.interp(codes, np.arange(256.0), dark) * 2.0**stops
    return np.asarray(np.interp(light, bright, np.arange(256.0)), np.float64)


def _table(codes: Float64) -> Bytes:
    return np.asarray(np.clip(np.rint(codes), 0, 255), np.uint8)[None]


def _contrast(frame: Any) -> Bytes:
    """Range of the codes among a pixel and its neighbours, per channel."""
    box = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.morphologyEx(frame, cv2.MORPH_GRADIENT, box), np.uint8)


_LOW, _HIGH = 8, 243
_STRIP: Final = 4  # rows
_LEAST_SHIFT: Final = 2  # columns: a block of 16 pixels is two in a picture an eighth as wide
_LEAST_CONTRAST: Final = 2.0
_LIKE: Final = 0.6
_BETTER: Final = 0.25
_MOST: Final = 0.6
_FEW: Final = 0.2
# The camera's own curve is not known here; it is near enough to sRGB for what damage does.
_ANY_CURVE: Final = Tolerance(stops=0.7, codes=6.0, toe=6.0, under=1.0, over=0.6, either=True)
_LEAST_STRIPS: Final = 2
_NEIGHBOURS: Final = 2


def disagreeing(frames: Sequence[Bytes], stops: Sequence[float]) -> tuple[int, ...]:
    """Find the frames that are likely damaged.

    `frames`, (h, w, 3) uint8 each, are area means of a panorama's frames, coded as in their
    files. Returns the fewest whose damage explains every pair that does not fit; both frames of
    a pair where neither is likelier. Empty with fewer than three frames.
    """
    if len(frames) < 3:
        return ()
    order = sorted(range(len(frames)), key=lambda k: stops[k])
    clashes = [
        {order[a], order[b]}
        for a, b in combinations(range(len(order)), 2)
        if b - a <= _NEIGHBOURS
        and _clash(frames[order[b]], frames[order[a]], stops[order[b]] - stops[order[a]])
    ]
    found: list[int] = []
    while clashes:
        counts = {k: sum(k in clash for clash in clashes) for k in order}
        worst = [k for k in order if counts[k] == max(counts.values())]
        found += worst
        clashes = [clash for clash in clashes if not clash & set(worst)]
    return tuple(sorted(found))


def _clash(bright: Bytes, dark: Bytes, step: float) -> bool:
    """Whether strips of one frame are displaced against the other, or impossible beside it."""
    if bright.shape != dark.shape or bright.shape[0] < 4 * _STRIP:
        return False
    rows = bright.shape[0] // _STRIP * _STRIP
    bright, dark = bright[:rows], dark[:rows]
    return _run(_displaced(bright, dark)) or _run(_contradicted(bright, dark, step))


def _displaced(one: Bytes, other: Bytes) -> Bools:
    """Mark strips in which one is like the other when moved sideways, and not as it lies."""
    sound = (one > _LOW) & (one < _HIGH) & (other > _LOW) & (other < _HIGH)
    valid = np.asarray(sound.all(axis=2))
    here, there = (_detail(frame, valid) for frame in (one, other))
    spectrum = np.conj(np.fft.rfft(here, axis=1)) * np.fft.rfft(there, axis=1)
    strips = len(here) // _STRIP
    spectrum = spectrum.reshape(strips, _STRIP, -1).sum(axis=1)
    match = np.fft.irfft(spectrum, here.shape[1], axis=1)
    power = [np.square(part).reshape(strips, -1).sum(axis=1) for part in (here, there)]
    match /= np.maximum(np.sqrt(power[0] * power[1]), 1e-9)[:, None]
    near = max(_LEAST_SHIFT, 1)
    still = np.concatenate([match[:, :near], match[:, 1 - near :]], axis=1).max(axis=1)
    best = match[:, near : match.shape[1] - near + 1].max(axis=1)
    rich = np.minimum(*power) > _LEAST_CONTRAST**2 * _STRIP * here.shape[1]
    return np.asarray(rich & (best > _LIKE) & (best > still + _BETTER))


def _detail(frame: Bytes, valid: Bools) -> Float64:
    """Keep what stands out sideways in the grey codes, where they can be compared."""
    grey = frame.astype(np.float64).mean(axis=2)
    weight = valid.astype(np.float64)
    width = (max(frame.shape[1] // 16, 3) | 1, 1)
    mean = cv2.blur(grey * weight, width, borderType=cv2.BORDER_REFLECT)
    mean /= np.maximum(cv2.blur(weight, width, borderType=cv2.BORDER_REFLECT), 1e-3)
    return np.asarray((grey - mean) * weight, np.float64)


def _contradicted(bright: Bytes, dark: Bytes, step: float) -> Bools:
    """Mark strips in which hardly a pixel of one frame can be what the other shows."""
    codes = np.arange(256) / 255.0
    curve = np.broadcast_to(
        np.where(codes > 0.04, ((codes + 0.055) / 1.055) ** 2.4, codes / 12.92), (3, 256)
    )
    expected = Predictions(curve, (step, 0.0)).between(0, 1, _ANY_CURVE)
    off = contradiction(bright, dark, expected) > 0
    share = off.reshape(len(off) // _STRIP, -1).mean(axis=1)
    bad = share > _MOST
    calm = share[~bad]
    return np.asarray(bad & (len(calm) > 0 and float(np.median(calm)) < _FEW))


def _run(marks: Any) -> bool:
    """Whether enough strips after each other are marked."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(marks, np.int8), [0]])))
    return bool(len(ends) and np.max(ends[1::2] - ends[::2]) >= _LEAST_STRIPS)


_BLACK: Final = 8
_FEWEST: Final = 64  # pixels that say something
# What two of three pixels keep to, most keep to a multiple of.
_USUAL_SHARE: Final = 0.68
_MISFIT: Final = 4.0
_MOST_SLACK: Final = 0.8
_SHARED: Final = 0.05  # of the picture that two frames must both expose well to be compared
_SAME_PLACE: Final = 0.6  # rank correlation of two frames of one place, however they are toned


def fill_hidden(
    frames: list[Bytes], hidden: Sequence[Float32 | None], predictions: Predictions
) -> None:
    """Give frames beyond their edges what their nearest neighbours show: no contradiction."""
    shown = list(frames)
    for index, mask in enumerate(hidden):
        if mask is None:
            continue
        empty = mask == 0.0
        filled = frames[index].copy()
        for other in sorted(range(len(frames)), key=lambda k: abs(k - index))[1:]:
            given = hidden[other]
            here = empty if given is None else empty & (given > 0.0)
            filled[here] = predictions.as_seen(shown[other], other, index)[here]
            empty = empty & ~here
            if not empty.any():
                break
        frames[index] = filled


def misfit(frames: Sequence[Bytes], predictions: Predictions) -> float:
    """Say by how many stops most places of neighbouring frames differ beyond what is usual."""
    usual = []
    for k in range(len(frames) - 1):
        off = predictions.apart(frames[k], frames[k + 1], k)
        if off.size > _FEWEST:
            usual.append(float(np.quantile(np.abs(off), _USUAL_SHARE)))
    return min(max(0.0, _MISFIT * max(usual, default=0.0) - LOOSE.stops), _MOST_SLACK)


def hopeless(frames: Sequence[Bytes], share: float) -> str:
    """Say why what moved cannot be told: another place, or frames of one that do not fit."""
    if alike(frames) > _SAME_PLACE:
        return tr(
            "The frames do not fit each other over {share:.0f} % of the picture, so "
            "that what moved cannot be told: they were averaged. Exposures or tone "
            "curves are not as stated.",
            share=100.0 * share,
        )
    return tr(
        "The frames show different things over {share:.0f} % of the picture. "
        "Shoot the bracket again if you can.",
        share=100.0 * share,
    )


def alike(frames: Sequence[Bytes]) -> float:
    """Return the least correlation of neighbouring frames where both are well exposed."""
    least = 1.0
    for one, other in pairwise(frames):
        first, second = one[..., 1].ravel(), other[..., 1].ravel()
        both = (first > _BLACK) & (first <= CLIPPED) & (second > _BLACK) & (second <= CLIPPED)
        if np.count_nonzero(both) > max(_FEWEST, _SHARED * both.size):
            ranks = [np.argsort(np.argsort(part[both], kind="stable")) for part in (first, second)]
            one_way, other_way = (rank - rank.mean() for rank in ranks)
            size = math.sqrt(float(one_way @ one_way) * float(other_way @ other_way))
            least = min(least, float(one_way @ other_way) / max(size, 1.0))
    return least
