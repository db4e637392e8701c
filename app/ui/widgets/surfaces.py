"""Surfaces: areas, frames, cards, dividers, menus and scroll areas."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QAction, QColor, QKeyEvent, QMouseEvent, QPainter, QPalette
from PySide6.QtWidgets import QFrame, QLayout, QMenu, QScrollArea, QSizePolicy, QWidget
from shiboken6 import isValid

from app.core.base.visible_text import visible
from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import icon
from app.ui.theme.style import dress_bars, dress_menu
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.displays import Picture
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import PaintedWidget, box, hover_fill, selected_edge


class Menu(QMenu):
    """A menu with round corners; entries have an icon, and a tool tip if they are disabled."""

    def __init__(self, parent: QWidget, name: str = tr("Menu")) -> None:
        super().__init__(parent)
        dress_menu(self)
        self.setToolTipsVisible(True)
        self.setFont(theme().font(14))
        self.setAccessibleName(name)

    def add(
        self,
        text: str,
        do: Callable[[], None],
        icon_name: str = "",
        shortcut: str = "",
        why: str = "",
    ) -> QAction:
        """Add an entry."""
        # In a title these are letters, not the sign of a key and of a column.
        plain = visible(text).replace("&", "&&").replace("\t", " ")
        action = self.addAction(f"{plain}\t{shortcut}" if shortcut else plain)
        if icon_name:
            action.setIcon(icon(icon_name))
        action.setEnabled(not why)
        action.setToolTip(visible(why))
        action.triggered.connect(lambda _on=False: do())
        return action

    def drop(self, under: QWidget) -> None:
        """Open it under a widget without waiting for an answer."""
        self.popup(under.mapToGlobal(QPoint(0, under.height() + px(4))))


class Divider(PaintedWidget):
    """A line as wide as edges are, between rows."""

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(theme().line_width)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        painter.fillRect(self.rect(), t.c.line)


_RADIUS: Final = 8


Side: TypeAlias = Literal["left", "right", "top", "bottom"]


class Surface(PaintedWidget):
    """A column or bar: one colour, a line on the sides that touch others, and a spoken name."""

    def __init__(self, fill: str = "panel", lines: tuple[Side, ...] = (), name: str = "") -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._fill = fill
        self._lines = lines

    def set_fill(self, fill: str) -> None:
        """Change its colour."""
        if fill != self._fill:
            self._fill = fill
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        fill: QColor = getattr(t.c, self._fill)
        painter.fillRect(self.rect(), fill)
        width, wide, high = t.line_width, self.width(), self.height()
        places = {
            "left": (0, 0, width, high),
            "right": (wide - width, 0, width, high),
            "top": (0, 0, wide, width),
            "bottom": (0, high - width, wide, width),
        }
        for side in self._lines:
            painter.fillRect(*places[side], t.c.line)


class Scroll(QScrollArea):
    """A named area that scrolls vertically with a slim bar, on a clear background."""

    bar_changed = Signal(int)
    """The bar came or went: its width, logical pixels, 0 without one."""

    def __init__(self, content: QWidget | None = None, height: int = 0, name: str = "") -> None:
        super().__init__()
        self._high = px(height)
        self.setAccessibleName(name)
        self.verticalScrollBar().rangeChanged.connect(self._tell_bar)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        dress_bars(self)
        self.viewport().setAutoFillBackground(False)
        see_through = self.palette()
        see_through.setColor(QPalette.ColorRole.Window, Qt.GlobalColor.transparent)
        self.viewport().setPalette(see_through)
        self.verticalScrollBar().setAccessibleName(tr("Scroll"))
        self.verticalScrollBar().setSingleStep(px(24))
        if content is not None:
            self.setWidget(content)

    def sizeHint(self) -> QSize:
        """Return the designed height, if there is one."""
        hint = super().sizeHint()
        return QSize(hint.width(), self._high or hint.height())

    def setWidget(self, widget: QWidget) -> None:
        """Set the content; the old one is deleted once nothing uses it."""
        before = self.widget()
        if before is not None:
            # Qt would delete it at once, with the focus in it: whoever follows the focus then
            # comes upon half a widget, and the program ends.
            before.hide()
            self.takeWidget()
            before.deleteLater()
        super().setWidget(widget)
        widget.setAutoFillBackground(False)

    def _tell_bar(self, _low: int, high: int) -> None:
        # The range changes once more while the window is taken down.
        if isValid(self) and isValid(bar := self.verticalScrollBar()):
            self.bar_changed.emit(bar.sizeHint().width() if high > 0 else 0)

    def lend(self, layout: QLayout, margin: int, least: int = 0) -> None:
        """Put the bar into the right margin of an inner layout, whose content keeps its edge.

        `margin`, `least`: without a bar, and the least that is left beside it, logical pixels.
        """

        def make_way(width: int) -> None:
            if isValid(layout):
                around = layout.contentsMargins()
                around.setRight(max(margin - width, least))
                layout.setContentsMargins(around)

        self.bar_changed.connect(make_way)

    def settle(self, layout: QLayout, new: Iterable[QWidget]) -> None:
        """Show new widgets of an inner layout; Qt would first paint them squeezed."""
        layout.setEnabled(False)
        for part in new:
            part.show()
        layout.setEnabled(True)
        layout.activate()
        QCoreApplication.sendPostedEvents(self.viewport(), QEvent.Type.LayoutRequest.value)

    def keep_visible(self, widget: QWidget) -> None:
        """Scroll as little as possible so that a widget inside can be seen."""
        margin = px(8)
        self.ensureWidgetVisible(widget, margin, margin)


class Room(Scroll):
    """Part of a screen that scrolls both ways once there is less room than it needs.

    Only large text in a small window comes to that; nothing then overlaps or is cut off.
    """

    def __init__(self, content: QWidget, width: int, height: int) -> None:
        content.setMinimumSize(px(width), px(height))
        super().__init__(content)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAsNeeded)
        dress_bars(self)
        # Nothing is painted where the two bars meet.
        self.setCornerWidget(QWidget())
        self.horizontalScrollBar().setAccessibleName(tr("Scroll sideways"))
        self.horizontalScrollBar().setSingleStep(px(24))

    def minimumSizeHint(self) -> QSize:
        """Leave the width to its neighbours."""
        return QSize(px(120), px(120))

    def sizeHint(self) -> QSize:
        """Return the least size."""
        return self.minimumSizeHint()


class OutlineBox(PaintedWidget):
    """A flat rectangle with an edge of a least width, to put a layout into; it is not pressed."""

    def __init__(
        self,
        fill: str = "panel",
        edge: str = "line",
        dashed: bool = False,
        radius: float = _RADIUS,
        width: int = 1,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._fill, self._edge, self._dashed = fill, edge, dashed
        self._radius, self._width = px(radius), width

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        fill = None if self._fill == "none" else getattr(t.c, self._fill)
        edge = None if self._edge == "none" else getattr(t.c, self._edge)
        if t.contrast and edge is None:
            edge = t.c.line
        width = max(self._width, t.line_width)
        box(painter, self.rect(), self._radius, fill, edge, width, self._dashed)


class Card(Pressable):
    """A frame that can be chosen; derive from it and paint what it shows in `paint_content`."""

    opened = Signal()
    preferred_size = (206, 138)  # of a style's card

    def __init__(self, name: str, dashed: bool = False) -> None:
        super().__init__(name, tip="")
        self._dashed = dashed

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter chooses and opens it; Space chooses it."""
        super().keyPressEvent(event)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            self.opened.emit()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Open it."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.opened.emit()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the frame in its state, then the content."""
        c = t.c
        fill, edge, width = c.panel, c.ctl if self._dashed else c.line, t.line_width
        if self._dashed:
            fill = c.bg
        if self.hovered():
            fill = hover_fill(t)
        if self.isDown():
            edge, width = c.ctl, selected_edge(t)
        if self.selected:
            # On white there is no brighter fill: the edge alone is three times as wide.
            fill, edge, width = c.raised, c.sel, 4 if t.contrast else selected_edge(t)
        dashed = self._dashed and not self.selected and not self.isDown()
        box(painter, self.rect(), px(_RADIUS), fill, edge, width, dashed)
        self.paint_content(painter)

    def paint_content(self, painter: QPainter) -> None:
        """Paint what the card shows; nothing here."""


class PictureLine(OutlineBox):
    """A framed line: a picture (see `Picture.set_picture`), words below each other, and buttons.

    `pressed` is for the mouse, as a larger target than a button, where `set_can_press` allows it.
    """

    pressed = Signal()

    def __init__(
        self,
        name: str,
        picture: NDArray[np.uint8] | None,
        size: tuple[int, int],
        *,
        raised: bool = False,
    ) -> None:
        super().__init__("raised" if raised else "panel")
        image = Picture(tr("Picture of {name}", name=name))
        image.setFixedSize(px(size[0]), px(size[1]))
        image.set_picture(picture)
        self.words = column(gap=4)
        self.row = row(image, (self.words, 1), into=self, gap=16, margins=8)
        self._can_press = False

    def set_can_press(self) -> None:
        """Make the whole line clickable."""
        self._can_press = True
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Handle a click anywhere but on the buttons."""
        inside = self.rect().contains(event.position().toPoint())
        if self._can_press and event.button() == Qt.MouseButton.LeftButton and inside:
            self.pressed.emit()
        super().mouseReleaseEvent(event)
