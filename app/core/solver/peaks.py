"""The turn to offer on a curve over 64 turns, with its tolerance arc and rival peaks.

`find_peak` contains the rule for choosing a turn within the tolerance arc.

Between the 64 turns, a curve is continued by trigonometric (band-limited) interpolation. The
expansion is always centred on the turn in question, so that a mirrored curve gives the mirrored
result. Offsets are in grid steps, positive clockwise. Angles are returned in degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import islice
from typing import Final

import numpy as np

from app.core.base.angles import TURNS, turn_of_index, wrap
from app.core.base.arrays import Bools, Float64, Int64

TIE: Final = 1e-6
"""Largest difference between equally good objectives, as a fraction of the curve's maximum."""

ARC_SHARE: Final = 0.03
"""Loss of the objective at the ends of the tolerance arc, as a fraction of its maximum (paper)."""

MARGIN: Final = 1 / 3
"""Smallest distance from the offered turn to either end of the arc, as a fraction of its width.

It does not apply to an end where the grade changes.
"""

_FINE = 16  # points per grid step for curves between the turns
_REACH = TURNS // 2
_STEP_DEG = 360.0 / TURNS
_MAX_PEAKS = 6
_FASTEST = 18.0  # waves per turn: details of a curve narrower than about ten degrees
_BACKWARD = -np.arange(TURNS) % TURNS  # the turn itself, then the others counter-clockwise


@dataclass(frozen=True, slots=True)
class Gate:
    """The turns that may be chosen, which are those where a curve (strength) reaches a limit.

    Attributes:
        curve: (64,) float64. Values of the curve at the grid turns.
    """

    curve: Float64
    limit: float

    @property
    def open(self) -> Bools:
        """Grid turns that may be chosen, (64,) bool."""
        return self.curve >= self.limit


@dataclass(frozen=True, slots=True)
class Peak:
    """A local maximum of an objective, and the turn to offer for it.

    Attributes:
        turn_deg, refined_deg: The offered turn, on the grid and refined between grid turns, in
            degrees within (-180, 180].
        arc_deg: The clockwise arc (from, to), in degrees, over which the objective stays within 3%
            of the maximum and the gate is open. (-180, 180) is the full circle.
    """

    index: int
    turn_deg: float
    refined_deg: float
    arc_deg: tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Series:
    """Trigonometric polynomial around a turn: sum a_m cos(m w u) + b_m sin(m w u)."""

    a: Float64
    b: Float64

    @classmethod
    def around(cls, curve: Float64, index: int) -> _Series:
        rolled = _rolled(curve, index)
        back = rolled[_BACKWARD]
        cosine, sine = _forward()
        # Even and odd parts are separate, so a mirrored curve has the same a and exactly -b.
        even: Float64 = cosine @ (rolled + back)
        odd: Float64 = sine @ (rolled - back)
        return cls(even, odd)

    def moved(self, offset: float) -> _Series:
        phase = _orders() * offset
        cosine, sine = np.cos(phase), np.sin(phase)
        return _Series(self.a * cosine + self.b * sine, self.b * cosine - self.a * sine)

    @property
    def smooth(self) -> _Series:
        """The polynomial without its highest frequencies, which the texel grid causes."""
        return _Series(self.a * _smoothing(), self.b * _smoothing())

    def at(self, offset: float) -> float:
        phase = _orders() * offset
        return float(self.a @ np.cos(phase) + self.b @ np.sin(phase))

    def fine(self, reach: int = _REACH) -> tuple[Float64, Float64]:
        """Return the values at offsets 0, 1/16 ... reach, clockwise and counter-clockwise."""
        cosine, sine = _fine_basis()
        stop = reach * _FINE + 1
        even, odd = self.a @ cosine[:, :stop], self.b @ sine[:, :stop]
        return even + odd, even - odd


def _rolled(curve: Float64, index: int) -> Float64:
    """Return `np.roll(curve, -index)` for an index from 0 to 63, several times as fast."""
    return np.concatenate([curve[index:], curve[:index]])


