"""Outlines of the areas of a face in a portrait, to show what a signature compares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.portrait.gallery_portraits import framing
from app.core.portrait.head import Head
from app.core.portrait.portrait_head import ROOM
from app.core.solver.face import AREAS, AROUND

_FINER: Final = 8  # times the pixels of the transport's picture
_SMOOTH: Final = 0.6  # pixels of that picture
_HALF: Final = 0.5  # of a part's largest weight, which is the rim of its oval
_EDGE: Final = 0.02  # of an area's largest weight, around all of its parts
_SMALLEST: Final = 0.2  # of the largest piece; smaller pieces, as beside the nose, only distract


@dataclass(frozen=True, slots=True, eq=False)
class AreaOutline:
    """The outline of an area in the picture of a head.

    Attributes:
        area: One of `AREAS`.
        loops: (n, 2) float64 each, largest first. Corners of the closed outlines, in pixels of the
            transport's picture from its upper left corner, across and down. There are none for an
            area that is not on the head or not visible.
    """

    area: str
    loops: tuple[Float64, ...] = field(repr=False)

    def in_portrait(self, head: Head, size: tuple[int, int]) -> tuple[Float64, ...]:
        """Return the outlines in the portrait that `Head.portraits` draws.

        Args:
            size: Rows and columns of the portrait, which decide its crop.

        Returns:
            (n, 2) float64 each. Fractions of the portrait's width from the left, and of its height
            from the top.
        """
        above = ROOM if head.may_be_full_at(size) else None
        frame = framing(head.transport.size, size, above=above)
        extent = frame.step * np.array(size[::-1])
        return tuple((loop - [frame.left, frame.top]) / extent for loop in self.loops)


def area_outlines(head: Head, areas: Sequence[str]) -> tuple[AreaOutline, ...]:
    """Outline areas on a head.

    Args:
        head: The head as the lens sees it.
        areas: Names from `AREAS`.
    """
    places = _places_on_front(head)
    outlines = []
    for area in areas:
        weights = head.pack.areas[AREAS.index(area)].astype(np.float32)
        loops: list[Float64] = []
        if AREAS.index(area) not in range(len(AREAS))[AROUND]:
            loops = _loops(weights if places is None else _in_view(weights, places))
        outlines.append(AreaOutline(area, tuple(loops)))
    return tuple(outlines)


def _places_on_front(head: Head) -> Float32 | None:
    """Return where the front picture shows the skin of a turned head, or None from the front."""
    if head.front is None:
        return None
    painted = head.front.painted()
    return painted.places_on_front(painted.view(head.yaw_deg))


def _in_view(weights: Float32, places: Float32) -> Float32:
    """Transfer the weights of an area, (N, N), from the front picture to that of a turned head."""
    column, row = (places[..., axis] * weights.shape[0] - 0.5 for axis in (0, 1))
    there = cv2.remap(weights, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(there * np.clip(places[..., 2], 0.0, 1.0), np.float32)


def _loops(weights: Float32) -> list[Float64]:
    """Return the outlines of an area, largest first, in pixels of the picture of its weights."""
    large = cv2.resize(weights, None, fx=_FINER, fy=_FINER, interpolation=cv2.INTER_LINEAR)
    large = cv2.GaussianBlur(large, (0, 0), _SMOOTH * _FINER)
    # The parts of an area count alike, so a small part has larger weights than a large one.
    count, part = cv2.connectedComponents((large > _EDGE * large.max()).astype(np.uint8))
    inside = np.zeros(large.shape, np.uint8)
    for number in range(1, count):
        here = part == number
        inside[here & (large > _HALF * large[here].max())] = 1
    contours, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    sizes = [cv2.contourArea(each) for each in contours]
    order = sorted(range(len(sizes)), key=lambda number: -sizes[number])
    large_ones = [contours[n] for n in order if sizes[n] >= _SMALLEST * sizes[order[0]]]
    return [(loop[:, 0].astype(np.float64) + 0.5) / _FINER for loop in large_ones]
