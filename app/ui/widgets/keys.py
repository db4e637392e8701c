"""Keys as they are drawn in the job line, with what they do."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRectF, QSize
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.widgets.paint import MIDDLE, box, put_text, text_width

_HEIGHT: Final = 20
_PADDING: Final = 7
_GAP: Final = 8


class KeyHint(QWidget):
    """A key in its frame, and what it does."""

    def __init__(self, keys: str, words: str) -> None:
        super().__init__()
        self._keys, self._words = keys, words
        self._column = 0
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._describe()

    def set(self, keys: str, words: str) -> None:
        """Change both."""
        if (keys, words) != (self._keys, self._words):
            self._keys, self._words = keys, words
            self._describe()
            self.updateGeometry()
            self.update()

    def _describe(self) -> None:
        self.setAccessibleName(f"{self._keys}: {self._words}")

    def align(self, column: int) -> None:
        """Begin the words where those of the hints above and below begin.

        Parameters
        ----------
        column : int
            Width kept for the key, logical pixels.
        """
        self._column = column
        self.updateGeometry()
        self.update()

    def cap(self) -> int:
        """Give the width of the key in its frame, logical pixels."""
        t = theme()
        return max(text_width(t.font(12, 600), self._keys) + 2 * t.px(_PADDING), t.px(_HEIGHT))

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        t = theme()
        words = text_width(t.font(12), self._words) + t.px(_GAP) if self._words else 0
        return QSize(max(self.cap(), self._column) + words, t.px(_HEIGHT))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        cap = QRectF(0, 0, self.cap(), self.height())
        box(painter, cap, t.px(4), None, t.c.ctl, t.line_width)
        put_text(painter, cap, self._keys, t.font(12, 600), t.c.text, MIDDLE)
        left = max(cap.right(), self._column) + t.px(_GAP)
        rest = QRectF(left, 0, self.width() - left, self.height())
        put_text(painter, rest, self._words, t.font(12), t.c.dim)
