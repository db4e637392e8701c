"""Rank places for a style."""

from __future__ import annotations

from collections.abc import Sequence

from app.core.base.angles import arc_width
from app.core.solver.style_result import StyleResult


def rank_spots(answers: Sequence[StyleResult]) -> tuple[int, ...]:
    """Rank places by their results for one style.

    As in the choice of a turn, a better grade comes first, then a better match. If both are equal
    to within a tenth of a point, the wider arc, which demands less precision, comes first, then the
    stronger light. `benchmarks/best-spot.md` states how often the ranking is right.

    Returns:
        Indices into `answers`, best place first. Ties keep their order.
    """

    def merit(position: int) -> tuple[int, float, float, float]:
        one = answers[position]
        return one.rank, round(one.match, 1), arc_width(one.arc_deg), one.strength

    return tuple(sorted(range(len(answers)), key=merit, reverse=True))
