"""Format of saved remarks. Each remark is saved as the name of its class and its fields.

Earlier files contain sentences. Remarks from newer versions of Turnlight are skipped.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from inspect import getmembers, isclass
from types import ModuleType, UnionType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from app.core.base.remarks import PlainRemark, Remark
from app.core.environment import remarks as environment_remarks
from app.core.measure.ball import remarks as ball_remarks
from app.core.measure.bracket import remarks as bracket_remarks
from app.core.measure.film import remarks as film_remarks
from app.core.measure.finish import remarks as finish_remarks
from app.core.measure.fisheye import remarks as fisheye_remarks
from app.core.measure.photos import remarks as photos_remarks
from app.core.measure.plan import remarks as plan_remarks
from app.core.measure.read import remarks as read_remarks
from app.core.places.saved.earlier_remarks import remark_of
from app.core.storage.json_file import (
    Check,
    Facts,
    Unfit,
    entries,
    listed,
    number,
    plain,
    record,
    text,
    truth,
    whole,
)

_MODULES: Final[tuple[ModuleType, ...]] = (
    environment_remarks,
    ball_remarks,
    bracket_remarks,
    film_remarks,
    finish_remarks,
    fisheye_remarks,
    photos_remarks,
    plan_remarks,
    read_remarks,
)
_LONGEST: Final = 4000
_MOST: Final = 200


def _kinds() -> dict[str, type[Remark]]:
    return {
        name: member
        for module in _MODULES
        for name, member in getmembers(module, isclass)
        if issubclass(member, Remark) and member is not Remark
    }


KINDS: Final = _kinds()
"""The kinds of remark that a file may contain, by class name."""


def facts_of(remarks: Sequence[Remark], most: int = _MOST) -> list[Facts | str]:
    """Convert remarks to JSON data. A plain remark becomes its sentence, truncated to fit."""
    return [
        each.sentence[:_LONGEST]
        if isinstance(each, PlainRemark)
        else {"kind": type(each).__name__, **_json(each)}
        for each in remarks[:most]
    ]


def remarks_of(value: Any) -> tuple[Remark, ...]:
    """Validate a list of remarks, some of which may be stored as sentences."""
    remarks = listed(_remark, _MOST)(value)
    return tuple(each for each in remarks if each is not None)


def _json(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if is_dataclass(value):
        return {each.name: _json(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, tuple):
        return [_json(each) for each in value]
    return plain(value)


def _remark(value: Any) -> Remark | None:
    if isinstance(value, str):
        return remark_of(text(_LONGEST)(value))
    kind = entries(value).get("kind")
    if not isinstance(kind, str):
        raise Unfit("a remark without its kind")
    try:
        return _CHECKS[kind](value) if kind in KINDS else None
    except Unfit:
        return None


def _check_of(hint: Any) -> Check:
    """Return the validator for a field, given its type."""
    arguments = get_args(hint)
    if get_origin(hint) is Literal:
        return _one_of(dict.fromkeys(arguments))
    if get_origin(hint) is tuple:
        return listed(_check_of(arguments[0]), _MOST)
    if isinstance(hint, UnionType):
        (inner,) = (each for each in arguments if each is not type(None))
        check = _check_of(inner)
        return lambda value: None if value is None else check(value)
    if isclass(hint) and issubclass(hint, Enum):
        return _one_of({member.value: member for member in hint})
    if is_dataclass(hint):
        hints = get_type_hints(hint)
        return record(hint, {each.name: _check_of(hints[each.name]) for each in fields(hint)})  # type: ignore[arg-type]
    return _PLAIN[hint]


def _one_of(values: dict[Any, Any]) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if not isinstance(value, str) or value not in values:
            raise Unfit("an unknown word")
        return values[value] or value

    return check


_PLAIN: Final[dict[type, Check]] = {
    str: text(_LONGEST),
    bool: truth,
    int: whole(-(10**9), 10**9),
    float: number(-1e300, 1e300),
}
_CHECKS: Final[dict[str, Check]] = {name: _check_of(kind) for name, kind in KINDS.items()}
