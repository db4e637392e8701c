"""What all drawings of a lamp share: the dot, by mouse and by keyboard."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Protocol

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPen

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.plots.base import Plot

if TYPE_CHECKING:
    from PySide6.QtGui import QFocusEvent, QKeyEvent, QMouseEvent
    from PySide6.QtWidgets import QWidget

    from app.core.solver.head_shape import HeadShape
    from app.ui.widgets.plots.geometry import Point

HIGHEST_DEG: Final = 67.5
"""Altitude that a lamp is raised and lowered to."""

_DOT: Final = 24
_HIT: Final = 40
_BEST: Final = 14
_BULB: Final = 14
_STEPS: Final = {
    Qt.Key.Key_Left: (-1.0, 0.0),
    Qt.Key.Key_Right: (1.0, 0.0),
    Qt.Key.Key_Up: (0.0, 1.0),
    Qt.Key.Key_Down: (0.0, -1.0),
}
_COARSE: Final = 10.0
_POWER: Final = {Qt.Key.Key_PageUp: 1, Qt.Key.Key_PageDown: -1}


class Heads(Protocol):
    """A lamp around a head, as it is drawn: metres and degrees.

    Attributes
    ----------
    shape : HeadShape or None
        Outlines of the head; None draws nothing.
    best : tuple of float or None
        Best azimuth and altitude.
    place_light_deg : float or None
        From where the place itself lights the face; None for all around.
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

    def __init__(self, name: str, parent: QWidget | None = None) -> None:
        super().__init__(name, parent)
        self._state: Heads | None = None
        self._dragging = False
        self.setMouseTracking(True)
        self.setToolTip(
            "Drag the lamp. Arrows 1°, Shift 10°, Page Up and Down its power, Home the best place"
        )

    def show_heads(self, state: Heads) -> None:
        """Show the lamp somewhere."""
        if state is not self._state:
            self._state = state
            self.say(f"Lamp {state.spoken}")
            self.update()

    @property
    def dragging(self) -> bool:
        """Whether the mouse holds the lamp."""
        return self._dragging

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
        return place is not None and math.dist(point, place) <= theme().px(_HIT) / 2.0

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the lamp with the keyboard."""
        state, step = self._state, _STEPS.get(Qt.Key(event.key()))
        if state is not None and state.shape is not None and step is not None:
            coarse = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
            size = _COARSE if coarse else 1.0
            azimuth, altitude = state.azimuth_deg, state.altitude_deg
            # From a whole number, so that what is shown counts on by whole degrees.
            if step[0]:
                azimuth = round(azimuth) + step[0] * size
            else:
                altitude = round(altitude) + step[1] * size
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
            self._dragging = True
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        else:
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Lead the lamp."""
        point = (event.position().x(), event.position().y())
        if self._dragging:
            self.moved.emit(*self.spot_at(point))
            return
        shape = Qt.CursorShape
        self.setCursor(shape.OpenHandCursor if self.takes(point) else shape.ArrowCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the lamp."""
        if event.button() == Qt.MouseButton.LeftButton and self._dragging:
            self._dragging = False
            self.setCursor(Qt.CursorShape.OpenHandCursor)
        super().mouseReleaseEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Repaint: the lamp shows that keys move it."""
        super().focusInEvent(event)
        self.update()


def draw_lamp(painter: QPainter, place: Point, *, focused: bool = False) -> None:
    """Draw the lamp: an amber dot with a bulb, with an edge that holds on any ground."""
    t = theme()
    radius = t.px(_DOT) / 2.0
    painter.setPen(QPen(t.c.onamber, 2.0))
    painter.setBrush(t.c.amberfill)
    painter.drawEllipse(QPointF(*place), radius, radius)
    if focused:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(t.c.focus, 2.0))
        painter.drawEllipse(QPointF(*place), radius + 4.0, radius + 4.0)
    side = t.px(_BULB)
    spot = QRectF(place[0] - side / 2.0, place[1] - side / 2.0, side, side)
    draw_icon(painter, "bulb", spot, side, t.c.onamber)


def draw_best(painter: QPainter, place: Point) -> None:
    """Draw the best place: a white ring on black."""
    t = theme()
    radius = t.px(_BEST) / 2.0
    painter.setBrush(t.c.raised)
    painter.setPen(QPen(QColor(Qt.GlobalColor.black), 4.0))
    painter.drawEllipse(QPointF(*place), radius, radius)
    painter.setPen(QPen(QColor(Qt.GlobalColor.white), 2.0))
    painter.drawEllipse(QPointF(*place), radius, radius)
