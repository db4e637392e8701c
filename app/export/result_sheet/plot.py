"""Small drawings on a card: the match over the turn, the meter, and the icons."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from app.export.result_sheet.canvas import Box, Canvas, Point, circle_points
from app.export.result_sheet.theme import AMBER, CTL, DIM, LINE, PANEL, TEXT, TRACK, Colour

if TYPE_CHECKING:
    from collections.abc import Sequence

_ICON_RADIUS: Final = 6.25


def polar(
    canvas: Canvas,
    centre: Point,
    radius: float,
    curve: Sequence[float],
    turn_deg: float,
    arc_deg: tuple[float, float] | None,
    limit: float,
) -> None:
    """Draw match over turn: 0 degrees up, clockwise to the right, 100 at the rim.

    Parameters
    ----------
    curve : Sequence[float]
        Match at evenly spaced turns from 0 on, clockwise; below 0 counts as 0.
    arc_deg : tuple[float, float] or None
        Tolerance arc, clockwise from first to second; None draws the style as out of reach.
    """
    reach = arc_deg is not None
    canvas.stroke(circle_points(centre, radius), CTL if reach else LINE, 1.0)
    for quarter in range(4):
        ends = [_at(centre, radius + step, 90.0 * quarter) for step in (0.0, 3.0)]
        canvas.stroke(ends, CTL, 1.0)
    canvas.dashes(circle_points(centre, radius * limit / 100.0, 240), CTL, 0.75, 2.0, 2.5)
    if arc_deg is not None:
        canvas.shape(_sector(centre, radius, arc_deg), AMBER, 0.28)
    count = len(curve)
    outline = [
        _at(centre, radius * min(max(value, 0.0), 100.0) / 100.0, 360.0 * index / count)
        for index, value in enumerate(curve)
    ]
    canvas.shape(outline, TEXT, 0.07)
    canvas.stroke(outline, TEXT if reach else DIM, 1.25, closed=True)
    tip = _at(centre, radius, turn_deg)
    if reach:
        canvas.stroke([centre, tip], AMBER, 1.5)
        canvas.dot(tip, 5.0, PANEL)
        canvas.dot(tip, 4.0, AMBER)
    else:
        canvas.dot(tip, 4.0, DIM)
        canvas.dot(tip, 2.75, PANEL)


def meter(canvas: Canvas, box: Box, match: float, limit: float, colour: Colour) -> None:
    """Draw a bar of 100 with a tick at the limit.

    Parameters
    ----------
    box : Box
        Of the bar; the tick stands out 3 px above and below.
    match : float
        0 to 100; outside it is clipped.
    """
    x, y, width, height = box
    canvas.panel(box, TRACK, height / 2.0)
    filled = width * min(max(match, 0.0), 100.0) / 100.0
    if filled >= height:
        canvas.panel((x, y, filled, height), colour, height / 2.0)
    at = x + width * limit / 100.0
    canvas.panel((at - 2.0, y - 3.0, 4.0, height + 6.0), PANEL)
    canvas.panel((at - 0.75, y - 3.0, 1.5, height + 6.0), colour)


def turn_icon(canvas: Canvas, centre: Point, colour: Colour, *, clockwise: bool) -> None:
    """Draw a curved arrow of 16 px."""
    sign = 1.0 if clockwise else -1.0
    arc = [_at(centre, _ICON_RADIUS, sign * angle) for angle in range(105, 415, 5)]
    canvas.stroke(arc, colour, 1.75)
    x, y = centre
    corner = (x + sign * _ICON_RADIUS, y - 2.1)
    head = [(corner[0], y - 7.0), corner, (corner[0] - sign * 4.9, y - 2.1)]
    canvas.stroke(head, colour, 1.75)


def not_possible_icon(canvas: Canvas, centre: Point, colour: Colour) -> None:
    """Draw a circle with a bar across, 16 px."""
    canvas.stroke(circle_points(centre, _ICON_RADIUS), colour, 1.5)
    bar = [_at(centre, _ICON_RADIUS, angle) for angle in (-45.0, 135.0)]
    canvas.stroke(bar, colour, 1.5)


def _at(centre: Point, radius: float, turn_deg: float) -> Point:
    angle = math.radians(turn_deg)
    return centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle)


def _sector(centre: Point, radius: float, arc_deg: tuple[float, float]) -> list[Point]:
    start, stop = arc_deg
    # An arc of the whole circle is written (-180, 180); others may wrap.
    extent = 360.0 if stop - start >= 360.0 else (stop - start) % 360.0
    steps = max(int(extent / 3.0), 1)
    rim = [_at(centre, radius, start + extent * step / steps) for step in range(steps + 1)]
    return [centre, *rim]
