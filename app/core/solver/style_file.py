"""Reading and checking one style file (TOML) that may have been written by hand."""

from __future__ import annotations

import math
import re
import tomllib
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from app.core.base.errors import StyleError
from app.core.base.files import open_file

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

PAINTED_FORMAT: Final = 1
"""Version of the form in which painted styles are written."""

_MAX_BYTES: Final = 64_000
_MAX_LAMPS: Final = 8
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_STYLE_KEYS: Final = ("title", "side", "place", "note", "paper", "lamps")
_TEXT_LENGTHS: Final = {"title": 32, "place": 40, "note": 400}
_PAINTED_KEYS: Final = ("title", "side", "place", "note", "painted")
_PAINTED_TABLE: Final = ("format", "sha256", "size", "head", "from")
_PAINTED_LENGTHS: Final = {**_TEXT_LENGTHS, "title": 80, "head": 80, "from": 80}
_SHA256: Final = re.compile(r"[0-9a-f]{64}")
_RANGES: Final = {
    "azimuth_deg": (-180.0, 180.0),
    "elevation_deg": (-90.0, 90.0),
    "diameter_deg": (0.5, 90.0),
    "power": (0.001, 1000.0),
    "distance_m": (2.0, 100.0),
}


class LampValues(NamedTuple):
    """One lamp's numbers, in the order of `app.core.solver.styles.StyleLamp`."""

    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    power: float
    distance_m: float


class StyleValues(NamedTuple):
    """What a style file says, checked; see `app.core.solver.styles.Style`."""

    name: str
    title: str
    side: Literal["left", "right", "none"]
    place: str
    note: str
    lamps: tuple[LampValues, ...]
    paper: bool


def read_toml(path: Path) -> StyleValues:
    """Read a style file and check everything in it.

    Returns:
        Angles in degrees, azimuth in (-180, 180], distance in metres.

    Raises:
        StyleError: When the file cannot be read, is not TOML, or anything in it is unknown, missing
            or out of range.
    """
    if not _NAME.fullmatch(path.stem):
        raise StyleError(
            f"{path.name} is not a name for a style.",
            "Use lower-case letters, digits and hyphens, at most 40.",
        )
    table = _parse(path)
    _refuse_unknown(table, _STYLE_KEYS, path.name)
    side = table.get("side", "none")
    if side not in ("left", "right", "none"):
        raise StyleError(f"{path.name}: side must be left, right or none, not {side!r}.")
    title, place, note = (_text(table, key, path.name) for key in _TEXT_LENGTHS)
    if not title:
        raise StyleError(f"{path.name}: the title is missing.")
    if side == "none" and not place:
        raise StyleError(f"{path.name}: a style without a side needs a place in words.")
    paper = table.get("paper", False)
    if not isinstance(paper, bool):
        raise StyleError(f"{path.name}: paper must be true or false.")
    return StyleValues(path.stem, title, side, place, note, _lamps(table, path.name), paper)


class PaintedValues(NamedTuple):
    """What the file of a painted style says, checked; its weights lie in a file beside it."""

    name: str
    title: str
    side: Literal["left", "right", "none"]
    place: str
    note: str
    head: str
    origin: str
    size: int
    sha256: str


def is_painted(path: Path) -> bool:
    """Tell whether a style file says that its style was painted.

    Returns:
        False also for a file that cannot be read: then nobody knows.
    """
    try:
        return "painted" in _parse(path)
    except StyleError:
        return False


