"""Compare the results before and after a change in the light, turn by turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.angles import difference
from app.core.base.arrays import Floats
from app.core.measure.finish.remarks import CostlyChange, MaskingChanges
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import Objective
from app.core.styles.style_pack import StylePack

_FREE: Final = 0.01  # fraction of a curve's range; a turn that loses no more counts as unchanged


@dataclass(frozen=True, slots=True)
class Change:
    """The change in a style's answer.

    Turns are refined and given in degrees in (-180, 180], positive clockwise.

    Attributes:
        change_deg: Change in the turn, in degrees, taking the shorter way around.
        given_up: Loss of the old turn under the new light, 0 to 1. This is the objective's value at
            the new turn minus its value at the old one, divided by the range of the objective's
            curve.
    """

    style: str
    title: str
    turn_before_deg: float
    turn_after_deg: float
    change_deg: float
    given_up: float
    attainable_before: bool
    attainable_after: bool


def changes(
    before: Floats,
    after: Floats,
    pack: StylePack,
    objective: Objective = "picture",
) -> tuple[Change, ...]:
    """Compare the answers of all styles under two lights.

    Args:
        before, after: (H, W, 3). Linear Rec. 709 radiance at turn 0, in the pack's size and at any
            exposure.

    Raises:
        EnvironmentFileError: If a light is black, is not finite or has a different size.
    """
    old = solve_all(pack, before, objective)
    new = solve_all(pack, after, objective)
    return tuple(_change(a, b, objective) for a, b in zip(old, new, strict=True))


def masking_changes(changed: Sequence[Change]) -> MaskingChanges:
    """Summarise the changes in the styles that were within reach before or are now.

    A turn that moved between two positions that are equally good in the new light (within 1% of the
    curve's range) counts as unchanged.
    """
    reachable = [each for each in changed if each.attainable_before or each.attainable_after]
    costly = [each for each in reachable if each.given_up > _FREE]
    worst = max(costly, key=lambda each: each.given_up, default=None)
    moved = (abs(each.change_deg) for each in reachable if each.given_up <= _FREE)
    gained = [each for each in reachable if each.attainable_after and not each.attainable_before]
    lost = [each for each in reachable if each.attainable_before and not each.attainable_after]
    return MaskingChanges(
        len(reachable),
        len(costly),
        None
        if worst is None
        else CostlyChange(
            worst.title or worst.style, worst.turn_before_deg, worst.turn_after_deg, worst.given_up
        ),
        max(moved, default=0.0),
        *(tuple(each.title or each.style for each in some) for some in (gained, lost)),
    )


def _change(before: StyleResult, after: StyleResult, objective: Objective) -> Change:
    curve = after.match_curve if objective == "picture" else after.quality_curve
    span = float(np.ptp(curve))
    loss = float(curve[after.turn_index] - curve[before.turn_index])
    return Change(
        style=before.name,
        title=before.title,
        turn_before_deg=before.turn_refined_deg,
        turn_after_deg=after.turn_refined_deg,
        change_deg=difference(after.turn_refined_deg, before.turn_refined_deg),
        # The new turn may be worse on this curve if its contrast was decisive.
        given_up=max(loss, 0.0) / span if span > 0.0 else 0.0,
        attainable_before=before.attainable,
        attainable_after=after.attainable,
    )
