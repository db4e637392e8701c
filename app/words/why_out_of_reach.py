"""Sentences for a `Shortfall`: why a style is out of reach or only soft.

The sentences end without a full stop and come in these lengths:

* sentence: the cause with its numbers, for tables, sheets and tooltips;
* line: the cause, for a row with the match or the contrast beside it;
* card: short enough for a card;
* spoken: a clause for screen readers.
"""

from __future__ import annotations

import math
from typing import Final

from app.core.solver.shortfall import (
    AreaShortfall,
    Aspect,
    Cause,
    LensShortfall,
    LightShortfall,
    Obstacle,
    Origin,
    SavedReason,
    Shortfall,
)
from app.core.text import tr, tr_plural
from app.words.phrases.area_reasons import AREA_REASONS, Wording
from app.words.phrases.quantities import contrast_words, lower_first

_ORIGINS: Final = {
    Origin.BELOW: tr("below"),
    Origin.ABOVE: tr("above"),
    Origin.BEHIND: tr("behind"),
    Origin.SIDE: tr("the side"),
    Origin.HIGH_IN_FRONT: tr("high in front"),
    Origin.FRONT: tr("the front"),
}
_CAUSES: Final = {
    Cause.EVEN: tr("The light here is too even"),
    Cause.NO_LIGHT: tr("No strong light from {place} here"),
    Cause.ONE_SIDE: tr("Light only from one side"),
    Cause.ONE_LAMP: tr("Only one of its two lights is here; none from {place}"),
    Cause.APART: tr("No turn here brings all of its lights together"),
    Cause.FILLED: tr("Other light fills the shadows"),
    Cause.SPOILED: tr("Other light interferes with the pattern"),
    Cause.NO_TURN: tr("No turn gives this pattern here"),
    Cause.WEAK_LAMP: tr("The lamp is too weak for the light here"),
}
_ON_CARDS: Final = {
    Cause.EVEN: tr("Light too even"),
    Cause.NO_LIGHT: tr("No light from {place}"),
    Cause.ONE_LAMP: tr("No second light"),
    Cause.APART: tr("No turn combines its lights"),
    Cause.SPOILED: tr("Other light spoils it"),
    Cause.NO_TURN: tr("No turn gives this pattern"),
    Cause.WEAK_LAMP: tr("Lamp too weak here"),
}
_OBSTACLES: Final = {
    Obstacle.BACKGROUND: tr("No turn puts this background behind the sitter"),
    Obstacle.FACE_HIDDEN: tr("Too little of the face is visible from there"),
    Obstacle.NO_SHORT_LIGHT: tr("No short light here"),
    Obstacle.NO_BROAD_LIGHT: tr("No broad light here"),
}


def reason_sentence(shortfall: Shortfall | None) -> str:
    """Describe the cause with its numbers, or return "" if there is no shortfall.

    Examples:
        >>> reason_sentence(LightShortfall(Cause.NO_LIGHT, "match", 14.3, 45.0, Origin.BELOW))
        'No strong light from below here: match 14 of 100'
        >>> shadow = ("left cheek", "left nose shadow")
        >>> reason_sentence(AreaShortfall(Aspect.NOSE_SHADOW, "Loop", *shadow, 0.31, 0.6))
        'The nose shadow is too shallow: 0.3 stop; Loop needs 0.6'
    """
    match shortfall:
        case AreaShortfall():
            return _areas(shortfall, _with_numbers(shortfall, _reason_of(shortfall)))
        case LightShortfall():
            cause, number = _cause(shortfall), _number(shortfall)
            return tr("{cause}: {number}", cause=cause, number=number)
    return _without_numbers(shortfall)


def reason_line(shortfall: Shortfall | None) -> str:
    """Describe the cause without its numbers, for use beside the numbers.

    Examples:
        >>> reason_line(LightShortfall(Cause.NO_LIGHT, "match", 14.3, 45.0, Origin.BELOW))
        'No strong light from below here'
    """
    match shortfall:
        case AreaShortfall():
            reason = _reason_of(shortfall)
            return _areas(shortfall, reason.line or _with_numbers(shortfall, reason))
        case LightShortfall():
            return _cause(shortfall)
    return _without_numbers(shortfall)


def reason_card(shortfall: Shortfall | None) -> str:
    """Describe the cause briefly, for a card.

    Examples:
        >>> reason_card(LightShortfall(Cause.ONE_LAMP, "match", 14.3, 45.0, Origin.BELOW))
        'No second light'
    """
    match shortfall:
        case AreaShortfall():
            reason = _reason_of(shortfall)
            return _areas(shortfall, reason.card)
        case LightShortfall(cause=Cause.NO_LIGHT, origin=Origin.HIGH_IN_FRONT):
            return tr("No light high in front")
        case LightShortfall():
            return _with_place(shortfall, _ON_CARDS.get(shortfall.cause, _CAUSES[shortfall.cause]))
    return _without_numbers(shortfall)


def out_of_reach_spoken(shortfall: Shortfall | None) -> str:
    """State that a style is out of reach, and why, in a clause for screen readers.

    Examples:
        >>> out_of_reach_spoken(LightShortfall(Cause.EVEN, "match", 14.3, 45.0))
        'out of reach: the light here is too even'
    """
    return tr("out of reach: {reason}", reason=lower_first(reason_line(shortfall)))


