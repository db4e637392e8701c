"""Write JSON files atomically, and validate them field by field.

A *check* returns a value as the program uses it, or raises `Unfit`. Tables of checks define the
valid content of a file. The meaning of the content is not judged here.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import stat
import unicodedata
from collections.abc import Callable, Collection, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields, is_dataclass, replace
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal, TypeAlias, TypeVar

import numpy as np

from app.core.base.atomic_files import atomic_write_bytes, words_of
from app.core.base.errors import CoreError
from app.core.base.visible_text import STEERING
from app.core.text import tr

Check: TypeAlias = Callable[[Any], Any]

Facts: TypeAlias = dict[str, Any]
"""A JSON object."""

State: TypeAlias = Literal["whole", "damaged", "missing", "unreadable"]

_Record = TypeVar("_Record")
_Lost = TypeVar("_Lost")

_NO_LETTERS: Final = frozenset({"Cc", "Cs", "Zl", "Zp"})
_DEEPEST: Final = 24
_LONGEST_WHOLE: Final = 18  # digits of a 64-bit number; parsing longer ones only takes time


class Unfit(ValueError):
    """A value is invalid."""


@dataclass(frozen=True, slots=True, eq=False)
class JsonFile:
    """The content of a JSON file, or the reason why it is unreadable."""

    state: State  # "unreadable": the system denies access
    facts: Facts = field(default_factory=dict)
    error: CoreError | None = None  # what is wrong with a file that is not whole
    version: str = ""  # SHA-256 of the file's bytes, or "" if none were read

    @property
    def why(self) -> str:
        """The error message, worded as part of a sentence, or "" if the file is undamaged."""
        return "" if self.error is None else self.error.message


def read_json(path: Path, most: int) -> JsonFile:
    """Read an untrusted JSON file of limited size, without ever raising an exception."""
    try:
        # A pipe would block, and a device has no end.
        if not stat.S_ISREG(path.stat().st_mode):
            return JsonFile("damaged", error=CoreError(tr("it is not an ordinary file")))
        with path.open("rb") as stream:
            data = stream.read(most + 1)
    except (FileNotFoundError, NotADirectoryError):
        return JsonFile("missing", error=CoreError(tr("it is missing")))
    except OSError as error:
        return JsonFile("unreadable", error=CoreError(words_of(error)))
    if len(data) > most:
        return JsonFile("damaged", error=CoreError(tr("it is far too large")))
    version = hashlib.sha256(data).hexdigest()
    if not data.strip(b"\0 \t\r\n"):
        return JsonFile("damaged", error=CoreError(tr("it is empty")), version=version)
    return replace(_parsed(data), version=version)


def _parsed(data: bytes) -> JsonFile:
    def integer(digits: str) -> int | float:
        return int(digits) if len(digits) <= _LONGEST_WHOLE else float(digits)

    try:
        facts = json.loads(data.decode("utf-8-sig"), parse_int=integer)
    except UnicodeDecodeError:
        return JsonFile("damaged", error=CoreError(tr("it is not plain text")))
    except RecursionError:
        return JsonFile("damaged", error=CoreError(tr("it is nested too deeply")))
    except ValueError:
        return JsonFile("damaged", error=CoreError(tr("it is damaged or incomplete")))
    if not isinstance(facts, dict):
        return JsonFile("damaged", error=CoreError(tr("it has the wrong content")))
    if not _is_shallow(facts, _DEEPEST + 1):
        return JsonFile("damaged", error=CoreError(tr("it is nested too deeply")))
    return JsonFile("whole", facts)


def _is_shallow(value: Any, depth: int) -> bool:
    inside = value.values() if isinstance(value, dict) else value
    if not isinstance(value, (dict, list)):
        return True
    return depth > 0 and all(_is_shallow(each, depth - 1) for each in inside)


_digests: Final[dict[Path, str]] = {}
"""Versions written by this process, by path. These versions do not count as conflicts."""


def write_json(path: Path, facts: Facts, most: int, base: str = "") -> Path | None:
    """Write a JSON file atomically, saving any concurrent version of the file next to it.

    Args:
        base: Version of the file on which the facts are based, from `read_json`, or "" if no file
            was read.

    Returns:
        The path of the concurrent version, which is neither the base nor a version written by this
        process, or None if there is none.

    Raises:
        CoreError: If the disk fails, or if the file would be larger than `most` bytes and therefore
            could not be read again.
    """
    data = dump(facts)
    if len(data) > most:
        raise CoreError(
            tr("{path} would be too large: {size} MB.", path=path, size=len(data) >> 20)
        )
    copy = _other_version(path, most, base)
    atomic_write_bytes(path, data, private=True)
    _digests[path] = hashlib.sha256(data).hexdigest()
    return copy


def _other_version(path: Path, most: int, base: str) -> Path | None:
    if not base:
        return None
    here = read_json(path, most).version
    ours = ("", base, _digests.get(path))
    return None if here in ours else keep_copy(path, most, "conflict")


def dump(facts: Facts) -> bytes:
    """Format entries as JSON, one per line, with floats that can be read back exactly.

    Examples:
        >>> print(dump({"name": "Café", "turns": [1, 2.5]}).decode(), end="")
        {
         "name": "Café",
         "turns": [1,2.5]
        }
    """
    try:
        lines = _lines(facts)
    except ValueError:
        # Only an entry of a newer version can contain an infinite number or NaN.
        lines = _lines(_finite(facts))
    try:
        return lines.encode("utf-8")
    except UnicodeEncodeError:
        return _lines(_finite(facts), ascii_only=True).encode("ascii")


def _lines(facts: Facts, *, ascii_only: bool = False) -> str:
    def words(value: Any) -> str:
        return json.dumps(value, ensure_ascii=ascii_only, allow_nan=False, separators=(",", ":"))

    entries = ",\n".join(f" {words(name)}: {words(value)}" for name, value in facts.items())
    return f"{{\n{entries}\n}}\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain(value: Any) -> Any:
    """Convert a value, such as a time, a dataclass or a NumPy value, to plain JSON values."""
    if isinstance(value, np.ndarray):
        return value.astype(np.float64).tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if is_dataclass(value):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    return value


def keep_bad(path: Path, most: int) -> Path | None:
    """Keep a copy of a damaged file as ``NAME.bak`` (see `keep_copy`)."""
    return keep_copy(path, most, "bak")


def keep_copy(path: Path, most: int, ending: str) -> Path | None:
    """Keep a copy of a file next to it, named ``NAME.ENDING``, ``NAME.ENDING-2`` and so on.

    The file itself stays until it is written again, so a power cut in between loses nothing. A file
    of more than `most` bytes is renamed instead of copied. An earlier copy with the same content is
    reused.

    Returns:
        The path of the copy, or None if the file could not be copied.
    """
    try:
        if not path.is_file():
            return None
        data = path.read_bytes() if path.stat().st_size <= most else None
        number = 1
        while True:
            aside = path.with_name(f"{path.name}.{ending}" + (f"-{number}" if number > 1 else ""))
            if not os.path.lexists(aside):
                break
            if data is not None and _holds(aside, data):
                return aside
            number += 1
        if data is None:
            path.rename(aside)
        else:
            atomic_write_bytes(aside, data)
    except (OSError, CoreError):
        return None
    return aside


def _holds(path: Path, data: bytes) -> bool:
    return path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data


def carry_unknown(new: Any, known_facts: Any, file_facts: Any) -> Any:
    """Preserve unknown entries from newer versions.

    Returns:
        `file_facts` if nothing has changed. Otherwise, `new` with the entries that only
        `file_facts` contains.

    Examples:
        >>> carry_unknown({"a": 2}, {"a": 1}, {"a": 1, "b": 7})
        {'a': 2, 'b': 7}
    """
    if isinstance(new, dict) and isinstance(known_facts, dict) and isinstance(file_facts, dict):
        merged = {
            name: carry_unknown(value, known_facts[name], file_facts[name])
            if name in known_facts and name in file_facts
            else value
            for name, value in new.items()
        }
        others = (name for name in file_facts if name not in known_facts and name not in new)
        return merged | {name: deepcopy(file_facts[name]) for name in others}
    return deepcopy(file_facts) if new == known_facts and type(new) is type(known_facts) else new


def take(facts: Facts, name: str, check: Check, default: Any, bad: list[_Lost], part: _Lost) -> Any:
    """Return an entry or its default. An invalid entry is removed and listed in `bad`."""
    if name not in facts:
        return default
    try:
        return check(facts[name])
    except Unfit:
        del facts[name]
        bad.append(part)
        return default


def clean(words: str) -> str:
    """Remove control characters, line breaks and broken characters from a text.

    Direction marks are removed too, since they would reverse neighbouring text.
    """
    return "".join(
        c for c in words if unicodedata.category(c) not in _NO_LETTERS and ord(c) not in STEERING
    ).strip()


def text(longest: int, pattern: str = "") -> Callable[[Any], str]:
    """Return a check for text that has a maximum length and, optionally, matches a pattern."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or len(value) > longest:
            raise Unfit("not a short text")
        if pattern and re.fullmatch(pattern, value) is None:
            raise Unfit("does not match the pattern")
        return value

    return check


