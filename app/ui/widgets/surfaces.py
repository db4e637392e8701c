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
    """A menu with rounded corners and icons, and with tooltips on disabled entries."""

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
        """Add an entry to the menu, and return its action."""
        # Escape "&" and tabs, which would start a shortcut or a second column.
        plain = visible(text).replace("&", "&&").replace("\t", " ")
        action = self.addAction(f"{plain}\t{shortcut}" if shortcut else plain)
        if icon_name:
            action.setIcon(icon(icon_name))
        action.setEnabled(not why)
        action.setToolTip(visible(why))
        action.triggered.connect(lambda _on=False: do())
        return action

    def drop(self, under: QWidget) -> None:
        """Open the menu below a widget without blocking."""
        self.popup(under.mapToGlobal(QPoint(0, under.height() + px(4))))


class Divider(PaintedWidget):
    """A line between rows that is as thick as the theme's borders."""

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(theme().line_width)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the divider in the current theme."""
        painter.fillRect(self.rect(), t.c.line)


_RADIUS: Final = 8


Side: TypeAlias = Literal["left", "right", "top", "bottom"]


class Surface(PaintedWidget):
    """A column or bar in a single colour, with lines along some sides and an accessible name."""

    def __init__(self, fill: str = "panel", lines: tuple[Side, ...] = (), name: str = "") -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._fill = fill
        self._lines = lines

    def set_fill(self, fill: str) -> None:
        """Change the colour."""
        if fill != self._fill:
            self._fill = fill
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the surface in the current theme."""
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
    """A named area that scrolls vertically and has a slim bar and a transparent background."""

    bar_changed = Signal(int)
    """Emitted when the scroll bar appears or disappears.

    The value is the width of the bar in logical pixels, or 0 if the bar is hidden.
    """

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
        """Return the design height, if the area has one."""
        hint = super().sizeHint()
        return QSize(hint.width(), self._high or hint.height())

    def setWidget(self, widget: QWidget) -> None:
        """Set the content, and delete the old content once it is no longer in use."""
        before = self.widget()
        if before is not None:
            # Qt would delete the old content at once together with the focus, and code that follows
            # the focus would then crash on a half-destroyed widget.
            before.hide()
            self.takeWidget()
            before.deleteLater()
        super().setWidget(widget)
        widget.setAutoFillBackground(False)

    def _tell_bar(self, _low: int, high: int) -> None:
        # The range changes once more while the window is being destroyed.
        if isValid(self) and isValid(bar := self.verticalScrollBar()):
            self.bar_changed.emit(bar.sizeHint().width() if high > 0 else 0)

    def lend(self, layout: QLayout, margin: int, least: int = 0) -> None:
        """Put the scroll bar into the right margin of an inner layout without moving the content.

        Args:
            margin: Margin in logical pixels without the scroll bar.
            least: Minimum margin in logical pixels beside the scroll bar.
        """

        def make_way(width: int) -> None:
            if isValid(layout):
                around = layout.contentsMargins()
                around.setRight(max(margin - width, least))
                layout.setContentsMargins(around)

        self.bar_changed.connect(make_way)

    def settle(self, layout: QLayout, new: Iterable[QWidget]) -> None:
        """Show new widgets in an inner layout at their final size.

        Without this step, Qt would first paint the widgets squeezed together.
        """
        layout.setEnabled(False)
        for part in new:
            part.show()
        layout.setEnabled(True)
        layout.activate()
        QCoreApplication.sendPostedEvents(self.viewport(), QEvent.Type.LayoutRequest.value)

    def keep_visible(self, widget: QWidget) -> None:
        """Scroll just far enough to make a widget visible."""
        margin = px(8)
        self.ensureWidgetVisible(widget, margin, margin)


class Room(Scroll):
    """A part of a screen that scrolls in both directions when it has less space than it needs.

    This happens only with large text in a small window. Even then, nothing may overlap or be cut
    off.
    """

    def __init__(self, content: QWidget, width: int, height: int) -> None:
        content.setMinimumSize(px(width), px(height))
        super().__init__(content)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAsNeeded)
        dress_bars(self)
        # Paint nothing where the two scroll bars meet.
        self.setCornerWidget(QWidget())
        self.horizontalScrollBar().setAccessibleName(tr("Scroll sideways"))
        self.horizontalScrollBar().setSingleStep(px(24))

    def minimumSizeHint(self) -> QSize:
        """Return a small size, which leaves the neighbours the width that they need."""
        return QSize(px(120), px(120))

    def sizeHint(self) -> QSize:
        """Return the minimum size."""
        return self.minimumSizeHint()


class OutlineBox(PaintedWidget):
    """A bordered rectangle that contains a layout and cannot be pressed."""

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
        """Paint the box in the current theme."""
        fill = None if self._fill == "none" else getattr(t.c, self._fill)
        edge = None if self._edge == "none" else getattr(t.c, self._edge)
        if t.contrast and edge is None:
            edge = t.c.line
        width = max(self._width, t.line_width)
        box(painter, self.rect(), self._radius, fill, edge, width, self._dashed)


class Card(Pressable):
    """The base class of selectable frames. Subclasses paint the content."""

    opened = Signal()
    preferred_size = (206, 138)  # size of a style's card

    def __init__(self, name: str, dashed: bool = False) -> None:
        super().__init__(name, tip="")
        self._dashed = dashed

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Select the card on Space or Enter. Enter also opens the card."""
        super().keyPressEvent(event)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            self.opened.emit()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Open the card."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.opened.emit()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the frame for the card's current state, then the content."""
        c = t.c
        fill, edge, width = c.panel, c.ctl if self._dashed else c.line, t.line_width
        if self._dashed:
            fill = c.bg
        if self.hovered():
            fill = hover_fill(t)
        if self.isDown():
            edge, width = c.ctl, selected_edge(t)
        if self.selected:
            # In high contrast, all fills are white, so only the wider border marks the selection.
            fill, edge, width = c.raised, c.sel, 4 if t.contrast else selected_edge(t)
        dashed = self._dashed and not self.selected and not self.isDown()
        box(painter, self.rect(), px(_RADIUS), fill, edge, width, dashed)
        self.paint_content(painter)

    def paint_content(self, painter: QPainter) -> None:
        """Paint the content of the card. This base class paints nothing."""


class PictureLine(OutlineBox):
    """A framed row with a picture (see `Picture.set_picture`), lines of text and buttons.

    Attributes:
        pressed: Emitted on a click anywhere on the row if `set_can_press` has been called. The row
            is a larger target than a button.
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
        """Make the whole row clickable."""
        self._can_press = True
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Emit `pressed` for a click anywhere except on the buttons."""
        inside = self.rect().contains(event.position().toPoint())
        if self._can_press and event.button() == Qt.MouseButton.LeftButton and inside:
            self.pressed.emit()
        super().mouseReleaseEvent(event)
