"""What the user's own things are called: titles on screen, names in commands and files."""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

_MOST: Final = 10_000
_LONGEST_NAME: Final = 28
_RESERVED: Final = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(-.*)?")  # on Windows


def title_key(title: str) -> str:
    """Return what of a title is compared: titles of one key look alike."""
    return unicodedata.normalize("NFKC", title).casefold()


def titles_like(title: str, longest: int) -> Iterator[str]:
    """Yield a title, then the same with a number, until one is free.

    Examples:
        >>> from itertools import islice
        >>> list(islice(titles_like("My Rembrandt", 80), 3))
        ['My Rembrandt', 'My Rembrandt 2', 'My Rembrandt 3']
    """
    yield title
    base = re.sub(r" \d{1,4}$", "", title)
    for count in range(2, _MOST):
        yield f"{base[: longest - 5]} {count}"


def names_like(title: str, otherwise: str, reserved: Collection[str]) -> Iterator[str]:
    """Yield names for commands and files made of a title, until one is free.

    Examples:
        >>> next(names_like("Café de l'Été", "lamp", ()))
        'cafe-de-l-ete'
    """
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode().lower()
    base = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:_LONGEST_NAME].strip("-") or otherwise
    if _RESERVED.fullmatch(base) or base in reserved:
        base = f"my-{base}"
    yield base
    for count in range(2, _MOST):
        yield f"{base}-{count}"
