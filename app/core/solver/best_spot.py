"""Which of several places is the best for a style."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.core.base.angles import arc_width
from app.core.solver.signature import GRADES
from app.core.solver.solve import StyleResult

GRADE_WORTH: Final = 10.0
"""Points of match. With ten, each reading of "best" in the benchmark holds in nine of ten sets."""


def rank_spots(answers: Sequence[StyleResult]) -> tuple[int, ...]:
    """Order places by what each answers for one and the same style.

    The better grade goes first unless it costs more than `GRADE_WORTH` of match, as in the choice
    of a turn; among equals to a tenth of a point the wider arc, where one may stand less exactly,
    then the stronger light. `benchmarks/best-spot.md` tells how often that names the right place.

    Returns:
        Positions in `answers`, the best first; equal ones in their order.
    """

    def merit(position: int) -> tuple[float, float, float]:
        one = answers[position]
        grade = GRADES.index(one.grade) if one.grade else 2 * one.attainable
        return round(one.match + GRADE_WORTH * grade, 1), arc_width(one.arc_deg), one.strength

    return tuple(sorted(range(len(answers)), key=merit, reverse=True))
