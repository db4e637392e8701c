"""The head with its weights, as items of a ViewBox: image, hatch, outline, tags and brush."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPen, QPixmap

from app.core.base.arrays import Bytes, Float32
from app.core.painting.canvas import Canvas, Region
from app.core.painting.stroke import Brush, Tool
from app.core.text import tr
from app.ui.plots.mask_canvas import BrushSign, draw_brush_ring
from app.ui.plots.panel import Panel
from app.ui.plots.parts.base import device_ratio
from app.ui.plots.parts.geometry import Point
from app.ui.plots.parts.items import Mark, Overlay
from app.ui.plots.parts.marks import draw_corners
from app.ui.screens.paint.state import HeadLook
from app.ui.screens.paint.tools_view import Viewing
from app.ui.theme import px, theme
from app.ui.widgets.paint import MIDDLE, draw_tag, put_text

Pixels: TypeAlias = NDArray[np.uint32]
Colour: TypeAlias = tuple[int, int, int]

_LEVELS: Final = 127  # of weights on either side of 0
_MIDDLE: Final = 0.58  # sRGB value of the head's median pixel
_STRONGEST: Final = 0.90  # opacity of full weight: the face still shows through
_BEND: Final = 2.2  # faint weights are to be seen too, without an edge where they change sign
_FADE: Final = 8.0  # an ignored area ends within an eighth of the layer's range
_OPAQUE: Final = np.uint32(0xFF000000)
_EDGE: Final = 1.6  # width of the head's outline, device pixels
_SOFT: Final = 0.4  # pixels of the head
_SPREAD: Final = 2.7  # pixels of the head over which a smoothed edge rises
_FINER: Final = 4
_LEAST: Final = np.float32(0.01)  # of a pixel; so little is no head
_LEAST_VISIBLE: Final = 0.5  # skin that the front shows less well is not painted on
_SMOOTH: Final = 1.0  # pixels of the head: its outline is a line, not steps


def colour_table(plus: Colour, minus: Colour) -> Pixels:
    """Colour every pair of a grey value and a weight.

    Args:
        plus, minus: sRGB of positive and negative weights.

    Returns:
        (256, 255) uint32. 0xffRRGGBB by grey value (sRGB byte) and weight (127 + 127 w).
    """
    grey = np.arange(256, dtype=np.float64)[:, None, None]
    weight = np.arange(-_LEVELS, _LEVELS + 1)[None, :, None] / _LEVELS
    opacity = _STRONGEST * np.expm1(-_BEND * np.abs(weight)) / np.expm1(-_BEND)
    tint = np.where(weight < 0, np.array(minus, float), np.array(plus, float))
    # The form of the face stays visible in the colour.
    brightness = np.clip(0.5 + 0.5 * grey / (255 * _MIDDLE), 0.4, 1.25)
    colour = np.clip((1 - opacity) * grey + opacity * np.minimum(tint * brightness, 255.0), 0, 255)
    red, green, blue = np.moveaxis(np.rint(colour).astype(np.uint32), 2, 0)
    return np.ascontiguousarray(_OPAQUE | red << 16 | green << 8 | blue)


class CanvasColours:
    """What the canvas looks like, at the canvas's own resolution.

    Args:
        plus, minus: sRGB of positive and negative weights.

    Attributes:
        pixels: (S, S) uint32. 0xffRRGGBB; always the same array for one size, so that an image may
            lie on it.
        ignored: (S, S) uint8. Opacity of the hatch.
    """

    def __init__(self, plus: Colour, minus: Colour) -> None:
        self._table = colour_table(plus, minus).ravel()
        self._grey: NDArray[np.int32] = np.zeros((0, 0), np.int32)
        self.pixels: Pixels = np.zeros((0, 0), np.uint32)
        self.ignored: Bytes = np.zeros((0, 0), np.uint8)
        self.any_ignored = False

    def set_head(self, grey: Float32, size: int) -> None:
        """Lay a head under the weights.

        Args:
            grey: (N, N) float32. sRGB values, 0 to 1.
            size: Side of the canvas, pixels.
        """
        values = np.rint(np.clip(_enlarged(grey, size), 0.0, 1.0) * 255.0).astype(np.int32)
        self._grey = values * (2 * _LEVELS + 1) + _LEVELS
        if self.pixels.shape != values.shape:
            self.pixels = np.zeros(values.shape, np.uint32)
            self.ignored = np.zeros(values.shape, np.uint8)

    def show_weights(self, canvas: Canvas, region: Region | None = None) -> None:
        """Colour what has changed, canvas pixels; everything by default."""
        part = region or Region(0, 0, canvas.size, canvas.size)
        if part.empty or self.pixels.shape != canvas.weights.shape:
            return
        place = part.slices
        ignore = canvas.ignore[place]
        hidden = np.clip((ignore - np.float32(0.5)) * np.float32(_FADE) + np.float32(0.5), 0, 1)
        weights = canvas.weights[place] * (1 - hidden)
        index = self._grey[place] + np.rint(weights * np.float32(_LEVELS)).astype(np.int32)
        self.pixels[place] = self._table[index]
        self.ignored[place] = (hidden * 255).astype(np.uint8)
        self.any_ignored = bool(self.ignored.any())

    def show_picture(self, picture: Bytes) -> None:
        """Show a picture of the head in place of the weights. `picture`, (N, N, 3) uint8: sRGB."""
        size = len(self.pixels)
        if not size:
            return
        fine = _enlarged(picture, size).astype(np.uint32)
        self.pixels[...] = _OPAQUE | fine[..., 0] << 16 | fine[..., 1] << 8 | fine[..., 2]
        self.any_ignored = False


def _enlarged(picture: NDArray[Any], size: int) -> NDArray[Any]:
    """Enlarge a picture of the head smoothly: its pixels must not be seen as squares."""
    fine = cv2.resize(picture, (size, size), interpolation=cv2.INTER_CUBIC)
    spread = _SOFT * size / len(picture)
    return np.asarray(cv2.GaussianBlur(fine, (0, 0), spread, borderType=cv2.BORDER_REPLICATE))


def _finer(places: Float32, size: int) -> Float32:
    """Places on the front, for each pixel of a canvas and in its pixels, (S, S, 3) float32."""
    coverage = (places[..., 2:] >= 0).astype(np.float32)
    share, sums = (
        cv2.resize(each, (size, size), interpolation=cv2.INTER_LINEAR)
        for each in (coverage, places * coverage)
    )
    scale = np.array([size, size, 1], np.float32)
    return np.asarray(scale * sums / np.maximum(share, _LEAST)[..., None], np.float32)


def veil_bytes(
    coverage: Float32, size: tuple[int, int], scale: float, offset: tuple[float, float], grey: int
) -> Pixels:
    """Cover everything that is not head, with a clean outline at the screen's own resolution.

    Args:
        coverage: (N, N) float32. Share of each pixel that the head covers.
        size: Width and height, device pixels.
        scale: Device pixels per pixel of the head.
        offset: Where the head's picture has its upper left corner, device pixels.

    Returns:
        (height, width) uint32. 0xAARRGGBB, colours multiplied by opacity.
    """
    # Finer first, then smoothed: a cubic through the pixels themselves would make waves.
    side = _FINER * len(coverage)
    fine = cv2.resize(coverage, (side, side), interpolation=cv2.INTER_LINEAR)
    smooth = cv2.GaussianBlur(fine, (0, 0), _FINER * _SMOOTH, borderType=cv2.BORDER_REPLICATE)
    share = np.rint(np.clip(smooth, 0.0, 1.0) * 255.0).astype(np.uint8)
    step = scale / _FINER
    # Device pixel i has its middle at i + 0.5.
    half = 0.5 / step - 0.5
    matrix = np.array(
        [[1 / step, 0.0, half - offset[0] / step], [0.0, 1 / step, half - offset[1] / step]]
    )
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    inside = cv2.warpAffine(share, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    place = np.arange(256) / 255.0
    opacity = 1.0 - np.clip((place - 0.5) * max(_SPREAD * scale / _EDGE, 1.0) + 0.5, 0.0, 1.0)
    alpha = np.rint(opacity * 255.0).astype(np.uint32)
    level = np.rint(opacity * grey).astype(np.uint32)
    table = (alpha << 24 | level << 16 | level << 8 | level).astype(np.uint32)
    return np.ascontiguousarray(table[np.asarray(inside)])


_RADIUS: Final = 8
_TAG_INSET: Final = 12
_SIGN: Final = 12  # reach of the sign in the middle of the ring
_CLEAR: Final = Qt.GlobalColor.transparent
_HATCH: Final = 8  # distance of the lines, logical pixels
_SIGNS: Final[dict[Tool, BrushSign]] = {
    Tool.BRIGHTER: "plus",
    Tool.DARKER: "minus",
    Tool.IGNORE: "ignore",
    Tool.RESTORE: "restore",
}
_RIGHT: Final = tr("Sitter’s right (camera left)")
_LEFT: Final = tr("Sitter’s left (camera right)")


class _Head(pg.ImageItem):  # type: ignore[misc]
    """An image of pixels that change in place: only a part of it is painted again."""

    def __init__(self) -> None:
        super().__init__(axisOrder="row-major")
        self._pixels = QImage()

    def set_pixels(self, pixels: Pixels) -> None:
        """Show another array from now on, (S, S) 0xffRRGGBB."""
        self.prepareGeometryChange()
        size = len(pixels)
        self._pixels = QImage(pixels.data, size, size, 4 * size, QImage.Format.Format_RGB32)
        self.update()

    def boundingRect(self) -> QRectF:
        """Return the canvas, in its pixels."""
        return QRectF(self._pixels.rect())

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint it."""
        painter.drawImage(self.boundingRect(), self._pixels)


