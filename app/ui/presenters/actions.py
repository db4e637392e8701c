"""Everything that can be done, as data: menus, shortcuts, hints and "find anything" read it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Action", "always"]


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
    words : str
        What it does, as on a button: "Open files…".
    run : callable
        Does it.
    icon : str
        Name of its icon, may be empty.
    shortcut : str
        As Qt writes it, "Ctrl+O"; several are separated by "; ". May be empty.
    enabled : callable
        Whether it can be done now.
    hint : str
        One or two words for the line at the foot of the window; empty = not shown there.
    keys : str
        How the shortcut is written in that line, when it is not `shortcut` itself.
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
