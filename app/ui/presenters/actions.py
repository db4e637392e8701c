"""Everything that can be done, as data: menus, shortcuts, hints and "find anything" read it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


def always() -> bool:
    """Say yes: for what can be done at any time."""
    return True


@dataclass(frozen=True, slots=True)
class Action:
    """Something that can be done.

    Attributes
    ----------
    key : str
        Name in code, unique: ``open-files``.
    shortcut : str
        As Qt writes it, "Ctrl+O"; several are separated by "; ". May be empty.
    hint : str
        One or two words for the line at the foot of the window; empty = not shown there.
    about : str
        What it would act on now, to be read after `words`: "Undo" "delete My Rembrandt".
    """

    key: str
    words: str
    run: Callable[[], None]
    icon: str = ""
    shortcut: str = ""
    enabled: Callable[[], bool] = always
    hint: str = ""
    keys: str = ""
    about: str = ""
