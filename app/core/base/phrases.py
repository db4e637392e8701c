"""Format lists of names, exposure times and percentages for sentences and errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.core.base.catalogue import tr

_MOST_NAMES: Final = 3


def listed(names: Sequence[str], most: int | None = _MOST_NAMES) -> str:
    """Join names into a phrase that lists the first `most` of them and counts the rest.

    Examples:
        >>> listed(["a", "b", "c"]), listed(["a", "b", "c", "d", "e"])
        ('a, b and c', 'a, b, c and 2 more')
        >>> listed(["a", "b", "c", "d"], most=None)
        'a, b, c and d'
    """
    if len(names) == 1:
        return names[0]
    if most is None or len(names) <= most:
        return tr("{names} and {last}", names=", ".join(names[:-1]), last=names[-1])
    return tr(
        "{names} and {count} more", names=", ".join(names[:most]), count=str(len(names) - most)
    )


def shutter_words(seconds: float) -> str:
    """Format an exposure time as photographers write it.

    Examples:
        >>> shutter_words(0.004), shutter_words(0.6), shutter_words(2.0)
        ('1/250 s', '0.6 s', '2 s')
    """
    return (
        f"1/{round(1.0 / seconds)} s" if 0.0 < seconds < 0.3 else f"{float(f'{seconds:.3g}'):g} s"
    )


def percent(share: float, digits: int = 0) -> str:
    """Format a fraction of the whole as a percentage.

    Examples:
        >>> percent(0.824), percent(0.0637, 1)
        ('82%', '6.4%')
    """
    return f"{100.0 * share:.{digits}f}%"


def small_percent(share: float) -> str:
    """Format a fraction that may be small as a percentage, with one decimal below 10%.

    Examples:
        >>> small_percent(0.824), small_percent(0.0637), small_percent(0.0004)
        ('82%', '6.4%', 'under 0.1%')
    """
    if 0.0 < share < 0.001:
        return tr("under 0.1%")
    return percent(share, 1 if share < 0.1 else 0)
