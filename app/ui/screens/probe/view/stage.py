"""What takes the place of panorama and lamps: the sign during a capture, and rough styles."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.probe.state import Live, RoughCard, Sign
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, column, row
from app.ui.widgets.paint import MIDDLE, Painted, box, faint, put_text
from app.ui.widgets.surfaces import Frame

_CARDS: Final = 3
_FILLS: Final = {
    "wait": ("panel", "text"),
    "act": ("amberfill", "onamber"),
    "move": ("ok", "raised"),
}
_CAPTION: Final = 0.2  # of the height
_LARGEST: Final = 400
_BAR: Final = 16


class _Face(Painted):
    """The words of the sign, as large as they can be, on a colour that says the same."""

    least = (240, 160)

    def __init__(self) -> None:
        super().__init__()
        self._sign = Sign()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_sign(self, sign: Sign) -> None:
        """Show it."""
        if sign != self._sign:
            self._sign = sign
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
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
    """Find the largest type in which words fit, before the theme's scale."""
    t = theme()
    width = QFontMetricsF(t.font(100, 700)).horizontalAdvance(words)
    most = 0.98 * min(room.width() / max(width, 1.0), room.height() / (1.25 * t.px(100)))
    return int(min(max(100.0 * most, 12.0), _LARGEST))


class CaptureSign(QWidget):
    """Read from three metres during a capture, over what was metered: the first panorama."""

    def __init__(self) -> None:
        super().__init__()
        self._face = _Face()
        self.picture = Picture(tr("What was metered"))
        self.picture.set_tag(tr("Metered"))
        column((self._face, 1), self.picture, into=self, gap=8, margins=16)
        self.picture.hide()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave the larger part to the words."""
        super().resizeEvent(event)
        self.picture.setFixedHeight(min((self.width() - px(32)) // 2, self.height() * 9 // 20))

    def show_sign(self, sign: Sign) -> None:
        """Show it."""
        self._face.show_sign(sign)
        self.picture.set_picture(sign.picture)
        self.picture.setVisible(sign.picture is not None)
        self.setAccessibleName(sign.big)
        self.setAccessibleDescription(sign.caption)


class _RoughView(Frame):
    """One style by the preview: what it is, how far to turn, and how sure that is."""

    def __init__(self, compact: bool) -> None:
        super().__init__("panel", "line")
        self.title = Text("", 14 if compact else 20, 600, elide=True)
        self.side = Text("", 12, role="dim", elide=True)
        self.turn = Text("", 20 if compact else 36, 700, "amber")
        self._arrow = Icon("clockwise", 16 if compact else 24, "amber")
        self.direction = Text("", 12 if compact else 14, role="dim", elide=True)
        self.note = Text("", 12 if compact else 14, elide=True)
        self._icon = Icon("check", 16)
        turn = row(self._arrow, (self.turn, 1), gap=8)
        line = row(self._icon, (self.note, 1), gap=6)
        gap = 0 if compact else 4
        column(
            self.title, self.side, gap, turn, self.direction, gap, line, ..., into=self, margins=12
        )
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)

    def show_card(self, card: RoughCard) -> None:
        """Show it."""
        self.title.set_text(card.title)
        self.side.set_text(card.side)
        self.turn.set_text(card.turn)
        self.direction.set_text(card.direction)
        self._arrow.set(card.arrow)
        self.note.set_text(f"{card.grade}, {card.note}")
        self._icon.set("warning" if card.unsure else "check")
        self.setAccessibleName(card.spoken)
        self.setToolTip(card.spoken)


class RoughCards(QWidget):
    """The best styles by the live preview, or why there are none."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self.message = Text("", 14, 600, wrap=True)
        self._icon = Icon("eye", 20)
        self.views: list[_RoughView] = []
        line = row((self._icon, 0, Qt.AlignmentFlag.AlignTop), (self.message, 1), gap=8)
        self._compact, self._cards = compact, row(gap=8)
        column(line, self._cards, ..., into=self, gap=8)
        # Its stack is no higher for what is seldom in front.
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Ignored)
        self.setAccessibleName(tr("Best styles here, roughly"))

    def show_live(self, live: Live) -> None:
        """Show them."""
        self.message.set_text(live.message)
        self._icon.set(*(("warning", "err") if live.trouble else ("eye", "text")))
        if not self.views:  # they are seldom wanted: the screen comes sooner without them
            self.views = [_RoughView(self._compact) for _ in range(_CARDS)]
            add(self._cards, *((view, 1) for view in self.views))
        for number, view in enumerate(self.views):
            there = number < len(live.cards)
            policy = view.sizePolicy()
            policy.setRetainSizeWhenHidden(True)
            view.setSizePolicy(policy)
            view.setVisible(there)
            if there:
                view.show_card(live.cards[number])
