"""The marker's grip, and the scale below a panorama.

The scale is painted here because pyqtgraph would cut off its labels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QPoint, QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QAccessible,
    QColor,
    QFocusEvent,
    QFontMetricsF,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPainterPath,
)
from PySide6.QtWidgets import QWidget

from app.core.base.angles import difference
from app.core.text import tr
from app.ui.plots.parts.base import arrow_step, draw_text, polygon, snap
from app.ui.plots.parts.mapping import Viewport, label_step
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import give_role
from app.ui.widgets.paint import PaintedWidget, box, pen
from app.words.phrases.turns import signed

_HEIGHT: Final = 36
_ICON: Final = 16
_PADDING: Final = 15
_GAP: Final = 8


class MarkerGrip(PaintedWidget):
    """An amber pill with an icon of a person, text and a drag handle.

    The arrow keys move the marker by 1°, or by 10° with Shift. Enter keeps the new position, and
    Esc restores the old one.
    """

    dragged = Signal(QPoint)
    """Emitted while the grip is being dragged, with a position in the parent's coordinates."""

    dropped = Signal()
    """Emitted when the grip is released or Enter is pressed."""

    stepped = Signal(float)
    """Emitted when an arrow key is pressed, with the step in degrees, positive clockwise."""

    home = Signal()
    """Emitted when Home or Esc is pressed, to move the marker back."""

    left = Signal()
    """Emitted when the grip loses the focus."""

    def __init__(self, words: str, parent: QWidget) -> None:
        super().__init__(parent)
        give_role(self, QAccessible.Role.Slider)
        self._words = words
        self._moving = ""
        self.held = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.setToolTip(
            tr("Drag to where you stand (M). Arrow keys: 1°, or 10° with Shift. Enter: keep")
        )
        self.set_words(words)

    def set_words(self, words: str) -> None:
        """Set the text shown at rest, such as "You face this way now"."""
        self._words = words
        self.setAccessibleName(words)
        self.resize(self.sizeHint())
        self.update()

    def set_moving(self, words: str) -> None:
        """Set the text shown during a move, or return to the text at rest if `words` is empty."""
        if words != self._moving:
            self._moving = words
            self.setAccessibleDescription(words)
            self.update()

    @property
    def text(self) -> str:
        """The text on the grip."""
        return self._moving or self._words

    def sizeHint(self) -> QSize:
        """Return the size of the pill with its text at rest, which it keeps during a move."""
        text = QFontMetricsF(theme().font(14, 600)).horizontalAdvance(self._words)
        parts = 2 * _PADDING + 2 * _ICON + 2 * _GAP
        return QSize(px(parts) + round(text), px(_HEIGHT))

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle and the corner radius of the focus ring."""
        return self.rect(), self.height() // 2

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the pill."""
        area = QRectF(self.rect())
        edge = t.c.onamber if t.contrast else None
        box(painter, area, area.height() / 2.0, t.c.amberfill, edge)
        side, pad = px(_ICON), px(_PADDING)
        top = (self.height() - side) / 2.0
        draw_icon(painter, "person", QRectF(pad, top, side, side), side, t.c.onamber)
        middle = (self.width() / 2.0, self.height() / 2.0)
        draw_text(painter, middle, self.text, t.font(14, 600), t.c.onamber)
        dots = QRectF(self.width() - pad - side, top, side, side)
        draw_icon(painter, "grip", dots, side, t.c.onamber)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the grip."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.held = True

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the grip."""
        if self.held:
            self.dragged.emit(self.mapToParent(event.position().toPoint()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the grip."""
        if self.held and event.button() == Qt.MouseButton.LeftButton:
            self.held = False
            self.dropped.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the marker by a step, confirm or cancel."""
        key = Qt.Key(event.key())
        if (step := arrow_step(event)) and step[0]:
            self.stepped.emit(step[0])
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self._moving:
            self.dropped.emit()
        elif key == Qt.Key.Key_Home or (key == Qt.Key.Key_Escape and self._moving):
            self.home.emit()
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Report the loss of focus."""
        super().focusOutEvent(event)
        self.left.emit()


_RADIUS: Final = 6
_LABEL_ROOM: Final = 72


@dataclass(frozen=True, slots=True)
class SceneLamp:
    """A lamp in the panorama, with the azimuth and elevation of its centre in the file."""

    letter: str
    azimuth_deg: float
    elevation_deg: float


@dataclass(frozen=True, slots=True)
class Marks:
    """The overlays of a panorama, and the azimuth at which the panorama's scale reads 0."""

    front_deg: float
    marker_deg: float | None
    lamps: tuple[SceneLamp, ...]
    grid: bool
    clipped: bool = True


def draw_corners(
    painter: QPainter, area: QRect | QRectF, ground: QColor, radius: int | None = None
) -> None:
    """Round the corners of a picture by painting over them, which is faster than clipping."""
    outer, radius = QRectF(area), radius or px(_RADIUS)
    path = QPainterPath()
    path.addRect(outer)
    path.addRoundedRect(outer, radius, radius)
    painter.fillPath(path, ground)


def draw_scale(painter: QPainter, ratio: float, area: QRect, view: Viewport, marks: Marks) -> None:
    """Paint the scale of azimuths below the picture, with the marker's position in amber."""
    t = theme()
    left, top = area.left(), float(area.bottom() + 1)
    amber = [] if marks.marker_deg is None else view.xs_of(marks.marker_deg)
    labelled = label_step(view.scale, px(_LABEL_ROOM))
    step = max(labelled // 3, 1)
    font = t.font(12)
    metrics = QFontMetricsF(font)
    for tick in view.ticks(marks.front_deg, step, labelled):
        half = t.line_width / 2.0
        x = left + min(max(snap(tick.x, ratio, t.line_width), half), view.width - half)
        painter.setPen(pen(t.c.ctl, t.line_width))
        painter.drawLine(QPointF(x, top), QPointF(x, top + px(8 if tick.label else 4)))
        width = metrics.horizontalAdvance(tick.label)
        near = any(abs(place - tick.x) < width / 2.0 + px(22) for place in amber)
        if tick.label and not near:
            middle = min(max(tick.x, width / 2.0), view.width - width / 2.0)
            draw_text(painter, (left + middle, top + px(18)), tick.label, font, t.c.dim)
    if marks.marker_deg is not None:
        words = signed(difference(marks.marker_deg, marks.front_deg))
        for place in amber:
            _draw_pointer(painter, (left + place, top), area, words)


def _draw_pointer(painter: QPainter, place: tuple[float, float], area: QRect, words: str) -> None:
    """Paint the triangle and the number below the marker."""
    t = theme()
    x, top = place
    half, height = px(7), px(9)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(t.c.amber)
    painter.drawPolygon(
        polygon([(x - half, top + height + 1), (x, top), (x + half, top + height + 1)])
    )
    font = t.font(12, 700)
    room = QFontMetricsF(font).horizontalAdvance(words) / 2.0
    middle = min(max(x, area.left() + room), area.right() + 1 - room)
    draw_text(painter, (middle, top + px(20)), words, font, t.c.amber)
