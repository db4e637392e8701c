"""Translate whole sentences with placeholders, using gettext catalogues.

The source is in English, and each sentence is its own key. A translation is a `turnlight.mo` file
in `resources/locale/LANGUAGE/LC_MESSAGES/`. No translation ships yet. `pybabel extract` writes the
template for translators. The language `test` is derived from the English sentences: it is accented,
40% longer and in brackets, to reveal text that is cut off, glued together or not translated.

This module imports no other module of the program, so that errors can be translated too. The
language is core's only global setting (`app.core.text.set_language`); the command line sets it
before any text is shown. Tables of words may therefore be translated on import.
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
# Placeholders, tags, entities, and the fields that argparse fills in.
_PLACEHOLDERS: Final = re.compile(r"(\{[^{}]*\}|<[^<>]*>|&\w+;|%\(\w+\)s)")


class PseudoLanguage(gettext.NullTranslations):
    """A pseudo-language for testing layouts: English with accents, brackets and extra length."""

    def gettext(self, message: str) -> str:
        """Return a message in the pseudo-language."""
        return stretched(message)

    def ngettext(self, msgid1: str, msgid2: str, n: int) -> str:
        """Return the singular or plural form for `n` in the pseudo-language."""
        return stretched(msgid1 if n == 1 else msgid2)


def stretched(message: str) -> str:
    """Convert an English sentence to the language `test`, leaving placeholders and tags unchanged.

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
    """Set the language of all translated text.

    Raises:
        OSError: If the folder contains no catalogue for the language.
    """
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
    """Translate a sentence in the singular or the plural, as its `{count}` requires.

    Examples:
        >>> tr_plural("{count} frame", "{count} frames", 3)
        '3 frames'
    """
    english = one if count == 1 else many
    return _filled(_speaks.ngettext(one, many, count), english, {"count": count, **values})


def _filled(translated: str, english: str, values: dict[str, object]) -> str:
    """Fill in the values, falling back to English if the translation's placeholders are wrong."""
    if not values:
        return translated
    fill: Callable[..., str] = translated.format
    try:
        return fill(**values)
    except (KeyError, IndexError, ValueError, AttributeError):
        return english.format(**values)
