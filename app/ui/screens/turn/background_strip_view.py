"""The background strip. It is painted directly to keep its frames, arrow and tags apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFontMetricsF,
    QImage,
    QKeyEvent,
    QPainter,
    QPainterPath,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy

from app.core.base.arrays import Bytes
from app.core.text import tr
from app.ui.plots.parts.base import Plot, arrow_step, draw_label, draw_text, label_area, snap
from app.ui.plots.parts.geometry import spread
from app.ui.plots.parts.mapping import StripScale
from app.ui.screens.turn.background_strip import Scale
from app.ui.theme import Theme, px, theme
from app.ui.widgets.paint import box, pen

_HEIGHT: Final = 220
_SCALE: Final = 64
_DARKER: Final = 0.42
_TICKS_DEG: Final = 15
_ROOM_DEG: Final = 14.0
_GOAL: Final = tr("Goal")
_NOW: Final = tr("Camera now")
_NEAREST_DEG: Final = 5.0  # minimum distance that leaves room for an arrow


class BackgroundStrip(Plot):
    """A strip showing 150° of background around the goal, above a scale of the remaining turn."""

    policies = (QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    stepped = Signal(float)
    """Emitted for an arrow key with a step of 1°, or 10° with Shift. Clockwise is positive."""

    def __init__(self) -> None:
        super().__init__(tr("Background of this place"))
        self._state: Scale | None = None
        self._picture: Bytes | None = None
        self._version = 0

    def sizeHint(self) -> QSize:
        """Return the designed size at the theme's scale."""
        return QSize(824, _HEIGHT + px(_SCALE))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest size at which the labels are readable."""
        return QSize(320, px(120 + _SCALE))

    def set_state(self, state: Scale | None, picture: Bytes | None = None) -> None:
        """Show a state, or an empty strip if the state is None.

        Args:
            picture: The 150° of background centred behind the sitter at the goal, (h, w, 3) uint8
                sRGB, or None until it is rendered.
        """
        if picture is not self._picture:
            self._picture = picture
            self._version += 1
        self._state = state
        self.say(state.description if state else "")
        self.update()

    @property
    def picture_rect(self) -> QRectF:
        """Area of the picture, in logical pixels."""
        height = max(self.height() - px(_SCALE), 1)
        return QRectF(0.0, 0.0, float(self.width()), float(height))

    @property
    def scale(self) -> StripScale:
        """Mapping from turns to positions on the strip at its current width."""
        state = self._state or Scale()
        return StripScale(float(self.width()), state.goal_deg, mirrored=state.mirrored)

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle of the focus ring and its corner radius."""
        return self.picture_rect.toRect(), px(6)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Emit `stepped` when an arrow key is pressed."""
        if step := arrow_step(event):
            # The camera's frame moves in the direction of the arrow.
            across = -step[0] if self.scale.mirrored else step[0]
            self.stepped.emit(across + step[1])
        else:
            super().keyPressEvent(event)

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the picture, the frames and the scale."""
        t, state = theme(), self._state
        area = self.picture_rect
        size = QSize(self.width(), round(area.height()))
        painter.drawPixmap(
            0, 0, self.cached_picture("picture", self._version, size, ratio, self._draw_picture)
        )
        if state is None:
            return
        if self._picture is not None:
            self._draw_dark(painter, state)
            painter.setClipRect(area)
            self._draw_goal(painter, t, state)
            self._draw_now(painter, t, state)
            self._draw_arrow(painter, t, state)
            self._draw_tags(painter, t, state)
            painter.setClipping(False)
        self._draw_scale(painter, ratio, t, state)

    def _draw_picture(self, painter: QPainter) -> None:
        t, area = theme(), self.picture_rect
        shape = QPainterPath()
        shape.addRoundedRect(area, px(6), px(6))
        painter.fillPath(shape, t.c.well)
        if self._picture is None:
            return
        pixels = painter.device()
        picture = _filled(self._picture, pixels.width(), pixels.height())
        kind = QImage.Format.Format_RGB888
        image = QImage(picture.data, pixels.width(), pixels.height(), picture.strides[0], kind)
        painter.setClipPath(shape)
        painter.drawImage(area, image)

    def _frame(self, turn_deg: float, fov_deg: float) -> QRectF:
        left, right = self.scale.frame(turn_deg, fov_deg)
        area = self.picture_rect
        left, right = max(left, -20.0), min(right, area.width() + 20.0)
        return QRectF(round(left), 2.5, round(right) - round(left), area.height() - 5.0)

    def _frames(self, state: Scale) -> list[QRectF]:
        camera = state.frame_deg
        turns = [state.goal_deg] if camera is None else [state.goal_deg, camera]
        frames = [self._frame(turn, state.fov_deg) for turn in turns]
        return [frame for frame in frames if frame.width() > 0.0]

    def _draw_dark(self, painter: QPainter, state: Scale) -> None:
        """Darken the picture outside the two frames."""
        dark = QPainterPath()
        dark.addRoundedRect(self.picture_rect, px(6), px(6))
        for frame in self._frames(state):
            hole = QPainterPath()
            hole.addRoundedRect(frame.adjusted(0, -2.5, 0, 2.5), px(6), px(6))
            dark = dark.subtracted(hole)
        painter.setOpacity(_DARKER)
        painter.fillPath(dark, Qt.GlobalColor.black)
        painter.setOpacity(1.0)

    def _draw_goal(self, painter: QPainter, t: Theme, state: Scale) -> None:
        frame = self._frame(state.goal_deg, state.fov_deg)
        amber = pen(t.c.amberfill, 3.0, (4.0, 2.0))
        _draw_frame(painter, frame, QPen(Qt.GlobalColor.black, 5.0), amber)

    def _draw_now(self, painter: QPainter, t: Theme, state: Scale) -> None:
        if state.frame_deg is None:
            return
        frame = self._frame(state.frame_deg, state.fov_deg)
        if frame.width() > 0.0:
            black, white = QPen(Qt.GlobalColor.black, 7.0), QPen(Qt.GlobalColor.white, 4.0)
            _draw_frame(painter, frame.adjusted(0, 0.5, 0, -0.5), black, white)

    def _draw_arrow(self, painter: QPainter, t: Theme, state: Scale) -> None:
        """Draw the arrow from the current turn to the goal."""
        if state.now_deg is None:
            return
        scale, area = self.scale, self.picture_rect
        start, stop = scale.x_of(state.now_deg), scale.x_of(state.goal_deg)
        way = 1.0 if stop > start else -1.0
        if abs(stop - start) < _NEAREST_DEG * scale.scale:
            return
        # If the camera is beyond the strip, start the arrow past the tag at the edge.
        start = min(max(start, 24.0), area.width() - 24.0)
        y, wing = round(area.height() / 2.0), 15.0
        wing = min(wing, abs(stop - start) / 2.0)
        shaft = QPolygonF([QPointF(start, y), QPointF(stop, y)])
        tip = [QPointF(stop - way * wing, y + side * wing) for side in (-1.0, 1.0)]
        head = QPolygonF([tip[0], QPointF(stop, y), tip[1]])
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for colour, width in ((Qt.GlobalColor.black, 10.0), (t.c.amberfill, 5.0)):
            painter.setPen(pen(colour, width, ends="round"))
            painter.drawPolyline(shaft)
            painter.drawPolyline(head)

    def _draw_tags(self, painter: QPainter, t: Theme, state: Scale) -> None:
        """Draw the tags inside their frames, clear of each other."""
        white, black = t.c.ontag, t.c.tag
        goal = self._frame(state.goal_deg, state.fov_deg)
        now_deg = state.now_deg
        right = now_deg is None or self.scale.x_of(now_deg) <= self.scale.x_of(state.goal_deg)
        now = QRectF()
        if now_deg is not None and self.scale.beyond(now_deg):
            now = self._draw_edge(painter, t, state)
        elif now_deg is not None:
            frame = self._frame(state.frame_deg or 0.0, state.fov_deg)
            now = self._tag_area(frame, _NOW, 0.0 if right else 1.0)
            place = (now.x(), now.y())
            draw_label(painter, place, _NOW, fill=white, ink=black, weight=600)
        area = self._tag_area(goal, _GOAL, 1.0 if right else 0.0)
        if area.adjusted(-4, -4, 4, 4).intersects(now):
            area.moveTop(now.bottom() + 4.0)
        place = (area.x(), area.y())
        ink = t.c.onamber
        draw_label(painter, place, _GOAL, fill=t.c.amberfill, ink=ink, weight=600)

    def _tag_area(self, frame: QRectF, words: str, align: float) -> QRectF:
        """Return the area of a tag in an upper corner of a frame's visible part."""
        gap = px(9)
        left = max(frame.left(), 0.0) + gap
        right = min(frame.right(), self.picture_rect.width()) - gap
        area = label_area((right if align else left, frame.top() + gap), words, (align, 0.0), 600)
        if area.left() < left:
            area.moveLeft(left)
        return area

    def _draw_edge(self, painter: QPainter, t: Theme, state: Scale) -> QRectF:
        """Draw a tag with an arrow towards the camera at the edge, and return the tag's area."""
        side = self.scale.beyond(state.now_deg or 0.0)
        area = self.picture_rect
        room, height = px(14), px(28)
        metrics = QFontMetricsF(t.font(12, 600))
        width = round(metrics.horizontalAdvance(_NOW)) + room + px(18)
        x = 0.0 if side < 0 else area.width() - width
        tag = QRectF(x, round((area.height() - height) / 4.0), width, height)
        shape = QPainterPath()
        outer = tag.adjusted(-8.0 if side < 0 else 0.0, 0.0, 8.0 if side > 0 else 0.0, 0.0)
        shape.addRoundedRect(outer, px(4), px(4))
        painter.fillPath(shape, t.c.ontag)
        painter.setPen(QPen(t.c.tag, 1.0))
        painter.drawPath(shape)
        middle = tag.center().y()
        tip = tag.left() + px(8) if side < 0 else tag.right() - px(8)
        wing = px(5)
        painter.setPen(pen(t.c.tag, 2.0, ends="round"))
        back = tip - side * wing
        painter.drawPolyline(
            [QPointF(back, middle - wing), QPointF(tip, middle), QPointF(back, middle + wing)]
        )
        text_x = tag.left() + room + px(8) if side < 0 else tag.right() - room - px(8)
        align = 0.0 if side < 0 else 1.0
        draw_text(painter, (text_x, middle), _NOW, t.font(12, 600), t.c.tag, align)
        return tag

    def _draw_scale(self, painter: QPainter, ratio: float, t: Theme, state: Scale) -> None:
        top = self.picture_rect.bottom() + px(14)
        bar, scale = float(px(12)), self.scale
        box(painter, QRectF(0.0, top, self.width(), bar), bar / 2.0, t.c.track2)
        for left, right in scale.bands(state.arc_deg) if state.arc_deg else []:
            box(painter, QRectF(left, top, right - left, bar), bar / 2.0, t.c.ok)
        markers = [(state.goal_deg, state.goal_words, t.c.amber)]
        if state.now_deg is not None and not scale.beyond(state.now_deg):
            markers.append((state.now_deg, state.now_words, t.c.text))
        words = self._marker_words(t, markers)
        self._draw_ticks(painter, ratio, t, tuple(turn for turn, _, _ in markers), words)
        # Draw "now" last, over the goal's marker.
        for turn, _, colour in markers:
            fill = t.c.amberfill if t.contrast and colour is t.c.amber else colour
            self._draw_marker(painter, ratio, scale.x_of(turn), colour, fill)
        y = self.picture_rect.bottom() + px(50)
        for (_, text, colour), (left, right) in zip(markers, words, strict=True):
            draw_text(painter, ((left + right) / 2.0, y), text, t.font(14, 700), colour)

    def _draw_ticks(
        self,
        painter: QPainter,
        ratio: float,
        t: Theme,
        markers: tuple[float, ...],
        spans: Sequence[tuple[float, float]],
    ) -> None:
        """Draw the scale, omitting any number that would touch a label or another number."""
        apart = float(px(8))
        wide = [(left - apart, right + apart) for left, right in spans]
        bottom = self.picture_rect.bottom()
        for tick in self.scale.ticks(_TICKS_DEG, markers, _ROOM_DEG):
            x = snap(tick.x, ratio, t.line_width)
            painter.setPen(pen(t.c.text, t.line_width))
            top = bottom + px(26)
            painter.drawLine(QPointF(x, top), QPointF(x, top + px(9)))
            half = QFontMetricsF(t.font(14)).horizontalAdvance(tick.label) / 2.0
            free = all(x + half <= left or right <= x - half for left, right in wide)
            if tick.label and free and half <= x <= self.width() - half:
                wide.append((x - half - apart, x + half + apart))
                draw_text(painter, (x, bottom + px(50)), tick.label, t.font(14), t.c.dim)

    def _draw_marker(
        self, painter: QPainter, ratio: float, x: float, edge: QColor, fill: QColor
    ) -> None:
        """Draw an upright bar through the scale, with a gap around it."""
        t = theme()
        width, top = float(px(4)), self.picture_rect.bottom() + px(5)
        middle = snap(x, ratio, width)
        bar = QRectF(middle - width / 2.0, top, width, px(30))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(t.c.bg)
        painter.drawRect(bar.adjusted(-2.0, 0.0, 2.0, 0.0))
        painter.setBrush(fill)
        if fill.rgb() != edge.rgb() and t.contrast:
            painter.setPen(QPen(edge, 2.0))
            bar.adjust(-1.0, 1.0, 1.0, -1.0)
        painter.drawRoundedRect(bar, 1.5, 1.5)

    def _marker_words(
        self, t: Theme, markers: list[tuple[float, str, QColor]]
    ) -> list[tuple[float, float]]:
        """Return the left and right edges of every marker's label."""
        metrics = QFontMetricsF(t.font(14, 700))
        widths = [metrics.horizontalAdvance(words) for _, words, _ in markers]
        places = [self.scale.x_of(turn) for turn, _, _ in markers]
        middles = spread(places, widths, float(px(12)), 0.0, float(self.width()))
        return [
            (middle - width / 2.0, middle + width / 2.0)
            for middle, width in zip(middles, widths, strict=True)
        ]


def _draw_frame(painter: QPainter, frame: QRectF, *pens: QPen) -> None:
    """Draw a frame with each of the pens, one on top of the other."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for one in pens:
        painter.setPen(one)
        painter.drawRoundedRect(frame, 4.0, 4.0)


def _filled(picture: Bytes, width: int, height: int) -> Bytes:
    """Scale a picture to a width, then crop it or repeat its edge rows to fit the height."""
    rows = max(round(picture.shape[0] * width / picture.shape[1]), 1)
    shrink = picture.shape[1] > width
    method = cv2.INTER_AREA if shrink else cv2.INTER_CUBIC
    scaled = np.asarray(cv2.resize(picture, (width, rows), interpolation=method), np.uint8)
    if rows >= height:
        top = (rows - height) // 2
        return np.ascontiguousarray(scaled[top : top + height])
    room = height - rows
    ends = ((room // 2, room - room // 2), (0, 0), (0, 0))
    return np.pad(scaled, ends, mode="edge")
