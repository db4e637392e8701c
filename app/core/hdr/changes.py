"""What a change of the light means for the answers: every turn before and after.

Used for masks (with and without the tripod), and good for any two environments of one place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.angles import difference
from app.core.solver.solve import StyleResult, solve_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Floats
    from app.core.solver.reach import Objective
    from app.core.solver.style_pack import StylePack

_SAME_DEG: Final = 0.5
_FREE: Final = 0.01  # of a curve's range: what a turn may cost before it is called a change


@dataclass(frozen=True, slots=True)
class Change:
    """What happens to a style's answer.

    Turns are refined, degrees in (-180, 180], positive clockwise; `change_deg` is the shorter
    way from before to after. `given_up` is what the turn before loses under the light after:
    the objective's maximum minus its value there, as a share of the range of the curve over all
    turns, 0 to 1.
    """

    style: str
    title: str
    turn_before_deg: float
    turn_after_deg: float
    change_deg: float
    given_up: float
    match_before: float
    match_after: float
    attainable_before: bool
    attainable_after: bool


def changes(
    before: Floats,
    after: Floats,
    pack: StylePack,
    objective: Objective = "picture",
) -> tuple[Change, ...]:
    """Solve for all styles under two lights and compare.

    Both are (H, W, 3) at turn 0 in the pack's size, linear Rec. 709 radiance, any exposure.
    EnvironmentFileError when one is black, not finite or of another size.
    """
    old = solve_all(pack, before, objective)
    new = solve_all(pack, after, objective)
    return tuple(_change(a, b, objective) for a, b in zip(old, new, strict=True))


def sentence(found: Sequence[Change], what: str = "what is masked") -> str:
    """Say in one or two sentences what changes.

    Only styles that the place can give, before or after, are spoken of. A turn that moved
    between two places which the new light finds equally good (within 1 % of the curve's range)
    counts as unchanged, and is mentioned.
    """
    lead = f"Without {what}"
    seen = [each for each in found if each.attainable_before or each.attainable_after]
    if not seen:
        return f"{lead}, as with it, no style is within reach."
    costly = [each for each in seen if each.given_up > _FREE]
    free = [each for each in seen if each.given_up <= _FREE]
    most = max((abs(each.change_deg) for each in free), default=0.0)
    words = [_costly_words(lead, costly, len(seen))] if costly else [_free_words(lead, most)]
    if not costly and most > 10.0:
        words[0] = f"{lead} no turn gets worse."
        words.append(
            f"Turns move by up to {most:.0f} degrees, but the old ones are as good within 1 %."
        )
    for reached, what_now in ((True, "Now within reach"), (False, "No longer within reach")):
        moved = [each for each in seen if each.attainable_before != each.attainable_after]
        names = [each.title or each.style for each in moved if each.attainable_after is reached]
        if names:
            words.append(f"{what_now}: {', '.join(names)}.")
    return " ".join(words)


def _free_words(lead: str, most: float) -> str:
    if most < _SAME_DEG:
        return f"{lead} no turn changes."
    whole = math.ceil(most)
    return f"{lead} no turn changes by more than {whole} degree{'' if whole == 1 else 's'}."


def _costly_words(lead: str, costly: Sequence[Change], count: int) -> str:
    worst = max(costly, key=lambda each: each.given_up)
    name = worst.title or worst.style
    verb = "changes" if len(costly) == 1 else "change"
    return (
        f"{lead} {len(costly)} of {count} turns {verb}, most of all {name}: "
        f"from {worst.turn_before_deg:.0f}° to {worst.turn_after_deg:.0f}°; "
        f"the old turn would give up {100.0 * worst.given_up:.0f} % of its range."
    )


def _change(before: StyleResult, after: StyleResult, objective: Objective) -> Change:
    curve = after.match_curve if objective == "picture" else after.quality_curve
    span = float(np.ptp(curve))
    lost = float(curve[after.turn_index] - curve[before.turn_index])
    return Change(
        style=before.name,
        title=before.title,
        turn_before_deg=before.turn_refined_deg,
        turn_after_deg=after.turn_refined_deg,
        change_deg=difference(after.turn_refined_deg, before.turn_refined_deg),
        # The new turn may be the lesser one on this curve, where its strength decided.
        given_up=max(lost, 0.0) / span if span > 0.0 else 0.0,
        match_before=before.match,
        match_after=after.match,
        attainable_before=before.attainable,
        attainable_after=after.attainable,
    )
