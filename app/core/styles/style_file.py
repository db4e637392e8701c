"""A style, and the strict reader of its TOML file."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final, Literal, NamedTuple, TypeAlias

from app.core.base.atomic_files import open_file, words_of
from app.core.base.errors import StyleError
from app.core.solver.face import AREAS
from app.core.solver.shortfall import Aspect
from app.core.solver.style_signature import UNSIGNED, Relation, Signature
from app.core.text import tr

PAINTED_FORMAT: Final = 1
"""Version of the form in which painted styles are written."""

_MAX_BYTES: Final = 64_000
_MOST_DOTS: Final = 2000
_MAX_LAMPS: Final = 8
_DEEPEST: Final = 8
_LONGEST_SHOWN: Final = 120
_TOO_LONG: Final = tr("a number has too many digits")
_TOO_DEEP: Final = tr("it is nested too deeply")
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_STYLE_KEYS: Final = (
    *("title", "side", "place", "note", "paper", "lamps", "signature"),
    *("key_elevation_deg", "key_azimuth_deg", "key_diameter_deg"),
)
_TEXT_LENGTHS: Final = {"title": 32, "place": 40, "note": 400}
_PAINTED_KEYS: Final = ("title", "side", "place", "note", "painted")
_PAINTED_TABLE: Final = ("format", "sha256", "size", "head", "from", "untouched")
_PAINTED_LENGTHS: Final = {**_TEXT_LENGTHS, "title": 80, "head": 80, "from": 80}
_SHA256: Final = re.compile(r"[0-9a-f]{64}")
_RANGES: Final = {
    "azimuth_deg": (-180.0, 180.0),
    "elevation_deg": (-90.0, 90.0),
    "diameter_deg": (0.5, 90.0),
    "power": (0.001, 1000.0),
    "distance_m": (2.0, 100.0),
    "match": (0.0, 100.0),
    "least": (-20.0, 20.0),
    "most": (-20.0, 20.0),
    "nearly": (0.0, 5.0),
}


_RELATION_KEYS: Final = ("aspect", "bright", "dark", "least", "most", "nearly")
_MAX_RELATIONS: Final = 24
_MOST_STOPS: Final = 99.0

Side: TypeAlias = Literal["left", "right", "none"]
"""The sitter's own side on which the key lamp stands."""


