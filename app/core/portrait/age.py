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
from datetime import datetime
from typing import Final, Literal, TypeAlias

from app.core.text import tr, tr_plural
from app.core.text.quantities import ago_words, span_words

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
_NO_TIME: Final = tr("It is not known when this was measured. Capture again to be sure.")
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
        return Age(0.0, None, "unknown", tr("measured at an unknown time"), _NO_TIME)
    if seconds < -_SKEW_S:
        ahead = span_words(-seconds / 60.0)
        when = tr("measured {ahead} ahead of this clock", ahead=ahead)
        words = tr(
            "Measured {ahead} ahead of this clock: check the clocks of camera and computer.",
            ahead=ahead,
        )
        return Age(0.0, None, "unknown", when, words)
    minutes = max(seconds, 0.0) / 60.0
    moved = None
    if kind == "lamps":
        state, words = _by_lamps(minutes)
    elif kind == "sun":
        moved, state, words = _by_sun(minutes, declination_deg(made_at), sun_elevation_deg)
    else:
        state, words = _by_sky(minutes, kind)
    return Age(minutes, moved, state, tr("measured {ago}", ago=ago_words(minutes)), words)


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


def _by_sun(
    minutes: float, declination: float, elevation: float | None
) -> tuple[float | None, State, str]:
    ago, moved = ago_words(minutes), sun_moved_deg(minutes, declination)
    if minutes >= _LONG_MINUTES:
        words = tr("Measured {ago}: the sun stands elsewhere by now. Capture again.", ago=ago)
        return None, "old", words
    aside, degrees = _largest_azimuth(moved, elevation), _degrees(moved)
    text = tr("Measured {ago}, the sun has moved {degrees}", ago=ago, degrees=degrees)
    if round(moved) + 2 <= round(aside) and aside < 90.0:
        text = tr(
            "Measured {ago}, the sun has moved {degrees}, up to {aside} along the horizon",
            ago=ago,
            degrees=degrees,
            aside=_degrees(aside),
        )
    part = max(moved / AGAIN_DEG, minutes / AGAIN_MINUTES)
    if part >= 1.0:
        return moved, "old", tr("{text}: capture again.", text=text)
    if part >= _SOON:
        return moved, "ageing", tr("{text}: capture again soon.", text=text)
    return moved, "fresh", f"{text}." if moved >= 0.5 else tr("Measured {ago}.", ago=ago)


def _degrees(angle: float) -> str:
    return tr_plural("{count} degree", "{count} degrees", round(angle))


def _largest_azimuth(moved: float, elevation: float | None) -> float:
    """Return the largest change of azimuth that an arc of this length from there can make."""
    if elevation is None or not math.isfinite(elevation):
        return moved
    # The meridian that just touches a circle of radius r around a point at elevation e lies
    # asin(sin r / cos e) away from it; a circle around the zenith touches all of them.
    reach = math.sin(math.radians(min(moved, 90.0)))
    level = math.cos(math.radians(elevation))
    return 180.0 if reach >= level else math.degrees(math.asin(reach / level))


def _by_sky(minutes: float, kind: Kind) -> tuple[State, str]:
    ago, (soon, again) = ago_words(minutes), _LIMITS_MINUTES[kind]
    if minutes >= _DAY_MINUTES and kind == "unknown":
        return "old", tr(
            "Measured {ago}: capture again unless only lamps light the place.", ago=ago
        )
    if minutes >= _DAY_MINUTES:
        return "old", tr("Measured {ago}: the light is hardly the same. Capture again.", ago=ago)
    if minutes < soon:
        return "fresh", tr("Measured {ago}.", ago=ago)
    light = {
        "sky": tr("the light of the sky changes"),
        "windows": tr("the light of the windows changes with the day"),
        "unknown": tr("daylight may have changed"),
    }[kind]
    if minutes < again:
        return "ageing", tr("Measured {ago}; {light}.", ago=ago, light=light)
    return "old", tr(
        "Measured {ago}; {light}. Capture again if it looks different.", ago=ago, light=light
    )


def _by_lamps(minutes: float) -> tuple[State, str]:
    ago = ago_words(minutes)
    if minutes < _DAY_MINUTES:
        return "fresh", tr("Measured {ago}.", ago=ago)
    return "ageing", tr("Measured {ago}; it holds as long as the lamps stand as they did.", ago=ago)
