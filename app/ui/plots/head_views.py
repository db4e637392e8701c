"""Drawings of the lamp around the head, drawn with pyqtgraph in pixels from the head's centre.

One drawing shows the head from above, with the camera at the bottom, and the other shows it from
the side that the lamp is on. Both are drawn to the same scale, using the outlines of the loaded
head. In the view from above, the face points down towards the camera. The sitter's left is
therefore on the right, as the camera sees it. In the view from the side, the face points left when
seen from the sitter's left, and right when seen from the sitter's right.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QFont, QPainter, QPen, QResizeEvent

from app.core.base.angles import at_turn, whole, wrap
from app.core.base.arrays import Float32
from app.core.text import tr
from app.ui.plots.lamps import HIGHEST_DEG, Heads, LampPlot, draw_best, draw_lamp
from app.ui.plots.parts.base import device_ratio, draw_text, snap
from app.ui.plots.parts.curve_items import Backdrop, Curve, Mark, Overlay, Pieces
from app.ui.plots.parts.geometry import Point, circle, finely
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import MIDDLE, box, faint, pen, put_text
from app.words.phrases.quantities import metres

_DOT: Final = 24
_RING_SHARE: Final = 0.445  # fraction of the width that leaves room for the dot beside the ring
_DRAWN_M: Final = (0.24, 0.9)  # minimum and maximum distance at which the ring is to scale
_LEVEL_DEG: Final = 3  # an altitude below this is called level
_TITLE: Final = 22
_FLAT: Final = 1.4
_CLOSE_DEG: Final = 24.0  # within this angle of the lamp's line, the light arrow moves aside
_ASIDE: Final = 22
_ARROW: Final = 56  # room beside the head for an arrow with text
_CLEAR: Final = 76  # labels closer to the lamp are hidden
_SIGN: Final = 44  # size of the lamp and of the best position


class _HeadView(LampPlot):
    """The base class of both drawings, each with a scale, a frame, a ring, a head and a lamp."""

    preferred_size = least = (200, 180)
    title = ""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        t, add = theme(), self.panel.add
        wide, strong = t.line_width * t.scale, (t.line_width + 1.0) * t.scale
        dashes, edge = QPen(t.c.dim, wide), QPen(t.c.text, strong)
        dashes.setDashPattern([3.0 * t.scale / wide, 3.0 * t.scale / wide])
        edge.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
        self._key: tuple[object, ...] = ()
        self._ring, self._ticks = Curve(dashes), Pieces(QPen(t.c.ctl, t.line_width))
        self._outline = Curve(edge, fill=t.c.raised)
        frame, below = Overlay(self._draw_frame), Overlay(self._draw_below)
        parts = (frame, self._ring, self._ticks, below, self._outline)
        self._backdrop = add(Backdrop(*parts))
        add(Overlay(self._draw_arrow))
        self._ray = add(Curve(QPen(t.c.amber, strong)))
        self._best = add(Mark(draw_best, px(_SIGN)))
        self._lamp = add(Mark(lambda *at: draw_lamp(*at, focused=self.hasFocus()), px(_SIGN)))
        add(Overlay(self._draw_above))

    @property
    def ring(self) -> float:
        """Radius of the ring in logical pixels. Drawings of equal size have rings of equal size."""
        across = self.width() * _RING_SHARE
        room = self.height() - px(_TITLE + 20) - self._foot_height
        return max(min(across, room / 2.0, self.width() / 2.0 - px(_DOT / 2 + 4)), 8.0)

    @property
    def _foot_height(self) -> int:
        """Height of the space below the ring, which is smaller in a wide, flat drawing."""
        flat = self.width() > _FLAT * self.height()
        return px(32 if flat else 56)

    @property
    def scale(self) -> float:
        """Logical pixels per metre."""
        distance = self._state.distance_m if self._state is not None else 0.3
        return self.ring / min(max(distance, _DRAWN_M[0]), _DRAWN_M[1])

    @property
    def reach(self) -> float:
        """Distance from the centre of the head to the lamp, in logical pixels."""
        distance = self._state.distance_m if self._state is not None else 0.3
        return min(distance * self.scale, self.ring)

    @property
    def middle(self) -> Point:
        """Centre of the head, in logical pixels."""
        top, foot = px(_TITLE), self._foot_height
        return self.width() / 2.0, top + (self.height() - top - foot) * 0.5 + px(4)

    def outline(self, state: Heads) -> Float32:
        """Return the head's outline in this drawing, (n, 2), in metres from the head's centre."""
        raise NotImplementedError

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the centre of the head in place."""
        super().resizeEvent(event)
        x, y = self.middle
        self.panel.look_at(QRectF(-x, -y, float(self.width()), float(self.height())))
        self.lamp_moved()

    def lamp_moved(self) -> None:
        """Move the ring, the head and the lamp."""
        state = self._state
        is_ready = state is not None and state.shape is not None
        if is_ready == self.panel.isHidden():
            self.panel.setVisible(is_ready)
            self.update()
        if state is None or not is_ready:
            return
        key = self._still(state)
        if key != self._key:
            self._key = key
            self._place(state)
            self._backdrop.changed()
        lamp = self._from_middle(state.azimuth_deg, state.altitude_deg)
        self._ray.set_points([(0.0, 0.0), lamp])
        self._lamp.setPos(*lamp)
        self._best.setVisible(False)
        if state.best is not None:
            best = self._from_middle(*state.best)
            self._best.setVisible(math.dist(best, lamp) > 1.0)
            self._best.setPos(*best)
        self.panel.viewport().update()

    def _still(self, state: Heads) -> tuple[object, ...]:
        """Return a cache key that contains everything the backdrop depends on."""
        return self.size(), self.scale, self.reach, self.title, id(state.shape)

    def _place(self, state: Heads) -> None:
        """Position the ring and the head."""
        self._ring.set_points(circle(self.reach))
        self._outline.set_points(finely(self.scale * self.outline(state)))

    def _from_middle(self, azimuth_deg: float, altitude_deg: float) -> Point:
        place, middle = self.place_of(azimuth_deg, altitude_deg), self.middle
        return place[0] - middle[0], place[1] - middle[1]

    def draw(self, painter: QPainter, _ratio: float) -> None:
        """Paint the frame if there is no head."""
        if self.panel.isHidden():
            self._draw_frame(painter, self.rect())

    def _draw_frame(self, painter: QPainter, _part: QRect) -> None:
        """Paint the frame and the title on an opaque background, which keeps the text sharp."""
        t = theme()
        box(painter, self.rect(), px(8), t.c.panel, t.c.line, t.line_width)
        line = QRectF(px(13), px(9), self.width() - px(21), px(16))
        put_text(painter, line, self.title, t.font(12, 600), t.c.dim)

    def _draw_below(self, painter: QPainter, _part: QRect) -> None:
        """Paint the layer below the head."""

    def _draw_arrow(self, painter: QPainter, _part: QRect) -> None:
        """Paint the layer between the head and the lamp."""

    def _draw_above(self, painter: QPainter, _part: QRect) -> None:
        """Paint the layer above the lamp."""

    @staticmethod
    def _plated(
        painter: QPainter, place: Point, words: str, font: QFont, align: float = 0.5
    ) -> None:
        """Draw text on a plate that hides the lines behind it."""
        t = theme()
        painter.setFont(font)
        wide = painter.fontMetrics().horizontalAdvance(words)
        left = place[0] - wide * align
        plate = QRectF(left - px(4), place[1] - px(9), wide + px(8), px(18))
        box(painter, plate, px(4), faint(t.c.panel, 0.85))
        draw_text(painter, place, words, font, t.c.text, align)


