"""The rings, dots and names on the match circle, for peaks, marks and the needle's handle.

Positions and sizes are in logical pixels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from PySide6.QtGui import QPainter

from app.core.base.angles import at_turn
from app.ui.plots.parts.base import disc, draw_text
from app.ui.plots.parts.geometry import Dial, Point
from app.ui.theme import px, theme
from app.ui.widgets.paint import text_width


def name_place(
    dial: Dial, radius: float, turn: float, name: str, peaks: Sequence[Point]
) -> Point | None:
    """Return a free position for a mark's name, or None if no position is free.

    The position is on either the outer or the inner side of the mark's dot.
    """
    wide = text_width(theme().font(12), name)
    half = wide / 2.0 * abs(math.sin(math.radians(turn)))
    away = half + px(12)
    for far in (radius + away, radius - away):
        middle = at_turn(dial.centre, far, turn)
        clear = dial.core + half < far < dial.rim - half and not any(
            abs(x - middle[0]) < wide / 2.0 + px(6) and abs(y - middle[1]) < px(12)
            for x, y in peaks
        )
        if clear:
            return middle
    return None


def draw_words(words: str, painter: QPainter, middle: Point) -> None:
    """Draw the name of a mark, or a number of degrees, centred on a point."""
    draw_text(painter, middle, words, theme().font(12), theme().c.dim)


def draw_dot(painter: QPainter, place: Point) -> None:
    """Draw a dot on the curve."""
    t = theme()
    disc(painter, place, px(7) / 2.0, t.c.text, t.c.bg, t.line_width + 0.5)


def draw_peak(painter: QPainter, place: Point, *, hovered: bool = False) -> None:
    """Draw the ring of a secondary peak, which is filled while the pointer is over it."""
    t = theme()
    radius = px(8) / 2.0 - 0.75
    fill = t.c.text if hovered else t.c.bg
    disc(painter, place, radius, fill, t.c.bg, 4.5)
    disc(painter, place, radius, fill, t.c.text, t.line_width + 0.5)


def draw_needle_dot(painter: QPainter, place: Point) -> None:
    """Draw the needle's handle on the rim."""
    t, radius = theme(), px(16) / 2.0
    disc(painter, place, radius, t.c.bg, t.c.amber, t.line_width + 0.75)
    disc(painter, place, radius - 2.0, t.c.amberfill)
