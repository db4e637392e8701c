"""The plan from above: the photographer, the sitter, the background and the lamps.

The plan shows the positions before and after the turn. Turn 0, the photographer's starting
position, is at the top, and clockwise turns run to the right, as on a clock face lying on the
floor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from app.core.base.angles import at_turn, difference, direction_of, whole, wrap
from app.core.text import tr
from app.export.canvas import Box, Colour, Page, Point, circle_points, sector, text_width
from app.export.set_sheet import SetSheet, SheetLamp
from app.export.theme import Print
from app.words.lights import share_words
from app.words.phrases.directions import elevation_words

WIDTH: Final = 340.0
HEIGHT: Final = 348.0
RADIUS: Final = 96.0
"""Radius of the circle on which the photographer moves, in logical pixels."""

RING: Final = 134.0
"""Radius of the circle on which the lamps are drawn, in logical pixels."""

BACKGROUND_WIDE_DEG: Final = 45.0
_HEAD: Final = 25.0
_LEGEND: Final = 46.0
_TICK: Final = 5.0
_LABEL: Final = 12.0
_ASIDE: Final = 18.0  # logical pixels from a mark to its label
_APART: Final = 20.0  # logical pixels; closer discs of two lamps would overlap
# degrees; below this, there is no room for an arrow between the two cameras
_NEAR_DEG: Final = 16.0


def centre_of(place: Point) -> Point:
    """Return the centre of the plan whose top left corner is at `place`."""
    return place[0] + WIDTH / 2.0, place[1] + (HEIGHT - _LEGEND) / 2.0 + 4.0


def draw_plan(canvas: Page, place: Point, sheet: SetSheet) -> None:
    """Draw the plan."""
    canvas.panel((*place, WIDTH, HEIGHT), Print.TINT, 8.0)
    centre = centre_of(place)
    turn = float(whole(sheet.turn_deg))
    _draw_ground(canvas, centre, sheet, turn)
    stands = _stands(sheet)
    for at, radius in stands:
        _draw_arrow(canvas, centre, at, (radius - 14.0, _HEAD + 14.0), Print.AMBER)
    _draw_people(canvas, centre, turn, sheet.nose_deg)
    for lamp, (at, radius) in zip(sheet.visible_lamps, stands, strict=True):
        draw_lamp(canvas, at_turn(centre, radius, at), lamp)
    _draw_labels(canvas, place, sheet, turn)
    _draw_legend(canvas, (place[0] + 16.0, place[1] + HEIGHT - _LEGEND), sheet)


def _turn_of(lamp: SheetLamp, sheet: SetSheet) -> float:
    return wrap(lamp.azimuth_deg - sheet.front_deg)


def _stands(sheet: SetSheet) -> list[tuple[float, float]]:
    """Return a turn and a radius for each lamp such that no disc covers that of a stronger lamp."""
    stands: list[tuple[float, float]] = []
    for lamp in sheet.visible_lamps:
        turn, radius, middle = _turn_of(lamp, sheet), RING, (0.0, 0.0)
        others = [at_turn(middle, far, at) for at, far in stands]
        while any(math.dist(at_turn(middle, radius, turn), one) < _APART for one in others):
            radius -= _APART
        stands.append((turn, radius))
    return stands


def _draw_ground(canvas: Page, centre: Point, sheet: SetSheet, turn: float) -> None:
    """Draw the lowest layer: the background, the tolerance arc, the circle and the clock hours."""
    behind = turn + 180.0
    half = BACKGROUND_WIDE_DEG / 2.0
    wedge = [at_turn(centre, 118.0, behind - half + 3.0 * k) for k in range(16)]
    canvas.shape([centre, *wedge], Print.LINE, 0.55)
    canvas.stroke(wedge, Print.MIDDLE, 2.5)
    canvas.shape(sector(centre, RADIUS, sheet.arc_deg), Print.AMBER_FILL, 0.38)
    canvas.stroke(circle_points(centre, RADIUS, 240), Print.MIDDLE, 1.0, dashes=(3.0, 3.0))
    for hour in range(12):
        ends = [at_turn(centre, RADIUS - step, 30.0 * hour) for step in (0.0, _TICK)]
        canvas.stroke(ends, Print.DIM, 1.0)
    for hour in (12, 3, 6, 9):
        x, y = at_turn(centre, RADIUS - 18.0, 30.0 * hour)
        busy = [turn, *(_turn_of(lamp, sheet) for lamp in sheet.visible_lamps)]
        if hour != 12 and all(abs(difference(30.0 * hour, place)) > 11.0 for place in busy):
            canvas.text((x, y + 4.3), str(hour), 12, 400, Print.DIM, "middle")


def _draw_arrow(
    canvas: Page,
    centre: Point,
    turn_deg: float,
    reach: tuple[float, float],
    colour: Colour,
    dashes: tuple[float, float] | None = None,
) -> None:
    """Draw a thin radial arrow at a given turn, between two distances from the centre."""
    tail, tip = (at_turn(centre, radius, turn_deg) for radius in reach)
    canvas.stroke([tail, tip], colour, 1.25, dashes=dashes)
    angle = math.radians(turn_deg)
    side = (math.cos(angle), math.sin(angle))
    back = at_turn(centre, reach[1] + math.copysign(8.0, reach[0] - reach[1]), turn_deg)
    barbs = [(back[0] + s * side[0], back[1] + s * side[1]) for s in (-4.0, 4.0)]
    canvas.shape([barbs[0], tip, barbs[1]], colour)


def _draw_people(canvas: Page, centre: Point, turn: float, nose: float) -> None:
    moves = direction_of(turn) != "none"
    if moves:
        _draw_head(canvas, centre, _HEAD, 0.0, ghost=True)
        _draw_camera(canvas, at_turn(centre, RADIUS, 0.0), 0.0, ghost=True)
    _draw_head(canvas, centre, _HEAD, nose, ghost=False)
    if nose != turn:
        for at, reach, dashes in ((nose, (33, 54), None), (turn, (80, 34), (4.0, 3.0))):
            _draw_arrow(canvas, centre, at, reach, Print.INK, dashes)
    if abs(turn) > 2.0 * _NEAR_DEG:
        way = 1.0 if turn > 0 else -1.0
        arc = (way * _NEAR_DEG, turn - way * 9.0)
        draw_curved_arrow(canvas, centre, RADIUS, arc, Print.AMBER)
    spot = at_turn(centre, RADIUS, turn)
    canvas.dot(spot, 16.0, Print.TINT)
    _draw_camera(canvas, spot, turn, ghost=False)
    if moves:
        # Beside the cameras, on their outer sides.
        aside = -1.0 if turn > 0 else 1.0
        far = abs(turn) > _NEAR_DEG
        first = at_turn(centre, RADIUS + 2.0, aside * 15.0)
        second = at_turn(centre, RADIUS + 2.0, turn - aside * 15.0)
        _draw_badge(canvas, first if far else at_turn(centre, RADIUS, aside * 22), "1")
        _draw_badge(canvas, second, "2")


def _draw_labels(canvas: Page, place: Point, sheet: SetSheet, turn: float) -> None:
    """Label the lamps and the background wherever there is room."""
    centre = centre_of(place)
    boxes: list[Box] = [
        _box_around(at_turn(centre, RADIUS, turn), 22.0),
        _box_around(at_turn(centre, RADIUS, turn + math.copysign(15.0, turn)), 11.0),
        _box_around(at_turn(centre, RADIUS, 0.0), 20.0),
        _box_around(centre, 1.3 * _HEAD),
    ]
    stands = _stands(sheet)
    boxes += [_box_around(at_turn(centre, radius, at), 14.0) for at, radius in stands]
    bounds = (place[0] + 6.0, place[1] + 6.0, WIDTH - 12.0, HEIGHT - _LEGEND - 8.0)
    labels = [(tr("Background"), turn + 180.0, 118.0, Print.DIM)]
    lamps = zip(sheet.visible_lamps, stands, strict=True)
    labels += [(_lamp_words(lamp), *stand, Print.INK) for lamp, stand in lamps]
    if sheet.nose_deg != turn:
        width = text_width(tr("nose"), _LABEL, 500) + 4.0
        aside = abs(math.sin(math.radians(sheet.nose_deg)))
        x, y = at_turn(centre, 61.0 + 0.5 * width * aside, sheet.nose_deg)
        boxes.append((x - width / 2.0, y - 8.0, width, 16.0))
        canvas.panel(boxes[-1], Print.TINT, 2.0)
        canvas.text((x, y + 4.3), tr("nose"), _LABEL, 500, Print.INK, "middle")
    for text, turn_deg, radius, colour in labels:
        width = text_width(text, _LABEL, 500)
        box = _room(centre, radius, turn_deg, width, boxes, bounds)
        boxes.append(box)
        canvas.panel((box[0] - 2, box[1], box[2] + 4, box[3]), Print.TINT, 2.0)
        canvas.text((box[0], box[1] + 12.0), text, _LABEL, 500, colour)


def _lamp_words(lamp: SheetLamp) -> str:
    name = tr("Sun") if lamp.sun else lamp.name
    height = elevation_words(lamp.elevation_deg)
    return f"{name} {share_words(lamp.share, lamp.clipped)}, {height}"


def _box_around(spot: Point, reach: float) -> Box:
    return spot[0] - reach, spot[1] - reach, 2.0 * reach, 2.0 * reach


def _room(
    centre: Point, radius: float, turn_deg: float, width: float, occupied: list[Box], bounds: Box
) -> Box:
    """Return a box for a label beside its mark: the first free one, or else the least crowded.

    Positions on the side facing away from the centre are tried first.
    """
    x, y = at_turn(centre, radius, turn_deg)
    height = _LABEL + 4.0
    right, left, level = x + _ASIDE, x - _ASIDE - width, y - height / 2.0
    sides = [(right, level), (left, level)] if x >= centre[0] else [(left, level), (right, level)]
    above, below = (x - width / 2.0, y - _ASIDE - height), (x - width / 2.0, y + _ASIDE)
    poles = [above, below] if y < centre[1] else [below, above]
    steep = abs(math.cos(math.radians(turn_deg))) > 0.85
    spots = [poles[0], *sides, poles[1]] if steep else [*sides, *poles]
    steps = (-14.0, 14.0, -24.0, 24.0, -36.0, 36.0, -50.0)
    spots += [(at, level + step) for step in steps for at, _ in sides]
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
        return sum(overlap(box, other) for other in occupied) + 60.0 * inside

    return min(boxes, key=cost)


def overlap(a: Box, b: Box) -> float:
    """Return the area in which two boxes overlap, in square logical pixels."""
    across = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    down = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return max(across, 0.0) * max(down, 0.0)


def _draw_legend(canvas: Page, place: Point, sheet: SetSheet) -> None:
    x, y = place
    if direction_of(sheet.turn_deg) == "none":
        text = tr("From above. You and the sitter stay where you are.")
        if sheet.yaw_deg:
            text = tr("From above. Nose past you, eyes on you.")
        canvas.text((x, y + 24.0), text, 12, 400, Print.DIM, room=WIDTH - 32.0)
        return
    canvas.panel((x, y, WIDTH - 32.0, 1.0), Print.LINE)
    words = (tr("You at the start"), tr("You after"), tr("good turns"))
    size = min(12.0, 12.0 * (WIDTH - 122.0) / text_width("".join(words), 12))
    _draw_badge(canvas, (x + 8.0, y + 16.0), "1")
    end = canvas.text((x + 22.0, y + 20.3), words[0], size, 400, Print.INK)
    _draw_badge(canvas, (end + 22.0, y + 16.0), "2")
    end = canvas.text((end + 36.0, y + 20.3), words[1], size, 400, Print.INK)
    canvas.panel((end + 14.0, y + 10.0, 12.0, 12.0), Print.AMBER_FILL, 3.0)
    canvas.text((end + 32.0, y + 20.3), words[2], size, 400, Print.INK)
    text = tr("From above. The sitter faces you throughout.")
    if sheet.yaw_deg:
        text = tr("From above. Nose past you, eyes on you.")
    canvas.text((x, y + 38.0), text, 12, 400, Print.DIM, room=WIDTH - 32.0)


def _draw_head(canvas: Page, centre: Point, size: float, turn_deg: float, *, ghost: bool) -> None:
    """Draw a head as seen from above.

    Args:
        turn_deg: Direction in which the head faces, in degrees clockwise from the top of the plan.
    """

    def turned(points: Sequence[Point]) -> list[Point]:
        return _place_points([(size * x, size * y) for x, y in points], centre, turn_deg)

    skull = turned([(0.78 * x, y) for x, y in circle_points((0.0, 0.0), 1.0)])
    nose = turned([(-0.17, -0.95), (-0.12, -1.2), (0.0, -1.27), (0.12, -1.2), (0.17, -0.95)])
    if ghost:
        canvas.stroke(skull, Print.MIDDLE, 1.25, dashes=(3.0, 3.0))
        canvas.stroke(nose, Print.MIDDLE, 1.25)
        return
    for side in (-1.0, 1.0):
        ear = [(0.13 * x + side * 0.82, 0.24 * y + 0.05) for x, y in circle_points((0, 0), 1.0)]
        canvas.shape(turned(ear), Print.PAPER)
        canvas.stroke(turned(ear), Print.INK, 1.75, closed=True)
    canvas.shape(skull, Print.PAPER)
    canvas.stroke(skull, Print.INK, 2.0, closed=True)
    canvas.shape(nose, Print.PAPER)
    canvas.stroke(nose, Print.INK, 2.0)


def _draw_camera(canvas: Page, centre: Point, turn_deg: float, *, ghost: bool) -> None:
    """Draw a camera as seen from above, pointing at the centre.

    Args:
        turn_deg: Position on the circle, in degrees clockwise from the top of the plan.
    """
    # In this outline, up is away from the centre, and the lens points down towards it.
    body = _place_points([(-11, -7), (11, -7), (11, 4), (-11, 4)], centre, turn_deg)
    lens = _place_points([(-5, 4), (5, 4), (6, 9), (-6, 9)], centre, turn_deg)
    edge = Print.MIDDLE if ghost else Print.INK
    for shape in (lens, body):
        canvas.stroke(shape, edge, 2.5, closed=True)
        canvas.shape(shape, Print.PAPER if ghost else Print.INK)


def _place_points(points: Sequence[Point], centre: Point, turn_deg: float) -> list[Point]:
    """Rotate a drawing clockwise about its origin, then move its origin to `centre`."""
    angle = math.radians(turn_deg)
    cosine, sine = math.cos(angle), math.sin(angle)
    return [
        (centre[0] + x * cosine - y * sine, centre[1] + x * sine + y * cosine) for x, y in points
    ]


def draw_curved_arrow(
    canvas: Page, centre: Point, radius: float, arc: tuple[float, float], colour: Colour
) -> None:
    """Draw a thick arc with an arrowhead at its end.

    Args:
        arc: Start and end of the arc, in degrees clockwise from the top. If the end is less than
            the start, the arc is drawn counter-clockwise.
    """
    start, stop = arc
    way = 1.0 if stop >= start else -1.0
    tip = math.degrees(11.0 / radius) * way
    steps = max(int(abs(stop - start) / 2.0), 2)
    ends = [start + (stop - tip * 0.8 - start) * k / steps for k in range(steps + 1)]
    canvas.stroke([at_turn(centre, radius, turn) for turn in ends], colour, 3.5)
    barbs = [at_turn(centre, radius + step, stop - tip) for step in (7.0, -7.0)]
    canvas.shape([barbs[0], at_turn(centre, radius, stop), barbs[1]], colour)


def draw_lamp(canvas: Page, centre: Point, lamp: SheetLamp) -> None:
    """Draw a lamp as an amber disc with its letter, or as a sun with rays."""
    if lamp.sun:
        for k in range(8):
            ray = [at_turn(centre, reach, 45.0 * k) for reach in (11.5, 15.5)]
            canvas.stroke(ray, Print.INK, 3.0)
            canvas.stroke(ray, Print.AMBER_FILL, 1.25)
    canvas.dot(centre, 9.5, Print.INK)
    canvas.dot(centre, 8.25, Print.AMBER_FILL)
    if not lamp.sun:
        canvas.text((centre[0], centre[1] + 4.3), lamp.name, 12, 600, Print.INK, "middle")


def _draw_badge(canvas: Page, centre: Point, number: str) -> None:
    """Draw a small number in a circle."""
    canvas.dot(centre, 8.5, Print.PAPER)
    canvas.dot(centre, 7.5, Print.INK)
    canvas.text((centre[0], centre[1] + 4.2), number, 12, 600, Print.PAPER, "middle")


def draw_warning(canvas: Page, centre: Point, colour: Colour) -> None:
    """Draw a triangle with an exclamation mark, 16 px wide."""
    x, y = centre
    triangle = [(x, y - 6.5), (x + 7.5, y + 6.5), (x - 7.5, y + 6.5)]
    canvas.stroke(triangle, colour, 1.75, closed=True)
    canvas.stroke([(x, y - 2.0), (x, y + 1.8)], colour, 1.75)
    canvas.dot((x, y + 4.4), 1.1, colour)