class AboveView(_HeadView):
    """A view of the head from above, with the camera at the bottom.

    Dragging moves the lamp around the head at its current altitude.
    """

    title = tr("From above")

    def __init__(self) -> None:
        super().__init__(tr("Lamp from above"))

    def outline(self, state: Heads) -> Float32:
        """Return the outline of the head as seen from above."""
        assert state.shape is not None
        return state.shape.above

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Return the position of a lamp.

        A lamp that is higher or lower than the head appears closer to it.
        """
        level = self.reach * math.cos(math.radians(altitude_deg))
        x, y = self.middle
        azimuth = math.radians(azimuth_deg)
        return x + level * math.sin(azimuth), y + level * math.cos(azimuth)

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Return the azimuth at a point, together with the current altitude."""
        state, (x, y) = self._state, self.middle
        altitude = 0.0 if state is None else state.altitude_deg
        if math.dist(point, (x, y)) < 1.0:
            return (0.0 if state is None else state.azimuth_deg), altitude
        return math.degrees(math.atan2(point[0] - x, point[1] - y)), altitude

    def _place(self, state: Heads) -> None:
        super()._place(state)
        reach = self.reach
        ends = [
            at_turn((0.0, 0.0), reach - px(8 if step % 2 == 0 else 6), 45.0 * step)
            + at_turn((0.0, 0.0), reach, 45.0 * step)
            for step in range(8)
        ]
        edge = reach + 1.0
        self._ticks.set_ends(np.array(ends), QRectF(-edge, -edge, 2.0 * edge, 2.0 * edge))

    def _draw_below(self, painter: QPainter, _part: QRect) -> None:
        """Paint the camera and the labels for both sides."""
        if self._state is None or self._state.shape is None:
            return
        t, (x, y) = theme(), self.middle
        side, nose = px(24), float(self._state.shape.above[:, 1].max())
        top = self.height() - px(8) - side
        dashes = QPen(t.c.dim, t.line_width)
        dashes.setDashPattern([2.0 / t.line_width, 3.0 / t.line_width])
        painter.setPen(dashes)
        across = snap(x, device_ratio(painter), t.line_width)
        painter.drawLine(QLineF(across, y + nose * self.scale + px(6), across, top - px(4)))
        draw_icon(painter, "camera", QRectF(x - side / 2.0, top, side, side), side, t.c.text)
        self._sides(painter)

    def _draw_arrow(self, painter: QPainter, _part: QRect) -> None:
        if self._state is not None and self._state.place_light_deg is not None:
            self._coming(painter, self._state.place_light_deg)

    def _sides(self, painter: QPainter) -> None:
        """Label both sides below the ring, as seen by the sitter and by the camera."""
        t = theme()
        low = self.height() - px(18)
        font, edge = t.font(12), px(10)
        for words, line in ((tr("sitter’s right"), -16), (tr("(camera left)"), 0)):
            draw_text(painter, (edge, low + px(line)), words, font, t.c.dim, 0.0)
        for words, line in ((tr("sitter’s left"), -16), (tr("(camera right)"), 0)):
            right = self.width() - edge
            draw_text(painter, (right, low + px(line)), words, font, t.c.dim, 1.0)

    def _coming(self, painter: QPainter, azimuth_deg: float) -> None:
        """Draw an arrow towards the head in the direction of the place's own light."""
        t, (x, y) = theme(), self.middle
        way, aside = self._way_of_light(azimuth_deg)
        head = 0.13 * self.scale
        tip = max(head + px(8), self.reach * 0.5)
        start = max(min(tip + px(36), self.reach - px(10)), tip + px(14))
        end = QPointF(x + way[0] * tip, y + way[1] * tip) + aside
        from_ = QPointF(x + way[0] * start, y + way[1] * start) + aside
        wide = (t.line_width + 0.75) * t.scale
        painter.setPen(pen(t.c.text, wide, ends="round"))
        painter.drawLine(from_, end)
        angle = math.atan2(way[0], way[1])
        for turn in (-150.0, 150.0):
            barb = angle + math.pi + math.radians(turn)
            painter.drawLine(end, end + QPointF(math.sin(barb), math.cos(barb)) * float(px(8)))
        if self.reach - head < px(_ARROW):
            return
        middle, font = (end + from_) / 2.0, t.font(12)
        if abs(way[0]) < 0.5:
            # The label goes beside the arrow, away from the lamp.
            right = aside.x() >= 0.0
            edge = max(end.x(), from_.x()) if right else min(end.x(), from_.x())
            place = (edge + px(8) * (1.0 if right else -1.0), middle.y())
            self._plated(painter, place, tr("light here"), font, 0.0 if right else 1.0)
        else:
            over = aside.y() <= 0.0
            edge = min(end.y(), from_.y()) if over else max(end.y(), from_.y())
            place = (middle.x(), edge + px(10) * (-1.0 if over else 1.0))
            self._plated(painter, place, tr("light here"), font)

    def _way_of_light(self, azimuth_deg: float) -> tuple[Point, QPointF]:
        """Return the direction of the light and the offset of its arrow from the lamp's line."""
        angle = math.radians(azimuth_deg)
        way = (math.sin(angle), math.cos(angle))
        state = self._state
        off = wrap(azimuth_deg - state.azimuth_deg) if state is not None else 180.0
        if abs(off) > _CLOSE_DEG:
            return way, QPointF()
        across = QPointF(way[1], -way[0]) * (1.0 if off >= 0.0 else -1.0)
        return way, across * float(px(_ASIDE))


