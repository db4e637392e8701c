"""The lamp around the head, painted: words and arrows make way for each other, in pixels.

One drawing is from above with the camera below, one from the lamp's side.

Both drawings have one scale and the head's own outlines. Their frame is the head's, metres from
its middle: x toward the sitter's left, y up, z out of the face. From above the face looks down the
picture, at the camera, so that the sitter's left is to the right, as the camera sees it. From the
sitter's left the face looks to the left, from the sitter's right to the right.
"""

from __future__ import annotations

import math
from typing import Final

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFont, QPainter, QPen

from app.core.base.angles import whole, wrap
from app.core.text import tr
from app.ui.plots.lamps import HIGHEST_DEG, Heads, LampPlot, draw_best, draw_lamp
from app.ui.plots.parts.base import closed_path, draw_text, snap
from app.ui.plots.parts.geometry import Point
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import MIDDLE, box, faint, pen, put_text
from app.words.phrases.quantities import metres

_DOT: Final = 24
_RING_SHARE: Final = 0.445  # of the width: room for the dot beside the ring
_DRAWN_M: Final = (0.24, 0.9)  # a ring nearer or farther is drawn at these
_LEVEL_DEG: Final = 3  # so little is level in words, too
_TITLE: Final = 22
_FLAT: Final = 1.4
_CLOSE_DEG: Final = 24.0  # nearer to the lamp's line, the arrow of the place's light makes way
_ASIDE: Final = 22
_ARROW: Final = 56  # room beside the head for an arrow with words
_CLEAR: Final = 76  # a word this near to the lamp makes way for it


class _HeadView(LampPlot):
    """What both drawings share: scale, ring, frame and title."""

    preferred_size = least = (200, 180)

    @property
    def ring(self) -> float:
        """Radius of the lamp's ring, logical pixels: the same in both drawings of one size."""
        across = self.width() * _RING_SHARE
        room = self.height() - px(_TITLE + 20) - self._foot_height
        return max(min(across, room / 2.0, self.width() / 2.0 - px(_DOT / 2 + 4)), 8.0)

    @property
    def _foot_height(self) -> int:
        """Height below the ring: in a flat drawing words stand beside it."""
        flat = self.width() > _FLAT * self.height()
        return px(32 if flat else 56)

    @property
    def scale(self) -> float:
        """Logical pixels per metre."""
        distance = self._state.distance_m if self._state is not None else 0.3
        return self.ring / min(max(distance, _DRAWN_M[0]), _DRAWN_M[1])

    @property
    def reach(self) -> float:
        """Radius at which the lamp is drawn, logical pixels."""
        distance = self._state.distance_m if self._state is not None else 0.3
        return min(distance * self.scale, self.ring)

    @property
    def middle(self) -> Point:
        """Middle of the head, logical pixels."""
        top, foot = px(_TITLE), self._foot_height
        return self.width() / 2.0, top + (self.height() - top - foot) * 0.5 + px(4)

    def _frame(self, painter: QPainter, title: str) -> None:
        t = theme()
        box(painter, self.rect(), px(8), t.c.panel, t.c.line, t.line_width)
        line = QRectF(px(13), px(9), self.width() - px(21), px(16))
        put_text(painter, line, title, t.font(12, 600), t.c.dim)

    def _ring(self, painter: QPainter) -> None:
        t, radius = theme(), self.reach
        wide = t.line_width * t.scale
        pen = QPen(t.c.dim, wide)
        pen.setDashPattern([3.0 * t.scale / wide, 3.0 * t.scale / wide])
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(QPointF(*self.middle), radius, radius)

    def _outline(self, painter: QPainter, points: list[Point]) -> None:
        t = theme()
        painter.setBrush(t.c.raised)
        pen = QPen(t.c.text, (t.line_width + 1.0) * t.scale)
        pen.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
        painter.setPen(pen)
        painter.drawPath(closed_path(points))

    def _ray(self, painter: QPainter, place: Point) -> None:
        t = theme()
        painter.setPen(QPen(t.c.amber, (t.line_width + 1.0) * t.scale))
        painter.drawLine(QPointF(*self.middle), QPointF(*place))

    @staticmethod
    def _plated(
        painter: QPainter, place: Point, words: str, font: QFont, align: float = 0.5
    ) -> None:
        """Draw words that may lie on a line of the drawing."""
        t = theme()
        painter.setFont(font)
        wide = painter.fontMetrics().horizontalAdvance(words)
        left = place[0] - wide * align
        plate = QRectF(left - px(4), place[1] - px(9), wide + px(8), px(18))
        box(painter, plate, px(4), faint(t.c.panel, 0.85))
        draw_text(painter, place, words, font, t.c.text, align)

    def _lamp(self, painter: QPainter, state: Heads) -> None:
        place = self.place_of(state.azimuth_deg, state.altitude_deg)
        self._ray(painter, place)
        if state.best is not None:
            best = self.place_of(*state.best)
            if math.dist(best, place) > 1.0:
                draw_best(painter, best)
        draw_lamp(painter, place, focused=self.hasFocus())


