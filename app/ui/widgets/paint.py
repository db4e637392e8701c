"""What all components paint with: boxes with exact edges, text on one line, states."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen

from app.ui.theme import Theme, theme

LEFT: Final = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
MIDDLE: Final = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignVCenter
RIGHT: Final = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


def mix(first: QColor, second: QColor, share: float) -> QColor:
    """Blend two colours in sRGB, as painting one over the other would.

    Parameters
    ----------
    share : float
        How much of the second, 0 to 1.
    """
    pairs = zip(first.getRgb()[:3], second.getRgb()[:3], strict=True)  # type: ignore[index]
    return QColor(*(round(a + (b - a) * share) for a, b in pairs))


def hover_fill(t: Theme) -> QColor:
    """Give the fill of a control under the mouse; in "contrast" raised would not be seen."""
    return t.c.track2 if t.contrast else t.c.raised


def box(
    painter: QPainter,
    rect: QRect | QRectF,
    radius: float,
    fill: QColor | None = None,
    edge: QColor | None = None,
    width: float = 1.0,
    dashed: bool = False,
) -> None:
    """Paint a rectangle with rounded corners whose edge lies inside it.

    Parameters
    ----------
    rect : QRect or QRectF
        Outer rectangle, logical pixels.
    fill, edge : QColor, optional
        None leaves it out.
    """
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setBrush(fill if fill is not None else Qt.BrushStyle.NoBrush)
    inner = QRectF(rect)
    if edge is None:
        painter.setPen(Qt.PenStyle.NoPen)
    else:
        pen = QPen(edge, width)
        if dashed:
            pen.setCapStyle(Qt.PenCapStyle.FlatCap)
            pen.setDashPattern([4 / width, 3 / width])
        painter.setPen(pen)
        half = width / 2
        inner.adjust(half, half, -half, -half)
        radius = max(0.0, radius - half)
    painter.drawRoundedRect(inner, radius, radius)
    painter.restore()


def text_width(font: QFont, text: str) -> int:
    """Give the width of a line of text in whole logical pixels, rounded up."""
    return int(QFontMetricsF(font).horizontalAdvance(text) + 0.999)


def put_text(
    painter: QPainter,
    rect: QRect | QRectF,
    text: str,
    font: QFont,
    colour: QColor,
    align: Qt.AlignmentFlag = LEFT,
) -> None:
    """Paint one line of text; what does not fit ends in an ellipsis."""
    area = QRectF(rect)
    shown = QFontMetricsF(font).elidedText(text, Qt.TextElideMode.ElideRight, area.width() + 0.5)
    painter.setFont(font)
    painter.setPen(colour)
    painter.drawText(area, int(align | Qt.TextFlag.TextSingleLine), shown)


def selected_edge(t: Theme | None = None) -> int:
    """Give the width of a selected or pressed edge, logical pixels: one more than a plain one."""
    return (t or theme()).line_width + 1
