"""The items on the canvas: the head with its weights, hatching, an outline, tags and the brush."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import cv2
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPen, QPixmap

from app.core.base.arrays import Bytes, Float32
from app.core.painting.canvas import Canvas, Region
from app.core.painting.stroke import Brush, Tool
from app.core.text import tr
from app.ui.plots.mask_canvas import BrushSign, draw_brush_ring
from app.ui.plots.panel import Panel
from app.ui.plots.parts.base import device_ratio
from app.ui.plots.parts.curve_items import Mark, Overlay
from app.ui.plots.parts.geometry import Point
from app.ui.plots.parts.panorama_scale import draw_corners
from app.ui.screens.paint.head_pixels import (
    CanvasColours,
    HeadLook,
    Pixels,
    finer_places,
    veil_bytes,
)
from app.ui.screens.paint.zoom_view import Viewing
from app.ui.theme import px, theme
from app.ui.widgets.paint import MIDDLE, draw_tag, put_text

_LEAST_VISIBLE: Final = 0.5  # minimum visibility of skin that can be painted
_RADIUS: Final = 8
_TAG_INSET: Final = 12
_SIGN: Final = 12  # extent of the sign in the middle of the ring
_CLEAR: Final = Qt.GlobalColor.transparent
_HATCH: Final = 8  # spacing of the lines in logical pixels
_SIGNS: Final[dict[Tool, BrushSign]] = {
    Tool.BRIGHTER: "plus",
    Tool.DARKER: "minus",
    Tool.IGNORE: "ignore",
    Tool.RESTORE: "restore",
}
SITTERS_RIGHT: Final = tr("Sitter’s right (camera left)")
SITTERS_LEFT: Final = tr("Sitter’s left (camera right)")


class _Head(pg.ImageItem):  # type: ignore[misc]
    """An image whose pixels change in place. Only the changed part is repainted."""

    def __init__(self) -> None:
        super().__init__(axisOrder="row-major")
        self._pixels = QImage()

    def set_pixels(self, pixels: Pixels) -> None:
        """Show another array of pixels, (S, S), each 0xffRRGGBB."""
        self.prepareGeometryChange()
        size = len(pixels)
        self._pixels = QImage(pixels.data, size, size, 4 * size, QImage.Format.Format_RGB32)
        self.update()

    def boundingRect(self) -> QRectF:
        """Return the area of the canvas, in canvas pixels."""
        return QRectF(self._pixels.rect())

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the image."""
        painter.drawImage(self.boundingRect(), self._pixels)


