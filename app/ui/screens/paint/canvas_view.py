"""The canvas, which shows the head with its weights and handles mouse, pen and keyboard."""

from __future__ import annotations

import time
from typing import Final

from PySide6.QtCore import QEvent, QPointF, Qt, QTimer, Signal, SignalInstance
from PySide6.QtGui import (
    QAccessible,
    QEnterEvent,
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QPointingDevice,
    QResizeEvent,
    QTabletEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy

from app.core.painting.canvas import Canvas, Region
from app.core.painting.stroke import Brush
from app.core.text import tr
from app.ui.plots.parts.base import Plot
from app.ui.screens.paint.canvas import CanvasMode, CanvasState, Point
from app.ui.screens.paint.face_view import FaceItems
from app.ui.screens.paint.head_pixels import head_words
from app.ui.screens.paint.tools import TOOLS
from app.ui.screens.paint.zoom_view import Viewing, ZoomBox, fitting
from app.ui.theme import px
from app.ui.widgets.accessibility import describe, give_role

_FRAME_MS: Final = 8  # faster moves are combined
_STEP: Final = 1.2  # zoom factor per step
_NOTCH: Final = 120.0
_MARGIN: Final = 12
_ARROWS: Final = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
}
_DABS: Final = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space})
_FIRST: Final = (0.42, 0.62)  # initial position of the keyboard's brush: a cheek


