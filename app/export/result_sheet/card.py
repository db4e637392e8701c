"""One style's card: target and picture, turn or reason, match over the turn, meter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.solver import pictures
from app.export.result_sheet import plot
from app.export.result_sheet.theme import AMBER, CTL, DIM, LINE, PANEL, TEXT
from app.export.result_sheet.words import SheetStyle, arc_words, side_words, turn_words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.core.base.colour import FloatImage
    from app.export.result_sheet.canvas import Canvas, Point
    from app.export.result_sheet.lettering import Lettering

WIDTH: Final = 256.0
_PAD: Final = 12.0
_PICTURE: Final = 112.0
_PLOT: Final = 88.0
_BLOCK_TOP: Final = _PAD + _PICTURE + 58.0
_FOOT: Final = 44.0
_REASON_WIDTH: Final = WIDTH - 2 * _PAD - _PLOT - 12.0
_REASON_SIZE: Final = 12.0
_REASON_LEADING: Final = 16.0


@dataclass(frozen=True, slots=True)
class CardData:
    """What a card shows.

    Attributes
    ----------
    target, picture : NDArray[np.float32], (N, N, 3)
        Linear pictures: under the studio lamps, and here at the best turn.
    coverage : NDArray[np.float32], (N, N)
        Share of each pixel covered by the head.
    """

    style: SheetStyle
    target: FloatImage
    picture: FloatImage
    coverage: FloatImage
    places: Mapping[str, str]
    limit: float


def height_of(data: CardData, lettering: Lettering) -> float:
    """Height that a card needs for all its words.

    Returns
    -------
    float
        Logical pixels.
    """
    lines = _reason_lines(data.style, lettering)
    return _BLOCK_TOP + max(_PLOT, 24.0 + _REASON_LEADING * len(lines)) + _FOOT


def draw_card(
    canvas: Canvas, at: Point, height: float, data: CardData, lettering: Lettering
) -> None:
    """Draw a card."""
    x, y = at
    style = data.style
    canvas.panel((x, y, WIDTH, height), PANEL, 8.0, LINE)
    for column, linear in enumerate((data.target, data.picture)):
        box = (x + _PAD + column * (_PICTURE + 8.0), y + _PAD, _PICTURE, _PICTURE)
        shown = pictures.portrait(linear, data.coverage, canvas.size_of(box))
        canvas.picture(box, shown if style.attainable else pictures.greyed(shown), 6.0)
    inner = WIDTH - 2 * _PAD
    main = TEXT if style.attainable else DIM
    title = lettering.shorten(style.title or style.name, 16, inner, 600)
    lettering.draw(canvas, (x + _PAD, y + _PAD + _PICTURE + 26), title, 16, 600, main)
    side = lettering.shorten(side_words(style, data.places), 12, inner)
    lettering.draw(canvas, (x + _PAD, y + _PAD + _PICTURE + 44), side, 12, 400, DIM)
    block = (x + _PAD, y + _BLOCK_TOP)
    if style.attainable:
        _draw_turn(canvas, block, style, lettering)
    else:
        _draw_reason(canvas, block, style, lettering)
    plot.polar(
        canvas,
        (x + WIDTH - _PAD - _PLOT / 2.0, y + _BLOCK_TOP + _PLOT / 2.0),
        _PLOT / 2.0 - 4.0,
        [float(value) for value in np.asarray(style.match_curve, np.float64)],
        style.turn_refined_deg,
        style.arc_deg if style.attainable else None,
        data.limit,
    )
    _draw_foot(canvas, (x + _PAD, y + height - _FOOT), inner, data, lettering)


def _draw_turn(canvas: Canvas, at: Point, style: SheetStyle, lettering: Lettering) -> None:
    x, y = at
    size, direction = turn_words(style.turn_refined_deg)
    start = x
    if direction.endswith("clockwise"):
        plot.turn_icon(canvas, (x + 8.5, y + 18), AMBER, clockwise=direction == "clockwise")
        start = x + 24
    lettering.draw(canvas, (start, y + 28), size, 28, 700, AMBER)
    lettering.draw(canvas, (x, y + 48), direction, 14, 600, TEXT)
    lettering.draw(canvas, (x, y + 70), "good from", 12, 400, DIM)
    lettering.draw(canvas, (x, y + 86), arc_words(style.arc_deg), 12, 400, TEXT)


def _reason_lines(style: SheetStyle, lettering: Lettering) -> list[str]:
    if style.attainable:
        return []
    return lettering.wrap(style.reason or "", _REASON_SIZE, _REASON_WIDTH)


def _draw_reason(canvas: Canvas, at: Point, style: SheetStyle, lettering: Lettering) -> None:
    x, y = at
    plot.not_possible_icon(canvas, (x + 7.5, y + 9), DIM)
    lettering.draw(canvas, (x + 21, y + 14), "out of reach", 14, 600, DIM)
    for index, line in enumerate(_reason_lines(style, lettering)):
        baseline = y + 36 + _REASON_LEADING * index
        lettering.draw(canvas, (x, baseline), line, _REASON_SIZE, 400, DIM)


def _draw_foot(
    canvas: Canvas, at: Point, width: float, data: CardData, lettering: Lettering
) -> None:
    """Numbers and the meter."""
    x, y = at
    style = data.style
    main = TEXT if style.attainable else DIM
    end = lettering.draw(canvas, (x, y + 20), "Match ", 12, 400, DIM)
    lettering.draw(canvas, (end + 4, y + 20), _whole(style.match), 12, 600, main)
    value = _whole(style.strength)
    lettering.draw(canvas, (x + width, y + 20), value, 12, 600, main, "right")
    before = x + width - lettering.width(value, 12, 600) - 5
    lettering.draw(canvas, (before, y + 20), "Strength", 12, 400, DIM, "right")
    meter_box = (x, y + 28, width, 4.0)
    plot.meter(canvas, meter_box, style.match, data.limit, TEXT if style.attainable else CTL)


def _whole(value: float) -> str:
    # Rounded down, so that 44.9 does not read as the limit that it misses.
    return f"{max(int(np.floor(value)), 0)}"