def read_painted(path: Path) -> PaintedValues:
    """Read the file of a painted style and check everything in it.

    Returns:
        `size` is the side of its canvas in pixels, `sha256` belongs to its weights.

    Raises:
        StyleError: When the file cannot be read, is not of this format, or anything in it is
            unknown, missing or out of range.
    """
    if not _NAME.fullmatch(path.stem):
        raise StyleError(
            f"{path.name} is not a name for a style.",
            "Use lower-case letters, digits and hyphens, at most 40.",
        )
    table, where = _parse(path), path.name
    painted = table.get("painted")
    if not isinstance(painted, dict):
        raise StyleError(f"{where} has no [painted] part.")
    _check_format(painted.get("format"), where)
    _refuse_unknown(table, _PAINTED_KEYS, where)
    _refuse_unknown(painted, _PAINTED_TABLE, where)
    side = table.get("side", "none")
    if side not in ("left", "right", "none"):
        raise StyleError(f"{where}: side must be left, right or none, not {side!r}.")
    title, place, note = (_text(table, key, where, _PAINTED_LENGTHS) for key in _TEXT_LENGTHS)
    head, origin = (_text(painted, key, where, _PAINTED_LENGTHS) for key in ("head", "from"))
    if not title:
        raise StyleError(f"{where}: the title is missing.")
    size, sha256 = painted.get("size"), painted.get("sha256")
    if isinstance(size, bool) or not isinstance(size, int) or not isinstance(sha256, str):
        raise StyleError(f"{where} does not say which weights are its own.")
    if not _SHA256.fullmatch(sha256):
        raise StyleError(f"{where} does not say which weights are its own.")
    return PaintedValues(path.stem, title, side, place, note, head, origin, size, sha256)


def _check_format(version: object, where: str) -> None:
    if isinstance(version, bool) or not isinstance(version, int):
        raise StyleError(f"{where} does not say which format it has.")
    if version > PAINTED_FORMAT:
        raise StyleError(
            f"{where} was made by a newer Turnlight (format {version}).", "Update Turnlight."
        )
    if version < PAINTED_FORMAT:
        raise StyleError(f"{where} has an older format ({version}) that is no longer read.")


def _parse(path: Path) -> Mapping[str, object]:
    try:
        with open_file(path) as stream:
            data = stream.read(_MAX_BYTES + 1)
        if len(data) > _MAX_BYTES:
            raise StyleError(f"{path.name} is too large to be a style.")
        return tomllib.loads(data.decode("utf-8"))
    except FileNotFoundError:
        raise StyleError(f"The style file {path} is missing.", "Install it again.") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise StyleError(f"{path} cannot be read: {reason}.") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise StyleError(f"{path.name} is not valid TOML: {str(error).rstrip('.')}.") from None


def _refuse_unknown(table: Mapping[str, object], known: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in known:
            raise StyleError(f"{where}: unknown key {key!r}.", f"Known are {', '.join(known)}.")


def _text(
    table: Mapping[str, object],
    key: str,
    where: str,
    lengths: Mapping[str, int] = _TEXT_LENGTHS,
) -> str:
    value = table.get(key, "")
    if not isinstance(value, str):
        raise StyleError(f"{where}: {key} must be text.")
    value = " ".join(value.split())
    if len(value) > lengths[key]:
        raise StyleError(f"{where}: {key} is longer than {lengths[key]} characters.")
    if not value.isprintable():
        raise StyleError(f"{where}: {key} has characters that cannot be shown.")
    return value


def _lamps(table: Mapping[str, object], where: str) -> tuple[LampValues, ...]:
    lamps = table.get("lamps")
    if not isinstance(lamps, list) or not 1 <= len(lamps) <= _MAX_LAMPS:
        raise StyleError(f"{where}: a style has 1 to {_MAX_LAMPS} [[lamps]].")
    return tuple(_lamp(lamp, f"{where}, lamp {index}") for index, lamp in enumerate(lamps, 1))


def _lamp(table: object, where: str) -> LampValues:
    if not isinstance(table, dict):
        raise StyleError(f"{where}: a lamp is a table of numbers.")
    _refuse_unknown(table, LampValues._fields, where)
    numbers = {key: _number(table, key, where) for key in LampValues._fields}
    if numbers["azimuth_deg"] == -180.0:
        numbers["azimuth_deg"] = 180.0
    return LampValues(**numbers)


def _number(table: Mapping[str, object], key: str, where: str) -> float:
    value = table.get(key)
    # bool is an int to Python, but not a number to anybody.
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        missing = "is missing" if value is None else "must be a finite number"
        raise StyleError(f"{where}: {key} {missing}.")
    low, high = _RANGES[key]
    if not low <= value <= high:
        raise StyleError(f"{where}: {key} = {value:g} is not between {low:g} and {high:g}.")
    return float(value)
