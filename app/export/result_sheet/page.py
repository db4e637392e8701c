"""The whole result sheet: header, panorama with the turns, key, and a card for each style."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.solver.styles import load_styles
from app.export.result_sheet import aside, card, place
from app.export.result_sheet.canvas import Canvas, Point
from app.export.result_sheet.lettering import Lettering
from app.export.result_sheet.theme import AMBER, BG, DIM, TEXT
from app.export.result_sheet.words import SheetStyle, head_words

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from app.core.base.colour import FloatImage
    from app.core.solver.environment import Environment

_COLUMNS: Final = 6
_GAP: Final = 12.0
_MARGIN: Final = 42.0
_WIDTH: Final = 2 * _MARGIN + _COLUMNS * card.WIDTH + (_COLUMNS - 1) * _GAP
_HEADER: Final = 104.0
_ASIDE_GAP: Final = 40.0
_OBJECTIVES: Final = {
    "picture": "turns by best match",
    "paper": "turns by the paper’s quality C",
}


def draw_sheet(
    results: Sequence[SheetStyle],
    targets: Mapping[str, FloatImage],
    pictures: Mapping[str, FloatImage],
    coverage: FloatImage,
    environment: Environment,
    title: str,
    head: str,
    *,
    objective: str = "picture",
    front_deg: float = 0.0,
    places: Mapping[str, str] | None = None,
    limit: float = 45.0,
) -> NDArray[np.uint8]:
    """Draw the result sheet of a place.

    Cards stand in reach by match, then out of reach by match.

    Parameters
    ----------
    targets, pictures : Mapping[str, NDArray[np.float32]], (N, N, 3)
        By style name: linear pictures under the studio lamps, and here at the best turn.
    coverage : NDArray[np.float32], (N, N)
        Share of each pixel covered by the head.
    front_deg : float, optional
        Panorama azimuth from which the turns are counted, degrees.
    places : Mapping[str, str], optional
        Where the light comes from, in words, by name, for styles without a side; by default
        what the built-in styles say.

    Returns
    -------
    NDArray[np.uint8], (H, W, 3)
        sRGB, two pixels per logical pixel.

    Raises
    ------
    KeyError
        When a style has no target or picture.
    """
    lettering = Lettering()
    if places is None:
        places = {style.name: style.place for style in load_styles()}
    order = sorted(results, key=lambda style: (not style.attainable, -style.match))
    cards = [
        card.CardData(style, targets[style.name], pictures[style.name], coverage, places, limit)
        for style in order
    ]
    flags = place.make_flags(order, places, lettering)
    heights = [card.height_of(data, lettering) for data in cards]
    rows = [max(heights[start : start + _COLUMNS]) for start in range(0, len(cards), _COLUMNS)]
    lanes = place.lanes_height(flags)
    panorama_bottom = _HEADER + 26.0 + place.HEIGHT
    cards_top = panorama_bottom + lanes + 24.0
    key_top = cards_top + sum(rows) + _GAP * len(rows) + 12.0
    canvas = Canvas(_WIDTH, key_top + aside.KEY_HEIGHT + _MARGIN, BG)
    _draw_header(canvas, title, f"{head_words(head)}, {_OBJECTIVES[objective]}", lettering)
    bottom = place.draw_panorama(canvas, (_MARGIN, _HEADER), environment, front_deg, lettering)
    place.draw_flags(canvas, (_MARGIN, bottom), flags, lettering)
    aside.draw_aside(canvas, (_MARGIN + place.WIDTH + _ASIDE_GAP, _HEADER), cards, lettering)
    y = cards_top
    for row, height in enumerate(rows):
        for column, data in enumerate(cards[row * _COLUMNS : (row + 1) * _COLUMNS]):
            at = (_MARGIN + column * (card.WIDTH + _GAP), y)
            card.draw_card(canvas, at, height, data, lettering)
        y += height + _GAP
    aside.draw_key(canvas, (_MARGIN, key_top), _WIDTH - 2 * _MARGIN, limit, lettering)
    return canvas.pixels


def _draw_header(canvas: Canvas, title: str, subtitle: str, lettering: Lettering) -> None:
    inner = _WIDTH - 2 * _MARGIN
    # Names of places are mostly names of files.
    plain = " ".join(title.replace("_", " ").split())
    name = lettering.shorten(plain, 28, inner - 220, 700)
    lettering.draw(canvas, (_MARGIN, 58), name, 28, 700, TEXT)
    lettering.draw(canvas, (_MARGIN, 82), subtitle, 14, 400, DIM)
    right = _WIDTH - _MARGIN
    start = right - lettering.width("Turnlight", 20, 600)
    lettering.draw(canvas, (start, 61), "Turnlight", 20, 600, TEXT)
    _draw_logo(canvas, (start - 24, 54))


def _draw_logo(canvas: Canvas, centre: Point) -> None:
    """Draw a head lit from one side: half a disc of light in a ring."""
    x, y = centre
    angles = np.linspace(0.0, np.pi, 49)
    half = [(x + 8.5 * float(np.sin(a)), y - 8.5 * float(np.cos(a))) for a in angles]
    canvas.dot(centre, 13.0, TEXT)
    canvas.dot(centre, 11.25, BG)
    canvas.shape(half, AMBER)
