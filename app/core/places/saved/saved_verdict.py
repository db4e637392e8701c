"""Read from the file of a place only what its verdict depends on, whatever else is in the file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from app.core.places.place import clean_name
from app.core.places.saved.result_json import MOST_RESULTS
from app.core.portrait.ratio_and_glare import Flow
from app.core.solver.style_signature import FORMER_GRADES, GRADES, Grade
from app.core.storage.json_file import Facts, Unfit, number, optional, record

_FLOW: Final = record(
    Flow,
    {
        "azimuth_deg": number(-180.0, 180.0),
        "elevation_deg": number(-90.0, 90.0),
        # A vector cannot be longer than four times the scalar illuminance, except by rounding.
        "strength": number(0.0, 4.1),
    },
)


@dataclass(frozen=True, slots=True)
class SavedAnswer:
    """A saved result as a `StyleAnswer`, without its curves and its title cleaned."""

    name: str
    title: str
    attainable: bool
    match: float
    grade: Grade | None
    same_picture: tuple[str, ...] = ()


def flow_of(value: Any) -> Flow | None:
    """Read a flow, or return None if there is none that can be read.

    The flow is computed again when the place is opened, so a damaged one is no loss.
    """
    try:
        flow: Flow | None = optional(_FLOW)(value)
    except Unfit:
        return None
    return flow


def saved_answers(facts: Facts) -> tuple[SavedAnswer, ...]:
    """Return the results in the file of a place, skipping those without a name."""
    results = facts.get("results")
    rows = results[:MOST_RESULTS] if isinstance(results, list) else []
    return tuple(
        _answer(row) for row in rows if isinstance(row, dict) and isinstance(row.get("name"), str)
    )


def _answer(row: Facts) -> SavedAnswer:
    match, title, grade = row.get("match"), row.get("title"), str(row.get("grade"))
    same = row.get("same_picture")
    grade = FORMER_GRADES.get(grade, grade)
    return SavedAnswer(
        name=row["name"],
        title=clean_name(title) if isinstance(title, str) and title else "",
        attainable=row.get("attainable") is True,
        match=match if isinstance(match, float) and math.isfinite(match) else 0.0,
        grade=next((one for one in GRADES if one == grade), None),
        same_picture=tuple(map(str, same[:MOST_RESULTS])) if isinstance(same, list) else (),
    )
