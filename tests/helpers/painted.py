"""The best turn for painted weights under one light, without a table that is kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from app.core.solver.relighting_cache import light_table
from app.core.solver.solve import solve_on_table
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS, Limits, Objective

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from app.core.solver.transport import Transport
    from app.core.solver.weights import PaintedWeights


def solve_painted(
    transport: Transport,
    weights: PaintedWeights,
    light: NDArray[np.floating[Any]],
    objective: Objective = "picture",
    *,
    limits: Limits = LIMITS,
) -> StyleResult:
    """Find the best turn for painted weights."""
    return solve_on_table(
        light_table(transport, light),
        weights,
        objective,
        limits=limits,
    )
