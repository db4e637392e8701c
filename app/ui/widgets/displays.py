"""Widgets that display pictures, values and progress."""

from __future__ import annotations

from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, QRect, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPixmap
from PySide6.QtWidgets import QProgressBar, QSizePolicy, QWidget
from shiboken6 import isValid

from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.widgets.paint import PaintedWidget, Paints, box, draw_tag, faint, mix, pen, tag_size

_STEPS: Final = 1000
_TICK_MS: Final = 40
_TURN_DEG: Final = 16
_SPAN_DEG: Final = 100


def draw_ring(painter: QPainter, rect: QRect | QRectF, colour: QColor, phase_deg: float) -> None:
    """Paint a busy indicator whose moving arc starts `phase_deg` degrees clockwise from the top."""
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    width = max(2.0, rect.width() / 8)
    area = QRectF(rect).adjusted(width / 2, width / 2, -width / 2, -width / 2)
    painter.setPen(QPen(faint(colour, 0.25), width))
    painter.drawEllipse(area)
    painter.setPen(pen(colour, width, ends="round"))
    painter.drawArc(area, round((90 - phase_deg) * 16), -_SPAN_DEG * 16)
    painter.restore()


class Beat(QObject):
    """A timer that keeps repainting a widget while the widget is busy and visible."""

    def __init__(self, widget: QWidget) -> None:
        super().__init__()
        self._widget = widget
        self.phase_deg = 0.0
        self._is_on = False
        self._timer: QTimer | None = None

    def run(self, on: bool) -> None:
        """Start or stop the animation."""
        self._is_on = on
        if on and self._timer is None:
            # Create the timer on demand, because every button has one and few are ever busy.
            self._timer = QTimer(self._widget)
            self._timer.setInterval(_TICK_MS)
            self._timer.timeout.connect(self._advance)
            self._widget.installEventFilter(self)
        self._follow()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Pause the animation while the widget is hidden."""
        if event.type() in (QEvent.Type.Show, QEvent.Type.Hide):
            self._follow()
        return False

    def _follow(self) -> None:
        if self._timer is not None and isValid(self._timer):
            moving = self._is_on and self._widget.isVisible()
            if moving != self._timer.isActive():
                self._timer.start() if moving else self._timer.stop()

    def _advance(self) -> None:
        self.phase_deg = (self.phase_deg + _TURN_DEG) % 360
        self._widget.update()


class Spinner(PaintedWidget):
    """A ring that rotates while a task is running."""

    def __init__(self, name: str = tr("Working")) -> None:
        super().__init__()
        side = px(16)
        self.setFixedSize(side, side)
        self.setAccessibleName(name)
        self._beat = Beat(self)
        self._beat.run(True)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the ring in the current theme."""
        draw_ring(painter, self.rect(), t.c.text, self._beat.phase_deg)


