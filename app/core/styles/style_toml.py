"""Parse TOML style files from untrusted sources and check their values."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import open_file, words_of
from app.core.base.errors import StyleError
from app.core.styles.style import Side
from app.core.text import tr

_MAX_BYTES: Final = 64_000
_MOST_DOTS: Final = 2000
_DEEPEST: Final = 8
_LONGEST_SHOWN: Final = 120
_TOO_LONG: Final = tr("a number has too many digits")
_TOO_DEEP: Final = tr("it is nested too deeply")
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
TEXT_LENGTHS: Final = {"title": 32, "place": 40, "note": 400}
"""Maximum lengths of the texts in a built-in style, in characters."""
_RANGES: Final = {
    "azimuth_deg": (-180.0, 180.0),
    "elevation_deg": (-90.0, 90.0),
    "diameter_deg": (0.5, 90.0),
    "power": (0.001, 1000.0),
    "distance_m": (2.0, 100.0),
    "match": (0.0, 100.0),
    "least": (-20.0, 20.0),
    "most": (-20.0, 20.0),
    "soft": (0.0, 5.0),
}


def parse(path: Path) -> Mapping[str, object]:
    """Parse a style file.

    Raises:
        StyleError: If the file cannot be read or is not small, plain TOML.
    """
    try:
        with open_file(path) as stream:
            data = stream.read(_MAX_BYTES + 1)
        # tomllib needs minutes for a key with very many parts.
        if len(data) > _MAX_BYTES or data.count(b".") > _MOST_DOTS:
            raise StyleError(tr("{name} is too large for a style.", name=path.name))
        table = tomllib.loads(data.decode("utf-8"))
        _check_values(table)
    except FileNotFoundError:
        raise StyleError(
            tr("The style file {path} is missing.", path=path), tr("Reinstall it.")
        ) from None
    except OSError as error:
        reason = words_of(error)
        raise StyleError(tr("{path} cannot be read: {reason}.", path=path, reason=reason)) from None
    except (ValueError, RecursionError) as error:
        raise StyleError(
            tr("{name} is not valid TOML: {reason}.", name=path.name, reason=_reason(error))
        ) from None
    return table


def _reason(error: ValueError | RecursionError) -> str:
    if isinstance(error, RecursionError):
        return _TOO_DEEP
    # Any other ValueError is Python's limit on digits.
    own = isinstance(error, tomllib.TOMLDecodeError | UnicodeDecodeError)
    return str(error).rstrip(".")[:_LONGEST_SHOWN] if own else _TOO_LONG


def _check_values(table: Mapping[str, object]) -> None:
    """Check that integers fit in 64 bits, as in TOML, and that nesting is shallow.

    Raises:
        TOMLDecodeError: If an integer is too large or the nesting is too deep.
    """
    level: list[object] = [table]
    for _ in range(_DEEPEST):
        for value in level:
            if isinstance(value, int) and not -(2**63) <= value < 2**63:
                raise tomllib.TOMLDecodeError(_TOO_LONG)
        tables = [value.values() for value in level if isinstance(value, dict)]
        lists = [value for value in level if isinstance(value, list)]
        level = [each for inside in (*tables, *lists) for each in inside]
        if not level:
            return
    raise tomllib.TOMLDecodeError(_TOO_DEEP)


def quoted(value: object) -> str:
    """Format a value from a file for use in a sentence, truncating a long one."""
    words = repr(value)
    return words if len(words) <= _LONGEST_SHOWN else f"{words[:_LONGEST_SHOWN]}…"


def parse_named(path: Path) -> Mapping[str, object]:
    """Parse a style file whose stem is the name of the style.

    Raises:
        StyleError: If the name is invalid, or for any of the reasons given in `parse`.
    """
    if not _NAME.fullmatch(path.stem):
        raise StyleError(
            tr("“{name}” is not a valid style name.", name=path.name),
            tr("Use at most 40 lower-case letters, digits and hyphens."),
        )
    return parse(path)


def style_words(
    table: Mapping[str, object], where: str, lengths: Mapping[str, int]
) -> tuple[str, Side, str, str]:
    """Return the title, side, place and note of a style.

    Raises:
        StyleError: If one of these values is invalid.
    """
    side = table.get("side", "none")
    if side not in ("left", "right", "none"):
        raise StyleError(
            tr(
                "{where}: side must be left, right or none, not {side}.",
                where=where,
                side=quoted(side),
            )
        )
    title, place, note = (text_of(table, key, where, lengths) for key in TEXT_LENGTHS)
    if not title:
        raise StyleError(tr("{where}: the title is missing.", where=where))
    return title, side, place, note


def refuse_unknown(table: Mapping[str, object], keys: tuple[str, ...], where: str) -> None:
    """Reject a table that contains keys other than `keys`.

    Args:
        where: Name of the table, for the error message.

    Raises:
        StyleError: If the table contains any other key.
    """
    for key in table:
        if key not in keys:
            raise StyleError(
                tr("{where}: unknown key {key}.", where=where, key=quoted(key)),
                tr("Valid names: {names}.", names=", ".join(keys)),
            )


def text_of(table: Mapping[str, object], key: str, where: str, lengths: Mapping[str, int]) -> str:
    """Return a text from a table, or "" if it is missing.

    Raises:
        StyleError: If the text is too long or not printable.
    """
    value = table.get(key, "")
    if not isinstance(value, str):
        raise StyleError(tr("{where}: {key} must be text.", where=where, key=key))
    value = " ".join(value.split())
    if len(value) > lengths[key]:
        raise StyleError(
            tr(
                "{where}: {key} is longer than {most} characters.",
                where=where,
                key=key,
                most=lengths[key],
            )
        )
    if not value.isprintable():
        raise StyleError(
            tr("{where}: {key} contains characters that cannot be displayed.", where=where, key=key)
        )
    return value


def number_of(table: Mapping[str, object], key: str, where: str) -> float:
    """Return a number from a table.

    Raises:
        StyleError: If the number is missing or is out of range for its key.
    """
    value = table.get(key)
    # bool is a subclass of int.
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise StyleError(
            tr("{where}: {key} is missing.", where=where, key=key)
            if value is None
            else tr("{where}: {key} must be a finite number.", where=where, key=key)
        )
    low, high = _RANGES[key]
    if not low <= value <= high:
        raise StyleError(
            tr(
                "{where}: {key} = {value:g} must be between {low:g} and {high:g}.",
                where=where,
                key=key,
                value=value,
                low=low,
                high=high,
            )
        )
    return float(value)
