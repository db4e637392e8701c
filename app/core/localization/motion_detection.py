"""Noticing a camera that stays where it is while the photographer walks.

Whoever holds a camera moves it: even one who stands and waits sways by tenths of a degree. A laptop
left on the ground, or a camera on a stand, shows the same background to a hundredth of that. When
such a camera is asked to turn, and the person in its picture walks, comes nearer, or goes out of
it, then somebody follows the guidance without the camera, and is told so.

Nothing is said while the person only waits before a camera on a stand, while the camera is held in
the hands, inside the tolerance arc, or before a wall without any marks, where nobody can tell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import difference
from app.core.localization.sitter import Sitter, background_mask

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]

ASKED_DEG: Final = 8.0
"""So far the arc has to be away: nobody walks for less."""

STILL_S: Final = 4.0
"""So long the camera has to have stood still."""

_SIDE: Final = 160  # longer side of the picture that is compared, pixels
_SEARCHED_PX: Final = 3
_STEADY_PX: Final = 0.25  # 0.1 deg with a field of view of 60 deg
_LIKENESS: Final = 0.5
_HEADING_DEG: Final = 4.0  # beyond the noise of a heading found twice from one place
_WINDOW: Final = 15
_FLOOR: Final = 4.0  # grey levels

_SMOOTH_S: Final = 1.0
_WALKED: Final = 1.5  # widths of the head
_NEARER: Final = 1.35
_SEEN_S: Final = 1.0
_GONE_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class _Walk:
    """Where a person has been in the picture; columns in widths of the head as it was first."""

    unit: float
    column: float
    tall: float
    columns: tuple[float, float]
    heights: tuple[float, float]
    first_s: float
    last_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Stillness:
    """What has been seen since the camera stands still; begin with `STILL`."""

    left_behind: bool = False
    since_s: float | None = None
    _picture: Float32 | None = field(default=None, repr=False)
    _heading_deg: float | None = None
    _walk: _Walk | None = None


STILL: Final = Stillness()
"""Nothing has been seen yet."""


def watch(
    state: Stillness,
    frame: Bytes,
    now_s: float,
    *,
    asked_deg: float | None,
    heading_deg: float | None = None,
    sitter: Sitter | None = None,
) -> Stillness:
    """Take a picture.

    Args:
        frame: (H, W, 3) uint8. sRGB.
        asked_deg: How far it still is to the tolerance arc, deg, whichever way round; 0 inside of
            it. None where no turn is asked for.
        heading_deg: Where the camera points, deg; None where that is not known.
    """
    if asked_deg is None or abs(asked_deg) < ASKED_DEG or min(frame.shape[:2]) < 4 * _SEARCHED_PX:
        return STILL
    picture = _marks(frame, sitter)
    if not _same(state, picture, heading_deg):
        start = Stillness(False, now_s, picture, heading_deg)
        return replace(start, _walk=_walked(None, sitter, now_s))
    heading = state._heading_deg if state._heading_deg is not None else heading_deg
    walk = _walked(state._walk, sitter, now_s)
    still = state.since_s is not None and now_s - state.since_s >= STILL_S
    behind = state.left_behind or (still and _moved(walk, now_s))
    return replace(state, left_behind=behind, _heading_deg=heading, _walk=walk)


def _same(state: Stillness, picture: Float32, heading_deg: float | None) -> bool:
    """Tell whether the camera stands as it did when it came to stand still."""
    before = state._picture
    if before is None or before.shape != picture.shape:
        return False
    if _turned(state._heading_deg, heading_deg):
        return False
    likeness, shift = _shift(before, picture)
    return likeness >= _LIKENESS and shift <= _STEADY_PX


def _turned(before_deg: float | None, now_deg: float | None) -> bool:
    if before_deg is None or now_deg is None:
        return False
    return abs(difference(now_deg, before_deg)) > _HEADING_DEG


def _marks(frame: Bytes, sitter: Sitter | None) -> Float32:
    """Return the background's marks, free of exposure; 0 where there are none or a person is."""
    scale = _SIDE / max(frame.shape[:2])
    size = (max(round(frame.shape[1] * scale), 16), max(round(frame.shape[0] * scale), 16))
    small = cv2.resize(frame, size, interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float32)
    mean = cv2.blur(grey, (_WINDOW, _WINDOW))
    square = cv2.blur(grey * grey, (_WINDOW, _WINDOW)) - mean * mean
    marks = (grey - mean) / (np.sqrt(np.maximum(square, 0.0)) + np.float32(_FLOOR))
    if sitter is not None:
        marks *= background_mask(sitter, marks.shape)
    return np.asarray(marks, np.float32)


def _shift(before: Float32, now: Float32) -> tuple[float, float]:
    """Return how alike two pictures are at best, and how many pixels they are apart then."""
    edge = _SEARCHED_PX
    # A person is blank in either picture, and speaks for no shift.
    inner = now[edge:-edge, edge:-edge]
    likeness = np.asarray(cv2.matchTemplate(before, inner, cv2.TM_CCORR_NORMED), np.float32)
    _, best, _, (column, row) = cv2.minMaxLoc(likeness)
    if not math.isfinite(best):
        return 0.0, math.inf
    x = column - edge + _peak(likeness[row], column)
    y = row - edge + _peak(likeness[:, column], row)
    return float(best), math.hypot(x, y)


def _peak(values: Float32, at: int) -> float:
    """Return how far the top of the parabola through three values is from the middle one."""
    if not 0 < at < len(values) - 1:
        return 0.0
    left, middle, right = (float(values[at + k]) for k in (-1, 0, 1))
    bend = left - 2.0 * middle + right
    return 0.0 if bend >= -1e-9 else 0.5 * (left - right) / bend


def _walked(walk: _Walk | None, sitter: Sitter | None, now_s: float) -> _Walk | None:
    if sitter is None:
        return walk
    left, top, right, bottom = sitter.box
    tall = max(bottom - top, 1e-3)
    if walk is None:
        unit = max(right - left, 1e-3)
        column = sitter.column / unit
        return _Walk(unit, column, tall, (column, column), (tall, tall), now_s, now_s)
    # Smoothed, so that one mistaken picture does not make a walk.
    share = 1.0 - math.exp(-min(max(now_s - walk.last_s, 0.0), 0.5 * _SMOOTH_S) / _SMOOTH_S)
    column = walk.column + share * (sitter.column / walk.unit - walk.column)
    tall = walk.tall + share * (tall - walk.tall)
    return replace(
        walk,
        column=column,
        tall=tall,
        columns=(min(walk.columns[0], column), max(walk.columns[1], column)),
        heights=(min(walk.heights[0], tall), max(walk.heights[1], tall)),
        last_s=now_s,
    )


def _moved(walk: _Walk | None, now_s: float) -> bool:
    """Tell whether a person has walked, come nearer or gone away, or left the picture."""
    if walk is None:
        return False
    if walk.columns[1] - walk.columns[0] >= _WALKED:
        return True
    if walk.heights[1] >= _NEARER * walk.heights[0]:
        return True
    return now_s - walk.last_s >= _GONE_S and walk.last_s - walk.first_s >= _SEEN_S
