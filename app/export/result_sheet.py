"""The result sheet: one image of the styles possible at a place, for prints, email and notebooks.

The sheet consists of a header, the panorama with the turn for each style, the best style, a card
for each style and a key.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import direction_of
from app.core.base.arrays import Bytes
from app.core.environment.environment import Environment
from app.core.guidance.who_moves import Mode
from app.core.portrait import display_pictures as pictures
from app.core.solver.style_result import StyleResult
from app.core.styles.styles import RARE, load_styles
from app.core.text import tr
from app.export import result_card as card
from app.export.canvas import Page, Point, shorten, text_width, wrap_text
from app.export.theme import Dark, draw_logo, draw_scale, draw_tag
from app.words.phrases.directions import BARE_SIDES
from app.words.phrases.turns import (
    arc_words,
    direction_words,
    signed,
    size_words,
    turn_words,
    walking_words,
)
from app.words.portrait.heads import head_words

_COLUMNS: Final = 6
_GAP: Final = 12.0
_MARGIN: Final = 42.0
_WIDTH: Final = 2 * _MARGIN + _COLUMNS * card.WIDTH + (_COLUMNS - 1) * _GAP
_HEADER: Final = 104.0
_ASIDE_GAP: Final = 40.0
_PANORAMA_WIDTH: Final = 1104.0
_PANORAMA_HEIGHT: Final = _PANORAMA_WIDTH / 2.0
_SCALE_ROOM: Final = 26.0
_FLAG_TOP: Final = 12.0
_LANE: Final = 20.0
_FLAG_GAP: Final = 14.0
_ASIDE_WIDTH: Final = 452.0
_KEY_HEIGHT: Final = 112.0
_PICTURE: Final = 220.0
_KEY_COLUMNS: Final = 3
_OBJECTIVES: Final = {
    "picture": tr("turns by best match"),
    "paper": tr("turns by the paper’s quality C"),
}


def draw_sheet(
    results: Sequence[StyleResult],
    draw: Callable[[str, tuple[int, int]], Sequence[Bytes]],
    environment: Environment,
    title: str,
    head: str,
    *,
    objective: str = "picture",
    front_deg: float = 0.0,
    places: Mapping[str, str] | None = None,
    limit: float = 45.0,
    verdict: str = "",
) -> NDArray[np.uint8]:
    """Draw the result sheet for a place.

    Cards for styles within reach come first, followed by those for styles out of reach. Each group
    is sorted by match, with rare styles last.

    Args:
        draw: Function that renders a style by name, as for `CardData.draw`.
        front_deg: Panorama azimuth from which turns are measured, in degrees.
        places: Words for where the light comes from, keyed by the names of the styles without a
            side, or None to use those of the built-in styles.
        verdict: The verdict about the place, or "" to leave it out.

    Returns:
        NDArray[np.uint8], (H, W, 3). sRGB picture with two pixels per logical pixel.
    """
    styles = load_styles()
    if places is None:
        places = {style.name: style.place for style in styles}
    # The minimum match of a style within reach; beyond that, the rest of its signature decides.
    least = {s.name: s.signature.match[1] for s in styles if s.signature.relations}
    # As in the gallery, styles that are rarely wanted on their own come last.
    order = sorted(results, key=lambda one: (not one.attainable, one.name in RARE, -one.match))
    cards = [
        card.CardData(style, partial(draw, style.name), places, least.get(style.name, limit))
        for style in order
    ]
    flags = make_flags(order)
    heights = [card.height_of(data) for data in cards]
    rows = [max(heights[start : start + _COLUMNS]) for start in range(0, len(cards), _COLUMNS)]
    cards_top = _HEADER + 26.0 + _PANORAMA_HEIGHT + lanes_height(flags) + 24.0
    key_top = cards_top + sum(rows) + _GAP * len(rows) + 12.0
    canvas = Page(_WIDTH, key_top + _KEY_HEIGHT + _MARGIN, Dark.BG)
    _draw_header(
        canvas,
        title,
        tr("{head}, {objective}", head=head_words(head), objective=_OBJECTIVES[objective]),
    )
    bottom = _draw_panorama(canvas, (_MARGIN, _HEADER), environment, front_deg)
    _draw_flags(canvas, (_MARGIN, bottom), flags)
    _draw_aside(canvas, (_MARGIN + _PANORAMA_WIDTH + _ASIDE_GAP, _HEADER), cards, verdict)
    _draw_cards(canvas, cards, rows, cards_top)
    _draw_key(canvas, (_MARGIN, key_top), _WIDTH - 2 * _MARGIN)
    return canvas.pixels


def _draw_cards(
    canvas: Page, cards: Sequence[card.CardData], heights: Sequence[float], top: float
) -> None:
    """Draw rows of cards with the given heights, from `top` downwards."""
    for row, height in enumerate(heights):
        for column, data in enumerate(cards[row * _COLUMNS : (row + 1) * _COLUMNS]):
            card.draw_card(canvas, (_MARGIN + column * (card.WIDTH + _GAP), top), height, data)
        top += height + _GAP


def _draw_header(canvas: Page, title: str, subtitle: str) -> None:
    inner = _WIDTH - 2 * _MARGIN
    # Place names are mostly file names.
    plain = " ".join(title.replace("_", " ").split())
    name = shorten(plain, 28, inner - 220, 700)
    canvas.text((_MARGIN, 58), name, 28, 700, Dark.TEXT)
    canvas.text((_MARGIN, 82), subtitle, 14, 400, Dark.DIM)
    start = _WIDTH - _MARGIN - text_width("Turnlight", 20, 600)
    canvas.text((start, 61), "Turnlight", 20, 600, Dark.TEXT)
    draw_logo(canvas, (start - 24, 54), (13.0, 11.25, 8.5), (Dark.TEXT, Dark.BG))


@dataclass(frozen=True, slots=True)
class Flag:
    """A turn marked under the panorama by a pole with text to the right of its foot.

    Attributes:
        turn, title, side: Texts for the turn in degrees, the style and the style's side. The last
            may be empty.
    """

    x: float
    lane: int
    turn: str
    title: str
    side: str


def make_flags(styles: Sequence[StyleResult]) -> tuple[Flag, ...]:
    """Place a flag for every style within reach so that no text overlaps other text or a pole.

    Text runs to the right of its pole. From right to left, each flag takes the first lane that is
    below all poles that its text would cross and clear of the flag before it.
    """
    reach = [style for style in styles if style.attainable]
    flags: list[Flag] = []
    for style in sorted(reach, key=lambda item: -item.turn_refined_deg):
        x = _PANORAMA_WIDTH * (style.turn_refined_deg / 360.0 + 0.5)
        side = BARE_SIDES.get(style.side, "")
        flag = Flag(x, 0, signed(style.turn_refined_deg), style.title or style.name, side)
        stop = x + flag_width(flag) + _FLAG_GAP
        lane = max((other.lane + 1 for other in flags if other.x < stop), default=0)
        flags.append(replace(flag, lane=lane))
    return tuple(flags)


def flag_width(flag: Flag) -> float:
    """Return the width of a flag's text, measured from its pole, in logical pixels."""
    width = 8.0 + text_width(flag.turn, 12, 700)
    width += 6.0 + text_width(flag.title, 12, 600)
    return width + (6.0 + text_width(flag.side, 12) if flag.side else 0.0)


