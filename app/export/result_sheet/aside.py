"""Beside the panorama: how many styles are in reach, and the best of them; below all: the key."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.core.solver import pictures
from app.export.result_sheet import plot
from app.export.result_sheet.theme import AMBER, DIM, LINE, ON_TAG, TAG, TEXT
from app.export.result_sheet.words import arc_words, side_words, turn_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.export.result_sheet.canvas import Canvas, Point
    from app.export.result_sheet.card import CardData
    from app.export.result_sheet.lettering import Lettering

WIDTH: Final = 452.0
KEY_HEIGHT: Final = 112.0
_PICTURE: Final = 220.0
_KEY_COLUMNS: Final = 3


def draw_aside(canvas: Canvas, at: Point, cards: Sequence[CardData], lettering: Lettering) -> None:
    """Draw the count and the best style."""
    x, y = at
    reach = sum(data.style.attainable for data in cards)
    end = lettering.draw(canvas, (x, y + 44), str(reach), 48, 700, TEXT)
    end = lettering.draw(canvas, (end + 10, y + 44), f"of {len(cards)}", 28, 600, DIM)
    lettering.draw(canvas, (x, y + 74), "styles in reach at this place", 16, 600, TEXT)
    canvas.panel((x, y + 96, WIDTH, 1.0), LINE)
    if reach:
        _draw_best(canvas, (x, y + 97), cards[0], lettering)
        return
    words = (
        "No style reaches its limits here, at any turn. Look for a place with one strong light"
        " and shade around it, or bring a lamp."
    )
    _paragraph(canvas, (x, y + 132), words, WIDTH, lettering, 14)


def _draw_best(canvas: Canvas, at: Point, data: CardData, lettering: Lettering) -> None:
    x, y = at
    style = data.style
    title = lettering.shorten(style.title or style.name, 20, WIDTH - 120, 600)
    end = lettering.draw(canvas, (x, y + 38), title, 20, 600, TEXT)
    side = lettering.shorten(side_words(style, data.places), 14, x + WIDTH - end - 130)
    lettering.draw(canvas, (end + 10, y + 38), side, 14, 400, DIM)
    lettering.draw(canvas, (x + WIDTH, y + 38), "best match here", 14, 400, DIM, "right")
    size, direction = turn_words(style.turn_refined_deg)
    tags = ("Target", f"Here, at {size} {direction}" if size != "0°" else "Here, without a turn")
    for column, (linear, tag) in enumerate(zip((data.target, data.picture), tags, strict=True)):
        left = x + column * (_PICTURE + 12.0)
        box = (left, y + 54, _PICTURE, _PICTURE)
        canvas.picture(box, pictures.portrait(linear, data.coverage, canvas.size_of(box)), 8.0)
        width = lettering.width(tag, 12, 500) + 16
        canvas.panel((left + 8, y + 54 + _PICTURE - 30, width, 22), TAG, 4.0)
        lettering.draw(canvas, (left + 16, y + 54 + _PICTURE - 15), tag, 12, 500, ON_TAG)
    _draw_turn(canvas, (x, y + 54 + _PICTURE), data, lettering)


def _draw_turn(canvas: Canvas, at: Point, data: CardData, lettering: Lettering) -> None:
    """Draw the turn in large figures, and which way to walk."""
    x, y = at
    style = data.style
    size, direction = turn_words(style.turn_refined_deg)
    end = lettering.draw(canvas, (x - 2, y + 66), size, 56, 700, AMBER) + 18
    # Seen from above the photographer faces the sitter, so that clockwise is to their left.
    hand = {"clockwise": "left", "counter-clockwise": "right"}.get(direction)
    start = end
    if hand:
        plot.turn_icon(canvas, (end + 8, y + 34), AMBER, clockwise=direction == "clockwise")
        start = end + 24
    lettering.draw(canvas, (start, y + 40), direction, 20, 600, TEXT)
    arc = f"good from {arc_words(style.arc_deg)}"
    lettering.draw(canvas, (end, y + 64), arc, 14, 400, DIM)
    words = (
        f"Walk to your {hand}. The sitter turns with you."
        if hand
        else "You and the sitter stay as you stand."
    )
    _paragraph(canvas, (x, y + 100), words, WIDTH, lettering, 14)


def draw_key(canvas: Canvas, at: Point, width: float, limit: float, lettering: Lettering) -> None:
    """Draw what the parts of a card mean."""
    x, y = at
    rows = (
        ("Pictures", "left the style under its studio lamps, right this place at the best turn"),
        ("Turn", "from where the photographer stands at turn 0, as seen from above"),
        (
            "Round plot",
            f"match over the turn, 0° up and clockwise to the right; dashed circle: {limit:.0f}",
        ),
        ("Amber", "the best turn, and the turns around it that are within 3 % of it"),
        ("Match", f"likeness to the target; the tick is the limit of reach, {limit:.0f} of 100"),
        ("Strength", "depth of light and shadow; the studio has 100"),
    )
    canvas.panel((x, y, width, 1.0), LINE)
    column_width = (width - (_KEY_COLUMNS - 1) * 32.0) / _KEY_COLUMNS
    for index, (label, meaning) in enumerate(rows):
        column, row = divmod(index, 2)
        left = x + column * (column_width + 32.0)
        top = y + 32 + row * 44
        lettering.draw(canvas, (left, top), label, 12, 600, TEXT)
        _paragraph(canvas, (left + 84, top), meaning, column_width - 84, lettering, 12)


def _paragraph(
    canvas: Canvas, at: Point, text: str, width: float, lettering: Lettering, size: float
) -> None:
    """Draw wrapped text from its first baseline on."""
    x, y = at
    leading = size + (6.0 if size > 12 else 4.0)
    for index, line in enumerate(lettering.wrap(text, size, width)):
        lettering.draw(canvas, (x, y + leading * index), line, size, 400, DIM)
