"""Words for grades: what a picture lacks that a style is named for, and how near it comes."""

from __future__ import annotations

import math
from typing import Final

from app.core.text import tr, tr_plural

# By aspect: what is wrong below the least value, and above the most. {value} and {limit} are stops.
_MISSING: Final = {
    "nose shadow": (
        tr("The nose’s shadow is {value} deep; {style} needs {limit}"),
        tr("The nose’s shadow is {value} deep; {style} bears {limit}"),
    ),
    "cheeks": (
        tr("The cheeks are {value} apart; {style} needs {limit}"),
        tr("The cheeks are {value} apart; {style} bears {limit}"),
    ),
    "open shadow": (
        tr("The nose’s shadow runs into the shadow on the cheek"),
        tr("The nose’s shadow runs into the shadow on the cheek"),
    ),
    "patch": (
        tr("The patch under the far eye is missing"),
        tr("The patch under the far eye is missing"),
    ),
    "dark patch": (
        tr("Under the far eye it is {value} darker; {style} needs {limit}"),
        tr("The far eye is too dark"),
    ),
    "shadow side": (
        tr("The two sides are {value} apart; {style} needs {limit}"),
        tr("The two sides are {value} apart; {style} bears {limit}"),
    ),
    "evenness": (
        tr("The sitter’s right is {value} brighter; {style} bears {limit}"),
        tr("The sitter’s left is {value} brighter; {style} bears {limit}"),
    ),
    "height": (
        tr("The light is too low for {style}"),
        tr("The light is too high for {style}"),
    ),
    "depth": (
        tr("The light is too high for {style}"),
        tr("The light is too low for {style}"),
    ),
    "above": (
        tr("The light is not high enough; {style} needs it above the head"),
        tr("The light is too high for {style}"),
    ),
    "below": (
        tr("The light is too high; {style} needs it under the chin"),
        tr("The light is too low for {style}"),
    ),
    "under the chin": (
        tr("Too little light under the chin; {style} needs its lamp there"),
        tr("The light is too low for {style}"),
    ),
    "throat": (
        tr("Too much light under the chin for {style}"),
        tr("Too little light under the chin for {style}"),
    ),
    "under the nose": (
        tr("No shadow under the nose; {style} needs one"),
        tr("The shadow under the nose is too deep for {style}"),
    ),
    "two lamps": (
        tr("One light alone; {style} needs one from above and one from below"),
        tr("The light comes too much from above for {style}"),
    ),
    "front": (
        tr("The light comes from behind; {style} needs it in front"),
        tr("The light comes from the front; {style} needs it behind"),
    ),
    "side": (
        tr("The light comes too much from the front for {style}"),
        tr("The light comes too much from behind for {style}"),
    ),
    "rim": (
        tr("The rim is too weak: {value} over the face, {style} needs {limit}"),
        tr("The rim is {value} over the face; {style} bears {limit}"),
    ),
    "one rim": (
        tr("Both edges of the face are bright; {style} needs one"),
        tr("Both edges of the face are bright; {style} needs one"),
    ),
    "rim only": (
        tr("The light comes from too far behind for {style}"),
        tr("The light comes from too far in front for {style}"),
    ),
    "two rims": (
        tr("One light behind the head alone; {style} needs one behind each side"),
        tr("One light behind the head alone; {style} needs one behind each side"),
    ),
    "grazed cheek": (
        tr("The light comes too much from the side for {style}"),
        tr("The light comes from too far behind for {style}"),
    ),
    "soft shadow": (
        tr("The light is too small or comes from elsewhere; {style} needs a large one at the side"),
        tr("The light is too small or comes from elsewhere; {style} needs a large one at the side"),
    ),
    "eye level": (
        tr("The light is too high for {style}"),
        tr("The light is too low for {style}"),
    ),
    "hair": (
        tr("The hair is {value} over the face; {style} needs {limit}"),
        tr("The hair is {value} over the face; {style} bears {limit}"),
    ),
    "hair only": (
        tr("The light is too low or too far aside; {style} needs it above and behind"),
        tr("The light is too high for {style}"),
    ),
    "hair before background": (
        tr("The background is too bright for {style}"),
        tr("The background is too dark for {style}"),
    ),
    "background": (
        tr("The background is {value} over the face; {style} needs {limit}"),
        tr("The background is {value} over the face; {style} bears {limit}"),
    ),
    "dark edge": (
        tr("The edges of the face are too dark for {style}"),
        tr("The edges of the face are too bright for {style}"),
    ),
    "bright background": (
        tr("The background is no brighter than the rest of the place"),
        tr("The background is too bright for {style}"),
    ),
    "middle line": (
        tr("The middle of the face is not dark enough: {value}, {style} needs {limit}"),
        tr("The middle of the face is too dark for {style}"),
    ),
}

ASPECTS: Final = tuple(_MISSING)
"""What relations of a signature may hold."""


def grade_words(grade: str | None, attainable: bool) -> str:
    """Name a grade in a word; without one, whether the style is in reach.

    Examples:
        >>> grade_words("nearly", True), grade_words(None, False)
        ('nearly', 'no')
    """
    words = {"yes": tr("yes"), "nearly": tr("nearly"), "no": tr("no")}
    return words[grade or ("yes" if attainable else "no")]


def missing_words(aspect: str, style: str, value: float, least: float, most: float) -> str:
    """Say what a picture lacks, without a full stop.

    Args:
        style: The style's title.
        value, least, most: Stops.

    Examples:
        >>> missing_words("nose shadow", "Loop", 0.31, 0.6, 99.0)
        'The nose’s shadow is 0.3 stop deep; Loop needs 0.6'
    """
    low = value < least
    limit = least if low else most
    if aspect == "evenness":
        value, limit = abs(value), abs(limit)
    below, above = _MISSING[aspect]
    return (below if low else above).format(
        style=style, value=_stops(value, limit), limit=f"{limit:.1f}".replace("-", "\N{MINUS SIGN}")
    )


def _stops(value: float, limit: float) -> str:
    """Round away from the limit, so that a value outside never reads as the limit.

    Examples:
        >>> _stops(0.31, 0.6), _stops(-1.66, 0.0), _stops(1.98, 2.0), _stops(-0.01, 0.6)
        ('0.3 stop', '−1.7 stops', '1.98 stops', '0.0 stop')
    """
    digits = 2 if f"{value:.1f}" == f"{limit:.1f}" else 1
    number = f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "\N{MINUS SIGN}")
    count = max(math.ceil(abs(round(value, digits))), 1)
    return tr_plural("{number} stop", "{number} stops", count, number=number)