def out_of_reach_sentence(shortfall: Shortfall | None) -> str:
    """State that a style is out of reach, and why, in a sentence with a full stop.

    Examples:
        >>> out_of_reach_sentence(LightShortfall(Cause.EVEN, "match", 14.3, 45.0))
        'Out of reach here: the light here is too even: match 14 of 100.'
    """
    why = reason_sentence(shortfall) or tr("not within the limits")
    return tr("Out of reach here: {reason}.", reason=lower_first(why))


def soft_sentence(shortfall: Shortfall) -> str:
    """State that a style is only softly visible, and why."""
    return tr("Soft. {what}", what=reason_sentence(shortfall))


def soft_card(shortfall: Shortfall) -> str:
    """State by how much a style is softer than in the studio, or the cause, for a card.

    Examples:
        >>> shadow = ("left cheek", "left nose shadow")
        >>> soft_card(AreaShortfall(Aspect.NOSE_SHADOW, "Loop", *shadow, 1.13, 2.0))
        '1.1 of 2 stops'
        >>> soft_card(LightShortfall(Cause.SPOILED, "match", 61.0, 70.0))
        'other light spoils it'
    """
    match shortfall:
        case AreaShortfall(value_stops=value, limit_stops=limit) if 0.05 <= value < limit:
            least = f"{limit:.1f}".removesuffix(".0")
            digits = 2 if f"{value:.1f}" == f"{limit:.1f}" else 1
            number = f"{math.floor(value * 10**digits) / 10**digits:.{digits}f}"
            if least == "1":
                return tr("{number} of 1 stop", number=number)
            return tr("{number} of {least} stops", number=number, least=least)
    return lower_first(reason_card(shortfall))


def too_soft_words(contrast: float, least: float) -> str:
    """State that the light is too soft.

    Examples:
        >>> too_soft_words(12.3, 20.0)
        'Too soft: contrast 12% of the studio’s, needs 20%'
    """
    return tr(
        "Too soft: contrast {contrast}, needs {least}%",
        contrast=contrast_words(contrast),
        least=f"{least:.0f}",
    )


def too_soft_card(contrast: float, least: float) -> str:
    """State that the light is too soft, for a card.

    Examples:
        >>> too_soft_card(12.3, 20.0)
        'too soft: 12 of 20%'
    """
    share = max(math.floor(contrast), 0)
    return tr("too soft: {share} of {least}%", share=share, least=f"{least:.0f}")


def grade_words(grade: str | None, attainable: bool) -> str:
    """Return the word for a grade, or for whether the style is within reach if it has no grade.

    Examples:
        >>> grade_words("soft", True), grade_words(None, False)
        ('soft', 'no')
    """
    words = {"yes": tr("yes"), "soft": tr("soft"), "no": tr("no")}
    return words[grade or ("yes" if attainable else "no")]


def _without_numbers(shortfall: LensShortfall | SavedReason | None) -> str:
    match shortfall:
        case LensShortfall():
            return _OBSTACLES[shortfall.obstacle]
        case SavedReason():
            return shortfall.sentence
    return ""


def _reason_of(shortfall: AreaShortfall) -> Wording:
    below, above = AREA_REASONS[shortfall.aspect]
    return below if shortfall.value_stops < shortfall.limit_stops else above


def _with_numbers(shortfall: AreaShortfall, reason: Wording) -> str:
    """Return the sentence, without a value of nothing: an edge that is darker is no rim at all."""
    if shortfall.value_stops > 0 or shortfall.aspect is Aspect.EVENNESS:
        return reason.sentence
    if "{value}" not in reason.sentence:
        return reason.sentence
    reason_alone = reason.sentence.partition(": {value}")[0]
    return tr("{reason}; {{style}} needs {{limit_stops}}", reason=reason_alone)


def _areas(shortfall: AreaShortfall, words: str) -> str:
    value, limit = shortfall.value_stops, shortfall.limit_stops
    if shortfall.aspect is Aspect.EVENNESS:
        value, limit = abs(value), abs(limit)
    return words.format(
        style=shortfall.style,
        value=_stops(value, limit),
        limit=f"{limit:.1f}".replace("-", "\N{MINUS SIGN}"),
        limit_stops=_stops(limit, math.inf),
    )


def _stops(value: float, limit: float) -> str:
    """Format stops, rounded away from the limit so that no value beyond it reads as the limit.

    Examples:
        >>> _stops(0.31, 0.6), _stops(-1.66, 0.0), _stops(1.98, 2.0), _stops(-0.01, 0.6)
        ('0.3 stop', '−1.7 stops', '1.98 stops', '0.0 stop')
    """
    digits = 2 if f"{value:.1f}" == f"{limit:.1f}" else 1
    number = f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "\N{MINUS SIGN}")
    count = max(math.ceil(abs(round(value, digits))), 1)
    return tr_plural("{number} stop", "{number} stops", count, number=number)


def _cause(shortfall: LightShortfall) -> str:
    return _with_place(shortfall, _CAUSES[shortfall.cause])


def _with_place(shortfall: LightShortfall, words: str) -> str:
    return words if shortfall.origin is None else words.format(place=_ORIGINS[shortfall.origin])


def _number(shortfall: LightShortfall) -> str:
    """Format a value, rounded down so that a value below its limit never reads as the limit."""
    if shortfall.measure == "contrast":
        return tr("contrast {contrast}", contrast=contrast_words(shortfall.value))
    return tr("match {value} of 100", value=max(math.floor(shortfall.value), 0))
