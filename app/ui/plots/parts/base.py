"""The base classes of plots, which handle keyboard input, cached pictures and descriptions."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, ClassVar, Final

from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QAccessible,
    QColor,
    QFont,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
    QPixmap,
    QPolygonF,
    QResizeEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.base.angles import wrap
from app.core.base.visible_text import visible
from app.ui.plots.parts.geometry import Point, smooth
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import give_role
from app.ui.widgets.paint import Paints, box, draw_tag, tag_size

if TYPE_CHECKING:
    from app.ui.plots.panel import Panel

_ARROWS: Final = {
    Qt.Key.Key_Left: (-1.0, 0.0),
    Qt.Key.Key_Right: (1.0, 0.0),
    Qt.Key.Key_Up: (0.0, 1.0),
    Qt.Key.Key_Down: (0.0, -1.0),
}


def arrow_step(event: QKeyEvent) -> tuple[float, float] | None:
    """Return an arrow key's step as (right, up) in degrees, or None for any other key."""
    way = _ARROWS.get(Qt.Key(event.key()))
    size = 10.0 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1.0
    return None if way is None else (way[0] * size, way[1] * size)


def device_ratio(painter: QPainter) -> float:
    """Return the number of device pixels that a painter uses per logical pixel."""
    return max(painter.deviceTransform().m11(), 0.25)


def snap(value: float, ratio: float, width: float = 1.0) -> float:
    """Return the centre of a line, shifted to align the line's edges with device pixels."""
    odd = round(width * ratio) % 2
    return (round(value * ratio - odd / 2.0) + odd / 2.0) / ratio


def polygon(points: Sequence[Point]) -> QPolygonF:
    """Return the points as a Qt polygon."""
    return QPolygonF([QPointF(x, y) for x, y in points])


def closed_path(points: Sequence[Point]) -> QPainterPath:
    """Return a smooth closed path through at least three points."""
    path = QPainterPath(QPointF(*points[0]))
    for first, second, stop in smooth(points).tolist():
        path.cubicTo(QPointF(*first), QPointF(*second), QPointF(*stop))
    path.closeSubpath()
    return path


def draw_text(
    painter: QPainter, middle: Point, text: str, font: QFont, colour: QColor, align: float = 0.5
) -> float:
    """Draw one line of text aligned with device pixels, and return its width.

    `middle` is the point at half the height of the capital letters, and `align` is the fraction of
    the text's width that lies to the left of this point.
    """
    text = visible(text)
    painter.setFont(font)
    metrics = painter.fontMetrics()
    width = float(metrics.horizontalAdvance(text))
    ratio = device_ratio(painter)
    x = round((middle[0] - width * align) * ratio) / ratio
    y = round((middle[1] + metrics.capHeight() / 2.0) * ratio) / ratio
    painter.setPen(colour)
    painter.drawText(QPointF(x, y), text)
    return width


def draw_label(
    painter: QPainter,
    place: Point,
    text: str,
    *,
    fill: QColor | None = None,
    ink: QColor | None = None,
    weight: int = 400,
) -> QRectF:
    """Draw a label with a dark edge on a picture, and return the rectangle of the label."""
    area = label_area(place, text, weight=weight)
    if fill is not None:
        edge = px(4) + 1
        box(painter, area.adjusted(-1.0, -1.0, 1.0, 1.0), edge, theme().c.tag)
    return draw_tag(painter, area.x(), area.y(), text, "tl", fill, ink, weight)


def label_area(
    place: Point, text: str, align: tuple[float, float] = (0.0, 0.0), weight: int = 400
) -> QRectF:
    """Return the rectangle, in logical pixels, of a label as drawn by `draw_label`.

    An `align` of (0, 0) puts the label's upper left corner at `place`, and (1, 1) puts its lower
    right corner there.
    """
    width, height = tag_size(text, weight)
    # Align with whole pixels to keep the edges sharp.
    return QRectF(
        round(place[0] - width * align[0]), round(place[1] - height * align[1]), width, height
    )


def disc(
    painter: QPainter,
    place: Point,
    radius: float,
    fill: QColor | Qt.GlobalColor | None = None,
    edge: QColor | Qt.GlobalColor | None = None,
    width: float = 1.0,
) -> None:
    """Draw a disc, or a ring if there is no fill, with the edge centred on the given radius."""
    painter.setBrush(Qt.BrushStyle.NoBrush if fill is None else fill)
    painter.setPen(Qt.PenStyle.NoPen if edge is None else QPen(edge, width))
    painter.drawEllipse(QPointF(*place), radius, radius)


