"""Small helpers for sentences about files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

_MOST_NAMES: Final = 3


def listed(names: Sequence[str]) -> str:
    """Join names to a list of words; of many names only the first three are said.

    >>> listed(["a", "b", "c"]), listed(["a", "b", "c", "d", "e"])
    ('a, b and c', 'a, b, c and 2 more')
    """
    if len(names) == 1:
        return names[0]
    if len(names) <= _MOST_NAMES:
        return f"{', '.join(names[:-1])} and {names[-1]}"
    return f"{', '.join(names[:_MOST_NAMES])} and {len(names) - _MOST_NAMES} more"


def plural(count: int, word: str) -> str:
    """Say a number of things.

    >>> plural(1, "frame"), plural(3, "frame")
    ('1 frame', '3 frames')
    """
    return f"{count} {word}{'' if count == 1 else 's'}"
