"""Painting the head with its weights: image, hatch, outline, tags and brush."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPainterPath, QPen, QPixmap

from app.core.painting.stroke import Tool
from app.ui.screens.paint.view.colours import CanvasColours, veil_bytes
from app.ui.theme import theme
from app.ui.widgets.paint import MIDDLE, draw_tag, put_text
from app.ui.widgets.plots.base import device_ratio
from app.ui.widgets.plots.mask_canvas import BrushSign, draw_brush_ring

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.painting.canvas import Canvas, Region
    from app.core.painting.stroke import Brush
    from app.ui.screens.paint.state import Bytes, HeadLook
    from app.ui.screens.paint.view.viewing import Viewing

_RADIUS: Final = 8
_TAG_INSET: Final = 12
_SIGN: Final = 12  # reach of the sign in the middle of the ring
_HATCH: Final = 8  # distance of the lines, logical pixels
_SIGNS: Final[dict[Tool, BrushSign]] = {
    Tool.BRIGHTER: "plus",
    Tool.DARKER: "minus",
    Tool.IGNORE: "ignore",
    Tool.RESTORE: "restore",
}
_RIGHT: Final = "Sitter’s right (camera left)"
_LEFT: Final = "Sitter’s left (camera right)"


class FacePainter:
    """Holds what the canvas shows, and paints it."""

    def __init__(self) -> None:
        c = theme().c
        plus, minus = ((each.red(), each.green(), each.blue()) for each in (c.plus, c.minus))
        self._colours = CanvasColours(plus, minus)
        self._head: HeadLook | None = None
        self._canvas: Canvas | None = None
        self._picture: Bytes | None = None
        self._image: QImage | None = None
        self._notice = ""
        self._weights = True
        self._veil: tuple[tuple[object, ...], QPixmap] | None = None
        self._hatch: tuple[float, QPixmap] | None = None
        self._ring: tuple[tuple[object, ...], QPixmap] | None = None
        self._corners: tuple[QSize, QPainterPath] | None = None

    @property
    def size(self) -> int:
        """Side of the canvas, pixels; 0 while there is none."""
        return 0 if self._canvas is None or self._head is None else self._canvas.size

    @property
    def shows_weights(self) -> bool:
        """Whether weights are shown, and no picture."""
        return self._picture is None

    def set_head(self, head: HeadLook | None) -> bool:
        """Take another head; returns whether it is one."""
        if head is self._head:
            return False
        self._head, self._veil = head, None
        if self._canvas is not None:
            self.set_canvas(self._canvas)
        return True

    def set_canvas(self, canvas: Canvas) -> None:
        """Take another canvas and colour all of it."""
        self._canvas = canvas
        if self._head is None:
            return
        colours = self._colours
        colours.set_head(self._head.grey, canvas.size)
        size = canvas.size
        self._image = QImage(colours.pixels.data, size, size, 4 * size, QImage.Format.Format_RGB32)
        if self._picture is None:
            colours.show_weights(canvas)
        else:
            colours.show_picture(self._picture)

    def show_region(self, canvas: Canvas, region: Region) -> None:
        """Colour a part of the canvas anew."""
        self._canvas = canvas
        if self._picture is None:
            self._colours.show_weights(canvas, region)

    def set_picture(self, picture: Bytes | None) -> bool:
        """Show a picture in place of the weights, or the weights; returns whether that is new."""
        if picture is self._picture:
            return False
        self._picture = picture
        if picture is not None:
            self._colours.show_picture(picture)
        elif self._canvas is not None:
            self._colours.show_weights(self._canvas)
        return True

    def set_words(self, notice: str, weights: bool) -> bool:
        """Set what stands in place of a canvas that is missing; returns whether that is new."""
        new = (notice, weights) != (self._notice, self._weights)
        self._notice, self._weights = notice, weights
        return new

    def draw(
        self, painter: QPainter, area: QRect, part: QRect, view: Viewing, ratio: float
    ) -> None:
        """Paint all but the ring.

        Parameters
        ----------
        painter : QPainter
            In logical pixels of the widget.
        ratio : float
            Device pixels per logical one.
        """
        t = theme()
        painter.fillRect(part, t.c.well)
        if self._image is not None and self.size:
            target = QRectF(view.left, view.top, self.size * view.zoom, self.size * view.zoom)
            painter.drawImage(target, self._image)
            if self._picture is None and self._colours.any_ignored:
                self._draw_hatch(painter, target, part, ratio)
            painter.drawPixmap(QPointF(0, 0), self._veil_for(area, view, ratio))
        elif self._notice:
            put_text(painter, area, self._notice, t.font(14), t.c.ontag, MIDDLE)
        inset = t.px(_TAG_INSET)
        low = area.height() - inset
        if part.bottom() >= low - t.px(24):
            draw_tag(painter, inset, low, _RIGHT, "bl")
            draw_tag(painter, area.width() - inset, low, _LEFT, "br")
        self._round_off(painter, area, part)

    def draw_rings(
        self, painter: QPainter, places: Sequence[QPointF], brush: Brush, zoom: float
    ) -> None:
        """Paint the brush where it is, and its mirror image paler.

        Parameters
        ----------
        zoom : float
            Logical pixels per canvas pixel.
        """
        ratio = device_ratio(painter)
        ring = self._ring_for(brush, zoom, ratio)
        half = ring.width() / ratio / 2
        for number, place in enumerate(places):
            painter.setOpacity(0.45 if number else 1.0)
            # On whole device pixels, or it would be smeared.
            x, y = (round((value - half) * ratio) / ratio for value in (place.x(), place.y()))
            painter.drawPixmap(QPointF(x, y), ring)
        painter.setOpacity(1.0)

    def _ring_for(self, brush: Brush, zoom: float, ratio: float) -> QPixmap:
        """Draw the ring once for each brush: antialiased circles are slow."""
        key = (brush.radius, brush.full_radius, brush.tool, zoom, ratio)
        if self._ring is not None and self._ring[0] == key:
            return self._ring[1]
        reach = int(max(brush.radius * zoom, _SIGN)) + 3
        pixmap = QPixmap(round(2 * reach * ratio), round(2 * reach * ratio))
        pixmap.setDevicePixelRatio(ratio)
        pixmap.fill(Qt.GlobalColor.transparent)
        painter = QPainter(pixmap)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        radius, inner = brush.radius * zoom, brush.full_radius * zoom
        draw_brush_ring(painter, (reach, reach), radius, inner, _SIGNS[brush.tool])
        painter.end()
        self._ring = (key, pixmap)
        return pixmap

    def _veil_for(self, area: QRect, view: Viewing, ratio: float) -> QPixmap:
        assert self._head is not None
        wide, high = round(area.width() * ratio), round(area.height() * ratio)
        key = (wide, high, view, ratio, self.size)
        if self._veil is not None and self._veil[0] == key:
            return self._veil[1]
        coverage = self._head.coverage
        scale = view.zoom * ratio * self.size / len(coverage)
        offset = (view.left * ratio, view.top * ratio)
        pixels = veil_bytes(coverage, (wide, high), scale, offset, theme().c.well.red())
        kind = QImage.Format.Format_ARGB32_Premultiplied
        image = QImage(pixels.data, wide, high, 4 * wide, kind)
        pixmap = QPixmap.fromImage(image)
        pixmap.setDevicePixelRatio(ratio)
        self._veil = (key, pixmap)
        return pixmap

    def _draw_hatch(self, painter: QPainter, target: QRectF, part: QRect, ratio: float) -> None:
        """Hatch what is ignored, with lines that stay sharp at any zoom."""
        part = part.intersected(target.toAlignedRect())
        if part.isEmpty():
            return
        layer = QImage(part.size() * ratio, QImage.Format.Format_ARGB32_Premultiplied)
        layer.setDevicePixelRatio(ratio)
        layer.fill(Qt.GlobalColor.transparent)
        on_layer = QPainter(layer)
        on_layer.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        on_layer.translate(-part.topLeft())
        on_layer.setBrushOrigin(0, 0)
        on_layer.fillRect(part, QBrush(self._hatch_for(ratio)))
        on_layer.setCompositionMode(QPainter.CompositionMode.CompositionMode_DestinationIn)
        mask = self._colours.ignored
        size = len(mask)
        image = QImage(mask.data, size, size, size, QImage.Format.Format_Alpha8)
        on_layer.drawImage(target, image)
        on_layer.end()
        painter.drawImage(part.topLeft(), layer)

    def _hatch_for(self, ratio: float) -> QPixmap:
        if self._hatch is not None and self._hatch[0] == ratio:
            return self._hatch[1]
        side = theme().px(_HATCH)
        tile = QPixmap(round(side * ratio), round(side * ratio))
        tile.setDevicePixelRatio(ratio)
        tile.fill(QColor(20, 20, 20, 70))
        painter = QPainter(tile)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for colour, width in ((QColor(0, 0, 0, 150), 3.0), (QColor(255, 255, 255, 210), 1.25)):
            painter.setPen(QPen(colour, width))
            for shift in (-side, 0, side):
                painter.drawLine(QPointF(shift, side), QPointF(shift + side, 0))
        painter.end()
        self._hatch = (ratio, tile)
        return tile

    def _round_off(self, painter: QPainter, area: QRect, part: QRect) -> None:
        """Cover the corners, so that the well is rounded."""
        t = theme()
        radius = t.px(_RADIUS)
        if area.adjusted(radius, radius, -radius, -radius).contains(part):
            return
        if self._corners is None or self._corners[0] != area.size():
            corners, inside = QPainterPath(), QPainterPath()
            corners.addRect(QRectF(area))
            inside.addRoundedRect(QRectF(area), radius, radius)
            self._corners = (area.size(), corners.subtracted(inside))
        painter.fillPath(self._corners[1], t.c.bg)
