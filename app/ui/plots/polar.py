"""Match around the circle of turns, painted by hand: pyqtgraph has no polar plots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QPointF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import at_turn, wrap
from app.core.text import tr
from app.core.text.turns import arc_words, turn_words
from app.ui.plots.base import TurnPlot, closed_path, disc, draw_text, polygon
from app.ui.plots.geometry import (
    Dial,
    Point,
    head_outline,
    hit,
    sector,
    turn_at,
    value_at,
)
from app.ui.theme import Theme, px, theme
from app.ui.widgets.paint import faint, pen, text_width

_INSET: Final = 18.0  # from the edge of the widget to the rim: room for the numbers
_CORE: Final = 26.0  # radius of the value 0: the head stands inside it
_HEAD: Final = 17.0  # half the length of the head
_GRAB: Final = 12.0  # how far from a peak a click still means it
_STILL: Final = 6.0  # so near the middle a pointer has no direction
_CURVE_FILL: Final = 0.12
_ARC_FILL: Final = 0.28


@dataclass(frozen=True, slots=True)
class _Data:
    curve: tuple[float, ...]
    limit: float
    arc: tuple[float, float] | None
    best: float | None
    peaks: tuple[float, ...]
    marks: tuple[tuple[str, float], ...] = ()


class PolarPlot(TurnPlot):
    """Match (or quality) at every turn: 0° is up, clockwise goes to the right.

    Arrows move the needle by 1°, with Shift by 10°, Home to the best turn, Page Down and Page Up
    to the next peak clockwise and counter-clockwise.
    """

    policies = (QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    peak_chosen = Signal(int)
    """The second peak of this index was chosen, by a click or by Page Up and Page Down."""

    def __init__(self, name: str = tr("Match by turn"), size: int = 224) -> None:
        super().__init__(name)
        self._side = px(size)
        self._data = _Data((), 45.0, None, None, ())
        self._hovered: int | None = None
        self._numbers = self._limit = ""
        self._marked: tuple[str, ...] = ()
        self.setMouseTracking(True)
        self.setToolTip(tr("Drag to try another turn. Arrows 1°, Shift 10°, Home the best turn"))
        self.describe()

    def sizeHint(self) -> QSize:
        """Return the square that it would like to have."""
        return QSize(self._side, self._side)

    def take_side(self, side: int) -> None:
        """Ask for another square, as where there is little height; logical pixels."""
        if side != self._side:
            self._side = side
            self.updateGeometry()

    def set_data(
        self,
        curve: Sequence[float],
        limit: float,
        arc: tuple[float, float] | None,
        best: float | None,
        peaks: Sequence[float] = (),
        needle: float | None = None,
        marks: Sequence[tuple[str, float]] = (),
    ) -> None:
        """Show a style.

        Args:
            curve: Match at evenly spaced turns from 0 on, clockwise, of 100; empty shows the bare
                dial.
            arc: tuple of float or None. Tolerance arc (from, to), clockwise, deg; may wrap. None:
                out of reach.
            peaks: Turns of the second peaks, deg, without the best.
            needle: Turn of the needle, deg; the best by default.
            marks: Names and turns, deg, of dots on the curve.
        """
        data = _Data(
            tuple(float(value) if math.isfinite(value) else 0.0 for value in curve),
            float(limit),
            None if arc is None else (float(arc[0]), float(arc[1])),
            None if best is None else wrap(float(best)),
            tuple(wrap(float(turn)) for turn in peaks),
            tuple(marks),
        )
        self._data, self._best = data, data.best
        self._hovered = None
        turn = data.best if needle is None else needle
        self.set_needle(0.0 if turn is None else turn)

    def tell(self, numbers: str, limit: str, marked: Sequence[str] = ()) -> None:
        """Take words from where all others come from: of the needle, the limit and the marks."""
        self._numbers, self._limit, self._marked = numbers, limit, tuple(marked)
        self.describe()

    def describe(self) -> None:
        """Put needle, match, best turn, arc, limit and peaks into words."""
        data = self._data
        if not data.curve:
            self.say(tr("No turn yet"))
            return
        match = max(math.floor(value_at(data.curve, self.needle)), 0)
        numbers = self._numbers or tr("match {match} of 100", match=match)
        words = [tr("Needle: {turn}, {numbers}", turn=turn_words(self.needle), numbers=numbers)]
        if data.best is not None:
            words.append(tr("Best: {turn}", turn=turn_words(data.best)))
        if data.arc is not None:
            words.append(tr("Good from {arc}", arc=arc_words(data.arc)))
        words.append(self._limit or tr("Limit of reach: {limit:.0f}", limit=data.limit))
        words += self._marked
        words += [tr("Second peak: {turn}", turn=turn_words(turn)) for turn in data.peaks]
        self.say(". ".join(words) + ".")

    @property
    def dial(self) -> Dial:
        """Circles of the plot at its present size, logical pixels."""
        centre = (self.width() / 2.0, self.height() / 2.0)
        rim = max(min(self.width(), self.height()) / 2.0 - px(_INSET), 1.0)
        return Dial(centre, min(float(px(_CORE)), rim * 0.4), rim)

    def peak_places(self) -> list[Point]:
        """Middles of the second peaks' rings, logical pixels."""
        dial, data = self.dial, self._data
        return [dial.place(turn, value_at(data.curve, turn)) for turn in data.peaks if data.curve]

    def draw(self, painter: QPainter, ratio: float) -> None:
        """Paint the dial from the cache, then the head and the needle."""
        painter.drawPixmap(0, 0, self.kept("dial", self._data, self.size(), ratio, self._draw_dial))
        if self._hovered is not None:
            self._draw_peak(painter, self.peak_places()[self._hovered], hovered=True)
        self._draw_numbers(painter)
        self._draw_head(painter)
        if self._data.curve:
            self._draw_needle(painter)

    def _draw_dial(self, painter: QPainter) -> None:
        t, dial, data = theme(), self.dial, self._data
        centre = QPointF(*dial.centre)
        disc(painter, dial.centre, dial.rim, t.c.bg)
        curve = closed_path(dial.outline(data.curve)) if len(data.curve) > 2 else None
        if curve is not None:
            painter.fillPath(curve, faint(t.c.text, _CURVE_FILL))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        dashes = QPen(t.c.dim, t.line_width)
        dashes.setDashPattern([3.0 / t.line_width, 3.0 / t.line_width])
        painter.setPen(dashes)
        limit = dial.radius(data.limit)
        painter.drawEllipse(centre, limit, limit)
        if data.arc is not None:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(faint(t.c.amberfill, _ARC_FILL))
            painter.drawPolygon(polygon(sector(dial.centre, dial.rim, data.arc)))
        self._draw_rim(painter, t, dial)
        if curve is not None:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(t.c.text, t.line_width + 0.75))
            painter.drawPath(curve)
        for place in self.peak_places():
            self._draw_peak(painter, place)
        for name, turn in data.marks:
            self._draw_mark(painter, name, turn)

    def _draw_mark(self, painter: QPainter, name: str, turn: float) -> None:
        """Draw a dot on the curve, and its name where there is room: further out, or within."""
        t, dial, font = theme(), self.dial, theme().font(12)
        radius, wide = dial.radius(value_at(self._data.curve, turn)), text_width(font, name)
        half = wide / 2.0 * abs(math.sin(math.radians(turn)))
        away, taken = half + t.px(12), self.peak_places()
        for far in (radius + away, radius - away):
            middle = at_turn(dial.centre, far, turn)
            clear = dial.core + half < far < dial.rim - half and not any(
                abs(x - middle[0]) < wide / 2.0 + t.px(6) and abs(y - middle[1]) < t.px(12)
                for x, y in taken
            )
            if clear:
                draw_text(painter, middle, name, font, t.c.dim)
                break
        place = at_turn(dial.centre, radius, turn)
        disc(painter, place, t.px(7) / 2.0, t.c.text, t.c.bg, t.line_width + 0.5)

    def _draw_rim(self, painter: QPainter, t: Theme, dial: Dial) -> None:
        disc(painter, dial.centre, dial.rim, None, t.c.ctl, t.line_width)
        for turn in range(0, 360, 30):
            length = px(8) if turn % 90 == 0 else px(4)
            inner = at_turn(dial.centre, dial.rim - length, turn)
            painter.drawLine(QPointF(*inner), QPointF(*at_turn(dial.centre, dial.rim, turn)))

    def _draw_numbers(self, painter: QPainter) -> None:
        """Draw 0° and 180°; a number makes way for the dot."""
        t, dial = theme(), self.dial
        dot = at_turn(dial.centre, dial.rim, self.needle)
        for turn, text in ((0.0, "0°"), (180.0, "180°")):
            place = at_turn(dial.centre, dial.rim + px(_INSET) / 2.0, turn)
            room = px(12) + px(4) * len(text)
            aside = abs(place[0] - dot[0]) > room or abs(place[1] - dot[1]) > px(20)
            if aside or not self._data.curve:
                draw_text(painter, place, text, t.font(12), t.c.dim)

    def _draw_peak(self, painter: QPainter, place: Point, *, hovered: bool = False) -> None:
        t = theme()
        radius = px(8) / 2.0 - 0.75
        fill = t.c.text if hovered else t.c.bg
        disc(painter, place, radius, fill, t.c.bg, 4.5)
        disc(painter, place, radius, fill, t.c.text, t.line_width + 0.5)

    def _draw_head(self, painter: QPainter) -> None:
        t, dial = theme(), self.dial
        size = dial.core * _HEAD / _CORE
        painter.setBrush(t.c.raised)
        painter.setPen(QPen(t.c.text, t.line_width + 0.75))
        painter.drawPath(closed_path(head_outline(dial.centre, size, self.needle)))

    def _draw_needle(self, painter: QPainter) -> None:
        t, dial = theme(), self.dial
        nose = at_turn(dial.centre, dial.core * _HEAD / _CORE * 1.2, self.needle)
        tip = at_turn(dial.centre, dial.rim, self.needle)
        painter.setPen(pen(t.c.amber, 2.0 * t.line_width))
        painter.drawLine(QPointF(*nose), QPointF(*tip))
        radius = px(16) / 2.0
        disc(painter, tip, radius, t.c.bg, t.c.amber, t.line_width + 0.75)
        disc(painter, tip, radius - 2.0, t.c.amberfill)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose a peak, or take the needle."""
        if event.button() != Qt.MouseButton.LeftButton or not self._data.curve:
            super().mousePressEvent(event)
            return
        point = (event.position().x(), event.position().y())
        peak = hit(self.peak_places(), point, px(_GRAB))
        dial = self.dial
        if peak is not None:
            self._choose(peak)
        elif _STILL < math.dist(point, dial.centre) <= dial.rim + px(_INSET):
            self.begin_drag(turn_at(dial.centre, point))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Lead the needle, or light up the peak under the pointer."""
        super().mouseMoveEvent(event)
        if self._dragging:
            return
        point = (event.position().x(), event.position().y())
        hovered = hit(self.peak_places(), point, px(_GRAB))
        if hovered != self._hovered:
            self._hovered = hovered
            shape = Qt.CursorShape
            self.setCursor(shape.ArrowCursor if hovered is None else shape.PointingHandCursor)
            self.update()

    def turn_under(self, point: Point) -> float | None:
        """Give the turn toward a pointer; none near the middle."""
        far = math.dist(point, self.dial.centre) > _STILL
        return turn_at(self.dial.centre, point) if far else None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go to the next peak, or move the needle."""
        ways = {Qt.Key.Key_PageDown: 1.0, Qt.Key.Key_PageUp: -1.0}
        way = ways.get(Qt.Key(event.key()))
        if way is None:
            super().keyPressEvent(event)
            return
        stops = [(turn, index) for index, turn in enumerate(self._data.peaks)]
        if self._best is not None:
            stops.append((self._best, -1))
        # Half a degree on: the needle itself is no next peak.
        ahead = [((way * (turn - self.needle) - 0.5) % 360.0, turn, i) for turn, i in stops]
        if ahead:
            _, turn, index = min(ahead)
            if index < 0:
                self.turn_to(turn)
                self.released.emit(self.needle)
            else:
                self._choose(index)

    def _choose(self, peak: int) -> None:
        self.set_needle(self._data.peaks[peak])
        self.peak_chosen.emit(peak)
