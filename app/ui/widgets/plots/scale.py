"""The key of weights: blue for darker, orange for brighter, always with their signs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QLinearGradient, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy

from app.ui.theme import theme
from app.ui.widgets.plots.base import Plot, draw_text, snap

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

WeightSign: TypeAlias = Literal["plus", "minus"]

_GREY: Final = QColor(0x6E, 0x6E, 0x6E)
_GAP: Final = 12


def draw_sign(painter: QPainter, area: QRectF, sign: WeightSign) -> None:
    """Draw the tile of a weight: orange with a plus, or blue with a minus.

    Parameters
    ----------
    painter : QPainter
        Antialiased, in logical pixels.
    area : QRectF
        Of the tile; square, on whole pixels.
    """
    t = theme()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(t.c.plus if sign == "plus" else t.c.minus)
    painter.drawRoundedRect(area, t.px(3), t.px(3))
    arm = area.width() * 0.22
    ratio = max(painter.deviceTransform().m11(), 0.25)
    width = max(area.width() / 10.0, 1.5)
    x, y = snap(area.center().x(), ratio, width), snap(area.center().y(), ratio, width)
    painter.setPen(QPen(Qt.GlobalColor.black, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap))
    painter.drawLine(QPointF(x - arm, y), QPointF(x + arm, y))
    if sign == "plus":
        painter.drawLine(QPointF(x, y - arm), QPointF(x, y + arm))


class WeightScale(Plot):
    """A bar from blue over grey to orange, with words and tiles at its ends."""

    def __init__(
        self,
        less: str = "should be darker",
        more: str = "should be brighter",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(f"Weights: blue and minus {less}, orange and plus {more}", parent)
        self._words = (less, more)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        """Return the size that the design asks for, at the scale of the theme."""
        return QSize(680, theme().px(20))

    def minimumSizeHint(self) -> QSize:
        """Return the width at which the bar is still seen."""
        t = theme()
        metrics = QFontMetricsF(t.font(12))
        words = sum(metrics.horizontalAdvance(each) for each in self._words)
        return QSize(round(words) + t.px(2 * 20 + 4 * _GAP + 48), t.px(20))

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint tiles, words and the bar."""
        t = theme()
        side, gap = float(t.px(20)), float(t.px(_GAP))
        y, middle = (self.height() - side) / 2.0, self.height() / 2.0
        draw_sign(painter, QRectF(0.0, round(y), side, side), "minus")
        draw_sign(painter, QRectF(self.width() - side, round(y), side, side), "plus")
        font = t.font(12)
        left = side + gap
        left += draw_text(painter, (left, middle), self._words[0], font, t.c.dim, 0.0) + gap
        right = self.width() - side - gap
        right -= draw_text(painter, (right, middle), self._words[1], font, t.c.dim, 1.0) + gap
        height = t.px(12)
        bar = QRectF(left, round(middle - height / 2.0), max(right - left, 0.0), height)
        gradient = QLinearGradient(bar.topLeft(), bar.topRight())
        for place, colour in ((0.0, t.c.minus), (0.5, _GREY), (1.0, t.c.plus)):
            gradient.setColorAt(place, colour)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(gradient)
        painter.drawRoundedRect(bar, height / 2.0, height / 2.0)


class WeightLegend(Plot):
    """Two tiles with words: what orange and blue on a panorama mean."""

    def __init__(
        self,
        helps: str = "light helps",
        harms: str = "light harms",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(f"Orange and plus: {helps}. Blue and minus: {harms}", parent)
        self._words: tuple[tuple[WeightSign, str], ...] = (("plus", helps), ("minus", harms))
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        """Return the size of its words."""
        t = theme()
        metrics = QFontMetricsF(t.font(12))
        words = sum(metrics.horizontalAdvance(each) for _, each in self._words)
        return QSize(round(words) + t.px(2 * (16 + 6) + 16) + 2, t.px(16))

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint tiles and words."""
        t = theme()
        side, x = float(t.px(16)), 0.0
        top = round((self.height() - side) / 2.0)
        for sign, words in self._words:
            draw_sign(painter, QRectF(round(x), top, side, side), sign)
            x = round(x) + side + t.px(6)
            place = (x, self.height() / 2.0)
            x += draw_text(painter, place, words, t.font(12), t.c.dim, 0.0) + t.px(16)
