"""The geometry of plots: circles of turns, smooth outlines, arrows and the spacing of labels.

Points are (x, y) in logical pixels, with x to the right and y downward. Turns and azimuths are in
degrees and increase clockwise as seen from above. On a circle, 0 is at the top and 90 is on the
right. This module does not use Qt, which allows every sign to be tested on its own.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import arc_width, at_turn, wrap
from app.core.base.paths import resources

Point: TypeAlias = tuple[float, float]
"""Position (x, y) in logical pixels, with y downward."""

_STEP_DEG: Final = 2.0
_SHARES: Final = np.arange(4.0)[:, None] / 4.0
_BERNSTEIN: Final = np.array([1.0, 3.0, 3.0, 1.0]) * (
    _SHARES ** np.arange(4) * (1.0 - _SHARES) ** np.arange(3, -1, -1)
)
_NECK_DEG: Final = 41.0
_CIRCLE: Final = np.array([at_turn((0.0, 0.0), 1.0, 90.0 + 2.0 * k) for k in range(181)])


@cache
def _half_head() -> list[Point]:
    """Return half the outline of the mean head, seen from above.

    The points are (side, forward) in units of half the head's length.
    """
    outline = json.loads((resources() / "heads" / "outline.json").read_text(encoding="utf-8"))
    return [(float(side), float(front)) for side, front in outline]


def turn_at(centre: Point, point: Point) -> float:
    """Return the turn towards a point, in (-180, 180] degrees. This is the inverse of `at_turn`.

    Examples:
        >>> turn_at((0.0, 0.0), (-3.0, 0.0))
        -90.0
    """
    east, north = point[0] - centre[0], centre[1] - point[1]
    return wrap(math.degrees(math.atan2(east, north)))


def circle(radius: float) -> NDArray[np.float64]:
    """Return a circle around the origin as a (181, 2) array of points, clockwise from the right."""
    return radius * _CIRCLE


def sector(centre: Point, radius: float, arc_deg: tuple[float, float]) -> list[Point]:
    """Return the outline of the sector for a clockwise arc (from, to), which may wrap around.

    The centre comes first, unless the arc is the whole circle.
    """
    extent = arc_width(arc_deg)
    steps = max(math.ceil(extent / _STEP_DEG), 1)
    rim = [at_turn(centre, radius, arc_deg[0] + extent * k / steps) for k in range(steps + 1)]
    return rim if extent >= 360.0 else [centre, *rim]


def value_at(curve: Sequence[float], turn_deg: float) -> float:
    """Return the value of a curve at a turn.

    The curve is sampled at evenly spaced turns starting at 0, and is interpolated between the
    samples.
    """
    count = len(curve)
    place = (turn_deg / 360.0 * count) % count
    low = int(place)
    share = place - low
    return float(curve[low % count] * (1.0 - share) + curve[(low + 1) % count] * share)


@dataclass(frozen=True, slots=True)
class Dial:
    """A round plot of values, which run from 0 at the core around the head to 100 at the rim."""

    centre: Point
    core: float
    rim: float

    def radius(self, value: float) -> float:
        """Return the radius for a value, clamped to the range from 0 to 100."""
        return self.core + (self.rim - self.core) * min(max(value, 0.0), 100.0) / 100.0

    def place(self, turn_deg: float, value: float) -> Point:
        """Return the position of a value at the given turn, in degrees."""
        return at_turn(self.centre, self.radius(value), turn_deg)

    def outline(self, curve: Sequence[float]) -> NDArray[np.float64]:
        """Return the positions of values at evenly spaced turns, clockwise from 0.

        The result is an (n, 2) array.
        """
        values = np.clip(np.asarray(curve, np.float64), 0.0, 100.0)
        radii = self.core + (self.rim - self.core) * values / 100.0
        turns = np.arange(len(radii)) * (2.0 * np.pi / max(len(radii), 1))
        across, up = radii * np.sin(turns), radii * np.cos(turns)
        return np.stack([self.centre[0] + across, self.centre[1] - up], axis=1)


def smooth(points: Sequence[Point] | NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Fit a smooth closed Bezier curve through points.

    The tangent at a point is that of the parabola through the point and its neighbours. Each handle
    is one third as long as the chord. This prevents a loop between a long and a short segment.

    Returns:
        (n, 3, 2). For each point, the two control points of the segment to the next point, followed
        by the next point.
    """
    here = np.asarray(points, np.float64)
    stop = np.roll(here, -1, axis=0)
    chord = stop - here
    ahead = np.sqrt((chord * chord).sum(1, keepdims=True))
    back, before = np.roll(ahead, 1, axis=0), np.roll(chord, 1, axis=0)
    tangent = np.zeros_like(here)
    apart = ((back > 0.0) & (ahead > 0.0))[:, 0]
    share = ahead[apart] / back[apart]
    tangent[apart] = before[apart] * share + chord[apart] / share
    length = np.sqrt((tangent * tangent).sum(1, keepdims=True))
    tangent = np.divide(tangent, length, out=np.zeros_like(here), where=length > 0.0)
    handle = tangent * ahead / 3.0
    other = np.roll(tangent, -1, axis=0) * ahead / 3.0
    return np.stack([here + handle, stop - other, stop], axis=1)


