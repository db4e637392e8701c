"""Ways to a better grade for a style, each of which has been computed.

Turning the face away from the lens is none of them: the grade depends on the direction of the nose
only, and the search has tried them all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from app.core.base.errors import CoreError
from app.core.places.best_spot import rank_spots
from app.core.places.place import Place, by_the_rule_before
from app.core.places.place_folder import read_place
from app.core.places.place_list import list_places
from app.core.reasons.light_in_the_way import LightInTheWay
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import Grade


@dataclass(frozen=True, slots=True)
class Mend:
    """A change that improves the grade of a style.

    Attributes:
        how: "block" for blocking the light in the way, or "spot" for another spot.
        turn_deg: The best turn then, in degrees from the photographer.
        spot: Name of the other spot, or "".
    """

    how: Literal["block", "spot"]
    grade: Grade
    turn_deg: float
    spot: str = ""


def find_mends(
    result: StyleResult,
    way: LightInTheWay | None,
    elsewhere: Mapping[str, StyleResult] | None = None,
) -> tuple[Mend, ...]:
    """Return the changes that improve the grade of a result.

    Args:
        elsewhere: Results for the same style at other spots, by the name of the spot.
    """
    mends = []
    if way is not None and way.blocked is not None and way.blocked.rank > result.rank:
        mends.append(_mend("block", way.blocked))
    spots = list(elsewhere.items()) if elsewhere else []
    for best in rank_spots([answer for _, answer in spots])[:1]:
        name, answer = spots[best]
        if answer.rank > result.rank:
            mends.append(_mend("spot", answer, name))
    return tuple(mends)


def _mend(how: Literal["block", "spot"], answer: StyleResult, spot: str = "") -> Mend:
    assert answer.grade is not None
    return Mend(how, answer.grade, answer.turn_refined_deg, spot)


def results_elsewhere(
    root: Path, here: Path | None, place: Place, head: str, style: str
) -> dict[str, StyleResult]:
    """Return the saved results for a style at the other spots that were measured on the same day.

    Only results for the same head, lamps and rule are comparable. Places that cannot be read are
    left out.

    Args:
        root: Folder that contains the places.
        here: Folder of the open place, or None if it is not saved.
        place: The open place.
        head: Name of the head.

    Returns:
        The results by the name of the place.
    """
    results: dict[str, StyleResult] = {}
    for summary in list_places(root):
        same_spot = summary.folder == here or (place.spot and summary.spot == place.spot)
        if same_spot or summary.state != "whole" or not _same_day(summary.made_at, place.made_at):
            continue
        try:
            other = read_place(summary.folder)
        except CoreError:
            continue
        basis = other.asked
        if basis is None or (basis.head, basis.objective) != (head, "picture"):
            continue
        if other.studios != place.studios or by_the_rule_before(other):
            continue
        for one in other.results:
            if one.name == style and one.grade is not None:
                results[other.name] = one
    return results


def _same_day(one: datetime, other: datetime) -> bool:
    return one.astimezone(other.tzinfo).date() == other.date()
