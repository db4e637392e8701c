"""What captured lamps are called: titles on screen, names in commands and files."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from app.core.base.errors import CoreError
from app.core.base.unique_names import names_like, title_key, titles_like
from app.core.second_light.lamp_presets import KINDS
from app.core.second_light.lamp_store import MAX_TITLE, facts_of, names

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


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


def titles_of(folder: Path, without: str = "") -> dict[str, str]:
    """Return the names of the lamps of a folder by `title_key`."""
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
    return _first(each for each in titles_like(title, MAX_TITLE) if title_key(each) not in taken)


def free_name(folder: Path, title: str) -> str:
    """Make a name for commands and files of a title: one that no lamp and no kind of lamp bears.

    Raises
    ------
    CoreError
        If thousands bear it already.
    """
    # A picture without its lamp is somebody's file all the same.
    taken = {*names(folder), *(file.stem for file in folder.glob("*.png"))}
    return _first(each for each in names_like(title, "lamp", KINDS) if each not in taken)


def _first(free: Iterator[str]) -> str:
    found = next(free, None)
    if found is None:
        raise CoreError("There are too many lamps of this name.", "Choose another name.")
    return found
