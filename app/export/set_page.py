"""The page of a set sheet: A4 portrait, black on white, as an image or a PDF.

On the panorama, the start, the sitter's direction, the background and the lamps are marked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import direction_of, ends_of, whole, wrap
from app.core.base.atomic_files import atomic_write_bytes
from app.core.base.colour import FloatImage
from app.core.base.imaging import images
from app.core.guidance.who_moves import Mode
from app.core.localization.views import BACKGROUND_TALL_DEG, Lens, bearings, look
from app.core.text import tr
from app.export.canvas import (
    PIXELS_PER_INCH,
    Box,
    Colour,
    Page,
    Point,
    pdf_bytes,
    shorten,
    text_width,
    wrap_text,
)
from app.export.set_plan import HEIGHT as PLAN_HEIGHT
from app.export.set_plan import WIDTH as PLAN_WIDTH
from app.export.set_plan import draw_curved_arrow, draw_lamp, draw_plan, draw_warning, overlap
from app.export.set_sheet import SetSheet, SheetLamp
from app.export.theme import Print, draw_degrees, draw_logo, draw_meter, draw_tag
from app.words.phrases.directions import lens_words, light_words, sitter_words
from app.words.phrases.quantities import contrast_words, upper_first
from app.words.phrases.turns import (
    arc_words,
    clock_words,
    direction_words,
    size_words,
    turn_words,
    walking_words,
)
from app.words.portrait.face_light import (
    catchlight_words,
    flow_words,
    glare_sentence,
    ratio_sentence,
)

STRIP_WIDTH: Final = 706.0
TOP_DEG: Final = 58.0
BOTTOM_DEG: Final = -47.0
STRIP_HEIGHT: Final = 206.0
STAY: Final = tr("You and the sitter stay where you are.")
ANY_TURN: Final = tr("Good at any turn.")
OUT_OF_REACH: Final = tr("Out of reach here. {reason}.")
_ACROSS: Final = 360.0 / STRIP_WIDTH
_ROWS: Final = (STRIP_HEIGHT - 30.0, 8.0, STRIP_HEIGHT - 56.0, 34.0, STRIP_HEIGHT - 82.0, 60.0)
_LENS: Final = Lens(BACKGROUND_TALL_DEG, (100, 100))


def x_of(turn_deg: float) -> float:
    """Return a turn's distance from the left edge of the strip, in logical pixels."""
    return (wrap(turn_deg) + 180.0) / _ACROSS


def background(sheet: SetSheet, size: tuple[int, int]) -> FloatImage:
    """Return the view behind the sitter at eye level. It covers 45 degrees from top to bottom.

    Args:
        size: Numbers of rows and columns, which must be equal.

    Returns:
        NDArray[np.float32], (rows, columns, 3). sRGB in 0..1.
    """
    lens = Lens(BACKGROUND_TALL_DEG, (size[1], size[0]))
    # Computed from the whole degrees shown, like everything on the sheet.
    behind = wrap(sheet.front_deg + whole(sheet.turn_deg) + 180.0)
    return look(sheet.panorama, behind, lens).astype(np.float32) / np.float32(255.0)


def draw_strip(canvas: Page, place: Point, sheet: SetSheet) -> None:
    """Draw the panorama with its scale of turns."""
    x, y = place
    box = (x, y, STRIP_WIDTH, STRIP_HEIGHT)
    canvas.picture(box, _picture(sheet, canvas.size_of(box)), 8.0)
    _draw_frame(canvas, place, _outline(whole(sheet.turn_deg) + 180.0))
    turn = float(whole(sheet.turn_deg))
    if direction_of(turn) != "none":
        _pole(canvas, (x + x_of(0.0), y), Print.ON_TAG, dashed=True)
    _pole(canvas, (x + x_of(turn), y), Print.AMBER_FILL, dashed=False)
    if sheet.yaw_deg:
        _pole(canvas, (x + x_of(sheet.nose_deg), y), Print.ON_TAG, dashed=False)
    for lamp in sheet.visible_lamps:
        draw_lamp(canvas, _spot(place, lamp, sheet), lamp)
    _draw_tags(canvas, place, sheet)
    _draw_scale(canvas, (x, y + STRIP_HEIGHT))


def _spot(place: Point, lamp: SheetLamp, sheet: SetSheet) -> Point:
    """Return the position of a lamp on the strip, clamped to its edges."""
    height = (TOP_DEG - lamp.elevation_deg) / (TOP_DEG - BOTTOM_DEG) * STRIP_HEIGHT
    return (
        place[0] + min(max(x_of(lamp.azimuth_deg - sheet.front_deg), 14.0), STRIP_WIDTH - 14.0),
        place[1] + min(max(height, 16.0), STRIP_HEIGHT - 16.0),
    )