class Plot(Paints, QWidget):
    """A widget that takes the focus and describes itself to screen readers.

    Everything that is positioned in data units is an item in the plot's panel, and `draw` paints
    the background.
    """

    policies: ClassVar = (QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    role = QAccessible.Role.Graphic
    """Accessible role of the plot."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        give_role(self, self.role)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(*self.policies)
        self._cache: dict[str, tuple[Hashable, QPixmap]] = {}
        self._panel: Panel | None = None

    @property
    def panel(self) -> Panel:
        """The part that pyqtgraph draws, created on first use."""
        if self._panel is None:
            # Import pyqtgraph late, because the import takes a quarter of a second.
            from app.ui.plots.panel import Panel

            self._panel = Panel(self, lambda p: self.draw_over(p, device_ratio(p)))
            self._panel.setGeometry(self.panel_rect())
            self._panel.lower()
            self._panel.show()
        return self._panel

    def panel_rect(self) -> QRect:
        """Return the area of the panel."""
        return self.rect()

    def draw_over(self, painter: QPainter, ratio: float) -> None:
        """Paint over the panel, in the panel's coordinates."""

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the panel in its area."""
        super().resizeEvent(event)
        if self._panel is not None:
            self._panel.setGeometry(self.panel_rect())

    def say(self, words: str) -> None:
        """Set the description for screen readers."""
        if words != self.accessibleDescription():
            self.setAccessibleDescription(words)

    def cached_picture(
        self, name: str, key: Hashable, size: QSize, ratio: float, draw: Callable[[QPainter], None]
    ) -> QPixmap:
        """Return a cached picture, which is redrawn only when its key changes.

        The picture has a transparent background and is drawn in logical pixels.
        """
        t = theme()
        whole = (key, t.name, t.scale, size.width(), size.height(), ratio)
        entry = self._cache.get(name)
        if entry is not None and entry[0] == whole:
            return entry[1]
        pixmap = QPixmap(round(size.width() * ratio), round(size.height() * ratio))
        pixmap.setDevicePixelRatio(ratio)
        pixmap.fill(Qt.GlobalColor.transparent)
        painter = QPainter(pixmap)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        try:
            draw(painter)
        finally:
            painter.end()
        self._cache[name] = (whole, pixmap)
        return pixmap

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the background below the panel.

        The painter is antialiased and works in logical pixels.
        """

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle and the corner radius of the focus ring."""
        return self.rect(), px(6)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the plot."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        # A painter that is left active after an error crashes the program.
        try:
            self.draw(painter, device_ratio(painter))
        finally:
            painter.end()


class TurnPlot(Plot):
    """A plot with a needle that can be moved to any turn with the mouse or the keyboard.

    The arrow keys move the needle by 1°, or by 10° with Shift, and Home moves it to the best turn.
    """

    role = QAccessible.Role.Dial

    turned = Signal(float)
    """Emitted with the needle's turn in (-180, 180] degrees, repeatedly during a drag."""

    released = Signal(float)
    """Emitted with the needle's turn in degrees when the needle is released."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.needle = 0.0  # turn in (-180, 180] degrees
        self._best: float | None = None
        self._dragging = False
        self._stepped = False

    def set_needle(self, turn_deg: float) -> None:
        """Move the needle without emitting a signal."""
        self.needle = wrap(turn_deg)
        self.describe()
        self.update()

    def describe(self) -> None:
        """Describe the values for screen readers."""

    def turn_to(self, turn_deg: float) -> None:
        """Move the needle and emit `turned`."""
        self.set_needle(turn_deg)
        self.turned.emit(self.needle)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the needle with the keyboard."""
        if step := arrow_step(event):
            # Start from a whole number, so that the display changes by whole degrees.
            self.turn_to(round(self.needle) + sum(step))
        elif event.key() == Qt.Key.Key_Home and self._best is not None:
            self.turn_to(self._best)
        else:
            super().keyPressEvent(event)
            return
        self._stepped = True
        event.accept()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Release the needle when the key stops repeating."""
        if self._stepped and not event.isAutoRepeat():
            self._stepped = False
            self.released.emit(self.needle)
        super().keyReleaseEvent(event)

    def turn_under(self, point: Point) -> float | None:
        """Return the turn at a pointer position, in degrees, or None if there is no turn there."""
        raise NotImplementedError

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the needle."""
        if self._dragging:
            turn = self.turn_under((event.position().x(), event.position().y()))
            if turn is not None:
                self.turn_to(turn)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Release the needle."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.end_drag()
        super().mouseReleaseEvent(event)

    def begin_drag(self, turn_deg: float) -> None:
        """Grab the needle with the mouse."""
        self._dragging = True
        self.turn_to(turn_deg)

    def end_drag(self) -> None:
        """Release the needle."""
        if self._dragging:
            self._dragging = False
            self.released.emit(self.needle)
            self.update()