def one_of(*words: str, former: Mapping[str, str] = MappingProxyType({})) -> Callable[[Any], str]:
    """Return a check for one of the given words.

    Args:
        former: Present words by those of earlier versions, which are replaced.
    """

    def check(value: Any) -> str:
        word = former.get(value, value) if isinstance(value, str) else value
        if word not in words:
            raise Unfit("an unknown word")
        return str(word)

    return check


def number(low: float, high: float) -> Callable[[Any], float]:
    """Return a check for a number in ``[low, high]``."""

    def check(value: Any) -> float:
        # Python treats True as 1, but in a file true means something else.
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Unfit("not a number")
        if not low <= value <= high:
            raise Unfit("out of range")
        return float(value)

    return check


def whole(low: int, high: int) -> Callable[[Any], int]:
    """Return a check for a whole number in ``[low, high]``."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise Unfit("not a whole number, or out of range")
        return value

    return check


def truth(value: Any) -> bool:
    """Check that a value is true or false."""
    if not isinstance(value, bool):
        raise Unfit("neither true nor false")
    return value


def moment(value: Any) -> datetime:
    """Check that a value is a time in ISO format."""
    try:
        return datetime.fromisoformat(text(64)(value))
    except ValueError as error:
        raise Unfit("not a time") from error


def optional(check: Check) -> Check:
    """Return a check that also accepts null."""
    return lambda value: None if value is None else check(value)


def listed(check: Check, most: int) -> Callable[[Any], tuple[Any, ...]]:
    """Return a check for a list of at most `most` values, each of which must pass `check`."""

    def check_all(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list) or len(value) > most:
            raise Unfit("not a list")
        return tuple(check(each) for each in value)

    return check_all


def entries(value: Any) -> Facts:
    """Check that a value is a JSON object."""
    if not isinstance(value, dict):
        raise Unfit("not an object")
    return value


def record(
    make: Callable[..., _Record], checks: Mapping[str, Check], needs: Collection[str] | None = None
) -> Callable[[Any], _Record]:
    """Return a check that converts an object whose entries all pass their checks.

    Args:
        make: Function called with the checked entries. Entries without a check are ignored.
        needs: Required entries, or None if every entry that has a check is required.
    """
    keys = checks if needs is None else needs

    def check(value: Any) -> _Record:
        facts = entries(value)
        for name in keys:
            if name not in facts:
                raise Unfit(f"it lacks {name}")
        return make(**{name: each(facts[name]) for name, each in checks.items() if name in facts})

    return check
