"""How old a measured light is, and whether it still holds.

The sun goes around the sky by 15 degrees an hour along a circle of declination, that is by
15 cos(declination) degrees of arc an hour. The declination follows from the date (Spencer, "Fourier
series representation of the position of the sun", Search 2(5), 1971, 172), so that how far the sun
has moved is known without the place on earth. Where its elevation was measured, the largest change
of its azimuth, which is what a turn is about, is bounded as well: a high sun swings quickly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

if TYPE_CHECKING:
    from datetime import datetime

Kind: TypeAlias = Literal["sun", "sky", "windows", "lamps", "unknown"]
"""What lights the place: the sun itself, the sky without it, windows, lamps only, or not known."""

State: TypeAlias = Literal["fresh", "ageing", "old", "unknown"]
"""Whether the light still holds; ageing: soon not; unknown: the clock contradicts itself."""

AGAIN_DEG: Final = 5.0
"""A turn is as old as this when the sun has moved so far: about half a tolerance arc."""

AGAIN_MINUTES: Final = 20.0
"""And in any case after this time in the sun: shadows of trees and houses have moved too."""

_SOON: Final = 0.6  # of these limits
_SKEW_S: Final = 120.0  # camera and computer may differ by so much
_DAY_MINUTES: Final = 24 * 60.0
_LIMITS_MINUTES: Final[dict[Kind, tuple[float, float]]] = {
    "sky": (30.0, 60.0),
    "windows": (45.0, 90.0),
    "unknown": (45.0, 90.0),
}
_NO_TIME: Final = "It is not known when this was measured. Capture again to be sure."
_LONG_MINUTES: Final = 6 * 60.0  # after it the sun is elsewhere, and degrees say nothing more


@dataclass(frozen=True, slots=True)
class Age:
    """The age of a light."""

    minutes: float
    # how far the sun has moved, deg of arc; None where there is no sun in it, or no telling
    sun_deg: float | None
    state: State
    when: str
    words: str


def light_age(
    made_at: datetime,
    now: datetime,
    kind: Kind = "unknown",
    sun_elevation_deg: float | None = None,
) -> Age:
    """Say how old a light is.

    `sun_elevation_deg`: of the measured sun, deg; with it the change of its azimuth is bounded.
    The state is unknown where it was measured more than two minutes in the future.
    """
    try:
        seconds = (now.astimezone() - made_at.astimezone()).total_seconds()
    except (OverflowError, ValueError, OSError):
        # The first and the last days of the calendar have no other time zone.
        return Age(0.0, None, "unknown", "measured at an unknown time", _NO_TIME)
    if seconds < -_SKEW_S:
        when = f"measured {_span(-seconds / 60.0)} ahead of this clock"
        words = f"{_start(when)}: check the clocks of camera and computer."
        return Age(0.0, None, "unknown", when, words)
    minutes = max(seconds, 0.0) / 60.0
    when = f"measured {ago_words(minutes)}"
    if kind == "lamps":
        return _by_lamps(minutes, when)
    if kind == "sun":
        return _by_sun(minutes, when, declination_deg(made_at), sun_elevation_deg)
    return _by_sky(minutes, when, kind)


def declination_deg(when: datetime) -> float:
    """Declination of the sun at a date (Spencer 1971), within 0.05 deg but for the leap day."""
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
    """Angle between where the sun was and where it is.

    `declination`: deg.
    Returns deg of arc on the sky; 15 cos(declination) an hour for short times.

    Examples:
        >>> round(sun_moved_deg(25.0, 0.0), 6), round(sun_moved_deg(720.0, 0.0))
        (6.25, 180)
    """
    half = math.radians(minutes / 4.0) / 2.0
    return math.degrees(2.0 * math.asin(abs(math.cos(math.radians(declination)) * math.sin(half))))


def ago_words(minutes: float) -> str:
    """Say how long ago something was.

    Examples:
        >>> ago_words(0.4), ago_words(25.2), ago_words(130.0), ago_words(1500.0), ago_words(4321.0)
        ('just now', '25 min ago', '2 h 10 min ago', '1 day ago', '3 days ago')
    """
    return "just now" if minutes < 1.0 else f"{_span(minutes)} ago"


def _span(minutes: float) -> str:
    if minutes < 60.0:
        return f"{max(math.floor(minutes), 1)} min"
    if minutes < _DAY_MINUTES:
        hours, rest = divmod(math.floor(minutes), 60)
        return f"{hours} h {rest} min" if rest and hours < 6 else f"{hours} h"
    days = math.floor(minutes / _DAY_MINUTES)
    if days < 60:
        return f"{days} day{'s' if days > 1 else ''}"
    if days < 730:
        return f"{days // 30} months"
    return f"{days // 365} years"


def _start(when: str) -> str:
    return when[0].upper() + when[1:]


def _by_sun(minutes: float, when: str, declination: float, elevation: float | None) -> Age:
    moved = sun_moved_deg(minutes, declination)
    if minutes >= _LONG_MINUTES:
        words = f"{_start(when)}: the sun stands elsewhere by now. Capture again."
        return Age(minutes, None, "old", when, words)
    aside = _largest_azimuth(moved, elevation)
    degrees = _degrees(moved)
    far = f", up to {_degrees(aside)} along the horizon" if _much_further(aside, moved) else ""
    text = f"{_start(when)}, the sun has moved {degrees}{far}"
    part = max(moved / AGAIN_DEG, minutes / AGAIN_MINUTES)
    if part >= 1.0:
        return Age(minutes, moved, "old", when, f"{text}: capture again.")
    if part >= _SOON:
        return Age(minutes, moved, "ageing", when, f"{text}: capture again soon.")
    return Age(minutes, moved, "fresh", when, f"{text if moved >= 0.5 else _start(when)}.")


def _degrees(angle: float) -> str:
    whole = round(angle)
    return f"{whole} degree{'' if whole == 1 else 's'}"


def _largest_azimuth(moved: float, elevation: float | None) -> float:
    """Return the largest change of azimuth that an arc of this length from there can make."""
    if elevation is None or not math.isfinite(elevation):
        return moved
    # The meridian that just touches a circle of radius r around a point at elevation e lies
    # asin(sin r / cos e) away from it; a circle around the zenith touches all of them.
    reach = math.sin(math.radians(min(moved, 90.0)))
    level = math.cos(math.radians(elevation))
    return 180.0 if reach >= level else math.degrees(math.asin(reach / level))


def _much_further(aside: float, moved: float) -> bool:
    return round(aside) >= round(moved) + 2 and aside < 90.0


def _by_sky(minutes: float, when: str, kind: Kind) -> Age:
    soon, again = _LIMITS_MINUTES[kind]
    light = {
        "sky": "the light of the sky changes",
        "windows": "the light of the windows changes with the day",
        "unknown": "daylight may have changed",
    }[kind]
    if minutes >= _DAY_MINUTES:
        verdict = "the light is hardly the same. Capture again."
        if kind == "unknown":
            verdict = "capture again unless only lamps light the place."
        return Age(minutes, None, "old", when, f"{_start(when)}: {verdict}")
    if minutes >= again:
        words = f"{_start(when)}; {light}. Capture again if it looks different."
        return Age(minutes, None, "old", when, words)
    if minutes >= soon:
        return Age(minutes, None, "ageing", when, f"{_start(when)}; {light}.")
    return Age(minutes, None, "fresh", when, f"{_start(when)}.")


def _by_lamps(minutes: float, when: str) -> Age:
    if minutes >= _DAY_MINUTES:
        words = f"{_start(when)}; it holds as long as the lamps stand as they did."
        return Age(minutes, None, "ageing", when, words)
    return Age(minutes, None, "fresh", when, f"{_start(when)}.")
