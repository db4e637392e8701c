"""Meters: a number of 100, with the limit of reach."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF, QSize
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.widgets.paint import box, mix

_RAIL: Final = 4
_TICK: Final = 8
_GAIN_TONE: Final = 0.45
_FULL: Final = 100.0


def draw_meter(
    painter: QPainter,
    rect: QRect | QRectF,
    value: float,
    limit: float | None = 45,
    before: float | None = None,
    fill: QColor | None = None,
) -> None:
    """Paint a meter into the middle of a rectangle.

    Parameters
    ----------
    value : float
        0 to 100.
    limit : float or None, optional
        Where the tick stands; None for no tick.
    """
    t = theme()
    ink = fill or t.c.text
    area, high = QRectF(rect), float(t.px(_RAIL))
    top = round(area.center().y() - high / 2)
    rail = QRectF(area.left(), top, area.width(), high)
    box(painter, rail, high / 2, t.c.track2)
    own = value if before is None else min(before, value)
    if before is not None and value > before:
        _part(painter, rail, value, mix(t.c.track2, ink, _GAIN_TONE))
    _part(painter, rail, own, ink)
    if limit is not None:
        wide, tall = t.px(2), t.px(_TICK)
        x = round(area.left() + area.width() * limit / _FULL - wide / 2)
        tick = QRectF(x, top - (tall - high) / 2, wide, tall)
        # A gap in the colour underneath keeps the tick visible on the filled part.
        painter.fillRect(tick.adjusted(-t.px(1), 0, t.px(1), 0), t.c.panel)
        painter.fillRect(tick, t.c.dim)


def _part(painter: QPainter, rail: QRectF, value: float, colour: QColor) -> None:
    share = min(max(value, 0.0), _FULL) / _FULL
    if share > 0:
        part = QRectF(rail)
        part.setWidth(max(rail.width() * share, rail.height()))
        box(painter, part, rail.height() / 2, colour)


class Meter(QWidget):
    """A meter 4 high."""

    def __init__(self, name: str = "Match") -> None:
        super().__init__()
        self._name = name
        self._shown: tuple[float, float | None, float | None] = (0.0, 45, None)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._describe()

    def set(self, value: float, limit: float | None = 45, before: float | None = None) -> None:
        """Show a value.

        Parameters
        ----------
        value : float
            0 to 100.
        limit : float or None, optional
            Where the tick stands; None for no tick.
        """
        if (value, limit, before) != self._shown:
            self._shown = (value, limit, before)
            self._describe()
            self.update()

    def _describe(self) -> None:
        value, _limit, before = self._shown
        words = f"{self._name} {int(value)} of 100"
        self.setAccessibleName(words if before is None else f"{words}, before {int(before)}")

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        return QSize(theme().px(120), theme().px(_TICK))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        return QSize(theme().px(24), theme().px(_TICK))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        value, limit, before = self._shown
        draw_meter(QPainter(self), self.rect(), value, limit, before)
