"""Drawings of a lamp, by hand: pyqtgraph’s pens grow thin on fine screens, its cells blur."""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPen,
)

from app.core.base.angles import wrap
from app.core.solver.head_shape import HeadShape
from app.core.text import tr
from app.ui.plots.base import Plot, arrow_step, disc, draw_text
from app.ui.plots.geometry import Point
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import box, faint, pen

_LABELS: Final = 24  # height of the line of words below
_ABOVE: Final = 6  # room for the dot where the lamp is raised as far as it goes
_RADIUS: Final = 6
_HATCH: Final = 8
_NAMES: Final = (
    (0.0, tr("behind"), tr("behind")),
    (0.25, tr("sitter’s right (camera left)"), tr("sitter’s right")),
    (0.5, tr("in front"), tr("in front")),
    (0.75, tr("sitter’s left (camera right)"), tr("sitter’s left")),
    (1.0, tr("behind"), tr("behind")),
)


class Sky(Protocol):
    """A map of matches, as it is drawn.

    Attributes:
        tones: (h, w) uint8 or None. Azimuth −180° to 180° to the right, altitude from the top down;
            None draws nothing.
        closed: (h, w) bool or None. Where the lamp may not be held.
        line: (n, 4) float32. Pieces of a line: azimuth and altitude of both ends, deg.
    """

    @property
    def tones(self) -> NDArray[np.uint8] | None:
        """Brightness of the map."""

    @property
    def closed(self) -> NDArray[np.bool_] | None:
        """Where the lamp may not be held."""

    @property
    def line(self) -> NDArray[np.float32]:
        """Pieces of a line."""

    @property
    def half_height_deg(self) -> float:
        """Altitude of the upper edge."""


HIGHEST_DEG: Final = 67.5
"""Altitude that a lamp is raised and lowered to."""

_DOT: Final = 24
_HIT: Final = 40
_BEST: Final = 14
_BULB: Final = 14
_POWER: Final = {Qt.Key.Key_PageUp: 1, Qt.Key.Key_PageDown: -1}


class Heads(Protocol):
    """A lamp around a head, as it is drawn: metres and degrees.

    Attributes:
        shape: Outlines of the head; None draws nothing.
        best: tuple of float or None. Best azimuth and altitude.
        place_light_deg: From where the place itself lights the face; None for all around.
    """

    @property
    def shape(self) -> HeadShape | None:
        """Outlines of the head."""

    @property
    def distance_m(self) -> float:
        """Of the lamp."""

    @property
    def azimuth_deg(self) -> float:
        """Of the lamp."""

    @property
    def altitude_deg(self) -> float:
        """Of the lamp."""

    @property
    def best(self) -> tuple[float, float] | None:
        """Best azimuth and altitude."""

    @property
    def place_light_deg(self) -> float | None:
        """Azimuth of the place's own light."""

    @property
    def spoken(self) -> str:
        """The placement in words."""


