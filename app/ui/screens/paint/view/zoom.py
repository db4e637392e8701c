"""The zoom box in the corner of the canvas: smaller, how large, larger."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.paint import MIDDLE, box, mix, put_text

_SIDE: Final = 36
_WORDS: Final = 44


class _OnTag(Pressable):
    """A button on the dark plate, whatever the theme."""

    def __init__(self, name: str, shortcut: str, icon: str = "") -> None:
        super().__init__(name)
        self.set_tip(name, shortcut)
        self._icon = icon
        t = theme()
        self.setFixedSize(t.px(_SIDE if icon else _WORDS), t.px(_SIDE))

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        return self.size()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        if self.hovered() or self.isDown():
            fill = mix(t.c.tag, t.c.ontag, 0.24 if self.isDown() else 0.14)
            edge = t.px(2)
            box(painter, self.rect().adjusted(edge, edge, -edge, -edge), t.px(6), fill)
        if self._icon:
            draw_icon(painter, self._icon, self.rect(), t.px(20), t.c.ontag)
        else:
            put_text(painter, self.rect(), self.text(), t.font(12), t.c.ontag, MIDDLE)


class ZoomBox(QWidget):
    """How large the canvas is shown."""

    stepped = Signal(int)
    fitted = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        less = _OnTag("Zoom out", "−", "minus")
        self._words = _OnTag("Fit the head", "0")
        more = _OnTag("Zoom in", "+", "plus")
        less.clicked.connect(lambda: self.stepped.emit(-1))
        more.clicked.connect(lambda: self.stepped.emit(1))
        self._words.clicked.connect(self.fitted)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        for widget in (less, self._words, more):
            row.addWidget(widget)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.adjustSize()

    def set_zoom(self, zoom: float) -> None:
        """Show how large the canvas is.

        Parameters
        ----------
        zoom : float
            Logical pixels per canvas pixel.
        """
        words = f"{round(100 * zoom)} %"
        if words != self._words.text():
            self._words.setText(words)
            self._words.setAccessibleDescription(f"Zoom {words}")
            self._words.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the plate."""
        t = theme()
        box(QPainter(self), self.rect(), t.px(8), t.c.tag)
