"""A style's card on the result sheet: target and picture, turn or reason, match and meter.

This module also contains small drawings used elsewhere on the sheet, such as the turn icon.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.angles import at_turn, direction_of
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.portrait import display_pictures as pictures
from app.core.solver.style_result import StyleResult
from app.core.text import tr
from app.export.canvas import (
    Colour,
    Page,
    Point,
    circle_points,
    sector,
    shorten,
    text_width,
    wrap_text,
)
from app.export.theme import Dark, draw_meter
from app.words.phrases.directions import place_words
from app.words.phrases.quantities import contrast_words
from app.words.phrases.turns import arc_words, direction_words, size_words
from app.words.why_out_of_reach import reason_sentence

WIDTH: Final = 256.0
_PAD: Final = 12.0
_PICTURE: Final = 112.0
_PLOT: Final = 88.0
_BLOCK_TOP: Final = _PAD + _PICTURE + 58.0
_FOOT: Final = 44.0
_REASON_WIDTH: Final = WIDTH - 2 * _PAD - _PLOT - 12.0
_REASON_SIZE: Final = 12.0
_REASON_LEADING: Final = 16.0
_ICON_RADIUS: Final = 6.25


@dataclass(frozen=True, slots=True)
class CardData:
    """The contents of a card.

    Attributes:
        draw: Function that renders two sRGB pictures of the head at a size given in rows and
            columns: first as lit by the studio lamps, then as lit at this place at the best turn.
    """

    style: StyleResult
    draw: Callable[[tuple[int, int]], Sequence[Bytes]]
    places: Mapping[str, str]
    limit: float

    def pictures(self, size: tuple[int, int]) -> list[FloatImage]:
        """Return both pictures as float arrays for the canvas."""
        return [np.asarray(picture / 255, np.float32) for picture in self.draw(size)]


def height_of(data: CardData) -> float:
    """Return the height that a card needs for its text, in logical pixels."""
    lines = _reason_lines(data.style)
    return _BLOCK_TOP + max(_PLOT, 24.0 + _REASON_LEADING * len(lines)) + _FOOT


def draw_card(canvas: Page, at: Point, height: float, data: CardData) -> None:
    """Draw a card."""
    x, y = at
    style = data.style
    canvas.panel((x, y, WIDTH, height), Dark.PANEL, 8.0, Dark.LINE)
    size = canvas.size_of((x + _PAD, y + _PAD, _PICTURE, _PICTURE))
    for column, picture in enumerate(data.pictures(size)):
        box = (x + _PAD + column * (_PICTURE + 8.0), y + _PAD, _PICTURE, _PICTURE)
        canvas.picture(box, picture if style.attainable else pictures.greyed(picture), 6.0)
    inner = WIDTH - 2 * _PAD
    main = Dark.TEXT if style.attainable else Dark.DIM
    title = shorten(style.title or style.name, 16, inner, 600)
    canvas.text((x + _PAD, y + _PAD + _PICTURE + 26), title, 16, 600, main)
    side = shorten(side_of(style, data.places), 12, inner)
    canvas.text((x + _PAD, y + _PAD + _PICTURE + 44), side, 12, 400, Dark.DIM)
    block = (x + _PAD, y + _BLOCK_TOP)
    if style.attainable:
        _draw_turn(canvas, block, style)
    else:
        _draw_reason(canvas, block, style)
    _draw_polar(
        canvas,
        (x + WIDTH - _PAD - _PLOT / 2.0, y + _BLOCK_TOP + _PLOT / 2.0),
        _PLOT / 2.0 - 4.0,
        [float(value) for value in np.asarray(style.match_curve, np.float64)],
        style.turn_refined_deg,
        style.arc_deg if style.attainable else None,
        data.limit,
    )
    _draw_foot(canvas, (x + _PAD, y + height - _FOOT), inner, data)


def _draw_turn(canvas: Page, at: Point, style: StyleResult) -> None:
    x, y = at
    turn, start = style.turn_refined_deg, x
    direction = direction_of(turn)
    if direction != "none":
        draw_turn_icon(canvas, (x + 8.5, y + 18), Dark.AMBER, clockwise=direction == "clockwise")
        start = x + 24
    canvas.text((start, y + 28), size_words(turn), 28, 700, Dark.AMBER)
    canvas.text((x, y + 48), direction_words(turn), 14, 600, Dark.TEXT)
    canvas.text((x, y + 70), tr("good from"), 12, 400, Dark.DIM)
    canvas.text((x, y + 86), arc_words(style.arc_deg), 12, 400, Dark.TEXT)


def _reason_lines(style: StyleResult) -> list[str]:
    if style.attainable:
        return []
    return wrap_text(reason_sentence(style.shortfall), _REASON_SIZE, _REASON_WIDTH)


def _draw_reason(canvas: Page, at: Point, style: StyleResult) -> None:
    x, y = at
    _draw_not_possible_icon(canvas, (x + 7.5, y + 9), Dark.DIM)
    canvas.text((x + 21, y + 14), tr("out of reach"), 14, 600, Dark.DIM)
    for index, line in enumerate(_reason_lines(style)):
        baseline = y + 36 + _REASON_LEADING * index
        canvas.text((x, baseline), line, _REASON_SIZE, 400, Dark.DIM)


def _draw_foot(canvas: Page, at: Point, width: float, data: CardData) -> None:
    """Draw the numbers and the meter at the bottom of a card."""
    x, y = at
    style = data.style
    main = Dark.TEXT if style.attainable else Dark.DIM
    end = canvas.text((x, y + 20), tr("Match") + " ", 12, 400, Dark.DIM)
    # Round down, so that 44.9 does not read as the limit that it misses.
    canvas.text((end + 4, y + 20), f"{max(int(style.match), 0)}", 12, 600, main)
    value = contrast_words(style.strength)
    canvas.text((x + width, y + 20), value, 11, 600, main, "right")
    before = x + width - text_width(value, 11, 600) - 5
    canvas.text((before, y + 20), tr("Contrast"), 11, 400, Dark.DIM, "right")
    colours = (Dark.TEXT if style.attainable else Dark.CTL, Dark.TRACK, Dark.PANEL)
    draw_meter(canvas, (x, y + 28, width, 4.0), style.match, data.limit, colours)


def side_of(style: StyleResult, places: Mapping[str, str]) -> str:
    """Name the side as the sitter and the camera see it, or say where the light comes from."""
    return place_words(style.side, places.get(style.name, ""))


def _draw_polar(
    canvas: Page,
    centre: Point,
    radius: float,
    curve: Sequence[float],
    turn_deg: float,
    arc_deg: tuple[float, float] | None,
    limit: float,
) -> None:
    """Draw the match as a polar plot of the turn, clockwise from 0 degrees at the top.

    Args:
        curve: Match at evenly spaced turns, clockwise from 0. A match of 100 reaches the rim, and
            values below 0 are drawn as 0.
        arc_deg: tuple[float, float] or None. Tolerance arc in degrees, clockwise from the first
            turn to the second, or None to draw the style as out of reach.
    """
    reach = arc_deg is not None
    canvas.stroke(circle_points(centre, radius), Dark.CTL if reach else Dark.LINE, 1.0)
    for quarter in range(4):
        ends = [at_turn(centre, radius + step, 90.0 * quarter) for step in (0.0, 3.0)]
        canvas.stroke(ends, Dark.CTL, 1.0)
    canvas.stroke(
        circle_points(centre, radius * limit / 100.0, 240), Dark.CTL, 0.75, dashes=(2.0, 2.5)
    )
    if arc_deg is not None:
        canvas.shape(sector(centre, radius, arc_deg), Dark.AMBER, 0.28)
    count = len(curve)
    outline = [
        at_turn(centre, radius * min(max(value, 0.0), 100.0) / 100.0, 360.0 * index / count)
        for index, value in enumerate(curve)
    ]
    canvas.shape(outline, Dark.TEXT, 0.07)
    canvas.stroke(outline, Dark.TEXT if reach else Dark.DIM, 1.25, closed=True)
    tip = at_turn(centre, radius, turn_deg)
    if reach:
        canvas.stroke([centre, tip], Dark.AMBER, 1.5)
        canvas.dot(tip, 5.0, Dark.PANEL)
        canvas.dot(tip, 4.0, Dark.AMBER)
    else:
        canvas.dot(tip, 4.0, Dark.DIM)
        canvas.dot(tip, 2.75, Dark.PANEL)


def draw_turn_icon(canvas: Page, centre: Point, colour: Colour, *, clockwise: bool) -> None:
    """Draw a curved arrow, 16 px wide."""
    sign = 1.0 if clockwise else -1.0
    arc = [at_turn(centre, _ICON_RADIUS, sign * angle) for angle in range(105, 415, 5)]
    canvas.stroke(arc, colour, 1.75)
    x, y = centre
    corner = (x + sign * _ICON_RADIUS, y - 2.1)
    canvas.stroke([(corner[0], y - 7.0), corner, (corner[0] - sign * 4.9, y - 2.1)], colour, 1.75)


def _draw_not_possible_icon(canvas: Page, centre: Point, colour: Colour) -> None:
    """Draw a circle crossed by a bar, 16 px wide."""
    canvas.stroke(circle_points(centre, _ICON_RADIUS), colour, 1.5)
    canvas.stroke([at_turn(centre, _ICON_RADIUS, angle) for angle in (-45.0, 135.0)], colour, 1.5)
