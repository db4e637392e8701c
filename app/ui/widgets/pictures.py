"""Pictures in a well: cropped to fill, with round corners, at the screen's own resolution."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QPixmap
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.widgets.paint import box
from app.ui.widgets.tags import Anchor, draw_tag, tag_size

if TYPE_CHECKING:
    from numpy.typing import NDArray

Corner: TypeAlias = Literal["tl", "tr", "bl", "br"]

_TAG_INSET: Final = 8


def to_image(picture: NDArray[np.uint8]) -> QImage:
    """Copy an array into an image that Qt can paint.

    Parameters
    ----------
    picture : ndarray, (h, w, 3) uint8
        sRGB, row 0 on top.

    Raises
    ------
    ValueError
        When the array has another shape or type.
    """
    if picture.ndim != 3 or picture.shape[2] != 3 or picture.dtype != np.uint8:
        raise ValueError(f"not an (h, w, 3) uint8 picture: {picture.shape} {picture.dtype}")
    rows = np.ascontiguousarray(picture)
    height, width = rows.shape[:2]
    shared = QImage(rows.data, width, height, 3 * width, QImage.Format.Format_RGB888)
    return shared.copy()


class Picture(QWidget):
    """A picture, cropped to fill the place it has."""

    def __init__(self, name: str, radius: int = 6) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._radius = theme().px(radius)
        self._array: NDArray[np.uint8] | None = None
        self._image: QImage | None = None
        self._ready: tuple[tuple[Any, ...], QPixmap] | None = None
        self._tags: dict[Corner, str] = {}

    def set_picture(self, picture: NDArray[np.uint8] | None) -> None:
        """Show a picture.

        Parameters
        ----------
        picture : ndarray, (h, w, 3) uint8, or None
            sRGB; None leaves the well empty. The array must not be changed afterwards.

        Raises
        ------
        ValueError
            When the array has another shape or type.
        """
        if picture is not None and picture is self._array:
            return
        self._image = None if picture is None else to_image(picture)
        self._array = picture
        self._changed()

    def set_tag(self, text: str, corner: Corner = "bl") -> None:
        """Put a label into a corner."""
        if self._tags.get(corner, "") != text:
            self._tags[corner] = text
            self.update()

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        return QSize(theme().px(94), theme().px(68))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        return QSize(theme().px(24), theme().px(16))

    def _changed(self) -> None:
        self._ready = None
        self.update()

    def _prepare(self, dpr: float) -> QPixmap | None:
        """Crop, scale and round the picture once for this size."""
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
        # Clipping to a path leaves jagged corners; a painted mask does not.
        mask = QImage(image.size(), QImage.Format.Format_ARGB32_Premultiplied)
        mask.fill(Qt.GlobalColor.transparent)
        painter = QPainter(mask)
        box(painter, mask.rect(), radius, QColor(Qt.GlobalColor.white))
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceIn)
        painter.drawImage(QPointF(0, 0), image)
        painter.end()
        return QPixmap.fromImage(mask)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        box(painter, self.rect(), self._radius, t.c.well)
        pixmap = self._prepare(painter.deviceTransform().m11())
        if pixmap is not None:
            painter.drawPixmap(QPointF(0, 0), pixmap)
        self._paint_tags(painter)

    def _paint_tags(self, painter: QPainter) -> None:
        usual = theme().px(_TAG_INSET)
        for corner, text in self._tags.items():
            if text:
                # A long tag on a small picture comes nearer to the edge before it is cut.
                inset = max(min(usual, (self.width() - tag_size(text)[0]) // 2), 0)
                area = QRectF(self.rect()).adjusted(inset, usual, -inset, -usual)
                x = area.left() if "l" in corner else area.right()
                y = area.top() if "t" in corner else area.bottom()
                anchor: Anchor = corner
                draw_tag(painter, x, y, text, anchor)
