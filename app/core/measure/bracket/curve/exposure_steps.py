"""Measure the exposure steps between frames, to check the response curve and the exposure tags.

The ratio of the linear values of matching codes is the step between two frames. A wrong response
curve shows up either as a step that depends on the level, or as all steps being off by the same
factor, because a curve raised to a power cannot be distinguished from longer steps. A frame's wrong
tag shows up as a constant difference in all pairs that include the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.arrays import Float64, Int64
from app.core.measure.bracket.curve.brightness_transfer import CodeMatches

# In brackets of 20 scenes with an sRGB curve, noise and JPEG 95, three quarters of the levels of
# 2-stop steps are within 0.015 stops, and for turned frames within 0.03. A curve that makes
# radiance wrong by as little as 1% (median) and 4% (95th percentile) shows up as 0.05.
_TOLERANCE: Final = 0.01
_TOLERANCE_PER_STOP: Final = 0.01
# Steps between frames that are turned or very noisy are less certain, by up to 0.1 of 2 stops.
_TURNED: Final = 3.5
_LEVELS: Final = 6
_DARKEST_CODE: Final = 24
_DARKEST_DARK_CODE: Final = 12.0
_FEWEST_PLACES: Final = 30.0
_ROW_STOPS: Final = 0.02
_SHARE: Final = 0.75
# Three quarters of a normal distribution lie within 1.15 standard deviations.
_NORMAL: Final = 1.1503


@dataclass(frozen=True, slots=True)
class MeasuredStep:
    """The step between two frames in stops: the nominal step and the median over all levels.

    Attributes:
        levels: Measured minus nominal step at increasing levels of the brighter frame, first for
            red, then for green, then for blue. Levels with too few places are omitted.
    """

    bright: int
    dark: int
    nominal: float
    measured: float
    levels: tuple[float, ...]

    @property
    def off(self) -> float:
        """The measured step minus the nominal step, in stops."""
        return self.measured - self.nominal


@dataclass(frozen=True, slots=True)
class StepCheck:
    """A comparison of all measured steps with the nominal ones.

    Attributes:
        residual_stops: Root mean square, over pairs and levels, of the measured minus the nominal
            steps, estimated from the upper quartile so that a few outliers do not count, or NaN if
            no frames overlap.
        disagreement: Upper quartile of the difference divided by its `tolerance`, or 0 if no frames
            overlap.
    """

    steps: tuple[MeasuredStep, ...]
    residual_stops: float
    disagreement: float

    @property
    def possible(self) -> bool:
        """Whether any frames overlap."""
        return bool(self.steps)

    @property
    def agrees(self) -> bool:
        """Whether noise explains the differences or nothing could be compared."""
        return self.disagreement <= 1.0


def tolerance(step: float) -> float:
    """Return the error in a step, in stops, that noise, rounding and compression can explain."""
    return _TOLERANCE + _TOLERANCE_PER_STOP * abs(step)


def check_matches(matches: CodeMatches, stops: Sequence[float], table: Float64) -> StepCheck:
    """Compare matching codes with the nominal exposures.

    Args:
        table: (256,), (3, 256), or (K, 3, 256) with one table per frame, float64. Linear light of
            each code, which is strictly increasing.
    """
    measured, slope = _measured(matches, table)
    rows = (matches.code >= _DARKEST_CODE) & (matches.dark_code >= _DARKEST_DARK_CODE)
    noise = (slope * matches.scatter) ** 2 / matches.places + _ROW_STOPS**2
    level = (matches.code - _DARKEST_CODE) * _LEVELS // (249 - _DARKEST_CODE)
    level += matches.channel * _LEVELS  # so that opposite errors of two channels do not cancel
    steps: list[MeasuredStep] = []
    off: list[float] = []
    share: list[float] = []
    frames = len(stops)
    for pair_number in np.unique(matches.bright * frames + matches.dark):
        bright, dark = divmod(int(pair_number), frames)
        pair = rows & (matches.bright == bright) & (matches.dark == dark)
        nominal = float(stops[bright] - stops[dark])
        off_here = measured[pair] - nominal
        levels = _by_level(level[pair], off_here, 1.0 / noise[pair], matches.places[pair])
        if levels:
            middle = nominal + float(np.median(levels))
            steps.append(MeasuredStep(bright, dark, nominal, middle, tuple(levels)))
            off += levels
            margin = tolerance(nominal) * (_TURNED if (bright, dark) in matches.turned else 1.0)
            share += [abs(value) / margin for value in levels]
    if not steps:
        return StepCheck((), float("nan"), 0.0)
    residual = float(np.quantile(np.abs(off), _SHARE)) / _NORMAL
    return StepCheck(tuple(steps), residual, float(np.quantile(share, _SHARE)))


def _measured(matches: CodeMatches, table: Float64) -> tuple[Float64, Float64]:
    """Return each row's measured step and the stops per code at its darker code, (R,) each."""
    measured = np.zeros(len(matches))
    slope = np.zeros(len(matches))
    curves = np.asarray(table)
    if curves.ndim < 3:
        curves = np.broadcast_to(np.atleast_2d(curves), (1, 3, 256))
    logs = np.log2(np.maximum(curves[..., 1:], 1e-300))
    own = len(curves) > 1
    for channel in range(3):
        for frame, log in enumerate(logs[:, channel]):
            rows = matches.channel == channel
            here = rows & (matches.bright == frame) if own else rows
            measured[here] += log[matches.code[here] - 1]
            here = rows & (matches.dark == frame) if own else rows
            dark = matches.dark_code[here]
            # Between codes, the curve is a power law, as in the recovery.
            measured[here] -= np.interp(np.log2(dark), np.log2(np.arange(1, 256)), log)
            slope[here] = np.gradient(log)[np.clip(dark.astype(np.int64) - 1, 0, 254)]
    return measured, slope


def _by_level(level: Int64, values: Float64, weights: Float64, places: Float64) -> list[float]:
    """Return the weighted mean of the values at each level with enough places."""
    count = np.bincount(level, places, minlength=3 * _LEVELS)
    total = np.maximum(np.bincount(level, weights, minlength=3 * _LEVELS), 1e-300)
    means = np.bincount(level, weights * values, minlength=3 * _LEVELS) / total
    levels: list[float] = means[count >= _FEWEST_PLACES].tolist()
    return levels
