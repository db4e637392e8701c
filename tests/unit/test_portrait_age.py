"""The age of a light: how far the sun has moved, and what is said about it."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta, timezone

import pytest

from app.core.portrait.age import (
    AGAIN_DEG,
    Age,
    Kind,
    declination_deg,
    light_age,
    sun_moved_deg,
)
from app.words.phrases.quantities import ago_words
from app.words.portrait.age import age_words

NOON = datetime(2026, 3, 20, 12, 0, tzinfo=UTC)


def after(minutes: float, kind: Kind = "sun", *, start: datetime = NOON) -> Age:
    return light_age(start, start + timedelta(minutes=minutes), kind)


@pytest.mark.parametrize(
    ("month", "day", "declination"),
    # Astronomical Almanac: equinoxes and solstices.
    [(3, 20, 0.0), (6, 21, 23.44), (9, 23, 0.0), (12, 21, -23.44)],
)
def test_declination(month: int, day: int, declination: float) -> None:
    found = declination_deg(datetime(2026, month, day, 12, tzinfo=UTC))
    assert found == pytest.approx(declination, abs=0.5)


@pytest.mark.parametrize("declination", [0.0, 23.44, -23.44, 10.0])
def test_twenty_five_minutes(declination: float) -> None:
    expected = 6.25 * math.cos(math.radians(declination))
    assert sun_moved_deg(25.0, declination) == pytest.approx(expected, rel=2e-3)


def test_the_sentence_of_a_photographer_in_the_sun() -> None:
    age = after(25.0)
    assert age.sun_deg == pytest.approx(6.25, abs=0.01)
    assert age.state == "old"
    words = age_words(age)
    assert "25 min ago" in words
    assert "6 degrees" in words


@pytest.mark.parametrize(
    ("minutes", "state"),
    [(0.0, "fresh"), (5.0, "fresh"), (11.0, "fresh"), (13.0, "ageing"), (20.0, "old")],
)
def test_states_in_the_sun(minutes: float, state: str) -> None:
    age = after(minutes)
    assert age.state == state
    assert ("Capture again" in age_words(age)) == (state != "fresh")


def test_five_degrees_are_the_limit() -> None:
    # At the equinox 20 minutes are 5 degrees; in June the sun is slower, and time decides.
    assert after(20.0).sun_deg == pytest.approx(AGAIN_DEG, abs=0.01)
    june = light_age(
        datetime(2026, 6, 21, 12, tzinfo=UTC), datetime(2026, 6, 21, 12, 20, tzinfo=UTC), "sun"
    )
    assert june.sun_deg is not None
    assert june.sun_deg < AGAIN_DEG
    assert june.state == "old"


def test_a_high_sun_swings_along_the_horizon() -> None:
    now = NOON + timedelta(minutes=25)
    high = light_age(NOON, now, "sun", sun_elevation_deg=60.0)
    # Largest change of azimuth on an arc of 6.25 deg from 60 deg up: asin(sin 6.25 / cos 60).
    assert "6 degrees, up to 13 degrees along the horizon. Capture again" in age_words(high)
    low = light_age(NOON, now, "sun", sun_elevation_deg=10.0)
    assert "horizon" not in age_words(low)
    zenith = light_age(NOON, now, "sun", sun_elevation_deg=89.0)
    assert "horizon" not in age_words(zenith)
    assert age_words(light_age(NOON, now, "sun", sun_elevation_deg=math.nan)) == age_words(low)


@pytest.mark.parametrize("kind", ["sun", "sky", "windows", "lamps", "unknown"])
def test_a_clock_that_runs_behind_is_said_and_not_believed(kind: Kind) -> None:
    age = after(-180.0, kind)
    assert (age.state, age.minutes, age.sun_deg) == ("unknown", -180.0, None)
    assert "Measured 3 h in the future" in age_words(age)
    # A camera's clock is never quite the computer's.
    assert age_words(after(-1.5, kind)) == "Measured just now."


@pytest.mark.parametrize(
    ("minutes", "when"),
    [
        (0.5, "just now"),
        (1.0, "1 min ago"),
        (59.9, "59 min ago"),
        (60.0, "1 h ago"),
        (130.0, "2 h 10 min ago"),
        (700.0, "11 h ago"),
        (1440.0, "1 day ago"),
        (4 * 1440.0, "4 days ago"),
        (90 * 1440.0, "3 months ago"),
        (1000 * 1440.0, "2 years ago"),
    ],
)
def test_age_names_its_span(minutes: float, when: str) -> None:
    assert ago_words(after(minutes).minutes or 0.0) == when


def test_long_ages_give_no_degrees() -> None:
    age = after(9 * 60.0)
    assert age.sun_deg is None
    assert "9 h ago" in age_words(age)
    assert "degree" not in age_words(age)


def test_indoors_is_softer() -> None:
    assert age_words(after(30.0, "windows")) == "Measured 30 min ago."
    assert after(60.0, "windows").state == "ageing"
    assert "Capture again if it looks different." in age_words(after(120.0, "windows"))
    assert after(600.0, "lamps").state == "fresh"
    assert "as long as the lamps have not moved" in age_words(after(3000.0, "lamps"))
    assert age_words(after(2000.0, "windows")).endswith("Capture again.")
    assert "unless only lamps" in age_words(after(2000.0, "unknown"))


def test_time_zones_are_the_same_moment() -> None:
    made = datetime(2026, 3, 20, 14, 0, tzinfo=timezone(timedelta(hours=2)))
    assert light_age(made, NOON + timedelta(minutes=10), "sun").minutes == pytest.approx(10.0)
    # Without a zone a time is the computer's own.
    local = NOON.astimezone().replace(tzinfo=None)
    assert light_age(local, NOON + timedelta(minutes=10), "sun").minutes == pytest.approx(10.0)


def test_dates_out_of_any_calendar() -> None:
    first = datetime(1, 1, 1)
    assert light_age(first, NOON).state in ("old", "unknown")
