"""The names of heads."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from app.core.text import tr

_SKINS: Final = {
    "light": tr("{name} head, light skin"),
    "medium": tr("{name} head, medium skin"),
    "dark": tr("{name} head, dark skin"),
}


def head_words(head: str) -> str:
    """Return the title of a head, with the skin tone if the name includes one.

    Examples:
        >>> head_words("generic"), head_words("generic-dark"), head_words("anna.npz")
        ('Generic head', 'Generic head, dark skin', 'Head anna')
    """
    if head.endswith(".npz"):
        return tr("Head {head}", head=Path(head).name.removesuffix(".npz").removesuffix(".styles"))
    base, _, tone = head.partition("-")
    if not base.isalpha() or tone not in ("", *_SKINS):
        return tr("Head {head}", head=head)
    name = base.capitalize()
    return _SKINS[tone].format(name=name) if tone else tr("{name} head", name=name)


def head_title(name: str) -> str:
    """Return a head's title for use in lists."""
    # Built-in heads without a tone in their name have medium skin.
    words = head_words(name)
    return tr("{head}, medium skin", head=words) if name.isalpha() else words
