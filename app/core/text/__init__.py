"""Translate whole sentences with placeholders into the language of the program."""

from typing import Final

from app.core.base.catalogue import speak, tr, tr_plural
from app.core.base.errors import CoreError
from app.core.base.paths import resources

__all__ = ["LANGUAGES", "TextError", "set_language", "tr", "tr_plural"]

LANGUAGES: Final = ("en", "test")
"""Languages that the program supports."""


class TextError(CoreError):
    """A language has no catalogue."""


def set_language(language: str) -> None:
    """Set the language of the program.

    Raises:
        TextError: If the language has no catalogue.
    """
    try:
        speak(language, resources() / "locale")
    except OSError as error:
        raise TextError(
            tr("Turnlight is not available in {language!r}.", language=language),
            tr("Choose one of {languages}.", languages=", ".join(LANGUAGES)),
        ) from error
