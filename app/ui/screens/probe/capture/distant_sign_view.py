"""The sign that can be read from three metres away, and the metered panorama below it."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF
from PySide6.QtGui import QFontMetricsF, QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.probe.capture.distant_sign import DistantSign
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.displays import Picture
from app.ui.widgets.layouts import column
from app.ui.widgets.paint import MIDDLE, PaintedWidget, box, faint, put_text

_FILLS: Final = {
    "wait": ("panel", "text"),
    "act": ("amberfill", "onamber"),
    "move": ("ok", "raised"),
}

_CAPTION: Final = 0.2  # fraction of the height

_LARGEST: Final = 400

_BAR: Final = 16


class _Face(PaintedWidget):
    """The sign's text, as large as will fit, on a background whose colour has the same meaning."""

    least = (240, 160)

    def __init__(self) -> None:
        super().__init__()
        self._sign = DistantSign()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_sign(self, sign: DistantSign) -> None:
        if sign != self._sign:
            self._sign = sign
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        sign = self._sign
        fill, ink = (getattr(t.c, name) for name in _FILLS[sign.kind])
        box(painter, self.rect(), px(8), fill, t.c.line, t.line_width)
        room = QRectF(self.rect()).adjusted(px(24), px(16), -px(24), -px(16))
        caption = QRectF(room)
        caption.setTop(room.bottom() - _CAPTION * min(room.height(), px(_LARGEST)))
        if sign.fraction is not None:
            bar = QRectF(room.left(), caption.top() - px(_BAR), room.width(), px(_BAR))
            box(painter, bar, bar.height() / 2, faint(ink, 0.25))
            bar.setWidth(max(bar.width() * sign.fraction, bar.height()))
            box(painter, bar, bar.height() / 2, ink)
        under = t.font(_fitting(sign.caption, caption), 600)
        put_text(painter, caption, sign.caption, under, ink, MIDDLE)
        room.setBottom(caption.top() - (px(_BAR + 8) if sign.fraction is not None else 0))
        if sign.kind == "move":
            side = int(min(room.height() * 0.4, room.width() * 0.4))
            spot = QRect(int(room.center().x() - side / 2), int(room.top()), side, side)
            draw_icon(painter, "check", spot, side, ink)
            room.setTop(room.top() + side)
        put_text(painter, room, sign.big, t.font(_fitting(sign.big, room), 700), ink, MIDDLE)


def _fitting(words: str, room: QRectF) -> int:
    """Return the largest font size at which the text fits, before the theme's scale is applied."""
    t = theme()
    width = QFontMetricsF(t.font(100, 700)).horizontalAdvance(words)
    most = 0.98 * min(room.width() / max(width, 1.0), room.height() / (1.25 * t.px(100)))
    return int(min(max(100.0 * most, 12.0), _LARGEST))


class CaptureSign(QWidget):
    """The sign, with the metered panorama below it."""

    def __init__(self) -> None:
        super().__init__()
        self._face = _Face()
        self.picture = Picture(tr("Metered panorama"))
        self.picture.set_tag(tr("Metered"))
        column((self._face, 1), self.picture, into=self, gap=8, margins=16)
        self.picture.hide()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep most of the height for the text."""
        super().resizeEvent(event)
        self.picture.setFixedHeight(min((self.width() - px(32)) // 2, self.height() * 9 // 20))

    def show_sign(self, sign: DistantSign) -> None:
        """Show the sign."""
        self._face.show_sign(sign)
        self.picture.set_picture(sign.picture)
        self.picture.setVisible(sign.picture is not None)
        self.setAccessibleName(sign.big)
        self.setAccessibleDescription(sign.caption)
