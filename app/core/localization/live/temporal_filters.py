"""Filters for live pictures: steady numbers, lens and sitter, and detection of a still camera.

A number should not move when nothing moves, and it should follow at once when something does. An
average that is long enough to remove the jitter of a measurement lags behind a motion, and a
shorter one jitters. The number on screen is therefore held on a *leash*. It is never further behind
the measurement than the length of the leash, and within that length it only creeps towards the
measurement. The leash, which is three times the jitter, shortens while the measurement keeps moving
in one direction. It limits the lag at any speed and with any pause between two measurements.

The field of view is the median of the last estimates, once they agree. The sitter's position is
kept for a moment if a picture does not show the sitter. From time to time, the whole picture is
searched again. The position found by most of the last searches counts, so that a lamp or a pot that
once looked like a head is not followed for long.

A camera may also be left behind while the photographer walks. A handheld camera moves: even a
photographer who stands still sways by tenths of a degree. A laptop on the ground, or a camera on a
stand, shows the same background to within a hundredth of that. If such a camera is supposed to
turn, but the person in its picture walks, comes closer or leaves the picture, then somebody is
following the guidance without the camera, and a message is shown.

No message is shown if the person is only waiting in front of a camera on a stand, or if the camera
is handheld, inside the tolerance arc, or in front of a featureless wall, where motion is invisible.
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
from app.core.localization.live.background_texture import texture_of
from app.core.localization.sitter import Sitter

_ESTIMATES: Final = 9
_ENOUGH: Final = 3
_SPREAD: Final = 0.08  # median deviation over the median, for estimates that agree
_AGAIN_S: Final = 4.0  # a zoom may have been turned, or the lens changed

_STEP_DEG: Final = 12.0  # a sitter who moves less between two pictures is the same person
_STAYS_S: Final = 1.5
_LOOK_AGAIN_S: Final = 0.3
_SEARCH_AGAIN_S: Final = 0.7
_SEARCHES: Final = 5


@dataclass(frozen=True, slots=True)
class Width:
    """The estimates of a lens's field of view.

    Attributes:
        estimates: The last estimates of the horizontal field of view, in degrees.
        time_s: Time of the last estimate, in seconds.
    """

    estimates: tuple[float, ...] = ()
    time_s: float = -math.inf

    @property
    def likely_deg(self) -> float | None:
        """The best guess, in degrees, or None before the first estimate."""
        return median(self.estimates) if self.estimates else None

    @property
    def known_deg(self) -> float | None:
        """The field of view on which several estimates agree, in degrees, or None if none do."""
        middle = self.likely_deg
        if middle is None or len(self.estimates) < _ENOUGH:
            return None
        spread = median(abs(one - middle) for one in self.estimates)
        return middle if spread <= _SPREAD * middle else None

    def due(self, now_s: float) -> bool:
        """Return whether another estimate is due."""
        return self.known_deg is None or now_s - self.time_s >= _AGAIN_S


def read(width: Width, fov_deg: float, now_s: float) -> Width:
    """Add an estimate of the field of view.

    Args:
        fov_deg: Horizontal field of view, in degrees.
        now_s: Time of the estimate, in seconds.
    """
    return Width((*width.estimates, fov_deg)[-_ESTIMATES:], now_s)


@dataclass(frozen=True, slots=True)
class Company:
    """The person in the picture, and the recent searches for one."""

    sitter: Sitter | None = None
    seen_s: float = -math.inf
    looked_s: float = -math.inf
    latest: Sitter | None = None
    searches: tuple[Sitter, ...] = ()
    searched_s: float = -math.inf

    def due(self, now_s: float) -> bool:
        """Return whether to search again: always if a person is visible, otherwise occasionally."""
        return self.sitter is not None or now_s - self.looked_s >= _LOOK_AGAIN_S

    def near(self, now_s: float) -> Sitter | None:
        """Return the person to search around first, or None to search the whole picture."""
        return None if now_s - self.searched_s >= _SEARCH_AGAIN_S else self.sitter


def update_company(company: Company, sitter: Sitter | None, now_s: float) -> Company:
    """Update the person with the result from a new picture."""
    before = company.sitter
    around = company.near(now_s)
    # A person away from the previous position was found by a search of the whole picture.
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
    """Return the current person, or one found in more searches, or None to wait."""
    if _near(sitter, before):
        return sitter
    here, there = (sum(_near(one, each) for each in searches) for one in (before, sitter))
    return sitter if there > here else None


def _near(first: Sitter, second: Sitter) -> bool:
    return abs(first.angle_deg - second.angle_deg) <= _STEP_DEG


@dataclass(frozen=True, slots=True)
class Leash:
    """Damping for values of one kind, in the same unit as the values.

    Attributes:
        length: Largest permitted lag.
        slow_per_s: Speed of a measurement, per second, at which the leash is halved.
        creep_s: Time constant of the approach within the leash, in seconds.
        speed_s: Time constant of the speed, in seconds.
    """

    length: float
    slow_per_s: float
    creep_s: float = 1.4
    speed_s: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Steady:
    """Steadied values, and the state required for the next step.

    Attributes:
        position: (...) float64. The steadied values.
        measured: (...) float64. The last measurement.
        speed: (...) float64. Speed of the measurements, per second.
        time_s: Time of the last measurement, in seconds.
    """

    position: Float64 = field(repr=False)
    measured: Float64 = field(repr=False)
    speed: Float64 = field(repr=False)
    time_s: float

    @classmethod
    def at(cls, measured: Float64, time_s: float) -> Steady:
        """Start with a first measurement.

        Args:
            measured: (...) float64. The measurement, which also becomes the steadied value.
        """
        value = np.array(measured, np.float64)
        return cls(value, value, np.zeros_like(value), time_s)


def steadied(before: Steady, measured: Float64, time_s: float, leash: Leash) -> Steady:
    """Return the steadied values after a new measurement.

    Args:
        measured: (...) float64. The measurement, in the same shape as before. Angles must be
            unwrapped, so that no step between two measurements is a full circle.
        time_s: Time of the measurement, in seconds. A measurement that is not later than the last
            one changes the value but not the speed.
    """
    value = np.array(measured, np.float64)
    pause = max(time_s - before.time_s, 0.0)
    # Fraction of the newest difference in the speed: exact for any pause between two measurements.
    share = 1.0 - math.exp(-pause / leash.speed_s)
    rate = (value - before.measured) / max(pause, 1e-3)
    speed = before.speed + share * (rate - before.speed)
    length = leash.length / (1.0 + (speed / leash.slow_per_s) ** 4)
    crept = value + (before.position - value) * math.exp(-pause / leash.creep_s)
    position = np.clip(crept, value - length, value + length)
    return Steady(position, value, speed, max(time_s, before.time_s))


ASKED_DEG: Final = 8.0
"""Minimum distance to the arc, in degrees. Nobody walks for less than this."""

STILL_S: Final = 4.0
"""Time for which the camera must have been still, in seconds."""

_SEARCHED_PX: Final = 3
_STEADY_PX: Final = 0.25  # 0.1 degrees with a field of view of 60 degrees
_LIKENESS: Final = 0.5
_HEADING_DEG: Final = 4.0  # beyond the noise between two headings from the same position

_SMOOTH_S: Final = 1.0
_WALK: Final = 1.5  # widths of the head
_NEARER: Final = 1.35
_SEEN_S: Final = 1.0
_GONE_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class _Trace:
    """The path of a person in the picture, with columns in widths of the person's initial head."""

    unit: float
    column: float
    tall: float
    columns: tuple[float, float]
    heights: tuple[float, float]
    first_s: float
    last_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Stillness:
    """The observations since the camera came to a stop, starting with `STILL`."""

    left_behind: bool = False
    since_s: float | None = None
    _picture: Float32 | None = field(default=None, repr=False)
    _heading_deg: float | None = None
    _walk: _Trace | None = None


