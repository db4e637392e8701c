"""What captured lamps are called: titles on screen, names in commands and files."""

from __future__ import annotations

import contextlib
import re
import unicodedata
from typing import TYPE_CHECKING, Final

from app.core.errors import CoreError
from app.core.second_light.lamp_store import MAX_TITLE, facts_of, names
from app.core.second_light.numbers import KINDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

__all__ = ["clean_title", "free_name", "free_title", "title_key", "titles_of"]

_LONGEST: Final = 28
_RESERVED: Final = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(-.*)?")  # on Windows


def clean_title(title: str) -> str:
    """Return a title as it is kept: one line of letters that can be seen.

    Raises
    ------
    CoreError
        If nothing is left of it, or too much.
    """
    visible = "".join(letter if letter.isprintable() else " " for letter in title)
    value = " ".join(visible.split())
    if not value:
        raise CoreError("The lamp needs a name.", "Type one.")
    if len(value) > MAX_TITLE:
        raise CoreError(f"This name is longer than {MAX_TITLE} characters.", "Shorten it.")
    return value


def title_key(title: str) -> str:
    """Return what of a title is compared: titles of one key look alike."""
    return unicodedata.normalize("NFKC", title).casefold()


def titles_of(folder: Path, without: str = "") -> dict[str, str]:
    """Return the names of the lamps of a folder by `title_key`.

    Parameters
    ----------
    folder : Path
        Where lamps are kept.
    without : str, optional
        Name of a lamp that is left out.
    """
    titles = {}
    for name in names(folder):
        # A title that cannot be read cannot be met again either.
        with contextlib.suppress(CoreError):
            if name != without:
                titles[title_key(facts_of(folder, name)[0]["title"])] = name
    return titles


def free_title(folder: Path, title: str) -> str:
    """Return a title that no lamp bears, with a number where this one is taken.

    Raises
    ------
    CoreError
        If thousands bear it already.
    """
    taken = titles_of(folder)
    if title_key(title) not in taken:
        return title
    base = re.sub(r" \d{1,4}$", "", title)
    return _first(
        (f"{base[: MAX_TITLE - 5]} {count}" for count in range(2, 10_000)),
        lambda candidate: title_key(candidate) not in taken,
    )


def free_name(folder: Path, title: str) -> str:
    """Make a name for commands and files of a title: one that no lamp and no kind of lamp bears.

    Raises
    ------
    CoreError
        If thousands bear it already.
    """
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode().lower()
    base = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:_LONGEST].strip("-") or "lamp"
    if _RESERVED.fullmatch(base) or base in KINDS:
        base = f"my-{base}"
    taken = set(names(folder))
    return _first(
        (base if count == 1 else f"{base}-{count}" for count in range(1, 10_000)),
        lambda candidate: candidate not in taken,
    )


def _first(candidates: Iterable[str], free: Callable[[str], bool]) -> str:
    found = next((candidate for candidate in candidates if free(candidate)), None)
    if found is None:
        raise CoreError("There are too many lamps of this name.", "Choose another name.")
    return found
