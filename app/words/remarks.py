"""The sentence of every remark, for window, commands and sheets alike."""

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
"""By remark: its sentence with the names of its fields, or what writes it."""


def remark_words(remark: Remark) -> str:
    """Write a remark.

    Examples:
        >>> remark_words(PlainRemark("The battery is low."))
        'The battery is low.'
    """
    return sentence_of(SENTENCES, remark)


def sentences(remarks: Iterable[Remark]) -> tuple[str, ...]:
    """Write remarks, one sentence or two for each, in their order."""
    return tuple(remark_words(each) for each in remarks)
