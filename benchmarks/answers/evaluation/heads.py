"""Dependence of the best turn on the head and the skin."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.solver.solve import solve_all

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.core.solver.style_result import StyleResult
    from app.core.solver.turn_choice import Objective
    from app.core.styles.style_pack import StylePack
    from benchmarks.answers.evaluation.differences import Best

Float64: TypeAlias = NDArray[np.float64]
Floats: TypeAlias = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Answers of one head for every scene and style.

    Attributes:
        curves: (P, S, 64) float64. The objective for P scenes and S styles.
        index: (P, S) int. Grid turn offered.
        refined_deg: (P, S) float64. Refined turn, deg.
        attainable: (P, S) bool.
    """

    curves: Float64 = field(repr=False)
    index: NDArray[np.intp] = field(repr=False)
    refined_deg: Float64 = field(repr=False)
    attainable: NDArray[np.bool_] = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Best turns of several heads compared with those of the generic one.

    Attributes:
        degrees: (V, P, S) float64. Angle between each head's refined turn and the generic head's,
            deg in [0, 180].
        regret: (V, P, S) float64. Loss of the generic head's turn on that head, relative to the
            largest value there.
        counted: (P, S) bool. Pairs that are attainable on the generic head: only there is the turn
            reliable.
    """

    names: tuple[str, ...]
    degrees: Float64 = field(repr=False)
    regret: Float64 = field(repr=False)
    counted: NDArray[np.bool_] = field(repr=False)

    @property
    def mean(self) -> float:
        """Mean over heads and attainable pairs, deg; 0 if there are none."""
        return _mean(self.degrees[:, self.counted])

    @property
    def mean_of_all(self) -> float:
        """Mean over heads and all pairs, deg."""
        return _mean(self.degrees)

    @property
    def by_style(self) -> Float64:
        """Mean over heads and the scenes where a style is attainable, (S,) deg; NaN if none."""
        kept = np.where(self.counted, self.degrees.mean(axis=0), 0.0).sum(axis=0)
        count = self.counted.sum(axis=0)
        result: Float64 = np.where(count > 0, kept / np.maximum(count, 1), np.nan)
        return result


def solved(
    pack: StylePack, lights: Sequence[Floats], objective: Objective, styles: Sequence[str]
) -> tuple[tuple[StyleResult, ...], ...]:
    """Return the answers of a head for every scene.

    Args:
        lights: sequence of (H, W, 3) float. Environments at turn 0 in the pack's size.
    """
    return tuple(solve_all(pack, light, objective, styles=styles) for light in lights)


def from_results(results: Sequence[Sequence[StyleResult]]) -> Answers:
    """Collect the app's own answers, by match."""
    return Answers(
        curves=np.array([[one.match_curve for one in row] for row in results]),
        index=np.array([[one.turn_index for one in row] for row in results], np.intp),
        refined_deg=np.array([[one.turn_refined_deg for one in row] for row in results]),
        attainable=np.array([[one.attainable for one in row] for row in results], bool),
    )


def from_best(best: Best, scenes: int, attainable: NDArray[np.bool_]) -> Answers:
    """Collect the best turns of a table of F; pairs go scene by scene."""
    return Answers(
        curves=best.curves.reshape(scenes, -1, best.curves.shape[1]),
        index=best.index.reshape(scenes, -1),
        refined_deg=best.refined_deg.reshape(scenes, -1),
        attainable=attainable,
    )


def spread(generic: Answers, others: Mapping[str, Answers]) -> Spread:
    """Compare the answers of several heads with those of the generic one."""
    degrees, regret = [], []
    for other in others.values():
        turned = other.refined_deg - generic.refined_deg
        degrees.append(np.abs((turned + 180.0) % 360.0 - 180.0))
        own = np.take_along_axis(other.curves, other.index[..., None], axis=2)[..., 0]
        given = np.take_along_axis(other.curves, generic.index[..., None], axis=2)[..., 0]
        largest = np.maximum(np.abs(other.curves).max(axis=2), 1e-30)
        regret.append(np.maximum(own - given, 0.0) / largest)
    return Spread(tuple(others), np.array(degrees), np.array(regret), generic.attainable)


def _mean(values: Float64) -> float:
    return float(values.mean()) if values.size else 0.0