def _draw_tags(canvas: Page, place: Point, sheet: SetSheet) -> None:
    """Label the marks, each in the first row where its label covers no lamp, tag or frame."""
    x, y = place
    turn = float(whole(sheet.turn_deg))
    words = [(tr("You stand here"), turn)]
    if direction_of(turn) != "none":
        faced = tr("2  You stand here; the sitter faces you")
        words = [
            (tr("2  You stand here") if sheet.yaw_deg else faced, turn),
            (tr("1  You stood here"), 0.0),
        ]
    if sheet.yaw_deg:
        words.append((tr("The nose points here"), sheet.nose_deg))
    words.append((tr("Background of the picture"), turn + 180.0))
    spots = [_spot(place, lamp, sheet) for lamp in sheet.visible_lamps]
    occupied: list[Box] = [(spot[0] - 14.0, spot[1] - 14.0, 28.0, 28.0) for spot in spots]
    half = 0.5 * BACKGROUND_TALL_DEG
    frame = (half / _ACROSS, half / (TOP_DEG - BOTTOM_DEG) * STRIP_HEIGHT)
    middle = (x + x_of(turn + 180.0), y + TOP_DEG / (TOP_DEG - BOTTOM_DEG) * STRIP_HEIGHT)
    for around in (-STRIP_WIDTH, 0.0, STRIP_WIDTH):
        left = middle[0] + around - frame[0]
        occupied.append((left, middle[1] - frame[1], 2.0 * frame[0], 2.0 * frame[1]))
    for text, at_turn in words:
        width = text_width(text, 12, 500) + 16.0
        left = min(max(x + x_of(at_turn) - width / 2.0, x + 6.0), x + STRIP_WIDTH - 6.0 - width)
        boxes = [(left, y + row, width, 22.0) for row in _ROWS]
        best = min(boxes, key=lambda box: sum(overlap(box, other) for other in occupied))
        occupied.append(best)
        draw_tag(canvas, (left, best[1]), text)


