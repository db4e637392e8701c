"""A preview of a measurement: the panorama with its lamps, clipped areas and masks marked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes
from app.core.base.phrases import percent, small_percent
from app.core.environment.environment import solid_angles
from app.core.measure.finish.display import (
    MASK_COLOUR,
    WIDTH,
    clip_overlay,
    display_panorama,
    mask_overlay,
)
from app.core.measure.finish.lamp_detection import Light
from app.core.measure.finish.tripod_detection import Clutter
from app.core.measure.read.frame import MergedLight
from app.core.portrait.display_pictures import WELL
from app.core.text import tr
from app.export.canvas import SCALE, Box, Page, Point, circle_points, shorten, text_width
from app.export.theme import Dark, draw_scale
from app.words.measure.masks import clutter_name
from app.words.phrases.quantities import stops_words, upper_first
from app.words.phrases.turns import signed

_MARGIN: Final = 24.0
_SCALE_ROOM: Final = 28.0
_GAP: Final = 22.0
_ROW: Final = 26.0
_MOST_ROWS: Final = 8
_TAG_SIZE: Final = 22.0
_NOTES_LEFT: Final = 0.52  # left edge of the notes, as a fraction of the panorama's width


def preview(
    merged: MergedLight,
    lights: Sequence[Light] = (),
    masks: Sequence[Clutter] = (),
    exposure_stops: float = 0.0,
    *,
    display: Bytes | None = None,
) -> Bytes:
    """Draw the panorama with a legend, marking the lamps, clipped areas and masks.

    Args:
        display: NDArray[np.uint8], (h, w, 3). The panorama as returned by
            `measure.finish.display.display_panorama` at that exposure, or None to compute it.

    Returns:
        NDArray[np.uint8], (rows, columns, 3). sRGB picture for `images.write_png`, in which the
        panorama is 2,048 pixels wide.
    """
    picture = display_panorama(merged.radiance, exposure_stops) if display is None else display
    if picture.shape[1] != WIDTH:
        rows = max(round(picture.shape[0] * WIDTH / picture.shape[1]), 1)
        picture = np.asarray(
            cv2.resize(picture, (WIDTH, rows), interpolation=cv2.INTER_AREA), np.uint8
        )
    for each in masks:
        picture = mask_overlay(picture, each.mask)
    picture = clip_overlay(picture, merged.clipped)
    high, wide = float(-(-picture.shape[0] // SCALE)), picture.shape[1] / SCALE
    notes = _notes(merged, masks, exposure_stops)
    lines = max(min(len(lights), _MOST_ROWS + 1) + 1 if lights else 0, len(notes))
    top = _MARGIN + _SCALE_ROOM
    canvas = Page(wide + 2 * _MARGIN, top + high + _GAP + lines * _ROW + _MARGIN - 8, Dark.BG)
    box = (_MARGIN, top, wide, picture.shape[0] / SCALE)
    canvas.picture(box, picture.astype(np.float32) / 255.0, 8.0)
    if picture.shape[1] == 2 * picture.shape[0]:
        _draw_scale(canvas, box)
        _draw_lamps(canvas, box, lights)
    foot = (_MARGIN, top + high + _GAP)
    _draw_lamp_list(canvas, foot, lights)
    _draw_notes(canvas, (float(round(_MARGIN + _NOTES_LEFT * wide)), foot[1]), notes)
    return canvas.pixels


def _draw_scale(canvas: Page, box: Box) -> None:
    """Draw the azimuth scale above the panorama, and a line at the photographer's position."""
    x, top, wide, high = box
    middle = x + wide / 2.0
    canvas.stroke([(middle, top), (middle, top + high)], Dark.TAG, 3.0, opacity=0.35)
    canvas.stroke([(middle, top), (middle, top + high)], Dark.ON_TAG, 1.0, opacity=0.75)
    draw_scale(canvas, box, tr("0° photographer stands here"), (Dark.CTL, Dark.DIM))


def _draw_lamps(canvas: Page, box: Box, lights: Sequence[Light]) -> None:
    """Draw a ring around each lamp, with its letter at a free position."""
    points: list[Point] = []
    rings = [(light, *_ring(box, light)) for light in lights]
    for _, centre, radius in rings:
        ring = circle_points(centre, radius)
        canvas.stroke(ring, Dark.TAG, 3.5, opacity=0.55)
        canvas.stroke(ring, Dark.ON_TAG, 1.5)
    for light, centre, radius in rings:
        at = _free_place(box, centre, radius, points)
        points.append(at)
        _draw_tag(canvas, at, light.id)


def _ring(box: Box, light: Light) -> tuple[Point, float]:
    x, top, wide, high = box
    centre = (
        x + wide * ((light.azimuth_deg / 360.0 + 0.5) % 1.0),
        top + high * (0.5 - light.elevation_deg / 180.0),
    )
    return centre, min(max(light.diameter_deg / 360.0 * wide / 2.0 + 3.0, 7.0), 60.0)