def lanes_height(flags: Sequence[Flag]) -> float:
    """Return the height of the flags under the panorama, in logical pixels."""
    return _FLAG_TOP + _LANE * (1 + max((flag.lane for flag in flags), default=-1))


def _draw_panorama(canvas: Page, at: Point, environment: Environment, front_deg: float) -> float:
    """Draw the panorama under its scale of turns.

    Args:
        front_deg: Panorama azimuth of the photographer, in degrees. It is drawn at the centre.
    """
    x, top = at[0], at[1] + _SCALE_ROOM
    box = (x, top, _PANORAMA_WIDTH, _PANORAMA_HEIGHT)
    strip = pictures.panorama(environment, front_deg, canvas.size_of(box))
    canvas.picture(box, strip, 8.0)
    draw_scale(canvas, box, "0°", (Dark.CTL, Dark.DIM))
    _draw_front(canvas, (x + _PANORAMA_WIDTH / 2.0, top))
    return top + _PANORAMA_HEIGHT


def _draw_flags(canvas: Page, at: Point, flags: Sequence[Flag]) -> None:
    """Draw the turn for each style under the panorama."""
    x, y = at
    for flag in flags:
        foot = y + _FLAG_TOP + _LANE * (flag.lane + 1) - 4.0
        canvas.stroke([(x + flag.x, y + 8), (x + flag.x, foot)], Dark.CTL, 1.0)
    for flag in flags:
        pole = x + flag.x
        # Amber with a dark edge is visible on any panorama.
        canvas.shape([(pole - 7.5, y + 10), (pole, y - 5.5), (pole + 7.5, y + 10)], Dark.BG)
        canvas.shape([(pole - 5, y + 8.5), (pole, y - 2), (pole + 5, y + 8.5)], Dark.AMBER)
        baseline = y + _FLAG_TOP + _LANE * (flag.lane + 1) - 5.0
        end = canvas.text((pole + 6, baseline), flag.turn, 12, 700, Dark.AMBER)
        end = canvas.text((end + 6, baseline), flag.title, 12, 600, Dark.TEXT)
        if flag.side:
            canvas.text((end + 6, baseline), flag.side, 12, 400, Dark.DIM)


