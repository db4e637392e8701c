"""Translate whole sentences with placeholders, through gettext's catalogues.

English is in the source: a sentence is its own key. A translation is a `turnlight.mo` under
`resources/locale/LANGUAGE/LC_MESSAGES/`; none ships yet, and `pybabel extract` writes the
template that translators start from. The language `test` is made of the English sentences:
accented, 40 % longer and in brackets, so that what is cut off, put together from pieces or not
translated at all is seen.

This module imports nothing of the program's, so that errors can be translated too. The language is
the one thing in core that is set once for the whole program (`app.core.text.set_language`), by the
command line before anything is shown. Tables of words may therefore be translated when their module
is imported.
"""

from __future__ import annotations

import gettext
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

DOMAIN: Final = "turnlight"
_LONGER: Final = 0.4
_ACCENTS: Final = str.maketrans(
    "ACDEGHIJKLNORSTUWYZacdeghijklnorstuwyz",
    "ÅÇĐÉĜĤÎĴĶĻÑÖŔŠŢÛŴÝŽåçđéĝĥîĵķļñöŕšţûŵýž",
)
# Placeholders, tags, entities, and what argparse fills in.
_PLACEHOLDERS: Final = re.compile(r"(\{[^{}]*\}|<[^<>]*>|&\w+;|%\(\w+\)s)")


class PseudoLanguage(gettext.NullTranslations):
    """A pseudo-language that tests layouts: English with accents, brackets and extra length."""

    def gettext(self, message: str) -> str:
        """Return a message in the pseudo-language."""
        return stretched(message)

    def ngettext(self, msgid1: str, msgid2: str, n: int) -> str:
        """Return the form for `n` as a foreign one."""
        return stretched(msgid1 if n == 1 else msgid2)


def stretched(message: str) -> str:
    """Convert English to the language `test`; placeholders and tags are left alone.

    Examples:
        >>> stretched("Turn {turn} clockwise")
        '[Ţûŕñ {turn} çļöçķŵîšé ~~~]'
    """
    if not any(letter.isalpha() for letter in _PLACEHOLDERS.sub("", message)):
        return message
    parts = _PLACEHOLDERS.split(message)
    parts[::2] = [part.translate(_ACCENTS) for part in parts[::2]]
    more = round(_LONGER * len(_PLACEHOLDERS.sub("", message)))
    return f"[{''.join(parts)} {'~' * max(more - 3, 0)}]" if more > 3 else f"[{''.join(parts)}]"


_speaks: gettext.NullTranslations = gettext.NullTranslations()


def speak(language: str, folder: Path) -> None:
    """Set the language; raises OSError if the folder has no catalogue for it."""
    global _speaks
    if language == "en":
        _speaks = gettext.NullTranslations()
    elif language == "test":
        _speaks = PseudoLanguage()
    else:
        _speaks = gettext.translation(DOMAIN, folder, [language])


def tr(sentence: str, /, **values: object) -> str:
    """Translate a sentence and fill in its placeholders.

    Examples:
        >>> tr("Turn {turn} {direction}", turn="96°", direction="clockwise")
        'Turn 96° clockwise'
    """
    return _filled(_speaks.gettext(sentence), sentence, values)


def tr_plural(one: str, many: str, count: int, /, **values: object) -> str:
    """Translate a sentence in the singular or plural form for its `{count}`.

    Examples:
        >>> tr_plural("{count} frame", "{count} frames", 3)
        '3 frames'
    """
    english = one if count == 1 else many
    return _filled(_speaks.ngettext(one, many, count), english, {"count": count, **values})


def _filled(translated: str, english: str, values: dict[str, object]) -> str:
    """Fill in the values; a translation that names others than the English gives way to it."""
    if not values:
        return translated
    fill: Callable[..., str] = translated.format
    try:
        return fill(**values)
    except (KeyError, IndexError, ValueError, AttributeError):
        return english.format(**values)
