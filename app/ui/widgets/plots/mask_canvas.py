"""A captured panorama on which is painted where the lamp is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

import cv2
import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import wrap
from app.ui.theme import theme
from app.ui.widgets.plots.base import Plot

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent
    from PySide6.QtWidgets import QWidget

    from app.ui.widgets.plots.geometry import Point

_ZOOMS: Final = (1.0, 2.0, 4.0, 8.0)
_NOTCH: Final = 120
_TINT: Final = 0.35
_WHITE: Final = 245
_STEPS: Final = {
    Qt.Key.Key_Left: (-1.0, 0.0),
    Qt.Key.Key_Right: (1.0, 0.0),
    Qt.Key.Key_Up: (0.0, 1.0),
    Qt.Key.Key_Down: (0.0, -1.0),
}
_COARSE: Final = 10.0
_DABS: Final = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space})


class Drawn(Protocol):
    """What is painted on, and with which brush; see `app.ui.screens.light.mask.MaskState`."""

    @property
    def picture(self) -> NDArray[np.uint8]:
        """(H, 2 H, 3) sRGB."""

    @property
    def alpha(self) -> NDArray[np.float32]:
        """(H, 2 H) the mask, 0 to 1."""

    @property
    def centre(self) -> tuple[float, float]:
        """Azimuth and elevation where looking begins, deg."""

    @property
    def lit(self) -> bool:
        """Whether the brush adds."""

    @property
    def radius_deg(self) -> float:
        """Of the brush."""


class MaskCanvas(Plot):
    """The panorama with the mask over it, and the brush.

    The mouse paints, the wheel zooms about the pointer, the right button moves the picture. Arrows
    move the brush by 1°, with Shift by 10°; Enter or Space paints a dab; + and − zoom.
    """

    pressed = Signal(float, float)
    """A stroke begins: azimuth and elevation, deg."""

    drawn = Signal(float, float)
    """It goes on."""

    lifted = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Where the lamp is", parent)
        self._state: Drawn | None = None
        self._shown = QImage()
        self._lamp_picture = np.zeros((0, 0, 3), np.uint8)
        self._kept: tuple[object, object] = (None, None)
        self._zoom = 1.0
        self._middle: Point = (0.0, 0.0)  # azimuth and elevation in the middle of the widget
        self._brush: Point | None = None
        self._stroking = False
        self._moving: QPointF | None = None
        self.setMouseTracking(True)
        # Nothing that lies beneath is painted for it.
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setToolTip("Paint with the mouse. Wheel zooms, the right button moves the picture")

    def sizeHint(self) -> QSize:
        """Twice as wide as high."""
        t = theme()
        return QSize(t.px(720), t.px(360))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        t = theme()
        return QSize(t.px(320), t.px(160))

    def show_state(self, state: Drawn) -> None:
        """Show another mask or brush."""
        first = self._state is None
        self._state = state
        if self._kept[0] is not state.picture:
            self._lamp_picture = _tinted(state.picture)
        if self._kept[0] is not state.picture or self._kept[1] is not state.alpha:
            self._shown = _drawn(state.picture, self._lamp_picture, state.alpha)
            self._kept = (state.picture, state.alpha)
        if first:
            self._brush = state.centre
            self._look(state.centre, self._fitting(state.alpha))
        how = "adds to the lamp" if state.lit else "takes away"
        self.say(f"The brush, {state.radius_deg:.1f}° around, {how}")
        self.update()

    # -- looking -------------------------------------------------------------------------------

    def place_of(self, azimuth_deg: float, elevation_deg: float) -> Point:
        """Where a direction lies, logical pixels."""
        unit = self._unit
        return (
            self.width() / 2.0 + wrap(azimuth_deg - self._middle[0]) * unit,
            self.height() / 2.0 - (elevation_deg - self._middle[1]) * unit,
        )

    def spot_at(self, point: Point) -> Point:
        """Read a direction, deg."""
        unit = self._unit
        across = (point[0] - self.width() / 2.0) / unit
        up = (self.height() / 2.0 - point[1]) / unit
        height = min(max(self._middle[1] + up, -90.0), 90.0)
        return wrap(self._middle[0] + across), height

    def zoom(self, steps: int) -> None:
        """Look more or less closely at the brush."""
        self._zoom_to(steps, None)

    @property
    def _unit(self) -> float:
        """Logical pixels per degree."""
        return self._zoom * max(self.width(), 1) / 360.0

    def _fitting(self, alpha: NDArray[np.float32]) -> float:
        """Zoom at which the lamp fills a good part of the picture."""
        rows = np.flatnonzero((alpha > 0.5).any(axis=1))
        tall = (rows[-1] - rows[0] + 1) * 180.0 / alpha.shape[0] if rows.size else 180.0
        return max((zoom for zoom in _ZOOMS if tall * zoom <= 100.0), default=1.0)

    def _look(self, middle: Point, zoom: float) -> None:
        self._zoom = zoom
        # The picture fills the height: there is nothing above the zenith.
        room = max(90.0 - self.height() / 2.0 / self._unit, 0.0)
        self._middle = (wrap(middle[0]), min(max(middle[1], -room), room))
        self.update()

    def _zoom_to(self, steps: int, about: Point | None) -> None:
        here = _ZOOMS.index(self._zoom) + steps
        if not 0 <= here < len(_ZOOMS):
            return
        if about is None:
            self._look(self._brush or self._middle, _ZOOMS[here])
            return
        spot = self.spot_at(about)
        self._look(self._middle, _ZOOMS[here])
        now = self.spot_at(about)
        across, up = wrap(spot[0] - now[0]), spot[1] - now[1]
        self._look((self._middle[0] + across, self._middle[1] + up), self._zoom)

    # -- hands ---------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a stroke, or take hold of the picture."""
        if event.button() == Qt.MouseButton.LeftButton and self._state is not None:
            self._stroking = True
            self._brush = self.spot_at((event.position().x(), event.position().y()))
            self.pressed.emit(*self._brush)
        elif event.button() in (Qt.MouseButton.RightButton, Qt.MouseButton.MiddleButton):
            self._moving = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Draw on, move the picture, or lead the ring."""
        here = event.position()
        if self._moving is not None:
            by = (here - self._moving) / self._unit
            self._moving = here
            self._look((self._middle[0] - by.x(), self._middle[1] + by.y()), self._zoom)
            return
        self._brush = self.spot_at((here.x(), here.y()))
        if self._stroking:
            self.drawn.emit(*self._brush)
        self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the stroke."""
        if event.button() == Qt.MouseButton.LeftButton and self._stroking:
            self._stroking = False
            self.lifted.emit()
        elif self._moving is not None:
            self._moving = None

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer."""
        notches = event.angleDelta().y() / _NOTCH
        if notches:
            here = event.position()
            self._zoom_to(1 if notches > 0 else -1, (here.x(), here.y()))
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the brush, paint a dab, or zoom."""
        key = Qt.Key(event.key())
        if self._brush is not None and key in _STEPS:
            coarse = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
            size = _COARSE if coarse else 1.0
            across, up = _STEPS[key]
            height = min(max(self._brush[1] + up * size, -90.0), 90.0)
            self._brush = (wrap(self._brush[0] + across * size), height)
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
        """Keep the brush in sight."""
        assert self._brush is not None
        x, y = self.place_of(*self._brush)
        if not self.rect().contains(QPointF(x, y).toPoint()):
            self._look(self._brush, self._zoom)
        self.update()

    # -- painting ------------------------------------------------------------------------------

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint panorama, mask and brush."""
        del ratio
        painter.fillRect(self.rect(), theme().c.well)
        if self._state is None:
            return
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        wide, tall = 360.0 * self._unit, 180.0 * self._unit
        # One column more at both ends, so that no seam is seen where two copies meet.
        over = wide / max(self._shown.width() - 2, 1)
        left, top = self.place_of(self._middle[0], 90.0)
        left -= wide / 2.0 + self._middle[0] * self._unit
        for turn in (-1, 0, 1):
            area = QRectF(left + turn * wide - over, top, wide + 2.0 * over, tall)
            if area.intersects(self.rect().toRectF()):
                painter.drawImage(area, self._shown)
        if self._brush is not None:
            self._draw_brush(painter)

    def _draw_brush(self, painter: QPainter) -> None:
        assert self._state is not None
        assert self._brush is not None
        t = theme()
        x, y = self.place_of(*self._brush)
        up = self._state.radius_deg * self._unit
        # The panorama widens what is high or low.
        level = max(float(np.cos(np.radians(self._brush[1]))), 0.05)
        across = min(up / level, self.width() / 1.0)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for colour, width in ((QColor(Qt.GlobalColor.black), 4.0), (t.c.ontag, 2.0)):
            painter.setPen(QPen(colour, width))
            painter.drawEllipse(QPointF(x, y), across, up)
        arm = float(t.px(5))
        for colour, width in ((QColor(Qt.GlobalColor.black), 4.0), (t.c.ontag, 2.0)):
            painter.setPen(QPen(colour, width))
            painter.drawLine(QPointF(x - arm, y), QPointF(x + arm, y))
            if self._state.lit:
                painter.drawLine(QPointF(x, y - arm), QPointF(x, y + arm))


def _tinted(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Picture as it looks where the lamp is."""
    amber = theme().c.amberfill
    tone = np.array([amber.red(), amber.green(), amber.blue()], np.float32)
    return np.asarray(picture + (tone - picture) * np.float32(_TINT) + 0.5).astype(np.uint8)


def _drawn(
    picture: NDArray[np.uint8], tinted: NDArray[np.uint8], alpha: NDArray[np.float32]
) -> QImage:
    """Picture with the lamp tinted, and its outline in white on black."""
    inside = (alpha > 0.5).astype(np.uint8)
    around = np.ones((3, 3), np.uint8)
    outer = cv2.dilate(inside, around) - inside
    inner = inside - cv2.erode(inside, around, borderValue=1)
    height, width = inside.shape
    # One column more at both ends.
    shown = np.empty((height, width + 2, 3), np.uint8)
    middle = shown[:, 1:-1]
    np.copyto(middle, picture)
    np.copyto(middle, tinted, where=inside.astype(bool)[..., None])
    middle[outer > 0] = 0
    middle[inner > 0] = _WHITE
    shown[:, 0], shown[:, -1] = shown[:, -2], shown[:, 1]
    return QImage(
        shown.data, width + 2, height, 3 * (width + 2), QImage.Format.Format_RGB888
    ).convertToFormat(QImage.Format.Format_RGB32)
