"""Heads for tests of screens: each is read once for a file, and drawn from its transport.

A picture at full size takes ten times as long. A head of the user's own has none either.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, lru_cache
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.solver.place_light import Facing, PlaceLight
from app.ui.presenters import heads, place_controller
from app.ui.presenters.heads import Head

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pytest

    from app.core.base.arrays import Bytes

_KEPT: Final = 16  # answers of 8 MB at most
_draw, _full, _load = Head.portraits, Head.__dict__["full"], heads.load_head


@dataclass(frozen=True)
class _Question:
    """What pictures depend on; heads and lights are held, so that their identities last."""

    pack: int
    looks: tuple[object, ...]
    linear: bytes
    size: tuple[int, int]
    lights: tuple[Any, ...]
    options: tuple[object, ...]
    head: Head = field(compare=False)
    pictures: Any = field(compare=False)
    given: tuple[Any, ...] = field(compare=False)


@lru_cache(maxsize=_KEPT)
def _answer(question: _Question) -> tuple[Bytes, ...]:
    close, quick, draft, exposed = question.options
    return tuple(
        _draw(
            question.head,
            question.pictures,
            question.size,
            question.given,
            close=bool(close),
            quick=bool(quick),
            draft=bool(draft),
            exposed=exposed,  # type: ignore[arg-type]
        )
    )


@lru_cache(maxsize=_KEPT)
def _digest(place: PlaceLight) -> tuple[object, ...]:
    radiance = np.ascontiguousarray(place.environment.radiance)
    return radiance.shape, blake2b(radiance.data).digest()


def _of_place(light: Facing) -> tuple[object, ...]:
    return *_digest(light.light), light.turn_deg


def _portraits(
    head: Head,
    linear: Any,
    size: tuple[int, int],
    lights: Sequence[Any],
    *,
    close: bool = False,
    quick: bool = False,
    draft: bool = False,
    exposed: Sequence[float] = (),
) -> list[Bytes]:
    pictures = np.asarray(linear)
    digest = blake2b(np.ascontiguousarray(pictures).data).digest()
    looks = head.name, id(head.transport), head.hair, head.in_place, head.yaw_deg
    options = close, quick, draft, tuple(exposed)
    # A place that is read again is the same place.
    asked = tuple(_of_place(one) if isinstance(one, Facing) else one for one in lights)
    key = _Question(
        id(head.pack), looks, digest, size, asked, options, head, pictures, tuple(lights)
    )
    return [picture.copy() for picture in _answer(key)]


@cache
def _loaded(name: str, hair: str, in_place: bool) -> Head:
    return _load(name, hair, in_place)


def make_quick(patch: pytest.MonkeyPatch) -> None:
    """Read each head once for all tests of a file, and make the same small picture once."""
    patch.setattr(place_controller, "load_head", _loaded)
    patch.setattr(Head, "full", None)
    patch.setattr(Head, "portraits", _portraits)


def make_real(patch: pytest.MonkeyPatch) -> None:
    """Take that back."""
    patch.setattr(place_controller, "load_head", _load)
    patch.setattr(Head, "full", _full)
    patch.setattr(Head, "portraits", _draw)
