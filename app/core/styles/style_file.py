"""Strict reader for the TOML file of a style."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Final, get_args

from app.core.base.errors import StyleError
from app.core.solver.face import AREAS
from app.core.solver.place_light import Expose
from app.core.solver.shortfall import Aspect
from app.core.solver.style_signature import UNSIGNED, Relation, Signature
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_toml import (
    TEXT_LENGTHS,
    number_of,
    parse_named,
    quoted,
    refuse_unknown,
    style_words,
)
from app.core.text import tr

_MAX_LAMPS: Final = 8
_STYLE_KEYS: Final = (
    *("title", "side", "place", "note", "paper", "lamps", "signature"),
    *("key_elevation_deg", "key_azimuth_deg", "key_diameter_deg", "expose"),
)
_RELATION_KEYS: Final = ("aspect", "bright", "dark", "least", "most", "soft")
_MAX_RELATIONS: Final = 24
_MOST_STOPS: Final = 99.0
_LAMP_KEYS: Final = tuple(field.name for field in fields(StyleLamp))


def read_style(path: Path) -> Style:
    """Read and validate a style file.

    Returns:
        The style, with angles in degrees, azimuths in (-180, 180] and distances in metres.

    Raises:
        StyleError: If the file cannot be read or is not TOML, or if an entry is unknown, missing or
            out of range.
    """
    table, where = parse_named(path), path.name
    refuse_unknown(table, _STYLE_KEYS, where)
    title, side, place, note = style_words(table, where, TEXT_LENGTHS)
    if side == "none" and not place:
        raise StyleError(tr("{where}: a style without a side needs a place.", where=where))
    paper = table.get("paper", False)
    if not isinstance(paper, bool):
        raise StyleError(tr("{where}: paper must be true or false.", where=where))
    lamps, signature = _lamps(table, where), _signature(table.get("signature"), where)
    elevation, azimuth, diameter = (
        _range(table, key, where) for key in _STYLE_KEYS if key.startswith("key_")
    )
    return Style(
        path.stem,
        title,
        side,
        place,
        note,
        lamps,
        paper,
        signature,
        elevation,
        azimuth,
        diameter,
        _expose(table, where),
    )


def _expose(table: Mapping[str, object], where: str) -> Expose:
    value, rules = table.get("expose", "face"), get_args(Expose)
    if value not in rules:
        raise StyleError(
            tr("{where}: unknown exposure {expose}.", where=where, expose=quoted(value)),
            tr("Valid names: {names}.", names=", ".join(rules)),
        )
    expose: Expose = rules[rules.index(value)]
    return expose


def _range(table: Mapping[str, object], key: str, where: str) -> tuple[float, float] | None:
    """Return a range of angles, or None if it is missing, as for a style with several lamps."""
    ends = table.get(key)
    if ends is None:
        return None
    if not isinstance(ends, list) or len(ends) != 2:
        raise StyleError(tr("{where}: {key} needs two numbers, from and to.", where=where, key=key))
    angle = key.removeprefix("key_")
    low, high = (number_of({angle: end}, angle, where) for end in ends)
    return low, high


def _lamps(table: Mapping[str, object], where: str) -> tuple[StyleLamp, ...]:
    lamps = table.get("lamps")
    if not isinstance(lamps, list) or not 1 <= len(lamps) <= _MAX_LAMPS:
        raise StyleError(
            tr("{where}: a style needs 1 to {most} [[lamps]].", where=where, most=_MAX_LAMPS)
        )
    return tuple(
        _lamp(lamp, tr("{where}, lamp {index}", where=where, index=index))
        for index, lamp in enumerate(lamps, 1)
    )


def _lamp(table: object, where: str) -> StyleLamp:
    if not isinstance(table, dict):
        raise StyleError(tr("{where}: a lamp must be a table of numbers.", where=where))
    refuse_unknown(table, _LAMP_KEYS, where)
    numbers = {key: number_of(table, key, where) for key in _LAMP_KEYS}
    if numbers["azimuth_deg"] == -180.0:
        numbers["azimuth_deg"] = 180.0
    return StyleLamp(**numbers)


def _signature(table: object, where: str) -> Signature:
    """Read the signature of a style. A style need not have one."""
    if table is None:
        return UNSIGNED
    if not isinstance(table, dict):
        raise StyleError(tr("{where}: the signature must be a table.", where=where))
    refuse_unknown(table, ("match", "even", "areas", "relations"), where)
    rows, match = table.get("relations"), table.get("match")
    if not isinstance(rows, list) or not 1 <= len(rows) <= _MAX_RELATIONS:
        raise StyleError(
            tr(
                "{where}: a signature needs 1 to {most} relations.",
                where=where,
                most=_MAX_RELATIONS,
            )
        )
    if not isinstance(match, list) or len(match) != 2:
        raise StyleError(tr("{where}: match needs two numbers, for yes and soft.", where=where))
    yes, soft = (number_of({"match": value}, "match", where) for value in match)
    relations = tuple(
        _relation(row, tr("{where}, relation {index}", where=where, index=index))
        for index, row in enumerate(rows, 1)
    )
    flags = (table.get(name) is True for name in ("even", "areas"))
    return Signature(relations, (yes, min(yes, soft)), *flags)


def _relation(row: object, where: str) -> Relation:
    if not isinstance(row, dict):
        raise StyleError(tr("{where} must be a table.", where=where))
    row = {"soft" if key == "nearly" else key: value for key, value in row.items()}  # former name
    refuse_unknown(row, _RELATION_KEYS, where)
    areas = [row.get("bright"), row.get("dark")]
    for area in areas:
        if area not in AREAS:
            raise StyleError(
                tr("{where}: unknown area {area}.", where=where, area=quoted(area)),
                tr("Valid names: {names}.", names=", ".join(AREAS)),
            )
    if row.get("aspect") not in tuple(Aspect):
        raise StyleError(
            tr(
                "{where}: unknown aspect {aspect}.",
                where=where,
                aspect=quoted(row.get("aspect")),
            ),
            tr("Valid names: {names}.", names=", ".join(Aspect)),
        )
    soft = number_of(row, "soft", where)
    most = number_of(row, "most", where) if "most" in row else _MOST_STOPS
    open_below = "most" in row and "least" not in row
    least = -_MOST_STOPS if open_below else number_of(row, "least", where)
    return Relation(Aspect(row["aspect"]), str(areas[0]), str(areas[1]), least, most, soft)
