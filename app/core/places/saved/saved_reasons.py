"""Read saved reasons, which are stored as data or, in earlier places, as sentences."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any, Final, TypeVar

from app.core.solver.face import AREAS
from app.core.solver.shortfall import (
    AreaShortfall,
    Aspect,
    Cause,
    LensShortfall,
    LightShortfall,
    Obstacle,
    Origin,
    SavedReason,
    Shortfall,
)
from app.core.storage.json_file import Check, Unfit, entries, number, one_of, optional, record, text

_Member = TypeVar("_Member", bound=Enum)

_SENTENCE: Final = text(2000)
_NUMBER: Final = number(-1e300, 1e300)


def _member_of(kind: type[_Member]) -> Callable[[Any], _Member]:
    """Return the validator for the members of an enum."""
    values: dict[Any, _Member] = {member.value: member for member in kind}

    def check(value: Any) -> _Member:
        if not isinstance(value, str) or value not in values:
            raise Unfit("an unknown word")
        return values[value]

    return check


_KINDS: Final[dict[str, Check]] = {
    "areas": record(
        AreaShortfall,
        {
            "aspect": _member_of(Aspect),
            "style": text(200),
            "bright": one_of(*AREAS),
            "dark": one_of(*AREAS),
            "value_stops": _NUMBER,
            "limit_stops": _NUMBER,
        },
    ),
    "light": record(
        LightShortfall,
        {
            "cause": _member_of(Cause),
            "measure": one_of("match", "contrast"),
            "value": _NUMBER,
            "limit": _NUMBER,
            "origin": optional(_member_of(Origin)),
        },
    ),
    "lens": record(LensShortfall, {"obstacle": _member_of(Obstacle)}),
    "saved": record(SavedReason, {"sentence": _SENTENCE}),
}


def shortfall_of(value: Any) -> Shortfall:
    """Parse a shortfall."""
    kind = entries(value).get("kind")
    if not isinstance(kind, str) or kind not in _KINDS:
        raise Unfit("an unknown kind of reason")
    shortfall: Shortfall = _KINDS[kind](value)
    if isinstance(shortfall, LightShortfall) and (shortfall.origin is None) == (
        shortfall.cause in (Cause.NO_LIGHT, Cause.ONE_LAMP)
    ):
        raise Unfit("a missing light without its origin")
    return shortfall


def sentence_of(value: Any) -> SavedReason | None:
    """Parse a sentence from an earlier place."""
    words = _SENTENCE(value)
    return SavedReason(words) if words else None
