"""How far work has come: the ring of a busy control, and the bar of the job line."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRect, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QHideEvent, QPainter, QPaintEvent, QPen, QShowEvent
from PySide6.QtWidgets import QProgressBar, QSizePolicy, QWidget

from app.ui.theme import theme

_STEPS: Final = 1000
_TICK_MS: Final = 40
_TURN_DEG: Final = 16
_SPAN_DEG: Final = 100


def draw_ring(painter: QPainter, rect: QRect | QRectF, colour: QColor, phase_deg: float) -> None:
    """Paint the ring of something busy.

    Parameters
    ----------
    phase_deg : float
        Where the moving part starts, clockwise from the top.
    """
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    width = max(2.0, rect.width() / 8)
    area = QRectF(rect).adjusted(width / 2, width / 2, -width / 2, -width / 2)
    faint = QColor(colour)
    faint.setAlphaF(0.25)
    painter.setPen(QPen(faint, width))
    painter.drawEllipse(area)
    pen = QPen(colour, width)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setPen(pen)
    painter.drawArc(area, round((90 - phase_deg) * 16), -_SPAN_DEG * 16)
    painter.restore()


class Beat:
    """A timer that repaints a widget while it is busy and can be seen."""

    def __init__(self, widget: QWidget) -> None:
        self._widget = widget
        self.phase_deg = 0.0
        self._timer: QTimer | None = None

    def run(self, wanted: bool) -> None:
        """Start or stop."""
        if wanted and self._timer is None:
            # Every button has a beat, and few are ever busy.
            self._timer = QTimer(self._widget, interval=_TICK_MS)
            self._timer.timeout.connect(self._advance)
        if self._timer is None:
            return
        if wanted and not self._timer.isActive():
            self._timer.start()
        elif not wanted:
            self._timer.stop()

    def _advance(self) -> None:
        self.phase_deg = (self.phase_deg + _TURN_DEG) % 360
        self._widget.update()


class Spinner(QWidget):
    """A ring that turns while something is under way."""

    def __init__(self, name: str = "Working", size: int = 16) -> None:
        super().__init__()
        side = theme().px(size)
        self.setFixedSize(side, side)
        self.setAccessibleName(name)
        self._beat = Beat(self)

    def showEvent(self, event: QShowEvent) -> None:
        """Start moving what moves."""
        super().showEvent(event)
        self._beat.run(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Nothing moves while it cannot be seen."""
        super().hideEvent(event)
        self._beat.run(False)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        draw_ring(QPainter(self), self.rect(), theme().c.text, self._beat.phase_deg)


class Bar(QProgressBar):
    """A bar of 160 x 4 in neutral colours."""

    def __init__(self, name: str = "Progress") -> None:
        super().__init__()
        t = theme()
        self.setFixedSize(t.px(160), t.px(4))
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setRange(0, _STEPS)
        self.setTextVisible(False)
        self.setAccessibleName(name)
        self._unknown = False
        self._beat = Beat(self)

    def set(self, fraction: float | None) -> None:
        """Show how much is done.

        Parameters
        ----------
        fraction : float or None
            0 to 1; None when nobody knows, which shows a part that moves along.
        """
        self._unknown = fraction is None
        self._beat.run(self._unknown and self.isVisible())
        # Qt would paint it at once, and all else in the window that waits to be painted.
        self.setUpdatesEnabled(False)
        self.setValue(0 if fraction is None else round(min(max(fraction, 0.0), 1.0) * _STEPS))
        self.setUpdatesEnabled(True)

    def sizeHint(self) -> QSize:
        """160 x 4 at the theme's scale."""
        return QSize(theme().px(160), theme().px(4))

    def showEvent(self, event: QShowEvent) -> None:
        """Start moving what moves."""
        super().showEvent(event)
        self._beat.run(self._unknown)

    def hideEvent(self, event: QHideEvent) -> None:
        """Nothing moves while it cannot be seen."""
        super().hideEvent(event)
        self._beat.run(False)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        c, area = theme().c, QRectF(self.rect())
        radius = area.height() / 2
        painter.setBrush(c.track2)
        painter.drawRoundedRect(area, radius, radius)
        part = QRectF(area)
        part.setWidth(area.width() * self.value() / _STEPS)
        if self._unknown:
            part.setWidth(area.width() / 4)
            part.moveLeft(area.width() * (self._beat.phase_deg / 360 * 1.25 - 0.25))
            painter.setClipRect(area)
        if part.width() > 0:
            part.setWidth(max(part.width(), area.height()))
            painter.setBrush(c.text)
            painter.drawRoundedRect(part, radius, radius)
