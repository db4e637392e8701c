"""Translate whole sentences with placeholders into the program's language."""

from typing import Final

from app.core.base.catalogue import speak, tr, tr_plural
from app.core.base.errors import CoreError
from app.core.base.paths import resources

__all__ = ["LANGUAGES", "TextError", "set_language", "tr", "tr_plural"]

LANGUAGES: Final = ("en", "test")
"""The languages that the program supports."""


class TextError(CoreError):
    """A language has no translation catalogue."""


def set_language(language: str) -> None:
    """Set the program's language.

    Raises:
        TextError: If the language has no translation catalogue.
    """
    try:
        speak(language, resources() / "locale")
    except OSError as error:
        raise TextError(
            tr("Turnlight is not available in {language!r}.", language=language),
            tr("Choose one of {languages}.", languages=", ".join(LANGUAGES)),
        ) from error
