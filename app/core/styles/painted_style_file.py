"""Strict reader for the TOML file of a painted style."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

from app.core.base.errors import StyleError
from app.core.styles.style import Side
from app.core.styles.style_toml import (
    TEXT_LENGTHS,
    parse,
    parse_named,
    refuse_unknown,
    style_words,
    text_of,
)
from app.core.text import tr

PAINTED_FORMAT: Final = 1
"""Version of the format of painted styles."""
_PAINTED_KEYS: Final = ("title", "side", "place", "note", "painted")
_PAINTED_TABLE: Final = ("format", "sha256", "size", "head", "from", "untouched")
_PAINTED_LENGTHS: Final = {**TEXT_LENGTHS, "title": 80, "head": 80, "from": 80}
_SHA256: Final = re.compile(r"[0-9a-f]{64}")


class PaintedValues(NamedTuple):
    """Validated values from a painted style's file. The weights are stored in a separate file."""

    name: str
    title: str
    side: Side
    place: str
    note: str
    head: str
    origin: str
    size: int
    sha256: str
    untouched: bool


def is_painted(path: Path) -> bool:
    """Return whether a style file can be read and describes a painted style."""
    try:
        return "painted" in parse(path)
    except StyleError:
        return False


def read_painted(path: Path) -> PaintedValues:
    """Read and validate the file of a painted style.

    Returns:
        The values. `size` is the side of the canvas in pixels, and `sha256` is the checksum of the
        weights.

    Raises:
        StyleError: If the file cannot be read or is not in this format, or if an entry is unknown,
            missing or out of range.
    """
    table, where = parse_named(path), path.name
    painted = table.get("painted")
    if not isinstance(painted, dict):
        raise StyleError(tr("{where} has no [painted] section.", where=where))
    _check_format(painted.get("format"), where)
    refuse_unknown(table, _PAINTED_KEYS, where)
    refuse_unknown(painted, _PAINTED_TABLE, where)
    title, side, place, note = style_words(table, where, _PAINTED_LENGTHS)
    head, origin = (text_of(painted, key, where, _PAINTED_LENGTHS) for key in ("head", "from"))
    size, sha256 = painted.get("size"), painted.get("sha256")
    if (
        isinstance(size, bool)
        or not isinstance(size, int)
        or not isinstance(sha256, str)
        or not _SHA256.fullmatch(sha256)
    ):
        raise StyleError(tr("{where} does not name its weights file.", where=where))
    untouched = painted.get("untouched", False)
    if not isinstance(untouched, bool):
        raise StyleError(tr("{where}: untouched must be true or false.", where=where))
    words = title, side, place, note, head, origin
    return PaintedValues(path.stem, *words, size, sha256, untouched)


def _check_format(version: object, where: str) -> None:
    if isinstance(version, bool) or not isinstance(version, int):
        raise StyleError(tr("{where} does not record its format.", where=where))
    if version > PAINTED_FORMAT:
        raise StyleError(
            tr(
                "{where} was made by a newer version of Turnlight (format {version}).",
                where=where,
                version=version,
            ),
            tr("Update Turnlight."),
        )
    if version < PAINTED_FORMAT:
        raise StyleError(
            tr(
                "{where} has an old format ({version}) that Turnlight no longer reads.",
                where=where,
                version=version,
            )
        )