@cache
def _orders() -> Float64:
    return np.linspace(0.0, np.pi, TURNS // 2 + 1)


@cache
def _smoothing() -> Float64:
    """Return the weight of each frequency of a curve in the search for its maximum.

    The highest frequencies come from the texel grid. With them, the turn for a small lamp would
    waver by up to 2 degrees as the lamp moves from one texel to the next.
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
    """Shift a curve so that its value at `turn_deg` moves to turn 0.

    Args:
        curve: (64,) float64. Values at the grid turns.

    Returns:
        (64,) float64. The band-limited curve at the turns ``turn_deg + 5.625 k``.
    """
    steps = wrap(turn_deg) / _STEP_DEG
    whole = round(steps)
    if abs(steps - whole) < 1e-9:
        return np.roll(curve, -whole)
    series = _Series.around(curve, whole % TURNS).moved(steps - whole)
    right, left = series.fine()
    return np.concatenate([right[::_FINE], left[(_REACH - 1) * _FINE : 0 : -_FINE]])


def value_at(curve: Float64, turn_deg: float) -> float:
    """Return the value of a curve at any turn, by band-limited interpolation.

    Args:
        curve: (64,) float64. Values at the turns 5.625 k degrees.

    Returns:
        The interpolated value. At a grid turn, it is exactly the value in `curve`.
    """
    return float(shift(curve, turn_deg)[0])


def best_index(objective: Float64, eligible: Bools) -> int:
    """Return the index of the grid turn with the largest objective.

    Among turns within `TIE` of the best, the smallest turn wins, and clockwise wins over
    counter-clockwise.

    Args:
        objective: (64,) float64. Values at the grid turns.
        eligible: (64,) bool. Turns that may be chosen. At least one must be True.

    Examples:
        >>> best_index(np.ones(64), np.ones(64, bool))
        0
    """
    return int(best_indices(objective, eligible))


def best_indices(objectives: Float64, eligible: Bools) -> Int64:
    """Return the index chosen by `best_index` for each curve, (...), of (..., 64) objectives."""
    best = np.where(eligible, objectives, -np.inf).max(axis=-1, keepdims=True)
    near = best - TIE * np.abs(objectives).max(axis=-1, keepdims=True)
    ties = eligible & (objectives >= near)
    # Smallest |turn| first; of a pair at equal |turn|, the clockwise one has the smaller index.
    size = np.minimum(np.arange(TURNS), TURNS - np.arange(TURNS))
    return np.asarray(np.where(ties, size, TURNS).argmin(axis=-1), np.int64)


def find_peak(
    objective: Float64,
    index: int,
    gate: Gate | None = None,
    contrast: Float64 | None = None,
    *,
    price: float = 0.0,
    is_open: Bools | None = None,
) -> Peak:
    """Refine a maximum between grid turns, and find its tolerance arc and the turn to offer.

    Without a price, the maximum itself is offered, as in the paper. With a price, the middle of the
    arc is offered if that costs less than the price. Otherwise, the offered turn is as far towards
    the middle as the price allows, but at least `MARGIN` of the arc's width from the nearer end,
    unless the gate closes there.

    Args:
        objective: (64,) float64. Values at the grid turns.
        contrast: (64,) float64. Divisor of the objective if the objective is a match. Light on a
            face changes smoothly with the turn, whereas a match may rise and fall within a step.
        price: Permitted loss for a turn nearer to the middle of the arc, in the same units as the
            objective.
        is_open: (64,) bool. Turns that may be offered. By default, any turn may be.
    """
    turn = turn_of_index(index)
    if float(np.ptp(objective)) <= TIE * float(np.abs(objective).max()):
        return Peak(index, turn, turn, (-180.0, 180.0))
    value = _Series.around(objective, index)
    guard = None if gate is None else _Series.around(gate.curve - gate.limit, index)
    offset = _refine(_between(objective, index, contrast), guard)
    top = turn_of_index(index + offset)
    guard = None if guard is None else guard.moved(offset)
    reach = _reach(value.moved(offset), guard)
    if reach is None:
        return Peak(index, turn, top, (-180.0, 180.0))
    arc = (wrap(top - reach.left * _STEP_DEG), wrap(top + reach.right * _STEP_DEG))
    if price <= 0.0:
        return Peak(index, turn, top, arc)
    free = np.ones(TURNS, bool) if is_open is None else is_open
    aside = _open_limit(index, offset, _toward_middle(value.moved(offset), reach, price), free)
    steps = _nearest(index, offset + aside, free if gate is None else free & gate.open)
    if steps is None:
        return Peak(index, turn, top, arc)
    index, refined = (index + steps) % TURNS, turn_of_index(index + offset + aside)
    return Peak(index, turn_of_index(index), refined, arc)


def _between(objective: Float64, index: int, contrast: Float64 | None) -> tuple[Float64, Float64]:
    """Return smoothed values at offsets 0, 1/16 ... 1 and at offsets 0, -1/16 ... -1."""
    if contrast is None:
        return _Series.around(objective, index).smooth.fine(1)
    product = _Series.around(objective * contrast, index).smooth.fine(1)
    square = _Series.around(contrast**2, index).smooth.fine(1)
    least = 1e-6 * float(contrast.max()) ** 2
    right, left = (p / np.sqrt(np.maximum(q, least)) for p, q in zip(product, square, strict=True))
    return right, left


def find_peaks(
    objective: Float64,
    index: int,
    gate: Gate | None = None,
    contrast: Float64 | None = None,
    *,
    price: float = 0.0,
    is_open: Bools | None = None,
) -> tuple[Peak, ...]:
    """Find the best turn and its rivals, which are local maxima that stand out by more than 3%.

    Args:
        objective, contrast, price: As in `find_peak`.
        is_open: (64,) bool. Turns that may be offered as the best turn. This does not restrict the
            rivals.

    Returns:
        The chosen peak, followed by the others from best to worst, at most six in all.
    """
    eligible = np.ones(TURNS, bool) if gate is None else gate.open
    heights = np.where(eligible, objective, -np.inf)
    least = ARC_SHARE * float(np.abs(objective).max())
    turns = [k for k in _local_maxima(heights) if k != index]
    rivals = [k for k in turns if _prominence(heights, k) > least]
    rivals.sort(key=lambda k: (-heights[k], min(k, TURNS - k), k))
    best = find_peak(objective, index, gate, contrast, price=price, is_open=is_open)
    others = (find_peak(objective, k, gate, contrast, price=price) for k in rivals)
    return (best, *islice(others, _MAX_PEAKS - 1))


def _local_maxima(heights: Float64) -> list[int]:
    before, after = _rolled(heights, TURNS - 1), _rolled(heights, 1)
    top = np.isfinite(heights) & (heights > before) & (heights >= after)
    return [int(k) for k in top.nonzero()[0]]


def _prominence(heights: Float64, index: int) -> float:
    """Return how far a curve descends from a peak before it climbs higher, in either direction."""
    around = _rolled(heights, index)
    higher = (around > around[0]).nonzero()[0]
    if higher.size == 0:
        return float(np.inf)
    saddles = around[: higher[0]].min(), around[higher[-1] :].min()
    return float(around[0] - max(saddles))


def _refine(values: tuple[Float64, Float64], guard: _Series | None) -> float:
    """Return the offset of the maximum, -1 to 1, reached from 0 without crossing a closed gate.

    Args:
        values: Values of the curve at offsets 0, 1/16 ... 1 and at offsets 0, -1/16 ... -1.
    """
    right, left = values
    if guard is not None:
        right, left = (v[: _open_run(g)] for v, g in zip(values, guard.fine(1), strict=True))
    to_right, to_left = int(np.argmax(right)), int(np.argmax(left))
    start = to_right if right[to_right] >= left[to_left] else -to_left
    around = np.concatenate([values[1][:0:-1], values[0]])
    place = (start + _top(around, start + _FINE)) / _FINE
    if guard is None or guard.at(place) >= 0:
        return place
    inside, outside = start / _FINE, place
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if guard.at(middle) >= 0 else (inside, middle)
    return inside


def _open_run(side: Float64) -> int:
    """Return the number of points before the gate closes. Point 0 is always treated as open."""
    closed = (side[1:] < 0).nonzero()[0]
    return int(closed[0]) + 1 if closed.size else len(side)


def _top(values: Float64, index: int) -> float:
    """Return the offset from the largest of three values to the vertex of their parabola."""
    if not 0 < index < len(values) - 1:
        return 0.0
    before, here, after = values[index - 1 : index + 2].tolist()
    bend = (before + after) - 2 * here
    # At the edge of a gate, the largest value need not be a maximum.
    return min(max(0.5 * (before - after) / bend, -1.0), 1.0) if bend < 0 else 0.0


@dataclass(frozen=True, slots=True)
class _Reach:
    """The tolerance arc's extent on each side, in steps, and whether a grade limits it there."""

    left: float
    right: float
    gate_left: bool
    gate_right: bool


def _reach(value: _Series, guard: _Series | None) -> _Reach | None:
    """Return the extent of the tolerance arc around offset 0, or None if it is the full circle."""
    slack = _around(value)
    top = slack[0]
    right, left = _first_crossings(slack - (top - ARC_SHARE * abs(top)))
    gate_right, gate_left = (np.inf, np.inf) if guard is None else _first_crossings(_around(guard))
    near_left, near_right = min(left, gate_left), min(right, gate_right)
    if near_left >= TURNS or near_right >= TURNS:
        return None
    return _Reach(near_left, near_right, gate_left <= left, gate_right <= right)


def _toward_middle(value: _Series, reach: _Reach, price: float) -> float:
    """Return the offset of the offered turn, in steps from the maximum at 0."""
    middle = 0.5 * (reach.right - reach.left)
    least = value.at(0.0) - price
    if value.at(middle) > least:
        return middle
    side = reach.right if middle < 0 else reach.left
    ends_by_grade = reach.gate_right if middle < 0 else reach.gate_left
    room = MARGIN * (reach.left + reach.right) - side
    start = 0.0 if ends_by_grade else math.copysign(max(room, 0.0), middle)
    if value.at(start) <= least:
        return start
    inside, outside = start, middle
    for _ in range(40):
        here = 0.5 * (inside + outside)
        inside, outside = (here, outside) if value.at(here) > least else (inside, here)
    return inside


def _open_limit(index: int, offset: float, aside: float, is_open: Bools) -> float:
    """Limit a shift if the next grid turn may not be offered."""
    step, last = (1 if aside > 0 else -1), 0
    while abs(last) < _REACH and is_open[(index + last + step) % TURNS]:
        last += step
    return step * min(step * aside, max(step * (last - offset), 0.0))


def _nearest(index: int, offset: float, eligible: Bools) -> int | None:
    """Return the number of steps from `index` to the permitted grid turn nearest to an offset.

    The turn is at most one step from the offset. If there is no such turn, the result is None. If
    two turns are equally near, the one nearer to `index` is chosen, so that mirrored curves give
    mirrored turns.
    """
    middle = round(offset)
    near = [
        step
        for step in (middle - 1, middle, middle + 1)
        if abs(step - offset) <= 1.0 and eligible[(index + step) % TURNS]
    ]
    return min(near, key=lambda step: (round(abs(step - offset), 6), abs(step)), default=None)


def _around(series: _Series) -> Float64:
    """Return the values at offsets 0, 1/16 ... for one full circle."""
    right, left = series.fine()
    return np.concatenate([right, left[-2:0:-1]])


def _first_crossings(slack: Float64) -> tuple[float, float]:
    """Return the clockwise and counter-clockwise offsets at which a curve first falls below 0."""
    back = np.concatenate([slack[:1], slack[:0:-1]])
    return _first_crossing(slack), _first_crossing(back)


def _first_crossing(slack: Float64) -> float:
    """Return the offset at which a curve first falls below 0, or TURNS if it never does."""
    below = (slack[1:] < 0).nonzero()[0]
    if below.size == 0:
        return float(TURNS)
    last = int(below[0])
    before, after = max(float(slack[last]), 0.0), float(slack[last + 1])
    return (last + before / (before - after)) / _FINE
