"""Colours of the sheets, and small drawings that the sheets share.

Every surface is neutral (equal red, green and blue), so that the tones in pictures can be judged
against it. Amber is reserved for light and turns.
"""

from __future__ import annotations

from typing import Final

from app.core.base.angles import at_turn
from app.export.canvas import Anchor, Box, Colour, Page, Point, text_width
from app.words.phrases.turns import signed


class Dark:
    """The window's dark theme, for sheets viewed on a screen."""

    BG: Final[Colour] = (0x16, 0x16, 0x16)
    PANEL: Final[Colour] = (0x1E, 0x1E, 0x1E)
    LINE: Final[Colour] = (0x38, 0x38, 0x38)
    CTL: Final[Colour] = (0x7D, 0x7D, 0x7D)
    TEXT: Final[Colour] = (0xED, 0xED, 0xED)
    DIM: Final[Colour] = (0xB4, 0xB4, 0xB4)
    TRACK: Final[Colour] = (0x3B, 0x3B, 0x3B)
    AMBER: Final[Colour] = (0xF2, 0xBC, 0x4B)
    TAG: Final[Colour] = (0x10, 0x10, 0x10)
    ON_TAG: Final[Colour] = (0xF5, 0xF5, 0xF5)


class Print:
    """Colours for a printed page: ink on white paper."""

    PAPER: Final[Colour] = (0xFF, 0xFF, 0xFF)
    INK: Final[Colour] = (0x1A, 0x1A, 0x1A)
    DIM: Final[Colour] = (0x51, 0x51, 0x51)
    MIDDLE: Final[Colour] = (0x9A, 0x9A, 0x9A)
    LINE: Final[Colour] = (0xC6, 0xC6, 0xC6)
    TINT: Final[Colour] = (0xF4, 0xF4, 0xF4)
    TRACK: Final[Colour] = (0xD8, 0xD8, 0xD8)
    AMBER: Final[Colour] = (0x7A, 0x4E, 0x00)
    AMBER_FILL: Final[Colour] = Dark.AMBER
    TAG: Final[Colour] = Dark.TAG
    ON_TAG: Final[Colour] = Dark.ON_TAG


def draw_tag(canvas: Page, place: Point, text: str) -> None:
    """Draw white text on a dark tag, 22 px high, whose top left corner is at `place`."""
    canvas.panel((*place, text_width(text, 12, 500) + 16.0, 22.0), Dark.TAG, 4.0)
    canvas.text((place[0] + 8.0, place[1] + 15.5), text, 12, 500, Dark.ON_TAG)


def draw_logo(
    canvas: Page, centre: Point, radii: tuple[float, float, float], colours: tuple[Colour, Colour]
) -> None:
    """Draw the logo, in which a half disc of light in a ring depicts a head lit from one side.

    Args:
        radii: Outer and inner radius of the ring, and radius of the disc, in logical pixels.
        colours: Colours of the ring and of the background.
    """
    canvas.dot(centre, radii[0], colours[0])
    canvas.dot(centre, radii[1], colours[1])
    canvas.shape([at_turn(centre, radii[2], 180.0 * k / 48) for k in range(49)], Dark.AMBER)


def draw_scale(canvas: Page, box: Box, zero: str, colours: tuple[Colour, Colour]) -> None:
    """Draw a scale of turns from -180 to 180 over a panorama, with the end labels inside its edges.

    Args:
        zero: Label at turn 0.
        colours: Colours of the ticks, and of all numbers except that at 0.
    """
    x, top, width, _ = box
    for degrees in range(-180, 181, 15):
        tick = x + width * (degrees / 360.0 + 0.5)
        labelled = degrees % 45 == 0
        inside = min(max(tick, x + 0.5), x + width - 0.5)
        canvas.stroke([(inside, top - (9.0 if labelled else 6.0)), (inside, top - 3)], colours[0])
        if degrees == 0:
            canvas.text((tick, top - 13), zero, 12, 600, Dark.TEXT, "middle")
        elif labelled:
            draw_degrees(canvas, (tick, top - 13), degrees, colours[1])


def draw_degrees(canvas: Page, at: Point, degrees: int, colour: Colour) -> None:
    """Draw a number on a scale. The labels at both ends keep their signs and stay inside it."""
    ends: dict[int, Anchor] = {-180: "left", 180: "right"}
    text = "−180°" if degrees == -180 else signed(degrees)
    canvas.text(at, text, 12, 400, colour, ends.get(degrees, "middle"))


def draw_meter(
    canvas: Page, box: Box, match: float, limit: float, colours: tuple[Colour, Colour, Colour]
) -> None:
    """Draw a match as a bar, with a tick that extends 3 px above and below the bar at the limit.

    Args:
        match: Match from 0 to 100. Values outside this range are clipped.
        colours: Colours of the bar, its track and the background.
    """
    x, y, width, height = box
    colour, track, ground = colours
    canvas.panel(box, track, height / 2.0)
    bar_width = width * min(max(match, 0.0), 100.0) / 100.0
    if bar_width >= height:
        canvas.panel((x, y, bar_width, height), colour, height / 2.0)
    at = x + width * limit / 100.0
    canvas.panel((at - 2.0, y - 3.0, 4.0, height + 6.0), ground)
    canvas.panel((at - 0.75, y - 3.0, 1.5, height + 6.0), colour)
