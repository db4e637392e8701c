"""Frames: what belongs together, and what can be chosen as a whole."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.paint import box, hover_fill, selected_edge

_RADIUS: Final = 8


class Frame(QWidget):
    """A flat rectangle with an edge, to put a layout into; it cannot be pressed."""

    def __init__(self, fill: str = "panel", edge: str = "line", dashed: bool = False) -> None:
        super().__init__()
        self._fill, self._edge, self._dashed = fill, edge, dashed

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        fill = None if self._fill == "none" else getattr(t.c, self._fill)
        edge = None if self._edge == "none" else getattr(t.c, self._edge)
        if t.contrast and edge is None:
            edge = t.c.line
        width = t.line_width
        box(QPainter(self), self.rect(), t.px(_RADIUS), fill, edge, width, self._dashed)


class Card(Pressable):
    """A frame that can be chosen; derive from it and paint what it shows in `paint_content`."""

    opened = Signal()

    def __init__(self, name: str, dashed: bool = False) -> None:
        super().__init__(name, tip="")
        self._dashed = dashed
        self._selected = False

    def sizeHint(self) -> QSize:
        """Give the size of a style's card."""
        return QSize(theme().px(206), theme().px(138))

    @property
    def selected(self) -> bool:
        """Whether it is the chosen one."""
        return self._selected

    def set_selected(self, selected: bool) -> None:
        """Show whether it is the chosen one."""
        if selected != self._selected:
            self._selected = selected
            self.setAccessibleDescription("chosen" if selected else "")
            self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter chooses and opens it; Space chooses it."""
        super().keyPressEvent(event)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            self.opened.emit()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Open it."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.opened.emit()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the frame in its state, then the content."""
        t = theme()
        c = t.c
        painter = QPainter(self)
        fill, edge, width = c.panel, c.ctl if self._dashed else c.line, t.line_width
        if self._dashed:
            fill = c.bg
        if self.hovered():
            fill = hover_fill(t)
        if self.isDown():
            edge, width = c.ctl, selected_edge(t)
        if self._selected:
            # On white there is no brighter fill: the edge alone is three times as wide.
            fill, edge, width = c.raised, c.sel, 4 if t.contrast else selected_edge(t)
        dashed = self._dashed and not self._selected and not self.isDown()
        box(painter, self.rect(), t.px(_RADIUS), fill, edge, width, dashed)
        self.paint_content(painter)

    def paint_content(self, painter: QPainter) -> None:
        """Paint what the card shows; nothing here."""
