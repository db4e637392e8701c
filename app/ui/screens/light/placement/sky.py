"""The map that shows the match for every direction of the lamp."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes, Float32, Float64
from app.core.second_light.placements import ALTITUDES_DEG, AZIMUTHS_DEG
from app.core.text import tr


@dataclass(frozen=True, slots=True, eq=False)
class SkyState:
    """The match for every direction of the lamp, at the current turn.

    Attributes:
        tones: (h, w) uint8 or None. Brighter tones mean a better match. Azimuths increase from
            −180° at the left edge to 180° at the right, with the sitter's left on the right-hand
            side. Altitudes decrease from top to bottom.
        closed: (h, w) bool or None. True for directions in which the lamp may not be held.
        line: (n, 4) float32. Segments of the contour at the limit, given by the azimuth and
            altitude of both ends, in degrees.
    """

    tones: Bytes | None = field(default=None, repr=False)
    closed: NDArray[np.bool_] | None = field(default=None, repr=False)
    line: Float32 = field(default_factory=lambda: np.zeros((0, 4), np.float32), repr=False)
    half_height_deg: float = 75.9375
    words: str = ""


_ROWS: Final = len(ALTITUDES_DEG)

_COLUMNS: Final = len(AZIMUTHS_DEG)

_FINER: Final = 4

_DARKEST: Final = 28  # tones of the map, sRGB

_BRIGHTEST: Final = 242

_CURVE: Final = 1.4  # so that the best places stand out


def sky_of(
    values: NDArray[np.floating[Any]],
    limit: float | None,
    is_open: NDArray[np.bool_] | None = None,
) -> SkyState:
    """Build the map from the values at one turn.

    Args:
        values: (9, 64) float. Objective at one turn. Altitudes increase along the rows, and
            azimuths along the columns from the front towards the sitter's left.
        limit: Value at which to draw the contour, or None for no contour.
        is_open: (576,) bool or None. For each placement, whether the lamp can be held there.
    """
    # Left to right from −180° to 180°: the sitter's right, the front, the sitter's left.
    around = np.roll(np.asarray(values, np.float64), _COLUMNS // 2, axis=1)
    fine, azimuths, altitudes = _finer(around)
    low = max(float(around.min()), 0.0)
    high = max(float(around.max()), low + 1e-9, limit or 0.0)
    share = np.clip((fine - low) / (high - low), 0.0, 1.0) ** _CURVE
    tones = (_DARKEST + share * (_BRIGHTEST - _DARKEST) + 0.5).astype(np.uint8)
    line, words = np.zeros((0, 4), np.float32), tr("Brighter is better.")
    if limit is not None:
        line = _line(fine - limit, azimuths, altitudes)
        words = tr("Brighter means a better match. The line marks {limit}.", limit=f"{limit:.0f}")
    closed = None
    if is_open is not None and not is_open.all():
        shut = np.roll(~is_open.reshape(_ROWS, _COLUMNS), _COLUMNS // 2, axis=1)
        # Texels are centred on a placement, so half of the first column wraps to the right edge.
        closed = np.ascontiguousarray(np.roll(np.repeat(shut, 2, axis=1), -1, axis=1)[::-1])
    if closed is not None:
        words = tr("{words} Hatched areas are out of reach.", words=words)
    half = float(ALTITUDES_DEG[-1]) + float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0]) / 2.0
    return SkyState(np.ascontiguousarray(tones[::-1]), closed, line, half, words)


def _finer(values: Float64) -> tuple[Float64, Float64, Float64]:
    """Return the interpolated map, its azimuths from −180° and its altitudes, both ascending."""
    step, rise = 360.0 / _COLUMNS, float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0])
    fine_columns = _FINER * 2 * _COLUMNS
    azimuths = -180.0 + (np.arange(fine_columns) + 0.5) * 360.0 / fine_columns
    across = (azimuths + 180.0) / step
    fine_rows = _FINER * 2 * _ROWS
    lowest = float(ALTITUDES_DEG[0]) - rise / 2.0
    altitudes = lowest + (np.arange(fine_rows) + 0.5) * rise * _ROWS / fine_rows
    up = np.clip((altitudes - float(ALTITUDES_DEG[0])) / rise, 0.0, _ROWS - 1.0)
    wrapped = _cubic(np.concatenate([values[:, -1:], values, values[:, :2]], axis=1).T, across + 1)
    padded = np.concatenate([wrapped[:, :1], wrapped, wrapped[:, -1:]], axis=1)
    return _cubic(padded.T, up + 1.0), azimuths, altitudes


def _cubic(values: Float64, places: Float64) -> Float64:
    """Interpolate (n, m) values along axis 0 at places in [1, n - 2] with a Catmull-Rom spline."""
    first = np.clip(np.floor(places).astype(np.intp), 1, len(values) - 3)
    t = (places - first)[:, None]
    a, b, c, d = (values[first + offset] for offset in (-1, 0, 1, 2))
    bend = c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))
    return np.asarray(b + 0.5 * t * bend)


def _line(over: Float64, azimuths: Float64, altitudes: Float64) -> Float32:
    """Return the zero contour of a map as segments, splitting each cell into two triangles."""
    above = (over >= 0).astype(np.int8)
    sides = above[:-1] + above[1:]
    # Only a few cells have corners on both sides.
    rows, columns = np.nonzero((sides[:, :-1] + sides[:, 1:]) % 4)
    corners = [
        (azimuths[columns + right], altitudes[rows + up], over[rows + up, columns + right])
        for up, right in ((0, 0), (0, 1), (1, 1), (1, 0))
    ]
    pieces = [_through(*corners[:3]), _through(corners[0], *corners[2:])]
    return np.concatenate(pieces).astype(np.float32)


def _through(*corners: tuple[Float64, ...]) -> Float64:
    """Return the (n, 4) segments along which triangles with corners (x, y, value) cross zero."""
    above = np.stack([corner[2] >= 0 for corner in corners])
    count = above.sum(axis=0)
    cut = np.flatnonzero((count == 1) | (count == 2))
    # The corner whose sign differs from the others is connected to both of them.
    alone = np.argmax(np.where(count[cut] == 1, above[:, cut], ~above[:, cut]), axis=0)
    values = np.stack([np.stack(corner) for corner in corners])[:, :, cut]
    index = np.arange(len(cut))
    start = values[alone, :, index]
    ends = []
    for step in (1, 2):
        stop = values[(alone + step) % 3, :, index]
        share = start[:, 2] / (start[:, 2] - stop[:, 2])
        ends.append(start[:, :2] + (stop[:, :2] - start[:, :2]) * share[:, None])
    return np.concatenate(ends, axis=1)
