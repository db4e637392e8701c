"""Measure how far the best turn moves after a change, and the cost of that move.

If two turns far apart are nearly equally good, the smallest change makes the best one jump from one
to the other, and the angle is meaningless. Such pairs are counted separately, by regret: the share
of the reference's optimum that the other turn gives up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.solver.peaks import best_index, find_peak

Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

TIED: Final = 0.01
"""Peaks whose quality differs by less than this share of the larger are nearly equal."""


@dataclass(frozen=True, slots=True)
class Best:
    """Best turns of many (scene, style) pairs.

    Attributes:
        curves: (N, 64) float64. The objective at turns of 5.625 k deg.
        index: (N,) int. Grid turn of each.
        refined_deg: (N,) float64. Between the turns of the grid, deg.
        width_deg: (N,) float64. Width of the tolerance arc around it, deg; 360 if nothing is lost
            anywhere.
    """

    curves: Float64
    index: NDArray[np.intp]
    refined_deg: Float64
    width_deg: Float64


@dataclass(frozen=True, slots=True)
class Change:
    """Changes of the best turns of many (scene, style) pairs.

    Attributes:
        degrees: (N,) float64. Angle between the grid turns, deg in [0, 180].
        refined: (N,) float64. Angle between the refined turns.
        regret: (N,) float64. Loss of the reference's curve at the other grid turn, relative to its
            largest value.
        regret_of_range: (N,) float64. The same as a share of the curve's range.
        tied: (N,) bool. Pairs whose two best peaks are nearly equal in the reference.
    """

    degrees: Float64
    refined: Float64
    regret: Float64
    regret_of_range: Float64
    tied: Mask

    @property
    def mean(self) -> float:
        """Mean angle of the pairs that are not tied, deg; 0 if there is none."""
        clear = self.degrees[~self.tied]
        return float(clear.mean()) if clear.size else 0.0

    @property
    def mean_refined(self) -> float:
        """Mean refined angle of the pairs that are not tied, deg; 0 if there is none."""
        clear = self.refined[~self.tied]
        return float(clear.mean()) if clear.size else 0.0

    @property
    def mean_regret(self) -> float:
        """Mean regret over all pairs, the larger of both measures."""
        return max(float(self.regret.mean()), float(self.regret_of_range.mean()))


def best_turns(curves: Float64) -> Best:
    """Find the best turn of every curve (64 turns, any turn allowed).

    Args:
        curves: (N, 64) float64. The objective at turns of 5.625 k deg.
    """
    anywhere = np.ones(TURNS, bool)
    peaks = [find_peak(curve, best_index(curve, anywhere)) for curve in curves]
    return Best(
        curves=curves,
        index=np.array([peak.index for peak in peaks], np.intp),
        refined_deg=np.array([peak.refined_deg for peak in peaks]),
        width_deg=np.array([_width(peak.arc_deg) for peak in peaks]),
    )


def change(reference: Best, other: Best) -> Change:
    """Compare best turns with those of a reference, pair by pair."""
    row = np.arange(len(reference.index))
    top = reference.curves[row, reference.index]
    lost = top - reference.curves[row, other.index]
    size = np.maximum(np.abs(reference.curves).max(axis=1), 1e-30)
    return Change(
        degrees=_apart((other.index - reference.index) * (360.0 / TURNS)),
        refined=_apart(other.refined_deg - reference.refined_deg),
        regret=lost / np.where(top > 0, np.maximum(top, 1e-30), size),
        regret_of_range=lost / np.maximum(np.ptp(reference.curves, axis=1), 1e-30 * size),
        tied=np.array([has_rival(curve) for curve in reference.curves]),
    )


def has_rival(curve: Float64, share: float = TIED) -> bool:
    """Return whether the second-best local maximum comes within a share of the best.

    Args:
        curve: (64,) float64. The objective at the grid turns.

    Examples:
        >>> t = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        >>> has_rival(np.cos(2 * t)), has_rival(np.cos(t))
        (True, False)
    """
    before, after = np.roll(curve, 1), np.roll(curve, -1)
    tops = np.sort(curve[(curve > before) & (curve >= after)])
    return bool(tops.size > 1 and tops[-1] - tops[-2] <= share * abs(tops[-1]))


def _apart(degrees: NDArray[np.floating[Any]]) -> Float64:
    """Return the size of angles, deg in [0, 180]."""
    wrapped: Float64 = np.abs((np.asarray(degrees, np.float64) + 180.0) % 360.0 - 180.0)
    return wrapped


def _width(arc: tuple[float, float]) -> float:
    if arc == (-180.0, 180.0):
        return 360.0
    return (arc[1] - arc[0]) % 360.0
