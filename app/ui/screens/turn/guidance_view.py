"""The right-hand column: the arrow, the degrees, the direction, the walk and the portraits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QAccessible, QAccessibleAnnouncementEvent, QColor, QFont, QPainter
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.plots.guidance import BigDegrees, TurnArrow
from app.ui.screens.turn.portraits_view import Portraits
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.labels import Icon, Role, Text
from app.ui.widgets.layouts import column, row, stacked
from app.ui.widgets.paint import MIDDLE, PaintedWidget, box, put_text, text_width

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.ui.screens.turn.guidance import Guidance

_LEAST: Final = 12
_MIDDLE: Final = Qt.AlignmentFlag.AlignHCenter


def _fitting(size: int, weight: int, text: str, width: int) -> QFont:
    """Return the largest font, up to the given size, at which the text fits the width."""
    t = theme()
    while size > _LEAST and text_width(t.font(size, weight), text) > width:
        size -= 1
    return t.font(size, weight)


class LargeWords(PaintedWidget):
    """A centred line of text at its designed size, reduced only as far as needed to fit."""

    def __init__(self, size: int, line: int, weight: int = 600, role: Role = "text") -> None:
        super().__init__()
        self._size, self._weight, self._role = size, weight, role
        self.words = ""
        self.setFixedHeight(px(line))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def set_words(self, text: str, role: Role | None = None, size: int | None = None) -> None:
        """Set the text, and also its colour role and its size unless they are None."""
        new = (text, role or self._role, size or self._size)
        if new != (self.words, self._role, self._size):
            self.words, self._role, self._size = new
            self.setAccessibleName(text)
            self.update()

    def sizeHint(self) -> QSize:
        """Return the width of the text and the height of the line."""
        font = theme().font(self._size, self._weight)
        return QSize(text_width(font, self.words), self.height())

    def minimumSizeHint(self) -> QSize:
        """Return a minimum size that lets the text shrink to the available width."""
        return QSize(0, self.height())

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the text in the current theme."""
        ink: QColor = getattr(t.c, self._role)
        font = _fitting(self._size, self._weight, self.words, self.width())
        put_text(painter, self.rect(), self.words, font, ink, MIDDLE)


