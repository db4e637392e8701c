"""The map of the match at every azimuth and altitude of the lamp, drawn with pyqtgraph."""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QMouseEvent, QPainter, QPainterPath, QPen, QResizeEvent, QTransform

from app.core.base.angles import wrap
from app.core.text import tr
from app.ui.plots.lamps import LampPlot, draw_best, draw_lamp
from app.ui.plots.parts.base import draw_text
from app.ui.plots.parts.curve_items import Backdrop, Mark, Overlay, Pieces
from app.ui.plots.parts.geometry import Point
from app.ui.plots.parts.panorama_scale import draw_corners
from app.ui.theme import px, theme
from app.ui.widgets.paint import box, faint, pen

_LABELS: Final = 24  # height of the line of text below
_ABOVE: Final = 6  # room for the dot of a lamp at its highest altitude
_RADIUS: Final = 6
_HATCH: Final = 8
_SIGN: Final = 40  # size of the lamp and of the best position
_NAMES: Final = (
    (0.0, tr("behind"), tr("behind")),
    (0.25, tr("sitter’s right (camera left)"), tr("sitter’s right")),
    (0.5, tr("in front"), tr("in front")),
    (0.75, tr("sitter’s left (camera right)"), tr("sitter’s left")),
    (1.0, tr("behind"), tr("behind")),
)


class Sky(Protocol):
    """A map of matches.

    Attributes:
        tones: (h, w) uint8, or None to draw nothing. Azimuths run from −180° at the left to 180° at
            the right, and the highest altitude is at the top.
        closed: (h, w) bool, or None if no direction is forbidden. True for each direction in which
            the lamp must not be held.
        line: (n, 4) float32. Segments of the contour at the limit. Each row contains the azimuth
            and the altitude of both ends of a segment, in degrees.
    """

    @property
    def tones(self) -> NDArray[np.uint8] | None:
        """Brightness of the map."""

    @property
    def closed(self) -> NDArray[np.bool_] | None:
        """Directions in which the lamp must not be held, or None if no direction is forbidden."""

    @property
    def line(self) -> NDArray[np.float32]:
        """Segments of the contour at the limit."""

    @property
    def half_height_deg(self) -> float:
        """Altitude of the upper edge of the map, in degrees."""


