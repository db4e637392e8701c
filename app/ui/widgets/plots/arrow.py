"""The curved arrow of the guidance: which way to turn, or a check once the light is right."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, TypeAlias

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QPainter, QPainterPath, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy

from app.ui.theme import theme
from app.ui.widgets.plots.base import Plot, polygon
from app.ui.widgets.plots.geometry import arrow_shape

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

Sign: TypeAlias = Literal["clockwise", "counter-clockwise", "check", "none"]
"""What the arrow shows; "none" shows nothing, while the heading is lost."""

_NAMES = {
    "clockwise": "Turn clockwise",
    "counter-clockwise": "Turn counter-clockwise",
    "check": "You are in the light",
    "none": "No direction now",
}


class TurnArrow(Plot):
    """A thick curved arrow in amber, or a green check."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("", parent)
        self._sign: Sign = "none"
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.set_sign("none")

    def sizeHint(self) -> QSize:
        """Return the size that the design asks for, at the scale of the theme."""
        return QSize(theme().px(320), theme().px(104))

    @property
    def sign(self) -> Sign:
        """What it shows."""
        return self._sign

    def set_sign(self, sign: Sign) -> None:
        """Show another sign."""
        self._sign = sign
        self.setAccessibleName(_NAMES[sign])
        self.update()

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the sign."""
        if self._sign == "check":
            self._draw_check(painter)
        elif self._sign != "none":
            self._draw_arrow(painter, clockwise=self._sign == "clockwise")

    def _draw_arrow(self, painter: QPainter, *, clockwise: bool) -> None:
        shape = arrow_shape(self.width(), self.height(), clockwise=clockwise)
        centre = QPointF(*shape.centre)
        # Qt counts angles from the right, counter-clockwise.
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
        join = Qt.PenJoinStyle.RoundJoin
        cap = Qt.PenCapStyle.RoundCap
        painter.setPen(QPen(theme().c.ok, math.ceil(22 * unit), Qt.PenStyle.SolidLine, cap, join))
        painter.drawPolyline(line)


def _circle(centre: QPointF, radius: float) -> QRectF:
    return QRectF(centre.x() - radius, centre.y() - radius, 2.0 * radius, 2.0 * radius)
