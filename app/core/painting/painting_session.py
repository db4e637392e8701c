"""A painting session, with its strokes and live answers.

Strokes are drawn immediately. The answer is computed when there is time, from the pixels that have
changed since the last answer. Between strokes, everything is recomputed from the canvas, so an
answer depends only on the canvas and not on its history.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from app.core.base.arrays import Bools, Float32, Float64, Indices
from app.core.painting.canvas import (
    IGNORED,
    Advice,
    Canvas,
    Region,
    advice,
    block_means,
    canvas_size,
    make_canvas,
    resized,
    weights_of,
)
from app.core.painting.stroke import Brush, Stroke
from app.core.painting.stroke_undo import TileChange, apply, revert
from app.core.solver.relighting_cache import CountedLight, LightTable, counted_light, table_picture
from app.core.solver.solve import solve_on_table
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS, Limits, Objective
from app.core.solver.weights import PaintedWeights, paint


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The answer for the painted weights."""

    # (H, W), pre-integrated target F (eq. 3) in panorama coordinates at turn 0: positive where
    # light helps, negative where it harms
    preintegrated: Float32 = field(repr=False)
    advice: Advice | None  # what the painting needs before it can be saved
    # best turn, match, strength and curves here, or None if there is no place
    result: StyleResult | None
    # (N, N, 3), linear Rec. 709 picture at the refined best turn on black, in the unit of the
    # environment, or None if there is no place or no colours
    picture: Float32 | None = field(repr=False)


class PaintSession:
    """A canvas with its head and the light of a place. This class is not thread-safe.

    Args:
        front_deg: Azimuth of the photographer at turn 0, in degrees.
    """

    def __init__(
        self,
        transport: Transport,
        canvas: Canvas,
        table: LightTable | None = None,
        *,
        objective: Objective = "picture",
        limits: Limits = LIMITS,
        front_deg: float = 0.0,
    ) -> None:
        self._transport = transport
        self._table = table
        self._front_deg = front_deg
        self._objective: Objective = objective
        self._limits = limits
        place = np.full(transport.size**2, -1)
        place[transport.pixels[transport.face]] = np.flatnonzero(transport.face)
        self._place = place.reshape(transport.size, transport.size)
        self._stroke: Stroke | None = None
        self._dirty: list[Region] = []
        self._count_cache: tuple[Bools, CountedLight] | None = None
        self.replace(canvas)

    @property
    def canvas(self) -> Canvas:
        """The canvas, including the current stroke."""
        return self._canvas if self._stroke is None else self._stroke.canvas

    @property
    def stroking(self) -> bool:
        """Whether a stroke is in progress."""
        return self._stroke is not None

    @property
    def weights(self) -> PaintedWeights:
        """The current weights."""
        if self._dirty:
            self._weights = self._caught_up()
            self._dirty.clear()
        return self._weights

    def set_light(self, table: LightTable | None, front_deg: float = 0.0) -> None:
        """Set the light of a place, or remove the current light if `table` is None.

        Args:
            front_deg: Azimuth of the photographer at turn 0, in degrees.
        """
        self._table, self._front_deg, self._count_cache = table, front_deg, None

    def replace(self, canvas: Canvas) -> None:
        """Replace the canvas and abort the current stroke."""
        size = canvas_size(self._transport)
        if canvas.size != size:
            layers = (canvas.weights, canvas.ignore, canvas.start_weights, canvas.start_ignore)
            canvas = make_canvas(*(resized(layer, size) for layer in layers))
        self._stroke = None
        self._start_afresh(canvas)

    def begin(self, brush: Brush, x: float, y: float, pressure: float = 1.0) -> tuple[Region, ...]:
        """Abort the current stroke, if there is one, and begin a new one.

        Args:
            x, y: Position in canvas pixels from the upper left corner.
            pressure: Pressure of the pen, 0 to 1.

        Returns:
            The changed regions.
        """
        self.abort()
        self._stroke = Stroke(self._canvas, brush, x, y, pressure)
        self._dirty += self._stroke.start_regions
        return self._stroke.start_regions

    def extend(self, x: float, y: float, pressure: float = 1.0) -> tuple[Region, ...]:
        """Extend the current stroke, if any, to a point, with the same arguments as `begin`."""
        if self._stroke is None:
            return ()
        regions = self._stroke.extend(x, y, pressure)
        self._dirty += regions
        return regions

    def commit(self) -> TileChange:
        """End the stroke and return its change for undo, which is empty if there is no stroke."""
        if self._stroke is None:
            return TileChange(())
        canvas, change = self._stroke.commit()
        self._stroke = None
        self._start_afresh(canvas)
        return change

    def abort(self) -> None:
        """Abort the current stroke."""
        if self._stroke is not None:
            self._stroke = None
            self._start_afresh(self._canvas)

    def apply(self, change: TileChange) -> None:
        """Redo a change (see `app.core.painting.stroke.apply`)."""
        self.abort()
        self._start_afresh(apply(self._canvas, change))

    def revert(self, change: TileChange) -> None:
        """Undo a change (see `app.core.painting.stroke.revert`)."""
        self.abort()
        self._start_afresh(revert(self._canvas, change))

    def answer(self) -> Answer:
        """Compute the answer for the canvas: its target and its best turn."""
        weights, table = self.weights, self._table
        target = weights.preintegrated(self._transport)
        missing = advice(self.canvas, weights)
        if table is None:
            return Answer(target, missing, None, None)
        result = solve_on_table(
            table,
            weights,
            self._objective,
            counted=self._counted_now(table, weights.active),
            limits=self._limits,
        )
        picture = None
        if table.pictures is not None:
            picture = table_picture(table, result.turn_refined_deg)
        at_front = result.seen_from(self._front_deg) if self._front_deg else result
        return Answer(target, missing, at_front, picture)

    def _start_afresh(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._weights = weights_of(canvas, self._transport)
        self._dirty.clear()

    def _counted_now(self, table: LightTable, active: Bools) -> CountedLight:
        cache = self._count_cache
        if cache is None or not np.array_equal(cache[0], active):
            cache = self._count_cache = active, counted_light(table, active)
        return cache[1]

    def _caught_up(self) -> PaintedWeights:
        """Return the weights after applying the changes made since the last call."""
        pixels, values, ignored = (
            np.concatenate(parts)
            for parts in zip(*(self._region_changes(region) for region in self._dirty), strict=True)
        )
        pixels, first = np.unique(pixels, return_index=True)
        return paint(self._transport, self._weights, pixels, values[first], ignored[first])

    def _region_changes(self, region: Region) -> tuple[Indices, Float64, Bools]:
        """Return the face pixels that have changed in a region of the canvas, and their values."""
        canvas, size = self.canvas, self._transport.size
        step = canvas.size // size
        part = Region(
            region.left // step,
            region.top // step,
            -(-region.right // step),
            -(-region.bottom // step),
        )
        place = self._place[part.slices]
        on_face = place >= 0
        pixels = place[on_face]
        values = block_means(canvas.weights, size, part)[on_face]
        ignored = block_means(canvas.ignore, size, part)[on_face] >= IGNORED
        before = self._weights
        same = (values == before.values[pixels]) & (ignored == ~before.active[pixels])
        return pixels[~same], values[~same], ignored[~same]
