"""One stroke of the brush, from pen down to pen up.

Within a stroke, coverage only grows towards its maximum along the path, as in paint programs: a
second pass over an area in the same stroke does not make the paint stronger.

The coverage of a pixel is the brush's profile at that pixel's distance from the path. It therefore
depends neither on the division of the path into segments nor on the number of events.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, TypeAlias

import numpy as np

from app.core.base.arrays import Float32
from app.core.painting.canvas import Canvas, Region, around
from app.core.painting.stroke_undo import TileChange, difference

Point: TypeAlias = tuple[float, float]

LEAST_DIAMETER: Final = 2.0
"""Diameter of the smallest brush, in canvas pixels."""

_RESTING: Final = 1e-6  # canvas pixels: a shorter path counts as none, and cannot be divided by
_EDGE: Final = 1.0  # the hardest edge still fades over a pixel; otherwise it would show steps


class Tool(StrEnum):
    """The effect that a stroke has on the canvas."""

    BRIGHTER = "brighter"
    DARKER = "darker"
    IGNORE = "ignore"
    RESTORE = "restore"


@dataclass(frozen=True, slots=True)
class Brush:
    """Settings of the brush."""

    tool: Tool = Tool.BRIGHTER
    diameter: float = 64.0  # canvas pixels
    strength: float = 0.3  # 0 to 1: how far one stroke goes towards the tool's goal
    softness: float = 0.7  # 0 to 1: fraction of the radius over which the brush fades out
    mirror: bool = False
    pen_pressure: bool = False

    @property
    def radius(self) -> float:
        """Radius, in canvas pixels."""
        return 0.5 * max(self.diameter, LEAST_DIAMETER)

    @property
    def full_radius(self) -> float:
        """Radius of full strength (the dashed inner ring), in canvas pixels."""
        inner = (1.0 - min(max(self.softness, 0.0), 1.0)) * self.radius
        return max(min(inner, self.radius - _EDGE), 0.0)


def reach(start: Point, stop: Point, radius: float, size: int) -> Region:
    """Return the part of a canvas that the brush can touch along a segment of the path.

    Args:
        start, stop: Ends (x, y) of the segment, in canvas pixels from the upper left corner.
        radius: Radius of the brush, in canvas pixels.
    """
    (left, right), (top, bottom) = (sorted(ends) for ends in zip(start, stop, strict=True))
    return Region(
        max(int(np.floor(left - radius)), 0),
        max(int(np.floor(top - radius)), 0),
        min(int(np.ceil(right + radius)), size),
        min(int(np.ceil(bottom + radius)), size),
    )


def cover(brush: Brush, start: Point, stop: Point, region: Region) -> Float32:
    """Return the profile of the brush along a straight segment of the path.

    Args:
        start, stop: Ends (x, y) of the segment, in canvas pixels from the upper left corner. They
            may be equal.
        region: Pixels that the result covers.

    Returns:
        (h, w) float32. The profile at the centres of the region's pixels, which is 1 within
        `full_radius` of the path and fades smoothly to 0 at the radius.
    """
    x = np.arange(region.left, region.right) + (0.5 - start[0])
    y = np.arange(region.top, region.bottom)[:, None] + (0.5 - start[1])
    dx, dy = stop[0] - start[0], stop[1] - start[1]
    length = dx * dx + dy * dy
    if length > _RESTING**2:
        along = (x * (dx / length) + y * (dy / length)).astype(np.float32)
        np.clip(along, 0.0, 1.0, out=along)
        across = x.astype(np.float32) - np.float32(dx) * along
        away = y.astype(np.float32) - np.float32(dy) * along
        distance = across * across
        distance += away * away
    else:
        distance = (x * x + y * y).astype(np.float32)
    np.sqrt(distance, out=distance)
    fade = np.float32(1.0 / (brush.radius - brush.full_radius))
    rest = np.float32(brush.radius) - distance
    rest *= fade
    np.clip(rest, 0.0, 1.0, out=rest)
    # Smoothstep: no visible ring where the fade begins and ends.
    return np.asarray(rest * rest * (np.float32(3.0) - np.float32(2.0) * rest))


_CELL_SHARE: Final = 0.125  # of the radius: length of the path that has one pressure
_LEAST_CELL: Final = 2.0  # canvas pixels


class Stroke:
    """A stroke in progress, on a copy of the canvas.

    The path is divided from its beginning into cells an eighth of the brush's radius long, and the
    largest pressure in a cell applies to all of it. The stroke therefore does not depend on the
    number of events.

    Args:
        x, y: Pen-down position, in canvas pixels from the upper left corner.
        pressure: Pressure of the pen, 0 to 1, which is used only if the brush has `pen_pressure`.
    """

    def __init__(
        self, canvas: Canvas, brush: Brush, x: float, y: float, pressure: float = 1.0
    ) -> None:
        self._before = canvas
        self._brush = brush
        self._weights = canvas.weights.copy()
        self._ignore = canvas.ignore.copy()
        self._shape = np.zeros_like(self._weights)  # profile, whatever the strength
        self._cover = np.zeros_like(self._weights)  # profile times strength times pressure
        self._cell = max(_CELL_SHARE * brush.radius, _LEAST_CELL)
        self._at = self._inside(x, y)
        self._pressure = self._feel(pressure)
        self._length = 0.0
        self._path: list[Point] = [self._at]
        self._strongest = self._pressure
        self.start_regions: tuple[Region, ...] = self._stamp(self._at, self._at)

    @property
    def canvas(self) -> Canvas:
        """A view of the current canvas, which keeps changing until the stroke ends."""
        return replace(self._before, weights=_view(self._weights), ignore=_view(self._ignore))

    def extend(self, x: float, y: float, pressure: float = 1.0) -> tuple[Region, ...]:
        """Extend the stroke in a straight line.

        Args:
            x, y: New position, in canvas pixels. It may be outside the canvas.
            pressure: Pressure at the new position, 0 to 1. It changes linearly along the line.

        Returns:
            The regions that may have changed, or an empty tuple if the position is not a number.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            return ()
        start, first = self._at, self._pressure
        stop, last = self._inside(x, y), self._feel(pressure)
        self._at, self._pressure = stop, last
        length = math.dist(start, stop)
        regions = [] if length else self._press(last)
        done = 0.0
        while done < length:
            upto, closed = self._cell_end(done, length, steady=first == last == self._strongest)
            pressed = [_between(first, last, share / length) for share in (done, upto)]
            regions += self._press(max(pressed))
            end = _along(start, stop, upto / length)
            regions += self._stamp(_along(start, stop, done / length), end)
            self._path.append(end)
            self._length += upto - done
            if closed is not None:
                # A new cell has begun, here or (at steady pressure) a little earlier.
                self._length = upto - closed
                self._path = [_along(start, stop, closed / length), end]
                self._strongest = pressed[1]
            done = upto
        return self._join(regions)

    def commit(self) -> tuple[Canvas, TileChange]:
        """End the stroke, and return the canvas and the change to it."""
        layers = [self._weights, self._ignore]
        for layer in layers:
            layer.setflags(write=False)
        after = replace(self._before, weights=layers[0], ignore=layers[1])
        return after, difference(self._before, after)

    def _inside(self, x: float, y: float) -> Point:
        """Limit distant positions to one canvas size beyond the canvas."""
        size = float(self._before.size)
        if not (math.isfinite(x) and math.isfinite(y)):
            return (-size, -size)
        return min(max(x, -size), 2 * size), min(max(y, -size), 2 * size)

    def _feel(self, pressure: float) -> float:
        if not self._brush.pen_pressure or not math.isfinite(pressure):
            return 1.0
        return min(max(pressure, 0.0), 1.0)

    def _cell_end(self, done: float, length: float, *, steady: bool) -> tuple[float, float | None]:
        """Return how far to draw at one pressure, and the end of the last cell on the way."""
        first_end = done + self._cell - self._length
        if first_end > length:
            return length, None
        if not steady:
            return first_end, first_end
        # With equal pressure in every cell, one piece is enough, however many cells it crosses.
        return length, first_end + (length - first_end) // self._cell * self._cell

    def _press(self, pressure: float) -> list[Region]:
        """Apply a pressure to the whole cell if no pressure in it has been larger so far."""
        if pressure <= self._strongest:
            return []
        self._strongest = pressure
        ends = self._path[1:] or self._path
        return [
            region
            for start, stop in zip(self._path, ends, strict=False)
            for region in self._stamp(start, stop)
        ]

    def _stamp(self, start: Point, stop: Point) -> tuple[Region, ...]:
        size = self._before.size
        region = reach(start, stop, self._brush.radius, size)
        if region.empty:
            return ()
        profile = cover(self._brush, start, stop, region)
        if not self._brush.mirror:
            self._lay(region, profile)
            return (region,)
        twin = region.mirrored(size)
        self._lay(region, profile)
        self._lay(twin, profile[:, ::-1])
        return region, twin

    def _join(self, regions: list[Region]) -> tuple[Region, ...]:
        """Join the regions on each side of the face, since a mirrored brush alternates sides."""
        sides = [regions[::2], regions[1::2]] if self._brush.mirror else [regions]
        return tuple(around(side) for side in sides if side)

    def _lay(self, region: Region, profile: Float32) -> None:
        place = region.slices
        shape, strong = self._shape[place], self._cover[place]
        np.maximum(shape, profile, out=shape)
        strength = min(max(self._brush.strength, 0.0), 1.0) * self._strongest
        np.maximum(strong, profile * np.float32(strength), out=strong)
        before, tool = self._before, self._brush.tool
        weights, ignore = before.weights[place], before.ignore[place]
        if tool is Tool.IGNORE:
            np.maximum(ignore, shape, out=self._ignore[place])
            return
        goal: Float32 | np.float32
        if tool is Tool.RESTORE:
            goal = before.start_weights[place]
            self._ignore[place] = ignore + (before.start_ignore[place] - ignore) * shape
        else:
            goal = np.float32(1.0 if tool is Tool.BRIGHTER else -1.0)
            # Painted areas count again.
            np.minimum(ignore, 1 - shape, out=self._ignore[place])
        self._weights[place] = weights + (goal - weights) * strong


def _between(first: float, last: float, share: float) -> float:
    return first + (last - first) * share


def _along(start: Point, stop: Point, share: float) -> Point:
    if share >= 1:
        return stop
    return _between(start[0], stop[0], share), _between(start[1], stop[1], share)


def _view(layer: Float32) -> Float32:
    view = layer.view()
    view.setflags(write=False)
    return view
