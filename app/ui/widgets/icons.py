"""An icon that stands alone, and the black signs on orange and blue."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import box

if TYPE_CHECKING:
    from app.ui.widgets.labels import Role


class Icon(QWidget):
    """A picture without a function; what it means stands beside it in words."""

    def __init__(self, name: str, size: int = 20, role: Role = "text", says: str = "") -> None:
        super().__init__()
        self._name = name
        self._role: Role = role
        self._side = theme().px(size)
        self.setAccessibleName(says)
        self.setToolTip(says)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def set(self, name: str, role: Role | None = None) -> None:
        """Change the icon, and its colour.

        Parameters
        ----------
        role : str, optional
            Token of its colour; None keeps the old one.
        """
        if (name, role or self._role) != (self._name, self._role):
            self._name, self._role = name, role or self._role
            self.update()

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        return QSize(self._side, self._side)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        c = theme().c
        own: QColor = getattr(c, self._role)
        colour = own if self.isEnabled() else c.dis
        draw_icon(QPainter(self), self._name, self.rect(), self._side, colour)


def draw_sign(painter: QPainter, rect: QRect | QRectF, sign: Literal["plus", "minus"]) -> None:
    """Paint a black plus on orange, or a black minus on blue."""
    area = QRectF(rect)
    box(painter, area, area.width() / 5, getattr(theme().c, sign))
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    pen = QPen(Qt.GlobalColor.black, area.width() / 9)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setPen(pen)
    middle, arm = area.center(), area.width() / 5
    painter.drawLine(middle - QPointF(arm, 0), middle + QPointF(arm, 0))
    if sign == "plus":
        painter.drawLine(middle - QPointF(0, arm), middle + QPointF(0, arm))
    painter.restore()


class Sign(QWidget):
    """The sign of a weight in front of what it means."""

    def __init__(self, sign: Literal["plus", "minus"], size: int = 16) -> None:
        super().__init__()
        self._sign: Literal["plus", "minus"] = sign
        side = theme().px(size)
        self.setFixedSize(side, side)
        self.setAccessibleName(sign)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        draw_sign(QPainter(self), self.rect(), self._sign)
