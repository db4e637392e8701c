"""How large the canvas is seen, and which part of it: the mapping, and the box in its corner."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.theme import Theme, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import MIDDLE, Painted, box, mix, put_text

if TYPE_CHECKING:
    from app.core.painting.canvas import Region

_SIDE: Final = 36
_WIDE: Final = 44
SMALLEST: Final = 0.5
LARGEST: Final = 8.0
"""Logical pixels per canvas pixel."""

_SHOWN_HEIGHT: Final = 0.95  # of the picture: crown to neck; the shoulders may be cut off
_SHOWN_WIDTH: Final = 0.75
_ABOVE: Final = 0.06  # of the height, over the crown


@dataclass(frozen=True, slots=True)
class Viewing:
    """A mapping from canvas to widget.

    Attributes:
        zoom: Logical pixels per canvas pixel.
        left, top: Where the canvas has its upper left corner, logical pixels of the widget.
    """

    zoom: float = 1.0
    left: float = 0.0
    top: float = 0.0

    def to_canvas(self, x: float, y: float) -> tuple[float, float]:
        """Canvas pixel under a point of the widget."""
        return (x - self.left) / self.zoom, (y - self.top) / self.zoom

    def to_widget(self, x: float, y: float) -> tuple[float, float]:
        """Point of the widget where a canvas pixel lies."""
        return self.left + x * self.zoom, self.top + y * self.zoom

    def area(self, region: Region) -> tuple[float, float, float, float]:
        """Left, top, width and height of a part of the canvas, logical pixels of the widget."""
        left, top = self.to_widget(region.left, region.top)
        width, height = region.right - region.left, region.bottom - region.top
        return left, top, width * self.zoom, height * self.zoom

    def moved(self, dx: float, dy: float) -> Viewing:
        """Return it shifted by logical pixels."""
        return replace(self, left=self.left + dx, top=self.top + dy)

    def zoomed(self, zoom: float, x: float, y: float) -> Viewing:
        """Return it at another zoom; what lies under a point of the widget stays there."""
        wanted = min(max(zoom, SMALLEST), LARGEST)
        at = self.to_canvas(x, y)
        return Viewing(wanted, x - at[0] * wanted, y - at[1] * wanted)

    def held(self, width: float, height: float, size: int) -> Viewing:
        """Return it shifted so that the middle of the widget lies on the canvas."""
        x, y = self.to_canvas(width / 2, height / 2)
        dx, dy = x - min(max(x, 0.0), size), y - min(max(y, 0.0), size)
        return self.moved(dx * self.zoom, dy * self.zoom)


def fitting(width: float, height: float, size: int) -> Viewing:
    """Show the head as large as it fits, in steps of 10 %.

    The widget's width and height are logical pixels, `size` is the side of the canvas.
    """
    room = min(height / (size * _SHOWN_HEIGHT), width / (size * _SHOWN_WIDTH))
    zoom = min(max(int(room * 10 + 1e-9) / 10, SMALLEST), LARGEST)
    return Viewing(zoom, (width - size * zoom) / 2, height * _ABOVE)


class _OnTag(Pressable):
    """A button on the dark plate, whatever the theme."""

    def __init__(self, name: str, shortcut: str, icon: str = "") -> None:
        super().__init__(name)
        self.set_tip(name, shortcut)
        self._icon = icon
        t = theme()
        self.setFixedSize(t.px(_SIDE if icon else _WIDE), t.px(_SIDE))

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        return self.size()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        if self.hovered() or self.isDown():
            fill = mix(t.c.tag, t.c.ontag, 0.24 if self.isDown() else 0.14)
            edge = t.px(2)
            box(painter, self.rect().adjusted(edge, edge, -edge, -edge), t.px(6), fill)
        if self._icon:
            draw_icon(painter, self._icon, self.rect(), t.px(20), t.c.ontag)
        else:
            put_text(painter, self.rect(), self.text(), t.font(12), t.c.ontag, MIDDLE)


class ZoomBox(Painted):
    """How large the canvas is shown."""

    stepped = Signal(int)
    fitted = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        less = _OnTag(tr("Zoom out"), "−", "minus")
        self._words = _OnTag(tr("Fit the head"), "0")
        more = _OnTag(tr("Zoom in"), "+", "plus")
        less.clicked.connect(lambda: self.stepped.emit(-1))
        more.clicked.connect(lambda: self.stepped.emit(1))
        self._words.clicked.connect(self.fitted)
        row(less, self._words, more, into=self)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.adjustSize()

    def set_zoom(self, zoom: float) -> None:
        """Show how large the canvas is.

        `zoom`: logical pixels per canvas pixel.
        """
        words = f"{round(100 * zoom)} %"
        if words != self._words.text():
            self._words.setText(words)
            self._words.setAccessibleDescription(tr("Zoom {percent}", percent=words))
            self._words.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the plate."""
        box(painter, self.rect(), t.px(8), t.c.tag)