class SkyMap(LampPlot):
    """A map of every azimuth and of the range of altitudes that is searched.

    Azimuth increases to the right, where the camera sees the sitter's left.
    """

    preferred_size = (616, 136 + _LABELS + _ABOVE)
    least = (280, 72 + _LABELS + _ABOVE)

    ground = "bg"
    """Colour of the map's surroundings, used to round the corners of the map."""

    def __init__(self) -> None:
        super().__init__(tr("Where the lamp works at this turn"))
        self._sky: Sky | None = None
        self._half_deg = 75.0
        self._closed, self._cells = QPainterPath(), QSize(1, 1)
        self.panel.paint_changes_only()
        add, black, white = self.panel.add, Qt.GlobalColor.black, Qt.GlobalColor.white
        self._tones = pg.ImageItem(axisOrder="row-major")
        self._line = Pieces(pen(black, 4.0, ends="round"), pen(white, 1.75, ends="round"))
        hatching, corners = Overlay(self._draw_closed), Overlay(self._draw_corners)
        self._map = add(Backdrop(self._tones, hatching, self._line, corners))
        self._best = add(Mark(draw_best, px(_SIGN)))
        self._lamp = add(Mark(lambda *at: draw_lamp(*at, focused=self.hasFocus()), px(_SIGN)))
        self.panel.hide()

    def show_sky(self, sky: Sky) -> None:
        """Show a different map."""
        if sky is self._sky:
            return
        self._sky, half = sky, sky.half_height_deg
        self._half_deg = half
        if sky.tones is not None:
            whole = QRectF(-180.0, -half, 360.0, 2.0 * half)
            self._tones.setImage(sky.tones, levels=(0, 255))
            self._tones.setRect(whole)
            self._line.set_ends(sky.line * (1.0, -1.0, 1.0, -1.0), whole)
            self._closed = QPainterPath() if sky.closed is None else _outline(sky.closed)
            self._cells = QSize(1, 1) if sky.closed is None else QSize(*sky.closed.shape[::-1])
            self._map.changed()
        if self._ready == self.panel.isHidden():
            self.panel.setVisible(self._ready)
            self.update()
        self._look()

    def lamp_moved(self) -> None:
        """Move the lamp and the best position, repainting only the areas around them."""
        state, best = self._state, None
        if state is not None and state.shape is not None:
            best = state.best
            self._lamp.setPos(wrap(state.azimuth_deg), -state.altitude_deg)
        if best is not None:
            self._best.setPos(wrap(best[0]), -best[1])
        self._lamp.setVisible(state is not None and state.shape is not None)
        self._best.setVisible(best is not None)

    @property
    def _ready(self) -> bool:
        return self._sky is not None and self._sky.tones is not None

    @property
    def area(self) -> QRectF:
        """Area of the map in logical pixels."""
        high = self.height() - px(_LABELS + _ABOVE)
        return QRectF(0.0, px(_ABOVE), self.width(), max(high, 1.0))

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Return the position of a direction in logical pixels."""
        area, half = self.area, self._half_deg
        return (
            area.left() + (wrap(azimuth_deg) + 180.0) / 360.0 * area.width(),
            area.top() + (half - altitude_deg) / (2.0 * half) * area.height(),
        )

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Return the azimuth and altitude at a point, in degrees."""
        area, half = self.area, self._half_deg
        across = min(max((point[0] - area.left()) / area.width(), 0.0), 1.0)
        down = min(max((point[1] - area.top()) / area.height(), 0.0), 1.0)
        return across * 360.0 - 180.0, half - 2.0 * half * down

    def takes(self, point: Point) -> bool:
        """Return whether a point is on the map. Pressing there moves the lamp to the point."""
        ready = self._state is not None and self._state.shape is not None
        return ready and self.area.contains(QPointF(*point))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the lamp and move it to the pointer."""
        super().mousePressEvent(event)
        if self.dragging:
            self.moved.emit(*self.spot_at((event.position().x(), event.position().y())))

    def panel_rect(self) -> QRect:
        """Return the whole widget, because the lamp may extend beyond the edge of the map."""
        return self.rect()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show the whole map at every size."""
        super().resizeEvent(event)
        self._look()

    def _look(self) -> None:
        """Show the whole map in its area, leaving room around it for text and half a lamp."""
        area, half = self.area, self._half_deg
        unit = 2.0 * half / area.height()
        whole = QRectF(-180.0, -half - area.top() * unit, 360.0, self.height() * unit)
        self.panel.look_at(whole)

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the text, and an empty well if there is no map."""
        if not self._ready:
            box(painter, self.area, px(_RADIUS), theme().c.well)
        names = self.cached_picture("names", None, self.size(), ratio, self._draw_names)
        painter.drawPixmap(0, 0, names)

    def _draw_closed(self, painter: QPainter, _part: QRect) -> None:
        """Hatch the directions in which the lamp must not be held."""
        if self._closed.isEmpty():
            return
        area, cells = self.area, self._cells
        to_area = QTransform.fromTranslate(area.left(), area.top())
        to_area.scale(area.width() / cells.width(), area.height() / cells.height())
        painter.setClipPath(to_area.map(self._closed), Qt.ClipOperation.IntersectClip)
        painter.fillRect(area, faint(Qt.GlobalColor.black, 0.55))
        painter.setPen(QPen(faint(Qt.GlobalColor.white, 0.35), 1.0))
        starts = range(int(-area.height()), int(area.width()), px(_HATCH))
        top, bottom = area.top(), area.bottom()
        painter.drawLines([QLineF(x, bottom, x + area.height(), top) for x in starts])

    def _draw_corners(self, painter: QPainter, _part: QRect) -> None:
        draw_corners(painter, self.area, getattr(theme().c, self.ground))

    def _draw_names(self, painter: QPainter) -> None:
        t, font = theme(), theme().font(12)
        # Letters are sharp only on an opaque background.
        low = self.rect().adjusted(0, math.ceil(self.area.bottom()), 0, 0)
        painter.fillRect(low, getattr(t.c, self.ground))
        painter.setFont(font)
        # A quarter of the width must hold the label at an end and half of the next one.
        end, side = (painter.fontMetrics().horizontalAdvance(name) for _, name, _ in _NAMES[:2])
        roomy = 4 * end + 2 * side + px(32) < self.width()
        y = self.height() - px(_LABELS) / 2.0 + px(3)
        for share, name, short in _NAMES:
            align = 0.0 if share == 0.0 else 1.0 if share == 1.0 else 0.5
            words = name
            if not roomy:
                wide = self.width() // 4 - px(8)
                words = painter.fontMetrics().elidedText(short, Qt.TextElideMode.ElideRight, wide)
            draw_text(painter, (share * self.width(), y), words, font, t.c.dim, align)


def _outline(closed: NDArray[np.bool_]) -> QPainterPath:
    """Return the outline of the forbidden cells, measured in columns and rows."""
    path = QPainterPath()
    edges = np.diff(np.pad(closed.astype(np.int8), ((0, 0), (1, 1))))
    # one rectangle for each run of cells in a row
    runs = zip(*np.nonzero(edges == 1), np.nonzero(edges == -1)[1], strict=True)
    for row, begin, end in runs:
        path.addRect(QRectF(begin, row, end - begin + 0.01, 1.01))
    return path.simplified()
