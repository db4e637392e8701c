"""Ways to a better grade for a style, each of which has been computed.

A face turned away from the lens does not help, because the grade depends only on the direction of
the nose, and the search has already tried every direction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from app.core.places.best_spot import rank_spots
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
