"""Areas of one colour, and areas that scroll."""

from __future__ import annotations

from typing import Literal, TypeAlias

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import QFrame, QScrollArea, QWidget
from shiboken6 import isValid

from app.ui.theme import theme
from app.ui.theme.style import dress_bars

Side: TypeAlias = Literal["left", "right", "top", "bottom"]


class Surface(QWidget):
    """A column or bar: one colour, and a line on the sides that touch others."""

    def __init__(self, fill: str = "panel", lines: tuple[Side, ...] = ()) -> None:
        super().__init__()
        self._fill = fill
        self._lines = lines

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
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
    """An area that scrolls up and down with a slim bar, and lets the background through."""

    bar_changed = Signal(int)
    """The bar came or went: its width, logical pixels, 0 without one."""

    def __init__(self, content: QWidget | None = None, height: int = 0) -> None:
        super().__init__()
        self._high = theme().px(height)
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
        self.verticalScrollBar().setAccessibleName("Scroll")
        self.verticalScrollBar().setSingleStep(theme().px(24))
        if content is not None:
            self.setWidget(content)

    def sizeHint(self) -> QSize:
        """Ask for the designed height, if there is one."""
        hint = super().sizeHint()
        return QSize(hint.width(), self._high or hint.height())

    def setWidget(self, widget: QWidget) -> None:
        """Take what is scrolled; what was before is deleted once nothing uses it any more."""
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

    def keep_visible(self, widget: QWidget) -> None:
        """Scroll as little as possible so that a widget inside can be seen."""
        margin = theme().px(8)
        self.ensureWidgetVisible(widget, margin, margin)


class Room(Scroll):
    """Part of a screen that scrolls both ways once there is less room than it needs.

    Only large text in a small window comes to that; nothing then overlaps or is cut off.
    """

    def __init__(self, content: QWidget, width: int, height: int) -> None:
        t = theme()
        content.setMinimumSize(t.px(width), t.px(height))
        super().__init__(content)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAsNeeded)
        dress_bars(self)
        # Nothing is painted where the two bars meet.
        self.setCornerWidget(QWidget())
        self.horizontalScrollBar().setAccessibleName("Scroll sideways")
        self.horizontalScrollBar().setSingleStep(t.px(24))

    def minimumSizeHint(self) -> QSize:
        """Leave the width to what stands beside it."""
        return QSize(theme().px(120), theme().px(120))

    def sizeHint(self) -> QSize:
        """Ask for no more than the least."""
        return self.minimumSizeHint()
