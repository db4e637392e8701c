"""Lines between things."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme


class Divider(QWidget):
    """A line, as wide as edges are.

    Parameters
    ----------
    upright : bool, optional
        Whether it stands between columns and not between rows.
    """

    def __init__(self, upright: bool = False) -> None:
        super().__init__()
        width = theme().line_width
        fixed, free = QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding
        if upright:
            self.setFixedWidth(width)
            self.setSizePolicy(fixed, free)
        else:
            self.setFixedHeight(width)
            self.setSizePolicy(free, fixed)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        QPainter(self).fillRect(self.rect(), theme().c.line)