class AboveView(_HeadView):
    """The head from above, looking down the picture at the camera.

    Dragging moves the lamp around the head; its altitude stays.
    """

    def __init__(self) -> None:
        super().__init__(tr("Lamp from above"))

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Where a lamp is drawn: its distance is seen shortened by its altitude."""
        level = self.reach * math.cos(math.radians(altitude_deg))
        x, y = self.middle
        azimuth = math.radians(azimuth_deg)
        return x + level * math.sin(azimuth), y + level * math.cos(azimuth)

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Read the azimuth; the altitude stays."""
        state, (x, y) = self._state, self.middle
        altitude = 0.0 if state is None else state.altitude_deg
        if math.dist(point, (x, y)) < 1.0:
            return (0.0 if state is None else state.azimuth_deg), altitude
        return math.degrees(math.atan2(point[0] - x, point[1] - y)), altitude

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint frame, ring, camera, head and lamp."""
        state = self._state
        self._frame(painter, tr("From above"))
        if state is None or state.shape is None:
            return
        self._ring(painter)
        self._ticks(painter)
        self._camera(painter, float(state.shape.above[:, 1].max()), ratio)
        self._sides(painter)
        x, y = self.middle
        unit = self.scale
        self._outline(painter, [(x + unit * a, y + unit * b) for a, b in state.shape.above])
        if state.place_light_deg is not None:
            self._coming(painter, state.place_light_deg)
        self._lamp(painter, state)

    def _ticks(self, painter: QPainter) -> None:
        t, (x, y), radius = theme(), self.middle, self.reach
        painter.setPen(QPen(t.c.ctl, t.line_width))
        for step in range(8):
            angle = math.radians(45.0 * step)
            inner, outer = radius - px(8 if step % 2 == 0 else 6), radius
            way = (math.sin(angle), math.cos(angle))
            painter.drawLine(
                QPointF(x + way[0] * inner, y + way[1] * inner),
                QPointF(x + way[0] * outer, y + way[1] * outer),
            )

    def _camera(self, painter: QPainter, nose: float, ratio: float) -> None:
        t, (x, y) = theme(), self.middle
        side = px(24)
        top = self.height() - px(8) - side
        pen = QPen(t.c.dim, t.line_width)
        pen.setDashPattern([2.0 / t.line_width, 3.0 / t.line_width])
        painter.setPen(pen)
        across = snap(x, ratio, t.line_width)
        start = QPointF(across, y + nose * self.scale + px(6))
        painter.drawLine(start, QPointF(across, top - px(4)))
        draw_icon(painter, "camera", QRectF(x - side / 2.0, top, side, side), side, t.c.text)

    def _sides(self, painter: QPainter) -> None:
        """Name both sides, twice each; below the ring."""
        t = theme()
        low = self.height() - px(18)
        font, edge = t.font(12), px(10)
        for words, line in ((tr("sitter’s right"), -16), (tr("(camera left)"), 0)):
            draw_text(painter, (edge, low + px(line)), words, font, t.c.dim, 0.0)
        for words, line in ((tr("sitter’s left"), -16), (tr("(camera right)"), 0)):
            right = self.width() - edge
            draw_text(painter, (right, low + px(line)), words, font, t.c.dim, 1.0)

    def _coming(self, painter: QPainter, azimuth_deg: float) -> None:
        """Draw from where the place's own light comes, as an arrow toward the head."""
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
            # Beside it, away from the lamp.
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
        """From where it comes, and how far its arrow makes way for the lamp's own line."""
        angle = math.radians(azimuth_deg)
        way = (math.sin(angle), math.cos(angle))
        state = self._state
        off = wrap(azimuth_deg - state.azimuth_deg) if state is not None else 180.0
        if abs(off) > _CLOSE_DEG:
            return way, QPointF()
        across = QPointF(way[1], -way[0]) * (1.0 if off >= 0.0 else -1.0)
        return way, across * float(px(_ASIDE))


