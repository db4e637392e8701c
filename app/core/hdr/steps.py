"""Steps between the frames of a bracket, as measured and as the files state them.

Where two frames both expose a place well, the ratio of their linear values is the step between
them. A wrong response curve shows as a step that depends on the level, or as all steps off by
one factor (a curve raised to a power cannot be told from longer steps); a wrong tag in a file
shows as a constant difference in the pairs of one frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.hdr.brightness_transfer import match_codes
from app.core.hdr.response_recovery import srgb_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Bytes, Float64
    from app.core.hdr.brightness_transfer import CodeMatches

# Brackets of 20 scenes with an sRGB curve, noise and JPEG 95: three quarters of the levels of
# 2-stop steps lie within 0.015 stops, of turned frames within 0.03. A curve that is off by so
# little that radiance is wrong by 1 % (median) and 4 % (95th percentile) shows as 0.05.
_TOLERANCE: Final = 0.01
_TOLERANCE_PER_STOP: Final = 0.01
# Steps between frames that are turned or very noisy are less certain: up to 0.1 of 2 stops.
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
    """The step between two frames, in stops: as the files state it, and the median over levels.

    `levels` are measured minus nominal steps at rising levels of the brighter frame, of red,
    then green, then blue; levels that too few places reach are left out. `codes` are its mean
    codes there.
    """

    bright: int
    dark: int
    nominal: float
    measured: float
    levels: tuple[float, ...]
    codes: tuple[float, ...]

    @property
    def off(self) -> float:
        """Measured minus nominal, in stops."""
        return self.measured - self.nominal

    @property
    def spread(self) -> float:
        """How far the step depends on the level: range of the middle 80 % of levels, in stops."""
        low, high = np.quantile(self.levels, (0.1, 0.9))
        return float(high - low)


@dataclass(frozen=True, slots=True)
class StepCheck:
    """Comparison of all measured steps with the nominal ones.

    `residual_stops` is the spread of measured minus nominal over pairs and levels: a root mean
    square, estimated from the upper quartile so that few strange levels do not count; NaN where
    no frames overlap. `disagreement` is the same as a share of what noise explains (see
    `tolerance`), exceeded by a quarter of the levels; 0 where no frames overlap.
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
        """Whether noise explains the differences; also where nothing could be compared."""
        return self.disagreement <= 1.0


def tolerance(step: float) -> float:
    """Difference from a nominal step, in stops, that noise, rounding and compression explain."""
    return _TOLERANCE + _TOLERANCE_PER_STOP * abs(step)


def check_steps(samples: Bytes, stops: Sequence[float], table: Float64 | None = None) -> StepCheck:
    """Measure the steps between the frames of a bracket.

    `samples` and stated `stops` as for `match_codes`. `table`, (256,) or (3, 256) float64, is
    the linear light of each code; sRGB when not given.
    """
    curve = srgb_table() if table is None else table
    matches = match_codes(samples, stops, reach(stops))
    return check_matches(matches, stops, curve)


def check_matches(matches: CodeMatches, stops: Sequence[float], table: Float64) -> StepCheck:
    """Compare matching codes with the stated steps.

    `table`, (256,), (3, 256) or (K, 3, 256) float64, is the linear light of each code, strictly
    rising; the last is of each frame.
    """
    measured, slope = _measured(matches, table)
    rows = (matches.code >= _DARKEST_CODE) & (matches.dark_code >= _DARKEST_DARK_CODE)
    noise = (slope * matches.scatter) ** 2 / matches.places + _ROW_STOPS**2
    level = (matches.code - _DARKEST_CODE) * _LEVELS // (249 - _DARKEST_CODE)
    level += matches.channel * _LEVELS  # opposite errors of two channels must not cancel
    steps: list[MeasuredStep] = []
    off: list[float] = []
    share: list[float] = []
    frames = len(stops)
    for pair_number in np.unique(matches.bright * frames + matches.dark):
        bright, dark = divmod(int(pair_number), frames)
        pair = rows & (matches.bright == bright) & (matches.dark == dark)
        nominal = float(stops[bright] - stops[dark])
        levels, codes = _by_level(
            level[pair],
            (measured[pair] - nominal, matches.code[pair].astype(np.float64)),
            1.0 / noise[pair],
            matches.places[pair],
        )
        if levels:
            middle = nominal + float(np.median(levels))
            steps.append(MeasuredStep(bright, dark, nominal, middle, tuple(levels), tuple(codes)))
            off += levels
            margin = tolerance(nominal) * (_TURNED if (bright, dark) in matches.turned else 1.0)
            share += [abs(value) / margin for value in levels]
    if not steps:
        return StepCheck((), float("nan"), 0.0)
    residual = float(np.quantile(np.abs(off), _SHARE)) / _NORMAL
    return StepCheck(tuple(steps), residual, float(np.quantile(share, _SHARE)))


def reach(stops: Sequence[float]) -> int:
    """How far apart in order two frames of a check may be.

    2, but neighbours only in long brackets, where they are evidence enough.
    """
    return 2 if len(stops) <= 5 else 1


def _measured(matches: CodeMatches, table: Float64) -> tuple[Float64, Float64]:
    """Step that each row measures, and stops per code at its darker code; (R,) each."""
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
            # Between codes the curve is a power law, as in the recovery.
            measured[here] -= np.interp(np.log2(dark), np.log2(np.arange(1, 256)), log)
            slope[here] = np.gradient(log)[np.clip(dark.astype(np.int64) - 1, 0, 254)]
    return measured, slope


def _by_level(
    level: Float64, values: tuple[Float64, Float64], weights: Float64, places: Float64
) -> tuple[list[float], list[float]]:
    """Weighted means of both values for each level that enough places reach."""
    count = np.bincount(level, places, minlength=3 * _LEVELS)
    enough = count >= _FEWEST_PLACES
    total = np.maximum(np.bincount(level, weights, minlength=3 * _LEVELS), 1e-300)
    means = [
        (np.bincount(level, weights * value, minlength=3 * _LEVELS) / total)[enough].tolist()
        for value in values
    ]
    return means[0], means[1]
