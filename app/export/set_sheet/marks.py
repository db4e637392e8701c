"""Small drawings of a set sheet: heads and cameras from above, lamps, arrows, badges, tags."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from app.export.result_sheet.canvas import circle_points
from app.export.set_sheet.theme import (
    AMBER_FILL,
    INK,
    MIDDLE,
    ON_TAG,
    PAPER,
    TAG,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.export.result_sheet.canvas import Canvas, Point
    from app.export.result_sheet.lettering import Lettering
    from app.export.result_sheet.theme import Colour
    from app.export.set_sheet.data import SheetLamp


def at(centre: Point, radius: float, turn_deg: float) -> Point:
    """Return a place on a plan: turn 0 is up, clockwise to the right."""
    angle = math.radians(turn_deg)
    return centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle)


def head(canvas: Canvas, centre: Point, size: float, turn_deg: float, *, ghost: bool) -> None:
    """Draw a head from above.

    Parameters
    ----------
    turn_deg : float
        Where it faces: 0 up, clockwise to the right.
    """

    def turned(points: Sequence[tuple[float, float]]) -> list[Point]:
        angle = math.radians(turn_deg)
        cosine, sine = math.cos(angle), math.sin(angle)
        return [
            (
                centre[0] + size * (x * cosine - y * sine),
                centre[1] + size * (x * sine + y * cosine),
            )
            for x, y in points
        ]

    skull = turned([(0.78 * x, y) for x, y in circle_points((0.0, 0.0), 1.0)])
    nose = turned([(-0.17, -0.95), (-0.12, -1.2), (0.0, -1.27), (0.12, -1.2), (0.17, -0.95)])
    if ghost:
        canvas.dashes(skull, MIDDLE, 1.25, 3.0, 3.0)
        canvas.stroke(nose, MIDDLE, 1.25)
        return
    for side in (-1.0, 1.0):
        ear = [(0.13 * x + side * 0.82, 0.24 * y + 0.05) for x, y in circle_points((0, 0), 1.0)]
        canvas.shape(turned(ear), PAPER)
        canvas.stroke(turned(ear), INK, 1.75, closed=True)
    canvas.shape(skull, PAPER)
    canvas.stroke(skull, INK, 2.0, closed=True)
    canvas.shape(nose, PAPER)
    canvas.stroke(nose, INK, 2.0)


def camera(canvas: Canvas, centre: Point, turn_deg: float, *, ghost: bool) -> None:
    """Draw a camera from above that stands at a turn and looks toward the middle.

    Parameters
    ----------
    turn_deg : float
        Where it stands: 0 above the middle, clockwise to the right.
    """
    angle = math.radians(turn_deg)
    cosine, sine = math.cos(angle), math.sin(angle)

    def placed(points: Sequence[tuple[float, float]]) -> list[Point]:
        return [
            (centre[0] + x * cosine - y * sine, centre[1] + x * sine + y * cosine)
            for x, y in points
        ]

    # Up is away from the middle; the lens points down, toward it.
    body = placed([(-11, -7), (11, -7), (11, 4), (-11, 4)])
    lens = placed([(-5, 4), (5, 4), (6, 9), (-6, 9)])
    edge = MIDDLE if ghost else INK
    for shape in (lens, body):
        canvas.stroke(shape, edge, 2.5, closed=True)
        canvas.shape(shape, PAPER if ghost else INK)


def curved_arrow(
    canvas: Canvas, centre: Point, radius: float, arc: tuple[float, float], colour: Colour
) -> None:
    """Draw a thick arc with an arrow head at its end.

    Parameters
    ----------
    arc : tuple of float
        Turns (from, to), 0 up, clockwise to the right; the second is less for the other way.
    """
    start, stop = arc
    way = 1.0 if stop >= start else -1.0
    tip = math.degrees(11.0 / radius) * way
    steps = max(int(abs(stop - start) / 2.0), 2)
    ends = [start + (stop - tip * 0.8 - start) * k / steps for k in range(steps + 1)]
    canvas.stroke([at(centre, radius, turn) for turn in ends], colour, 3.5)
    back = stop - tip
    barbs = [at(centre, radius + step, back) for step in (7.0, -7.0)]
    canvas.shape([barbs[0], at(centre, radius, stop), barbs[1]], colour)


def draw_lamp(canvas: Canvas, centre: Point, lamp: SheetLamp, lettering: Lettering) -> None:
    """Draw a lamp: an amber disc with its letter, or the sun with its rays."""
    if lamp.sun:
        for k in range(8):
            ray = [at(centre, reach, 45.0 * k) for reach in (11.5, 15.5)]
            canvas.stroke(ray, INK, 3.0)
            canvas.stroke(ray, AMBER_FILL, 1.25)
    canvas.dot(centre, 9.5, INK)
    canvas.dot(centre, 8.25, AMBER_FILL)
    if not lamp.sun:
        lettering.draw(canvas, (centre[0], centre[1] + 4.3), lamp.name, 12, 600, INK, "middle")


def badge(
    canvas: Canvas, centre: Point, number: str, lettering: Lettering, *, ghost: bool = False
) -> None:
    """Draw a small number in a circle."""
    canvas.dot(centre, 8.5, PAPER)
    canvas.dot(centre, 7.5, MIDDLE if ghost else INK)
    lettering.draw(canvas, (centre[0], centre[1] + 4.2), number, 12, 600, PAPER, "middle")


def tag(canvas: Canvas, place: Point, text: str, lettering: Lettering) -> None:
    """Draw white words on a dark tag, 22 high, its upper left corner at `place`."""
    canvas.panel((*place, lettering.width(text, 12, 500) + 16.0, 22.0), TAG, 4.0)
    lettering.draw(canvas, (place[0] + 8.0, place[1] + 15.5), text, 12, 500, ON_TAG)


def warning(canvas: Canvas, centre: Point, colour: Colour) -> None:
    """Draw a triangle with an exclamation mark, 16 px."""
    x, y = centre
    triangle = [(x, y - 6.5), (x + 7.5, y + 6.5), (x - 7.5, y + 6.5)]
    canvas.stroke(triangle, colour, 1.75, closed=True)
    canvas.stroke([(x, y - 2.0), (x, y + 1.8)], colour, 1.75)
    canvas.dot((x, y + 4.4), 1.1, colour)
