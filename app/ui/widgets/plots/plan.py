"""The walk from above, painted by hand: the sitter, the ring around them, and what lights them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPolygonF
from PySide6.QtWidgets import QSizePolicy

from app.core.guidance.plan import Kind, Mark, Plan
from app.core.text import tr
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.paint import box, faint, pen, text_width
from app.ui.widgets.plots.base import Plot, closed_path, disc, draw_text, polygon
from app.ui.widgets.plots.geometry import Point, at_turn, head_outline, sector

_LABEL: Final = 12
_BEHIND_DEG: Final = 25.0  # half the background's wedge
_LEAST_DEG: Final = 4.0  # shorter ways are no arrow
_HEAD: Final = 22
_RADII: Final[dict[Kind, int]] = {"start": 6, "now": 13, "goal": 9}
_INNER: Final[frozenset[Kind]] = frozenset({"light", "lamp", "background"})


class PlanView(Plot):
    """Sitter, start, now, goal, the way between, the light and the background."""

    policies = (QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def __init__(self) -> None:
        super().__init__(tr("From above"))
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._plan = Plan()
        self._taken: list[QRectF] = []
        self._marks: dict[Kind, Callable[[QPainter, Mark], None]] = {
            "start": self._draw_start,
            "now": self._draw_now,
            "goal": self._draw_goal,
            "light": self._draw_light,
            "lamp": self._draw_lamp,
            "background": self._draw_background,
        }

    def sizeHint(self) -> QSize:
        """Return the size that the design asks for, at the scale of the theme."""
        return QSize(px(272), px(272))

    def set_plan(self, plan: Plan) -> None:
        """Show another one."""
        if plan != self._plan:
            self._plan = plan
            self.say(plan.description)
            self.update()

    @property
    def centre(self) -> Point:
        """Middle of the ring, logical pixels."""
        return self.width() / 2.0, self.height() / 2.0 + px(8)

    @property
    def ring(self) -> float:
        """Radius of the ring that is walked on: around it there is room for words."""
        return max(min(self.width() / 2.0 - px(40), self.height() / 2.0 - px(46)), float(px(30)))

    def _at(self, turn_deg: float, radius: float) -> Point:
        return at_turn(self.centre, radius, turn_deg - self._plan.up_deg)

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint it from the ground up: what counts most lies on top."""
        t, plan, ring = theme(), self._plan, self.ring
        box(painter, self.rect(), px(8), t.c.panel, t.c.line, t.line_width)
        draw_text(painter, (px(13), px(17)), plan.title, t.font(_LABEL, 600), t.c.dim, 0.0)
        if not plan.marks:
            return
        self._taken = [self._around(self.centre, px(_HEAD))]
        first = [mark for mark in plan.marks if mark.kind == "background"]
        for mark in first:
            self._marks[mark.kind](painter, mark)
        disc(painter, self.centre, ring, None, t.c.ctl, t.line_width * t.scale)
        if plan.arc_deg is not None:
            self._sweep(
                painter, plan.arc_deg[0], (plan.arc_deg[1] - plan.arc_deg[0]) % 360.0, 7.0, t.c.ok
            )
        self._draw_way(painter)
        self._draw_head(painter)
        for mark in reversed(plan.marks):
            if mark not in first:
                self._marks[mark.kind](painter, mark)
            if mark.kind not in _INNER:
                place = self._at(mark.turn_deg, ring)
                self._taken.append(self._around(place, px(_RADII[mark.kind])))
        for mark in plan.marks:
            self._draw_words(painter, mark)

    @staticmethod
    def _around(place: Point, radius: float) -> QRectF:
        return QRectF(place[0] - radius, place[1] - radius, 2.0 * radius, 2.0 * radius)

    def _sweep(
        self, painter: QPainter, start: float, extent: float, width: float, ink: QColor
    ) -> None:
        (x, y), ring = self.centre, self.ring
        painter.setPen(pen(ink, px(width)))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        # Qt counts sixteenths of a degree from the right, counter-clockwise.
        area = QRectF(x - ring, y - ring, 2.0 * ring, 2.0 * ring)
        angle = 90.0 - (start - self._plan.up_deg)
        painter.drawArc(area, round(16.0 * angle), round(-16.0 * extent))

    def _draw_way(self, painter: QPainter) -> None:
        """Draw the walk that is left, ending in an arrow's head at the goal."""
        start, extent = self._plan.way
        if abs(extent) < _LEAST_DEG:
            return
        ink, way = theme().c.amber, 1.0 if extent > 0.0 else -1.0
        # Up to the edge of the goal's disc, the arrow's head before it.
        tip, root = (
            way * min(math.degrees(px(length) / self.ring), abs(extent) / 2.0)
            for length in (_RADII["goal"], _RADII["goal"] + 13)
        )
        goal, wing = start + extent, px(8)
        self._sweep(painter, start, extent - root, 4.0, ink)
        sides = [self._at(goal - root, self.ring + side) for side in (-wing, wing)]
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink)
        painter.drawPolygon(polygon([sides[0], self._at(goal - tip, self.ring), sides[1]]))

    def _draw_head(self, painter: QPainter) -> None:
        t, plan = theme(), self._plan
        painter.setPen(pen(t.c.text, (t.line_width + 1.0) * t.scale))
        painter.setBrush(t.c.raised)
        outline = head_outline(self.centre, px(_HEAD), plan.nose_deg - plan.up_deg)
        painter.drawPath(closed_path(outline))

    def _draw_start(self, painter: QPainter, mark: Mark) -> None:
        t = theme()
        disc(
            painter,
            self._at(mark.turn_deg, self.ring),
            px(_RADII["start"]),
            t.c.panel,
            t.c.text,
            px(2),
        )

    def _draw_now(self, painter: QPainter, mark: Mark) -> None:
        t, (x, y), radius = theme(), self._at(mark.turn_deg, self.ring), px(_RADII["now"])
        disc(painter, (x, y), radius, t.c.text, t.c.panel, px(2))
        icon = px(16)
        area = QRectF(x - icon / 2.0, y - icon / 2.0, icon, icon)
        draw_icon(painter, "camera", area, icon, t.c.panel)

    def _draw_goal(self, painter: QPainter, mark: Mark) -> None:
        t, place = theme(), self._at(mark.turn_deg, self.ring)
        disc(painter, place, px(_RADII["goal"]), t.c.amberfill, t.c.onamber, px(2))

    def _draw_light(self, painter: QPainter, mark: Mark) -> None:
        """Draw an arrow toward the head."""
        t = theme()
        painter.setPen(pen(t.c.text, px(2), ends="round"))
        tip = self._at(mark.turn_deg, self.ring * 0.52)
        tail = self._at(mark.turn_deg, self.ring * 0.86)
        painter.drawLine(QPointF(*tail), QPointF(*tip))
        wings = [self._at(mark.turn_deg + side, self.ring * 0.62) for side in (-9.0, 9.0)]
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(polygon([wings[0], tip, wings[1]]))

    def _draw_lamp(self, painter: QPainter, mark: Mark) -> None:
        t, (x, y), side = theme(), self._at(mark.turn_deg, self.ring * 0.6), px(20)
        disc(painter, (x, y), side / 2.0, t.c.amberfill, t.c.onamber, px(1))
        icon = px(14)
        area = QRectF(x - icon / 2.0, y - icon / 2.0, icon, icon)
        draw_icon(painter, "bulb", area, icon, t.c.onamber)

    def _draw_background(self, painter: QPainter, mark: Mark) -> None:
        """Draw what the camera will see behind the sitter, as a wedge."""
        turn = mark.turn_deg - self._plan.up_deg
        wedge = sector(self.centre, self.ring, (turn - _BEHIND_DEG, turn + _BEHIND_DEG))
        path = QPainterPath()
        path.addPolygon(QPolygonF(polygon(wedge)))
        painter.fillPath(path, faint(theme().c.text, 0.14))

    def _draw_words(self, painter: QPainter, mark: Mark) -> None:
        """Draw a mark's word beside it, where nothing else is."""
        t, inner = theme(), mark.kind in _INNER
        bold = mark.kind in ("now", "goal")
        font = t.font(_LABEL, 600 if bold else 400)
        wide, high, ring = text_width(font, mark.words), px(16), self.ring
        places: list[tuple[float, int]] = [
            (radius, aside) for aside in (0, 10, 20, 32, 45) for radius in (px(18), -px(18))
        ]
        if inner:
            places = [(-0.36 * ring, aside) for aside in (0, 24, 34, 45, 60)]
        if mark.kind != "background" and inner:
            places = places[1:]  # its arrow is there
        found = None
        for beside, aside in places:
            for turn in (mark.turn_deg + aside, mark.turn_deg - aside):
                x, y = self._at(turn, ring + beside)
                # Outside it ends at the ring on the left and begins there on the right.
                share = (x - self.centre[0]) / (ring + beside) * (1.0 if beside > 0 else -1.0)
                left = x - wide / 2.0 + share * (0.0 if inner else wide / 2.0 - px(6))
                area = QRectF(left, y - high / 2.0, wide, high)
                inside = px(4) <= left <= self.width() - px(4) - wide
                if inside and not any(area.intersects(one) for one in self._taken):
                    found = area
                    break
            if found is not None:
                break
        if found is None:
            return
        self._taken.append(found)
        middle, ink = found.center(), t.c.text if bold else t.c.dim
        draw_text(painter, (middle.x(), middle.y()), mark.words, font, ink)
