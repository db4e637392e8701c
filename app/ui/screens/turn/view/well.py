"""A well for pictures that change many times a second: drawn as they are, without copying."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRect, QRectF, QSize, Qt
from PySide6.QtGui import QFontMetrics, QImage, QPainter, QPainterPath, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.ui.theme import theme
from app.ui.widgets.paint import box, draw_tag

if TYPE_CHECKING:
    from PySide6.QtGui import QColor

Bytes: TypeAlias = NDArray[np.uint8]

_RADIUS: Final = 8
_INSET: Final = 12
_DIM: Final = 0.42


class Well(QWidget):
    """Shows an array that has its own size in device pixels already."""

    def __init__(self, name: str, edge: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._edge = edge
        self._picture: Bytes | None = None
        self._tag, self._message, self._dim = "", "", False

    def set_picture(self, picture: Bytes | None) -> None:
        """Show a picture.

        Parameters
        ----------
        picture : (h, w, 3) uint8 or None
            sRGB; not to be written to afterwards.
        """
        if picture is not self._picture:
            self._picture = None if picture is None else np.ascontiguousarray(picture)
            self.update()

    def set_words(self, tag: str, message: str, dim: bool) -> None:
        """Write on the picture."""
        if (tag, message, dim) != (self._tag, self._message, self._dim):
            self._tag, self._message, self._dim = tag, message, dim
            self.setAccessibleDescription(f"{tag} {message}".strip())
            self.update()

    @property
    def picture(self) -> Bytes | None:
        """What it shows."""
        return self._picture

    @property
    def message(self) -> str:
        """What is written over it."""
        return self._message

    @property
    def dim(self) -> bool:
        """Whether the picture is shown as an old one."""
        return self._dim

    def minimumSizeHint(self) -> QSize:
        """Give a size at which something can be seen."""
        return QSize(theme().px(96), theme().px(54))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint picture, words and edge."""
        t = theme()
        painter = QPainter(self)
        painter.fillRect(self.rect(), t.c.well)
        self._paint_picture(painter)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._tag:
            inset = t.px(_INSET)
            draw_tag(painter, inset, inset, self._tag, "tl", t.c.tag, t.c.ontag)
        if self._message:
            self._paint_message(painter)
        self._paint_corners(painter)
        edge: QColor = getattr(t.c, self._edge)
        width = 3 if t.contrast else 2
        box(painter, self.rect(), t.px(_RADIUS), None, edge, width)

    def _paint_picture(self, painter: QPainter) -> None:
        picture = self._picture
        if picture is None:
            return
        rows, columns = picture.shape[:2]
        kind = QImage.Format.Format_RGB888
        image = QImage(picture.data, columns, rows, picture.strides[0], kind)
        ratio = self.devicePixelRatioF()
        whole = (round(self.width() * ratio), round(self.height() * ratio)) == (columns, rows)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, not whole)
        painter.setOpacity(_DIM if self._dim else 1.0)
        painter.drawImage(QRectF(self.rect()), image, QRectF(0, 0, columns, rows))
        painter.setOpacity(1.0)

    def _paint_message(self, painter: QPainter) -> None:
        t = theme()
        flags = int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignLeft)
        message = self._message.replace(" o’clock", "\u00a0o’clock")  # one word, so to speak
        # Where the picture is small, smaller letters, and then the first sentence alone.
        for size, edge, said in (
            (14, _INSET, message),
            (12, 4, message),
            (12, 4, message.partition(". ")[0]),
        ):
            inset, padding = t.px(edge), t.px(min(edge, 10))
            font = t.font(size, 500)
            room = QRect(0, 0, self.width() - 2 * inset - 2 * padding, self.height())
            words = QFontMetrics(font).boundingRect(room, flags, said)
            message = said
            if words.height() + 2 * (padding + inset) <= self.height():
                break
        high = min(words.height() + 2 * padding, self.height() - 2 * inset)
        wide = words.width() + 2 * padding
        plate = QRect(inset, self.height() - inset - high, wide, high)
        box(painter, plate, t.px(6), t.c.tag)
        painter.setFont(font)
        painter.setPen(t.c.ontag)
        inside = plate.adjusted(padding, padding, -padding, -padding)
        painter.drawText(inside.adjusted(0, 0, 2, 2), flags, message)

    def _paint_corners(self, painter: QPainter) -> None:
        """Cover the corners: clipping to a round shape would leave them jagged."""
        t = theme()
        corners = QPainterPath()
        corners.addRect(QRectF(self.rect()))
        inner = QPainterPath()
        inner.addRoundedRect(QRectF(self.rect()), t.px(_RADIUS), t.px(_RADIUS))
        painter.fillPath(corners.subtracted(inner), t.c.bg)