class SideView(_HeadView):
    """A view of the head from the side that the lamp is on.

    Dragging raises or lowers the lamp, and moves it between the front and the back of that side.
    """

    def __init__(self) -> None:
        super().__init__(tr("Lamp from the side"))

    @property
    def title(self) -> str:  # type: ignore[override]
        """Title of the drawing, which names the side that the lamp is on."""
        if self.from_left:
            return tr("From the sitter’s left (camera right)")
        return tr("From the sitter’s right (camera left)")

    def outline(self, state: Heads) -> Float32:
        """Return the outline of the head as seen from the side that the lamp is on."""
        assert state.shape is not None
        return state.shape.side * np.array([self.way, -1.0], np.float32)

    @property
    def from_left(self) -> bool:
        """Whether the drawing shows the sitter from the sitter's left."""
        state = self._state
        return state is None or math.sin(math.radians(state.azimuth_deg)) >= -1e-9

    @property
    def way(self) -> float:
        """Direction in which the face points in the drawing: −1 for left, 1 for right."""
        return -1.0 if self.from_left else 1.0

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Return the position of a lamp."""
        azimuth, altitude = math.radians(azimuth_deg), math.radians(altitude_deg)
        x, y = self.middle
        front = self.reach * math.cos(altitude) * math.cos(azimuth)
        return x + self.way * front, y - self.reach * math.sin(altitude)

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Return the azimuth and the altitude at a point.

        The azimuth is on the side of the head that is visible.
        """
        x, y = self.middle
        up = min(max((y - point[1]) / self.reach, -1.0), 1.0)
        altitude = min(max(math.degrees(math.asin(up)), -HIGHEST_DEG), HIGHEST_DEG)
        level = self.reach * math.cos(math.radians(altitude))
        front = min(max(self.way * (point[0] - x) / level, -1.0), 1.0)
        azimuth = math.degrees(math.acos(front))
        return (azimuth if self.from_left else -azimuth), altitude

    def _draw_below(self, painter: QPainter, _part: QRect) -> None:
        if self._state is not None:
            self._level(painter, self._state)

    def _draw_above(self, painter: QPainter, _part: QRect) -> None:
        if self._state is not None:
            self._height(painter, self._state)
            self._foot(painter, self._state)

    def _still(self, state: Heads) -> tuple[object, ...]:
        return *super()._still(state), *self._words(state)

    def _words(self, state: Heads) -> list[tuple[str, Point, float]]:
        """Return the labels for the ends of the level line, omitting any that are near the lamp."""
        (x, y), radius = self.middle, self.reach
        lamp = self.place_of(state.azimuth_deg, state.altitude_deg)
        front, back = (0.0, 1.0) if self.from_left else (1.0, 0.0)
        places = [
            (words, (x + (radius - px(6)) * (2.0 * align - 1.0), y + px(down)), align)
            for align, words, down in (
                (front, tr("camera"), -10),
                (front, tr("ear height"), 12),
                (back, tr("behind"), -10),
            )
        ]
        return [each for each in places if math.dist(each[1], lamp) > px(_CLEAR)]

    def _level(self, painter: QPainter, state: Heads) -> None:
        """Draw the line at ear height, and the labels at its ends."""
        t, (x, y), radius = theme(), self.middle, self.reach
        line = snap(y, device_ratio(painter), t.line_width)
        painter.setPen(QPen(t.c.line, t.line_width))
        painter.drawLine(QPointF(x - radius, line), QPointF(x + radius, line))
        for words, place, align in self._words(state):
            draw_text(painter, place, words, t.font(12), t.c.dim, align)

    def _height(self, painter: QPainter, state: Heads) -> None:
        t = theme()
        place = self.place_of(state.azimuth_deg, state.altitude_deg)
        degrees = whole(state.altitude_deg)
        rise = state.distance_m * math.sin(math.radians(state.altitude_deg))
        if abs(degrees) < _LEVEL_DEG:
            words = tr("at ear height")
        elif degrees > 0:
            words = tr("raised {degrees}° ({height})", degrees=degrees, height=metres(rise))
        else:
            words = tr("lowered {degrees}° ({height})", degrees=-degrees, height=metres(-rise))
        over = -1.0 if degrees >= 0 else 1.0
        font = t.font(12, 600)
        painter.setFont(font)
        half = painter.fontMetrics().horizontalAdvance(words) / 2.0
        middle = min(max(place[0], half + px(10)), self.width() - half - px(10))
        y = place[1] + over * px(28)
        self._plated(painter, (middle, y), words, font)

    def _foot(self, painter: QPainter, state: Heads) -> None:
        t = theme()
        far = metres(state.distance_m)
        words = tr("The ring is {far} from the middle of the head.", far=far)
        if state.distance_m > _DRAWN_M[1]:
            words = tr("{far} from the middle of the head, but drawn closer.", far=far)
        line = QRectF(px(8), self.height() - px(26), self.width() - px(16), px(16))
        put_text(painter, line, words, t.font(12), t.c.dim, MIDDLE)