def finely(points: Sequence[Point] | NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return a smooth closed curve through points, sampled four times per point.

    The result is an (n, 2) array.
    """
    if not len(points):
        return np.zeros((0, 2))
    pieces = np.concatenate([np.asarray(points, float)[:, None], smooth(points)], axis=1)
    fine = np.einsum("sk,nkd->nsd", _BERNSTEIN, pieces).reshape(-1, 2)
    return np.concatenate([fine, fine[:1]])


def head_outline(centre: Point, size: float, turn_deg: float) -> list[Point]:
    """Return the outline of the mean head from above, starting at the nose.

    The outline is exactly symmetric about `turn_deg`, and `size` is half the outline's length. Use
    `smooth` to round the outline.
    """
    half = _half_head()
    other = [(-side, front) for side, front in reversed(half[1:-1])]
    angle = math.radians(turn_deg)
    sine, cosine = math.sin(angle) * size, math.cos(angle) * size
    return [
        (centre[0] + side * cosine + front * sine, centre[1] + side * sine - front * cosine)
        for side, front in (*half, *other)
    ]


def hit(places: Sequence[Point], point: Point, reach: float) -> int | None:
    """Return the index of the nearest target within reach of a point, or None if there is none."""
    near = [(math.dist(place, point), index) for index, place in enumerate(places)]
    best = min(near, default=(math.inf, -1))
    return best[1] if best[0] <= reach else None


def spread(
    targets: Sequence[float], widths: Sequence[float], gap: float, low: float, high: float
) -> list[float]:
    """Move overlapping labels apart by equal distances, within the limits of their line.

    `targets` contains the preferred centres of the labels, in any order.
    """
    order = sorted(range(len(targets)), key=lambda index: targets[index])
    middles = [targets[index] for index in order]
    sizes = [widths[index] for index in order]
    for left in range(len(order) - 1):
        least = (sizes[left] + sizes[left + 1]) / 2.0 + gap
        short = least - (middles[left + 1] - middles[left])
        if short > 0.0:
            middles[left] -= short / 2.0
            middles[left + 1] += short / 2.0
    floor = low
    for place, size in enumerate(sizes):
        middles[place] = max(middles[place], floor + size / 2.0)
        floor = middles[place] + size / 2.0 + gap
    ceiling = high
    for place in reversed(range(len(sizes))):
        middles[place] = min(middles[place], ceiling - sizes[place] / 2.0)
        ceiling = middles[place] - sizes[place] / 2.0 - gap
    result = [0.0] * len(order)
    for place, index in enumerate(order):
        result[index] = middles[place]
    return result


@dataclass(frozen=True, slots=True)
class ArrowShape:
    """A thick curved arrow: a band between two radii, from one turn to another, and its head."""

    centre: Point
    inner: float
    outer: float
    start_deg: float
    stop_deg: float
    head: tuple[Point, Point, Point]


def arrow_shape(width: float, height: float, *, clockwise: bool) -> ArrowShape:
    """Fit a thick curved arrow, designed for 320 x 104 pixels, into a box without distorting it."""
    unit = min(width / 320.0, height / 104.0)
    side = 1.0 if clockwise else -1.0
    # The arrowhead is wider than the tail, so centre the whole arrow instead of the circle.
    centre = (width / 2.0 - side * 4.5 * unit, height / 2.0 + 125.0 * unit)
    outer, inner = 170.0 * unit, 142.0 * unit
    base = at_turn(centre, 163.0 * unit, side * _NECK_DEG)
    tip = at_turn(centre, outer, side * 62.0)
    length = math.dist(base, tip)
    half = 40.0 * unit / length
    across = ((tip[1] - base[1]) * half, (base[0] - tip[0]) * half)
    outside = (base[0] + side * across[0], base[1] + side * across[1])
    inside = (base[0] - side * across[0], base[1] - side * across[1])
    # The band extends slightly under the head, so that no seam is visible.
    stop = side * (_NECK_DEG + 2.0)
    return ArrowShape(centre, inner, outer, side * -56.3, stop, (outside, tip, inside))
