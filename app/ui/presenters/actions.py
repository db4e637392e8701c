"""Actions as data, and the search for entries that match a few typed letters."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from app.core.text import tr

_WORDS: Final = re.compile(r"[^\W_]+")
_MOST: Final = 50

SEARCH_SCOPE: Final = tr("an action, a style, a place, a lamp, a head or a setting")
"""The kinds of entries that the search can return."""


@dataclass(frozen=True, slots=True)
class Findable:
    """An entry of "Find anything".

    Attributes:
        detail: The kind of the entry in a few words, such as "style" or "place, 21 Nov".
    """

    words: str
    detail: str
    icon: str
    keys: str
    run: Callable[[], None]


def score(query: str, words: str) -> float:
    """Return how well a few letters match a text, from 0 (no match) to 1 (perfect match).

    Every word of the query must occur in the text. A query word scores highest at the start of the
    text word in the same position, lower at the start of any other word, and lowest inside a word.
    Shorter texts score slightly higher.

    Examples:
        >>> score("rem", "Rembrandt") > score("rem", "Save as a rembrandt") > 0
        True
        >>> score("cafe", "Café")
        1.0
    """
    query_words = _WORDS.findall(_plain(query))
    haystack = _WORDS.findall(_plain(words))
    if not query_words or not haystack:
        return 0.0
    total = 0.0
    for number, part in enumerate(query_words):
        begins = [at for at, word in enumerate(haystack) if word.startswith(part)]
        if begins:
            total += 1.0 - 0.1 * min(abs(begins[0] - number), 5)
        elif any(part in word for word in haystack):
            total += 0.3
        else:
            return 0.0
    length = sum(map(len, query_words)) / max(sum(map(len, haystack)), 1)
    return total / len(query_words) * (0.9 + 0.1 * min(length, 1.0))


def best(query: str, things: Iterable[Findable]) -> Sequence[Findable]:
    """Return the matching entries, best first."""
    if not query.strip():
        return list(things)[:_MOST]
    rated = [
        (max(score(query, one.words), 0.8 * score(query, f"{one.words} {one.detail}")), one)
        for one in things
    ]
    fitting = [pair for pair in rated if pair[0] > 0.0]
    return [one for _, one in sorted(fitting, key=lambda pair: -pair[0])][:_MOST]


def nothing_words(query: str) -> str:
    """Return the message for a search that has no matches, including suggestions."""
    return tr(
        "Nothing found for “{typed}”. Type a few letters of {searched}.",
        typed=query.strip(),
        searched=SEARCH_SCOPE,
    )


def _plain(text: str) -> str:
    split = unicodedata.normalize("NFKD", text.casefold())
    return "".join(letter for letter in split if not unicodedata.combining(letter))


def always() -> bool:
    """Return True, for use by actions that are always available."""
    return True


@dataclass(frozen=True, slots=True)
class Action:
    """An action that the user can perform.

    Attributes:
        key: Unique name in code, such as ``open-files``.
        shortcut: Shortcuts in Qt's notation, such as "Ctrl+O", separated by "; ", or an empty
            string if there are none.
        hint: One or two words for the line at the foot of the window, or an empty string to omit
            the action from that line.
        about: Current object of the action, shown after `words`, such as "delete My Rembrandt"
            after "Undo".
    """

    key: str
    words: str
    run: Callable[[], None]
    icon: str = ""
    shortcut: str = ""
    enabled: Callable[[], bool] = always
    hint: str = ""
    keys: str = ""
    about: str = ""
