"""Basic painting for all controls: boxes with exact borders, lines of text, tags and states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from PySide6.QtCore import QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QGradient, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from app.core.base.visible_text import visible
from app.ui.theme import Theme, px, theme

Anchor: TypeAlias = Literal["tl", "tr", "bl", "br", "t", "b", "c"]
"""The point at which a tag is positioned: a corner, the middle of an edge or the centre."""


if TYPE_CHECKING:
    _Widget = QWidget
else:
    _Widget = object


class Paints(_Widget):
    """A mixin that paints a widget in the current theme.

    It must be listed before the Qt widget class.

    Attributes:
        preferred_size, least: Design width and height for the size hints, or None to leave the
            hints to Qt.
    """

    preferred_size: tuple[float, float] | None = None
    least: tuple[float, float] | None = None

    def sizeHint(self) -> QSize:
        """Return the design size at the theme's scale."""
        return QSize(*map(px, self.preferred_size)) if self.preferred_size else super().sizeHint()

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size."""
        return QSize(*map(px, self.least)) if self.least else super().minimumSizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Call `paint_on`."""
        self.paint_on(QPainter(self), theme())

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the widget. This base class paints nothing."""


class PaintedWidget(Paints, QWidget):
    """A widget that paints itself in the current theme."""


STALE: Final = 0.42
"""Opacity at which an answer for another selection is painted."""
_HEIGHT: Final = 20
_PADDING: Final = 8


def tag_size(text: str, weight: int = 400) -> tuple[int, int]:
    """Return the width and height of a tag in logical pixels."""
    return text_width(theme().font(12, weight), text) + 2 * px(_PADDING), px(_HEIGHT)


def draw_tag(
    painter: QPainter,
    x: float,
    y: float,
    text: str,
    anchor: Anchor = "tl",
    fill: QColor | None = None,
    ink: QColor | None = None,
    weight: int = 400,
    most: int = 1 << 15,
) -> QRectF:
    """Paint a tag that is at most `most` pixels wide, with its `anchor` at (x, y).

    The tag consists of 12 px text on a dark plate.
    """
    t = theme()
    width, height = tag_size(text, weight)
    width = min(width, most)
    left = x - (width if "r" in anchor else 0 if "l" in anchor else width / 2)
    top = y - (height if "b" in anchor else 0 if "t" in anchor else height / 2)
    area = QRectF(round(left), round(top), width, height)
    box(painter, area, px(4), fill or t.c.tag)
    put_text(painter, area, text, t.font(12, weight), ink or t.c.ontag, MIDDLE)
    return area


LEFT: Final = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
MIDDLE: Final = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignVCenter
RIGHT: Final = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


def mix(first: QColor, second: QColor, share: float) -> QColor:
    """Blend two colours in sRGB, as if the second one were painted over the first."""
    pairs = zip(first.getRgb()[:3], second.getRgb()[:3], strict=True)  # type: ignore[index]
    return QColor(*(round(a + (b - a) * share) for a, b in pairs))


def faint(colour: QColor | Qt.GlobalColor, opacity: float) -> QColor:
    """Return a colour with the given opacity, from 0 to 1."""
    shade = QColor(colour)
    shade.setAlphaF(opacity)
    return shade


def pen(
    colour: QColor | Qt.GlobalColor, width: float, dashes: Sequence[float] = (), ends: str = "flat"
) -> QPen:
    """Return a pen that has flat ends, or round ends and corners.

    Args:
        dashes: Lengths of the dashes and gaps, in multiples of the width.
    """
    solid, cap, join = Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.BevelJoin
    if ends == "round":
        cap, join = Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin
    result = QPen(colour, width, solid, cap, join)
    if dashes:
        result.setDashPattern(list(dashes))
    return result


def hover_fill(t: Theme) -> QColor:
    """Return the fill of a control under the mouse, which is more pronounced in "contrast"."""
    return t.c.track2 if t.contrast else t.c.raised


def box(
    painter: QPainter,
    rect: QRect | QRectF,
    radius: float,
    fill: QColor | QGradient | None = None,
    edge: QColor | None = None,
    width: float = 1.0,
    dashed: bool = False,
) -> None:
    """Paint a rounded rectangle with its border on the inside."""
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setBrush(fill if fill is not None else Qt.BrushStyle.NoBrush)
    inner = QRectF(rect)
    if edge is None:
        painter.setPen(Qt.PenStyle.NoPen)
    else:
        painter.setPen(pen(edge, width, [4 / width, 3 / width]) if dashed else QPen(edge, width))
        half = width / 2
        inner.adjust(half, half, -half, -half)
        radius = max(0.0, radius - half)
    painter.drawRoundedRect(inner, radius, radius)
    painter.restore()


def text_width(font: QFont, text: str) -> int:
    """Return the width of a line of text, rounded up to whole logical pixels."""
    return int(QFontMetricsF(font).horizontalAdvance(visible(text)) + 0.999)


def put_text(
    painter: QPainter,
    rect: QRect | QRectF,
    text: str,
    font: QFont,
    colour: QColor,
    align: Qt.AlignmentFlag = LEFT,
) -> None:
    """Paint one line of text, ending in an ellipsis if the text does not fit."""
    area = QRectF(rect)
    text = visible(text)
    elided = QFontMetricsF(font).elidedText(text, Qt.TextElideMode.ElideRight, area.width() + 0.5)
    painter.setFont(font)
    painter.setPen(colour)
    painter.drawText(area, int(align | Qt.TextFlag.TextSingleLine), elided)


def selected_edge(t: Theme | None = None) -> int:
    """Return the border width of a selected or pressed control, one pixel wider than usual."""
    return (t or theme()).line_width + 1
