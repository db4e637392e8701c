"""The match that turns chosen under one light lose under others."""

from __future__ import annotations

import numpy as np

from app.core.base.arrays import Float64
from app.core.solver.turn_choice import Choice


def lost_match(choice: Choice) -> Float64:
    """Return the points of match that the turns offered under the first light lose in the others.

    Args:
        choice: Choice under two or more lights.

    Returns:
        (N - 1, S) float64. Losses by light and style, negative if a turn has more match than the
        best turn of a better grade.
    """
    match, rows = choice.measured.match[1:], np.arange(choice.measured.match.shape[1])
    best = np.take_along_axis(match, choice.best[1:, :, None], axis=-1)[..., 0]
    return np.asarray(best - match[:, rows, choice[0].offer])
