"""What the answers would be under another light: turns chosen, and what a turn gives up.

The choice is that of `app.core.solver.solve`, for many lights at once and without refining the
turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.solver.peaks import best_index
from app.core.solver.reasons import EPSILON, MIN_STRENGTH
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import curves_of
from app.core.solver.solve import match_and_strength

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.solver.search import Curves
    from app.core.solver.solve import Objective
    from app.core.solver.style_pack import StylePack

Bool: TypeAlias = NDArray[np.bool_]
Float64: TypeAlias = NDArray[np.float64]
Int64: TypeAlias = NDArray[np.int64]

_AT_ONCE: Final = 16  # lights: few enough that their waves stay near the processor


@dataclass(frozen=True, slots=True)
class Choice:
    """What decides the turn of every style under one light, or under each of N.

    Attributes
    ----------
    curve : (S, 64) or (N, S, 64) float64
        The objective: match where the picture objective chooses, quality C where C does.
    allowed : (S, 64) or (N, S, 64) bool
        Turns that may be chosen: those of sufficient strength.
    """

    curve: Float64
    allowed: Bool

    def __getitem__(self, lights: int | slice) -> Choice:
        """Choose one or some of several lights."""
        return Choice(self.curve[lights], self.allowed[lights])

    @property
    def turns(self) -> Int64:
        """(S,) int64: the turn chosen for each style under one light, as the solver would."""
        return np.array(
            [best_index(c, a) for c, a in zip(self.curve, self.allowed, strict=True)], np.int64
        )


def choose(
    pack: StylePack, light: NDArray[np.floating[Any]], objective: Objective = "picture"
) -> Choice:
    """Find what decides the turns under a light.

    Parameters
    ----------
    light : (H, W, 3) or (H, W) float
        Environment at turn 0 in the pack's size, linear Rec. 709 radiance or luminance, any
        exposure.

    Raises
    ------
    EnvironmentFileError
        If the environment is black or not finite.
    """
    return choices(pack, [light], objective)[0]


def choices(
    pack: StylePack, lights: Sequence[NDArray[np.floating[Any]]], objective: Objective = "picture"
) -> Choice:
    """Find what decides the turns under each of several lights.

    Parameters
    ----------
    lights : sequence of (H, W, 3) or (H, W) float

    Raises
    ------
    EnvironmentFileError
        As `choose`.
    """
    parts = []
    for start in range(0, len(lights), _AT_ONCE):
        some = lights[start : start + _AT_ONCE]
        seen = [pack.seen(normalised(light, pack.header.environment)[0]) for light in some]
        parts.append(_choice(pack, curves_of(pack.tables, np.stack(seen)), objective))
    return Choice(
        np.concatenate([part.curve for part in parts]),
        np.concatenate([part.allowed for part in parts]),
    )


def _choice(pack: StylePack, found: Curves, objective: Objective) -> Choice:
    if objective == "paper":
        return Choice(found.quality, np.ones(found.quality.shape, bool))
    match, whole, strength = match_and_strength(pack, found)
    every_lamp, as_whole = strength >= MIN_STRENGTH, whole >= MIN_STRENGTH
    attainable = (every_lamp & (match >= EPSILON)).any(axis=-1, keepdims=True)
    allowed = np.where(attainable, every_lamp, as_whole)
    weak = ~allowed.any(axis=-1, keepdims=True)
    return Choice(np.where(weak, found.quality, match), allowed | weak)


def given_up(truth: Choice, turns: NDArray[np.integer[Any]]) -> Float64:
    """Share of what a place could give that is lost by turning elsewhere.

    Parameters
    ----------
    turns : (S,) int
        The turn taken for each style, 0..63.

    Returns
    -------
    (S,) or (N, S) float64
        (best value of the objective among the turns allowed, minus its value at the turn taken)
        over the range of the objective's curve; 0 to 1.
    """
    best = np.where(truth.allowed, truth.curve, -np.inf).max(axis=-1)
    taken = truth.curve[..., np.arange(len(turns)), turns]
    span = np.ptp(truth.curve, axis=-1)
    lost = (best - taken) / np.maximum(span, 1e-30)
    return np.asarray(np.clip(lost, 0.0, 1.0), np.float64)
