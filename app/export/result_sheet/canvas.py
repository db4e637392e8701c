"""A drawing surface in logical pixels: anti-aliased shapes and pictures.

Shapes are drawn as coverage at four times the surface's resolution and averaged, which gives the
same clean edges for every shape, without a drawing library beyond OpenCV.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.export.result_sheet.theme import SCALE, Colour

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

Point: TypeAlias = tuple[float, float]
"""x to the right, y down, logical pixels."""

Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, width, height, logical pixels."""

Mask: TypeAlias = NDArray[np.uint8]
"""Coverage 0 to 255, (H, W)."""

_FINE: Final = 4
FINE: Final = SCALE * _FINE
"""Pixels of a shape's mask per logical pixel."""

_SHIFT: Final = 4
_SUB: Final = 1 << _SHIFT


class Canvas:
    """An sRGB picture that is drawn on.

    Parameters
    ----------
    width, height : float
        Size in logical pixels.

    Attributes
    ----------
    pixels : NDArray[np.uint8], (H, W, 3)
        The picture, sRGB, `SCALE` pixels per logical pixel.
    """

    def __init__(self, width: float, height: float, colour: Colour) -> None:
        shape = (round(height * SCALE), round(width * SCALE), 3)
        self.pixels: NDArray[np.uint8] = np.empty(shape, np.uint8)
        self.pixels[:] = colour

    def panel(
        self, box: Box, colour: Colour, radius: float = 0.0, edge: Colour | None = None
    ) -> None:
        """Draw a filled rectangle with rounded corners, and a 1 px edge inside it if wanted."""
        if edge is not None:
            self.fill(box, edge, lambda mask, at: _round(mask, at, box, radius))
            x, y, width, height = box
            box, radius = (x + 1, y + 1, width - 2, height - 2), max(radius - 1, 0.0)
        self.fill(box, colour, lambda mask, at: _round(mask, at, box, radius))

    def stroke(
        self,
        points: Sequence[Point],
        colour: Colour,
        width: float = 1.0,
        *,
        closed: bool = False,
        opacity: float = 1.0,
    ) -> None:
        """Draw a line through points, with round joins and ends.

        Parameters
        ----------
        opacity : float, optional
            0 to 1.
        """

        def draw(mask: Mask, at: Point) -> None:
            thickness = max(round(width * FINE), 1)
            path = [_fine_points(points, at)]
            cv2.polylines(mask, path, closed, 255, thickness, cv2.LINE_8, _SHIFT)

        self.fill(_around(points, width), colour, draw, opacity)

    def shape(self, points: Sequence[Point], colour: Colour, opacity: float = 1.0) -> None:
        """Fill a polygon.

        Parameters
        ----------
        opacity : float, optional
            0 to 1.
        """

        def draw(mask: Mask, at: Point) -> None:
            cv2.fillPoly(mask, [_fine_points(points, at)], 255, cv2.LINE_8, _SHIFT)

        self.fill(_around(points, 0.0), colour, draw, opacity)

    def dot(self, centre: Point, radius: float, colour: Colour) -> None:
        """Draw a filled circle."""
        self.shape(circle_points(centre, radius), colour)

    def dashes(
        self, points: Sequence[Point], colour: Colour, width: float, on: float, off: float
    ) -> None:
        """Draw a dashed line."""
        length, run = 0.0, [points[0]]
        for before, here in pairwise(points):
            length += math.dist(before, here)
            if length % (on + off) < on:
                run.append(here)
            else:
                if len(run) > 1:
                    self.stroke(run, colour, width)
                run = [here]
        if len(run) > 1:
            self.stroke(run, colour, width)

    def picture(self, box: Box, display: NDArray[np.float32], radius: float = 0.0) -> None:
        """Place a picture, with rounded corners.

        Parameters
        ----------
        box : Box
            Where, on whole pixels of the surface.
        display : NDArray[np.float32], (h, w, 3)
            sRGB in 0..1, in the surface's resolution (see `Canvas.size_of`).
        """
        rows, columns, cover = self._cover(box, lambda mask, at: _round(mask, at, box, radius))
        region = self.pixels[rows, columns].astype(np.float32)
        mixed = region + cover[..., np.newaxis] * (display * 255.0 - region)
        self.pixels[rows, columns] = (mixed + 0.5).astype(np.uint8)

    @staticmethod
    def size_of(box: Box) -> tuple[int, int]:
        """Rows and columns of the surface's pixels in a box."""
        x, y, width, height = box
        return (
            round((y + height) * SCALE) - round(y * SCALE),
            round((x + width) * SCALE) - round(x * SCALE),
        )

    def fill(
        self,
        box: Box,
        colour: Colour,
        draw: Callable[[Mask, Point], None],
        opacity: float = 1.0,
    ) -> None:
        """Fill whatever shape a function draws.

        Parameters
        ----------
        draw : Callable[[Mask, Point], None]
            Draws the shape with 255 into a mask of `FINE` pixels per logical pixel, whose upper
            left corner is at the point given.
        opacity : float, optional
            0 to 1.
        """
        rows, columns, cover = self._cover(box, draw)
        region = self.pixels[rows, columns].astype(np.float32)
        ink = np.asarray(colour, np.float32)
        mixed = region + (cover * opacity)[..., np.newaxis] * (ink - region)
        self.pixels[rows, columns] = (mixed + 0.5).astype(np.uint8)

    def _cover(
        self, box: Box, draw: Callable[[Mask, Point], None]
    ) -> tuple[slice, slice, NDArray[np.float32]]:
        """Coverage of what `draw` draws in a box: whole pixels around it, cut to the surface."""
        x, y, width, height = box
        left, top = math.floor(x * SCALE + 1e-6), math.floor(y * SCALE + 1e-6)
        right = math.ceil((x + width) * SCALE - 1e-6)
        bottom = math.ceil((y + height) * SCALE - 1e-6)
        mask = np.zeros((max(bottom - top, 1) * _FINE, max(right - left, 1) * _FINE), np.uint8)
        draw(mask, (left / SCALE, top / SCALE))
        size = (mask.shape[1] // _FINE, mask.shape[0] // _FINE)
        cover = cv2.resize(mask, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255.0
        high, wide = self.pixels.shape[:2]
        rows = slice(min(max(top, 0), high), min(max(top + size[1], 0), high))
        columns = slice(min(max(left, 0), wide), min(max(left + size[0], 0), wide))
        inside = cover[
            rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]
        return rows, columns, inside


def circle_points(centre: Point, radius: float, count: int = 96) -> list[Point]:
    """Points on a circle, closed, clockwise from the top.

    Returns
    -------
    list[Point]
        ``count + 1`` points, the last like the first.
    """
    angles = [2.0 * math.pi * index / count for index in range(count + 1)]
    return [
        (centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle))
        for angle in angles
    ]


def _fine_points(points: Sequence[Point], at: Point) -> NDArray[np.int32]:
    """To the mask's fixed-point pixels, whose whole numbers are at the pixels' middles."""
    values = (np.asarray(points, np.float64) - at) * FINE - 0.5
    return np.round(values * _SUB).astype(np.int32)


def _around(points: Sequence[Point], width: float) -> Box:
    xs, ys = [point[0] for point in points], [point[1] for point in points]
    room = width / 2.0 + 0.5
    return (
        min(xs) - room,
        min(ys) - room,
        max(xs) - min(xs) + 2.0 * room,
        max(ys) - min(ys) + 2.0 * room,
    )


def _round(mask: Mask, at: Point, box: Box, radius: float) -> None:
    """Fill a rectangle with rounded corners, on the whole fine pixels."""
    left, top = round((box[0] - at[0]) * FINE), round((box[1] - at[1]) * FINE)
    right = round((box[0] + box[2] - at[0]) * FINE) - 1
    bottom = round((box[1] + box[3] - at[1]) * FINE) - 1
    r = min(round(radius * FINE), (right - left) // 2, (bottom - top) // 2)
    if r <= 0:
        cv2.rectangle(mask, (left, top), (right, bottom), 255, cv2.FILLED)
        return
    cv2.rectangle(mask, (left + r, top), (right - r, bottom), 255, cv2.FILLED)
    cv2.rectangle(mask, (left, top + r), (right, bottom - r), 255, cv2.FILLED)
    for x in (left + r, right - r):
        for y in (top + r, bottom - r):
            cv2.circle(mask, (x, y), r, 255, cv2.FILLED)
