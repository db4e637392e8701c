"""The canvas's magnification and visible part, and the zoom box in its corner."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.screens.paint.head_pixels import head_words
from app.ui.theme import Theme, px
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Do, Pressable
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import MIDDLE, PaintedWidget, box, mix, put_text

_SIDE: Final = 36
_WIDE: Final = 44
_LEAST_ZOOM: Final = 0.5
_MOST_ZOOM: Final = 8.0
"""Smallest and largest zoom, in logical pixels per canvas pixel."""

_HEAD_HEIGHT: Final = 0.95  # area of the picture from crown to neck, without shoulders
_HEAD_WIDTH: Final = 0.75
_ABOVE: Final = 0.06  # fraction of the height above the crown


@dataclass(frozen=True, slots=True)
class Viewing:
    """A mapping from the canvas to the widget.

    Attributes:
        zoom: Logical pixels per canvas pixel.
        left, top: Upper left corner of the canvas, in logical pixels of the widget.
    """

    zoom: float = 1.0
    left: float = 0.0
    top: float = 0.0

    def to_canvas(self, x: float, y: float) -> tuple[float, float]:
        """Return the canvas pixel under a point of the widget."""
        return (x - self.left) / self.zoom, (y - self.top) / self.zoom

    def to_widget(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the widget over a canvas pixel."""
        return self.left + x * self.zoom, self.top + y * self.zoom

    def moved(self, dx: float, dy: float) -> Viewing:
        """Return the mapping shifted by a distance in logical pixels."""
        return replace(self, left=self.left + dx, top=self.top + dy)

    def zoomed(self, zoom: float, x: float, y: float) -> Viewing:
        """Return the mapping at another zoom, keeping a point of the widget fixed."""
        new_zoom = min(max(zoom, _LEAST_ZOOM), _MOST_ZOOM)
        at = self.to_canvas(x, y)
        return Viewing(new_zoom, x - at[0] * new_zoom, y - at[1] * new_zoom)

    def within(self, width: float, height: float, size: int) -> Viewing:
        """Return the mapping, shifted if necessary to keep the widget's centre on the canvas."""
        x, y = self.to_canvas(width / 2, height / 2)
        dx, dy = x - min(max(x, 0.0), size), y - min(max(y, 0.0), size)
        return self.moved(dx * self.zoom, dy * self.zoom)


def fitting(width: float, height: float, size: int) -> Viewing:
    """Return the mapping that shows the whole head as large as possible, in zoom steps of 10%.

    Args:
        width, height: Size of the widget, in logical pixels.
        size: Side length of the canvas, in pixels.
    """
    room = min(height / (size * _HEAD_HEIGHT), width / (size * _HEAD_WIDTH))
    zoom = min(max(int(room * 10 + 1e-9) / 10, _LEAST_ZOOM), _MOST_ZOOM)
    return Viewing(zoom, (width - size * zoom) / 2, height * _ABOVE)


class _OnTag(Pressable):
    """A button on the dark plate. It looks the same in all themes."""

    def __init__(self, name: str, shortcut: str, do: Do, icon: str = "") -> None:
        super().__init__(name, do=do)
        self.set_tip(name, shortcut)
        self._icon = icon
        self.preferred_size = (_SIDE if icon else _WIDE, _SIDE)
        self.setFixedSize(self.sizeHint())

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        if self.hovered() or self.isDown():
            fill = mix(t.c.tag, t.c.ontag, 0.24 if self.isDown() else 0.14)
            edge = px(2)
            box(painter, self.rect().adjusted(edge, edge, -edge, -edge), px(6), fill)
        if self._icon:
            draw_icon(painter, self._icon, self.rect(), px(20), t.c.ontag)
        else:
            put_text(painter, self.rect(), self.text(), t.font(12), t.c.ontag, MIDDLE)


class ZoomBox(PaintedWidget):
    """The box with the buttons for the zoom and the viewing angle."""

    stepped = Signal(int)
    fitted = Signal()
    turned = Signal(int)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        step, turn = self.stepped.emit, self.turned.emit
        self._words = _OnTag(tr("Fit the head"), "0", lambda: self.fitted.emit())
        self._yaw = _OnTag(tr("See the head from the front"), "", lambda: turn(0))
        row(
            _OnTag(tr("Turn the head to its right"), ",", lambda: turn(-1), "chevron-left"),
            self._yaw,
            _OnTag(tr("Turn the head to its left"), ".", lambda: turn(1), "chevron-right"),
            8,
            _OnTag(tr("Zoom out"), "−", lambda: step(-1), "minus"),
            self._words,
            _OnTag(tr("Zoom in"), "+", lambda: step(1), "plus"),
            into=self,
        )
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.set_yaw(0.0)
        self.adjustSize()

    def set_yaw(self, yaw_deg: float) -> None:
        """Show the yaw of the head."""
        self._yaw.setText(f"{abs(yaw_deg):.0f}°")
        self._yaw.setAccessibleDescription(head_words(yaw_deg))
        self._yaw.update()

    def set_zoom(self, zoom: float) -> None:
        """Show the zoom, given in logical pixels per canvas pixel."""
        words = f"{round(100 * zoom)}%"
        if words != self._words.text():
            self._words.setText(words)
            self._words.setAccessibleDescription(tr("Zoom {percent}", percent=words))
            self._words.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the plate."""
        box(painter, self.rect(), px(8), t.c.tag)
