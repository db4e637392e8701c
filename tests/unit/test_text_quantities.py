"""Lists of names, and numbers with their units."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import pytest

from app.core.base.errors import CoreError
from app.core.base.phrases import shutter_words
from app.words.phrases.quantities import ev_words, lux_words, metres, read_metres, time_words

CEST = timezone(timedelta(hours=2))
NOW = datetime(2026, 11, 21, 14, 5, tzinfo=CEST)


def test_distances() -> None:
    assert metres(0.07, rough=True) == "7 cm"
    assert metres(0.996) == "1.0 m"


def test_exposures() -> None:
    assert [ev_words(stops) for stops in (2.0, 0.02, -1.67)] == ["+2 EV", "0 EV", "−1.7 EV"]
    assert [shutter_words(time) for time in (0.004, 0.5, 2.0)] == ["1/250 s", "0.5 s", "2 s"]


@pytest.mark.parametrize(
    ("lux", "words"), [(5.0, "5 lx"), (213.0, "210 lx"), (8000.0, "8,000 lx"), (0.34, "0.34 lx")]
)
def test_illuminance_is_written_with_two_figures(lux: float, words: str) -> None:
    assert lux_words(lux) == words


@pytest.mark.parametrize(
    ("text", "metres"),
    [("0.4", 0.4), ("40 cm", 0.4), ("40cm", 0.4), ("1,2 m", 1.2), ("2", 2.0), ("near", None),
     ("-1", None), ("4 ft", None), ("", None)],
)  # fmt: skip
def test_distances_as_they_are_typed(text: str, metres: float | None) -> None:
    if metres is None:
        with pytest.raises(CoreError):
            read_metres(text)
    else:
        assert read_metres(text) == pytest.approx(metres)


@pytest.mark.parametrize(
    ("moment", "words"),
    [
        (NOW, "21 Nov, 14:05"),
        (datetime(2026, 3, 1, 9, 7, tzinfo=CEST), "1 Mar, 09:07"),
        (datetime(2025, 12, 31, 23, 30, tzinfo=UTC), "1 Jan, 01:30"),
        (datetime(2024, 5, 2, 12, 0, tzinfo=CEST), "2 May 2024, 12:00"),
    ],
)
def test_times_are_said_in_the_zone_of_today(moment: datetime, words: str) -> None:
    assert time_words(moment, NOW) == words
