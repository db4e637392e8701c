"""Translation: whole sentences with placeholders, in the language that the program speaks."""

from typing import Final

from app.core.base.catalogue import speak, tr, tr_plural
from app.core.base.errors import CoreError
from app.core.base.paths import resources

__all__ = ["LANGUAGES", "TextError", "set_language", "tr", "tr_plural"]

LANGUAGES: Final = ("en", "test")
"""The languages that the program speaks."""


class TextError(CoreError):
    """A language that the program does not speak."""


def set_language(language: str) -> None:
    """Speak a language from now on; raises `TextError` when there is no catalogue of it."""
    try:
        speak(language, resources() / "locale")
    except OSError as error:
        raise TextError(
            tr("Turnlight does not speak {language!r}.", language=language),
            tr("Choose one of {languages}.", languages=", ".join(LANGUAGES)),
        ) from error
