"""Sentences about the first rough answers, which come from a single thumbnail."""

from __future__ import annotations

from collections.abc import Sequence

from app.core.measure.single.preview import RoughAnswer
from app.core.text import tr
from app.words.phrases.directions import place_words
from app.words.phrases.turns import turn_words


def rough_words(answers: Sequence[RoughAnswer] | None) -> str:
    """Describe how to turn for the best styles, or return "" if there are no answers."""
    if answers is None:
        return ""
    if not answers:
        return tr("Rough first answer: no style seems to be within reach here.")
    return tr("Rough first answer: {turns}.", turns="; ".join(_named(each) for each in answers))


def _named(answer: RoughAnswer) -> str:
    result = answer.result
    where, turn = place_words(result.side, ""), turn_words(result.turn_refined_deg)
    words = (result.title, where, turn, tr("unsure") if answer.unsure else "")
    return ", ".join(part for part in words if part)
