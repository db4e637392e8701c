"""Parts of the Turn screen that nothing else needs: large words that fit, and the pill."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import MIDDLE, box, put_text, text_width

if TYPE_CHECKING:
    from app.ui.widgets.labels import Role

_LEAST: Final = 12


def _fitting(size: int, weight: int, text: str, width: int) -> QFont:
    """Give the largest font up to a size in which a line fits a width."""
    t = theme()
    while size > _LEAST and text_width(t.font(size, weight), text) > width:
        size -= 1
    return t.font(size, weight)


class LargeWords(QWidget):
    """One line in the middle, as large as designed or as fits."""

    def __init__(self, size: int, line: int, weight: int = 600, role: Role = "text") -> None:
        super().__init__()
        self._size, self._weight, self._role = size, weight, role
        self._text = ""
        self.setFixedHeight(theme().px(line))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def set_words(self, text: str, role: Role | None = None, size: int | None = None) -> None:
        """Change what it says.

        Parameters
        ----------
        role : str, optional
            New token of the colour; None keeps the old one.
        size : int, optional
            New type size; None keeps the old one.
        """
        new = (text, role or self._role, size or self._size)
        if new != (self._text, self._role, self._size):
            self._text, self._role, self._size = new
            self.setAccessibleName(text)
            self.update()

    @property
    def words(self) -> str:
        """What it says."""
        return self._text

    def sizeHint(self) -> QSize:
        """Room for the words, at the height of the line."""
        font = theme().font(self._size, self._weight)
        return QSize(text_width(font, self._text), self.height())

    def minimumSizeHint(self) -> QSize:
        """Get smaller rather than wider than there is room."""
        return QSize(0, self.height())

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        ink: QColor = getattr(theme().c, self._role)
        font = _fitting(self._size, self._weight, self._text, self.width())
        put_text(QPainter(self), self.rect(), self._text, font, ink, MIDDLE)


class Pill(QWidget):
    """When the light begins, or that it has."""

    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor
        self._text, self._icon, self._filled = "", "bulb", False
        self.setFixedHeight(theme().px(max(48 * factor, 36)))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def set(self, text: str, icon: str, filled: bool) -> None:
        """Change it."""
        if (text, icon, filled) != (self._text, self._icon, self._filled):
            self._text, self._icon, self._filled = text, icon, filled
            self.setAccessibleName(text)
            self.update()

    @property
    def words(self) -> str:
        """What it says."""
        return self._text

    @property
    def filled(self) -> bool:
        """Whether it says that one is in the light."""
        return self._filled

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        if not self._text:
            return
        t = theme()
        painter = QPainter(self)
        size = max(round(20 * self._factor), 16)
        side, gap = t.px(size + 2), t.px(max(12 * self._factor, 6))
        padding = t.px(max(24 * self._factor, 12))
        room = self.width() - 2 * padding - side - gap
        font = _fitting(size, 600, self._text, room)
        words = min(text_width(font, self._text), room)
        width = words + 2 * padding + side + gap
        area = QRectF(round((self.width() - width) / 2), 0, width, self.height())
        ink = t.c.bg if self._filled else t.c.text
        fill = t.c.ok if self._filled else None
        edge = None if self._filled else t.c.ctl
        box(painter, area, area.height() / 2, fill, edge, 2)
        left = area.left() + padding
        draw_icon(painter, self._icon, QRectF(left, 0, side, self.height()), side, ink)
        place = QRectF(left + side + gap, 0, words + 1, self.height())
        put_text(painter, place, self._text, font, ink, Qt.AlignmentFlag.AlignVCenter)
