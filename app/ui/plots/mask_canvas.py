"""A canvas for painting a mask of the lamp on a captured panorama, and the ring of the brush."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, Literal, Protocol, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPen, QResizeEvent, QWheelEvent

from app.core.base.angles import difference, wrap
from app.core.text import tr
from app.ui.plots.parts.base import Plot, arrow_step, disc
from app.ui.plots.parts.curve_items import Mark
from app.ui.plots.parts.geometry import Point
from app.ui.plots.parts.layers import PanoramaLayer
from app.ui.plots.parts.mapping import Viewport
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import pen

BrushSign: TypeAlias = Literal["plus", "minus", "ignore", "restore"]
"""Effect of the brush: to make an area brighter or darker, or to ignore or restore it."""

_RING_WHITE = QColor(255, 255, 255)
_BLACK = QColor(0, 0, 0)
_SHADOW = QColor(0, 0, 0, 150)


def draw_brush_ring(
    painter: QPainter, centre: Point, radius: float, inner: float, sign: BrushSign
) -> None:
    """Draw the extent of the brush, its area of full strength, and the sign for its effect.

    The inner ring, which shows the area of full strength, is left out if it would not fit.
    """
    middle = QPointF(*centre)
    painter.save()
    for colour, width in ((_BLACK, 4.0), (_RING_WHITE, 2.0)):
        disc(painter, centre, radius, None, colour, width)
    if 5.0 <= inner <= radius - 3.0:
        _draw_inner(painter, middle, inner)
    if radius >= 12.0:
        _draw_sign(painter, middle, sign)
    painter.restore()


def _draw_inner(painter: QPainter, middle: QPointF, radius: float) -> None:
    painter.setPen(QPen(_SHADOW, 3.0))
    painter.drawEllipse(middle, radius, radius)
    # Use a whole number of dashes, so that none is cut where the ring closes.
    count = max(round(2.0 * 3.14159 * radius / 8.0), 6)
    length = 2.0 * 3.14159 * radius / count / 1.5
    painter.setPen(pen(_RING_WHITE, 1.5, [length / 2.0, length / 2.0]))
    painter.drawEllipse(middle, radius, radius)


def _draw_sign(painter: QPainter, middle: QPointF, sign: BrushSign) -> None:
    if sign in ("ignore", "restore"):
        for colour, shift in ((_BLACK, 1.0), (_RING_WHITE, 0.0)):
            area = QRectF(middle.x() - 8.0 + shift, middle.y() - 8.0 + shift, 16.0, 16.0)
            draw_icon(painter, sign, area, 16, colour)
        return
    arm = 5.0
    lines = [(QPointF(-arm, 0.0), QPointF(arm, 0.0))]
    if sign == "plus":
        lines.append((QPointF(0.0, -arm), QPointF(0.0, arm)))
    for colour, width, cap in (
        (_BLACK, 4.0, Qt.PenCapStyle.SquareCap),
        (_RING_WHITE, 2.0, Qt.PenCapStyle.FlatCap),
    ):
        painter.setPen(QPen(colour, width, Qt.PenStyle.SolidLine, cap))
        for start, stop in lines:
            painter.drawLine(middle + start, middle + stop)


_ZOOMS: Final = (1.0, 2.0, 4.0, 8.0)
_NOTCH: Final = 120
_TINT: Final = 0.35
_WHITE: Final = 245
_DABS: Final = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space})


class MaskPicture(Protocol):
    """The panorama, the mask and the brush (see `MaskState` of the Light screen)."""

    @property
    def picture(self) -> NDArray[np.uint8]:
        """The panorama, (H, 2 H, 3) uint8 sRGB."""

    @property
    def alpha(self) -> NDArray[np.float32]:
        """The mask, (H, 2 H) float32 from 0 to 1."""

    @property
    def centre(self) -> tuple[float, float]:
        """Azimuth and elevation of the centre of the initial view, in degrees."""

    @property
    def adds_lamp(self) -> bool:
        """Whether the brush adds to the mask."""

    @property
    def radius_deg(self) -> float:
        """Radius of the brush in degrees."""


class MaskCanvas(Plot):
    """The panorama, overlaid with the mask and the brush.

    Dragging paints, the wheel zooms around the pointer, and dragging with the right button pans.
    The arrow keys move the brush by 1°, or by 10° with Shift. Enter or Space paints a dab, and +
    and − zoom.
    """

    preferred_size = (720, 360)
    least = (320, 160)

    pressed = Signal(float, float)
    """Emitted at the start of a stroke with the azimuth and the elevation, in degrees."""

    drawn = Signal(float, float)
    """Emitted for each further point of a stroke with the azimuth and the elevation, in degrees."""

    lifted = Signal()

    def __init__(self) -> None:
        super().__init__(tr("Where the lamp is"))
        self._state: MaskPicture | None = None
        self._layer = self.panel.add(PanoramaLayer())
        self._ring = self.panel.add(Mark(self._draw_brush, 0.0))
        self._ring.hide()
        self.panel.setBackgroundBrush(theme().c.well)
        self.panel.paint_changes_only()
        # Make the widgets opaque, so that a stroke does not repaint the sheet behind them.
        for widget in (self, self.panel.viewport()):
            widget.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._lamp_picture = np.zeros((0, 0, 3), np.uint8)
        self._last: tuple[object, object] = (None, None)
        self._view = Viewport(720.0)
        self._brush: Point | None = None
        self._reach = (0.0, 0.0)  # radii of the brush across and up, in logical pixels
        self._stroking = False
        self._moving: QPointF | None = None
        self.setMouseTracking(True)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setToolTip(tr("Paint with the mouse. Wheel: zoom. Right button: move the picture"))

    def show_state(self, state: MaskPicture) -> None:
        """Show a different mask or brush."""
        first = self._state is None
        self._state = state
        if self._last[0] is not state.picture:
            self._lamp_picture = _tinted(state.picture)
        if self._last[0] is not state.picture or self._last[1] is not state.alpha:
            self._layer.set_pixels(_draw(state.picture, self._lamp_picture, state.alpha))
            self._last = (state.picture, state.alpha)
        if first:
            self._brush = state.centre
            self._look(replace(self._sized(), zoom=_fitting(state.alpha)).moved_to(*state.centre))
        words = tr("Brush radius {radius:.1f}°, erases the lamp", radius=state.radius_deg)
        if state.adds_lamp:
            words = tr("Brush radius {radius:.1f}°, adds to the lamp", radius=state.radius_deg)
        self.say(words)
        self._show_brush()

    # -- view ----------------------------------------------------------------------------------

    def place_of(self, azimuth_deg: float, elevation_deg: float) -> Point:
        """Return the position of a direction in logical pixels."""
        return self._view.x_of(azimuth_deg), self._view.y_of(elevation_deg)

    def spot_at(self, point: Point) -> Point:
        """Return the azimuth and elevation at a point, in degrees."""
        elevation = min(max(self._view.elevation_at(point[1]), -90.0), 90.0)
        return self._view.azimuth_at(point[0]), elevation

    def zoom(self, steps: int) -> None:
        """Zoom in or out, keeping the brush in place."""
        zoom = self._zoomed(steps)
        if zoom != self._view.zoom:
            view = replace(self._view, zoom=zoom)
            middle = self._brush or (view.azimuth_deg, view.elevation_deg)
            self._look(view.moved_to(*middle))

    def _zoomed(self, steps: int) -> float:
        here = _ZOOMS.index(self._view.zoom) + steps
        return _ZOOMS[min(max(here, 0), len(_ZOOMS) - 1)]

    def _sized(self) -> Viewport:
        """Return the same view, adjusted to the widget's current size."""
        view = replace(
            self._view,
            width=float(max(self.width(), 1)),
            shape=self.height() / max(self.width(), 1),
        )
        return view.moved_to(view.azimuth_deg, view.elevation_deg)

    def _look(self, view: Viewport) -> None:
        self._view = view
        self.panel.look(view)
        self._show_brush()

    def _show_brush(self) -> None:
        """Place the ring around the brush, stretched as the panorama is at that elevation."""
        self._ring.setVisible(self._brush is not None and self._state is not None)
        if self._brush is None or self._state is None:
            return
        up = self._state.radius_deg * self._view.scale
        # The panorama stretches everything near the poles.
        across = min(up / max(math.cos(math.radians(self._brush[1])), 0.05), self.width())
        self._reach = (across, up)
        self._ring.set_size(2.0 * max(across, up, px(5)) + 8.0)
        ahead = difference(self._brush[0], self._view.azimuth_deg)
        self._ring.setPos(self._view.azimuth_deg + ahead, -self._brush[1])
        self._ring.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the same view when the size changes."""
        super().resizeEvent(event)
        self._look(self._sized())

    # -- mouse and keyboard --------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a stroke, or start panning."""
        if event.button() == Qt.MouseButton.LeftButton and self._state is not None:
            self._stroking = True
            self._brush = self.spot_at((event.position().x(), event.position().y()))
            self.pressed.emit(*self._brush)
        elif event.button() in (Qt.MouseButton.RightButton, Qt.MouseButton.MiddleButton):
            self._moving = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Extend the stroke, pan, or move the ring."""
        here = event.position()
        if self._moving is not None:
            by, self._moving = here - self._moving, here
            self._look(self._view.panned(by.x(), by.y()))
            return
        self._brush = self.spot_at((here.x(), here.y()))
        if self._stroking:
            self.drawn.emit(*self._brush)
        self._show_brush()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the stroke."""
        if event.button() == Qt.MouseButton.LeftButton and self._stroking:
            self._stroking = False
            self.lifted.emit()
        elif self._moving is not None:
            self._moving = None

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom around the pointer."""
        notches = event.angleDelta().y() / _NOTCH
        if notches:
            here, zoom = event.position(), self._zoomed(1 if notches > 0 else -1)
            self._look(self._view.zoomed(zoom, here.x(), here.y()))
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the brush, paint a dab, or zoom."""
        key = Qt.Key(event.key())
        if self._brush is not None and (step := arrow_step(event)):
            height = min(max(self._brush[1] + step[1], -90.0), 90.0)
            self._brush = (wrap(self._brush[0] + step[0]), height)
            self._follow()
        elif self._brush is not None and key in _DABS:
            self.pressed.emit(*self._brush)
            self.lifted.emit()
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Minus):
            self.zoom(-1 if key == Qt.Key.Key_Minus else 1)
        else:
            super().keyPressEvent(event)
            return
        event.accept()

    def _follow(self) -> None:
        """Scroll to keep the brush visible."""
        assert self._brush is not None
        x, y = self.place_of(*self._brush)
        if not self.rect().contains(QPointF(x, y).toPoint()):
            self._look(self._view.moved_to(*self._brush))
        self._show_brush()

    # -- painting ------------------------------------------------------------------------------

    def draw(self, painter: QPainter, _ratio: float) -> None:
        """Paint the well that surrounds the panorama."""
        painter.fillRect(self.rect(), theme().c.well)

    def _draw_brush(self, painter: QPainter, middle: Point) -> None:
        assert self._state is not None
        (x, y), (across, up), arm = middle, self._reach, float(px(5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        inks = ((QColor(Qt.GlobalColor.black), 4.0), (theme().c.ontag, 2.0))
        for colour, width in inks:
            painter.setPen(QPen(colour, width))
            painter.drawEllipse(QPointF(x, y), across, up)
        for colour, width in inks:
            painter.setPen(QPen(colour, width))
            painter.drawLine(QPointF(x - arm, y), QPointF(x + arm, y))
            if self._state.adds_lamp:
                painter.drawLine(QPointF(x, y - arm), QPointF(x, y + arm))


def _tinted(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture tinted as it appears inside the mask."""
    amber = theme().c.amberfill
    tone = np.array([amber.red(), amber.green(), amber.blue()], np.float32)
    return np.asarray(picture + (tone - picture) * np.float32(_TINT) + 0.5).astype(np.uint8)


def _fitting(alpha: NDArray[np.float32]) -> float:
    """Return the zoom at which the lamp fills much of the picture."""
    rows = np.flatnonzero((alpha > 0.5).any(axis=1))
    tall = (rows[-1] - rows[0] + 1) * 180.0 / alpha.shape[0] if rows.size else 180.0
    return max((zoom for zoom in _ZOOMS if tall * zoom <= 100.0), default=1.0)


def _draw(
    picture: NDArray[np.uint8], tinted: NDArray[np.uint8], alpha: NDArray[np.float32]
) -> NDArray[np.uint8]:
    """Return the picture with the lamp tinted, and outlined in white with a black edge."""
    inside = (alpha > 0.5).astype(np.uint8)
    around = np.ones((3, 3), np.uint8)
    outer = cv2.dilate(inside, around) - inside
    inner = inside - cv2.erode(inside, around, borderValue=1)
    # This is ten times faster than indexing with a mask.
    result = cv2.copyTo(tinted, inside, picture.copy())
    result = cv2.copyTo(np.zeros_like(result), outer, result)
    return np.asarray(cv2.copyTo(np.full_like(result, _WHITE), inner, result))
