"""A style in the list of what a lamp does: its picture, match before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRectF, QSize
from PySide6.QtWidgets import QSizePolicy

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import describe
from app.ui.widgets.displays import Picture, draw_meter
from app.ui.widgets.paint import RIGHT, put_text, text_width
from app.ui.widgets.surfaces import Card

if TYPE_CHECKING:
    from PySide6.QtGui import QPainter, QResizeEvent

    from app.ui.screens.light.state import RowState

HEIGHT: Final = 76
"""Of a row, logical pixels at scale 1."""

PICTURE: Final = 56
"""Side of its picture."""

_PAD: Final = 8
_ARROW: Final = 16
_LONGEST: Final = "1/256 power"
_STALE: Final = 0.42


class RowCard(Card):
    """A style with its match without and with the lamp."""

    def __init__(self, state: RowState) -> None:
        super().__init__(state.spoken)
        self._state = state
        self._stale = False
        self._picture = Picture("")
        self._picture.setParent(self)
        self._picture.set_picture(state.picture)
        self.setFixedHeight(theme().px(HEIGHT))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.set_selected(state.chosen)
        self._tell()

    @property
    def state(self) -> RowState:
        """What it shows."""
        return self._state

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        t = theme()
        return QSize(t.px(280), t.px(HEIGHT))

    def show_state(self, state: RowState, stale: bool) -> None:
        """Show other numbers of the same style; `stale`: new ones are on their way."""
        if stale != self._stale:
            self._stale = stale
            self.update()
        self.set_selected(state.chosen)
        if state != self._state or state.picture is not self._state.picture:
            self._state = state
            self._picture.set_picture(state.picture)
            self._tell()
            self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Put the picture at the left."""
        super().resizeEvent(event)
        t = theme()
        side = t.px(PICTURE)
        self._picture.setGeometry(t.px(_PAD), (self.height() - side) // 2, side, side)

    def paint_content(self, painter: QPainter) -> None:
        """Paint names, numbers and meter."""
        t, state = theme(), self._state
        if self._stale:
            painter.setOpacity(_STALE)
        left = t.px(_PAD + PICTURE + 10)
        right = self.width() - t.px(10)
        line = QRectF(left, t.px(10), right - left, t.px(20))
        line.setRight(self._numbers(painter, line) - t.px(8))
        put_text(painter, line, state.title, t.font(14, 600), t.c.text)
        below = QRectF(left, t.px(32), right - left, t.px(16))
        put_text(painter, below, state.line, t.font(12), t.c.dim)
        meter = QRectF(left, t.px(54), right - left, t.px(10))
        if state.power:
            font, place = t.font(12), QRectF(left, t.px(51), right - left, t.px(16))
            put_text(painter, place, state.power, font, t.c.dim, RIGHT)
            meter.setRight(right - text_width(font, _LONGEST) - t.px(8))
        draw_meter(painter, meter, state.after, state.limit, state.before)
        painter.setOpacity(1.0)

    def _numbers(self, painter: QPainter, line: QRectF) -> float:
        """Paint "29 → 63" at the right, and give where it begins."""
        t, state = theme(), self._state
        strong, plain = t.font(14, 700), t.font(14)
        after, before = str(state.after), str(state.before)
        right = line.right()
        put_text(painter, line, after, strong, t.c.text, RIGHT)
        right -= text_width(t.font(14, 700), "00") + t.px(6)
        side = t.px(_ARROW)
        spot = QRectF(right - side, line.top(), side, line.height())
        draw_icon(painter, "arrow-right", spot, side, t.c.dim)
        right -= side + t.px(6)
        place = QRectF(line.left(), line.top(), right - line.left(), line.height())
        put_text(painter, place, before, plain, t.c.dim, RIGHT)
        return right - text_width(plain, before)

    def _tell(self) -> None:
        describe(self, self._state.spoken, tip=f"{self._state.title}: {self._state.line}")
