"""What the answers would be under another light: turns chosen, and what a turn gives up.

The turn is chosen by the rule of `app.core.solver.reach`, for many lights at once and without
refining it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.solver import reach
from app.core.solver.reach import LIMITS, Choice, Limits, Measured, Objective
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import curves_of
from app.core.solver.solve import measure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from app.core.base.arrays import Float64, Floats
    from app.core.solver.style_pack import StylePack


_AT_ONCE: Final = 16  # lights: few enough that their waves stay near the processor


def choose(
    pack: StylePack,
    light: Floats,
    objective: Objective = "picture",
    limits: Limits = LIMITS,
) -> Choice:
    """Find what decides the turns under a light; see `choices`."""
    return choices(pack, [light], objective, limits)[0]


def choices(
    pack: StylePack,
    lights: Sequence[Floats],
    objective: Objective = "picture",
    limits: Limits = LIMITS,
) -> Choice:
    """Find what decides the turns under each of several lights.

    Each is (H, W, 3) radiance or (H, W) luminance at turn 0 in the pack's size, linear Rec.
    709, any exposure. EnvironmentFileError if one is black or not finite.
    """
    parts = []
    for start in range(0, len(lights), _AT_ONCE):
        some = lights[start : start + _AT_ONCE]
        seen = [pack.seen(normalised(light, pack.header.environment)[0]) for light in some]
        parts.append(measure(pack, curves_of(pack.tables, np.stack(seen))))
    return reach.choose(
        Measured(
            np.concatenate([part.quality for part in parts]),
            np.concatenate([part.match for part in parts]),
            np.concatenate([part.whole for part in parts]),
            np.concatenate([part.strength for part in parts]),
        ),
        objective,
        limits,
    )


def given_up(truth: Choice, turns: NDArray[np.integer[Any]]) -> Float64:
    """Share of what a place could give that is lost by turning elsewhere, (S,) or (N, S).

    `turns`, (S,) in 0..63, is the turn taken for each style. The best value of the objective
    among the turns allowed, minus its value at the turn taken, over the range of the
    objective's curve; 0 to 1.
    """
    best = np.where(truth.allowed, truth.curve, -np.inf).max(axis=-1)
    taken = truth.curve[..., np.arange(len(turns)), turns]
    span = np.ptp(truth.curve, axis=-1)
    lost = (best - taken) / np.maximum(span, 1e-30)
    return np.asarray(np.clip(lost, 0.0, 1.0), np.float64)