def _draw_front(canvas: Page, at: Point) -> None:
    """Mark the photographer's position, at turn 0, with a dark-edged line and a tag."""
    x, y = at
    line = [(x, y), (x, y + _PANORAMA_HEIGHT)]
    canvas.stroke(line, Dark.TAG, 3.0, opacity=0.6)
    canvas.stroke(line, Dark.ON_TAG, 1.0)
    words = tr("Photographer stands here at turn 0")
    width = text_width(words, 12, 600) + 16
    canvas.panel((x - width / 2.0, y + _PANORAMA_HEIGHT - 40, width, 24), Dark.TAG, 4.0)
    canvas.text((x, y + _PANORAMA_HEIGHT - 24), words, 12, 600, Dark.ON_TAG, "middle")


def _draw_aside(canvas: Page, at: Point, cards: Sequence[card.CardData], verdict: str = "") -> None:
    """Draw the number of styles within reach, the verdict about the place, and the best style."""
    x, y = at
    reach = sum(data.style.attainable for data in cards)
    end = canvas.text((x, y + 44), str(reach), 48, 700, Dark.TEXT)
    end = canvas.text((end + 10, y + 44), tr("of {count}", count=len(cards)), 28, 600, Dark.DIM)
    canvas.text((x, y + 74), tr("styles within reach at this place"), 16, 600, Dark.TEXT)
    if verdict:
        y += 6 + _paragraph(canvas, (x, y + 98), verdict, _ASIDE_WIDTH, 14)
    canvas.panel((x, y + 96, _ASIDE_WIDTH, 1.0), Dark.LINE)
    if reach:
        _draw_best(canvas, (x, y + 97), cards[0])
        return
    words = tr(
        "No style is within reach here, whichever way you turn. Look for a place with one strong "
        "light and shade around it, or bring a lamp."
    )
    _paragraph(canvas, (x, y + 132), words, _ASIDE_WIDTH, 14)


