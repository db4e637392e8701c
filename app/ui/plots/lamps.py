"""The base class of drawings in which a lamp is moved with the mouse or the keyboard."""

from __future__ import annotations

import math
from typing import Final, Protocol

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
)

from app.core.solver.head_shape import HeadShape
from app.core.text import tr
from app.ui.plots.parts.base import Plot, arrow_step, disc
from app.ui.plots.parts.geometry import Point
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon

HIGHEST_DEG: Final = 67.5
"""Largest angle of a lamp above or below head level, in degrees."""

_DOT: Final = 24
_HIT: Final = 40
_BEST: Final = 14
_BULB: Final = 14
_POWER: Final = {Qt.Key.Key_PageUp: 1, Qt.Key.Key_PageDown: -1}


class Heads(Protocol):
    """The position of a lamp around a head, in metres and degrees.

    Attributes:
        shape: Outlines of the head, or None to draw nothing.
        best: Best azimuth and altitude in degrees, or None if there is no best position.
        place_light_deg: Azimuth from which the place's own light reaches the face, in degrees, or
            None if the light comes from all around.
    """

    @property
    def shape(self) -> HeadShape | None:
        """Outlines of the head, or None to draw nothing."""

    @property
    def distance_m(self) -> float:
        """Distance of the lamp from the head, in metres."""

    @property
    def azimuth_deg(self) -> float:
        """Azimuth of the lamp, in degrees."""

    @property
    def altitude_deg(self) -> float:
        """Altitude of the lamp, in degrees."""

    @property
    def best(self) -> tuple[float, float] | None:
        """Best azimuth and altitude, in degrees, or None if there is no best position."""

    @property
    def place_light_deg(self) -> float | None:
        """Azimuth of the place's own light, in degrees, or None if there is no main direction."""

    @property
    def spoken(self) -> str:
        """Position of the lamp in words, for screen readers."""


class LampPlot(Plot):
    """A drawing whose lamp can be moved with the mouse and the keyboard.

    The arrow keys move the lamp by 1°, or by 10° with Shift. The left and right arrows move it
    around the head towards the sitter's right and left, and the up and down arrows change its
    altitude. Home moves it to the best position, and Page Up and Page Down change its power.
    """

    moved = Signal(float, float)
    """Emitted with the azimuth and the altitude, in degrees, repeatedly during a drag."""

    home_asked = Signal()

    power_asked = Signal(int)
    """Emitted with a change of power in stops."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._state: Heads | None = None
        self.dragging = False
        self.setMouseTracking(True)
        self.setToolTip(
            tr(
                "Drag the lamp. Arrow keys: 1°, or 10° with Shift. Page Up and Page Down: power. "
                "Home: best position"
            )
        )

    def show_heads(self, state: Heads) -> None:
        """Show the lamp and the head."""
        if state is not self._state:
            self._state = state
            self.say(tr("Lamp {spoken}", spoken=state.spoken))
            self.lamp_moved()

    def lamp_moved(self) -> None:
        """Update the drawing after the lamp has moved."""
        self.update()

    def lamp_place(self) -> Point | None:
        """Return the centre of the lamp, in logical pixels, or None if there is no head."""
        state = self._state
        if state is None or state.shape is None:
            return None
        return self.place_of(state.azimuth_deg, state.altitude_deg)

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Return the position of a lamp in the drawing, in logical pixels."""
        raise NotImplementedError

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Return the azimuth and the altitude at a pointer position, in degrees."""
        raise NotImplementedError

    def takes(self, point: Point) -> bool:
        """Return whether pressing the mouse at a point grabs the lamp."""
        place = self.lamp_place()
        return place is not None and math.dist(point, place) <= px(_HIT) / 2.0

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the lamp with the keyboard."""
        state, step = self._state, arrow_step(event)
        if state is not None and state.shape is not None and step is not None:
            azimuth, altitude = state.azimuth_deg, state.altitude_deg
            # Start from a whole number, so that the display changes by whole degrees.
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
        """Grab the lamp."""
        point = (event.position().x(), event.position().y())
        if event.button() == Qt.MouseButton.LeftButton and self.takes(point):
            self.dragging = True
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        else:
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the lamp."""
        point = (event.position().x(), event.position().y())
        if self.dragging:
            self.moved.emit(*self.spot_at(point))
            return
        shape = Qt.CursorShape
        self.setCursor(shape.OpenHandCursor if self.takes(point) else shape.ArrowCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the lamp."""
        if event.button() == Qt.MouseButton.LeftButton and self.dragging:
            self.dragging = False
            self.setCursor(Qt.CursorShape.OpenHandCursor)
        super().mouseReleaseEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Repaint the lamp to show that the drawing has the focus."""
        super().focusInEvent(event)
        self.update()


def draw_lamp(painter: QPainter, place: Point, *, focused: bool = False) -> None:
    """Draw the lamp as an amber dot with a bulb, and an edge that stands out on any background."""
    t = theme()
    radius = px(_DOT) / 2.0
    disc(painter, place, radius, t.c.amberfill, t.c.onamber, 2.0)
    if focused:
        disc(painter, place, radius + 4.0, None, t.c.focus, 2.0)
    side = px(_BULB)
    spot = QRectF(place[0] - side / 2.0, place[1] - side / 2.0, side, side)
    draw_icon(painter, "bulb", spot, side, t.c.onamber)


def draw_best(painter: QPainter, place: Point) -> None:
    """Draw the best position as a white ring with a black edge."""
    t = theme()
    radius = px(_BEST) / 2.0
    disc(painter, place, radius, t.c.raised, Qt.GlobalColor.black, 4.0)
    disc(painter, place, radius, t.c.raised, Qt.GlobalColor.white, 2.0)
