"""The light that a style needs: weights over the panorama, and the key to the weights' colours."""

from __future__ import annotations

from typing import Any, Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFontMetricsF,
    QLinearGradient,
    QMouseEvent,
    QPainter,
    QResizeEvent,
)
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.text import tr
from app.ui.plots.parts.base import Plot, TurnPlot, draw_label, draw_text, label_area, snap
from app.ui.plots.parts.curve_items import around
from app.ui.plots.parts.geometry import Point
from app.ui.plots.parts.layers import PanoramaLayer
from app.ui.plots.parts.mapping import Viewport
from app.ui.plots.parts.panorama_scale import draw_corners
from app.ui.theme import px, theme
from app.ui.widgets.paint import box, faint, pen
from app.words.phrases.turns import turn_words

WeightSign: TypeAlias = Literal["plus", "minus"]

_GREY: Final = QColor(0x6E, 0x6E, 0x6E)
_GAP: Final = 12


def draw_sign(painter: QPainter, area: QRectF, sign: WeightSign) -> None:
    """Draw the tile of a weight, aligned with pixels.

    The tile is orange with a plus sign or blue with a minus sign.
    """
    t = theme()
    box(painter, area, px(3), t.c.plus if sign == "plus" else t.c.minus)
    arm = area.width() * 0.22
    ratio = max(painter.deviceTransform().m11(), 0.25)
    width = max(area.width() / 10.0, 1.5)
    x, y = snap(area.center().x(), ratio, width), snap(area.center().y(), ratio, width)
    painter.setPen(pen(Qt.GlobalColor.black, width))
    painter.drawLine(QPointF(x - arm, y), QPointF(x + arm, y))
    if sign == "plus":
        painter.drawLine(QPointF(x, y - arm), QPointF(x, y + arm))


