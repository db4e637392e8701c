"""The page of a set sheet: A4, upright, ink on white."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.solver import pictures
from app.core.solver.pictures import WELL
from app.core.text.turns import (
    Mode,
    arc_words,
    clock_words,
    direction_of,
    direction_words,
    side_words,
    size_words,
    turn_words,
    walking_words,
)
from app.export.result_sheet.canvas import Canvas
from app.export.result_sheet.lettering import Lettering
from app.export.set_sheet import marks, plan, strip
from app.export.set_sheet.theme import (
    AMBER,
    AMBER_FILL,
    DIM,
    HEIGHT,
    INK,
    LINE,
    MARGIN,
    PAPER,
    TRACK,
    WIDTH,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from app.core.base.colour import FloatImage
    from app.export.result_sheet.canvas import Box, Point
    from app.export.set_sheet.data import SetSheet

_INNER: Final = WIDTH - 2 * MARGIN
_RIGHT: Final = WIDTH - MARGIN
_GAP: Final = 17.0
_TURN_TOP: Final = 138.0
PLAN_AT: Final = (_RIGHT - plan.WIDTH, _TURN_TOP)
_COLUMN: Final = PLAN_AT[0] - MARGIN - 20.0
_PICTURE: Final = 224.0  # with two gaps the whole width; pictures lie on whole pixels
_PICTURES_TOP: Final = _TURN_TOP + plan.HEIGHT + 18.0
STRIP_AT: Final = (MARGIN, _PICTURES_TOP + _PICTURE + 18.0)
_NOTES_TOP: Final = STRIP_AT[1] + strip.HEIGHT + 50.0
_FOOT: Final = HEIGHT - 28.0
_LABEL: Final = 68.0
_NOTE_LINES: Final = 3
_LARGE: Final = 88.0
_LEADING: Final = 18.0


def draw(sheet: SetSheet, lettering: Lettering | None = None) -> NDArray[np.uint8]:
    """Draw a set sheet.

    Returns
    -------
    NDArray[np.uint8], (2246, 1588, 3)
        SRGB page, 192 pixels per inch: A4.
    """
    letters = Lettering() if lettering is None else lettering
    canvas = Canvas(WIDTH, HEIGHT, PAPER)
    _draw_header(canvas, sheet, letters)
    bottom = _draw_turn(canvas, sheet, letters)
    _draw_facts(canvas, bottom, sheet, letters)
    plan.draw_plan(canvas, PLAN_AT, sheet, letters)
    _draw_pictures(canvas, sheet, letters)
    strip.draw_strip(canvas, STRIP_AT, sheet, letters)
    _draw_notes(canvas, sheet, letters)
    _draw_foot(canvas, sheet, letters)
    return canvas.pixels


def _draw_header(canvas: Canvas, sheet: SetSheet, letters: Lettering) -> None:
    place = " ".join(sheet.place.replace("_", " ").split()) or "Unnamed place"
    title = letters.shorten(sheet.title, 32, 0.5 * _INNER, 700)
    end = letters.draw(canvas, (MARGIN, 72.0), title, 32, 700, INK)
    name = letters.shorten(place, 16, _RIGHT - end - 24.0, 600)
    letters.draw(canvas, (_RIGHT, 62.0), name, 16, 600, INK, "right")
    letters.draw(canvas, (_RIGHT, 81.0), sheet.made, 13, 400, DIM, "right")
    side = letters.shorten(_side(sheet), 15, 0.5 * _INNER)
    end = letters.draw(canvas, (MARGIN, 100.0), side, 15, 400, DIM)
    room = _RIGHT - end - 24.0
    lines = letters.wrap(sheet.age, 12, room)
    if len(lines) == 2:
        # Two lines of about the same length rather than one with a last word under it.
        half = 0.55 * letters.width(sheet.age, 12)
        balanced = letters.wrap(sheet.age, 12, half)
        lines = balanced if len(balanced) == 2 else lines
    lines = [*lines[:1], letters.shorten(" ".join(lines[1:]), 12, room)]
    for line, text in enumerate(lines):
        letters.draw(canvas, (_RIGHT, 98.0 + 15.0 * line), text, 12, 400, DIM, "right")
    canvas.panel((MARGIN, 121.0, _INNER, 1.5), INK)


def _side(sheet: SetSheet) -> str:
    """Name the side twice, or say where the light comes from: "In front, from above"."""
    return side_words(sheet.side) or sheet.light[:1].upper() + sheet.light[1:]


def _draw_turn(canvas: Canvas, sheet: SetSheet, letters: Lettering) -> float:
    """Draw the turn in large figures and in words; return where the words end."""
    y = _TURN_TOP
    turn = sheet.turn_deg
    way = direction_of(turn)
    number, words = size_words(turn), direction_words(turn)
    room = _COLUMN - 9.0 - letters.width(words, 17, 600)
    size = min(_LARGE, _LARGE * room / letters.width(number, _LARGE, 700))
    end = letters.draw(canvas, (MARGIN - 3.0, y + 66.0), number, size, 700, AMBER) + 12.0
    if way != "none":
        sign = 1.0 if way == "clockwise" else -1.0
        middle = (end + 14.0, y + 15.0)
        marks.curved_arrow(canvas, middle, 12.0, (sign * -200.0, sign * 60.0), AMBER)
        letters.draw(canvas, (end, y + 66.0), clock_words(turn), 15, 400, INK)
    letters.draw(canvas, (end, y + 47.0), words, 17, 600, INK)
    walk, company = walking_words(way, Mode.WALK)
    text = f"{walk}, around the sitter." if walk else "You and the sitter stay as you stand."
    letters.draw(canvas, (MARGIN, y + 98.0), text, 17, 600, INK)
    arc = arc_words(sheet.arc_deg)
    good = "Good at any turn." if arc == "any turn" else f"Good from {arc}."
    letters.draw(canvas, (MARGIN, y + 119.0), f"{company} {good}".strip(), 13, 400, DIM)
    return y + 133.0


def _draw_facts(canvas: Canvas, top: float, sheet: SetSheet, letters: Lettering) -> None:
    canvas.panel((MARGIN, top, _COLUMN, 1.0), LINE)
    y = _draw_match(canvas, top + 22.0, sheet, letters)
    facts = _facts(sheet)
    room = _COLUMN - _LABEL
    lines = {f.label: letters.wrap(f.text, 13, room, 600 if f.alarm else 400) for f in facts}
    # What does not fit is left out, the least needed first.
    for label in ("Light", "Eyes"):
        height = sum(len(lines[fact.label]) * _LEADING + 6.0 for fact in facts)
        if y + height > _PICTURES_TOP:
            facts = [fact for fact in facts if fact.label != label or fact.alarm]
    for fact in facts:
        y = _draw_fact(canvas, y, fact, lines[fact.label], letters)


@dataclass(frozen=True, slots=True)
class _Fact:
    label: str
    text: str
    alarm: bool = False


def _facts(sheet: SetSheet) -> list[_Fact]:
    facts = []
    if sheet.reason is not None:
        text = f"Out of reach here. {sheet.reason.rstrip('.')}."
        facts.append(_Fact("Reach", text, alarm=True))
    if sheet.ratio is not None:
        facts.append(_Fact("Ratio", _ratio_text(sheet)))
    if sheet.glare is not None:
        facts.append(_Fact("Eyes", sheet.glare.words, sheet.glare.warns))
    if sheet.flow is not None:
        facts.append(_Fact("Light", f"{sheet.flow.words}."))
    return facts


def _ratio_text(sheet: SetSheet) -> str:
    assert sheet.ratio is not None
    return f"{sheet.ratio.words.rstrip('.')}."


def _draw_match(canvas: Canvas, y: float, sheet: SetSheet, letters: Lettering) -> float:
    letters.draw(canvas, (MARGIN, y), "Match", 13, 600, INK)
    x = MARGIN + _LABEL
    # Rounded down, so that what is under the limit never reads as the limit.
    match, strength = (max(math.floor(value), 0) for value in (sheet.match, sheet.strength))
    end = letters.draw(canvas, (x, y), f"{match} of 100", 13, 600, INK)
    letters.draw(canvas, (end, y), f", strength {strength}", 13, 400, INK)
    bar = (x, y + 9.0, _COLUMN - _LABEL, 5.0)
    canvas.panel(bar, TRACK, 2.5)
    canvas.panel((x, y + 9.0, max(bar[2] * min(match, 100) / 100.0, 5.0), 5.0), INK, 2.5)
    tick = x + bar[2] * sheet.limit / 100.0
    canvas.panel((tick - 2.0, y + 6.0, 4.0, 11.0), PAPER)
    canvas.panel((tick - 0.75, y + 6.0, 1.5, 11.0), INK)
    return y + 36.0


def _draw_fact(
    canvas: Canvas, y: float, fact: _Fact, lines: Sequence[str], letters: Lettering
) -> float:
    """Draw a label with wrapped words beside it; return the next line."""
    x = MARGIN
    if fact.alarm:
        marks.warning(canvas, (MARGIN + 7.5, y - 4.5), INK)
        x += 19.0
    letters.draw(canvas, (x, y), fact.label, 13, 600, INK)
    for line in lines:
        letters.draw(canvas, (MARGIN + _LABEL, y), line, 13, 600 if fact.alarm else 400, INK)
        y += _LEADING
    return y + 6.0


def _draw_pictures(canvas: Canvas, sheet: SetSheet, letters: Lettering) -> None:
    boxes: list[Box] = [
        (MARGIN + k * (_PICTURE + _GAP), _PICTURES_TOP, _PICTURE, _PICTURE) for k in range(3)
    ]
    way = turn_words(sheet.turn_deg)
    here = "Here, without a turn" if direction_of(sheet.turn_deg) == "none" else f"Here, {way}"
    tags = ("Target" if sheet.target is not None else "Painted", here, "Behind the sitter")
    shown = (_target(sheet, canvas.size_of(boxes[0])), _here(sheet, canvas.size_of(boxes[1])))
    views = (*shown, strip.background(sheet, canvas.size_of(boxes[2])))
    for box, view, text in zip(boxes, views, tags, strict=True):
        canvas.picture(box, view, 8.0)
        place: Point = (box[0] + 8.0, box[1] + box[3] - 30.0)
        marks.tag(canvas, place, text, letters)


def _target(sheet: SetSheet, size: tuple[int, int]) -> FloatImage:
    if sheet.target is not None:
        return pictures.portrait(sheet.target, sheet.coverage, size)
    if sheet.painted is None:
        return np.full((size[0], size[1], 3), WELL[0] / 255.0, np.float32)
    method = cv2.INTER_AREA if sheet.painted.shape[0] > size[0] else cv2.INTER_CUBIC
    painted = cv2.resize(sheet.painted, (size[1], size[0]), interpolation=method)
    return np.asarray(painted, np.float32) / np.float32(255.0)


def _here(sheet: SetSheet, size: tuple[int, int]) -> FloatImage:
    return pictures.portrait(sheet.picture, sheet.coverage, size)


def _draw_notes(canvas: Canvas, sheet: SetSheet, letters: Lettering) -> None:
    y = _NOTES_TOP
    letters.draw(canvas, (MARGIN, y), "Notes", 13, 600, INK)
    x = MARGIN + _LABEL
    lines = letters.wrap(sheet.notes, 13, _RIGHT - x)
    last = _NOTE_LINES - 1
    lines = [*lines[:last], letters.shorten(" ".join(lines[last:]), 13, _RIGHT - x)]
    for line in range(_NOTE_LINES):
        baseline = y + 22.0 * line
        canvas.panel((x, baseline + 5.0, _RIGHT - x, 1.0), LINE)
        text = lines[line] if line < len(lines) else ""
        letters.draw(canvas, (x, baseline), text, 13, 400, INK)


def _draw_foot(canvas: Canvas, sheet: SetSheet, letters: Lettering) -> None:
    logo = (MARGIN + 8.0, _FOOT - 4.5)
    canvas.dot(logo, 8.0, INK)
    canvas.dot(logo, 6.75, PAPER)
    angles = np.linspace(0.0, np.pi, 33)
    half = [(logo[0] + 5.2 * math.sin(a), logo[1] - 5.2 * math.cos(a)) for a in angles]
    canvas.shape(half, AMBER_FILL)
    letters.draw(canvas, (MARGIN + 24.0, _FOOT), "Turnlight set sheet", 12, 600, INK)
    text = "Turns are degrees, clockwise as seen from above."
    text = f"{sheet.head}. {text}" if sheet.head else text
    letters.draw(canvas, (_RIGHT, _FOOT), text, 12, 400, DIM, "right")
