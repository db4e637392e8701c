"""How the paper's greedy search compares with the full one.

Greedy first turns as if there were no lamp and then places it: 64 + 576 combinations instead of
36,864. The full search takes milliseconds here, so greedy is kept to be compared with.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from app.core.base.angles import difference

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.second_light.search import Placed
    from app.core.solver.reach import Objective


@dataclass(frozen=True, slots=True)
class GreedyPair:
    """Full and greedy search for one style.

    Attributes
    ----------
    turn_apart_deg : float
        Between the two turns, 0 to 180 deg.
    lost : float
        What greedy gives up: points of match, or per cent of the larger quality. Below
        0 where greedy stopped at a better match of a combination that is not strong enough.
    """

    name: str
    same: bool
    turn_apart_deg: float
    lost: float
    attainable_full: bool
    attainable_greedy: bool


@dataclass(frozen=True, slots=True)
class GreedyReport:
    """Full and greedy search for some styles."""

    pairs: tuple[GreedyPair, ...]


def compare(
    full: Sequence[Placed], greedy: Sequence[Placed], objective: Objective = "picture"
) -> GreedyReport:
    """Compare the answers of both searches."""
    pairs = zip(full, greedy, strict=True)
    return GreedyReport(tuple(_pair(a, b, objective) for a, b in pairs))


def _pair(full: Placed, greedy: Placed, objective: Objective) -> GreedyPair:
    if objective == "paper":
        size = max(abs(full.quality), abs(greedy.quality), 1e-30)
        lost = 100.0 * (full.quality - greedy.quality) / size
    else:
        lost = full.match - greedy.match
    same = (full.turn_index, full.placement) == (greedy.turn_index, greedy.placement)
    return GreedyPair(
        name=full.name,
        same=same,
        turn_apart_deg=abs(difference(full.turn_deg, greedy.turn_deg)),
        lost=0.0 if same else lost,
        attainable_full=full.attainable,
        attainable_greedy=greedy.attainable,
    )
