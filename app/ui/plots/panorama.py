"""The panorama of a place, with zoom, pan, overlays and a marker for the photographer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, QSize, Qt, QVariantAnimation, Signal
from PySide6.QtGui import (
    QKeyEvent,
    QMouseEvent,
    QNativeGestureEvent,
    QPainter,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import difference, whole, wrap
from app.core.base.arrays import Bytes
from app.core.text import tr
from app.ui.plots.parts.base import Plot, arrow_step
from app.ui.plots.parts.mapping import Viewport
from app.ui.plots.parts.panorama_scale import (
    MarkerGrip,
    Marks,
    SceneLamp,
    draw_corners,
    draw_scale,
)
from app.ui.theme import px, theme
from app.words.phrases.turns import turn_words

if TYPE_CHECKING:
    from app.ui.plots.panorama_items import PanoramaDrawing

__all__ = ["PanoramaView", "SceneLamp"]


_SCALE: Final = 28
_ZOOM_STEP: Final = 1.25
_NOTCH: Final = 120.0
_GLIDE_MS: Final = 240
_NEAR: Final = 6.0  # distance at which the pointer hits the marker's line
_STANDING: Final = tr("Photographer stands here")


class PanoramaView(Plot):
    """A panorama that can be zoomed and panned, with a marker for the photographer's position.

    All azimuths in this class are relative to the panorama, but the scale below it is numbered from
    the photographer's azimuth. The arrow keys pan by 1°, or by 10° with Shift. Plus and minus zoom,
    0 shows everything, Home centres the photographer, and M focuses the marker.
    """

    marker_moved = Signal(float)
    """Emitted with the marker's azimuth in (-180, 180] degrees, repeatedly while it is dragged."""

    marker_released = Signal(float)
    """Emitted with the marker's azimuth in degrees when the marker is released.

    The marker stays there until `set_front` is called.
    """

    zoom_changed = Signal(float)
    """Emitted with the new zoom, from 1 to 8."""

    def __init__(self, name: str = tr("Panorama of this place")) -> None:
        super().__init__(name)
        self._picture: Bytes | None = None
        self._clipped: NDArray[Any] | None = None
        self._drawing: PanoramaDrawing | None = None
        self.view = Viewport(864.0)
        self._front = self.marker_deg = 0.0  # azimuths in (-180, 180] degrees
        self._lamps: tuple[SceneLamp, ...] = ()
        self._visible = {"clipped": True, "lamps": True, "grid": False, "marker": True}
        self._drag: QPointF | None = None
        self._leading = False
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)
        self.setMouseTracking(True)
        self.setCursor(Qt.CursorShape.OpenHandCursor)
        self._glide = QVariantAnimation(self)
        self._glide.setDuration(_GLIDE_MS)
        self._glide.valueChanged.connect(self._glided)
        self.grip = MarkerGrip(_STANDING, self)
        self.grip.hide()
        self.grip.dragged.connect(lambda point: self._lead(float(point.x())))
        self.grip.dropped.connect(self._release)
        self.grip.left.connect(self._release)
        self.grip.stepped.connect(self._step)
        self.grip.home.connect(lambda: self._move_marker(self._front))
        self._describe()

    # Contents

    def set_picture(self, picture: Bytes | None) -> None:
        """Show a different picture, keeping the view.

        Args:
            picture: Panorama, (h, w, 3) uint8 sRGB at 2:1, up to 4096 x 2048, or None to show an
                empty well.
        """
        if picture is self._picture:
            return
        self._picture = picture
        if picture is not None:
            self.make_ready()
        if self._drawing is not None:
            self._drawing.set_pixels(picture)
        self._changed()

    def make_ready(self) -> None:
        """Create the panel in advance, because creating it takes as long as showing the picture."""
        if self._drawing is None:
            # Importing pyqtgraph takes a quarter of a second.
            from app.ui.plots.panorama_items import PanoramaDrawing

            self._drawing = PanoramaDrawing(self.panel)
            self._drawing.set_clipped(self._clipped)
            self._drawing.set_pixels(self._picture)
            self._changed()

    def set_clipped(self, clipped: NDArray[Any] | None) -> None:
        """Set the clipped areas, which are hatched.

        Args:
            clipped: (H, W) array of any size. It is either bool, True for each clipped texel, or
                float, giving the clipped fraction of each texel from 0 to 1. If it is None, nothing
                is hatched.
        """
        if clipped is not self._clipped:
            self._clipped = clipped
            if self._drawing is not None:
                self._drawing.set_clipped(clipped)
            self._changed()

    def set_lamps(self, lamps: Sequence[SceneLamp]) -> None:
        """Set the labelled lamps."""
        self._lamps = tuple(lamps)
        self._changed()

    def set_shown(self, **parts: bool) -> None:
        """Show or hide ``clipped``, ``lamps``, ``grid`` or ``marker`` over the picture."""
        self._visible |= parts
        self._changed()

    def set_front(self, azimuth_deg: float, *, glide: bool = False) -> None:
        """Set the photographer's azimuth and centre the view there, optionally with animation."""
        self._front = self.marker_deg = wrap(azimuth_deg)
        self.grip.set_moving("")
        self._glide.stop()
        way = difference(self._front, self.view.azimuth_deg)
        if glide and abs(way) > 0.5 and self.isVisible():
            self._glide.setStartValue(self._front - way)
            self._glide.setEndValue(self._front)
            self._glide.start()
        else:
            self._look(self.view.moved_to(self._front, self.view.elevation_deg))
        self._changed()

    def set_marker_words(self, words: str) -> None:
        """Set the text of the marker."""
        self.grip.set_words(words)
        self._changed()

    def set_zoom(self, zoom: float) -> None:
        """Zoom around the centre of the view, clamping the zoom to the range from 1 to 8."""
        view = self.view
        self._look(view.zoomed(zoom, view.width / 2.0, view.height / 2.0))

    def zoom_by(self, steps: float) -> None:
        """Zoom in by the given number of 25% steps, or out if the number is negative."""
        self.set_zoom(self.view.zoom * _ZOOM_STEP**steps)

    def fit(self) -> None:
        """Show the whole panorama with the photographer in the centre."""
        self._look(Viewport(self.view.width).moved_to(self._front, 0.0))

    # Geometry

    @property
    def picture_rect(self) -> QRect:
        """Area of the 2:1 picture in the widget, in logical pixels."""
        room = max(self.height() - px(_SCALE), 2)
        width = max(min(self.width(), 2 * room) // 2 * 2, 2)
        return QRect((self.width() - width) // 2, 0, width, width // 2)

    def sizeHint(self) -> QSize:
        """Return the design size."""
        return QSize(864, self.heightForWidth(864))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size."""
        return QSize(360, self.heightForWidth(360))

    def heightForWidth(self, width: int) -> int:
        """Return the height needed for a 2:1 picture and its scale."""
        return width // 2 + px(_SCALE)

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle and the corner radius of the focus ring."""
        return self.picture_rect, px(6)

    # Movement

    def _look(self, view: Viewport) -> None:
        before, self.view = self.view, view
        if view.zoom != before.zoom:
            self.zoom_changed.emit(view.zoom)
        if view != before:
            self._changed()

    def _glided(self, azimuth_deg: float) -> None:
        self._look(self.view.moved_to(azimuth_deg, self.view.elevation_deg))

    def _changed(self) -> None:
        if self._drawing is not None:
            self._drawing.show_marks(self.view, self._marks())
        self._place_grip()
        self._describe()
        self.update()

    def _place_grip(self) -> None:
        """Place the grip on the marker's line, inside the picture."""
        area = self.picture_rect
        places = self.view.xs_of(self.marker_deg)
        visible = self._picture is not None and self._visible["marker"]
        visible = visible and bool(places)
        if visible:
            edge = px(8)
            width = self.grip.width()
            x = area.left() + places[0] - width / 2.0
            x = min(max(x, area.left() + edge), area.right() + 1 - edge - width)
            y = area.bottom() + 1 - px(16) - self.grip.height()
            self.grip.move(round(x), y)
        if not visible and self.grip.hasFocus():
            self.setFocus(Qt.FocusReason.OtherFocusReason)
        self.grip.setVisible(visible)

    def _lead(self, x: float) -> None:
        self._move_marker(self.view.azimuth_at(x - self.picture_rect.left()))

    def _step(self, degrees: float) -> None:
        self._move_marker(round(difference(self.marker_deg, self._front)) + degrees + self._front)
        if not self.view.xs_of(self.marker_deg):
            self._look(self.view.moved_to(self.marker_deg, self.view.elevation_deg))

    def _move_marker(self, azimuth_deg: float) -> None:
        self._glide.stop()
        self.marker_deg = wrap(azimuth_deg)
        shift = difference(self.marker_deg, self._front)
        self.grip.set_moving(turn_words(shift) if shift else "")
        self._changed()
        self.marker_moved.emit(self.marker_deg)

    def _release(self) -> None:
        """Emit the marker's azimuth if the marker has moved and is not being dragged."""
        if self.marker_deg != self._front and not self.grip.held and not self._leading:
            self.marker_released.emit(self.marker_deg)

    def take_marker(self) -> None:
        """Focus the marker, scrolling to it if it is out of view."""
        if not self.view.xs_of(self.marker_deg):
            self._look(self.view.moved_to(self.marker_deg, self.view.elevation_deg))
        self._place_grip()
        self.grip.setFocus(Qt.FocusReason.ShortcutFocusReason)

    # Events

    def panel_rect(self) -> QRect:
        """Return the area of the picture."""
        return self.picture_rect

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the scale, and an empty well if there is no picture."""
        if self._picture is None:
            painter.save()
            painter.translate(self.picture_rect.topLeft())
            painter.fillRect(QRect(QPoint(), self.picture_rect.size()), theme().c.well)
            self.draw_over(painter, ratio)
            painter.restore()
        draw_scale(painter, ratio, self.picture_rect, self.view, self._marks())

    def draw_over(self, painter: QPainter, _ratio: float) -> None:
        """Round the corners of the picture."""
        draw_corners(painter, QRect(QPoint(), self.picture_rect.size()), theme().c.bg)

    def _marks(self) -> Marks:
        here = self._picture is not None
        return Marks(
            self._front,
            self.marker_deg if here and self._visible["marker"] else None,
            self._lamps if here and self._visible["lamps"] else (),
            grid=here and self._visible["grid"],
            clipped=self._visible["clipped"],
        )

    def _describe(self) -> None:
        if self._picture is None:
            self.say(tr("No panorama yet"))
            return
        ahead = difference(self.view.azimuth_deg, self._front)
        words = [tr("Zoom {zoom:.0f}%", zoom=self.view.zoom * 100)]
        words.append(tr("In the middle: {turn}", turn=_turn(ahead)))
        if shift := difference(self.marker_deg, self._front):
            marker = self.grip.accessibleName()
            words.append(tr("{marker}, moved {turn}", marker=marker, turn=_turn(shift)))
        for lamp in self._lamps:
            way = _turn(difference(lamp.azimuth_deg, self._front))
            values = {"letter": lamp.letter, "way": way, "degrees": round(abs(lamp.elevation_deg))}
            if lamp.elevation_deg >= 0:
                words.append(tr("Lamp {letter}: {way}, {degrees}° up", **values))
            else:
                words.append(tr("Lamp {letter}: {way}, {degrees}° down", **values))
        self.say(". ".join(words) + ".")

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the same view at the new width."""
        super().resizeEvent(event)
        view = self.view
        new = Viewport(float(self.picture_rect.width()), view.zoom)
        self.view = new.moved_to(view.azimuth_deg, view.elevation_deg)
        self._changed()

    def _near_marker(self, x: float) -> bool:
        if self._picture is None or not self._visible["marker"]:
            return False
        left = self.picture_rect.left()
        return any(abs(x - left - place) <= _NEAR for place in self.view.xs_of(self.marker_deg))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start panning, or grab the marker by its line."""
        inside = self.picture_rect.contains(event.position().toPoint())
        if event.button() != Qt.MouseButton.LeftButton or not inside or self._picture is None:
            super().mousePressEvent(event)
            return
        self._glide.stop()
        self._leading = self._near_marker(event.position().x())
        self._drag = event.position()
        if not self._leading:
            self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the picture or the marker."""
        place = event.position()
        if self._drag is None:
            shapes = Qt.CursorShape
            near = self._near_marker(place.x())
            self.setCursor(shapes.SizeHorCursor if near else shapes.OpenHandCursor)
        elif self._leading:
            self._lead(place.x())
        else:
            way = place - self._drag
            self._drag = place
            self._look(self.view.panned(way.x(), way.y()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the picture or the marker."""
        if event.button() == Qt.MouseButton.LeftButton and self._drag is not None:
            self._drag, self._leading = None, False
            self.setCursor(Qt.CursorShape.OpenHandCursor)
            self._release()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom around the pointer."""
        notches = event.angleDelta().y() / _NOTCH
        if notches and self._picture is not None:
            self._zoom_at(_ZOOM_STEP**notches, event.position())
            event.accept()
        else:
            super().wheelEvent(event)

    def _zoom_at(self, factor: float, place: QPointF) -> None:
        area = self.picture_rect
        x, y = place.x() - area.left(), place.y() - area.top()
        self._look(self.view.zoomed(self.view.zoom * factor, x, y))

    def event(self, event: QEvent) -> bool:
        """Zoom when two fingers pinch on a touchpad, and handle other events as usual."""
        if isinstance(event, QNativeGestureEvent) and (
            event.gestureType() == Qt.NativeGestureType.ZoomNativeGesture
        ):
            self._zoom_at(1.0 + event.value(), event.position())
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Pan, zoom, or focus the marker."""
        key = Qt.Key(event.key())
        deeds = {
            Qt.Key.Key_Plus: lambda: self.zoom_by(1.0),
            Qt.Key.Key_Equal: lambda: self.zoom_by(1.0),
            Qt.Key.Key_Minus: lambda: self.zoom_by(-1.0),
            Qt.Key.Key_0: self.fit,
            Qt.Key.Key_Home: lambda: self._look(self.view.moved_to(self._front, 0.0)),
            Qt.Key.Key_M: self.take_marker,
        }
        if self._picture is not None and (step := arrow_step(event)):
            view = self.view
            self._look(view.moved_to(view.azimuth_deg + step[0], view.elevation_deg + step[1]))
        elif self._picture is not None and key in deeds:
            deeds[key]()
        else:
            super().keyPressEvent(event)


def _turn(off_deg: float) -> str:
    return turn_words(off_deg) if whole(off_deg) else "0°"
