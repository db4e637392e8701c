"""The plan from above: where photographer, sitter, background and lamps are, before and after.

Turn 0, where the photographer stands at the start, is up; clockwise goes to the right, as on the
face of a clock that lies on the floor.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from app.core.base.angles import difference, wrap
from app.core.text.turns import direction_of, whole
from app.export.result_sheet.canvas import circle_points
from app.export.set_sheet import marks
from app.export.set_sheet.theme import AMBER, AMBER_FILL, DIM, INK, LINE, MIDDLE, TINT

if TYPE_CHECKING:
    from app.export.result_sheet.canvas import Box, Canvas, Point
    from app.export.result_sheet.lettering import Lettering
    from app.export.set_sheet.data import SetSheet, SheetLamp

WIDTH: Final = 340.0
HEIGHT: Final = 348.0
RADIUS: Final = 96.0
"""Of the circle on which the photographer walks, logical pixels."""

RING: Final = 134.0
"""Of the circle on which lamps are drawn."""

BACKGROUND_WIDE_DEG: Final = 45.0
_HEAD: Final = 25.0
_LEGEND: Final = 46.0
_TICK: Final = 5.0
_LABEL: Final = 12.0
_ASIDE: Final = 18.0  # from a mark to its label
_NEAR_DEG: Final = 16.0  # below, an arrow is too short to be drawn between the two cameras


def centre_of(place: Point) -> Point:
    """Return the middle of the plan whose upper left corner is at `place`."""
    return place[0] + WIDTH / 2.0, place[1] + (HEIGHT - _LEGEND) / 2.0 + 4.0


def draw_plan(canvas: Canvas, place: Point, sheet: SetSheet, lettering: Lettering) -> None:
    """Draw the plan."""
    canvas.panel((*place, WIDTH, HEIGHT), TINT, 8.0)
    centre = centre_of(place)
    turn = float(whole(sheet.turn_deg))
    _draw_ground(canvas, centre, sheet, turn, lettering)
    lamps = sheet.shown
    for lamp in lamps:
        _draw_ray(canvas, centre, _turn_of(lamp, sheet))
    _draw_people(canvas, centre, turn, lettering)
    for lamp in lamps:
        spot = marks.at(centre, RING, _turn_of(lamp, sheet))
        marks.draw_lamp(canvas, spot, lamp, lettering)
    _draw_labels(canvas, place, sheet, turn, lettering)
    _draw_legend(canvas, (place[0] + 16.0, place[1] + HEIGHT - _LEGEND), turn, lettering)


def _turn_of(lamp: SheetLamp, sheet: SetSheet) -> float:
    return wrap(lamp.azimuth_deg - sheet.front_deg)


def _draw_ground(
    canvas: Canvas, centre: Point, sheet: SetSheet, turn: float, lettering: Lettering
) -> None:
    """Draw what lies under everything: background, tolerance arc, circle, hours."""
    behind = turn + 180.0
    half = BACKGROUND_WIDE_DEG / 2.0
    wedge = [marks.at(centre, 118.0, behind - half + 3.0 * k) for k in range(16)]
    canvas.shape([centre, *wedge], LINE, 0.55)
    canvas.stroke(wedge, MIDDLE, 2.5)
    start, stop = sheet.arc_deg
    extent = 360.0 if stop - start >= 360.0 else (stop - start) % 360.0
    steps = max(int(extent / 3.0), 1)
    rim = [marks.at(centre, RADIUS, start + extent * k / steps) for k in range(steps + 1)]
    canvas.shape([centre, *rim], AMBER_FILL, 0.38)
    canvas.dashes(circle_points(centre, RADIUS, 240), MIDDLE, 1.0, 3.0, 3.0)
    for hour in range(12):
        turn_deg = 30.0 * hour
        ends = [marks.at(centre, RADIUS - step, turn_deg) for step in (0.0, _TICK)]
        canvas.stroke(ends, DIM, 1.0)
    for hour in (12, 3, 6, 9):
        x, y = marks.at(centre, RADIUS - 18.0, 30.0 * hour)
        busy = [turn, *(_turn_of(lamp, sheet) for lamp in sheet.shown)]
        if hour != 12 and all(abs(difference(30.0 * hour, place)) > 11.0 for place in busy):
            lettering.draw(canvas, (x, y + 4.3), str(hour), 12, 400, DIM, "middle")


def _draw_ray(canvas: Canvas, centre: Point, turn_deg: float) -> None:
    """Draw where a lamp's light goes: a thin line with an arrow head before the head."""
    tip = marks.at(centre, _HEAD + 14.0, turn_deg)
    canvas.stroke([marks.at(centre, RING - 14.0, turn_deg), tip], AMBER, 1.25)
    angle = math.radians(turn_deg)
    side = (math.cos(angle), math.sin(angle))
    back = marks.at(centre, _HEAD + 22.0, turn_deg)
    barbs = [(back[0] + s * side[0], back[1] + s * side[1]) for s in (-4.0, 4.0)]
    canvas.shape([barbs[0], tip, barbs[1]], AMBER)


