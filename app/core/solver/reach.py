"""The one rule: which turn a place offers for a style, and whether the style is in reach there.

By the picture objective the best match counts, among the turns at which every lamp of the style
shows: where its strength reaches the limit. Where none of these reaches the limit of match, the
style is out of reach, and the turn that comes nearest is offered: the best match among the turns
at which the pattern as a whole is strong enough, or, where there is none, the largest quality C.
The paper's objective takes the largest C of all turns (eq. 5).

A style is in reach where match and strength at the turn offered reach their limits.

Answers, the clip audit, painting and the second light all ask here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.solver.peaks import Gate, best_index

Bool: TypeAlias = NDArray[np.bool_]
Float64: TypeAlias = NDArray[np.float64]
Int64: TypeAlias = NDArray[np.int64]
Objective: TypeAlias = Literal["picture", "paper"]

OBJECTIVES: Final[tuple[Objective, ...]] = ("picture", "paper")


@dataclass(frozen=True, slots=True)
class Limits:
    """Least match and strength of a style in reach, of 100.

    The match is the paper's value, read on the scale of match. A strength of 0 asks for none: then
    the best match of all turns is taken.
    """

    match: float = 45.0
    strength: float = 20.0

    def met(self, match: float, strength: float) -> bool:
        """Whether a style is in reach at a turn of this match and strength."""
        return match >= self.match and strength >= self.strength


LIMITS: Final = Limits()
"""What is asked where nobody asked for anything else."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Curves of styles at all turns, free of exposure; any axes in front.

    Attributes
    ----------
    quality : (..., n) float64
        C of eq. 5.
    match : (..., n) float64
        100 x correlation of picture and target.
    whole : (..., n) float64
        Strength of the pattern as a whole, of 100.
    strength : (..., n) float64
        The same, but no stronger than the weakest of the style's lamps.
    """

    quality: Float64
    match: Float64
    whole: Float64
    strength: Float64

    def __getitem__(self, lights: int | slice) -> Measured:
        """Take one or some along the first axis."""
        return Measured(
            self.quality[lights], self.match[lights], self.whole[lights], self.strength[lights]
        )


@dataclass(frozen=True, slots=True)
class Choice:
    """Which turns may be chosen, and what is largest at the one that is.

    Attributes
    ----------
    curve : (..., n) float64
        The objective: match where the picture objective chooses, quality C where C does.
    gate : (..., n) float64
        The strength that must reach its limit at the turn chosen; infinite where none is asked.
    allowed : (..., n) bool
        Turns that may be chosen.
    tier : (...) int64
        How far the rule got: 2 with all the strength that is asked, 1 with that of the pattern as
        a whole, 0 by quality.
    """

    measured: Measured
    limits: Limits
    curve: Float64
    gate: Float64
    allowed: Bool
    tier: Int64

    def __getitem__(self, lights: int | slice) -> Choice:
        """Take one or some along the first axis."""
        return Choice(
            self.measured[lights],
            self.limits,
            self.curve[lights],
            self.gate[lights],
            self.allowed[lights],
            self.tier[lights],
        )

    @property
    def turns(self) -> Int64:
        """(S,) turn that is chosen for each style, of (S, 64) curves."""
        return np.array(
            [best_index(c, a) for c, a in zip(self.curve, self.allowed, strict=True)], np.int64
        )

    @property
    def best(self) -> Int64:
        """(...) the same for any axes, where ties do not matter."""
        return np.asarray(np.where(self.allowed, self.curve, -np.inf).argmax(axis=-1))

    @property
    def in_reach(self) -> Bool:
        """(...) whether each style is in reach."""
        at = self.best[..., None]
        match = np.take_along_axis(self.measured.match, at, axis=-1)[..., 0]
        strength = np.take_along_axis(self.measured.strength, at, axis=-1)[..., 0]
        return (match >= self.limits.match) & (strength >= self.limits.strength)

    @property
    def guard(self) -> Gate | None:
        """The gate of one style, None where no strength is asked."""
        return None if np.isinf(self.gate).any() else Gate(self.gate, self.limits.strength)


def choose(
    measured: Measured,
    objective: Objective = "picture",
    limits: Limits = LIMITS,
    is_open: Bool | None = None,
) -> Choice:
    """Apply the rule to each style's curves.

    Parameters
    ----------
    is_open : (n,) bool, optional
        Which of the n may be chosen at all; all by default.
    """
    shape = measured.match.shape
    free = np.broadcast_to(True if is_open is None else is_open, shape)
    if objective == "paper" or limits.strength <= 0:
        curve = measured.quality if objective == "paper" else measured.match
        gate, tier = np.broadcast_to(np.inf, shape), np.full(shape[:-1], 2)
        return Choice(measured, limits, curve, gate, free, tier)
    every_lamp = free & (measured.strength >= limits.strength)
    reached = (every_lamp & (measured.match >= limits.match)).any(axis=-1, keepdims=True)
    gate = np.where(reached, measured.strength, measured.whole)
    allowed = free & (gate >= limits.strength)
    some = allowed.any(axis=-1, keepdims=True)
    tier = np.where(reached, 2, np.where(some, 1, 0))[..., 0]
    if some.all():
        return Choice(measured, limits, measured.match, gate, allowed, tier)
    return Choice(
        measured,
        limits,
        np.where(some, measured.match, measured.quality),
        np.where(some, gate, np.inf),
        np.where(some, allowed, free),
        tier,
    )
