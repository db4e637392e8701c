"""Sentences about reach: as kept over the demo scenes, and whole at every length."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

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
from app.words.why_out_of_reach import (
    out_of_reach_sentence,
    out_of_reach_spoken,
    reason_card,
    reason_line,
    reason_sentence,
    soft_card,
    soft_sentence,
)
from tests.helpers import reach_sentences

LENGTHS = (
    *(reason_sentence, reason_line, reason_card, out_of_reach_sentence, out_of_reach_spoken),
    *(soft_sentence, soft_card),
)


def every_shortfall() -> Iterator[Shortfall]:
    for aspect in Aspect:
        for value in (-0.31, 1.27):
            yield AreaShortfall(aspect, "Loop", "left cheek", "left nose shadow", value, 0.6)
    for cause in Cause:
        for origin in Origin if cause in (Cause.NO_LIGHT, Cause.ONE_LAMP) else (None,):
            yield LightShortfall(cause, "match", 31.9, 45.0, origin)
            yield LightShortfall(cause, "contrast", 12.9, 20.0, origin)
    yield from map(LensShortfall, Obstacle)
    yield SavedReason("Too dark: match 3 of 100")


def test_sentences_over_the_demo_scenes_are_as_kept() -> None:
    assert reach_sentences.sentences() == reach_sentences.read()


def test_a_card_has_at_most_five_words() -> None:
    for shortfall in every_shortfall():
        if not isinstance(shortfall, (LensShortfall, SavedReason)):
            assert len(reason_card(shortfall).split()) <= 5, reason_card(shortfall)


@pytest.mark.parametrize("words", LENGTHS)
def test_no_sentence_has_a_negative_number(words: Callable[[Shortfall], str]) -> None:
    for shortfall in every_shortfall():
        assert "\N{MINUS SIGN}" not in words(shortfall)


@pytest.mark.parametrize("words", LENGTHS)
def test_every_shortfall_has_a_whole_sentence(words: Callable[[Shortfall], str]) -> None:
    for shortfall in every_shortfall():
        text = words(shortfall)
        assert text
        assert text == text.strip()
        assert not set("{}") & set(text), text


def test_shorter_sentences_are_no_longer() -> None:
    for shortfall in every_shortfall():
        sentence, line = reason_sentence(shortfall), reason_line(shortfall)
        assert len(reason_card(shortfall)) <= len(line) <= len(sentence)


def test_numbers_never_read_as_their_limit() -> None:
    shallow = AreaShortfall(Aspect.NOSE_SHADOW, "Loop", "left cheek", "left patch", 0.58, 0.6)
    assert "0.58 stop" in reason_sentence(shallow)
    close = LightShortfall(Cause.EVEN, "match", 44.99, 45.0)
    assert reason_sentence(close) == "The light here is too even: match 44 of 100"


def test_no_shortfall_has_no_words() -> None:
    assert reason_sentence(None) == reason_line(None) == reason_card(None) == ""
