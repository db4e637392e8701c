"""Finding anything by a few letters."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.ui.presenters.actions import Findable, best, score


def thing(words: str, detail: str = "") -> Findable:
    return Findable(words, detail, "", "", lambda: None)


THINGS = [
    thing("Open files…", "action"),
    thing("Rembrandt, sitter's left (camera right)", "style"),
    thing("Rembrandt, sitter's right (camera left)", "style"),
    thing("Rim, sitter's left (camera right)", "style"),
    thing("Café by the window", "place of 21 Nov"),
    thing("Undo", "action"),
]


@pytest.mark.parametrize(
    ("wanted", "first"),
    [
        ("rem", 1),
        ("rembrandt right", 2),
        ("rim", 3),
        ("CAFE", 4),
        ("window", 4),
        ("un", 5),
        ("file", 0),
        ("place", 4),
    ],
)
def test_what_is_meant_comes_first(wanted: str, first: int) -> None:
    assert best(wanted, THINGS)[0] is THINGS[first]


def test_nothing_typed_shows_everything_in_order() -> None:
    assert list(best("  ", THINGS)) == THINGS


def test_letters_that_fit_nowhere_find_nothing() -> None:
    assert not best("xyzzy", THINGS)


@given(st.text(max_size=30), st.text(max_size=60))
def test_any_text_has_a_score_between_nothing_and_all(wanted: str, words: str) -> None:
    assert 0.0 <= score(wanted, words) <= 1.0