class LampPlot(Plot):
    """A drawing on which the lamp can be moved, by mouse or keyboard.

    Arrows move it by 1°, with Shift by 10°: right and left around the head toward the sitter's
    left and right, up and down in altitude. Home goes to the best place, Page Up and Page Down
    turn the lamp up and down.
    """

    moved = Signal(float, float)
    """Azimuth and altitude, deg; many times while dragging."""

    home_asked = Signal()

    power_asked = Signal(int)
    """Up or down by so many stops."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._state: Heads | None = None
        self.dragging = False
        self.setMouseTracking(True)
        self.setToolTip(
            tr(
                "Drag the lamp. Arrows 1°, Shift 10°, Page Up and Down its power, Home "
                "the best place"
            )
        )

    def show_heads(self, state: Heads) -> None:
        """Show the lamp somewhere."""
        if state is not self._state:
            self._state = state
            self.say(tr("Lamp {spoken}", spoken=state.spoken))
            self.update()

    def lamp_place(self) -> Point | None:
        """Middle of the lamp, logical pixels; None while there is none."""
        state = self._state
        if state is None or state.shape is None:
            return None
        return self.place_of(state.azimuth_deg, state.altitude_deg)

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Where a lamp at some place is drawn, logical pixels."""
        raise NotImplementedError

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Give azimuth and altitude that a pointer means, deg."""
        raise NotImplementedError

    def takes(self, point: Point) -> bool:
        """Whether a press here takes the lamp."""
        place = self.lamp_place()
        return place is not None and math.dist(point, place) <= px(_HIT) / 2.0

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the lamp with the keyboard."""
        state, step = self._state, arrow_step(event)
        if state is not None and state.shape is not None and step is not None:
            azimuth, altitude = state.azimuth_deg, state.altitude_deg
            # From a whole number, so that what is shown counts on by whole degrees.
            if step[0]:
                azimuth = round(azimuth) + step[0]
            else:
                altitude = round(altitude) + step[1]
            self.moved.emit(azimuth, min(max(altitude, -HIGHEST_DEG), HIGHEST_DEG))
        elif event.key() == Qt.Key.Key_Home:
            self.home_asked.emit()
        elif event.key() in _POWER:
            self.power_asked.emit(_POWER[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)
            return
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take the lamp."""
        point = (event.position().x(), event.position().y())
        if event.button() == Qt.MouseButton.LeftButton and self.takes(point):
            self.dragging = True
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        else:
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Lead the lamp."""
        point = (event.position().x(), event.position().y())
        if self.dragging:
            self.moved.emit(*self.spot_at(point))
            return
        shape = Qt.CursorShape
        self.setCursor(shape.OpenHandCursor if self.takes(point) else shape.ArrowCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the lamp."""
        if event.button() == Qt.MouseButton.LeftButton and self.dragging:
            self.dragging = False
            self.setCursor(Qt.CursorShape.OpenHandCursor)
        super().mouseReleaseEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Repaint: the lamp shows that keys move it."""
        super().focusInEvent(event)
        self.update()


def draw_lamp(painter: QPainter, place: Point, *, focused: bool = False) -> None:
    """Draw the lamp: an amber dot with a bulb, with an edge that holds on any ground."""
    t = theme()
    radius = px(_DOT) / 2.0
    disc(painter, place, radius, t.c.amberfill, t.c.onamber, 2.0)
    if focused:
        disc(painter, place, radius + 4.0, None, t.c.focus, 2.0)
    side = px(_BULB)
    spot = QRectF(place[0] - side / 2.0, place[1] - side / 2.0, side, side)
    draw_icon(painter, "bulb", spot, side, t.c.onamber)


def draw_best(painter: QPainter, place: Point) -> None:
    """Draw the best place: a white ring on black."""
    t = theme()
    radius = px(_BEST) / 2.0
    disc(painter, place, radius, t.c.raised, Qt.GlobalColor.black, 4.0)
    disc(painter, place, radius, t.c.raised, Qt.GlobalColor.white, 2.0)


class SkyMap(LampPlot):
    """A map of 360° by the band of altitudes that is searched.

    Azimuth grows to the right, which is toward the sitter's left as the camera sees it.
    """

    wanted = (616, 136 + _LABELS + _ABOVE)
    least = (280, 72 + _LABELS + _ABOVE)

    def __init__(self) -> None:
        super().__init__(tr("Where the lamp works at this turn"))
        self._sky: Sky | None = None
        self._half_deg = 75.0

    def show_sky(self, sky: Sky) -> None:
        """Show another map."""
        if sky is not self._sky:
            self._sky, self._half_deg = sky, sky.half_height_deg
            self.update()

    @property
    def area(self) -> QRectF:
        """Where the map lies, logical pixels."""
        high = self.height() - px(_LABELS + _ABOVE)
        return QRectF(0.0, px(_ABOVE), self.width(), max(high, 1.0))

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Where a direction lies, logical pixels."""
        area, half = self.area, self._half_deg
        return (
            area.left() + (wrap(azimuth_deg) + 180.0) / 360.0 * area.width(),
            area.top() + (half - altitude_deg) / (2.0 * half) * area.height(),
        )

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Read a direction, deg."""
        area, half = self.area, self._half_deg
        across = min(max((point[0] - area.left()) / area.width(), 0.0), 1.0)
        down = min(max((point[1] - area.top()) / area.height(), 0.0), 1.0)
        return across * 360.0 - 180.0, half - 2.0 * half * down

    def takes(self, point: Point) -> bool:
        """Anywhere on the map: the lamp comes to the pointer."""
        ready = self._state is not None and self._state.shape is not None
        return ready and self.area.contains(QPointF(*point))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take the lamp, and bring it here."""
        super().mousePressEvent(event)
        if self.dragging:
            self.moved.emit(*self.spot_at((event.position().x(), event.position().y())))

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the map from the cache, then the lamp."""
        t, area = theme(), self.area
        size = area.size().toSize()
        shown = self._sky is not None and self._sky.tones is not None
        if not shown:
            box(painter, area, px(_RADIUS), t.c.well)
        else:
            key = id(self._sky)
            painter.drawPixmap(
                0, round(area.top()), self.kept("sky", key, size, ratio, self._draw_sky)
            )
        self._draw_names(painter)
        state = self._state
        if not shown or state is None or state.shape is None:
            return
        place = self.place_of(state.azimuth_deg, state.altitude_deg)
        if state.best is not None:
            draw_best(painter, self.place_of(*state.best))
        draw_lamp(painter, place, focused=self.hasFocus())

    def _draw_sky(self, painter: QPainter) -> None:
        area, sky = self.area, self._sky
        assert sky is not None
        assert sky.tones is not None
        painter.translate(-area.topLeft())
        clip = QPainterPath()
        clip.addRoundedRect(area, px(_RADIUS), px(_RADIUS))
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        tones = np.ascontiguousarray(sky.tones)
        height, width = tones.shape
        image = QImage(tones.data, width, height, width, QImage.Format.Format_Grayscale8)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(Qt.GlobalColor.black)
        painter.drawPath(clip)
        # Only where the rounded plate is: a clip would leave jagged corners.
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceIn)
        painter.drawImage(area, image.copy())
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceAtop)
        if sky.closed is not None:
            self._draw_closed(painter, area, sky.closed)
        lines = [QLineF(*ends) for ends in self._raw(sky.line).tolist()]
        for colour, wide in ((Qt.GlobalColor.black, 4.0), (Qt.GlobalColor.white, 1.75)):
            painter.setPen(pen(colour, wide, ends="round"))
            painter.drawLines(lines)

    def _raw(self, line: NDArray[np.float32]) -> NDArray[np.float32]:
        """As `place_of` for (n, 4) ends, without wrapping: a line may end at either edge."""
        area, half = self.area, self._half_deg
        ends = np.empty_like(line)
        ends[:, ::2] = area.left() + (line[:, ::2] + 180.0) / 360.0 * area.width()
        ends[:, 1::2] = area.top() + (half - line[:, 1::2]) / (2.0 * half) * area.height()
        return ends

    def _draw_closed(self, painter: QPainter, area: QRectF, closed: NDArray[np.bool_]) -> None:
        """Hatch where the lamp may not be held."""
        rows, columns = closed.shape
        path = QPainterPath()
        wide, tall = area.width() / columns, area.height() / rows
        edges = np.diff(np.pad(closed.astype(np.int8), ((0, 0), (1, 1))))
        # Row by row from where it begins to where it ends.
        runs = zip(*np.nonzero(edges == 1), np.nonzero(edges == -1)[1], strict=True)
        for row, begin, end in runs:
            place = QRectF(begin * wide, row * tall, (end - begin) * wide + 0.01, tall + 0.01)
            path.addRect(place.translated(area.topLeft()))
        painter.save()
        painter.setClipPath(path.simplified())
        painter.fillRect(area, faint(Qt.GlobalColor.black, 0.55))
        painter.setPen(QPen(faint(Qt.GlobalColor.white, 0.35), 1.0))
        for start in range(int(-area.height()), int(area.width()), px(_HATCH)):
            low, high = QPointF(start, area.bottom()), QPointF(start + area.height(), area.top())
            painter.drawLine(low, high)
        painter.restore()

    def _draw_names(self, painter: QPainter) -> None:
        t, font = theme(), theme().font(12)
        painter.setFont(font)
        # A quarter of the width holds the word at an end and half of the one beside it.
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
