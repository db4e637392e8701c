"""JSON files of the user's own: written whole, and doubted in every field when they are read.

A file is one object with one entry to a line, so that the entries before and after a damaged one
can still be read. Nothing here judges what the entries mean.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
import unicodedata
from copy import deepcopy
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.base.files import atomic_write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

Facts: TypeAlias = dict[str, Any]
"""An object as JSON knows it."""

State: TypeAlias = Literal["whole", "damaged", "missing", "unreadable"]

_NO_LETTERS: Final = frozenset({"Cc", "Cs", "Zl", "Zp"})
_DEEPEST: Final = 24
_ENTRY: Final = re.compile(r'^([ \t]*)"((?:[^"\\\n]|\\.){1,100})"[ \t]*:[ \t]*', re.MULTILINE)
_MOST_SAVED: Final = 500  # entries looked at in a damaged file
_LONGEST_WHOLE: Final = 18  # digits that a 64-bit number can have; more only cost time


class Unfit(ValueError):
    """A value is not what its name promises."""


@dataclass(frozen=True, slots=True, eq=False)
class JsonFile:
    """What a file holds, or why it does not."""

    # "whole"; "damaged": `facts` are the entries that could be saved; "missing"; "unreadable": the
    # system does not give it out
    state: State
    facts: Facts = field(default_factory=dict)
    why: str = ""
    lost: tuple[str, ...] = ()


def read_json(path: Path, most: int) -> JsonFile:
    """Read a file that may be anything, without ever failing.

    `most`: largest size that is read, bytes.
    Entries of a damaged file are saved one by one.
    """
    try:
        # A pipe would be waited for, and a device has no end.
        if not stat.S_ISREG(path.stat().st_mode):
            return JsonFile("damaged", why="it is not an ordinary file")
        with path.open("rb") as stream:
            data = stream.read(most + 1)
    except (FileNotFoundError, NotADirectoryError):
        return JsonFile("missing", why="it is missing")
    except OSError as error:
        return JsonFile("unreadable", why=(error.strerror or str(error)).lower())
    if len(data) > most:
        return JsonFile("damaged", why="it is far too large")
    return _parsed(data)


def _parsed(data: bytes) -> JsonFile:
    if not data.strip(b"\0 \t\r\n"):
        return JsonFile("damaged", why="it is empty")
    try:
        facts = json.loads(data.decode("utf-8-sig"), parse_int=_whole)
    except UnicodeDecodeError:
        return _saved(data, "it is not all text")
    except RecursionError:
        return JsonFile("damaged", why="it is nested too deeply")
    except ValueError:
        return _saved(data, "it is damaged or incomplete")
    if not isinstance(facts, dict):
        return JsonFile("damaged", why="it is something else")
    deep = tuple(name for name, value in facts.items() if not _is_shallow(value, _DEEPEST))
    if deep:
        kept = {name: value for name, value in facts.items() if name not in deep}
        return JsonFile("damaged", kept, "it is nested too deeply", deep)
    return JsonFile("whole", facts)


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits) <= _LONGEST_WHOLE else float(digits)


def _is_shallow(value: Any, left: int) -> bool:
    if isinstance(value, dict):
        return left > 0 and all(_is_shallow(each, left - 1) for each in value.values())
    if isinstance(value, list):
        return left > 0 and all(_is_shallow(each, left - 1) for each in value)
    return True


def _saved(data: bytes, why: str) -> JsonFile:
    """Save the entries that are whole, each for itself."""
    words = data.decode("utf-8", "surrogateescape")
    decoder = json.JSONDecoder(parse_int=_whole)
    facts: Facts = {}
    lost: list[str] = []
    indent: str | None = None
    for found in islice(_ENTRY.finditer(words), _MOST_SAVED):
        # The first entry shows how far the outermost ones are set in; deeper ones are not ours.
        indent = found[1] if indent is None else indent
        if found[1] != indent or _is_broken(found[2]):
            continue
        name = found[2]
        try:
            value, end = decoder.raw_decode(words, found.end())
        except (ValueError, RecursionError):
            lost.append(name)
            continue
        ended = re.match(r"[ \t\r\n]*[,}]", words[end : end + 200]) is not None
        if ended and not _is_broken(words[found.end() : end]) and _is_shallow(value, _DEEPEST):
            facts[name] = value
        else:
            lost.append(name)
    return JsonFile("damaged", facts, why, tuple(each for each in lost if each not in facts))


def _is_broken(words: str) -> bool:
    """Whether bytes in here were no text."""
    return any("\udc80" <= letter <= "\udcff" for letter in words)


def write_json(path: Path, facts: Facts, most: int) -> None:
    """Write a file whole or not at all.

    `most`: largest size that will be read again, bytes.
    Raises CoreError when the disk refuses, or the file would be too large to be read again.
    """
    data = dump(facts)
    if len(data) > most:
        raise CoreError(f"There is too much to keep in {path}: {len(data) >> 20} MB.")
    atomic_write_bytes(path, data)


def dump(facts: Facts) -> bytes:
    """Write entries down, one to a line; floats are read back to the last bit.

    Examples
    --------
    >>> print(dump({"name": "Café", "turns": [1, 2.5]}).decode(), end="")
    {
     "name": "Café",
     "turns": [1,2.5]
    }
    """
    try:
        lines = _lines(facts)
    except ValueError:
        # A number that is none can only have come in with an entry that is not ours.
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


def keep_bad(path: Path, most: int) -> Path | None:
    """Keep a damaged file beside itself, under a name that nothing has yet.

    The file stays where it is until it is written anew, so that a power cut in between takes
    nothing; only one too large to be copied is renamed.

    `most`: largest size that is copied, bytes.
    ``NAME.bak``, or ``NAME.bak-2`` and so on; an earlier copy with the same content counts. None
    when it could not be kept.
    """
    try:
        if not path.is_file():
            return None
        data = path.read_bytes() if path.stat().st_size <= most else None
        number = 1
        while True:
            aside = path.with_name(f"{path.name}.bak" + (f"-{number}" if number > 1 else ""))
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


def carry_unknown(new: Any, known: Any, found: Any) -> Any:
    """Put back what a newer version has written and this one does not know.

    `found` where nothing has changed, else `new` with the entries that only `found` has.

    Examples
    --------
    >>> carry_unknown({"a": 2}, {"a": 1}, {"a": 1, "b": 7})
    {'a': 2, 'b': 7}
    """
    if isinstance(new, dict) and isinstance(known, dict) and isinstance(found, dict):
        merged = {
            name: carry_unknown(value, known[name], found[name])
            if name in known and name in found
            else value
            for name, value in new.items()
        }
        others = (name for name in found if name not in known and name not in new)
        return merged | {name: deepcopy(found[name]) for name in others}
    return deepcopy(found) if new == known and type(new) is type(known) else new


def take(
    facts: Facts, name: str, check: Callable[[Any], Any], default: Any, lost: list[str], noun: str
) -> Any:
    """Take one entry, or its default where it is missing or unfit."""
    if name not in facts:
        return default
    try:
        return check(facts[name])
    except Unfit:
        del facts[name]
        lost.append(noun)
        return default


def clean(words: str) -> str:
    """Drop what a line of text cannot hold: control characters, line ends, broken letters."""
    return "".join(c for c in words if unicodedata.category(c) not in _NO_LETTERS).strip()


def text(longest: int, pattern: str = "") -> Callable[[Any], str]:
    """Return a check for text of a length at most, and of a pattern where one is given."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or len(value) > longest:
            raise Unfit("not a short text")
        if pattern and re.fullmatch(pattern, value) is None:
            raise Unfit("not of the pattern")
        return value

    return check


def number(low: float, high: float) -> Callable[[Any], float]:
    """Return a check for a number in ``[low, high]``."""

    def check(value: Any) -> float:
        # Python takes True for 1; a file that says true means something else.
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Unfit("not a number")
        if not low <= value <= high:
            raise Unfit("not in range")
        return float(value)

    return check


def truth(value: Any) -> bool:
    """Check that a value is true or false."""
    if not isinstance(value, bool):
        raise Unfit("neither true nor false")
    return value


def optional(check: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a check that lets null pass."""
    return lambda value: None if value is None else check(value)
