"""All kinds of hair in one function."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from scenes.head_detail.brows import brows
from scenes.head_detail.hair import hair_long, hair_short
from scenes.head_detail.lashes import lashes
from scenes.head_detail.strands import Strands

_KINDS: dict[str, Callable[[str], Strands]] = {
    "brows": brows,
    "lashes": lashes,
    "hair-short": hair_short,
    "hair-long": hair_long,
}


@cache
def curves(name: str, what: str) -> Strands:
    """Return the strands of one kind on one head.

    Args:
        what: ``brows``, ``lashes``, ``hair-short`` or ``hair-long``.
    """
    made: Strands = _KINDS[what](name)
    return made
