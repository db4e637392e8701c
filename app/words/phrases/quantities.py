"""Lists of names, and numbers with units: distances, times, stops, light and shares."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Collection
from datetime import datetime
from typing import Final

from app.core.base.catalogue import tr, tr_plural
from app.core.base.errors import CoreError

_DISTANCE: Final = re.compile(r"(\d{1,5}(?:[.,]\d{1,6})?) *(m|cm)?")
_DAY_MINUTES: Final = 24 * 60
_MONTHS: Final = (
    tr("Jan"), tr("Feb"), tr("Mar"), tr("Apr"), tr("May"), tr("Jun"), tr("Jul"), tr("Aug"),
    tr("Sep"), tr("Oct"), tr("Nov"), tr("Dec"),
)  # fmt: skip
_WHOLE_MONTHS: Final = (
    tr("January"), tr("February"), tr("March"), tr("April"), tr("May"), tr("June"), tr("July"),
    tr("August"), tr("September"), tr("October"), tr("November"), tr("December"),
)  # fmt: skip
_DAYS: Final = (
    tr("Monday"), tr("Tuesday"), tr("Wednesday"), tr("Thursday"), tr("Friday"), tr("Saturday"),
    tr("Sunday"),
)  # fmt: skip


def upper_first(words: str) -> str:
    """Capitalise the first letter, for use at the start of a line.

    Examples:
        >>> upper_first("nose to the left")
        'Nose to the left'
    """
    return words[:1].upper() + words[1:]


def lower_first(words: str) -> str:
    """Lower-case the first letter, for use within a sentence.

    Examples:
        >>> lower_first("No light from below")
        'no light from below'
    """
    return words[:1].lower() + words[1:]


def metres(distance_m: float, *, rough: bool = False) -> str:
    """Format a distance, using centimetres below one metre.

    Examples:
        >>> metres(0.304), metres(0.217, rough=True), metres(1.25)
        ('30 cm', '20 cm', '1.2 m')
    """
    centimetres = round(100.0 * distance_m)
    if rough and centimetres >= 10:
        centimetres = 5 * round(20.0 * distance_m)
    return f"{centimetres} cm" if centimetres < 100 else f"{centimetres / 100.0:.1f} m"


def read_metres(text: str) -> float:
    """Parse a distance in metres, or in centimetres if the text gives that unit.

    Examples:
        >>> read_metres("0.4"), read_metres("40 cm"), read_metres("1,2 m")
        (0.4, 0.4, 1.2)
    """
    match = _DISTANCE.fullmatch(text.strip().lower())
    if match is None:
        raise CoreError(
            tr("This is not a distance."),
            tr("Enter the distance in metres, such as 0.4, or in centimetres, such as 40 cm."),
        )
    value = float(match[1].replace(",", "."))
    return value / 100.0 if match[2] == "cm" else value


def ev_words(stops: float, *, tenths: bool = False) -> str:
    """Format an exposure in EV, always to one decimal place if `tenths` is set.

    Examples:
        >>> ev_words(2.0), ev_words(-1.67), ev_words(0.02), ev_words(-2.0, tenths=True)
        ('+2 EV', '−1.7 EV', '0 EV', '−2.0 EV')
    """
    number = _signed_tenths(stops)
    return f"{number if tenths else number.removesuffix('.0')} EV"


def _signed_tenths(stops: float) -> str:
    rounded = round(10.0 * stops) / 10.0
    sign = "" if rounded == 0.0 else "+" if rounded > 0.0 else "−"
    return f"{sign}{abs(rounded):.1f}"


def tenths(stops: float) -> str:
    """Format a lighting ratio in stops to one decimal place so that it reads the same everywhere.

    Examples:
        >>> tenths(1.04), tenths(0.0)
        ('1.0', '0.0')
    """
    return f"{stops:.1f}"


def exposed_words(stops: float) -> str:
    """Format an exposure for the small label on a picture.

    Examples:
        >>> exposed_words(1.26), exposed_words(-0.5), exposed_words(0.01)
        ('+1.3 stops', '−0.5 stops', '0.0 stops')
    """
    return tr("{number} stops", number=_signed_tenths(stops))


def stops_words(stops: float) -> str:
    """Format a number of stops.

    Examples:
        >>> stops_words(1.0), stops_words(2.5)
        ('1 stop', '2.5 stops')
    """
    if stops == round(stops):
        return tr_plural("{count} stop", "{count} stops", round(stops))
    return tr("{number} stops", number=f"{stops:g}")


def lux_words(lux: float) -> str:
    """Format an illuminance to two significant figures.

    Examples:
        >>> lux_words(213.4), lux_words(61234.0), lux_words(4.87)
        ('210 lx', '61,000 lx', '4.9 lx')
    """
    digits = 1 - math.floor(math.log10(max(lux, 1e-3)))
    value = round(lux, digits)
    return f"{value:,.0f} lx" if value == round(value) else f"{value:.{digits}f} lx"


def contrast_words(contrast: float) -> str:
    """Format the contrast on a face, rounded down so as never to read as a limit that it misses.

    Args:
        contrast: Contrast as a percentage of the contrast in the style's studio picture.

    Examples:
        >>> contrast_words(51.9)
        '51% of the studio’s'
    """
    return tr("{share}% of the studio’s", share=max(math.floor(contrast), 0))


def time_words(moment: datetime, today: datetime) -> str:
    """Format a time as "21 Nov, 14:05", adding the year unless it is the current one."""
    local = moment.astimezone(today.tzinfo)
    values = {"day": str(local.day), "month": _MONTHS[local.month - 1], "time": f"{local:%H:%M}"}
    if local.year == today.year:
        return tr("{day} {month}, {time}", **values)
    return tr("{day} {month} {year}, {time}", year=str(local.year), **values)


def day_words(moment: datetime, today: datetime) -> str:
    """Format a day as "Today", "Yesterday" or "Thursday 12 November", with any year but this one.

    Examples:
        >>> now = datetime(2026, 11, 26, 9)
        >>> day_words(datetime(2026, 11, 25, 23), now), day_words(datetime(2025, 7, 3, 8), now)
        ('Yesterday', 'Thursday 3 July 2025')
    """
    local = moment if today.tzinfo is None else moment.astimezone(today.tzinfo)
    since = (today.date() - local.date()).days
    if since in (0, 1):
        return tr("Yesterday") if since else tr("Today")
    day, month = _DAYS[local.weekday()], _WHOLE_MONTHS[local.month - 1]
    values = {"weekday": day, "day": str(local.day), "month": month}
    if local.year == today.year:
        return tr("{weekday} {day} {month}", **values)
    return tr("{weekday} {day} {month} {year}", year=str(local.year), **values)


def span_words(minutes: float) -> str:
    """Format a time span, rounded down to two units at most.

    Examples:
        >>> span_words(25.2), span_words(130.0), span_words(1500.0), span_words(4321.0)
        ('25 min', '2 h 10 min', '1 day', '3 days')
    """
    if minutes < 60.0:
        return f"{max(math.floor(minutes), 1)} min"
    if minutes < _DAY_MINUTES:
        hours, rest = divmod(math.floor(minutes), 60)
        return f"{hours} h {rest} min" if rest and hours < 6 else f"{hours} h"
    days = math.floor(minutes / _DAY_MINUTES)
    if days < 60:
        return tr_plural("{count} day", "{count} days", days)
    if days < 730:
        return tr_plural("{count} month", "{count} months", days // 30)
    return tr_plural("{count} year", "{count} years", days // 365)


def ago_words(minutes: float) -> str:
    """Format how long ago something happened.

    Examples:
        >>> ago_words(0.4), ago_words(25.2), ago_words(1500.0)
        ('just now', '25 min ago', '1 day ago')
    """
    return tr("just now") if minutes < 1.0 else tr("{span} ago", span=span_words(minutes))


def about_words(seconds: float) -> str:
    """Format an approximate duration.

    Examples:
        >>> about_words(2.0), about_words(61.0), about_words(150.0), about_words(7300.0)
        ('5 s', '60 s', '2 min', '2 h')
    """
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    if seconds < 90 * 60:
        return f"{round(seconds / 60)} min"
    return f"{round(seconds / 3600)} h"


_HOURS: Final = (
    (5, tr("Night")),
    (11, tr("Morning")),
    (14, tr("Midday")),
    (18, tr("Afternoon")),
    (22, tr("Evening")),
)
LIGHTS: Final = {
    "sun": tr("{hour}, sun"),
    "lamp": tr("{hour}, one lamp"),
    "lamps": tr("{hour}, lamps"),
    "window": tr("{hour}, window light"),
    "soft": tr("{hour}, soft light"),
}
"""Templates for place names, keyed by the light that does most to shape faces."""


def place_name(when: datetime, light: str = "", names: Collection[str] = ()) -> str:
    """Name a place after the time of day and, once measured, its light (`Findings.light`).

    Args:
        when: Local time on the photographer's clock.
        names: Names of other places, which the new name must not repeat.

    Examples:
        >>> evening = datetime(2026, 11, 25, 18, 5)
        >>> place_name(evening), place_name(evening, "window", ["Evening, window light"])
        ('Evening', 'Evening, window light 2')
    """
    hour = next((name for end, name in _HOURS if when.hour < end), _HOURS[0][1])
    name = LIGHTS[light].format(hour=hour) if light else hour
    numbered = (tr("{name} {number}", name=name, number=n) for n in itertools.count(2))
    return next(one for one in itertools.chain([name], numbered) if one not in names)
