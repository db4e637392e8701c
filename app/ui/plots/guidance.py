"""The remaining degrees and the turn arrow, painted without pyqtgraph because they plot no data."""

from __future__ import annotations

import math
from typing import Final, Literal, TypeAlias

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QFont, QFontMetricsF, QPainter, QPainterPath, QPolygonF
from PySide6.QtWidgets import QSizePolicy

from app.core.text import tr
from app.ui.plots.parts.base import Plot, polygon
from app.ui.plots.parts.geometry import arrow_shape
from app.ui.theme import px, theme
from app.ui.widgets.paint import pen

_FIGURE: Final = 224
_LINE: Final = 176
_WORDS: Final = 32
_WORDS_LINE: Final = 36
_LEAST: Final = 48
_SIGN: Final = "°"
_SIGN_SIZE: Final = 0.54  # fraction of the number's size


class BigDegrees(Plot):
    """A large number of degrees, with text to the right of the last digit.

    If the number and the text are wider than the widget, they shrink together.
    """

    policies = (QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def __init__(self, size: int = _FIGURE) -> None:
        super().__init__("")
        self._size = size
        self._number: int | None = None
        self._words: tuple[str, ...] = ()
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def sizeHint(self) -> QSize:
        """Return the design size at the theme's scale."""
        return QSize(px(432), px(_LINE * self._size / _FIGURE))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size."""
        return QSize(px(160), self.sizeHint().height())

    def set_value(self, degrees: int | None, words: str = tr("to go")) -> None:
        """Show a non-negative number of degrees, or nothing if `degrees` is None.

        `degrees` is None while the heading is lost. `words`, such as "to go" or "too far", is set
        on two lines if it has more than two words.
        """
        self._number = degrees
        parts = words.split()
        half = (len(parts) + 1) // 2
        lines = [words] if len(parts) < 3 else [" ".join(parts[:half]), " ".join(parts[half:])]
        self._words = tuple(line for line in lines if line)
        self.setAccessibleName("" if degrees is None else f"{degrees}° {words}".strip())
        self.update()

    def figure_font(self) -> QFont:
        """Return the font of the number, at its design size or smaller to fit the widget."""
        size, need = self._size, self._extent(self._size)
        if need > self.width():
            # Start close to the final size, because every size creates a new font.
            steps = int(size * (1.0 - self.width() / need) / 2.0)
            size = max(size - 2 * steps, _LEAST)
            while size + 2 <= self._size and self._extent(size + 2) <= self.width():
                size += 2
            while size > _LEAST and self._extent(size) > self.width():
                size -= 2
        return theme().font(size, 700)

    def _extent(self, size: int) -> float:
        """Return the required width.

        This is twice the width of the wider half, because the number is centred.
        """
        digits, number = self._widths(theme().font(size, 700), size)
        return max(number, 2.0 * (digits + self._side(size) - number / 2.0))

    def _widths(self, font: QFont, size: int) -> tuple[float, float]:
        """Return the width of the digits, first without and then with the degree sign."""
        digits = QFontMetricsF(font).horizontalAdvance(str(self._number))
        return digits, digits + QFontMetricsF(self._sign_font(size)).horizontalAdvance(_SIGN)

    def _sign_font(self, size: int) -> QFont:
        return theme().font(round(size * _SIGN_SIZE), 700)

    def _side(self, size: int) -> float:
        """Return the width of the text to the right of the last digit."""
        font = self._words_font(size)
        widths = [QFontMetricsF(font).horizontalAdvance(line) for line in self._words]
        return max(widths, default=0.0) + px(10)

    def _words_font(self, size: int) -> QFont:
        return theme().font(max(round(_WORDS * size / _FIGURE), 14), 600)

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the number, the degree sign and the text."""
        if self._number is None:
            return
        t = theme()
        font = self.figure_font()
        size = round(font.pixelSize() / t.scale)
        tall = QFontMetricsF(font).capHeight()
        digits, number = self._widths(font, size)
        left = round((self.width() - number) / 2.0 * ratio) / ratio
        base = round((self.height() + tall) / 2.0 * ratio) / ratio
        painter.setPen(t.c.text)
        painter.setFont(font)
        painter.drawText(QPointF(left, base), str(self._number))
        sign = self._sign_font(size)
        painter.setFont(sign)
        # The ring of the degree sign extends slightly above the digits.
        ring = QFontMetricsF(sign).tightBoundingRect(_SIGN).top()
        top = max(base - tall - size / 50.0, 1.0) - ring
        painter.drawText(QPointF(left + digits, top), _SIGN)
        small = self._words_font(size)
        painter.setFont(small)
        line = px(_WORDS_LINE) * small.pixelSize() / px(_WORDS)
        for index, words in enumerate(reversed(self._words)):
            painter.drawText(QPointF(left + digits + px(10), base - index * line), words)


Sign: TypeAlias = Literal["clockwise", "counter-clockwise", "check", "none"]
"""Sign that the turn arrow shows. It is "none" while the heading is lost."""

NAMES = {
    "clockwise": tr("Turn clockwise"),
    "counter-clockwise": tr("Turn counter-clockwise"),
    "check": tr("You are in the light"),
    "none": tr("No direction available"),
}


class TurnArrow(Plot):
    """A thick, curved amber arrow, or a green check mark."""

    preferred_size = (320, 104)
    policies = (QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def __init__(self) -> None:
        super().__init__("")
        self.sign: Sign = "none"
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.set_sign("none")

    def set_sign(self, sign: Sign) -> None:
        """Show a different sign."""
        self.sign = sign
        self.setAccessibleName(NAMES[sign])
        self.update()

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the sign."""
        if self.sign == "check":
            self._draw_check(painter)
        elif self.sign != "none":
            self._draw_arrow(painter, clockwise=self.sign == "clockwise")

    def _draw_arrow(self, painter: QPainter, *, clockwise: bool) -> None:
        shape = arrow_shape(self.width(), self.height(), clockwise=clockwise)
        centre = QPointF(*shape.centre)
        # Qt measures angles from the right, counter-clockwise.
        start, sweep = 90.0 - shape.start_deg, shape.start_deg - shape.stop_deg
        path = QPainterPath()
        outer, inner = _circle(centre, shape.outer), _circle(centre, shape.inner)
        path.arcMoveTo(outer, start)
        path.arcTo(outer, start, sweep)
        path.arcTo(inner, start + sweep, -sweep)
        path.closeSubpath()
        head = QPainterPath()
        head.addPolygon(polygon(shape.head))
        head.closeSubpath()
        painter.fillPath(path.united(head), theme().c.amber)

    def _draw_check(self, painter: QPainter) -> None:
        unit = min(self.width() / 320.0, self.height() / 104.0)
        middle = QPointF(self.width() / 2.0, self.height() / 2.0)
        corners = ((-44.0, 2.0), (-12.0, 34.0), (44.0, -30.0))
        line = QPolygonF([middle + QPointF(x, y) * unit for x, y in corners])
        painter.setPen(pen(theme().c.ok, math.ceil(22 * unit), ends="round"))
        painter.drawPolyline(line)


def _circle(centre: QPointF, radius: float) -> QRectF:
    return QRectF(centre.x() - radius, centre.y() - radius, 2.0 * radius, 2.0 * radius)
