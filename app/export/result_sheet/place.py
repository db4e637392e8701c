"""The panorama of a sheet, with its scale and the turns of the styles marked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.solver import pictures
from app.export.result_sheet.theme import AMBER, BG, CTL, DIM, ON_TAG, TAG, TEXT, Colour
from app.export.result_sheet.words import SheetStyle, side_words, signed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.core.solver.environment import Environment
    from app.export.result_sheet.canvas import Canvas, Point
    from app.export.result_sheet.lettering import Anchor, Lettering, Weight

WIDTH: Final = 1104.0
HEIGHT: Final = WIDTH / 2.0
_SCALE_ROOM: Final = 26.0
_FLAG_TOP: Final = 12.0
_LANE: Final = 20.0
_GAP: Final = 14.0


@dataclass(frozen=True, slots=True)
class Flag:
    """A turn marked under the panorama: a pole, and words to the right of its foot.

    Attributes
    ----------
    turn, title, side : str
        The words: degrees, the style, and its side (may be empty).
    """

    x: float
    lane: int
    turn: str
    title: str
    side: str


def make_flags(
    styles: Sequence[SheetStyle], places: Mapping[str, str], lettering: Lettering
) -> tuple[Flag, ...]:
    """Place a flag for every style in reach, such that no words meet words or poles.

    Words run to the right of their pole. Going from right to left, each takes the first lane
    below all the poles it would run across, whose own flags end above it.
    """
    reach = [style for style in styles if style.attainable]
    flags: list[Flag] = []
    for style in sorted(reach, key=lambda item: -item.turn_refined_deg):
        x = WIDTH * (style.turn_refined_deg / 360.0 + 0.5)
        side = side_words(style, places).partition(" (")[0] if style.side != "none" else ""
        turn = signed(style.turn_refined_deg)
        draft = Flag(x, 0, turn, style.title or style.name, side)
        stop = x + flag_width(draft, lettering) + _GAP
        below = [flag.lane + 1 for flag in flags if flag.x < stop]
        flags.append(Flag(x, max(below, default=0), draft.turn, draft.title, draft.side))
    return tuple(flags)


def flag_width(flag: Flag, lettering: Lettering) -> float:
    """Width of a flag's words from its pole, logical pixels."""
    width = 8.0 + lettering.width(flag.turn, 12, 700)
    width += 6.0 + lettering.width(flag.title, 12, 600)
    return width + (6.0 + lettering.width(flag.side, 12) if flag.side else 0.0)


def lanes_height(flags: Sequence[Flag]) -> float:
    """Height of the flags under the panorama, logical pixels."""
    return _FLAG_TOP + _LANE * (1 + max((flag.lane for flag in flags), default=-1))


def draw_panorama(
    canvas: Canvas, at: Point, environment: Environment, front_deg: float, lettering: Lettering
) -> float:
    """Draw the panorama under its scale of turns.

    Parameters
    ----------
    front_deg : float
        Panorama azimuth at which the photographer stands: it comes to the centre.
    """
    x, top = at[0], at[1] + _SCALE_ROOM
    box = (x, top, WIDTH, HEIGHT)
    shown = pictures.panorama(environment, front_deg, canvas.size_of(box))
    canvas.picture(box, shown, 8.0)
    for degrees in range(-180, 181, 15):
        tick = x + WIDTH * (degrees / 360.0 + 0.5)
        labelled = degrees % 45 == 0
        length = 6.0 if labelled else 3.0
        inside = min(max(tick, x + 0.5), x + WIDTH - 0.5)
        canvas.stroke([(inside, top - 3 - length), (inside, top - 3)], CTL, 1.0)
        if labelled:
            _draw_degrees(canvas, (tick, top - 13), degrees, lettering)
    _draw_front(canvas, (x + WIDTH / 2.0, top), lettering)
    return top + HEIGHT


def draw_flags(canvas: Canvas, at: Point, flags: Sequence[Flag], lettering: Lettering) -> None:
    """Draw the turns of the styles under the panorama."""
    x, y = at
    for flag in flags:
        foot = y + _FLAG_TOP + _LANE * (flag.lane + 1) - 4.0
        canvas.stroke([(x + flag.x, y + 8), (x + flag.x, foot)], CTL, 1.0)
    for flag in flags:
        pole = x + flag.x
        # Amber with a dark edge, so that it holds on any picture.
        canvas.shape([(pole - 7.5, y + 10), (pole, y - 5.5), (pole + 7.5, y + 10)], BG)
        canvas.shape([(pole - 5, y + 8.5), (pole, y - 2), (pole + 5, y + 8.5)], AMBER)
        baseline = y + _FLAG_TOP + _LANE * (flag.lane + 1) - 5.0
        end = lettering.draw(canvas, (pole + 6, baseline), flag.turn, 12, 700, AMBER)
        end = lettering.draw(canvas, (end + 6, baseline), flag.title, 12, 600, TEXT)
        if flag.side:
            lettering.draw(canvas, (end + 6, baseline), flag.side, 12, 400, DIM)


def _draw_degrees(canvas: Canvas, at: Point, degrees: int, lettering: Lettering) -> None:
    """Draw a number on the scale; the outermost two stay inside its ends."""
    ends: dict[int, Anchor] = {-180: "left", 180: "right"}
    style: tuple[Weight, Colour] = (600, TEXT) if degrees == 0 else (400, DIM)
    anchor = ends.get(degrees, "middle")
    lettering.draw(canvas, at, signed(degrees), 12, *style, anchor)


def _draw_front(canvas: Canvas, at: Point, lettering: Lettering) -> None:
    """Mark where the photographer stands at turn 0: a line with a dark edge, and a tag."""
    x, y = at
    line = [(x, y), (x, y + HEIGHT)]
    canvas.stroke(line, TAG, 3.0, opacity=0.6)
    canvas.stroke(line, ON_TAG, 1.0)
    words = "Photographer stands here at turn 0"
    width = lettering.width(words, 12, 600) + 16
    canvas.panel((x - width / 2.0, y + HEIGHT - 40, width, 24), TAG, 4.0)
    lettering.draw(canvas, (x, y + HEIGHT - 24), words, 12, 600, ON_TAG, "middle")
