"""Lines, curves and marks at places of the data, as wide on every screen and at every zoom.

A pen of pyqtgraph’s is counted in pixels of the screen: on a fine one its lines grow thin.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF
from PySide6.QtGui import QBrush, QColor, QPainter, QPen, QTransform

from app.ui.plots.base import device_ratio, snap
from app.ui.plots.geometry import Point

Draw: TypeAlias = Callable[[QPainter, Point], object]
"""Paints a mark around its middle, logical pixels."""


def _to_pixels(painter: QPainter) -> QTransform:
    """Let a painter of an item paint in logical pixels; returns from the item's units to them."""
    transform = QTransform(painter.transform())
    painter.resetTransform()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    return transform


class Line(pg.InfiniteLine):  # type: ignore[misc]
    """A line across the plot, upright or level, its pens one upon the other from the widest on."""

    def __init__(self, *pens: QPen, upright: bool = True) -> None:
        super().__init__(angle=90 if upright else 0, pen=pens[0])
        self._pens = pens

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint it on whole pixels of the screen."""
        area = self.boundingRect()
        transform = _to_pixels(painter)
        start, stop = (transform.map(QPointF(x, 0.0)) for x in (area.left(), area.right()))
        ratio, width = device_ratio(painter), self._pens[-1].widthF()
        if self.angle == 90:
            x = snap(start.x(), ratio, width)
            start, stop = QPointF(x, start.y()), QPointF(x, stop.y())
        else:
            y = snap(start.y(), ratio, width)
            start, stop = QPointF(start.x(), y), QPointF(stop.x(), y)
        for pen in self._pens:
            painter.setPen(pen)
            painter.drawLine(start, stop)


class Curve(pg.PlotCurveItem):  # type: ignore[misc]
    """A curve, its pens one upon the other from the widest on; with a fill it is closed."""

    def __init__(self, *pens: QPen, fill: QColor | None = None) -> None:
        super().__init__()
        self._pens, self._fill = pens, fill

    def set_points(self, points: Sequence[Point] | Any, *, pairs: bool = False) -> None:
        """Lead it through other points, (n, 2); `pairs`: as pieces of two points each."""
        places = np.asarray(points, float).reshape(-1, 2)
        self.setData(places[:, 0], places[:, 1], connect="pairs" if pairs else "all")

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint fill and pens."""
        path = _to_pixels(painter).map(self.getPath())
        if self._fill is not None:
            path.closeSubpath()
            painter.fillPath(path, QBrush(self._fill))
        for pen in self._pens:
            painter.strokePath(path, pen)


class Mark(pg.TargetItem):  # type: ignore[misc]
    """A sign of one size at a place of the data, no larger than `size` logical pixels."""

    def __init__(self, draw: Draw, size: float) -> None:
        super().__init__(size=size, symbol="s", movable=False)
        self._draw = draw

    def set_draw(self, draw: Draw) -> None:
        """Show another sign."""
        self._draw = draw
        self.update()

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the sign."""
        middle = _to_pixels(painter).map(QPointF())
        self._draw(painter, (middle.x(), middle.y()))


class Group(pg.ItemGroup):  # type: ignore[misc]
    """Items that are moved, turned and hidden together."""

    def __init__(self, *items: Any) -> None:
        super().__init__()
        # Qt deletes an item that nobody holds.
        self._items = items
        for item in items:
            self.addItem(item)


def around(*pens: QPen) -> Group:
    """Give a line at an azimuth, the group's x, that may stand at both edges of a panorama."""
    lines = [Line(*pens) for _ in range(3)]
    for line, turn in zip(lines, (-360.0, 0.0, 360.0), strict=True):
        line.setPos(turn)
    return Group(*lines)