def _picture(sheet: SetSheet, size: tuple[int, int]) -> FloatImage:
    """Crop the strip from the panorama, with the front in the middle."""
    height, width = sheet.panorama.shape[:2]
    rows = np.linspace(90.0 - TOP_DEG, 90.0 - BOTTOM_DEG, size[0] + 1)
    row = ((rows[:-1] + rows[1:]) / 360.0 * height - 0.5).astype(np.float32)
    turn = (np.arange(size[1]) + 0.5) / size[1] - 0.5 + sheet.front_deg / 360.0
    column = ((turn + 0.5) % 1.0 * width - 0.5).astype(np.float32)
    across, down = np.meshgrid(column, row)
    source = sheet.panorama
    if width >= 2 * size[1]:
        # The panorama is finer than the print, so average it first to avoid aliasing.
        source = np.asarray(cv2.blur(source, (width // size[1], width // size[1])), np.uint8)
    view = cv2.remap(source, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(view, np.float32) / np.float32(255.0)


def _outline(turn_deg: float) -> NDArray[np.float64]:
    """Return the outline of the background view as (N, 2) turns and elevations, in degrees.

    Turns may exceed 180 degrees.
    """
    side = np.arange(0.0, 100.0, 5.0)
    none, full = 0.0 * side, 0.0 * side + 100.0
    edges = ((side, none), (full, side), (100.0 - side, full), (none, 100.0 - side))
    rays = bearings(_LENS, 0.0, 0.0, np.concatenate([np.stack(edge, axis=1) for edge in edges]))
    turns = np.degrees(np.arctan2(-rays[:, 0], rays[:, 2])) + wrap(turn_deg)
    return np.stack([turns, np.degrees(np.arcsin(rays[:, 1]))], axis=1)


def _draw_frame(canvas: Page, place: Point, edge: NDArray[np.float64]) -> None:
    """Draw the edge of the frame, and repeat it at the other end if it wraps around the strip."""
    x, y = place
    down = (TOP_DEG - edge[:, 1]) / (TOP_DEG - BOTTOM_DEG) * STRIP_HEIGHT + y
    with canvas.clipped((x, y, STRIP_WIDTH, STRIP_HEIGHT)):
        for around in (-360.0, 0.0, 360.0):
            across = (edge[:, 0] + around + 180.0) / _ACROSS + x
            points = [(float(a), float(b)) for a, b in zip(across, down, strict=True)]
            canvas.stroke(points, Print.TAG, 3.5, closed=True)
            canvas.stroke(points, Print.AMBER_FILL, 1.75, closed=True, dashes=(6.0, 4.0))


def _pole(canvas: Page, foot: Point, colour: Colour, *, dashed: bool) -> None:
    x, y = foot
    canvas.stroke([(x, y + 2.0), (x, y + STRIP_HEIGHT - 2.0)], Print.TAG, 4.0, opacity=0.7)
    dashes = (6.0, 5.0) if dashed else None
    line = [(x, y + 1.0), (x, y + STRIP_HEIGHT - 1.0)]
    canvas.stroke(line, colour, 1.75 if dashed else 2.0, dashes=dashes)


def _draw_scale(canvas: Page, place: Point) -> None:
    x, y = place
    for degrees in range(-180, 181, 15):
        tick = min(max(x + (degrees + 180.0) / _ACROSS, x + 0.5), x + STRIP_WIDTH - 0.5)
        long = degrees % 45 == 0
        canvas.stroke([(tick, y + 4.0), (tick, y + (10.0 if long else 7.0))], Print.DIM, 1.0)
        if long:
            draw_degrees(canvas, (tick, y + 23.0), degrees, Print.INK)


# A4 at 96 logical pixels per inch: 210 x 297 mm.
WIDTH: Final = 794.0
HEIGHT: Final = 1123.0
MARGIN: Final = 44.0
_INNER: Final = WIDTH - 2 * MARGIN
_RIGHT: Final = WIDTH - MARGIN
_GAP: Final = 17.0
_TURN_TOP: Final = 138.0
PLAN_AT: Final = (_RIGHT - PLAN_WIDTH, _TURN_TOP)
_COLUMN: Final = PLAN_AT[0] - MARGIN - 20.0
# side of a picture; three of them and two gaps fill the width, aligned to whole pixels
_PICTURE: Final = 224.0
_PICTURES_TOP: Final = _TURN_TOP + PLAN_HEIGHT + 18.0
STRIP_AT: Final = (MARGIN, _PICTURES_TOP + _PICTURE + 18.0)
_PLACE_TOP: Final = STRIP_AT[1] + STRIP_HEIGHT + 46.0
_NOTES_TOP: Final = _PLACE_TOP + 22.0
_FOOT: Final = HEIGHT - 28.0
_LABEL: Final = 68.0
_NOTE_LINES: Final = 3
_LARGE: Final = 88.0
_LEADING: Final = 18.0


def draw_page(canvas: Page, sheet: SetSheet) -> None:
    """Draw a set sheet."""
    _draw_header(canvas, sheet)
    bottom = _draw_turn(canvas, sheet)
    _draw_facts(canvas, bottom, sheet)
    draw_plan(canvas, PLAN_AT, sheet)
    _draw_pictures(canvas, sheet)
    draw_strip(canvas, STRIP_AT, sheet)
    _draw_place(canvas, sheet)
    _draw_notes(canvas, sheet)
    _draw_foot(canvas, sheet)


def draw(sheet: SetSheet) -> NDArray[np.uint8]:
    """Draw a set sheet as a (2246, 1588, 3) sRGB image, which is A4 at 192 pixels per inch."""
    canvas = Page(WIDTH, HEIGHT, Print.PAPER)
    draw_page(canvas, sheet)
    return canvas.pixels


def write_png(path: Path, sheet: SetSheet) -> None:
    """Write a set sheet as a PNG file, atomically.

    Raises:
        CoreError: If the file cannot be written.
    """
    images.write_png(path, draw(sheet), PIXELS_PER_INCH)


def write_pdf(path: Path, sheet: SetSheet) -> None:
    """Write a set sheet as a one-page A4 PDF with searchable text, atomically.

    Raises:
        CoreError: If the file cannot be written.
    """
    title = f"{sheet.title}, {sheet.place}" if sheet.place else sheet.title
    data = pdf_bytes(WIDTH, HEIGHT, title, lambda canvas: draw_page(canvas, sheet))
    atomic_write_bytes(path, data)


def _draw_header(canvas: Page, sheet: SetSheet) -> None:
    place = " ".join(sheet.place.replace("_", " ").split()) or tr("Unnamed place")
    title = shorten(sheet.title, 32, 0.5 * _INNER, 700)
    end = canvas.text((MARGIN, 72.0), title, 32, 700, Print.INK)
    name = shorten(place, 16, _RIGHT - end - 24.0, 600)
    canvas.text((_RIGHT, 62.0), name, 16, 600, Print.INK, "right")
    canvas.text((_RIGHT, 81.0), sheet.made_text, 13, 400, Print.DIM, "right")
    side = shorten(light_words(sheet.side) or upper_first(sheet.light), 15, 0.5 * _INNER)
    end = canvas.text((MARGIN, 100.0), side, 15, 400, Print.DIM)
    room = _RIGHT - end - 24.0
    lines = wrap_text(sheet.age, 12, room)
    if len(lines) == 2:
        # Prefer two lines of similar length to one line and a single word.
        balanced = wrap_text(sheet.age, 12, 0.55 * text_width(sheet.age, 12))
        lines = balanced if len(balanced) == 2 else lines
    lines = [*lines[:1], shorten(" ".join(lines[1:]), 12, room)]
    for line, text in enumerate(lines):
        canvas.text((_RIGHT, 98.0 + 15.0 * line), text, 12, 400, Print.DIM, "right")
    canvas.panel((MARGIN, 121.0, _INNER, 1.5), Print.INK)


def _draw_turn(canvas: Page, sheet: SetSheet) -> float:
    """Draw the turn in figures and in words, and return the y coordinate below the text."""
    y = _TURN_TOP
    turn = sheet.turn_deg
    way = direction_of(turn)
    number, words = size_words(turn), direction_words(turn)
    room = _COLUMN - 9.0 - text_width(words, 17, 600)
    size = min(_LARGE, _LARGE * room / text_width(number, _LARGE, 700))
    end = canvas.text((MARGIN - 3.0, y + 66.0), number, size, 700, Print.AMBER) + 12.0
    if way != "none":
        sign = 1.0 if way == "clockwise" else -1.0
        middle = (end + 14.0, y + 15.0)
        draw_curved_arrow(canvas, middle, 12.0, (sign * -200.0, sign * 60.0), Print.AMBER)
        room = MARGIN + _COLUMN - end
        canvas.text((end, y + 66.0), clock_words(turn), 15, 400, Print.INK, room=room)
    canvas.text((end, y + 47.0), words, 17, 600, Print.INK)
    walk, company = walking_words(way, Mode.WALK)
    text = STAY
    if sheet.yaw_deg:
        text = tr("You stay where you are.")
    if walk:
        text = tr("{walk}, around the sitter.", walk=walk)
    canvas.text((MARGIN, y + 98.0), text, 17, 600, Print.INK, room=_COLUMN)
    good = tr("Good from {arc}.", arc=arc_words(sheet.arc_deg))
    if ends_of(sheet.arc_deg) is None:
        good = ANY_TURN
    text = f"{company} {good}".strip()
    canvas.text((MARGIN, y + 119.0), text, 13, 400, Print.DIM, room=_COLUMN)
    return y + 133.0


def _draw_facts(canvas: Page, top: float, sheet: SetSheet) -> None:
    canvas.panel((MARGIN, top, _COLUMN, 1.0), Print.LINE)
    y = _draw_match(canvas, top + 22.0, sheet)
    facts = _facts(sheet)
    room = _COLUMN - _LABEL
    lines = {f.label: wrap_text(f.text, 13, room, 600 if f.alarm else 400) for f in facts}
    # Drop the least important lines first if they do not all fit.
    for label in (tr("Light"), tr("Eyes")):
        height = sum(len(lines[fact.label]) * _LEADING + 6.0 for fact in facts)
        if y + height > _PICTURES_TOP:
            facts = [fact for fact in facts if fact.label != label or fact.alarm]
    for fact in facts:
        y = _draw_fact(canvas, y, fact, lines[fact.label])


@dataclass(frozen=True, slots=True)
class _Fact:
    label: str
    text: str
    alarm: bool = False


def _facts(sheet: SetSheet) -> list[_Fact]:
    facts = []
    if sheet.reason is not None:
        text = OUT_OF_REACH.format(reason=sheet.reason)
        facts.append(_Fact(tr("Reach"), text, alarm=True))
    if sheet.yaw_deg:
        facts.append(_Fact(tr("You"), f"{lens_words(sheet.yaw_deg)}."))
        facts.append(_Fact(tr("Sitter"), f"“{sitter_words(sheet.yaw_deg)}.”"))
    if sheet.ratio is not None:
        facts.append(_Fact(tr("Ratio"), f"{ratio_sentence(sheet.ratio)}."))
    if sheet.glare is not None:
        eye_words = "" if sheet.catchlights is None else f"{catchlight_words(sheet.catchlights)}."
        words = " ".join(filter(None, (glare_sentence(sheet.glare), eye_words)))
        facts.append(_Fact(tr("Eyes"), words, sheet.glare.warns))
    if sheet.flow is not None:
        facts.append(_Fact(tr("Light"), f"{flow_words(sheet.flow)}."))
    return facts


def _draw_match(canvas: Page, y: float, sheet: SetSheet) -> float:
    canvas.text((MARGIN, y), tr("Match"), 13, 600, Print.INK)
    x = MARGIN + _LABEL
    # Round down, so that a value under the limit never reads as the limit.
    match, contrast = max(math.floor(sheet.match), 0), contrast_words(sheet.strength)
    end = canvas.text((x, y), tr("{match} of 100", match=match), 13, 600, Print.INK)
    more = ", " + tr("contrast {contrast}", contrast=contrast)
    canvas.text((end, y), more, 13, 400, Print.INK, room=MARGIN + _COLUMN - end)
    bar = (x, y + 9.0, _COLUMN - _LABEL, 5.0)
    draw_meter(canvas, bar, match, sheet.limit, (Print.INK, Print.TRACK, Print.PAPER))
    return y + 36.0


def _draw_fact(canvas: Page, y: float, fact: _Fact, lines: Sequence[str]) -> float:
    """Draw a label with wrapped text beside it, and return the y coordinate of the next line."""
    x = MARGIN
    if fact.alarm:
        draw_warning(canvas, (MARGIN + 7.5, y - 4.5), Print.INK)
        x += 19.0
    canvas.text((x, y), fact.label, 13, 600, Print.INK, room=MARGIN + _LABEL - 4.0 - x)
    for line in lines:
        canvas.text((MARGIN + _LABEL, y), line, 13, 600 if fact.alarm else 400, Print.INK)
        y += _LEADING
    return y + 6.0


def _draw_pictures(canvas: Page, sheet: SetSheet) -> None:
    boxes: list[Box] = [
        (MARGIN + k * (_PICTURE + _GAP), _PICTURES_TOP, _PICTURE, _PICTURE) for k in range(3)
    ]
    here = tr("Here, without a turn")
    if direction_of(sheet.turn_deg) != "none":
        here = tr("Here, {turn}", turn=turn_words(sheet.turn_deg))
    tags = (tr("Target"), here, tr("Behind the sitter"))
    size = canvas.size_of(boxes[0])
    target, picture = (np.asarray(one / 255, np.float32) for one in sheet.draw(size))
    views = (target, picture, background(sheet, size))
    for box, view, text in zip(boxes, views, tags, strict=True):
        canvas.picture(box, view, 8.0)
        place: Point = (box[0] + 8.0, box[1] + box[3] - 30.0)
        draw_tag(canvas, place, shorten(text, 12, box[2] - 32.0, 500))


def _draw_place(canvas: Page, sheet: SetSheet) -> None:
    """Write the verdict about the place on one line."""
    if sheet.verdict:
        canvas.text((MARGIN, _PLACE_TOP), tr("Place"), 13, 600, Print.INK)
        x = MARGIN + _LABEL
        canvas.text((x, _PLACE_TOP), shorten(sheet.verdict, 13, _RIGHT - x), 13, 400, Print.INK)


def _draw_notes(canvas: Page, sheet: SetSheet) -> None:
    y = _NOTES_TOP
    canvas.text((MARGIN, y), tr("Notes"), 13, 600, Print.INK)
    x = MARGIN + _LABEL
    lines = wrap_text(sheet.notes, 13, _RIGHT - x)
    last = _NOTE_LINES - 1
    lines = [*lines[:last], shorten(" ".join(lines[last:]), 13, _RIGHT - x)]
    for line in range(_NOTE_LINES):
        baseline = y + 22.0 * line
        canvas.panel((x, baseline + 5.0, _RIGHT - x, 1.0), Print.LINE)
        text = lines[line] if line < len(lines) else ""
        canvas.text((x, baseline), text, 13, 400, Print.INK)


def _draw_foot(canvas: Page, sheet: SetSheet) -> None:
    draw_logo(canvas, (MARGIN + 8.0, _FOOT - 4.5), (8.0, 6.75, 5.2), (Print.INK, Print.PAPER))
    end = canvas.text((MARGIN + 24.0, _FOOT), tr("Turnlight set sheet"), 12, 600, Print.INK)
    text = tr("Turns are in degrees, clockwise as seen from above.")
    text = f"{sheet.head}. {text}" if sheet.head else text
    canvas.text((_RIGHT, _FOOT), text, 12, 400, Print.DIM, "right", _RIGHT - end - 24.0)
