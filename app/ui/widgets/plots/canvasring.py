"""The ring around the brush on the paint canvas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from app.ui.theme.icons import draw_icon

if TYPE_CHECKING:
    from app.ui.widgets.plots.geometry import Point

BrushSign: TypeAlias = Literal["plus", "minus", "ignore", "restore"]
"""What the brush does: brighter, darker, ignore, restore."""

_WHITE = QColor(255, 255, 255)
_BLACK = QColor(0, 0, 0)
_SHADOW = QColor(0, 0, 0, 150)


def draw_brush_ring(
    painter: QPainter, centre: Point, radius: float, inner: float, sign: BrushSign
) -> None:
    """Draw how far the brush reaches, where it has its full strength, and what it does.

    Parameters
    ----------
    painter : QPainter
        Antialiased, in logical pixels.
    centre : Point
        Of the brush, logical pixels.
    radius : float
        Of the brush, logical pixels.
    inner : float
        Radius of full strength, logical pixels; left out where there is no room for it.
    """
    middle = QPointF(*centre)
    painter.save()
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for colour, width in ((_BLACK, 4.0), (_WHITE, 2.0)):
        painter.setPen(QPen(colour, width))
        painter.drawEllipse(middle, radius, radius)
    if 5.0 <= inner <= radius - 3.0:
        _draw_inner(painter, middle, inner)
    if radius >= 12.0:
        _draw_sign(painter, middle, sign)
    painter.restore()


def _draw_inner(painter: QPainter, middle: QPointF, radius: float) -> None:
    painter.setPen(QPen(_SHADOW, 3.0))
    painter.drawEllipse(middle, radius, radius)
    pen = QPen(_WHITE, 1.5, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap)
    # A whole number of dashes, so that none is cut where the ring closes.
    count = max(round(2.0 * 3.14159 * radius / 8.0), 6)
    length = 2.0 * 3.14159 * radius / count / 1.5
    pen.setDashPattern([length / 2.0, length / 2.0])
    painter.setPen(pen)
    painter.drawEllipse(middle, radius, radius)


def _draw_sign(painter: QPainter, middle: QPointF, sign: BrushSign) -> None:
    if sign in ("ignore", "restore"):
        for colour, shift in ((_BLACK, 1.0), (_WHITE, 0.0)):
            area = QRectF(middle.x() - 8.0 + shift, middle.y() - 8.0 + shift, 16.0, 16.0)
            draw_icon(painter, sign, area, 16, colour)
        return
    arm = 5.0
    lines = [(QPointF(-arm, 0.0), QPointF(arm, 0.0))]
    if sign == "plus":
        lines.append((QPointF(0.0, -arm), QPointF(0.0, arm)))
    for colour, width, cap in (
        (_BLACK, 4.0, Qt.PenCapStyle.SquareCap),
        (_WHITE, 2.0, Qt.PenCapStyle.FlatCap),
    ):
        painter.setPen(QPen(colour, width, Qt.PenStyle.SolidLine, cap))
        for start, stop in lines:
            painter.drawLine(middle + start, middle + stop)