class SideView(_HeadView):
    """The head from the side on which the lamp is.

    Dragging raises and lowers the lamp, and moves it between front and back on its side.
    """

    def __init__(self) -> None:
        super().__init__(tr("Lamp from the side"))

    @property
    def from_left(self) -> bool:
        """Whether the sitter is seen from their left."""
        state = self._state
        return state is None or math.sin(math.radians(state.azimuth_deg)) >= -1e-9

    @property
    def way(self) -> float:
        """Where the face looks: −1 to the left of the picture, 1 to its right."""
        return -1.0 if self.from_left else 1.0

    def place_of(self, azimuth_deg: float, altitude_deg: float) -> Point:
        """Where a lamp is drawn."""
        azimuth, altitude = math.radians(azimuth_deg), math.radians(altitude_deg)
        x, y = self.middle
        front = self.reach * math.cos(altitude) * math.cos(azimuth)
        return x + self.way * front, y - self.reach * math.sin(altitude)

    def spot_at(self, point: Point) -> tuple[float, float]:
        """Read the altitude, and the azimuth on the side that is seen."""
        x, y = self.middle
        up = min(max((y - point[1]) / self.reach, -1.0), 1.0)
        altitude = min(max(math.degrees(math.asin(up)), -HIGHEST_DEG), HIGHEST_DEG)
        level = self.reach * math.cos(math.radians(altitude))
        front = min(max(self.way * (point[0] - x) / level, -1.0), 1.0)
        azimuth = math.degrees(math.acos(front))
        return (azimuth if self.from_left else -azimuth), altitude

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint frame, ring, head and lamp."""
        state = self._state
        title = tr("From the sitter’s right (camera left)")
        if self.from_left:
            title = tr("From the sitter’s left (camera right)")
        self._frame(painter, title)
        if state is None or state.shape is None:
            return
        self._ring(painter)
        self._level(painter, state, ratio)
        x, y = self.middle
        unit, way = self.scale, self.way
        self._outline(painter, [(x + way * unit * a, y - unit * b) for a, b in state.shape.side])
        self._lamp(painter, state)
        self._height(painter, state)
        self._foot(painter, state)

    def _level(self, painter: QPainter, state: Heads, ratio: float) -> None:
        """Draw the line at the height of the ears, and what lies at its ends, but for the lamp."""
        t, (x, y), radius = theme(), self.middle, self.reach
        lamp = self.place_of(state.azimuth_deg, state.altitude_deg)
        line = snap(y, ratio, t.line_width)
        painter.setPen(QPen(t.c.line, t.line_width))
        painter.drawLine(QPointF(x - radius, line), QPointF(x + radius, line))
        front, back = (0.0, 1.0) if self.from_left else (1.0, 0.0)
        for align, words, down in (
            (front, tr("camera"), -10),
            (front, tr("ear height"), 12),
            (back, tr("behind"), -10),
        ):
            place = (x + (radius - px(6)) * (2.0 * align - 1.0), y + px(down))
            if math.dist(place, lamp) > px(_CLEAR):
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
            words = tr("{far} from the middle of the head; drawn nearer.", far=far)
        line = QRectF(px(8), self.height() - px(26), self.width() - px(16), px(16))
        put_text(painter, line, words, t.font(12), t.c.dim, MIDDLE)
