"""Sentences about the age of a place's light."""

from __future__ import annotations

from typing import Final

from app.core.portrait.age import DAY_MINUTES, Age
from app.core.text import tr, tr_plural
from app.words.phrases.quantities import ago_words, span_words

# By light source, for light that will soon have to be captured again.
_CHANGES: Final = {
    "sky": tr("Measured {ago}; the sky is changing."),
    "windows": tr("Measured {ago}; window light changes during the day."),
    "unknown": tr("Measured {ago}; daylight may have changed."),
}
# By light source, for light that has to be captured again now.
_CHANGED: Final = {
    "sky": tr("Measured {ago}; the sky is changing. Capture again if the light looks different."),
    "windows": tr(
        "Measured {ago}; window light changes during the day. Capture again if it looks different."
    ),
    "unknown": tr(
        "Measured {ago}; daylight may have changed. Capture again if it looks different."
    ),
}
# After the sun has moved: the light is valid, valid for a little longer, or no longer valid.
_SUN: Final = {
    "fresh": tr("Measured {ago}; the sun has moved {degrees}."),
    "ageing": tr("Measured {ago}; the sun has moved {degrees}. Capture again soon."),
    "old": tr("Measured {ago}; the sun has moved {degrees}. Capture again."),
}
# The same for a high sun, whose azimuth changes faster.
_HIGH_SUN: Final = {
    "fresh": tr("Measured {ago}; the sun has moved {degrees}, up to {aside} along the horizon."),
    "ageing": tr(
        "Measured {ago}; the sun has moved {degrees}, up to {aside} along the horizon. "
        "Capture again soon."
    ),
    "old": tr(
        "Measured {ago}; the sun has moved {degrees}, up to {aside} along the horizon. "
        "Capture again."
    ),
}
_STILL_DEG: Final = 0.5
_APART_DEG: Final = 2
_ANYWHERE_DEG: Final = 90.0


def age_words(age: Age) -> str:
    """Describe how old the light is, and what to do if it may have changed."""
    if age.minutes is None:
        return tr("The time of measurement is not recorded. Capture again to be sure.")
    if age.minutes < 0.0:
        return tr(
            "Measured {ahead} in the future. Check the clocks of the camera and the computer.",
            ahead=span_words(-age.minutes),
        )
    ago = ago_words(age.minutes)
    if age.kind == "sun":
        return _by_sun(age, ago)
    if age.kind == "lamps":
        if age.state == "fresh":
            return tr("Measured {ago}.", ago=ago)
        return tr("Measured {ago}; valid as long as the lamps have not moved.", ago=ago)
    if age.minutes >= DAY_MINUTES:
        if age.kind == "unknown":
            return tr("Measured {ago}. Capture again unless only lamps light the place.", ago=ago)
        return tr("Measured {ago}; the light has changed since. Capture again.", ago=ago)
    if age.state == "fresh":
        return tr("Measured {ago}.", ago=ago)
    return (_CHANGES if age.state == "ageing" else _CHANGED)[age.kind].format(ago=ago)


def _by_sun(age: Age, ago: str) -> str:
    if age.sun_deg is None:
        return tr("Measured {ago}; the sun has moved on since. Capture again.", ago=ago)
    if age.state == "fresh" and age.sun_deg < _STILL_DEG:
        return tr("Measured {ago}.", ago=ago)
    aside = age.sun_deg if age.sun_aside_deg is None else age.sun_aside_deg
    high = round(age.sun_deg) + _APART_DEG <= round(aside) and aside < _ANYWHERE_DEG
    words = (_HIGH_SUN if high else _SUN)[age.state]
    return words.format(ago=ago, degrees=_degrees(age.sun_deg), aside=_degrees(aside))


def _degrees(angle: float) -> str:
    return tr_plural("{count} degree", "{count} degrees", round(angle))
