"""The map of matches over all directions of a lamp: its tones and the line of the limit."""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.second_light.placements import ALTITUDES_DEG, AZIMUTHS_DEG
from app.ui.presenters.light_state import SkyState

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_FINER: Final = 4
_DARKEST: Final = 28  # tones of the map, sRGB
_BRIGHTEST: Final = 242
_CURVE: Final = 1.4  # so that the best places stand out
_ROWS: Final = len(ALTITUDES_DEG)
_COLUMNS: Final = len(AZIMUTHS_DEG)


def sky_of(
    values: NDArray[np.floating[Any]],
    limit: float | None,
    allowed: NDArray[np.bool_] | None = None,
) -> SkyState:
    """Draw up the map.

    Parameters
    ----------
    values : (9, 64) float
        Objective at one turn: altitudes upward, azimuths from in front toward the sitter's left.
    limit : float or None
        Where the line runs; None for no line.
    allowed : (576,) bool or None, optional
        Placements that can be reached.
    """
    # Left to right −180 to 180: the sitter's right, in front, the sitter's left.
    around = np.roll(np.asarray(values, np.float64), _COLUMNS // 2, axis=1)
    fine, azimuths, altitudes = _finer(around)
    low = max(float(around.min()), 0.0)
    high = max(float(around.max()), low + 1e-9, limit or 0.0)
    share = np.clip((fine - low) / (high - low), 0.0, 1.0) ** _CURVE
    tones = (_DARKEST + share * (_BRIGHTEST - _DARKEST) + 0.5).astype(np.uint8)
    line = np.zeros((0, 4), np.float32)
    if limit is not None:
        line = _line(fine - limit, azimuths, altitudes)
    closed = None
    if allowed is not None and not allowed.all():
        shut = np.roll(~allowed.reshape(_ROWS, _COLUMNS), _COLUMNS // 2, axis=1)
        # Texels of a placement lie around it: half of the first column is at the right end.
        closed = np.ascontiguousarray(np.roll(np.repeat(shut, 2, axis=1), -1, axis=1)[::-1])
    words = "brighter is better" if limit is None else "brighter is a better match"
    if limit is not None:
        words += f", the line is {limit:.0f}"
    if closed is not None:
        words += ", hatched is out of reach"
    half = float(ALTITUDES_DEG[-1]) + float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0]) / 2.0
    return SkyState(np.ascontiguousarray(tones[::-1]), closed, line, half, words)


def _finer(values: Float64) -> tuple[Float64, Float64, Float64]:
    """Read the map between placements: texels' azimuths from −180 on, altitudes upward, deg."""
    step, rise = 360.0 / _COLUMNS, float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0])
    fine_columns = _FINER * 2 * _COLUMNS
    azimuths = -180.0 + (np.arange(fine_columns) + 0.5) * 360.0 / fine_columns
    across = (azimuths + 180.0) / step
    fine_rows = _FINER * 2 * _ROWS
    lowest = float(ALTITUDES_DEG[0]) - rise / 2.0
    altitudes = lowest + (np.arange(fine_rows) + 0.5) * rise * _ROWS / fine_rows
    up = np.clip((altitudes - float(ALTITUDES_DEG[0])) / rise, 0.0, _ROWS - 1.0)
    wrapped = _cubic(np.concatenate([values[:, -1:], values, values[:, :2]], axis=1).T, across + 1)
    held = np.concatenate([wrapped[:, :1], wrapped, wrapped[:, -1:]], axis=1)
    return _cubic(held.T, up + 1.0), azimuths, altitudes


def _cubic(values: Float64, places: Float64) -> Float64:
    """Read (n, m) along its first axis at places in [1, n - 2], by Catmull-Rom's curve."""
    first = np.clip(np.floor(places).astype(np.intp), 1, len(values) - 3)
    t = (places - first)[:, None]
    a, b, c, d = (values[first + offset] for offset in (-1, 0, 1, 2))
    curved: Float64 = b + 0.5 * t * (
        c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))
    )
    return curved


def _line(over: Float64, azimuths: Float64, altitudes: Float64) -> Float32:
    """Pieces of the line where a map is 0: two triangles to each cell, one piece to each."""
    x, y = np.meshgrid(azimuths, altitudes)
    corners = [
        tuple(part[rows, columns].ravel() for part in (x, y, over))
        for rows, columns in (
            (slice(None, -1), slice(None, -1)),
            (slice(None, -1), slice(1, None)),
            (slice(1, None), slice(1, None)),
            (slice(1, None), slice(None, -1)),
        )
    ]
    pieces = [
        _through(corners[0], corners[1], corners[2]),
        _through(corners[0], corners[2], corners[3]),
    ]
    return np.concatenate(pieces).astype(np.float32)


def _through(*corners: tuple[Float64, ...]) -> Float64:
    """Cut triangles, each corner (x, y, value): (n, 4) pieces where the value is 0."""
    above = np.stack([corner[2] >= 0 for corner in corners])
    count = above.sum(axis=0)
    cut = np.flatnonzero((count == 1) | (count == 2))
    # The corner that stands alone is joined to both others.
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
