"""Toggles: on or off, seen by the fill and by the side of the knob."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.paint import box, hover_fill, put_text, selected_edge, text_width

_SWITCH: Final = (36, 20)
_KNOB: Final = 14
_ICON: Final = 20
_GAP: Final = 10


class Toggle(Pressable):
    """A line with a name, and a switch of 36 x 20 at its right end."""

    switched = Signal(bool)

    def __init__(self, name: str, icon: str = "", bare: bool = False) -> None:
        super().__init__(name, tip="")
        self._icon = icon
        self._bare = bare
        self.setText(name)
        self.setCheckable(True)
        across = QSizePolicy.Policy.Fixed if bare else QSizePolicy.Policy.Preferred
        self.setSizePolicy(across, QSizePolicy.Policy.Fixed)
        self.clicked.connect(self.switched)

    @property
    def on(self) -> bool:
        """Whether it is on."""
        return self.isChecked()

    def set_on(self, on: bool) -> None:
        """Switch without telling anybody."""
        self.setChecked(on)

    def sizeHint(self) -> QSize:
        """Room for icon, name and switch."""
        t = theme()
        width = t.px(_SWITCH[0])
        if not self._bare:
            width += text_width(t.font(14), self.text()) + 2 * t.px(_GAP)
            width += t.px(_ICON + _GAP) if self._icon else 0
        return QSize(width, t.px(32))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        return self.sizeHint()

    def _switch(self) -> QRect:
        t = theme()
        width, height = t.px(_SWITCH[0]), t.px(_SWITCH[1])
        return QRect(self.width() - width, (self.height() - height) // 2, width, height)

    def focus_shape(self) -> tuple[QRect, int]:
        """Give the switch."""
        switch = self._switch()
        return switch, switch.height() // 2

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        ink = t.c.text if self.isEnabled() else t.c.dis
        if not self._bare:
            left = 0
            if self._icon:
                side = t.px(_ICON)
                draw_icon(painter, self._icon, QRect(0, 0, side, self.height()), side, ink)
                left = side + t.px(_GAP)
            room = self.width() - left - t.px(_SWITCH[0] + _GAP)
            put_text(painter, QRect(left, 0, room, self.height()), self.text(), t.font(14), ink)
        self._paint_switch(painter)

    def _paint_switch(self, painter: QPainter) -> None:
        t = theme()
        c, on = t.c, self.isEnabled()
        area = QRectF(self._switch())
        radius = area.height() / 2
        width = selected_edge(t) if self.isDown() else t.line_width
        gap = (area.height() - t.px(_KNOB)) / 2
        knob = QRectF(area.left() + gap, area.top() + gap, t.px(_KNOB), t.px(_KNOB))
        if self.isChecked():
            full = c.text if on else c.dis
            box(painter, area, radius, full, c.ctl if self.isDown() else full, width)
            knob.moveRight(area.right() - gap)
            ink = c.panel
        else:
            fill = hover_fill(t) if self.hovered() else None
            box(painter, area, radius, fill, c.ctl if on else c.dis, width)
            ink = c.ctl if on else c.dis
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink)
        painter.drawEllipse(knob)
