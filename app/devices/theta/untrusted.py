"""JSON from untrusted sources, and JSON that a simple camera can parse.

A reply may be damaged or malicious, so limits apply to its size, its nesting, the number of its
values and the length of its numbers.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from decimal import Decimal
from typing import Any, Final, TypeAlias

from app.core.text import tr
from app.devices.errors import BadReply

JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"
"""A JSON value, in which every number is finite and every string is valid Unicode."""

MAX_BYTES: Final = 4_000_000
"""Maximum size of a reply, in bytes. A listing of a hundred files takes 50 kB."""

MAX_DEPTH: Final = 32
"""Maximum nesting depth. Cameras use seven levels."""

MAX_VALUES: Final = 100_000
"""Maximum number of values in a reply.

Without this limit, a few megabytes could become hundreds in memory.
"""

_MAX_DIGITS: Final = 40
_TEXT: Final = 200
_HINT: Final = tr("Try again. If the problem persists, restart the camera.")


def parse_json(data: bytes) -> JsonValue:
    """Parse the body of a reply.

    Args:
        data: JSON in UTF-8. Invalid characters become "�", because a single badly encoded
            description must not make a whole listing unusable. If a key is repeated, its last value
            is used.

    Raises:
        BadReply: If the data is not JSON, exceeds the limits, or contains NaN, an infinity or a
            number of more than 40 characters.
    """
    if len(data) > MAX_BYTES:
        raise BadReply(tr("The camera’s answer is too large."), _HINT, "too-large")
    if data.count(b",") + data.count(b"[") + data.count(b"{") > MAX_VALUES:
        raise BadReply(tr("The camera’s answer contains too many values."), _HINT, "too-large")
    try:
        value = json.loads(
            data.decode("utf-8-sig", "replace"),
            parse_int=_whole,
            parse_float=_real,
            parse_constant=_refuse,
        )
        return _sound(value, MAX_DEPTH)
    except (ValueError, RecursionError) as error:
        raise BadReply(tr("The camera’s answer cannot be read."), _HINT) from error


def _whole(digits: str) -> int:
    if len(digits) > _MAX_DIGITS:
        raise ValueError("number too long")
    return int(digits)


def _real(digits: str) -> float:
    value = float(digits) if len(digits) <= _MAX_DIGITS else math.inf
    if not math.isfinite(value):
        raise ValueError("number too long or too large")
    return value


def _refuse(word: str) -> float:
    raise ValueError(f"{word} is not a number")


def _sound(value: Any, depth: int) -> JsonValue:
    """Copy a value, removing lone surrogates, which can be neither saved nor displayed."""
    if isinstance(value, str):
        return value if value.isascii() else _sound_text(value)
    if not isinstance(value, (list, dict)):
        return value  # type: ignore[no-any-return]
    if depth == 0:
        raise ValueError("nested too deeply")
    if isinstance(value, list):
        return [_sound(item, depth - 1) for item in value]
    return {_sound_text(key): _sound(item, depth - 1) for key, item in value.items()}


def _sound_text(text: str) -> str:
    return text.encode("utf-8", "replace").decode("utf-8")


def write_json(value: Any) -> bytes:
    """Encode the body of a request.

    Numbers are written without exponents. A shutter speed of 0.00004 is therefore sent as the
    camera lists it and not as 4e-05.

    Raises:
        ValueError: If a number is not finite.
        TypeError: If a value's type cannot be represented in JSON.

    Examples:
        >>> write_json({"shutterSpeed": 0.00004})
        b'{"shutterSpeed":0.00004}'
    """
    return _dump(value).encode("ascii")


def _dump(value: Any) -> str:
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError("only finite numbers can be sent to a camera")
        return format(Decimal(repr(float(value))), "f")
    if value is None or isinstance(value, (bool, int, str)):
        return json.dumps(value)
    if isinstance(value, dict) or hasattr(value, "items"):
        return _written_table(value)
    if isinstance(value, (list, tuple)):
        return "[" + ",".join(map(_dump, value)) + "]"
    raise TypeError(f"{type(value).__name__} cannot be sent to a camera")


def _written_table(value: Mapping[str, Any]) -> str:
    if not all(isinstance(key, str) for key in value):
        raise TypeError("JSON keys must be strings")
    return "{" + ",".join(f"{json.dumps(key)}:{_dump(value[key])}" for key in value) + "}"


def table(value: object) -> dict[str, JsonValue]:
    """Return a JSON object, or an empty object for anything else."""
    return value if isinstance(value, dict) else {}


def words(value: object, longest: int = _TEXT) -> str:
    """Return a printable, stripped string of at most `longest` characters, or "" for other types.

    Longer strings are truncated, and control characters are removed.
    """
    if not isinstance(value, str):
        return ""
    return "".join(sign for sign in value[:longest] if sign.isprintable()).strip()


def texts(value: object, most: int = 100) -> tuple[str, ...]:
    """Return the non-empty strings in a list, each cleaned by `words`."""
    items = (words(item) for item in value[:most]) if isinstance(value, list) else ()
    return tuple(text for text in items if text)


def number(value: object) -> float | None:
    """Return a number, or None for anything else, including booleans."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value)


def fraction(value: object) -> float | None:
    """Return a number from 0 to 1, or None for anything else."""
    amount = number(value)
    return amount if amount is not None and 0.0 <= amount <= 1.0 else None


def whole(value: object, most: int = 2**53) -> int | None:
    """Return a whole number from 0 to `most` (5.0 counts as 5), or None for anything else."""
    amount = number(value)
    if amount is None or not amount.is_integer() or not 0 <= amount <= most:
        return None
    return int(amount)


def flag(value: object) -> bool | None:
    """Return a boolean, or None for anything else."""
    return value if isinstance(value, bool) else None
