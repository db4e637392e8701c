"""Heads for tests of screens: each is read once for a file, and drawn from its transport.

A picture at full size takes ten times as long. A head of the user's own has none either.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from app.core.portrait.head import Head, load_head
from app.ui.presenters import heads

if TYPE_CHECKING:
    import pytest

_load, _full = load_head, Head.__dict__["full"]


@cache
def _loaded(name: str, hair: str, in_place: bool) -> Head:
    return _load(name, hair, in_place)


def make_quick(patch: pytest.MonkeyPatch) -> None:
    """Read each head once for all tests of a file, and draw it small."""
    patch.setattr(heads, "load_head", _loaded)
    patch.setattr(Head, "full", None)


def make_real(patch: pytest.MonkeyPatch) -> None:
    """Take that back."""
    patch.setattr(heads, "load_head", _load)
    patch.setattr(Head, "full", _full)
