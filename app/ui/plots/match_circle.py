"""The circular plot of the match at every turn, drawn with pyqtgraph around the dial's centre."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QSizePolicy

from app.core.base.angles import at_turn, wrap
from app.core.text import tr
from app.ui.plots.match_circle_rings import (
    draw_dot,
    draw_needle_dot,
    draw_peak,
    draw_words,
    name_place,
)
from app.ui.plots.parts.base import TurnPlot
from app.ui.plots.parts.curve_items import Backdrop, Curve, Draw, Mark, MarkGroup, Pieces
from app.ui.plots.parts.geometry import (
    Dial,
    Point,
    circle,
    finely,
    head_outline,
    hit,
    sector,
    turn_at,
    value_at,
)
from app.ui.theme import px, theme
from app.ui.widgets.paint import faint, pen, text_width
from app.words.phrases.turns import arc_words, turn_words

_INSET: Final = 18.0  # distance from the widget's edge to the rim, leaving room for the numbers
_CORE: Final = 26.0  # radius of the value 0, with the head inside
_HEAD: Final = 17.0  # half the length of the head
_GRAB: Final = 12.0  # distance at which the pointer hits a peak
_STILL: Final = 6.0  # a pointer closer to the centre than this has no direction
_CURVE_FILL: Final = 0.12
_ARC_FILL: Final = 0.28
_O: Final = (0.0, 0.0)
_ENDS: Final = ("0°", "180°")


@dataclass(frozen=True, slots=True)
class _Data:
    curve: tuple[float, ...]
    limit: float
    arc: tuple[float, float] | None
    best: float | None
    peaks: tuple[float, ...]
    marks: tuple[tuple[str, float], ...] = ()


class PolarPlot(TurnPlot):
    """The match (or quality) at every turn, with 0° at the top and clockwise turns on the right.

    The arrow keys move the needle by 1°, or by 10° with Shift. Home moves it to the best turn, and
    Page Down and Page Up move it to the next peak clockwise or counter-clockwise.
    """

    policies = (QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    peak_chosen = Signal(int)
    """Emitted with the index of a secondary peak when it is chosen with a click or a page key."""

    def __init__(self, name: str = tr("Match by turn"), size: int = 224) -> None:
        super().__init__(name)
        self._side = px(size)
        self._data = _Data((), 45.0, None, None, ())
        self._hovered: int | None = None
        self._numbers = self._limit_words = ""
        self._marked: tuple[str, ...] = ()
        self._make_items()
        self.setMouseTracking(True)
        self.setToolTip(
            tr("Drag to try another turn. Arrow keys: 1°, or 10° with Shift. Home: best turn")
        )
        self.describe()

    def _make_items(self) -> None:
        """Create the items from back to front."""
        t, add = theme(), self.panel.add
        self.panel.paint_changes_only()
        thin, line = QPen(t.c.ctl, t.line_width), QPen(t.c.text, t.line_width + 0.75)
        dashes = QPen(t.c.dim, t.line_width)
        dashes.setDashPattern([3.0 / t.line_width, 3.0 / t.line_width])
        self._ground = Curve(fill=t.c.bg)
        self._inside = Curve(fill=faint(t.c.text, _CURVE_FILL))
        self._limit = Curve(dashes)
        self._arc = Curve(fill=faint(t.c.amberfill, _ARC_FILL))
        self._rim, self._ticks, self._curve = Curve(thin), Pieces(thin), Curve(line)
        parts = (self._ground, self._inside, self._limit, self._arc, self._rim, self._ticks)
        self._backdrop = add(Backdrop(*parts, self._curve))
        self._peaks, self._marks = add(MarkGroup()), add(MarkGroup())
        self._ends = [add(Mark(partial(draw_words, text), px(32))) for text in _ENDS]
        self._head = Curve(line, fill=t.c.raised)
        self._needle_line = Curve(pen(t.c.amber, 2.0 * t.line_width))
        self._dot = Mark(draw_needle_dot, px(24))
        self._turned = add(pg.ItemGroup())
        for item in (self._head, self._needle_line, self._dot):
            self._turned.addItem(item)

    def sizeHint(self) -> QSize:
        """Return the size of the preferred square."""
        return QSize(self._side, self._side)

    def take_side(self, side: int) -> None:
        """Set the side of the preferred square in logical pixels."""
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
            curve: Match, from 0 to 100, at evenly spaced turns clockwise from 0, or an empty
                sequence to show a bare dial.
            limit: Lowest match that counts as within reach.
            arc: Tolerance arc (from, to) in degrees, clockwise, which may wrap around, or None if
                the style is out of reach.
            best: Best turn in degrees, or None if there is none.
            peaks: Turns of the other peaks in degrees, not including the best turn.
            needle: Turn of the needle in degrees, or None to put the needle at the best turn.
            marks: Name and turn, in degrees, of each dot on the curve.
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
        self._show_data()
        turn = data.best if needle is None else needle
        self.set_needle(0.0 if turn is None else turn)

    def tell(self, numbers: str, limit: str, marked: Sequence[str] = ()) -> None:
        """Set the text spoken for the needle, the limit and the marks."""
        self._numbers, self._limit_words, self._marked = numbers, limit, tuple(marked)
        self.describe()

    def describe(self) -> None:
        """Describe the needle, match, best turn, arc, limit, marks and peaks for screen readers."""
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
        words.append(self._limit_words or tr("Limit of reach: {limit:.0f}", limit=data.limit))
        words += self._marked
        words += [tr("Second peak: {turn}", turn=turn_words(turn)) for turn in data.peaks]
        self.say(". ".join(words) + ".")

    @property
    def dial(self) -> Dial:
        """The circles of the plot at its current size, measured in logical pixels."""
        centre = (self.width() / 2.0, self.height() / 2.0)
        rim = max(min(self.width(), self.height()) / 2.0 - px(_INSET), 1.0)
        return Dial(centre, min(float(px(_CORE)), rim * 0.4), rim)

    def peak_places(self) -> list[Point]:
        """Centres of the rings that mark the secondary peaks, in logical pixels."""
        dial, data = self.dial, self._data
        return [dial.place(turn, value_at(data.curve, turn)) for turn in data.peaks if data.curve]

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Update the layout of the dial."""
        super().resizeEvent(event)
        dial, wide, high = self._round, float(self.width()), float(self.height())
        self.panel.look_at(QRectF(-wide / 2.0, -high / 2.0, wide, high))
        whole = circle(dial.rim)
        self._ground.set_points(whole)
        self._rim.set_points(whole)
        around = range(0, 360, 30)
        inner = [dial.rim - (px(8) if turn % 90 == 0 else px(4)) for turn in around]
        ticks = [
            at_turn(_O, r, a) + at_turn(_O, dial.rim, a) for r, a in zip(inner, around, strict=True)
        ]
        self._ticks.set_ends(
            np.array(ticks), QRectF(-dial.rim, -dial.rim, 2.0 * dial.rim, 2.0 * dial.rim)
        )
        size = dial.core * _HEAD / _CORE
        self._head.set_points(finely(head_outline(_O, size, 0.0)))
        self._needle_line.set_points([(0.0, -1.2 * size), (0.0, -dial.rim)])
        self._dot.setPos(0.0, -dial.rim)
        for number, down in zip(self._ends, (-1.0, 1.0), strict=True):
            number.setPos(0.0, down * (dial.rim + px(_INSET) / 2.0))
        self._show_data()
        self._show_needle()

    @property
    def _round(self) -> Dial:
        """The dial, with its centre at the origin of the items' coordinates."""
        return replace(self.dial, centre=_O)

    def _show_data(self) -> None:
        data, dial = self._data, self._round
        self._limit.set_points(circle(dial.radius(data.limit)))
        curve = finely(dial.outline(data.curve) if len(data.curve) > 2 else [])
        self._inside.set_points(curve)
        self._curve.set_points(curve)
        self._arc.set_points([] if data.arc is None else sector(_O, dial.rim, data.arc))
        self._backdrop.changed()
        self._lay_signs(dial)

    def _lay_signs(self, dial: Dial) -> None:
        """Place the peaks and marks on the curve, and the names of the marks beside it."""
        x, y = self.dial.centre
        places = [(place[0] - x, place[1] - y) for place in self.peak_places()]
        signs: list[tuple[Point, Draw, float]] = []
        for name, turn in self._data.marks:
            radius = dial.radius(value_at(self._data.curve, turn))
            signs.append((at_turn(_O, radius, turn), draw_dot, px(16)))
            middle = name_place(dial, radius, turn, name, places)
            if middle is not None:
                wide = text_width(theme().font(12), name)
                signs.append((middle, partial(draw_words, name), wide))
        self._peaks.show_marks([(place, draw_peak, px(16)) for place in places])
        self._marks.show_marks(signs)

    def _show_needle(self) -> None:
        """Turn the head and the needle, and hide a number if the dot would cover it."""
        has_curve = bool(self._data.curve)
        self._turned.setRotation(self.needle)
        self._needle_line.setVisible(has_curve)
        self._dot.setVisible(has_curve)
        dial = self.dial
        dot = at_turn(_O, dial.rim, self.needle)
        for number, text in zip(self._ends, _ENDS, strict=True):
            place, room = number.pos(), px(12) + px(4) * len(text)
            aside = abs(place.x() - dot[0]) > room or abs(place.y() - dot[1]) > px(20)
            number.setVisible(aside or not has_curve)

    def set_needle(self, turn_deg: float) -> None:
        """Move the needle without emitting a signal."""
        self.needle = wrap(turn_deg)
        self.describe()
        self._show_needle()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose a peak, or grab the needle."""
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
        """Move the needle, or highlight the peak under the pointer."""
        super().mouseMoveEvent(event)
        if self._dragging:
            return
        point = (event.position().x(), event.position().y())
        hovered = hit(self.peak_places(), point, px(_GRAB))
        if hovered != self._hovered:
            for index, peak in enumerate(self._peaks.marks):
                peak.set_draw(partial(draw_peak, hovered=index == hovered))
            self._hovered = hovered
            shape = Qt.CursorShape
            self.setCursor(shape.ArrowCursor if hovered is None else shape.PointingHandCursor)

    def turn_under(self, point: Point) -> float | None:
        """Return the turn at a pointer position, or None if the pointer is near the centre."""
        far = math.dist(point, self.dial.centre) > _STILL
        return turn_at(self.dial.centre, point) if far else None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the needle to the next peak, or by one step."""
        ways = {Qt.Key.Key_PageDown: 1.0, Qt.Key.Key_PageUp: -1.0}
        way = ways.get(Qt.Key(event.key()))
        if way is None:
            super().keyPressEvent(event)
            return
        stops = [(turn, index) for index, turn in enumerate(self._data.peaks)]
        if self._best is not None:
            stops.append((self._best, -1))
        # Search from half a degree further on, so that the current peak is not the next one.
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
