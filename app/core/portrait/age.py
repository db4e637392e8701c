"""The age of measured light, and whether the light is still valid.

The sun moves across the sky along a circle of declination, by 15 cos(declination) degrees of arc
per hour. The declination follows from the date (Spencer, "Fourier series representation of the
position of the sun", Search 2(5), 1971, 172), so the sun's motion is known without the position on
Earth. If the sun's elevation was measured, there is also a known limit to the change of its
azimuth, which determines the turns: a high sun changes azimuth quickly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal, TypeAlias

Kind: TypeAlias = Literal["sun", "sky", "windows", "lamps", "unknown"]
"""Main light at a place: the sun, the sky without the sun, windows, only lamps, or unknown."""

State: TypeAlias = Literal["fresh", "ageing", "old", "unknown"]
"""Validity of the light.

Ageing light will soon no longer be valid. The validity is unknown if the clocks disagree.
"""

AGAIN_DEG: Final = 5.0
"""Motion of the sun, in degrees, after which the light is old. It is about half a tolerance arc."""

AGAIN_MINUTES: Final = 20.0
"""Minutes after which sunlight is old in any case, because shadows move."""

DAY_MINUTES: Final = 24 * 60.0
"""Minutes after which daylight has changed completely."""

_SOON: Final = 0.6  # fraction of these limits
_SKEW_S: Final = 120.0  # possible difference between the clocks of camera and computer
_LIMITS_MINUTES: Final[dict[Kind, tuple[float, float]]] = {
    "sky": (30.0, 60.0),
    "windows": (45.0, 90.0),
    "unknown": (45.0, 90.0),
}
# after this time the sun is elsewhere, and degrees are no longer meaningful
_LONG_MINUTES: Final = 6 * 60.0


@dataclass(frozen=True, slots=True)
class Age:
    """The age of a light.

    Attributes:
        minutes: Age in minutes, negative if the measurement is dated later than this clock, or None
            if the time is unknown.
        sun_deg: Motion of the sun, in degrees of arc, or None if there is no sun or hours have
            passed.
        sun_aside_deg: Largest possible change of the sun's azimuth, in degrees, or None in the same
            cases as `sun_deg`.
    """

    minutes: float | None
    state: State
    kind: Kind = "unknown"
    sun_deg: float | None = None
    sun_aside_deg: float | None = None


def light_age(
    made_at: datetime,
    now: datetime,
    kind: Kind = "unknown",
    sun_elevation_deg: float | None = None,
) -> Age:
    """Return the age of a light.

    The state is unknown if the measurement is dated more than two minutes in the future.

    Args:
        sun_elevation_deg: Measured elevation of the sun, in degrees. It limits the change of the
            sun's azimuth.
    """
    try:
        seconds = (now.astimezone() - made_at.astimezone()).total_seconds()
    except (OverflowError, ValueError, OSError):
        # The first and the last days of the calendar cannot be converted.
        return Age(None, "unknown", kind)
    if seconds < -_SKEW_S:
        return Age(seconds / 60.0, "unknown", kind)
    minutes = max(seconds, 0.0) / 60.0
    if kind == "lamps":
        return Age(minutes, "fresh" if minutes < DAY_MINUTES else "ageing", kind)
    if kind == "sun":
        return _by_sun(minutes, declination_deg(made_at), sun_elevation_deg)
    soon, again = _LIMITS_MINUTES[kind]
    return Age(minutes, "fresh" if minutes < soon else "ageing" if minutes < again else "old", kind)


def declination_deg(when: datetime) -> float:
    """Return the sun's declination on a date (Spencer 1971), within 0.05° except on leap days."""
    day = when.timetuple().tm_yday - 1 + (when.hour + when.minute / 60.0) / 24.0
    angle = 2.0 * math.pi * day / 365.0
    return math.degrees(
        0.006918
        - 0.399912 * math.cos(angle)
        + 0.070257 * math.sin(angle)
        - 0.006758 * math.cos(2 * angle)
        + 0.000907 * math.sin(2 * angle)
        - 0.002697 * math.cos(3 * angle)
        + 0.00148 * math.sin(3 * angle)
    )


def sun_moved_deg(minutes: float, declination: float) -> float:
    """Return the angle through which the sun has moved.

    Args:
        minutes: Time, in minutes.
        declination: Declination of the sun, in degrees.

    Returns:
        The angle in degrees of arc on the sky, which is 15 cos(declination) per hour for short
        times.

    Examples:
        >>> round(sun_moved_deg(25.0, 0.0), 6), round(sun_moved_deg(720.0, 0.0))
        (6.25, 180)
    """
    half = math.radians(minutes / 4.0) / 2.0
    return math.degrees(2.0 * math.asin(abs(math.cos(math.radians(declination)) * math.sin(half))))


def _by_sun(minutes: float, declination: float, elevation: float | None) -> Age:
    if minutes >= _LONG_MINUTES:
        return Age(minutes, "old", "sun")
    shift_deg = sun_moved_deg(minutes, declination)
    part = max(shift_deg / AGAIN_DEG, minutes / AGAIN_MINUTES)
    state: State = "old" if part >= 1.0 else "ageing" if part >= _SOON else "fresh"
    return Age(minutes, state, "sun", shift_deg, _largest_azimuth(shift_deg, elevation))


def _largest_azimuth(shift_deg: float, elevation: float | None) -> float:
    """Return the largest change of azimuth for an arc of a given length at a given elevation."""
    if elevation is None or not math.isfinite(elevation):
        return shift_deg
    # The meridian tangent to a circle of radius r around a point at elevation e is asin(sin r / cos
    # e) away from it; a circle around the zenith touches all of them.
    reach = math.sin(math.radians(min(shift_deg, 90.0)))
    level = math.cos(math.radians(elevation))
    return 180.0 if reach >= level else math.degrees(math.asin(reach / level))
