"""Changes that a stroke makes to the canvas, stored by tile for undo and redo."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Float32
from app.core.painting.canvas import Canvas, Region

TILE: Final = 64
"""Side of a tile, in canvas pixels. Tiles at the right and lower edges may be smaller."""

_LAYERS: Final = ("weights", "ignore")


@dataclass(frozen=True, slots=True, eq=False)
class Tile:
    """Part of one layer, before and after a stroke."""

    layer: str
    # column, row: in tiles, so that the left edge is at 64 times the column
    column: int
    row: int
    # before, after: (h, w)
    before: Float32 = field(repr=False)
    after: Float32 = field(repr=False)

    @property
    def region(self) -> Region:
        """Region of the canvas that the tile covers."""
        left, top = self.column * TILE, self.row * TILE
        height, width = self.before.shape
        return Region(left, top, left + width, top + height)


@dataclass(frozen=True, slots=True, eq=False)
class TileChange:
    """All changes made by a stroke."""

    tiles: tuple[Tile, ...]

    @property
    def nbytes(self) -> int:
        """Memory used by the change, in bytes."""
        return sum(tile.before.nbytes + tile.after.nbytes for tile in self.tiles)

    @property
    def regions(self) -> tuple[Region, ...]:
        """Parts of the canvas that have changed."""
        regions = {(tile.column, tile.row): tile.region for tile in self.tiles}
        return tuple(regions.values())

    def __bool__(self) -> bool:
        """Return whether the stroke changed anything."""
        return bool(self.tiles)


def difference(before: Canvas, after: Canvas) -> TileChange:
    """Find the tiles in which two canvases differ."""
    tiles: list[Tile] = []
    for layer in _LAYERS:
        old, new = getattr(before, layer), getattr(after, layer)
        if old is new:
            continue
        differs = old != new
        rows, columns = (np.flatnonzero(differs.any(axis=axis)) // TILE for axis in (1, 0))
        for row in dict.fromkeys(rows.tolist()):
            for column in dict.fromkeys(columns.tolist()):
                place = (_span(row), _span(column))
                if differs[place].any():
                    pair = old[place].copy(), new[place].copy()
                    tiles.append(Tile(layer, column, row, *pair))
    return TileChange(tuple(tiles))


def apply(canvas: Canvas, change: TileChange) -> Canvas:
    """Redo a change.

    The canvas is then identical, bit for bit, to the canvas after the change.

    Raises:
        ValueError: If the canvas is not in its state before the change.
    """
    return _exchange(canvas, [(tile, tile.before, tile.after) for tile in change.tiles])


def revert(canvas: Canvas, change: TileChange) -> Canvas:
    """Undo a change. This function reverses `apply` and raises the same errors."""
    return _exchange(canvas, [(tile, tile.after, tile.before) for tile in change.tiles])


def cleared(canvas: Canvas) -> tuple[Canvas, TileChange]:
    """Restore, as a single change, the layers from which a canvas started."""
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