class Bar(Paints, QProgressBar):
    """A progress bar, 160 x 4 pixels in size, in neutral colours."""

    def __init__(self, name: str = tr("Progress")) -> None:
        super().__init__()
        self.setFixedSize(px(160), px(4))
        self.setRange(0, _STEPS)
        self.setTextVisible(False)
        self.setAccessibleName(name)
        self._unknown = False
        self._beat = Beat(self)

    def set(self, fraction: float | None) -> None:
        """Show progress from 0 to 1, or a moving bar if `fraction` is None."""
        self._unknown = fraction is None
        self._beat.run(self._unknown)
        # Otherwise, Qt would repaint the bar and all other pending parts of the window at once.
        self.setUpdatesEnabled(False)
        self.setValue(0 if fraction is None else round(min(max(fraction, 0.0), 1.0) * _STEPS))
        self.setUpdatesEnabled(True)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the bar in the current theme."""
        c, area = t.c, QRectF(self.rect())
        radius = area.height() / 2
        box(painter, area, radius, c.track2)
        part = QRectF(area)
        part.setWidth(area.width() * self.value() / _STEPS)
        if self._unknown:
            part.setWidth(area.width() / 4)
            part.moveLeft(area.width() * (self._beat.phase_deg / 360 * 1.25 - 0.25))
            painter.setClipRect(area)
        if part.width() > 0:
            part.setWidth(max(part.width(), area.height()))
            box(painter, part, radius, c.text)


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
    """Paint a meter from 0 to 100 in a rectangle. There is no tick if `limit` is None."""
    t = theme()
    ink = fill or t.c.text
    area, high = QRectF(rect), float(px(_RAIL))
    top = round(area.center().y() - high / 2)
    rail = QRectF(area.left(), top, area.width(), high)
    box(painter, rail, high / 2, t.c.track2)
    own = value if before is None else min(before, value)
    if before is not None and value > before:
        _part(painter, rail, value, mix(t.c.track2, ink, _GAIN_TONE))
    _part(painter, rail, own, ink)
    if limit is not None:
        wide, tall = px(2), px(_TICK)
        x = round(area.left() + area.width() * limit / _FULL - wide / 2)
        tick = QRectF(x, top - (tall - high) / 2, wide, tall)
        # A gap in the background colour keeps the tick visible on the filled part.
        painter.fillRect(tick.adjusted(-px(1), 0, px(1), 0), t.c.panel)
        painter.fillRect(tick, t.c.dim)


def _part(painter: QPainter, rail: QRectF, value: float, colour: QColor) -> None:
    share = min(max(value, 0.0), _FULL) / _FULL
    if share > 0:
        part = QRectF(rail)
        part.setWidth(max(rail.width() * share, rail.height()))
        box(painter, part, rail.height() / 2, colour)


class Meter(PaintedWidget):
    """A meter that is 4 pixels high."""

    preferred_size, least = (120, _TICK), (24, _TICK)

    def __init__(self, name: str = tr("Match")) -> None:
        super().__init__()
        self._name = name
        self._values: tuple[float, float | None, float | None] = (0.0, 45, None)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._describe()

    def set(self, value: float, limit: float | None = 45, before: float | None = None) -> None:
        """Show a value from 0 to 100. There is no tick if `limit` is None."""
        if (value, limit, before) != self._values:
            self._values = (value, limit, before)
            self._describe()
            self.update()

    def _describe(self) -> None:
        value, _limit, before = self._values
        words = tr("{name} {value} of 100", name=self._name, value=int(value))
        if before is not None:
            words = tr("{match}, previously {before}", match=words, before=int(before))
        self.setAccessibleName(words)

    def paint_on(self, painter: QPainter, _t: Theme) -> None:
        """Paint the meter in the current theme."""
        value, limit, before = self._values
        draw_meter(painter, self.rect(), value, limit, before)


Corner: TypeAlias = Literal["tl", "tr", "bl", "br"]

_TAG_INSET: Final = 8


def to_image(picture: NDArray[np.uint8]) -> QImage:
    """Copy an sRGB array, (h, w, 3) uint8 with row 0 at the top, into an image that Qt can paint.

    Raises:
        ValueError: If the array has a different shape or type.
    """
    if picture.ndim != 3 or picture.shape[2] != 3 or picture.dtype != np.uint8:
        raise ValueError(f"not an (h, w, 3) uint8 picture: {picture.shape} {picture.dtype}")
    rows = np.ascontiguousarray(picture)
    height, width = rows.shape[:2]
    shared = QImage(rows.data, width, height, 3 * width, QImage.Format.Format_RGB888)
    return shared.copy()


class Picture(PaintedWidget):
    """A picture that is cropped to fill its area."""

    preferred_size, least = (94, 68), (24, 16)

    def __init__(self, name: str, radius: int = 6) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._radius = px(radius)
        self._array: NDArray[np.uint8] | None = None
        self._image: QImage | None = None
        self._ready: tuple[tuple[Any, ...], QPixmap] | None = None
        self._tags: dict[Corner, str] = {}

    def set_picture(self, picture: NDArray[np.uint8] | None) -> None:
        """Show an sRGB array, (h, w, 3) uint8, or an empty well if `picture` is None.

        The array must not be modified afterwards.

        Raises:
            ValueError: If the array has a different shape or type.
        """
        if picture is not None and picture is self._array:
            return
        self._image = None if picture is None else to_image(picture)
        self._array = picture
        self._changed()

    def set_tag(self, text: str, corner: Corner = "bl") -> None:
        """Show a label in one corner of the picture."""
        if self._tags.get(corner, "") != text:
            self._tags[corner] = text
            self.update()

    def _changed(self) -> None:
        self._ready = None
        self.update()

    def _prepare(self, dpr: float) -> QPixmap | None:
        """Return the picture, cropped, scaled and rounded for its current size.

        The result is cached until the size changes.
        """
        if self._image is None or self._array is None or self.size().isEmpty():
            return None
        wide, high = round(self.width() * dpr), round(self.height() * dpr)
        key = (wide, high)
        if self._ready is not None and self._ready[0] == key:
            return self._ready[1]
        fitted = self._image.scaled(
            wide,
            high,
            Qt.AspectRatioMode.KeepAspectRatioByExpanding,
            Qt.TransformationMode.SmoothTransformation,
        )
        left, top = (fitted.width() - wide) // 2, (fitted.height() - high) // 2
        pixmap = self._rounded(fitted.copy(QRect(left, top, wide, high)), self._radius * dpr)
        pixmap.setDevicePixelRatio(dpr)
        self._ready = (key, pixmap)
        return pixmap

    @staticmethod
    def _rounded(image: QImage, radius: float) -> QPixmap:
        # Clipping to a path leaves jagged corners, but a painted mask does not.
        mask = QImage(image.size(), QImage.Format.Format_ARGB32_Premultiplied)
        mask.fill(Qt.GlobalColor.transparent)
        painter = QPainter(mask)
        box(painter, mask.rect(), radius, QColor(Qt.GlobalColor.white))
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceIn)
        painter.drawImage(QPointF(0, 0), image)
        painter.end()
        return QPixmap.fromImage(mask)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the picture and its label in the current theme."""
        box(painter, self.rect(), self._radius, t.c.well)
        pixmap = self._prepare(painter.deviceTransform().m11())
        if pixmap is not None:
            painter.drawPixmap(QPointF(0, 0), pixmap)
        self._paint_tags(painter)

    def _paint_tags(self, painter: QPainter) -> None:
        usual = px(_TAG_INSET)
        for corner, text in self._tags.items():
            if text:
                # On a small picture, a long label moves closer to the edge before it is cut off.
                inset = max(min(usual, (self.width() - tag_size(text)[0]) // 2), 0)
                area = QRectF(self.rect()).adjusted(inset, usual, -inset, -usual)
                x = area.left() if "l" in corner else area.right()
                y = area.top() if "t" in corner else area.bottom()
                draw_tag(painter, x, y, text, corner, most=self.width())
