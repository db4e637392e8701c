"""Sentences for all remarks, shared by the window, commands and sheets."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from app.core.base.remarks import PlainRemark, Remark
from app.words import places
from app.words.measure import bracket, merged_light, panorama, ways
from app.words.sentences import Sentences, sentence_of

_TABLES: Final = (
    bracket.SENTENCES,
    merged_light.SENTENCES,
    panorama.SENTENCES,
    places.SENTENCES,
    ways.SENTENCES,
)
SENTENCES: Final[Sentences] = {
    PlainRemark: "{sentence}",
    **{kind: entry for table in _TABLES for kind, entry in table.items()},
}
"""Sentence for each type of remark: text with field names, or a function that returns it."""


def remark_words(remark: Remark) -> str:
    """Return the text of a remark.

    Examples:
        >>> remark_words(PlainRemark("The battery is low."))
        'The battery is low.'
    """
    return sentence_of(SENTENCES, remark)


def sentences(remarks: Iterable[Remark]) -> tuple[str, ...]:
    """Return the texts of the remarks in their order, one or two sentences each."""
    return tuple(remark_words(each) for each in remarks)