def _draw_best(canvas: Page, at: Point, data: card.CardData) -> None:
    x, y = at
    style = data.style
    title = shorten(style.title or style.name, 20, _ASIDE_WIDTH - 120, 600)
    end = canvas.text((x, y + 38), title, 20, 600, Dark.TEXT)
    side = shorten(card.side_of(style, data.places), 14, x + _ASIDE_WIDTH - end - 130)
    canvas.text((end + 10, y + 38), side, 14, 400, Dark.DIM)
    canvas.text((x + _ASIDE_WIDTH, y + 38), tr("best match here"), 14, 400, Dark.DIM, "right")
    turn = style.turn_refined_deg
    moves = direction_of(turn) != "none"
    here = tr("Here, at {turn}", turn=turn_words(turn)) if moves else tr("Here, without a turn")
    tags = (tr("Target"), here)
    size = canvas.size_of((x, y + 54, _PICTURE, _PICTURE))
    for column, (tag, portrait) in enumerate(zip(tags, data.pictures(size), strict=True)):
        left = x + column * (_PICTURE + 12.0)
        canvas.picture((left, y + 54, _PICTURE, _PICTURE), portrait, 8.0)
        draw_tag(canvas, (left + 8, y + 54 + _PICTURE - 30), tag)
    _draw_best_turn(canvas, (x, y + 54 + _PICTURE), data)


def _draw_best_turn(canvas: Page, at: Point, data: card.CardData) -> None:
    """Draw the turn in large figures, with the direction in which to walk."""
    x, y = at
    style = data.style
    turn = style.turn_refined_deg
    direction = direction_of(turn)
    end = canvas.text((x - 2, y + 66), size_words(turn), 56, 700, Dark.AMBER) + 18
    start = end
    if direction != "none":
        clockwise = direction == "clockwise"
        card.draw_turn_icon(canvas, (end + 8, y + 34), Dark.AMBER, clockwise=clockwise)
        start = end + 24
    canvas.text((start, y + 40), direction_words(turn), 20, 600, Dark.TEXT)
    good = tr("good from {arc}", arc=arc_words(style.arc_deg))
    canvas.text((end, y + 64), good, 14, 400, Dark.DIM)
    walk, company = walking_words(direction, Mode.WALK)
    words = tr("You and the sitter stay where you are.")
    if walk:
        words = tr("{walk}. {company}", walk=walk, company=company)
    _paragraph(canvas, (x, y + 100), words, _ASIDE_WIDTH, 14)


def _draw_key(canvas: Page, at: Point, width: float) -> None:
    """Draw the key that explains the parts of a card."""
    x, y = at
    rows = (
        (
            tr("Pictures"),
            tr("left: the style in the studio; right: this place at the best turn"),
        ),
        (tr("Turn"), tr("from the photographer’s position at turn 0, as seen from above")),
        (
            tr("Round plot"),
            tr("match by turn, 0° up, clockwise to the right; dashed: the minimum"),
        ),
        (tr("Amber"), tr("the best turn, and the turns within 3% of it")),
        (
            tr("Match"),
            tr("similarity to the target; the tick is the style’s minimum"),
        ),
        (tr("Contrast"), tr("depth of light and shadow compared with the studio")),
    )
    canvas.panel((x, y, width, 1.0), Dark.LINE)
    column_width = (width - (_KEY_COLUMNS - 1) * 32.0) / _KEY_COLUMNS
    for index, (label, meaning) in enumerate(rows):
        column, row = divmod(index, 2)
        left = x + column * (column_width + 32.0)
        top = y + 32 + row * 44
        canvas.text((left, top), label, 12, 600, Dark.TEXT)
        _paragraph(canvas, (left + 84, top), meaning, column_width - 84, 12)


def _paragraph(canvas: Page, at: Point, text: str, width: float, size: float) -> float:
    """Draw wrapped text with its first baseline at the given point, and return its height."""
    x, y = at
    leading = size + (6.0 if size > 12 else 4.0)
    lines = wrap_text(text, size, width)
    for index, line in enumerate(lines):
        canvas.text((x, y + leading * index), line, size, 400, Dark.DIM)
    return leading * len(lines)