def _free_place(box: Box, centre: Point, radius: float, points: Sequence[Point]) -> Point:
    """Return the centre for a letter beside its ring, away from other letters."""
    x, top, wide, high = box
    room = _TAG_SIZE / 2.0 + 2.0
    far = radius + room + 2.0
    slant = 0.8 * far
    offsets = (
        (slant, -slant), (-slant, -slant), (slant, slant), (-slant, slant),
        (far, 0.0), (-far, 0.0), (0.0, -far), (0.0, far),
    )  # fmt: skip
    places = [
        (
            min(max(centre[0] + right, x + room), x + wide - room),
            min(max(centre[1] + down, top + room), top + high - room),
        )
        for right, down in offsets
    ]

    def crowded(place: Point) -> float:
        nearest = min((float(np.hypot(place[0] - a, place[1] - b)) for a, b in points), default=1e9)
        on_lamp = float(np.hypot(place[0] - centre[0], place[1] - centre[1])) < radius
        return max(_TAG_SIZE + 2.0 - nearest, 0.0) + (100.0 if on_lamp else 0.0)

    return min(places, key=crowded)


def _draw_tag(canvas: Page, at: Point, letter: str) -> None:
    wide = max(text_width(letter, 13, 700) + 10.0, _TAG_SIZE)
    box = (at[0] - wide / 2.0, at[1] - _TAG_SIZE / 2.0, wide, _TAG_SIZE)
    canvas.panel(box, Dark.TAG, 5.0, Dark.CTL)
    canvas.text((at[0], at[1] + 4.7), letter, 13, 700, Dark.ON_TAG, "middle")


def _draw_lamp_list(canvas: Page, at: Point, lights: Sequence[Light]) -> None:
    """Draw a row for each lamp, with its letter, its direction and its share of the light."""
    if not lights:
        return
    x, y = at
    stops = (0.0, 52.0, 124.0, 206.0)
    heads = (tr("Lamp"), tr("Azimuth"), tr("Elevation"), tr("Share of the light"))
    for stop, head in zip(stops, heads, strict=True):
        canvas.text((x + stop, y + 12), head, 12, 600, Dark.DIM)
    rows = lights[:_MOST_ROWS]
    for row, light in enumerate(rows, start=1):
        line = y + row * _ROW + 12
        _draw_tag(canvas, (x + _TAG_SIZE / 2.0, line - 4.5), light.id)
        canvas.text((x + stops[1], line), signed(light.azimuth_deg), 13, 400, Dark.TEXT)
        canvas.text((x + stops[2], line), signed(light.elevation_deg), 13, 400, Dark.TEXT)
        words = small_percent(light.share)
        if light.clipped and light.share < 0.001:
            words = tr("{share}, clipped", share=words)
        elif light.clipped:
            words = tr("at least {share}, clipped", share=words)
        canvas.text((x + stops[3], line), words, 13, 600 if light.clipped else 400, Dark.TEXT)
    if len(lights) > len(rows):
        line = y + (len(rows) + 1) * _ROW + 12
        rest = sum(light.share for light in lights[_MOST_ROWS:])
        words = tr(
            "and {count} more, together {share}",
            count=len(lights) - len(rows),
            share=small_percent(rest),
        )
        canvas.text((x, line), words, 13, 400, Dark.DIM)


def _notes(
    merged: MergedLight, masks: Sequence[Clutter], exposure_stops: float
) -> list[tuple[str, str]]:
    """Return the legend as pairs of a swatch type and its text."""
    shape = (merged.radiance.shape[0], merged.radiance.shape[1])
    heights = solid_angles(shape) / (4.0 * np.pi)
    notes = []
    clipped = float(merged.clipped.sum(axis=1, dtype=np.float64) @ heights)
    if (merged.clipped > 0.0).any():
        words = tr(
            "Too bright for every frame: {share} of the sphere", share=small_percent(clipped)
        )
        notes.append(("hatch", words))
    for each in masks:
        share = small_percent(each.solid_angle_sr / (4.0 * np.pi))
        name = upper_first(clutter_name(each))
        words = tr("{name}: {share} of the sphere", name=name, share=share)
        if each.confidence < 1.0:
            sure = percent(each.confidence)
            words = tr(
                "{name}: {share} of the sphere, {sure} sure", name=name, share=share, sure=sure
            )
        notes.append(("mask", words))
    if exposure_stops:
        stops = stops_words(abs(exposure_stops))
        brighter, darker = (
            tr("Shown {stops} brighter than usual", stops=stops),
            tr("Shown {stops} darker than usual", stops=stops),
        )
        notes.append(("", brighter if exposure_stops > 0 else darker))
    return notes


def _draw_notes(canvas: Page, at: Point, notes: Sequence[tuple[str, str]]) -> None:
    for row, (kind, words) in enumerate(notes):
        x, line = at[0], at[1] + row * _ROW + 12
        box = (x, line - 11.0, 22.0, 14.0)
        if kind == "hatch":
            canvas.picture(box, _hatch(canvas.size_of(box)), 3.0)
        elif kind == "mask":
            canvas.panel(box, _mixed(), 3.0, Dark.ON_TAG)
        room = canvas.width - _MARGIN - x - 32.0
        cut = shorten(words, 13, room)
        canvas.text((x + (32.0 if kind else 0.0), line), cut, 13, 400, Dark.TEXT)


def _hatch(size: tuple[int, int]) -> NDArray[np.float32]:
    plain = np.full((*size, 3), WELL[0], np.uint8)
    return clip_overlay(plain, np.ones(size, np.float32), WIDTH).astype(np.float32) / 255.0


def _mixed() -> tuple[int, int, int]:
    red, green, blue = (round(0.6 * ink + 0.4 * WELL[0]) for ink in MASK_COLOUR)
    return red, green, blue