@dataclass(frozen=True, slots=True)
class StyleLamp:
    """One studio lamp, relative to the face.

    Attributes:
        distance_m: From the point midway between the eyes, at least 2 m: nearer lamps do not act
            from one direction over the whole face.
    """

    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    power: float
    distance_m: float

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector to the lamp in the head frame (+X sitter's left, +Y up, +Z out of the face).

        Examples:
            >>> StyleLamp(90.0, 0.0, 10.0, 1.0, 2.0).direction[0]
            1.0
        """
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )


@dataclass(frozen=True, slots=True)
class Style:
    """A named target look.

    Attributes:
        key_elevation_deg, key_azimuth_deg: Where one lamp alone gives it, from and to, relative to
            the face; None for a style that needs several. From a larger to a smaller azimuth it is
            the way around the back.
        key_diameter_deg: How large that lamp is; None where any is right.
    """

    name: str
    title: str
    side: Side
    place: str
    note: str
    lamps: tuple[StyleLamp, ...]
    paper: bool = False
    signature: Signature = UNSIGNED
    key_elevation_deg: tuple[float, float] | None = None
    key_azimuth_deg: tuple[float, float] | None = None
    key_diameter_deg: tuple[float, float] | None = None


_LAMP_KEYS: Final = tuple(field.name for field in fields(StyleLamp))


def read_style(path: Path) -> Style:
    """Read and validate a style file.

    Returns:
        Angles in degrees, azimuth in (-180, 180], distance in metres.

    Raises:
        StyleError: When the file cannot be read, is not TOML, or anything in it is unknown, missing
            or out of range.
    """
    table, where = _parse_named(path), path.name
    _refuse_unknown(table, _STYLE_KEYS, where)
    title, side, place, note = _words(table, where, _TEXT_LENGTHS)
    if side == "none" and not place:
        raise StyleError(tr("{where}: a style without a side needs a place in words.", where=where))
    paper = table.get("paper", False)
    if not isinstance(paper, bool):
        raise StyleError(tr("{where}: paper must be true or false.", where=where))
    lamps, signature = _lamps(table, where), _signature(table.get("signature"), where)
    keys = [_range(table, key, where) for key in _STYLE_KEYS if key.startswith("key_")]
    return Style(path.stem, title, side, place, note, lamps, paper, signature, *keys)


def _range(table: Mapping[str, object], key: str, where: str) -> tuple[float, float] | None:
    """Read two angles; a style of several lamps has none of its key alone."""
    ends = table.get(key)
    if ends is None:
        return None
    if not isinstance(ends, list) or len(ends) != 2:
        raise StyleError(tr("{where}: {key} has two numbers, from and to.", where=where, key=key))
    angle = key.removeprefix("key_")
    low, high = (_number({angle: end}, angle, where) for end in ends)
    return low, high


class PaintedValues(NamedTuple):
    """Validated values of a painted style's file; its weights are in a file beside it."""

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
    """Return whether a style file describes a painted style.

    Returns:
        False also for a file that cannot be read.
    """
    try:
        return "painted" in _parse(path)
    except StyleError:
        return False


def read_painted(path: Path) -> PaintedValues:
    """Read and validate the file of a painted style.

    Returns:
        `size` is the side of its canvas in pixels, `sha256` belongs to its weights.

    Raises:
        StyleError: When the file cannot be read, is not of this format, or anything in it is
            unknown, missing or out of range.
    """
    table, where = _parse_named(path), path.name
    painted = table.get("painted")
    if not isinstance(painted, dict):
        raise StyleError(tr("{where} has no [painted] part.", where=where))
    _check_format(painted.get("format"), where)
    _refuse_unknown(table, _PAINTED_KEYS, where)
    _refuse_unknown(painted, _PAINTED_TABLE, where)
    title, side, place, note = _words(table, where, _PAINTED_LENGTHS)
    head, origin = (_text(painted, key, where, _PAINTED_LENGTHS) for key in ("head", "from"))
    size, sha256 = painted.get("size"), painted.get("sha256")
    if (
        isinstance(size, bool)
        or not isinstance(size, int)
        or not isinstance(sha256, str)
        or not _SHA256.fullmatch(sha256)
    ):
        raise StyleError(tr("{where} does not say which weights are its own.", where=where))
    untouched = painted.get("untouched", False)
    if not isinstance(untouched, bool):
        raise StyleError(tr("{where}: untouched must be true or false.", where=where))
    words = title, side, place, note, head, origin
    return PaintedValues(path.stem, *words, size, sha256, untouched)


def _check_format(version: object, where: str) -> None:
    if isinstance(version, bool) or not isinstance(version, int):
        raise StyleError(tr("{where} does not say which format it has.", where=where))
    if version > PAINTED_FORMAT:
        raise StyleError(
            tr(
                "{where} was made by a newer Turnlight (format {version}).",
                where=where,
                version=version,
            ),
            tr("Update Turnlight."),
        )
    if version < PAINTED_FORMAT:
        raise StyleError(
            tr(
                "{where} has an older format ({version}) that is no longer read.",
                where=where,
                version=version,
            )
        )


def _parse(path: Path) -> Mapping[str, object]:
    try:
        with open_file(path) as stream:
            data = stream.read(_MAX_BYTES + 1)
        # Python's reader takes minutes over a key of very many parts.
        if len(data) > _MAX_BYTES or data.count(b".") > _MOST_DOTS:
            raise StyleError(tr("{name} is too large to be a style.", name=path.name))
        table = tomllib.loads(data.decode("utf-8"))
        _check_values(table)
    except FileNotFoundError:
        raise StyleError(
            tr("The style file {path} is missing.", path=path), tr("Install it again.")
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
    # Python's own limit on digits is the one error that is neither of the two.
    own = isinstance(error, tomllib.TOMLDecodeError | UnicodeDecodeError)
    return str(error).rstrip(".")[:_LONGEST_SHOWN] if own else _TOO_LONG


def _check_values(table: Mapping[str, object]) -> None:
    """Check that numbers have 64 bits, as TOML has them, and that little is nested.

    Raises `tomllib.TOMLDecodeError`.
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


def _quoted(value: object) -> str:
    """Show a value of a file in a sentence; a long one is cut."""
    words = repr(value)
    return words if len(words) <= _LONGEST_SHOWN else f"{words[:_LONGEST_SHOWN]}…"


def _parse_named(path: Path) -> Mapping[str, object]:
    """Read a file whose name is to be the style's."""
    if not _NAME.fullmatch(path.stem):
        raise StyleError(
            tr("{name} is not a name for a style.", name=path.name),
            tr("Use lower-case letters, digits and hyphens, at most 40."),
        )
    return _parse(path)


def _words(
    table: Mapping[str, object], where: str, lengths: Mapping[str, int]
) -> tuple[str, Side, str, str]:
    """Title, side, place and note."""
    side = table.get("side", "none")
    if side not in ("left", "right", "none"):
        raise StyleError(
            tr(
                "{where}: side must be left, right or none, not {side}.",
                where=where,
                side=_quoted(side),
            )
        )
    title, place, note = (_text(table, key, where, lengths) for key in _TEXT_LENGTHS)
    if not title:
        raise StyleError(tr("{where}: the title is missing.", where=where))
    return title, side, place, note


def _refuse_unknown(table: Mapping[str, object], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            raise StyleError(
                tr("{where}: unknown key {key}.", where=where, key=_quoted(key)),
                tr("Valid names: {names}.", names=", ".join(keys)),
            )


def _text(table: Mapping[str, object], key: str, where: str, lengths: Mapping[str, int]) -> str:
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
            tr("{where}: {key} has characters that cannot be shown.", where=where, key=key)
        )
    return value


def _lamps(table: Mapping[str, object], where: str) -> tuple[StyleLamp, ...]:
    lamps = table.get("lamps")
    if not isinstance(lamps, list) or not 1 <= len(lamps) <= _MAX_LAMPS:
        raise StyleError(
            tr("{where}: a style has 1 to {most} [[lamps]].", where=where, most=_MAX_LAMPS)
        )
    return tuple(
        _lamp(lamp, tr("{where}, lamp {index}", where=where, index=index))
        for index, lamp in enumerate(lamps, 1)
    )


def _lamp(table: object, where: str) -> StyleLamp:
    if not isinstance(table, dict):
        raise StyleError(tr("{where}: a lamp is a table of numbers.", where=where))
    _refuse_unknown(table, _LAMP_KEYS, where)
    numbers = {key: _number(table, key, where) for key in _LAMP_KEYS}
    if numbers["azimuth_deg"] == -180.0:
        numbers["azimuth_deg"] = 180.0
    return StyleLamp(**numbers)


def _signature(table: object, where: str) -> Signature:
    """Read what a style is named for; a style need not say it."""
    if table is None:
        return UNSIGNED
    if not isinstance(table, dict):
        raise StyleError(tr("{where}: the signature is not a table.", where=where))
    _refuse_unknown(table, ("match", "even", "areas", "relations"), where)
    rows, match = table.get("relations"), table.get("match")
    if not isinstance(rows, list) or not 1 <= len(rows) <= _MAX_RELATIONS:
        raise StyleError(
            tr("{where}: a signature has 1 to {most} relations.", where=where, most=_MAX_RELATIONS)
        )
    if not isinstance(match, list) or len(match) != 2:
        raise StyleError(tr("{where}: match has two numbers, for yes and nearly.", where=where))
    yes, nearly = (_number({"match": value}, "match", where) for value in match)
    relations = tuple(
        _relation(row, tr("{where}, relation {index}", where=where, index=index))
        for index, row in enumerate(rows, 1)
    )
    flags = (table.get(name) is True for name in ("even", "areas"))
    return Signature(relations, (yes, min(yes, nearly)), *flags)


def _relation(row: object, where: str) -> Relation:
    if not isinstance(row, dict):
        raise StyleError(tr("{where} is not a table.", where=where))
    _refuse_unknown(row, _RELATION_KEYS, where)
    areas = [row.get("bright"), row.get("dark")]
    for area in areas:
        if area not in AREAS:
            raise StyleError(
                tr("{where}: there is no area {area}.", where=where, area=_quoted(area)),
                tr("Valid names: {names}.", names=", ".join(AREAS)),
            )
    if row.get("aspect") not in tuple(Aspect):
        raise StyleError(
            tr(
                "{where}: there is no aspect {aspect}.",
                where=where,
                aspect=_quoted(row.get("aspect")),
            ),
            tr("Valid names: {names}.", names=", ".join(Aspect)),
        )
    nearly = _number(row, "nearly", where)
    most = _number(row, "most", where) if "most" in row else _MOST_STOPS
    open_below = "most" in row and "least" not in row
    least = -_MOST_STOPS if open_below else _number(row, "least", where)
    return Relation(Aspect(row["aspect"]), str(areas[0]), str(areas[1]), least, most, nearly)


def _number(table: Mapping[str, object], key: str, where: str) -> float:
    value = table.get(key)
    # bool is an int to Python, but not a number to anybody.
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
                "{where}: {key} = {value:g} is not between {low:g} and {high:g}.",
                where=where,
                key=key,
                value=value,
                low=low,
                high=high,
            )
        )
    return float(value)
