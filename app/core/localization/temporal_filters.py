"""Filters over live pictures: steady numbers, lens, sitter, still camera.

Numbers stand still when nothing moves, and follow at once when something does. An average that is
long enough to still the jitter of a measurement lags behind a motion; one that follows a motion
jitters. So the shown value is held on a *leash*: wherever the measurement goes, the shown value is
never further behind than the leash is long, and within that it only creeps after it. The leash,
three times the jitter, shortens while the measurement keeps going one way. It bounds the lag by
construction, at any speed and with any pause between two measurements.

The width of the lens is the median of the last estimates, once these agree. The sitter stays where
they were for a moment when a picture does not show them. From time to time the whole picture is
searched for them again, and they are believed to be where most of the last searches found them: a
lamp or a pot that once looked like a head is not followed for long.

A camera may also stay where it is while the photographer walks.

Whoever holds a camera moves it: even one who stands and waits sways by tenths of a degree. A laptop
left on the ground, or a camera on a stand, shows the same background to a hundredth of that. When
such a camera is asked to turn, and the person in its picture walks, comes nearer, or goes out of
it, then somebody follows the guidance without the camera, and is told so.

Nothing is said while the person only waits before a camera on a stand, while the camera is held in
the hands, inside the tolerance arc, or before a wall without any marks, where motion is invisible.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from statistics import median
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import difference
from app.core.base.arrays import Bytes, Float32, Float64
from app.core.localization.sitter import Sitter, background_mask

_ESTIMATES: Final = 9
_ENOUGH: Final = 3
_SPREAD: Final = 0.08  # median deviation over the median, of estimates that agree
_AGAIN_S: Final = 4.0  # a zoom may have been turned, or another lens taken

_STEP_DEG: Final = 12.0  # a sitter who moves no more between two pictures is the same
_STAYS_S: Final = 1.5
_LOOK_AGAIN_S: Final = 0.3
_SEARCH_AGAIN_S: Final = 0.7
_SEARCHES: Final = 5


@dataclass(frozen=True, slots=True)
class Width:
    """How wide a lens seems to be.

    Attributes:
        estimates: The last ones, horizontal fields of view in deg.
    """

    estimates: tuple[float, ...] = ()
    time_s: float = -math.inf

    @property
    def likely_deg(self) -> float | None:
        """Best guess, deg; None before the first estimate."""
        return median(self.estimates) if self.estimates else None

    @property
    def known_deg(self) -> float | None:
        """What several estimates agree on, deg; None where they do not."""
        middle = self.likely_deg
        if middle is None or len(self.estimates) < _ENOUGH:
            return None
        spread = median(abs(one - middle) for one in self.estimates)
        return middle if spread <= _SPREAD * middle else None

    def due(self, now_s: float) -> bool:
        """Tell whether another estimate would be good."""
        return self.known_deg is None or now_s - self.time_s >= _AGAIN_S


def read(width: Width, fov_deg: float, now_s: float) -> Width:
    """Take an estimate of the field of view.

    Args:
        fov_deg: Horizontal, deg.
    """
    return Width((*width.estimates, fov_deg)[-_ESTIMATES:], now_s)


@dataclass(frozen=True, slots=True)
class Company:
    """Who is in the picture."""

    sitter: Sitter | None = None
    seen_s: float = -math.inf
    looked_s: float = -math.inf
    latest: Sitter | None = None
    searches: tuple[Sitter, ...] = ()
    searched_s: float = -math.inf

    def due(self, now_s: float) -> bool:
        """Tell whether to look again: always for who is there, now and then for who is not."""
        return self.sitter is not None or now_s - self.looked_s >= _LOOK_AGAIN_S

    def near(self, now_s: float) -> Sitter | None:
        """Return whom to look around first; None when it is time to search the whole picture."""
        return None if now_s - self.searched_s >= _SEARCH_AGAIN_S else self.sitter


def update_company(company: Company, sitter: Sitter | None, now_s: float) -> Company:
    """Take what was seen of the sitter in a picture."""
    before = company.sitter
    around = company.near(now_s)
    # Somebody who is not where they were looked for first was found by a search of everything.
    if around is None or (sitter is not None and not _near(sitter, around)):
        searches = company.searches if sitter is None else (*company.searches, sitter)[-_SEARCHES:]
        company = replace(company, searches=searches, searched_s=now_s)
    if sitter is None:
        stays = now_s - company.seen_s <= _STAYS_S
        return replace(company, sitter=before if stays else None, looked_s=now_s, latest=None)
    choice = sitter if before is None else _likelier(before, sitter, company.searches)
    if choice is None:
        return replace(company, looked_s=now_s, latest=sitter)
    return replace(company, sitter=choice, seen_s=now_s, looked_s=now_s, latest=sitter)


def _likelier(before: Sitter, sitter: Sitter, searches: tuple[Sitter, ...]) -> Sitter | None:
    """Keep to the one who is followed, or take another whom more searches found; None: wait."""
    if _near(sitter, before):
        return sitter
    here, there = (sum(_near(one, each) for each in searches) for one in (before, sitter))
    return sitter if there > here else None


def _near(first: Sitter, second: Sitter) -> bool:
    return abs(first.angle_deg - second.angle_deg) <= _STEP_DEG


@dataclass(frozen=True, slots=True)
class Leash:
    """How values of one kind are held still; units are those of the value."""

    length: float
    slow_per_s: float
    creep_s: float = 1.4
    speed_s: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Steady:
    """Values as shown, and what the next step needs.

    Attributes:
        position: (...) float64. The steadied values.
        measured: (...) float64. The last measurement.
        speed: (...) float64. Of the measurements, a second.
    """

    position: Float64 = field(repr=False)
    measured: Float64 = field(repr=False)
    speed: Float64 = field(repr=False)
    time_s: float

    @classmethod
    def at(cls, measured: Float64, time_s: float) -> Steady:
        """Begin with a measurement.

        Args:
            measured: (...) float64. It is shown as it is.
        """
        value = np.array(measured, np.float64)
        return cls(value, value, np.zeros_like(value), time_s)


def steadied(before: Steady, measured: Float64, time_s: float, leash: Leash) -> Steady:
    """Take a measurement.

    Args:
        measured: (...) float64. Of the same shape; angles unwrapped, so that no step between two is
            a whole circle.
        time_s: When it was taken; one that is not later than the last changes the value and no
            speed.
    """
    value = np.array(measured, np.float64)
    pause = max(time_s - before.time_s, 0.0)
    # Share of the newest difference in the speed: exact for any pause between two measurements.
    share = 1.0 - math.exp(-pause / leash.speed_s)
    rate = (value - before.measured) / max(pause, 1e-3)
    speed = before.speed + share * (rate - before.speed)
    length = leash.length / (1.0 + (speed / leash.slow_per_s) ** 4)
    crept = value + (before.position - value) * math.exp(-pause / leash.creep_s)
    position = np.clip(crept, value - length, value + length)
    return Steady(position, value, speed, max(time_s, before.time_s))


ASKED_DEG: Final = 8.0
"""So far the arc has to be away; no one walks for less."""

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
_WALK: Final = 1.5  # widths of the head
_NEARER: Final = 1.35
_SEEN_S: Final = 1.0
_GONE_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class _Trace:
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
    _walk: _Trace | None = None


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
    behind = state.left_behind or (still and _has_moved(walk, now_s))
    return replace(state, left_behind=behind, _heading_deg=heading, _walk=walk)


def _same(state: Stillness, picture: Float32, heading_deg: float | None) -> bool:
    """Tell whether the camera stands as it did when it came to stand still."""
    before = state._picture
    if before is None or before.shape != picture.shape:
        return False
    if _has_turned(state._heading_deg, heading_deg):
        return False
    likeness, shift = _shift(before, picture)
    return likeness >= _LIKENESS and shift <= _STEADY_PX


def _has_turned(before_deg: float | None, now_deg: float | None) -> bool:
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


def _walked(walk: _Trace | None, sitter: Sitter | None, now_s: float) -> _Trace | None:
    if sitter is None:
        return walk
    left, top, right, bottom = sitter.box
    tall = max(bottom - top, 1e-3)
    if walk is None:
        unit = max(right - left, 1e-3)
        column = sitter.column / unit
        return _Trace(unit, column, tall, (column, column), (tall, tall), now_s, now_s)
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


def _has_moved(walk: _Trace | None, now_s: float) -> bool:
    """Tell whether a person has walked, come nearer or gone away, or left the picture."""
    if walk is None:
        return False
    if walk.columns[1] - walk.columns[0] >= _WALK:
        return True
    if walk.heights[1] >= _NEARER * walk.heights[0]:
        return True
    return now_s - walk.last_s >= _GONE_S and walk.last_s - walk.first_s >= _SEEN_S
