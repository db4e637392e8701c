"""The panorama of a set sheet with its marks: start, where the sitter faces, background, lamps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.colour import FloatImage
from app.core.localization.views import BACKGROUND_TALL_DEG, Lens, bearings, look
from app.core.text import tr
from app.core.text.turns import direction_of, whole
from app.export.canvas import Box, Canvas, Colour, Point, text_width
from app.export.set_plan import draw_lamp, overlap
from app.export.theme import Print, draw_degrees, draw_tag

if TYPE_CHECKING:
    from app.export.set_sheet import SetSheet, SheetLamp

WIDTH: Final = 706.0
TOP_DEG: Final = 62.0
BOTTOM_DEG: Final = -52.0
HEIGHT: Final = 224.0
_ACROSS: Final = 360.0 / WIDTH
_ROWS: Final = (HEIGHT - 30.0, 8.0, HEIGHT - 56.0, 34.0, HEIGHT - 82.0, 60.0)
_LENS: Final = Lens(BACKGROUND_TALL_DEG, (100, 100))


def x_of(turn_deg: float) -> float:
    """Return where a turn lies on the strip, from its left edge, logical pixels."""
    return (wrap(turn_deg) + 180.0) / _ACROSS


def background(sheet: SetSheet, size: tuple[int, int]) -> FloatImage:
    """Show what is behind the sitter at the turn.

    Args:
        size: Rows and columns, alike.

    Returns:
        NDArray[np.float32], (rows, columns, 3). SRGB in 0..1, 45 degrees from top to bottom, at eye
        level.
    """
    lens = Lens(BACKGROUND_TALL_DEG, (size[1], size[0]))
    view = look(sheet.panorama, _behind(sheet), lens)
    return view.astype(np.float32) / np.float32(255.0)


def draw_strip(canvas: Canvas, place: Point, sheet: SetSheet) -> None:
    """Draw the panorama and its scale of turns."""
    x, y = place
    box = (x, y, WIDTH, HEIGHT)
    canvas.picture(box, _picture(sheet, canvas.size_of(box)), 8.0)
    _draw_frame(canvas, place, _outline(whole(sheet.turn_deg) + 180.0))
    turn = float(whole(sheet.turn_deg))
    moved = direction_of(turn) != "none"
    if moved:
        _pole(canvas, (x + x_of(0.0), y), Print.ON_TAG, dashed=True)
    _pole(canvas, (x + x_of(turn), y), Print.AMBER_FILL, dashed=False)
    for lamp in sheet.shown:
        draw_lamp(canvas, _spot(place, lamp, sheet), lamp)
    _draw_tags(canvas, place, sheet)
    _draw_scale(canvas, (x, y + HEIGHT))


def _spot(place: Point, lamp: SheetLamp, sheet: SetSheet) -> Point:
    """Return where a lamp is on the strip; one beyond its edges is drawn at the edge."""
    height = (TOP_DEG - lamp.elevation_deg) / (TOP_DEG - BOTTOM_DEG) * HEIGHT
    return (
        place[0] + min(max(x_of(lamp.azimuth_deg - sheet.front_deg), 14.0), WIDTH - 14.0),
        place[1] + min(max(height, 16.0), HEIGHT - 16.0),
    )


def _draw_tags(canvas: Canvas, place: Point, sheet: SetSheet) -> None:
    """Name the marks, each in the row where it covers no lamp, no other tag and no frame."""
    x, y = place
    turn = float(whole(sheet.turn_deg))
    words = [(tr("You stand here"), turn)]
    if direction_of(turn) != "none":
        words = [
            (tr("2  You stand here, the sitter faces you"), turn),
            (tr("1  You stood here"), 0.0),
        ]
    words.append((tr("Background of the picture"), turn + 180.0))
    spots = [_spot(place, lamp, sheet) for lamp in sheet.shown]
    taken: list[Box] = [(spot[0] - 14.0, spot[1] - 14.0, 28.0, 28.0) for spot in spots]
    half = 0.5 * BACKGROUND_TALL_DEG
    frame = (half / _ACROSS, half / (TOP_DEG - BOTTOM_DEG) * HEIGHT)
    middle = (x + x_of(turn + 180.0), y + TOP_DEG / (TOP_DEG - BOTTOM_DEG) * HEIGHT)
    for around in (-WIDTH, 0.0, WIDTH):
        left = middle[0] + around - frame[0]
        taken.append((left, middle[1] - frame[1], 2.0 * frame[0], 2.0 * frame[1]))
    for text, at_turn in words:
        width = text_width(text, 12, 500) + 16.0
        left = min(max(x + x_of(at_turn) - width / 2.0, x + 6.0), x + WIDTH - 6.0 - width)
        boxes = [(left, y + row, width, 22.0) for row in _ROWS]
        best = min(boxes, key=lambda box: sum(overlap(box, other) for other in taken))
        taken.append(best)
        draw_tag(canvas, (left, best[1]), text)


def _behind(sheet: SetSheet) -> float:
    """Azimuth behind the sitter; from the shown whole degrees, like everything on the sheet."""
    return wrap(sheet.front_deg + whole(sheet.turn_deg) + 180.0)


def _picture(sheet: SetSheet, size: tuple[int, int]) -> FloatImage:
    """Cut the strip out of the panorama, with the front in its middle."""
    height, width = sheet.panorama.shape[:2]
    rows = np.linspace(90.0 - TOP_DEG, 90.0 - BOTTOM_DEG, size[0] + 1)
    row = ((rows[:-1] + rows[1:]) / 360.0 * height - 0.5).astype(np.float32)
    turn = (np.arange(size[1]) + 0.5) / size[1] - 0.5 + sheet.front_deg / 360.0
    column = ((turn + 0.5) % 1.0 * width - 0.5).astype(np.float32)
    across, down = np.meshgrid(column, row)
    source = sheet.panorama
    if width >= 2 * size[1]:
        # Finer than the print: averaged first, so that nothing flickers into stairs.
        source = np.asarray(cv2.blur(source, (width // size[1], width // size[1])), np.uint8)
    taken = cv2.remap(source, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(taken, np.float32) / np.float32(255.0)


def _outline(turn_deg: float) -> NDArray[np.float64]:
    """(N, 2) edge of the background view: turns and elevations, deg; turns go on past 180."""
    side = np.arange(0.0, 100.0, 5.0)
    none, full = 0.0 * side, 0.0 * side + 100.0
    edges = ((side, none), (full, side), (100.0 - side, full), (none, 100.0 - side))
    rays = bearings(_LENS, 0.0, 0.0, np.concatenate([np.stack(edge, axis=1) for edge in edges]))
    turns = np.degrees(np.arctan2(-rays[:, 0], rays[:, 2])) + wrap(turn_deg)
    return np.stack([turns, np.degrees(np.arcsin(rays[:, 1]))], axis=1)


def _draw_frame(canvas: Canvas, place: Point, edge: NDArray[np.float64]) -> None:
    """Draw an edge once more on the other side where it goes past the strip's end."""
    x, y = place
    down = (TOP_DEG - edge[:, 1]) / (TOP_DEG - BOTTOM_DEG) * HEIGHT + y
    with canvas.clipped((x, y, WIDTH, HEIGHT)):
        for around in (-360.0, 0.0, 360.0):
            across = (edge[:, 0] + around + 180.0) / _ACROSS + x
            points = [(float(a), float(b)) for a, b in zip(across, down, strict=True)]
            canvas.stroke(points, Print.TAG, 3.5, closed=True)
            canvas.stroke(points, Print.AMBER_FILL, 1.75, closed=True, dashes=(6.0, 4.0))


def _pole(canvas: Canvas, foot: Point, colour: Colour, *, dashed: bool) -> None:
    x, y = foot
    canvas.stroke([(x, y + 2.0), (x, y + HEIGHT - 2.0)], Print.TAG, 4.0, opacity=0.7)
    dashes = (6.0, 5.0) if dashed else None
    line = [(x, y + 1.0), (x, y + HEIGHT - 1.0)]
    canvas.stroke(line, colour, 1.75 if dashed else 2.0, dashes=dashes)


def _draw_scale(canvas: Canvas, place: Point) -> None:
    x, y = place
    for degrees in range(-180, 181, 15):
        tick = min(max(x + (degrees + 180.0) / _ACROSS, x + 0.5), x + WIDTH - 0.5)
        long = degrees % 45 == 0
        canvas.stroke([(tick, y + 4.0), (tick, y + (10.0 if long else 7.0))], Print.DIM, 1.0)
        if long:
            draw_degrees(canvas, (tick, y + 23.0), degrees, Print.INK)
