"""Every word that a user reads: whole sentences with placeholders, ready for a second language."""

from app.core.text.catalogue import LANGUAGES, TextError, set_language, tr, tr_plural

__all__ = ["LANGUAGES", "TextError", "set_language", "tr", "tr_plural"]
