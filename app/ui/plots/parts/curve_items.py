"""Lines, curves and marks in data units that keep their widths on any screen and at any zoom.

pyqtgraph measures pens in device pixels, which makes lines too thin on high-resolution screens.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen, QPixmap, QTransform
from PySide6.QtWidgets import QStyleOptionGraphicsItem

from app.ui.plots.parts.base import device_ratio, snap
from app.ui.plots.parts.geometry import Point

Draw: TypeAlias = Callable[[QPainter, Point], object]
"""A function that paints a mark around its centre, which is given in logical pixels."""


def _to_pixels(painter: QPainter) -> QTransform:
    """Switch a painter to logical pixels, and return the transform from the item's units."""
    transform = QTransform(painter.transform())
    painter.resetTransform()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    return transform


class PlotLine(pg.InfiniteLine):  # type: ignore[misc]
    """A vertical or horizontal line across the plot, drawn with one or more pens, widest first."""

    def __init__(self, *pens: QPen, upright: bool = True) -> None:
        super().__init__(angle=90 if upright else 0, pen=pens[0])
        self._pens = pens

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the line, aligned with device pixels."""
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
    """A curve drawn with any number of pens, widest first.

    A curve that has a fill is closed.
    """

    def __init__(self, *pens: QPen, fill: QColor | None = None) -> None:
        super().__init__(pen=_padding(pens))
        self._pens, self._fill = pens, fill

    def set_points(self, points: Sequence[Point] | Any) -> None:
        """Set the points, given as an (n, 2) array."""
        places = np.asarray(points, float).reshape(-1, 2)
        self.setData(places[:, 0], places[:, 1])

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the fill and the pens."""
        path = _to_pixels(painter).map(self.getPath())
        if self._fill is not None:
            path.closeSubpath()
            painter.fillPath(path, QBrush(self._fill))
        for pen in self._pens:
            painter.strokePath(path, pen)


class Pieces(pg.PlotCurveItem):  # type: ignore[misc]
    """Straight line segments, drawn with one or more pens, widest first."""

    def __init__(self, *pens: QPen) -> None:
        super().__init__()
        self._pens = pens
        self._ends = np.zeros((0, 4))
        self._area = QRectF()
        self.setFlag(self.GraphicsItemFlag.ItemUsesExtendedStyleOption)
        self.setFlag(self.GraphicsItemFlag.ItemClipsToShape)

    def set_ends(self, ends: NDArray[np.floating[Any]], area: QRectF) -> None:
        """Set the segments and the area to which they are clipped.

        Args:
            ends: (n, 4). Each row contains the x and y of both ends of a segment.
        """
        self._ends, self._area = np.asarray(ends, float), area
        places = self._ends.reshape(-1, 2)
        self.setData(places[:, 0], places[:, 1], connect="pairs")

    def boundingRect(self) -> QRectF:
        """Return the area to which the segments are clipped."""
        return self._area

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, *_args: object) -> None:
        """Paint only the exposed segments, because painting all of them would take too long."""
        transform = _to_pixels(painter)
        wide = self._pens[0].widthF()
        area = transform.mapRect(option.exposedRect).adjusted(-wide, -wide, wide, wide)
        x, y = self._ends[:, ::2] * transform.m11(), self._ends[:, 1::2] * transform.m22()
        x, y = x + transform.dx(), y + transform.dy()
        visible = (x.max(1) > area.left()) & (x.min(1) < area.right())
        visible &= (y.max(1) > area.top()) & (y.min(1) < area.bottom())
        ends = np.stack([x[visible, 0], y[visible, 0], x[visible, 1], y[visible, 1]], axis=1)
        lines = [QLineF(*each) for each in ends.tolist()]
        for pen in self._pens:
            painter.setPen(pen)
            painter.drawLines(lines)


def _padding(pens: Sequence[QPen]) -> QPen:
    """Return a pen that gives pyqtgraph the total width of a curve's own pens."""
    pen = QPen(pens[0]) if pens else QPen(Qt.PenStyle.NoPen)
    pen.setCosmetic(True)
    return pen


