"""The walk seen from above, painted without pyqtgraph to keep its labels clear of the arrows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import arc_width, at_turn, difference
from app.core.guidance.walk_plan import Kind, PlanDrawing, PlanMark
from app.core.text import tr
from app.ui.plots.parts.base import Plot, closed_path, disc, draw_text, polygon
from app.ui.plots.parts.geometry import Point, head_outline, sector
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import box, faint, pen, text_width
from app.words.plan import PlanWords

_LABEL: Final = 12
_DESIGNED: Final = (274, 316)
_BEHIND_DEG: Final = 25.0  # half the angle of the background's wedge
_LEAST_DEG: Final = 4.0  # a shorter way has no arrow
_HEAD: Final = 22
_TOP: Final = 24  # height reserved for the title
_TOKENS: Final[dict[Kind, tuple[int, float, str, str, str]]] = {
    "start": (6, 1.0, "panel", "text", ""),
    "now": (13, 1.0, "text", "panel", "camera"),
    "goal": (9, 1.0, "amberfill", "onamber", ""),
    "lamp": (10, 0.6, "amberfill", "onamber", "bulb"),
}
"""Radius, position (as a fraction of the ring's radius), fill, ink and icon of each disc."""


class PlanView(Plot):
    """A plan of the sitter, start, current turn, goal, way to the goal, light and background."""

    policies = (QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def __init__(self) -> None:
        super().__init__(tr("From above"))
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._plan, self._words = PlanDrawing(), PlanWords()
        self._boxes: list[QRectF] = []

    def set_plan(self, plan: PlanDrawing, words: PlanWords) -> None:
        """Show a different plan."""
        if (plan, words) != (self._plan, self._words):
            self._plan, self._words = plan, words
            self.say(words.description)
            self.update()

    @property
    def centre(self) -> Point:
        """Centre of the ring, in logical pixels."""
        return self.width() / 2.0, (self.height() + px(_TOP - 8)) / 2.0

    @property
    def ring(self) -> float:
        """Radius of the walk in logical pixels, which leaves room for the labels around it."""
        wide, high = self.width() / 2.0, (self.height() - px(_TOP)) / 2.0
        # If space is short, the margin for labels shrinks before the drawing does.
        wide -= self._px(40) if wide >= px(116) else px(22)
        high -= self._px(28) if high >= px(116) else px(18)
        return max(min(wide, high), float(px(30)))

    def _px(self, length: float) -> int:
        """Return a design length in pixels, scaled up in a large drawing."""
        grown = min(self.width() / px(_DESIGNED[0]), self.height() / px(_DESIGNED[1]))
        return px(length * min(max(grown, 1.0), 2.0))

    def _font(self, weight: int) -> QFont:
        return theme().font(round(_LABEL * self._px(1000) / px(1000)), weight)

    def _at(self, turn_deg: float, radius: float) -> Point:
        return at_turn(self.centre, radius, turn_deg - self._plan.up_deg)

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint from back to front. The most important mark is on top and is labelled first."""
        t, plan = theme(), self._plan
        box(painter, self.rect(), px(8), t.c.panel, t.c.line, t.line_width)
        draw_text(
            painter, (self._px(13), self._px(17)), self._words.title, self._font(600), t.c.dim, 0.0
        )
        self._draw_background(painter)
        disc(painter, self.centre, self.ring, None, t.c.ctl, t.line_width * t.scale)
        if plan.arc_deg is not None:
            self._sweep(painter, plan.arc_deg[0], arc_width(plan.arc_deg), 12.0, t.c.ok)
        self._draw_way(painter)
        painter.setPen(pen(t.c.text, (t.line_width + 1.0) * t.scale))
        painter.setBrush(t.c.raised)
        turn, head = plan.nose_deg - plan.up_deg, min(float(self._px(_HEAD)), self.ring / 4.0)
        painter.drawPath(closed_path(head_outline(self.centre, head, turn)))
        self._boxes = [_around(self.centre, head)]
        for mark in reversed(plan.marks):
            if mark.kind == "light":
                self._boxes.append(self._draw_arrow(painter, mark.turn_deg, (0.86, 0.62)))
            elif mark.kind == "nose":
                self._draw_nose(painter, mark)
            elif mark.kind != "background":
                self._draw_token(painter, mark)
        for mark, label in zip(plan.marks, self._words.labels, strict=False):
            if label:
                self._draw_words(painter, mark, label)

    def _sweep(
        self, painter: QPainter, start: float, extent: float, width: float, ink: QColor
    ) -> None:
        painter.setPen(pen(ink, self._px(width)))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        # Qt measures sixteenths of a degree from the right, counter-clockwise.
        angle = 90.0 - (start - self._plan.up_deg)
        area = _around(self.centre, self.ring)
        painter.drawArc(area, round(16.0 * angle), round(-16.0 * extent))

    def _draw_way(self, painter: QPainter) -> None:
        """Draw the remaining part of the walk, with an arrowhead before the goal."""
        start, extent = self._plan.way
        if abs(extent) < _LEAST_DEG:
            return
        ink, way, rim = theme().c.amber, math.copysign(1.0, extent), _TOKENS["goal"][0]
        tip, root = (
            start
            + extent
            - way * min(math.degrees(self._px(length) / self.ring), abs(extent) / 2.0)
            for length in (rim, rim + 13)
        )
        self._sweep(painter, start, root - start, 4.0, ink)
        sides = [self._at(root, self.ring + self._px(side)) for side in (-8, 8)]
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink)
        painter.drawPolygon(polygon([sides[0], self._at(tip, self.ring), sides[1]]))

    def _draw_token(self, painter: QPainter, mark: PlanMark) -> None:
        colours = theme().c
        size, share, fill, ink, icon = _TOKENS[mark.kind]
        place, radius = self._at(mark.turn_deg, share * self.ring), float(self._px(size))
        edge: QColor = getattr(colours, ink)
        disc(painter, place, radius, getattr(colours, fill), edge, self._px(2))
        if icon:
            side = round(1.25 * radius)
            draw_icon(painter, icon, _around(place, side / 2.0), side, edge)
        self._boxes.append(_around(place, radius))

    def _draw_nose(self, painter: QPainter, mark: PlanMark) -> None:
        """Draw the direction of the nose, and the direction of the lens if it is different."""
        lens = self._plan.lens_deg
        if self._plan.yaw_deg:
            self._draw_arrow(painter, lens, (0.86, 0.34), (3.0, 3.0))
            spots = [self._at(lens, self.ring * share) for share in (0.75, 0.6, 0.45)]
            self._boxes += [_around(spot, self._px(6)) for spot in spots]
        self._boxes.append(self._draw_arrow(painter, mark.turn_deg, (0.28, 0.54)))

    def _draw_arrow(
        self,
        painter: QPainter,
        turn_deg: float,
        reach: tuple[float, float],
        dashes: tuple[float, ...] = (),
    ) -> QRectF:
        """Draw an arrow between two fractions of the radius, and return the area that it covers."""
        tail, tip = (self._at(turn_deg, self.ring * share) for share in reach)
        back = reach[1] + math.copysign(0.1, reach[0] - reach[1])
        wings = [self._at(turn_deg + side, self.ring * back) for side in (-9.0, 9.0)]
        ink, wide = theme().c.text, self._px(2)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(pen(ink, wide, dashes) if dashes else pen(ink, wide, ends="round"))
        painter.drawPolyline(polygon([tail, tip]))
        painter.setPen(pen(ink, wide, ends="round"))
        painter.drawPolyline(polygon([wings[0], tip, wings[1]]))
        return polygon([tail, tip, *wings]).boundingRect().adjusted(-6, 0, 6, 0)

    def _draw_background(self, painter: QPainter) -> None:
        """Draw a wedge for the background that the camera will see behind the sitter."""
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(faint(theme().c.text, 0.14))
        for mark in self._plan.marks:
            if mark.kind == "background":
                turn = mark.turn_deg - self._plan.up_deg
                arc = (turn - _BEHIND_DEG, turn + _BEHIND_DEG)
                painter.drawPolygon(polygon(sector(self.centre, self.ring, arc)))

    def _draw_words(self, painter: QPainter, mark: PlanMark, label: str) -> None:
        """Draw a mark's label beside the mark, in the first free position."""
        t, bold = theme(), mark.kind in ("now", "goal")
        font = self._font(600 if bold else 400)
        wide = self._px(17) + text_width(self._font(600), self._words.title)
        title = QRectF(0, 0, wide, self._px(28))
        for area in self._places(mark, text_width(font, label)):
            inside = QRectF(self.rect()).adjusted(px(4), px(_TOP), -px(4), -px(2)).contains(area)
            if inside and not any(area.intersects(one) for one in (title, *self._boxes)):
                self._boxes.append(area)
                middle, ink = area.center(), t.c.text if bold else t.c.dim
                draw_text(painter, (middle.x(), middle.y()), label, font, ink)
                return

    def _places(self, mark: PlanMark, wide: float) -> Iterator[QRectF]:
        """Yield possible positions for a label: outside and inside the ring, or beside an arrow."""
        inner = mark.kind in ("nose", "light", "lamp", "background")
        beside = self.ring * (0.45 if mark.kind == "nose" else 0.64 if inner else 1.0)
        # far enough from an arrow for half the label
        first = 0.0
        if inner and mark.kind != "background":
            first = math.degrees((wide / 2.0 + self._px(8)) / beside)
        others = [m.turn_deg for m in self._plan.marks if {m.kind, mark.kind} == {"now", "goal"}]
        if mark.kind == "nose":
            others = [self._plan.lens_deg]
        # Only on the side away from the other arrow, to avoid confusion between the labels.
        away = math.copysign(1.0, difference(mark.turn_deg, others[0])) if others else 1.0
        steps: tuple[int, ...] = (0, 10, 20, 32, 45)
        if mark.kind == "nose":
            steps = (0, 10)  # farther away, the label would seem to belong to another mark
            for more in steps:  # beyond the arrow
                x, y = self._at(mark.turn_deg + away * more, 0.78 * self.ring)
                yield QRectF(x - wide / 2.0, y - self._px(8), wide, self._px(16))
        for more in steps:
            for out in (0,) if inner else (self._px(18), -self._px(18)):
                for side in (away,) if others else (away, -away):
                    turn = mark.turn_deg + side * (first + more)
                    x, y = self._at(turn, beside + out)
                    # Outside the ring, a label on the left ends at the ring, and one on the right
                    # begins there.
                    share = (x - self.centre[0]) / (beside + out)
                    x += share * math.copysign(wide / 2.0 - self._px(6), out) if out else 0.0
                    yield QRectF(x - wide / 2.0, y - self._px(8), wide, self._px(16))


def _around(place: Point, radius: float) -> QRectF:
    return QRectF(place[0] - radius, place[1] - radius, 2.0 * radius, 2.0 * radius)