STILL: Final = Stillness()
"""The observations before the first picture."""


def watch(
    state: Stillness,
    frame: Bytes,
    now_s: float,
    *,
    asked_deg: float | None,
    heading_deg: float | None = None,
    sitter: Sitter | None = None,
) -> Stillness:
    """Update the observations with a new picture.

    Args:
        frame: (H, W, 3) uint8. sRGB.
        now_s: Time of the picture, in seconds.
        asked_deg: Distance to the tolerance arc in either direction, in degrees. It is 0 inside the
            arc, and None if no turn is requested.
        heading_deg: Heading of the camera, in degrees, or None if unknown.
        sitter: The person in the picture, or None if there is none.
    """
    if asked_deg is None or abs(asked_deg) < ASKED_DEG or min(frame.shape[:2]) < 4 * _SEARCHED_PX:
        return STILL
    picture = texture_of(frame, sitter)
    if not _same(state, picture, heading_deg):
        start = Stillness(False, now_s, picture, heading_deg)
        return replace(start, _walk=_walked(None, sitter, now_s))
    heading = state._heading_deg if state._heading_deg is not None else heading_deg
    walk = _walked(state._walk, sitter, now_s)
    still = state.since_s is not None and now_s - state.since_s >= STILL_S
    behind = state.left_behind or (still and _has_moved(walk, now_s))
    return replace(state, left_behind=behind, _heading_deg=heading, _walk=walk)


def _same(state: Stillness, picture: Float32, heading_deg: float | None) -> bool:
    """Return whether the camera is still at the position where it came to a stop."""
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


def _shift(before: Float32, now: Float32) -> tuple[float, float]:
    """Return the best correlation of two pictures, and the shift at which it occurs, in pixels."""
    edge = _SEARCHED_PX
    # A person is blank in either picture, and does not count.
    inner = now[edge:-edge, edge:-edge]
    likeness = np.asarray(cv2.matchTemplate(before, inner, cv2.TM_CCORR_NORMED), np.float32)
    _, best, _, (column, row) = cv2.minMaxLoc(likeness)
    if not math.isfinite(best):
        return 0.0, math.inf
    x = column - edge + _peak(likeness[row], column)
    y = row - edge + _peak(likeness[:, column], row)
    return float(best), math.hypot(x, y)


def _peak(values: Float32, at: int) -> float:
    """Return the offset from the middle of three values to the peak of their parabola."""
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
    # Smooth the motion, so that one wrong picture does not count as a walk.
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
    """Return whether a person has walked, come closer, moved away or left the picture."""
    if walk is None:
        return False
    if walk.columns[1] - walk.columns[0] >= _WALK:
        return True
    if walk.heights[1] >= _NEARER * walk.heights[0]:
        return True
    return now_s - walk.last_s >= _GONE_S and walk.last_s - walk.first_s >= _SEEN_S
