"""Images of a whole panorama and hatching over them, in degrees of azimuth and elevation."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QImage,
    QPainter,
    QPainterPath,
    QPen,
    QPixmap,
    QPolygonF,
    QTransform,
)
from PySide6.QtWidgets import QGraphicsItem, QStyleOptionGraphicsItem, QWidget

from app.core.base.arrays import Bytes

_SMALLEST: Final = 512  # minimum columns of a smaller copy
_GAP: Final = 1 / 340  # half the widest gap as a fraction of the width: 3 texels in 1,024
_CLIPPED: Final = 0.02  # a texel with a larger clipped fraction counts as clipped
_PERIOD: Final = 8.0  # spacing of the hatching in logical pixels along a row
_INK: Final = QColor(16, 16, 16)
_PAPER: Final = QColor(245, 245, 245)


class PanoramaLayer(pg.ImageItem):  # type: ignore[misc]
    """An image of a whole panorama, drawn from a smaller copy when the image is scaled down."""

    def __init__(self) -> None:
        super().__init__(axisOrder="row-major")
        self._copies: list[Bytes] = []
        self._images: dict[int, QImage] = {}

    def set_pixels(self, pixels: Bytes | None) -> None:
        """Show a different image.

        Args:
            pixels: uint8 array of one of three shapes: (h, w) for greyscale, (h, w, 3) for sRGB, or
                (h, w, 4) for premultiplied blue, green and red with opacity. If it is None, nothing
                is shown. Azimuths run from −180° to 180°, shifted by `setX`.
        """
        self._images = {}
        self._copies = [] if pixels is None else [pixels]
        if pixels is None:
            self.clear()
            return
        rows, columns = pixels.shape[:2]
        self._around = QRectF(-(columns // 2), 0.0, columns + columns // 2 * 2, rows)
        self.setImage(pixels, autoLevels=False)
        self.setRect(QRectF(-180.0, -90.0, 360.0, 180.0))

    def boundingRect(self) -> QRectF:
        """Return the area of the panorama plus half a turn on each side, in panorama pixels."""
        return self._around if self._copies else QRectF()

    def paint(self, painter: QPainter, *_args: object) -> None:
        """Paint the smallest copy that has enough pixels."""
        if not self._copies:
            return
        index, scale = 0, painter.deviceTransform().m11()
        while scale <= 0.5 and self._copy(index).shape[1] >= 2 * _SMALLEST:
            index, scale = index + 1, 2.0 * scale
        if index not in self._images:
            self._images[index] = _image_around(self._copy(index))
        painter.drawImage(self._around, self._images[index])

    def _copy(self, index: int) -> Bytes:
        """Return a copy of the pixels, halved in size `index` times."""
        while len(self._copies) <= index:
            rows, columns = self._copies[-1].shape[:2]
            size = (columns // 2, max(rows // 2, 1))
            half = cv2.resize(self._copies[-1], size, interpolation=cv2.INTER_AREA)
            self._copies.append(np.asarray(half, np.uint8))
        return self._copies[index]


def _image_around(pixels: Bytes) -> QImage:
    """Return an image in Qt's fastest format, with an extra half turn on each side."""
    half = pixels.shape[1] // 2
    around = np.concatenate([pixels[:, -half:], pixels, pixels[:, :half]], axis=1)
    formats = QImage.Format
    kinds = {3: formats.Format_RGB888, 4: formats.Format_ARGB32_Premultiplied}
    kind = formats.Format_Grayscale8 if pixels.ndim == 2 else kinds[pixels.shape[2]]
    image = QImage(around.data, around.shape[1], around.shape[0], around.strides[0], kind)
    if pixels.ndim == 3 and pixels.shape[2] == 4:
        return image.copy()
    return image.convertToFormat(formats.Format_RGB32)


