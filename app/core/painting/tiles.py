"""What a stroke changed, tile by tile, so that it can be taken back and done again exactly."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.painting.canvas import Canvas, Region

Float32: TypeAlias = NDArray[np.float32]

TILE: Final = 64
"""Side of a tile, canvas pixels; those at the right and lower edge may be smaller."""

_LAYERS: Final = ("weights", "ignore")


@dataclass(frozen=True, slots=True, eq=False)
class Tile:
    """A part of one layer before and after.

    Attributes
    ----------
    column, row : int
        Tile coordinates: the tile's left edge is at 64 times the column.
    before, after : (h, w) float32
    """

    layer: str
    column: int
    row: int
    before: Float32 = field(repr=False)
    after: Float32 = field(repr=False)

    @property
    def region(self) -> Region:
        """Where it is on the canvas."""
        left, top = self.column * TILE, self.row * TILE
        height, width = self.before.shape
        return Region(left, top, left + width, top + height)


@dataclass(frozen=True, slots=True, eq=False)
class TileChange:
    """All that a stroke changed."""

    tiles: tuple[Tile, ...]

    @property
    def nbytes(self) -> int:
        """Memory that it takes, bytes."""
        return sum(tile.before.nbytes + tile.after.nbytes for tile in self.tiles)

    @property
    def regions(self) -> tuple[Region, ...]:
        """Parts of the canvas that it changes."""
        found = {(tile.column, tile.row): tile.region for tile in self.tiles}
        return tuple(found.values())

    def __bool__(self) -> bool:
        """Whether anything changed at all."""
        return bool(self.tiles)


def difference(before: Canvas, after: Canvas) -> TileChange:
    """Find the tiles in which two canvases differ."""
    tiles: list[Tile] = []
    for layer in _LAYERS:
        old, new = getattr(before, layer), getattr(after, layer)
        if old is new:
            continue
        changed = old != new
        rows, columns = (np.flatnonzero(changed.any(axis=axis)) // TILE for axis in (1, 0))
        for row in dict.fromkeys(rows.tolist()):
            for column in dict.fromkeys(columns.tolist()):
                place = (_span(row), _span(column))
                if changed[place].any():
                    pair = old[place].copy(), new[place].copy()
                    tiles.append(Tile(layer, column, row, *pair))
    return TileChange(tuple(tiles))


def apply(canvas: Canvas, change: TileChange) -> Canvas:
    """Do a change again.

    Returns
    -------
    Canvas
        As it was after the change, to the last bit.

    Raises
    ------
    ValueError
        If the canvas is not the one that the change began with.
    """
    return _exchange(canvas, [(tile, tile.before, tile.after) for tile in change.tiles])


def revert(canvas: Canvas, change: TileChange) -> Canvas:
    """Take a change back; the reverse of `apply`, with the same errors."""
    return _exchange(canvas, [(tile, tile.after, tile.before) for tile in change.tiles])


def cleared(canvas: Canvas) -> tuple[Canvas, TileChange]:
    """Take all strokes away: back to what the canvas started from, as one change."""
    after = replace(canvas, weights=canvas.start_weights, ignore=canvas.start_ignore)
    return after, difference(canvas, after)


def _span(index: int) -> slice:
    return slice(index * TILE, (index + 1) * TILE)


def _exchange(canvas: Canvas, parts: list[tuple[Tile, Float32, Float32]]) -> Canvas:
    layers = {name: getattr(canvas, name).copy() for name in {tile.layer for tile, _, _ in parts}}
    for tile, old, new in parts:
        place = tile.region.slices
        if not np.array_equal(layers[tile.layer][place], old):
            raise ValueError("the change belongs to another state of the canvas")
        layers[tile.layer][place] = new
    for layer in layers.values():
        layer.setflags(write=False)
    return replace(canvas, **layers)
