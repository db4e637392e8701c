"""The saved results of other spots of the day, at which a style may be better."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from app.core.base.errors import CoreError
from app.core.places.place import Place, by_the_rule_before
from app.core.places.place_folder import read_place
from app.core.places.place_list import list_places
from app.core.solver.style_result import StyleResult


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