class FaceItems:
    """The items on the canvas, from back to front."""

    def __init__(self, panel: Panel) -> None:
        c = theme().c
        plus, minus = ((each.red(), each.green(), each.blue()) for each in (c.plus, c.minus))
        self._colours = CanvasColours(plus, minus)
        self._head: HeadLook | None = None
        self._places: Float32 | None = None
        self._canvas: Canvas | None = None
        self._picture: Bytes | None = None
        self._notice = ""
        self._weights = True
        self._cache: dict[str, tuple[object, QPixmap]] = {}
        self._view, self._brush = Viewing(), Brush()
        self._panel = panel
        panel.setBackgroundBrush(c.well)
        panel.paint_changes_only()
        self._image = panel.add(_Head())
        self._image.hide()
        panel.add(Overlay(self._draw_over))
        self._twin = panel.add(Mark(partial(self._draw_ring_at, 0.45), 0.0))
        self._ring = panel.add(Mark(partial(self._draw_ring_at, 1.0), 0.0))

    @property
    def size(self) -> int:
        """Side length of the canvas in pixels, or 0 before the first canvas."""
        return 0 if self._canvas is None or self._head is None else self._canvas.size

    @property
    def turned(self) -> bool:
        """Whether the head is turned away from the lens."""
        return self._head is not None and self._head.places is not None

    def set_head(self, head: HeadLook | None) -> bool:
        """Set the head, and return whether it has changed."""
        if head is self._head:
            return False
        self._head = head
        self._cache.pop("veil", None)
        if self._canvas is not None:
            self.set_canvas(self._canvas)
        return True

    def set_canvas(self, canvas: Canvas) -> None:
        """Set the canvas and update all of its colours."""
        self._canvas = canvas
        if self._head is None:
            return
        colours = self._colours
        colours.set_head(self._head.grey, canvas.size)
        size = canvas.size
        self._image.set_pixels(colours.pixels)
        self._image.show()
        places = self._head.places
        self._places = None if places is None else finer_places(places, size)
        if self._picture is None:
            colours.show_weights(self._laid_on(canvas))
        else:
            colours.show_picture(self._picture)

    def _laid_on(self, canvas: Canvas) -> Canvas:
        """Return the canvas, projected onto the head in its current view."""
        if self._places is None:
            return canvas
        # The centre of pixel i is at i + 0.5.
        across, down, visibility = cv2.split(self._places)
        weights, ignore = (
            visibility * cv2.remap(layer, across - 0.5, down - 0.5, cv2.INTER_LINEAR)
            for layer in (canvas.weights, canvas.ignore)
        )
        return replace(canvas, weights=weights, ignore=ignore)

    def on_front(self, x: float, y: float) -> tuple[float, float] | None:
        """Return the front-view pixel showing the same skin, or None if that skin is hidden."""
        if self._places is None:
            return x, y
        column, row = int(x), int(y)
        if not (0 <= column < self.size and 0 <= row < self.size):
            return None
        across, down, visibility = self._places[row, column].tolist()
        return (across, down) if visibility >= _LEAST_VISIBLE else None

    def show_region(self, canvas: Canvas, region: Region) -> None:
        """Update the colours of a part of the canvas."""
        self._canvas = canvas
        if self._picture is None:
            self._colours.show_weights(self._laid_on(canvas), None if self.turned else region)
            whole = self._image.boundingRect()
            # Scaling up blends neighbours, so pixels around the region change as well.
            wide, high = region.right - region.left + 4, region.bottom - region.top + 4
            part = QRectF(region.left - 2, region.top - 2, wide, high)
            self._image.update(whole if self.turned else part)

    def set_picture(self, picture: Bytes | None) -> bool:
        """Show a picture, or the weights if it is None, and return whether anything changed."""
        if picture is self._picture:
            return False
        self._picture = picture
        if picture is not None:
            self._colours.show_picture(picture)
        elif self._canvas is not None:
            self._colours.show_weights(self._laid_on(self._canvas))
        return True

    def set_words(self, notice: str, weights: bool) -> bool:
        """Set the text that replaces a missing canvas, and return whether anything changed."""
        new = (notice, weights) != (self._notice, self._weights)
        self._notice, self._weights = notice, weights
        return new

    def look(self, view: Viewing) -> None:
        """Show a part of the canvas."""
        self._view = view
        wide, high = self._panel.width() / view.zoom, self._panel.height() / view.zoom
        self._panel.look_at(QRectF(-view.left / view.zoom, -view.top / view.zoom, wide, high))

    def repaint(self) -> None:
        """Repaint everything."""
        self._panel.viewport().update()

    def show_ring(self, place: tuple[float, float] | None, brush: Brush) -> None:
        """Show the brush and its paler mirror image, or hide both.

        Args:
            place: Position of the brush in canvas pixels, or None to hide it.
        """
        fresh, self._brush = brush != self._brush, brush
        mirrored = brush.mirror and not self.turned
        for ring, visible in ((self._ring, True), (self._twin, mirrored)):
            ring.setVisible(visible and place is not None)
            if place is not None:
                ring.set_size(2.0 * (int(max(brush.radius * self._view.zoom, _SIGN)) + 4))
                ring.setPos(place[0] if ring is self._ring else self.size - place[0], place[1])
            if fresh:
                ring.update()

    def _draw_over(self, painter: QPainter, part: QRect) -> None:
        """Paint the hatching, the outline, the tags and the corners on top of the head."""
        t, area, view = theme(), self._panel.rect(), self._view
        ratio = device_ratio(painter)
        if self.size:
            if self._picture is None and self._colours.any_ignored:
                target = QRectF(view.left, view.top, self.size * view.zoom, self.size * view.zoom)
                self._draw_hatch(painter, target, part, ratio)
            wide, high = round(area.width() * ratio), round(area.height() * ratio)
            veil = self._once(
                "veil",
                (wide, high, view, ratio, self.size),
                lambda: self._draw_veil(wide, high, view, ratio),
            )
            painter.drawPixmap(QPointF(0, 0), veil)
        elif self._notice:
            put_text(painter, area, self._notice, t.font(14), t.c.ontag, MIDDLE)
        inset = px(_TAG_INSET)
        low = area.height() - inset
        if part.bottom() >= low - px(24):
            draw_tag(painter, inset, low, SITTERS_RIGHT, "bl")
            draw_tag(painter, area.width() - inset, low, SITTERS_LEFT, "br")
        radius = px(_RADIUS)
        if not area.adjusted(radius, radius, -radius, -radius).contains(part):
            draw_corners(painter, area, t.c.bg, radius)

    def _draw_ring_at(self, opacity: float, painter: QPainter, place: Point) -> None:
        brush, zoom, ratio = self._brush, self._view.zoom, device_ratio(painter)
        key = (brush.radius, brush.full_radius, brush.tool, zoom, ratio)
        ring = self._once("ring", key, lambda: self._draw_ring(brush, zoom, ratio))
        half = ring.width() / ratio / 2
        painter.setOpacity(opacity)
        # Align the ring with whole device pixels to keep it sharp.
        x, y = (round((value - half) * ratio) / ratio for value in place)
        painter.drawPixmap(QPointF(x, y), ring)

    def _once(self, what: str, key: object, make: Callable[[], QPixmap]) -> QPixmap:
        """Return a pixmap from the cache, because antialiased circles are slow to draw."""
        entry = self._cache.get(what)
        if entry is None or entry[0] != key:
            entry = self._cache[what] = (key, make())
        return entry[1]

    def _draw_ring(self, brush: Brush, zoom: float, ratio: float) -> QPixmap:
        reach = int(max(brush.radius * zoom, _SIGN)) + 3
        pixmap = _pixmap(2 * reach, ratio)
        painter = QPainter(pixmap)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        radius, inner = brush.radius * zoom, brush.full_radius * zoom
        draw_brush_ring(painter, (reach, reach), radius, inner, _SIGNS[brush.tool])
        painter.end()
        return pixmap

    def _draw_veil(self, wide: int, high: int, view: Viewing, ratio: float) -> QPixmap:
        assert self._head is not None
        coverage = self._head.coverage
        scale = view.zoom * ratio * self.size / len(coverage)
        offset = (view.left * ratio, view.top * ratio)
        pixels = veil_bytes(coverage, (wide, high), scale, offset, theme().c.well.red())
        kind = QImage.Format.Format_ARGB32_Premultiplied
        pixmap = QPixmap.fromImage(QImage(pixels.data, wide, high, 4 * wide, kind))
        pixmap.setDevicePixelRatio(ratio)
        return pixmap

    def _draw_hatch(self, painter: QPainter, target: QRectF, part: QRect, ratio: float) -> None:
        """Hatch the ignored areas with lines that stay sharp at any zoom."""
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
        on_layer.fillRect(part, QBrush(self._once("hatch", ratio, lambda: _hatch(ratio))))
        on_layer.setCompositionMode(QPainter.CompositionMode.CompositionMode_DestinationIn)
        mask = self._colours.ignored
        size = len(mask)
        on_layer.drawImage(target, QImage(mask.data, size, size, size, QImage.Format.Format_Alpha8))
        on_layer.end()
        painter.drawImage(part.topLeft(), layer)


def _pixmap(side: int, ratio: float, fill: QColor | Qt.GlobalColor = _CLEAR) -> QPixmap:
    """Return a square pixmap whose side is given in logical pixels."""
    pixmap = QPixmap(round(side * ratio), round(side * ratio))
    pixmap.setDevicePixelRatio(ratio)
    pixmap.fill(fill)
    return pixmap


def _hatch(ratio: float) -> QPixmap:
    side = px(_HATCH)
    tile = _pixmap(side, ratio, QColor(20, 20, 20, 70))
    painter = QPainter(tile)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    for colour, width in ((QColor(0, 0, 0, 150), 3.0), (QColor(255, 255, 255, 210), 1.25)):
        painter.setPen(QPen(colour, width))
        for shift in (-side, 0, side):
            painter.drawLine(QPointF(shift, side), QPointF(shift + side, 0))
    painter.end()
    return tile