class FaceItems:
    """Holds what the canvas shows, and the items that show it, from the ground up."""

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
        """Side of the canvas, pixels; 0 while there is none."""
        return 0 if self._canvas is None or self._head is None else self._canvas.size

    @property
    def turned(self) -> bool:
        """Whether the head is seen from aside."""
        return self._head is not None and self._head.places is not None

    def set_head(self, head: HeadLook | None) -> bool:
        """Take another head; returns whether it is one."""
        if head is self._head:
            return False
        self._head = head
        self._cache.pop("veil", None)
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
        self._image.set_pixels(colours.pixels)
        self._image.show()
        places = self._head.places
        self._places = None if places is None else _finer(places, size)
        if self._picture is None:
            colours.show_weights(self._laid_on(canvas))
        else:
            colours.show_picture(self._picture)

    def _laid_on(self, canvas: Canvas) -> Canvas:
        """What is painted as the head shows it that is seen."""
        if self._places is None:
            return canvas
        # Pixel i has its middle at i + 0.5.
        across, down, visibility = cv2.split(self._places)
        weights, ignore = (
            visibility * cv2.remap(layer, across - 0.5, down - 0.5, cv2.INTER_LINEAR)
            for layer in (canvas.weights, canvas.ignore)
        )
        return replace(canvas, weights=weights, ignore=ignore)

    def on_front(self, x: float, y: float) -> tuple[float, float] | None:
        """Canvas pixel of the front that shows the same skin; None where it shows none of it."""
        if self._places is None:
            return x, y
        column, row = int(x), int(y)
        if not (0 <= column < self.size and 0 <= row < self.size):
            return None
        across, down, visibility = self._places[row, column].tolist()
        return (across, down) if visibility >= _LEAST_VISIBLE else None

    def show_region(self, canvas: Canvas, region: Region) -> None:
        """Colour a part of the canvas again."""
        self._canvas = canvas
        if self._picture is None:
            self._colours.show_weights(self._laid_on(canvas), None if self.turned else region)
            whole = self._image.boundingRect()
            # Enlarging mixes neighbours, so pixels around it have changed, too.
            wide, high = region.right - region.left + 4, region.bottom - region.top + 4
            part = QRectF(region.left - 2, region.top - 2, wide, high)
            self._image.update(whole if self.turned else part)

    def set_picture(self, picture: Bytes | None) -> bool:
        """Show a picture in place of the weights, or the weights; returns whether that is new."""
        if picture is self._picture:
            return False
        self._picture = picture
        if picture is not None:
            self._colours.show_picture(picture)
        elif self._canvas is not None:
            self._colours.show_weights(self._laid_on(self._canvas))
        return True

    def set_words(self, notice: str, weights: bool) -> bool:
        """Set what stands in place of a canvas that is missing; returns whether that is new."""
        new = (notice, weights) != (self._notice, self._weights)
        self._notice, self._weights = notice, weights
        return new

    def look(self, view: Viewing) -> None:
        """Show a part of the canvas."""
        self._view = view
        wide, high = self._panel.width() / view.zoom, self._panel.height() / view.zoom
        self._panel.look_at(QRectF(-view.left / view.zoom, -view.top / view.zoom, wide, high))

    def repaint(self) -> None:
        """Paint everything again."""
        self._panel.viewport().update()

    def show_ring(self, place: tuple[float, float] | None, brush: Brush) -> None:
        """Show the brush at a canvas pixel, and its mirror image paler; None shows neither."""
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
        """Paint what lies over the head: hatch, outline, tags and corners."""
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
            draw_tag(painter, inset, low, _RIGHT, "bl")
            draw_tag(painter, area.width() - inset, low, _LEFT, "br")
        radius = px(_RADIUS)
        if not area.adjusted(radius, radius, -radius, -radius).contains(part):
            draw_corners(painter, area, t.c.bg, radius)

    def _draw_ring_at(self, opacity: float, painter: QPainter, place: Point) -> None:
        brush, zoom, ratio = self._brush, self._view.zoom, device_ratio(painter)
        key = (brush.radius, brush.full_radius, brush.tool, zoom, ratio)
        ring = self._once("ring", key, lambda: self._draw_ring(brush, zoom, ratio))
        half = ring.width() / ratio / 2
        painter.setOpacity(opacity)
        # On whole device pixels, or it would be smeared.
        x, y = (round((value - half) * ratio) / ratio for value in place)
        painter.drawPixmap(QPointF(x, y), ring)

    def _once(self, what: str, key: object, make: Callable[[], QPixmap]) -> QPixmap:
        """Draw something once for each key: antialiased circles are slow."""
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
        on_layer.fillRect(part, QBrush(self._once("hatch", ratio, lambda: _hatch(ratio))))
        on_layer.setCompositionMode(QPainter.CompositionMode.CompositionMode_DestinationIn)
        mask = self._colours.ignored
        size = len(mask)
        on_layer.drawImage(target, QImage(mask.data, size, size, size, QImage.Format.Format_Alpha8))
        on_layer.end()
        painter.drawImage(part.topLeft(), layer)


def _pixmap(side: int, ratio: float, fill: QColor | Qt.GlobalColor = _CLEAR) -> QPixmap:
    """Make a square pixmap of a side in logical pixels."""
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