class PaintCanvas(Plot):
    """The head, its weights and the brush.

    The mouse and the pen paint. The wheel zooms. Dragging with the middle button, or with Space
    held, pans. The arrow keys move the brush by one pixel, or by ten with Shift. Enter or Space
    paints a dab. The keys +, − and 0 zoom.

    Attributes:
        pressed: Signal(object, bool). Start of a stroke, with a `Point` and whether the eraser is
            in use.
        drawn, lifted: Signal(object). Continuation and end of a stroke, each with a list of
            `Point`s.
        dabbed: Signal(float, float). A single dab, with its position in canvas pixels.
        head_turned: Signal(int). Number of views by which to turn the head to its left, or 0 for
            the front.
    """

    pressed = Signal(object, bool)
    drawn = Signal(object)
    lifted = Signal(object)
    dabbed = Signal(float, float)
    head_turned = Signal(int)

    def __init__(self) -> None:
        super().__init__(tr("Canvas"))
        give_role(self, QAccessible.Role.Canvas)
        self._name_it(0.0)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(px(160), px(160))
        self.setCursor(Qt.CursorShape.BlankCursor)
        self._face = FaceItems(self.panel)
        self.viewing = Viewing()
        self._fits = True
        self._brush = Brush()
        self._ring: QPointF | None = None
        self._by_keys = False
        self._stroking = False
        self._panning: QPointF | None = None
        self._space = False
        self._points: list[Point] = []
        self._last = QPointF()
        self._drawn_at = 0.0
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.setTimerType(Qt.TimerType.PreciseTimer)
        self._later.timeout.connect(self.flush)
        self._zoom = ZoomBox(self)
        self._zoom.stepped.connect(self._zoom_step)
        self._zoom.fitted.connect(self.fit)
        self._zoom.turned.connect(self.head_turned)

    def _name_it(self, yaw_deg: float) -> None:
        name = tr("Canvas")
        describe(self, f"{name}, {head_words(yaw_deg)}", tip="")

    # -- what the screen calls -----------------------------------------------------------------

    def show_state(self, state: CanvasState) -> None:
        """Show the head, the chosen contents and the brush."""
        if self._face.set_head(state.head):
            yaw = 0.0 if state.head is None else state.head.yaw_deg
            self._zoom.set_yaw(yaw)
            self._name_it(yaw)
            self.fit()
        if self._face.set_picture(state.picture):
            self._face.repaint()
        if self._face.set_words(state.notice, state.mode is CanvasMode.WEIGHTS):
            self._face.repaint()
        if state.brush != self._brush:
            self._brush = state.brush
            self._show_ring()
            self._describe()

    def canvas_changed(self, canvas: Canvas, regions: tuple[Region, ...] | None) -> None:
        """Repaint the given regions, or everything if `regions` is None."""
        if regions is None or self._face.size != canvas.size:
            fresh = self._face.size != canvas.size
            self._face.set_canvas(canvas)
            if fresh and self._fits:
                self.fit()
            self._face.repaint()
            return
        for region in regions:
            self._face.show_region(canvas, region)

    def fit(self) -> None:
        """Fit the head to the canvas."""
        self._fits = True
        size = self._face.size or 1
        self._look(fitting(self.width(), self.height(), size))
        self._fits = True

    def at(self, x: float, y: float) -> QPointF:
        """Return the point of the widget over a canvas pixel."""
        return QPointF(*self.viewing.to_widget(x, y))

    # -- zoom and pan --------------------------------------------------------------------------

    def _look(self, view: Viewing) -> None:
        self.viewing = view.within(self.width(), self.height(), self._face.size or 1)
        self._fits = False
        self._zoom.set_zoom(self.viewing.zoom)
        self._face.look(self.viewing)
        self._face.repaint()
        self._show_ring()

    def _zoom_step(self, way: int) -> None:
        middle = (self.width() / 2, self.height() / 2)
        self._look(self.viewing.zoomed(self.viewing.zoom * _STEP**way, *middle))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the head again, or keep the centre of the view in place."""
        super().resizeEvent(event)
        margin = px(_MARGIN)
        self._zoom.move(self.width() - self._zoom.width() - margin, margin)
        if self._fits:
            self.fit()
        else:
            self._look(self.viewing)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom around the pointer."""
        notches = (event.angleDelta().y() or event.angleDelta().x()) / _NOTCH
        here = event.position()
        self._look(self.viewing.zoomed(self.viewing.zoom * _STEP**notches, here.x(), here.y()))
        self._move_ring(here)
        event.accept()

    # -- mouse and pen -------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a stroke, or start panning."""
        left = event.button() == Qt.MouseButton.LeftButton
        if event.button() == Qt.MouseButton.MiddleButton or (left and self._space):
            self._panning = event.position()
            self._show_ring()
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        elif left and not self._stroking:
            self._down(event.position(), 1.0, eraser=False)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Extend the stroke, pan or move the ring."""
        here = event.position()
        if self._panning is not None:
            step = here - self._panning
            self._panning = here
            self._space = False  # Space is used for panning now, so its release paints no dab.
            self._look(self.viewing.moved(step.x(), step.y()))
        elif self._stroking:
            self._on(here, 1.0)
            return
        self._move_ring(here)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the stroke or the pan."""
        if self._panning is not None:
            self._panning = None
            self._show_ring()
            self.setCursor(Qt.CursorShape.BlankCursor)
        elif event.button() == Qt.MouseButton.LeftButton:
            self._up()

    def tabletEvent(self, event: QTabletEvent) -> None:
        """Paint with a pen and its pressure, or restore with its eraser."""
        kind, here = event.type(), event.position()
        if kind == QEvent.Type.TabletPress and event.button() == Qt.MouseButton.LeftButton:
            eraser = event.pointerType() == QPointingDevice.PointerType.Eraser
            self._down(here, event.pressure(), eraser=eraser)
        elif kind == QEvent.Type.TabletMove and self._stroking:
            self._on(here, event.pressure())
        elif kind == QEvent.Type.TabletMove:
            self._move_ring(here)
        elif kind == QEvent.Type.TabletRelease:
            self._up()
        else:
            event.ignore()
            return
        event.accept()

    def _down(self, here: QPointF, pressure: float, *, eraser: bool) -> None:
        spot = self._spot(here)
        if spot is None:
            return
        self._stroking = True
        self._by_keys = False
        self.pressed.emit((*spot, pressure), eraser)
        self._drawn_at = time.perf_counter()
        self._move_ring(here)
        self._on(here, pressure)

    def _on(self, here: QPointF, pressure: float) -> None:
        spot, self._last = self._spot(here), here
        if spot is not None:
            self._points.append((*spot, pressure))
        if not self._later.isActive():
            passed = 1000 * (time.perf_counter() - self._drawn_at)
            self._later.start(max(round(_FRAME_MS - passed), 0))

    def _up(self) -> None:
        if self._stroking:
            self._stroking = False
            self._emit_points(self.lifted)

    def flush(self) -> None:
        """Emit the moves collected since the last frame."""
        if self._points:
            self._emit_points(self.drawn)
            self._drawn_at = time.perf_counter()

    def _emit_points(self, signal: SignalInstance) -> None:
        self._later.stop()
        points, self._points = self._points, []
        signal.emit(points)
        if points:
            # Move the ring together with the stroke, so that the canvas is painted only once.
            self._move_ring(self._last)

    def _spot(self, here: QPointF) -> tuple[float, float] | None:
        """Return the canvas pixel under a point, or None if its skin is hidden from the front."""
        return self._face.on_front(*self.viewing.to_canvas(here.x(), here.y()))

    def leaveEvent(self, event: QEvent) -> None:
        """Hide the ring, unless the keyboard controls it."""
        if not self._stroking:
            self._move_ring(self._kept_ring() if self.hasFocus() and self._by_keys else None)
        super().leaveEvent(event)

    def enterEvent(self, event: QEnterEvent) -> None:
        """Show the ring."""
        self._move_ring(event.position())
        super().enterEvent(event)

    # -- keyboard ------------------------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Claim Enter, Space and the arrow keys before the window treats them as shortcuts."""
        if event.type() == QEvent.Type.ShortcutOverride:
            key = Qt.Key(event.key())  # type: ignore[attr-defined]
            plain = event.modifiers() == Qt.KeyboardModifier.NoModifier  # type: ignore[attr-defined]
            if plain and (key in _DABS or key in _ARROWS):
                event.accept()
                return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the brush, paint a dab or zoom."""
        key = Qt.Key(event.key())
        zooms = {Qt.Key.Key_Plus: 1, Qt.Key.Key_Equal: 1, Qt.Key.Key_Minus: -1}
        if key in _ARROWS:
            far = 10 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1
            self._step_ring(_ARROWS[key][0] * far, _ARROWS[key][1] * far)
        elif key == Qt.Key.Key_Space:
            # A dab is painted on release, because Space may still start a pan.
            self._space = True
        elif key in _DABS and not event.isAutoRepeat():
            self._dab()
        elif key in zooms:
            self._zoom_step(zooms[key])
        elif key == Qt.Key.Key_0:
            self.fit()
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Paint a dab, unless Space was used for panning."""
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            if self._space and self._panning is None:
                self._dab()
            self._space = False
            return
        super().keyReleaseEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show the brush that the keyboard controls."""
        super().focusInEvent(event)
        if self._ring is None and not self.underMouse():
            self._by_keys = True
            self._move_ring(self._kept_ring())

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Hide the brush that the keyboard controls."""
        super().focusOutEvent(event)
        self._space = False
        if not self.underMouse():
            self._move_ring(None)

    def _dab(self) -> None:
        if not self._stroking:
            here = self._kept_ring()
            self._by_keys = True
            self._move_ring(here)
            spot = self._spot(here)
            if spot is not None:
                self.dabbed.emit(*spot)

    def _kept_ring(self) -> QPointF:
        if self._ring is not None:
            return self._ring
        size = self._face.size
        return self.at(_FIRST[0] * size, _FIRST[1] * size)

    def _step_ring(self, dx: int, dy: int) -> None:
        self._by_keys = True
        here = self._kept_ring()
        x, y = self.viewing.to_canvas(here.x(), here.y())
        top = float(self._face.size)
        x, y = min(max(round(x) + dx, 0.0), top), min(max(round(y) + dy, 0.0), top)
        there = self.at(x, y)
        # Scroll to keep the brush visible.
        out_x = min(there.x(), 0.0) + max(there.x() - self.width(), 0.0)
        out_y = min(there.y(), 0.0) + max(there.y() - self.height(), 0.0)
        if out_x or out_y:
            self._look(self.viewing.moved(-out_x, -out_y))
        self._move_ring(self.at(x, y))

    # -- the ring ------------------------------------------------------------------------------

    def _move_ring(self, there: QPointF | None) -> None:
        self._ring = there
        self._show_ring()
        if self._by_keys:
            self._describe()

    def _describe(self) -> None:
        tool, wide = TOOLS[self._brush.tool], self._brush.diameter
        if self._ring is None or not self._face.size:
            self.say(tr("Brush: {tool}, {diameter:.0f} px", tool=tool, diameter=wide))
            return
        x, y = self.viewing.to_canvas(self._ring.x(), self._ring.y())
        across, down = (round(100 * value / self._face.size) for value in (x, y))
        self.say(
            tr(
                "Brush: {tool}, {diameter:.0f} px, {across}% from the left and {down}% from "
                "the top",
                tool=tool,
                diameter=wide,
                across=across,
                down=down,
            )
        )

    def _show_ring(self) -> None:
        """Show the brush, but not while panning."""
        here = None
        if self._ring is not None and self._face.size and self._panning is None:
            here = self.viewing.to_canvas(self._ring.x(), self._ring.y())
        self._face.show_ring(here, self._brush)