class Pill(PaintedWidget):
    """A rounded box that shows whether the sitter has reached the light."""

    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor
        self.words, self._icon, self.filled = "", "bulb", False
        self.setFixedHeight(px(max(48 * factor, 36)))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def set(self, text: str, icon: str, filled: bool) -> None:
        """Set the text, the icon and whether the box is filled."""
        if (text, icon, filled) != (self.words, self._icon, self.filled):
            self.words, self._icon, self.filled = text, icon, filled
            self.setAccessibleName(text)
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the box in the current theme."""
        if not self.words:
            return
        size = max(round(20 * self._factor), 16)
        side, gap = px(size + 2), px(max(12 * self._factor, 6))
        padding = px(max(24 * self._factor, 12))
        room = self.width() - 2 * padding - side - gap
        font = _fitting(size, 600, self.words, room)
        words = min(text_width(font, self.words), room)
        width = words + 2 * padding + side + gap
        area = QRectF(round((self.width() - width) / 2), 0, width, self.height())
        ink = t.c.bg if self.filled else t.c.text
        fill = t.c.ok if self.filled else None
        edge = None if self.filled else t.c.ctl
        box(painter, area, area.height() / 2, fill, edge, 2)
        left = area.left() + padding
        draw_icon(painter, self._icon, QRectF(left, 0, side, self.height()), side, ink)
        place = QRectF(left + side + gap, 0, words + 1, self.height())
        put_text(painter, place, self.words, font, ink, Qt.AlignmentFlag.AlignVCenter)


DESIGNED: Final = QSize(480, 804)
"""Size of the column for which the text sizes are designed."""

_MODES: Final = (
    (tr("I walk around the sitter"), tr("Selfie: I turn myself")),
    (tr("I walk around"), tr("I turn myself")),
    (tr("I walk"), tr("Selfie")),
)
"""Names of the two modes, as pairs in order of decreasing length for narrower columns."""

_KEYS: Final = ("walk", "selfie")
_LONG_DIRECTION: Final = 11  # letters; a longer direction gets a smaller font


class GuideColumn(QWidget):
    """The right-hand column, laid out to be readable from three metres away."""

    def __init__(self, factor: float, set_mode: Callable[[str], None]) -> None:
        super().__init__()
        self._factor = factor
        self._last: Guidance | None = None
        modes = list(zip(_KEYS, _MODES[0], strict=True))
        self._mode = SegmentedChoice(modes, tr("Who turns"), do=set_mode)
        self._pages = stacked(self._turn_page(), self._sentence_page())
        self._pages.setAccessibleName(tr("What to do"))
        upper = ((self._mode, 0, _MIDDLE), self._gap(16, 8), self._pages, ...)
        self.portraits = Portraits(factor)
        lower = (self._gap(12, 8), self.portraits.layout)
        column(*upper, *lower, into=self, margins=self._gap(24, 12))

    def _gap(self, length: float, least: float = 0.0) -> float:
        """Return a designed length, scaled to the size of the column."""
        return max(length * self._factor, least)

    def _px(self, length: float, least: float = 0.0) -> int:
        return px(self._gap(length, least))

    def _size(self, size: int, least: int = 12) -> int:
        return max(round(size * self._factor), least)

    def _turn_page(self) -> QWidget:
        page = QWidget()
        self._arrow = TurnArrow()
        self._arrow.setFixedSize(self._px(320), self._px(104))
        self._degrees = BigDegrees(self._size(224, 48))
        self._direction = LargeWords(self._size(56), self._line(60), 700, "amber")
        self._walk = LargeWords(self._size(36), self._line(44), 600)
        self._company = Text("", self._size(20, 13), role="dim", wrap=True, align=_MIDDLE)
        self._pill = Pill(self._factor)
        number = ((self._arrow, 0, _MIDDLE), self._gap(8), self._degrees, self._gap(12))
        words = (self._direction, self._walk, self._company)
        column(*number, *words, self._gap(14, 8), self._pill, into=page)
        return page

    def _line(self, line: int, least: int = 16) -> int:
        return max(round(line * self._factor), least)

    def _sentence_page(self) -> QWidget:
        page = QWidget()
        self._sentence_icon = Icon("target", self._size(64, 32))
        self._sentence = Text("", self._size(28, 18), 600, wrap=True, align=_MIDDLE)
        self._advice = Text("", self._size(20, 14), role="dim", wrap=True, align=_MIDDLE)
        whole = column(..., (self._sentence_icon, 0, _MIDDLE), into=page)
        whole.setSpacing(self._px(24, 12))
        for words in (self._sentence, self._advice):
            words.setMaximumWidth(self._px(400))
            whole.addLayout(row(..., (words, 100), ..., gap=None))
        whole.addStretch(2)
        return page

    def fit(self, width: int) -> None:
        """Choose the longest names of the modes that fit the width."""
        room = width - 2 * self._px(24, 12) - 2 * px(6)
        for words in _MODES:
            for key, text in zip(_KEYS, words, strict=True):
                self._mode.set_text(key, text)
            if sum(self._mode.part(key).sizeHint().width() for key in _KEYS) <= room:
                break

    def set_mode(self, mode: str) -> None:
        """Show the current mode."""
        self._mode.choose(mode)

    def show_guidance(self, guidance: Guidance) -> None:
        """Show the guidance."""
        before, self._last = self._last, guidance
        self._pages.setCurrentIndex(1 if guidance.sentence else 0)
        self._sentence.set_text(guidance.sentence)
        self._sentence_icon.set(guidance.sentence_icon)
        self._advice.set_text(guidance.advice)
        if guidance.sign != self._arrow.sign:
            self._arrow.set_sign(guidance.sign)
        number = (guidance.number, guidance.number_words)
        if before is None or number != (before.number, before.number_words):
            self._degrees.set_value(*number)
        long = len(guidance.direction) > _LONG_DIRECTION
        # Amber is illegible on green.
        ink: Role = "text" if guidance.inside else "amber"
        self._direction.set_words(guidance.direction, ink, self._size(44 if long else 56))
        self._walk.set_words(guidance.walk)
        self._company.set_text(guidance.company)
        self._pill.set(guidance.pill, guidance.pill_icon, guidance.inside)
        self._speak(guidance, before)

    def _speak(self, guidance: Guidance, before: Guidance | None) -> None:
        """Describe the whole column in one sentence for screen readers, and announce changes."""
        self._pages.setAccessibleDescription(guidance.spoken)
        last_words = "" if before is None else before.announced
        if guidance.announced and guidance.announced != last_words and QAccessible.isActive():
            event = QAccessibleAnnouncementEvent(self._pages, guidance.announced)
            event.setPoliteness(QAccessible.AnnouncementPoliteness.Polite)
            QAccessible.updateAccessibility(event)