class WeightScale(Plot):
    """A bar from blue through grey to orange, with labels and tiles at its ends."""

    policies = (QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def __init__(self) -> None:
        super().__init__(
            tr("Weights: blue and minus should be darker, orange and plus should be brighter")
        )
        self._words = (tr("should be darker"), tr("should be brighter"))
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def sizeHint(self) -> QSize:
        """Return the design size at the theme's scale."""
        return QSize(680, px(20))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size."""
        metrics = QFontMetricsF(theme().font(12))
        words = sum(metrics.horizontalAdvance(each) for each in self._words)
        return QSize(round(words) + px(2 * 20 + 4 * _GAP + 48), px(20))

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the tiles, the labels and the bar."""
        t = theme()
        side, gap = float(px(20)), float(px(_GAP))
        y, middle = (self.height() - side) / 2.0, self.height() / 2.0
        draw_sign(painter, QRectF(0.0, round(y), side, side), "minus")
        draw_sign(painter, QRectF(self.width() - side, round(y), side, side), "plus")
        font = t.font(12)
        left = side + gap
        left += draw_text(painter, (left, middle), self._words[0], font, t.c.dim, 0.0) + gap
        right = self.width() - side - gap
        right -= draw_text(painter, (right, middle), self._words[1], font, t.c.dim, 1.0) + gap
        height = px(12)
        bar = QRectF(left, round(middle - height / 2.0), max(right - left, 0.0), height)
        gradient = QLinearGradient(bar.topLeft(), bar.topRight())
        for place, colour in ((0.0, t.c.minus), (0.5, _GREY), (1.0, t.c.plus)):
            gradient.setColorAt(place, colour)
        box(painter, bar, height / 2.0, gradient)


class WeightLegend(Plot):
    """Two labelled tiles that explain orange and blue on a panorama."""

    policies = (QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def __init__(self) -> None:
        super().__init__(tr("Orange and plus: light helps. Blue and minus: light hurts"))
        self._words: tuple[tuple[WeightSign, str], ...] = (
            ("plus", tr("light helps")),
            ("minus", tr("light hurts")),
        )
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def sizeHint(self) -> QSize:
        """Return the size of the labels."""
        metrics = QFontMetricsF(theme().font(12))
        words = sum(metrics.horizontalAdvance(each) for _, each in self._words)
        return QSize(round(words) + px(2 * (16 + 6) + 16) + 2, px(16))

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the tiles and the labels."""
        t = theme()
        side, x = float(px(16)), 0.0
        top = round((self.height() - side) / 2.0)
        for sign, words in self._words:
            draw_sign(painter, QRectF(round(x), top, side, side), sign)
            x = round(x) + side + px(6)
            place = (x, self.height() / 2.0)
            x += draw_text(painter, place, words, t.font(12), t.c.dim, 0.0) + px(16)


_RADIUS: Final = 6
_SHADE: Final = 0.72  # brightness of the grey panorama under the weights
_STRONGEST: Final = 0.80  # opacity of the largest weight, low enough to keep the place visible
_GAMMA: Final = 0.8
_DOTS: Final = (2.0, 2.0)


def dimmed(picture: Bytes) -> Bytes:
    """Convert a panorama, (h, w, 3) uint8 sRGB, to darkened greyscale, (h, w) uint8."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    table = np.round(np.arange(256) * _SHADE).astype(np.uint8)
    return np.asarray(cv2.LUT(grey, table), np.uint8)


def tinted(
    target: NDArray[np.floating[Any]], plus: tuple[int, ...], minus: tuple[int, ...]
) -> Bytes:
    """Colour a pre-integrated target, with more opacity where light has more effect.

    Args:
        target: (H, W) float. F of eq. 3 for turn 0, on an arbitrary scale, positive where light
            helps.
        plus, minus: sRGB colours for positive and negative weights.

    Returns:
        (H, W, 4) uint8. Premultiplied blue, green and red, followed by opacity. Qt blends this
        format fastest.
    """
    values = np.nan_to_num(np.asarray(target, np.float32), posinf=0.0, neginf=0.0)
    largest = float(np.abs(values).max(initial=0.0))
    share = np.abs(values) / largest if largest > 0.0 else np.zeros_like(values)
    opacity = _STRONGEST * share**_GAMMA
    colours = np.array([(*plus[::-1], 255), (*minus[::-1], 255)], np.float32)
    inks = colours[(values < 0.0).astype(np.intp)]
    return np.asarray(inks * opacity[..., np.newaxis] + 0.5, np.uint8)


class WeightPanorama(TurnPlot):
    """The panorama of a place with the weights of a style, which turn with the sitter.

    The centre of the panorama is the photographer's position at turn 0. A solid line marks the
    direction that the sitter faces, and a dotted line marks the background behind them. Dragging
    turns the sitter. The arrow keys turn the sitter by 1°, or by 10° with Shift.
    """

    policies = (QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def __init__(
        self,
        name: str = tr("What the style needs here"),
        size: tuple[int, int] = (272, 136),
        sitter: str = tr("Sitter"),
        behind: str = tr("Behind"),
    ) -> None:
        super().__init__(name)
        self.preferred_size = size
        self._words = (sitter, behind)
        self._picture: Bytes | None = None
        self._front = 0.0
        self._place = self.panel.add(PanoramaLayer())
        self._weights = self.panel.add(PanoramaLayer())
        c = theme().c
        edge = pen(faint(c.tag, 0.7), 4.0)
        self._sitter = self.panel.add(around(edge, pen(c.ontag, 2.0)))
        self._behind = self.panel.add(around(edge, pen(c.ontag, 2.0, _DOTS)))
        self._sitter.setVisible(bool(sitter))
        self._behind.setVisible(bool(behind))
        self._behind.setX(180.0)
        self.panel.hide()
        self.describe()

    def set_picture(self, picture: Bytes | None, front_deg: float = 0.0) -> None:
        """Show the panorama of a different place, centred on the given azimuth.

        The picture is (h, w, 3) uint8 sRGB.
        """
        if picture is self._picture and front_deg == self._front:
            return
        self._picture, self._front = picture, front_deg
        self._place.set_pixels(None if picture is None else dimmed(picture))
        self._place.setX(-wrap(front_deg))
        self.panel.setVisible(picture is not None)
        self.update()

    def set_target(self, target: NDArray[np.floating[Any]] | None) -> None:
        """Show different weights, which are the pre-integrated F of eq. 3 for turn 0.

        The array is (H, W), on an arbitrary scale.
        """
        c = theme().c
        plus, minus = ((each.red(), each.green(), each.blue()) for each in (c.plus, c.minus))
        self._weights.set_pixels(None if target is None else tinted(target, plus, minus))
        self.update()

    def set_needle(self, turn_deg: float) -> None:
        """Turn the sitter and the weights without emitting a signal."""
        super().set_needle(turn_deg)
        self._weights.setX(self.needle)
        self._sitter.setX(self.needle)
        self._behind.setX(wrap(self.needle + 180.0))

    def set_turn(self, turn_deg: float, best_deg: float | None = None) -> None:
        """Turn the sitter without emitting a signal.

        The weights at azimuth a move to azimuth a + turn.
        """
        if best_deg is not None:
            self._best = wrap(best_deg)
        self.set_needle(turn_deg)

    def describe(self) -> None:
        """Describe the direction of the sitter for screen readers."""
        self.say(
            tr(
                "The sitter faces {turn}, and the background is {behind}. Orange: "
                "light helps. Blue: light hurts.",
                turn=turn_words(self.needle),
                behind=turn_words(self.needle + 180.0),
            )
            if self.needle
            else tr(
                "The sitter faces the photographer’s starting position. Orange: light helps. "
                "Blue: light hurts."
            )
        )

    @property
    def view(self) -> Viewport:
        """The whole panorama, centred on turn 0."""
        return Viewport(float(self.width()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show the whole panorama at every size."""
        super().resizeEvent(event)
        self.panel.look(self.view)

    def draw(self, painter: QPainter, _ratio: float) -> None:
        """Paint an empty well if there is no place."""
        if self._picture is None:
            box(painter, self.rect(), px(_RADIUS), theme().c.well)

    def draw_over(self, painter: QPainter, _ratio: float) -> None:
        """Paint the labels of the lines.

        The second label is placed below the first if they would otherwise overlap.
        """
        box = QRectF()
        for words, turn in zip(self._words, (self.needle, self.needle + 180.0), strict=True):
            if words:
                box = self._tag_area(self.view.x_of(turn), words, box)
                draw_label(painter, (box.x(), box.y()), words)
        draw_corners(painter, self.rect(), theme().c.panel)

    def _tag_area(self, x: float, words: str, box: QRectF) -> QRectF:
        """Return the area of a label, which is to the right of its line if there is room.

        Otherwise, the label is to the left of its line.
        """
        gap = px(6)
        area = label_area((x + gap, gap), words)
        if area.right() > self.width() - gap:
            area.moveRight(round(x - gap))
        if area.intersects(box.adjusted(-gap, 0, gap, 0)):
            area.moveTop(box.bottom() + px(4))
        return area

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Turn the sitter towards the pointer."""
        if event.button() == Qt.MouseButton.LeftButton and self._picture is not None:
            self.begin_drag(self.turn_under((event.position().x(), 0.0)))
        else:
            super().mousePressEvent(event)

    def turn_under(self, point: Point) -> float:
        """Return the azimuth in degrees at a pointer position."""
        return self.view.azimuth_at(point[0])
