"""Rows and headings for the list of styles."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRectF
from PySide6.QtGui import QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.light.style_list import RowState
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import describe
from app.ui.widgets.displays import Picture, draw_meter
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import row
from app.ui.widgets.paint import RIGHT, STALE, put_text, text_width
from app.ui.widgets.surfaces import Card

HEIGHT: Final = 76
"""Height of a row, in logical pixels at scale 1."""

PICTURE: Final = 56
"""Width and height of the picture in a row, in logical pixels at scale 1."""

_PAD: Final = 8

_ARROW: Final = 16

_LONGEST: Final = tr("{share} power", share="1/256")


class RowCard(Card):
    """A style, with its match without the lamp and with it."""

    preferred_size = (280, HEIGHT)

    def __init__(self, state: RowState) -> None:
        super().__init__(state.spoken)
        self.state = state
        self._stale = False
        self._picture = Picture("")
        self._picture.setParent(self)
        self._picture.set_picture(state.picture)
        self.setFixedHeight(px(HEIGHT))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.set_selected(state.chosen)
        self._tell()

    def show_state(self, state: RowState, stale: bool) -> None:
        """Show new numbers for the same style, dimmed if they are `stale`."""
        if stale != self._stale:
            self._stale = stale
            self.update()
        self.set_selected(state.chosen)
        if state != self.state or state.picture is not self.state.picture:
            self.state = state
            self._picture.set_picture(state.picture)
            self._tell()
            self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Place the picture on the left."""
        super().resizeEvent(event)
        side = px(PICTURE)
        self._picture.setGeometry(px(_PAD), (self.height() - side) // 2, side, side)

    def paint_content(self, painter: QPainter) -> None:
        """Paint the names, the numbers and the meter."""
        t, state = theme(), self.state
        if self._stale:
            painter.setOpacity(STALE)
        left = px(_PAD + PICTURE + 10)
        right = self.width() - px(10)
        line = QRectF(left, px(10), right - left, px(20))
        line.setRight(self._numbers(painter, line) - px(8))
        put_text(painter, line, state.title, t.font(14, 600), t.c.text)
        below = QRectF(left, px(32), right - left, px(16))
        put_text(painter, below, state.line, t.font(12), t.c.dim)
        meter = QRectF(left, px(54), right - left, px(10))
        if state.power:
            font, place = t.font(12), QRectF(left, px(51), right - left, px(16))
            put_text(painter, place, state.power, font, t.c.dim, RIGHT)
            meter.setRight(right - text_width(font, _LONGEST) - px(8))
        draw_meter(painter, meter, state.after, state.limit, state.before)
        painter.setOpacity(1.0)

    def _numbers(self, painter: QPainter, line: QRectF) -> float:
        """Paint numbers such as "29 → 63" on the right, and return the numbers' left edge."""
        t, state = theme(), self.state
        strong, plain = t.font(14, 700), t.font(14)
        after, before = str(state.after), str(state.before)
        right = line.right()
        put_text(painter, line, after, strong, t.c.text, RIGHT)
        right -= text_width(t.font(14, 700), "00") + px(6)
        side = px(_ARROW)
        spot = QRectF(right - side, line.top(), side, line.height())
        draw_icon(painter, "arrow-right", spot, side, t.c.dim)
        right -= side + px(6)
        place = QRectF(line.left(), line.top(), right - line.left(), line.height())
        put_text(painter, place, before, plain, t.c.dim, RIGHT)
        return right - text_width(plain, before)

    def _tell(self) -> None:
        describe(self, self.state.spoken, tip=f"{self.state.title}: {self.state.line}")


class SectionHeading(QWidget):
    """The title of a section and the number of styles in that section."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.title = title
        self.count = Text("", 14, role="dim")
        words = (Text(title, 14, 600, elide=True), 1)
        row(words, self.count, into=self, gap=None, margins=(0, 8, 0, 0))
