"""From a curve over 64 turns to an answer: the best turn, its refinement, its arc, its rivals.

Between the 64 turns a curve is continued by trigonometric (band-limited) interpolation, always
developed around the turn in question, so that a mirrored curve gives the mirrored answer.
Offsets are in steps of the grid, positive clockwise; angles leave this module in degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from app.core.base.angles import TURNS, turn_of_index, wrap
from app.core.base.arrays import Bools, Float64

TIE: Final = 1e-6
"""Objectives closer than this share of the curve's largest value are equally good."""

ARC_SHARE: Final = 0.03
"""The tolerance arc ends where the objective has lost this share of its maximum (the paper)."""

_FINE = 16  # points per grid step where a curve is looked at between the turns
_REACH = TURNS // 2
_STEP_DEG = 360.0 / TURNS
_MAX_PEAKS = 6
_FASTEST = 18.0  # waves a turn: details of a curve narrower than some ten degrees
_BACKWARD = -np.arange(TURNS) % TURNS  # the same turn, then the others counter-clockwise


@dataclass(frozen=True, slots=True)
class Gate:
    """Turns that may be chosen: those where a curve (strength) reaches a limit.

    Attributes:
        curve: (64,) float64.
    """

    curve: Float64
    limit: float

    @property
    def open(self) -> Bools:
        """(64,) bool: which grid turns may be chosen."""
        return self.curve >= self.limit


@dataclass(frozen=True, slots=True)
class Peak:
    """A local maximum of an objective.

    Attributes:
        turn_deg, refined_deg: The grid turn and the maximum between grid turns, deg in (-180, 180].
        arc_deg: (from, to) going clockwise: where the objective stays within 3 % of the maximum,
            and the gate open. (-180, 180) is the whole circle.
    """

    index: int
    turn_deg: float
    refined_deg: float
    arc_deg: tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Series:
    """Trigonometric polynomial around a place: sum a_m cos(m w u) + b_m sin(m w u)."""

    a: Float64
    b: Float64

    @classmethod
    def around(cls, curve: Float64, index: int) -> _Series:
        rolled = _rolled(curve, index)
        back = rolled[_BACKWARD]
        cosine, sine = _forward()
        # Even and odd parts apart: a mirrored curve then has the same a and exactly -b.
        even: Float64 = cosine @ (rolled + back)
        odd: Float64 = sine @ (rolled - back)
        return cls(even, odd)

    def moved(self, offset: float) -> _Series:
        phase = _orders() * offset
        cosine, sine = np.cos(phase), np.sin(phase)
        return _Series(self.a * cosine + self.b * sine, self.b * cosine - self.a * sine)

    @property
    def smooth(self) -> _Series:
        """Without the fastest waves, which come from the texels."""
        return _Series(self.a * _smoothing(), self.b * _smoothing())

    def at(self, offset: float) -> float:
        phase = _orders() * offset
        return float(self.a @ np.cos(phase) + self.b @ np.sin(phase))

    def fine(self, reach: int = _REACH) -> tuple[Float64, Float64]:
        """Values clockwise and counter-clockwise, at offsets 0, 1/16 ... reach."""
        cosine, sine = _fine_basis()
        stop = reach * _FINE + 1
        even, odd = self.a @ cosine[:, :stop], self.b @ sine[:, :stop]
        return even + odd, even - odd


def _rolled(curve: Float64, index: int) -> Float64:
    """Return `np.roll(curve, -index)` for an index in 0..63, several times as fast."""
    return np.concatenate([curve[index:], curve[:index]])


