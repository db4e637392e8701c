"""Text about the light on a face: ratio, direction, glare and catchlights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.core.portrait.catchlights import EYES, Catchlight
from app.core.portrait.ratio_and_glare import DEEPEST_STOPS, Flow, Glare, Hardness, LightingRatio
from app.core.text import tr, tr_plural
from app.words.lights import MIRRORED
from app.words.phrases.directions import face_direction_words
from app.words.phrases.quantities import tenths

CONVENTION: Final = tr("key plus fill : fill")
"""Meaning of the two numbers in a ratio, shown beside them."""

_SIDES: Final = {
    "left": tr("key on the sitter’s left (camera right)"),
    "right": tr("key on the sitter’s right (camera left)"),
}
_OVERHEAD_DEG: Final = 75.0
_FLOW: Final = {
    Hardness.HARD: tr("Hard light with deep shadows from {place}"),
    Hardness.STRONG: tr("Strong light with clear shadows from {place}"),
    Hardness.SOFT: tr("Soft light with open shadows from {place}"),
    Hardness.EVEN: tr("Nearly even light from all around"),
}
_STRONG: Final = {
    "sun": tr("At this turn, the sun shines into the sitter’s eyes: {place}. Expect squinting."),
    "lamp": tr(
        "At this turn, a bright lamp shines into the sitter’s eyes: {place}. Expect squinting."
    ),
    "window": tr(
        "At this turn, a bright window shines into the sitter’s eyes: {place}. Expect squinting."
    ),
}
_NOTICEABLE: Final = {
    "sun": tr("The sun is in the sitter’s view at this turn: {place}. They may squint a little."),
    "lamp": tr(
        "A bright lamp is in the sitter’s view at this turn: {place}. They may squint a little."
    ),
    "window": tr(
        "A bright window is in the sitter’s view at this turn: {place}. They may squint a little."
    ),
}
# Short forms for one line: strong glare, then noticeable glare.
_LINES: Final = {
    "sun": (tr("Sun in the eyes: {where}"), tr("Sun in view: {where}")),
    "lamp": (tr("Bright lamp in the eyes: {where}"), tr("Bright lamp in view: {where}")),
    "window": (tr("Bright window in the eyes: {where}"), tr("Bright window in view: {where}")),
}
_ANY_LINE: Final = (tr("Bright light in the eyes: {where}"), tr("Bright light in view: {where}"))


def stops_words(ratio: LightingRatio) -> str:
    """Format the difference between the cheeks in stops, such as "2.3 stops"."""
    if ratio.stops > DEEPEST_STOPS:
        return tr("over {stops} stops", stops=f"{DEEPEST_STOPS:.0f}")
    text = tenths(ratio.stops)
    return tr_plural("{stops} stop", "{stops} stops", 1 if text == "1.0" else 2, stops=text)


def key_fill(stops: float) -> str:
    """Format a difference in stops as a ratio of key plus fill to fill.

    Examples:
        >>> key_fill(2.0), key_fill(0.6), key_fill(0.02), key_fill(4.2)
        ('4:1', '1.5:1', '1:1', '18:1')
    """
    ratio = 2.0 ** min(stops, 20.0)
    number = f"{ratio:.1f}".removesuffix(".0") if ratio < 9.95 else f"{ratio:.0f}"
    return f"{number}:1"


def ratio_line(ratio: LightingRatio) -> str:
    """Format a ratio for a single line, such as "4.9:1 key + fill : fill"."""
    numbers = key_fill(ratio.stops)
    if ratio.stops > DEEPEST_STOPS:
        numbers = tr("over {ratio}", ratio=key_fill(DEEPEST_STOPS))
    return tr("{ratio} key + fill : fill", ratio=numbers)


def ratio_sentence(ratio: LightingRatio) -> str:
    """Describe a ratio with its convention and its side, with no full stop at the end."""
    if ratio.lit == "none":
        return tr("No light reaches the face")
    if ratio.lit == "face":
        return tr("Both cheeks are in shadow, so there is no ratio")
    numbers = {"ratio": key_fill(min(ratio.stops, DEEPEST_STOPS)), "convention": CONVENTION}
    if ratio.key_side == "none":
        return tr(
            "{stops}, {ratio} ({convention}), both cheeks alike",
            stops=stops_words(ratio),
            **numbers,
        )
    if ratio.stops > DEEPEST_STOPS:
        return tr(
            "more than {stops:.0f} stops, over {ratio} ({convention}), {where}; no fill on the "
            "other cheek",
            stops=DEEPEST_STOPS,
            where=_SIDES[ratio.key_side],
            **numbers,
        )
    return tr(
        "{stops}, {ratio} ({convention}), {where}",
        stops=stops_words(ratio),
        where=_SIDES[ratio.key_side],
        **numbers,
    )


def flow_words(flow: Flow) -> str:
    """Describe how directional the light is and where it comes from, without a full stop."""
    place = face_direction_words(flow.azimuth_deg, flow.elevation_deg)
    if flow.elevation_deg > _OVERHEAD_DEG:
        place = tr("overhead")
    elif flow.elevation_deg < -_OVERHEAD_DEG:
        place = tr("beneath")
    return _FLOW[flow.hardness].format(place=place)


def glare_sentence(glare: Glare) -> str:
    """Describe how the light shines into the sitter's eyes, and how that affects the sitter."""
    if not glare.warns:
        return tr("No glare in the sitter’s eyes at this turn.")
    place = face_direction_words(glare.azimuth_deg, glare.elevation_deg)
    if glare.level == "strong":
        other = tr(
            "At this turn, a bright light shines into the sitter’s eyes: {place}. Expect squinting."
        )
        return _STRONG.get(glare.kind, other).format(place=place)
    other = tr(
        "A bright light is in the sitter’s view at this turn: {place}. They may squint a little."
    )
    return _NOTICEABLE.get(glare.kind, other).format(place=place)


def glare_line(glare: Glare) -> str:
    """Describe the glare in a narrow line, or return "" if there is none."""
    if not glare.warns:
        return ""
    where = face_direction_words(glare.azimuth_deg, glare.elevation_deg, brief=True)
    return _LINES.get(glare.kind, _ANY_LINE)[glare.level != "strong"].format(where=where)


def catchlight_words(lights: Sequence[Catchlight] | None) -> str:
    """Describe the eye with the most catchlights, or return "" if the eyes are not visible.

    Examples:
        >>> catchlight_words([Catchlight("left", 10.0, 0.1, "window", "A")])
        'One catchlight at 10 o’clock: a window (A)'
    """
    if lights is None:
        return ""
    eyes = [[one for one in lights if one.eye == eye] for eye in EYES]
    most = max(eyes, key=len)
    if not most:
        return tr("No catchlight in the eyes")
    hour, what = round(most[0].clock) % 12 or 12, MIRRORED[most[0].what]
    if most[0].letter:
        what = tr("{what} ({letter})", what=what, letter=most[0].letter)
    if len(most) == 1:
        return tr("One catchlight at {hour} o’clock: {what}", hour=hour, what=what)
    return tr(
        "{count} catchlights, the brightest at {hour} o’clock: {what}",
        count=len(most),
        hour=hour,
        what=what,
    )