def _draw_people(canvas: Canvas, centre: Point, turn: float, lettering: Lettering) -> None:
    moved = direction_of(turn) != "none"
    if moved:
        marks.head(canvas, centre, _HEAD, 0.0, ghost=True)
        spot = marks.at(centre, RADIUS, 0.0)
        marks.camera(canvas, spot, 0.0, ghost=True)
    marks.head(canvas, centre, _HEAD, turn, ghost=False)
    if abs(turn) > 2.0 * _NEAR_DEG:
        way = 1.0 if turn > 0 else -1.0
        arc = (way * _NEAR_DEG, turn - way * 9.0)
        marks.curved_arrow(canvas, centre, RADIUS, arc, AMBER)
    spot = marks.at(centre, RADIUS, turn)
    canvas.dot(spot, 16.0, TINT)
    marks.camera(canvas, spot, turn, ghost=False)
    if moved:
        # Beside the cameras, away from each other.
        aside = -1.0 if turn > 0 else 1.0
        far = abs(turn) > _NEAR_DEG
        first = marks.at(centre, RADIUS + 2.0, aside * 15.0)
        second = marks.at(centre, RADIUS + 2.0, turn - aside * 15.0)
        marks.badge(canvas, first if far else marks.at(centre, RADIUS, aside * 22), "1", lettering)
        marks.badge(canvas, second, "2", lettering)


def _draw_labels(
    canvas: Canvas, place: Point, sheet: SetSheet, turn: float, lettering: Lettering
) -> None:
    """Write what lamps and background are, where there is room for it."""
    centre = centre_of(place)
    taken: list[Box] = [
        _around(marks.at(centre, RADIUS, turn), 22.0),
        _around(marks.at(centre, RADIUS, 0.0), 20.0),
    ]
    lamps = sheet.shown
    taken += [_around(marks.at(centre, RING, _turn_of(lamp, sheet)), 14.0) for lamp in lamps]
    bounds = (place[0] + 6.0, place[1] + 6.0, WIDTH - 12.0, HEIGHT - _LEGEND - 8.0)
    wanted = [("Background", turn + 180.0, 118.0, DIM)]
    wanted += [(_lamp_words(lamp), _turn_of(lamp, sheet), RING, INK) for lamp in lamps]
    for text, turn_deg, radius, colour in wanted:
        width = lettering.width(text, _LABEL, 500)
        box = _room(centre, radius, turn_deg, width, taken, bounds)
        taken.append(box)
        canvas.panel((box[0] - 2, box[1], box[2] + 4, box[3]), TINT, 2.0)
        lettering.draw(canvas, (box[0], box[1] + 12.0), text, _LABEL, 500, colour)


def _lamp_words(lamp: SheetLamp) -> str:
    name = "Sun" if lamp.sun else lamp.name
    height = f"{abs(round(lamp.elevation_deg))}° {'up' if lamp.elevation_deg >= 0 else 'down'}"
    share = math.floor(100.0 * lamp.share)
    return f"{name} {share} %, {height}" if share >= 1 else f"{name}, {height}"


def _around(spot: Point, reach: float) -> Box:
    return spot[0] - reach, spot[1] - reach, 2.0 * reach, 2.0 * reach


def _room(
    centre: Point, radius: float, turn_deg: float, width: float, taken: list[Box], bounds: Box
) -> Box:
    """Find a place for a label beside its mark: the first that covers nothing, else the best.

    It is tried on the side away from the middle first.
    """
    x, y = marks.at(centre, radius, turn_deg)
    height = _LABEL + 4.0
    right, left, level = x + _ASIDE, x - _ASIDE - width, y - height / 2.0
    sides = [(right, level), (left, level)] if x >= centre[0] else [(left, level), (right, level)]
    above, below = (x - width / 2.0, y - _ASIDE - height), (x - width / 2.0, y + _ASIDE)
    poles = [above, below] if y < centre[1] else [below, above]
    steep = abs(math.cos(math.radians(turn_deg))) > 0.85
    spots = [poles[0], *sides, poles[1]] if steep else [*sides, *poles]
    spots += [(at, level + step) for step in (-14.0, 14.0, -24.0, 24.0) for at, _ in sides]
    boxes = [
        (
            min(max(spot[0], bounds[0]), bounds[0] + bounds[2] - width),
            min(max(spot[1], bounds[1]), bounds[1] + bounds[3] - height),
            width,
            height,
        )
        for spot in spots
    ]

    def cost(box: Box) -> float:
        # The inside of the circle is full of arrows.
        across = [box[0] + share * box[2] for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        middle = box[1] + height / 2.0 - centre[1]
        inside = sum(math.hypot(x - centre[0], middle) < RADIUS + 10.0 for x in across)
        return sum(overlap(box, other) for other in taken) + 60.0 * inside

    return min(boxes, key=cost)


def overlap(a: Box, b: Box) -> float:
    """Return the area that two boxes share."""
    across = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    down = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return max(across, 0.0) * max(down, 0.0)


def _draw_legend(canvas: Canvas, place: Point, turn: float, lettering: Lettering) -> None:
    x, y = place
    if direction_of(turn) == "none":
        text = "From above. You and the sitter stay as you stand."
        lettering.draw(canvas, (x, y + 24.0), text, 12, 400, DIM)
        return
    canvas.panel((x, y, WIDTH - 32.0, 1.0), LINE)
    marks.badge(canvas, (x + 8.0, y + 16.0), "1", lettering)
    end = lettering.draw(canvas, (x + 22.0, y + 20.3), "You at the start", 12, 400, INK)
    marks.badge(canvas, (end + 22.0, y + 16.0), "2", lettering)
    end = lettering.draw(canvas, (end + 36.0, y + 20.3), "You after", 12, 400, INK)
    canvas.panel((end + 14.0, y + 10.0, 12.0, 12.0), AMBER_FILL, 3.0)
    lettering.draw(canvas, (end + 32.0, y + 20.3), "good turns", 12, 400, INK)
    text = "Seen from above. The sitter faces you throughout."
    lettering.draw(canvas, (x, y + 38.0), text, 12, 400, DIM)
