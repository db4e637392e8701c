"""Chips: what is connected or chosen, in a rounded frame of 32."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF, QSize
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.buttons import Pressable, button_look
from app.ui.widgets.paint import box, put_text, text_width
from app.ui.widgets.tips import describe

_HEIGHT: Final = 32
_PADDING: Final = 13
_ICON: Final = 16
_GAP: Final = 8


class Chip(Pressable):
    """A chip with icon and words; it can be pressed."""

    def __init__(self, icon: str, text: str, menu: bool = False) -> None:
        super().__init__(text, tip="")
        self._icon = icon
        self._warning = ""
        self._menu = menu
        self.setText(text)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def set(self, icon: str, text: str, warning: str = "") -> None:
        """Change what it says."""
        if (icon, text, warning) == (self._icon, self.text(), self._warning):
            return
        self._icon, self._warning = icon, warning
        self.setText(text)
        self._tell()

    def _tell(self) -> None:
        words = f"{self.text()}. {self._warning}" if self._warning else self.text()
        describe(self, words, tip="")
        self.updateGeometry()
        self.update()

    def _pieces(self) -> list[tuple[str, str]]:
        """List icons and words from left to right as (icon or "", words or "")."""
        pieces = [(self._icon, "")] if self._icon else []
        if self.text():
            pieces.append(("", self.text()))
        if self._warning:
            pieces += [("warning", ""), ("", self._warning)]
        if self._menu:
            pieces.append(("chevron-down", ""))
        return pieces

    def _width(self, words: str) -> int:
        t = theme()
        return text_width(t.font(13), words) if words else t.px(_ICON)

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        t = theme()
        pieces = self._pieces()
        inner = sum(self._width(words) for _icon, words in pieces)
        inner += t.px(_GAP) * max(len(pieces) - 1, 0)
        height = t.px(_HEIGHT)
        return QSize(max(inner + 2 * t.px(_PADDING), height), height)

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        return self.sizeHint()

    def focus_shape(self) -> tuple[QRect, int]:
        """Give what the focus ring goes around."""
        return self.rect(), self.height() // 2

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        look = button_look(self)
        box(painter, self.rect(), self.height() / 2, look.fill, look.edge, look.width)
        x = float(t.px(_PADDING))
        for name, words in self._pieces():
            width = self._width(words)
            area = QRectF(x, 0, width, self.height())
            if words:
                put_text(painter, area, words, t.font(13), look.ink)
            else:
                draw_icon(painter, name, area, t.px(_ICON), look.ink)
            x += width + t.px(_GAP)
