"""What a style asks of a place: its weights laid over the panorama, turning with the sitter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QImage, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import wrap
from app.core.text.turns import turn_words
from app.ui.theme import theme
from app.ui.widgets.plots.base import TurnPlot, draw_label, label_area, snap
from app.ui.widgets.plots.mapping import Viewport

if TYPE_CHECKING:
    from PySide6.QtGui import QMouseEvent
    from PySide6.QtWidgets import QWidget

Bytes: TypeAlias = NDArray[np.uint8]

_RADIUS: Final = 6
_SHADE: Final = 0.72  # how bright the grey panorama stays: weights are what is to be seen
_STRONGEST: Final = 0.80  # opacity of the largest weight: the place still shows through
_GAMMA: Final = 0.8
_DOTS: Final = (2.0, 2.0)


def dimmed(picture: Bytes, columns: int) -> Bytes:
    """Make a panorama grey and darker, and move its columns.

    Parameters
    ----------
    picture : NDArray[np.uint8], (h, w, 3)
        sRGB.
    columns : int
        How many columns everything moves to the left; what leaves comes in at the right.

    Returns
    -------
    NDArray[np.uint8], (h, w)
        Grey, sRGB bytes.
    """
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    table = np.round(np.arange(256) * _SHADE).astype(np.uint8)
    return np.roll(np.asarray(cv2.LUT(grey, table), np.uint8), -columns, axis=1)


def tinted(
    target: NDArray[np.floating[Any]], plus: tuple[int, ...], minus: tuple[int, ...]
) -> Bytes:
    """Colour a pre-integrated target: more opaque where light counts more.

    Parameters
    ----------
    target : (H, W) float
        F of eq. 3 for turn 0, any scale; positive where light helps.
    plus, minus : tuple of int
        sRGB of positive and negative weights.

    Returns
    -------
    NDArray[np.uint8], (H, W, 4)
        Blue, green, red, opacity; colours multiplied by opacity, as Qt blends them fastest.
    """
    values = np.nan_to_num(np.asarray(target, np.float32), posinf=0.0, neginf=0.0)
    largest = float(np.abs(values).max(initial=0.0))
    share = np.abs(values) / largest if largest > 0.0 else np.zeros_like(values)
    opacity = _STRONGEST * share**_GAMMA
    colours = np.array([(*plus[::-1], 255), (*minus[::-1], 255)], np.float32)
    chosen = colours[(values < 0.0).astype(np.intp)]
    return np.asarray(chosen * opacity[..., np.newaxis] + 0.5, np.uint8)


def enlarged(tint: Bytes, width: int, height: int) -> Bytes:
    """Enlarge a panorama of texels smoothly; its left and right edge meet without a seam.

    Parameters
    ----------
    tint : NDArray[np.uint8], (H, W, 4)
        As from `tinted`.
    width, height : int
        Device pixels wanted.

    Returns
    -------
    NDArray[np.uint8], (height, width, 4)
        Bilinear between the middles of the texels.
    """
    rows, columns = tint.shape[:2]
    wide = np.pad(tint, ((1, 1), (1, 1), (0, 0)), mode="wrap")
    wide[0], wide[-1] = wide[1], wide[-2]
    across, down = columns / width, rows / height
    # Pixel i has its middle at (i + 0.5) texels; the padding moves everything by one.
    matrix = np.array([[across, 0.0, 0.5 * across + 0.5], [0.0, down, 0.5 * down + 0.5]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    shown = cv2.warpAffine(
        wide, matrix, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(shown, np.uint8)


class WeightPanorama(TurnPlot):
    """The panorama of a place with the weights of a style, turned as the sitter is.

    Its middle is where the photographer stands at turn 0. A solid line marks where the sitter
    faces, a dotted one what is behind them. Dragging moves the sitter; arrows 1°, Shift 10°.

    Parameters
    ----------
    size : (int, int), optional
        Size that it would like to have, logical pixels at scale 1; 2:1.
    """

    def __init__(
        self,
        name: str = "What the style asks of this place",
        size: tuple[int, int] = (272, 136),
        sitter: str = "Sitter",
        behind: str = "Behind",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(name, parent)
        self._size = size
        self._words = (sitter, behind)
        self._picture: Bytes | None = None
        self._front = 0.0
        self._tint: Bytes | None = None
        self._version = [0, 0]
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.describe()

    def sizeHint(self) -> QSize:
        """Return the size that the design asks for, at the scale of the theme."""
        return QSize(theme().px(self._size[0]), theme().px(self._size[1]))

    def set_picture(self, picture: Bytes | None, front_deg: float = 0.0) -> None:
        """Show another place.

        Parameters
        ----------
        picture : NDArray[np.uint8], (h, w, 3), or None
            Panorama, sRGB.
        front_deg : float, optional
            Panorama azimuth at which the photographer stands, deg: it comes to the middle.
        """
        if picture is self._picture and front_deg == self._front:
            return
        self._picture, self._front = picture, front_deg
        self._version[0] += 1
        self.update()

    def set_target(self, target: NDArray[np.floating[Any]] | None) -> None:
        """Show other weights.

        Parameters
        ----------
        target : (H, W) float or None
            Pre-integrated target F (eq. 3) of turn 0, any scale; 64 x 32 texels.
        """
        c = theme().c
        plus, minus = ((each.red(), each.green(), each.blue()) for each in (c.plus, c.minus))
        self._tint = None if target is None else tinted(target, plus, minus)
        self._version[1] += 1
        self.update()

    def set_turn(self, turn_deg: float, best_deg: float | None = None) -> None:
        """Turn the sitter, without a signal.

        Parameters
        ----------
        turn_deg : float
            Turn, deg: the weights of azimuth a are then shown at a + turn.
        """
        if best_deg is not None:
            self._best = wrap(best_deg)
        self.set_needle(turn_deg)

    def describe(self) -> None:
        """Put into words where the sitter faces."""
        self.say(
            f"The sitter faces {turn_words(self._needle)}, the background is "
            f"{turn_words(self._needle + 180.0)}. Orange: light helps. Blue: light harms."
            if self._needle
            else "The sitter faces the photographer’s first place. "
            "Orange: light helps. Blue: light harms."
        )

    @property
    def view(self) -> Viewport:
        """The whole panorama, its middle at turn 0."""
        return Viewport(float(self.width()))

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the panorama, the weights at their turn, and the two lines."""
        base = self.kept("base", self._version[0], self.size(), ratio, self._draw_base)
        painter.drawPixmap(0, 0, base)
        clip = QPainterPath()
        clip.addRoundedRect(QRectF(self.rect()), theme().px(_RADIUS), theme().px(_RADIUS))
        painter.setClipPath(clip)
        if self._tint is not None and self._picture is not None:
            self._draw_weights(painter, ratio)
        if self._picture is not None:
            self._draw_lines(painter, ratio)
        painter.setClipping(False)

    def _draw_base(self, painter: QPainter) -> None:
        t, area = theme(), QRectF(self.rect())
        shape = QPainterPath()
        shape.addRoundedRect(area, t.px(_RADIUS), t.px(_RADIUS))
        painter.fillPath(shape, t.c.well)
        if self._picture is None:
            return
        pixels = painter.device()
        size = (max(pixels.width(), 1), max(pixels.height(), 1))
        small = np.asarray(cv2.resize(self._picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        grey = np.ascontiguousarray(dimmed(small, round(self._front * size[0] / 360.0)))
        image = QImage(grey.data, *size, size[0], QImage.Format.Format_Grayscale8)
        painter.setClipPath(shape)
        painter.drawImage(area, image)

    def _draw_weights(self, painter: QPainter, ratio: float) -> None:
        """Lay the enlarged weights over the panorama, wrapped around its edge."""
        pixmap = self.kept("tint", self._version[1], self.size(), ratio, self._draw_tint)
        offset = round(self._needle * self.width() / 360.0 * ratio) / ratio
        left = offset % self.width()
        painter.drawPixmap(QPointF(left, 0.0), pixmap)
        if left > 0.0:
            painter.drawPixmap(QPointF(left - self.width(), 0.0), pixmap)

    def _draw_tint(self, painter: QPainter) -> None:
        pixels = painter.device()
        if self._tint is None:
            return
        shown = enlarged(self._tint, pixels.width(), pixels.height())
        kind = QImage.Format.Format_ARGB32_Premultiplied
        image = QImage(shown.data, pixels.width(), pixels.height(), shown.strides[0], kind)
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_Source)
        painter.drawImage(QRectF(self.rect()), image)

    def _draw_lines(self, painter: QPainter, ratio: float) -> None:
        sitter, behind = self._words
        taken = self._draw_line(painter, ratio, self._needle, sitter, QRectF(), dotted=False)
        self._draw_line(painter, ratio, self._needle + 180.0, behind, taken, dotted=True)

    def _draw_line(
        self,
        painter: QPainter,
        ratio: float,
        turn_deg: float,
        words: str,
        taken: QRectF,
        *,
        dotted: bool,
    ) -> QRectF:
        """Draw a line and its tag, below the other tag where they would meet."""
        if not words:
            return QRectF()
        t = theme()
        for place in self.view.xs_of(turn_deg, 2.0):
            x = snap(place, ratio, 2.0)
            ends = (QPointF(x, 0.0), QPointF(x, float(self.height())))
            flat = Qt.PenCapStyle.FlatCap
            painter.setPen(QPen(t.c.tag, 4.0, Qt.PenStyle.SolidLine, flat))
            painter.setOpacity(0.7)
            painter.drawLine(*ends)
            painter.setOpacity(1.0)
            pen = QPen(t.c.ontag, 2.0, Qt.PenStyle.SolidLine, flat)
            if dotted:
                pen.setDashPattern(list(_DOTS))
            painter.setPen(pen)
            painter.drawLine(*ends)
        area = self._tag_area(self.view.x_of(turn_deg), words, taken)
        draw_label(painter, (area.x(), area.y()), words)
        return area

    def _tag_area(self, x: float, words: str, taken: QRectF) -> QRectF:
        """Place a tag beside its line: to the right where there is room, else to the left."""
        t = theme()
        gap = t.px(6)
        area = label_area((x + gap, gap), words)
        if area.right() > self.width() - gap:
            area.moveRight(round(x - gap))
        if area.intersects(taken.adjusted(-gap, 0, gap, 0)):
            area.moveTop(taken.bottom() + t.px(4))
        return area

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Turn the sitter toward the pointer."""
        if event.button() == Qt.MouseButton.LeftButton and self._picture is not None:
            self.begin_drag(self.view.azimuth_at(event.position().x()))
        else:
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Lead the sitter."""
        if self._dragging:
            self.turn_to(self.view.azimuth_at(event.position().x()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the sitter."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.end_drag()
        super().mouseReleaseEvent(event)