@cache
def _orders() -> Float64:
    return np.linspace(0.0, np.pi, TURNS // 2 + 1)


@cache
def _smoothing() -> Float64:
    """What each wave of a curve counts where its maximum is looked for.

    The fastest ones come from the texels: with them a small lamp's turn would waver by up to 2 deg
    as the lamp moves from one texel to the next.
    """
    return np.exp(-((np.arange(TURNS // 2 + 1) / _FASTEST) ** 4))


@cache
def _forward() -> tuple[Float64, Float64]:
    phase = np.outer(_orders(), np.arange(TURNS))
    share = np.full(TURNS // 2 + 1, 1.0 / TURNS)
    share[0] = share[-1] = 0.5 / TURNS
    return np.cos(phase) * share[:, None], np.sin(phase) * share[:, None]


@cache
def _fine_basis() -> tuple[Float64, Float64]:
    phase = np.outer(_orders(), np.arange(_REACH * _FINE + 1) / _FINE)
    return np.cos(phase), np.sin(phase)


def shift(curve: Float64, turn_deg: float) -> Float64:
    """Move a curve so that its value at `turn_deg` comes to turn 0.

    Args:
        curve: (64,) float64. Values at the grid turns.

    Returns:
        (64,) float64. Band-limited interpolation of the curve at turns ``turn_deg + 5.625 k``.
    """
    steps = wrap(turn_deg) / _STEP_DEG
    whole = round(steps)
    if abs(steps - whole) < 1e-9:
        return np.roll(curve, -whole)
    series = _Series.around(curve, whole % TURNS).moved(steps - whole)
    right, left = series.fine()
    return np.concatenate([right[::_FINE], left[(_REACH - 1) * _FINE : 0 : -_FINE]])


def best_index(objective: Float64, allowed: Bools) -> int:
    """Choose the grid turn with the largest objective.

    Among turns within `TIE` of the best, the smaller turn wins, then clockwise.

    Args:
        objective: (64,) float64. At the grid turns.
        allowed: (64,) bool. At least one True.

    Examples:
        >>> best_index(np.ones(64), np.ones(64, bool))
        0
    """
    best = objective[allowed].max()
    near = best - TIE * np.abs(objective).max()
    ties = np.flatnonzero(allowed & (objective >= near))
    # Smallest |turn| first; of a pair at equal |turn| the clockwise one has the smaller index.
    size = np.minimum(ties, TURNS - ties)
    return int(ties[np.argmin(size)])


def find_peak(
    objective: Float64, index: int, gate: Gate | None = None, contrast: Float64 | None = None
) -> Peak:
    """Refine one maximum between the grid turns and find its tolerance arc.

    Args:
        objective: (64,) float64. At the grid turns.
        contrast: (64,) float64. What it was divided by, where it is a match: light on a face
            changes smoothly with the turn, while a match may rise and fall within a step.
    """
    turn = turn_of_index(index)
    if float(np.ptp(objective)) <= TIE * float(np.abs(objective).max()):
        return Peak(index, turn, turn, (-180.0, 180.0))
    value = _Series.around(objective, index)
    guard = None if gate is None else _Series.around(gate.curve - gate.limit, index)
    offset = _refine(_between(objective, index, contrast), guard)
    guard = None if guard is None else guard.moved(offset)
    arc = _arc(value.moved(offset), guard, turn_of_index(index + offset))
    return Peak(index, turn, turn_of_index(index + offset), arc)


def _between(objective: Float64, index: int, contrast: Float64 | None) -> tuple[Float64, Float64]:
    """Values at offsets 0, 1/16 ... 1 and 0, -1/16 ... -1, without the fastest waves."""
    if contrast is None:
        return _Series.around(objective, index).smooth.fine(1)
    product = _Series.around(objective * contrast, index).smooth.fine(1)
    square = _Series.around(contrast**2, index).smooth.fine(1)
    least = 1e-6 * float(contrast.max()) ** 2
    right, left = (p / np.sqrt(np.maximum(q, least)) for p, q in zip(product, square, strict=True))
    return right, left


def find_peaks(
    objective: Float64, index: int, gate: Gate | None = None, contrast: Float64 | None = None
) -> tuple[Peak, ...]:
    """Find the best turn and its rivals: local maxima that stand out by more than 3 %.

    Args:
        objective, contrast: (64,) float64. See `find_peak`.

    Returns:
        The chosen one, then the others, best first; at most six.
    """
    allowed = np.ones(TURNS, bool) if gate is None else gate.open
    heights = np.where(allowed, objective, -np.inf)
    least = ARC_SHARE * float(np.abs(objective).max())
    turns = [k for k in _local_maxima(heights) if k != index]
    rivals = [k for k in turns if _prominence(heights, k) > least]
    rivals.sort(key=lambda k: (-heights[k], min(k, TURNS - k), k))
    return tuple(find_peak(objective, k, gate, contrast) for k in [index, *rivals][:_MAX_PEAKS])


def _local_maxima(heights: Float64) -> list[int]:
    before, after = _rolled(heights, TURNS - 1), _rolled(heights, 1)
    top = np.isfinite(heights) & (heights > before) & (heights >= after)
    return [int(k) for k in top.nonzero()[0]]


def _prominence(heights: Float64, index: int) -> float:
    """How far one has to descend from a peak before climbing higher, in either direction."""
    around = _rolled(heights, index)
    higher = (around > around[0]).nonzero()[0]
    if higher.size == 0:
        return float(np.inf)
    saddles = around[: higher[0]].min(), around[higher[-1] :].min()
    return float(around[0] - max(saddles))


def _refine(values: tuple[Float64, Float64], guard: _Series | None) -> float:
    """Offset in [-1, 1] of the maximum, reached from 0 without crossing a closed gate.

    Args:
        values: The curve at offsets 0, 1/16 ... 1 and 0, -1/16 ... -1.
    """
    right, left = values
    if guard is not None:
        right, left = (v[: _open_run(g)] for v, g in zip(values, guard.fine(1), strict=True))
    to_right, to_left = int(np.argmax(right)), int(np.argmax(left))
    start = to_right if right[to_right] >= left[to_left] else -to_left
    around = np.concatenate([values[1][:0:-1], values[0]])
    found = (start + _top(around, start + _FINE)) / _FINE
    if guard is None or guard.at(found) >= 0:
        return found
    inside, outside = start / _FINE, found
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if guard.at(middle) >= 0 else (inside, middle)
    return inside


def _open_run(side: Float64) -> int:
    """Points from 0 on before the gate closes; 0 itself is open, whatever rounding says."""
    closed = (side[1:] < 0).nonzero()[0]
    return int(closed[0]) + 1 if closed.size else len(side)


def _top(values: Float64, index: int) -> float:
    """How far the vertex of a parabola through a largest value and its neighbours is from it."""
    if not 0 < index < len(values) - 1:
        return 0.0
    before, here, after = values[index - 1 : index + 2].tolist()
    bend = (before + after) - 2 * here
    # At the edge of a gate the largest value need not be a maximum.
    return min(max(0.5 * (before - after) / bend, -1.0), 1.0) if bend < 0 else 0.0


def _arc(value: _Series, guard: _Series | None, turn_deg: float) -> tuple[float, float]:
    """Find the ends of the tolerance arc around offset 0 of the series, deg."""
    slack = _around(value)
    top = slack[0]
    slack = slack - (top - ARC_SHARE * abs(top))
    slacks = [slack] if guard is None else [slack, _around(guard)]
    right = min(_first_crossing(s) for s in slacks)
    left = min(_first_crossing(np.concatenate([s[:1], s[:0:-1]])) for s in slacks)
    if right >= TURNS or left >= TURNS:
        return (-180.0, 180.0)
    return (wrap(turn_deg - left * _STEP_DEG), wrap(turn_deg + right * _STEP_DEG))


def _around(series: _Series) -> Float64:
    """Values at offsets 0, 1/16 ... once around the circle."""
    right, left = series.fine()
    return np.concatenate([right, left[-2:0:-1]])


def _first_crossing(slack: Float64) -> float:
    """Offset at which a curve first falls below 0, TURNS when it never does."""
    below = (slack[1:] < 0).nonzero()[0]
    if below.size == 0:
        return float(TURNS)
    last = int(below[0])
    before, after = max(float(slack[last]), 0.0), float(slack[last + 1])
    return (last + before / (before - after)) / _FINE