class Mark(pg.TargetItem):  # type: ignore[misc]
    """A sign at a position in data units, at most `size` logical pixels wide and high."""

    def __init__(self, draw: Draw, size: float) -> None:
        self.scale = size
        super().__init__(size=size, symbol="s", movable=False)
        self._draw = draw

    def set_draw(self, draw: Draw) -> None:
        """Show a different sign."""
        self._draw = draw
        self.update()

    def set_size(self, size: float) -> None:
        """Set the size of the sign in logical pixels."""
        if size != self.scale:
            self.prepareGeometryChange()
            self.scale = size
            self.viewTransformChanged()

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the sign."""
        middle = _to_pixels(painter).map(QPointF())
        self._draw(painter, (middle.x(), middle.y()))


class Overlay(pg.UIGraphicsItem):  # type: ignore[misc]
    """A layer between items, which a function paints in logical pixels.

    The function receives the exposed area and need not paint anything outside it.
    """

    def __init__(self, draw: Callable[[QPainter, QRect], object]) -> None:
        super().__init__()
        self._draw = draw
        self.setFlag(self.GraphicsItemFlag.ItemUsesExtendedStyleOption)

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, *_args: object) -> None:
        """Call the function."""
        part = _to_pixels(painter).mapRect(option.exposedRect).toAlignedRect()
        self._draw(painter, part)


class Backdrop(pg.UIGraphicsItem):  # type: ignore[misc]
    """A group of rarely changing items, painted once into a picture of the whole view.

    The scene does not paint these items, so call `changed` after changing any of them.
    """

    def __init__(self, *items: Any) -> None:
        super().__init__()
        self._items = items
        self._key: tuple[QTransform, QRect, float] | None = None
        self._picture = QPixmap()
        for item in items:
            item.setParentItem(self)
            item.hide()

    def changed(self) -> None:
        """Paint the items again."""
        self._key = None
        self.update()

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the cached picture."""
        transform = _to_pixels(painter)
        area, ratio = self.getViewWidget().rect(), device_ratio(painter)
        if (transform, area, ratio) != self._key:
            self._key = (transform, area, ratio)
            if self._picture.size() != area.size() * ratio:
                self._picture = QPixmap(area.size() * ratio)
            self._picture.setDevicePixelRatio(ratio)
            self._picture.fill(Qt.GlobalColor.transparent)
            inner = QPainter(self._picture)
            inner.setRenderHints(painter.renderHints())
            inner.setLayoutDirection(painter.layoutDirection())
            for item in self._items:
                option, flags = QStyleOptionGraphicsItem(), item.flags()
                inner.save()
                inner.setTransform(item.itemTransform(self)[0] * transform)
                if flags & item.GraphicsItemFlag.ItemUsesExtendedStyleOption:
                    option.exposedRect = item.boundingRect()
                if flags & item.GraphicsItemFlag.ItemClipsToShape:
                    inner.setClipRect(item.boundingRect())
                item.paint(inner, option, None)
                inner.restore()
            inner.end()
        painter.drawPixmap(0, 0, self._picture)


class Group(pg.ItemGroup):  # type: ignore[misc]
    """A group of items that are moved, turned and hidden together."""

    def __init__(self, *items: Any) -> None:
        super().__init__()
        # Keep references, because Qt deletes items that have none.
        self._items = items
        for item in items:
            self.addItem(item)


class MarkGroup(pg.ItemGroup):  # type: ignore[misc]
    """A group of marks whose number can change."""

    def __init__(self) -> None:
        super().__init__()
        self.marks: list[Mark] = []

    def show_marks(self, signs: Sequence[tuple[Point, Draw, float]]) -> None:
        """Set the position, the painter and the size of each mark."""
        while len(self.marks) < len(signs):
            self.marks.append(Mark(signs[0][1], 0.0))
            self.addItem(self.marks[-1])
        while len(self.marks) > len(signs):
            mark = self.marks.pop()
            mark.setParentItem(None)
            if mark.scene() is not None:
                mark.scene().removeItem(mark)
        for mark, (place, draw, size) in zip(self.marks, signs, strict=True):
            mark.set_draw(draw)
            mark.set_size(size)
            mark.setPos(*place)


def around(*pens: QPen) -> Group:
    """Return a group that contains a vertical line at the azimuth given by the group's x.

    The line is repeated one full turn to each side. It can therefore appear at both edges of a
    panorama.
    """
    lines = [PlotLine(*pens) for _ in range(3)]
    for line, turn in zip(lines, (-360.0, 0.0, 360.0), strict=True):
        line.setPos(turn)
    return Group(*lines)