class Hatching(QGraphicsItem):
    """Black-and-white hatching with a black edge over clipped areas.

    The hatching and the edge are equally wide at any zoom.
    """

    def __init__(self) -> None:
        super().__init__()
        self._outlines: list[tuple[QRectF, QPainterPath]] = []
        self.setFlag(self.GraphicsItemFlag.ItemUsesExtendedStyleOption)

    def set_clipped(self, clipped: NDArray[Any] | None) -> None:
        """Set the hatched areas.

        Args:
            clipped: (h, w) array of any size. It is either bool, True for each clipped texel, or
                float, giving the clipped fraction of each texel from 0 to 1. If it is None, nothing
                is hatched.
        """
        self._outlines = [] if clipped is None else _outlines(clipped)
        self.update()

    def boundingRect(self) -> QRectF:
        """Return the area of the panorama plus half a turn on each side."""
        return QRectF(-360.0, -90.0, 720.0, 180.0)

    def paint(
        self, painter: QPainter, option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Paint the edges and the hatching, even in areas thinner than a pixel."""
        path = QPainterPath()
        for area, outline in self._outlines:
            if area.intersects(option.exposedRect):
                path.addPath(outline)
        if path.isEmpty():
            return
        transform = painter.deviceTransform()
        ratio = self._ratio(painter)
        lines = QBrush(_tile(max(round(_PERIOD * ratio), 4)))
        lines.setTransform(QTransform.fromScale(1.0 / transform.m11(), 1.0 / transform.m22()))
        # Antialiased edges would take ten times as long.
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, False)
        for brush, width in ((QBrush(_INK), 3.0), (lines, 1.0)):
            pen = QPen(brush, width * ratio, j=Qt.PenJoinStyle.BevelJoin)
            pen.setCosmetic(True)
            painter.strokePath(path, pen)
        painter.fillPath(path, lines)

    def _ratio(self, painter: QPainter) -> float:
        """Return the number of device pixels per logical pixel, ignoring the scene's own scale."""
        return painter.deviceTransform().m11() / max(self.sceneTransform().m11(), 1e-9)


def _outlines(clipped: NDArray[Any]) -> list[tuple[QRectF, QPainterPath]]:
    """Return the outlines of the clipped areas in degrees, with an extra half turn on each side.

    Returns:
        list of (QRectF, QPainterPath). For each piece, the area that the edge may cover, and the
        path of the piece including any holes.
    """
    mask = np.asarray(np.asarray(clipped, np.float32) > _CLIPPED, np.uint8)
    if not mask.any():
        return []
    mask = _joined(mask)
    rows, columns = mask.shape
    half = columns // 2
    around = np.concatenate([mask[:, -half:], mask, mask[:, :half]], axis=1)
    # Contours run through pixel centres, so halve the texels to keep every outline non-empty.
    large = cv2.resize(around, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    contours, tree = cv2.findContours(large, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_TC89_L1)
    unit, corner = (180.0 / columns, 90.0 / rows), (180.0 + half * 360.0 / columns, 90.0)
    paths: dict[int, QPainterPath] = {}
    for index, contour in enumerate(contours):
        parent = int(tree[0, index, 3])
        path = paths.setdefault(index if parent < 0 else parent, QPainterPath())
        points = ((contour[:, 0] + 0.5) * unit - corner).tolist()
        path.addPolygon(QPolygonF([QPointF(*point) for point in points]))
        path.closeSubpath()
    return [(path.boundingRect().adjusted(-1, -1, 1, 1), path) for path in paths.values()]


def _joined(mask: Bytes) -> Bytes:
    """Close the gaps between nearby specks, which would otherwise look like noise."""
    reach = round(mask.shape[1] * _GAP)
    if reach < 1:
        return mask
    size = 2 * reach + 1
    round_ = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    around = np.concatenate([mask[:, -size:], mask, mask[:, :size]], axis=1)
    closed = cv2.morphologyEx(around, cv2.MORPH_CLOSE, round_)
    return np.ascontiguousarray(closed[:, size:-size], np.uint8)


def _tile(side: int) -> QPixmap:
    """Return one period of slanted white lines on black, measured in device pixels."""
    tile = QPixmap(side, side)
    tile.fill(_INK)
    painter = QPainter(tile)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(_PAPER, side / 2.0 * 0.5**0.5))
    for start in (-side, 0, side):
        painter.drawLine(QPointF(start - side, 2.0 * side), QPointF(start + 2.0 * side, -side))
    painter.end()
    return tile
