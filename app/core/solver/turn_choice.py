"""The rule for choosing the turn for a style and for deciding whether the style is within reach.

The picture objective ranks grade above match. It takes the best match among the turns whose
pictures have the style's signature (`app.core.solver.style_signature`). If there are no such turns,
it takes the best match among those whose pictures show it softly, and otherwise among
all turns. A style is within reach if its grade at the offered turn is yes or soft.

The offered turn is not the maximum itself but is nearer to the middle of its tolerance arc, so that
the style survives small errors by the sitter (see `app.core.solver.peaks.find_peak`).

The paper's objective offers exactly the turn with the largest C (eq. 5).

Painted styles have no signature. For them, the rule takes the best match among the turns whose
strength reaches its limit, or the largest C if there are no such turns. A painted style is within
reach if the match and the strength at the offered turn both reach their limits.

Results, the clip audit, painting and the second light all use this rule.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.arrays import Bools, Float64, Int64
from app.core.solver.peaks import ARC_SHARE, Gate, Peak, best_indices, find_peak, find_peaks
from app.core.solver.shortfall import Cause, LightShortfall, Origin
from app.core.solver.style_signature import NO, SOFT, YES, grades

_PRICE_SHARE: Final = ARC_SHARE / 3  # fraction of the largest quality, if quality decides

Objective: TypeAlias = Literal["picture", "paper"]

OBJECTIVES: Final[tuple[Objective, ...]] = ("picture", "paper")


@dataclass(frozen=True, slots=True)
class Limits:
    """The minimum match and strength of a style within reach, 0 to 100, and the paper's minimum C.

    Attributes:
        match, strength: Limits for styles without a signature, such as painted styles. The limit of
            the match is the paper's value, converted to the scale of the match. If the limit of the
            strength is 0, the rule takes the best match of all turns.
        quality: Limit for the paper's rule. A style is within reach if the largest C is at least
            this value, on the scale of `app.core.solver.solve.quality_scale`.
    """

    match: float = 45.0
    strength: float = 20.0
    quality: float = 45.0

    def are_met(self, match: float, strength: float) -> bool:
        """Return whether a style with this match and strength at a turn is within reach."""
        return match >= self.match and strength >= self.strength

    def miss(
        self,
        cause: Cause,
        match: float,
        strength: float,
        origin: Origin | None = None,
        *,
        weak: bool,
    ) -> LightShortfall:
        """Return the shortfall for a cause, in contrast if `weak` is set, otherwise in match."""
        if weak:
            return LightShortfall(cause, "contrast", strength, self.strength, origin)
        return LightShortfall(cause, "match", match, self.match, origin)


PRICE: Final = 1.0
"""Largest loss in points of match that is accepted to move towards the middle of the arc."""

LIMITS: Final = Limits()
"""The default limits."""


@dataclass(frozen=True, slots=True)
class StyleMeasures:
    """Curves for styles at every turn, independent of exposure, with any number of leading axes.

    Attributes:
        quality: (..., n) float64. C of eq. 5, over the whole head.
        match: (..., n) float64. Correlation of picture and target over the face, times 100.
        strength: (..., n) float64. Depth of the pattern, as a percentage of that of the target.
        yes, soft: (..., n) float64. Distance of a picture inside the limits of the grade, in
            stops, or NaN for a style without a signature. `yes` takes rival styles into account.
        contrast: (..., n) float64. The contrast used in the match, or 1 if the match is not
            computed over the face.
    """

    quality: Float64
    match: Float64
    strength: Float64
    yes: Float64
    soft: Float64
    contrast: Float64

    def __getitem__(self, lights: int | slice) -> StyleMeasures:
        """Select one or several lights along the first axis."""
        return StyleMeasures(*(getattr(self, each.name)[lights] for each in fields(self)))


@dataclass(frozen=True, slots=True)
class Choice:
    """The permitted turns for each style, and the curve to maximise.

    Attributes:
        curve: (..., n) float64. The objective, which is the match or the quality C.
        gate: (..., n) float64. Condition that must be at least 0 at the chosen turn, or infinity if
            there is no condition.
        eligible: (..., n) bool. Turns of the best grade.
        grade: (...) int64. Grade of these turns by the picture objective: `NO`, `SOFT` or `YES`.
        contrast: (..., n) float64. Divisor of the curve (see `find_peak`).
        price: (...) float64. Permitted cost of a turn nearer to the middle of its arc (see
            `find_peak`), or 0 if only the maximum itself may be offered.
        is_open: (..., n) bool. Permitted turns, regardless of their grade.
    """

    measured: StyleMeasures
    limits: Limits
    curve: Float64
    gate: Float64
    eligible: Bools
    grade: Int64
    contrast: Float64
    price: Float64
    is_open: Bools

    def __getitem__(self, lights: int | slice) -> Choice:
        """Select one or several lights along the first axis."""
        return Choice(
            self.measured[lights],
            self.limits,
            self.curve[lights],
            self.gate[lights],
            self.eligible[lights],
            self.grade[lights],
            self.contrast[lights],
            self.price[lights],
            self.is_open[lights],
        )

    @property
    def turns(self) -> Int64:
        """The best grid turn for each style, (...)."""
        return best_indices(self.curve, self.eligible)

    @property
    def best(self) -> Int64:
        """The best grid turn, (...), for any leading axes. Of tied turns, the first is used."""
        return np.asarray(np.where(self.eligible, self.curve, -np.inf).argmax(axis=-1))

    @property
    def in_reach(self) -> Bools:
        """Whether each style is within reach, (...)."""
        return grade_at(self.measured, self.limits, self.best) > NO

    @property
    def offer(self) -> Int64:
        """The grid turn offered for each style, (S,), for (S, 64) curves."""
        best = self.turns.tolist()
        return np.array([self[row].peak(at).index for row, at in enumerate(best)], np.int64)

    def peak(self, index: int) -> Peak:
        """Return the turn offered for one style, given (64,) curves and the best grid turn."""
        return find_peak(
            self.curve,
            index,
            self.guard,
            self.contrast,
            price=float(self.price),
            is_open=self.is_open,
        )

    def peaks(self, index: int) -> tuple[Peak, ...]:
        """Return the turn offered for one style and the other maxima, for (64,) curves.

        Args:
            index: Best grid turn.
        """
        return find_peaks(
            self.curve,
            index,
            self.guard,
            self.contrast,
            price=float(self.price),
            is_open=self.is_open,
        )

    @property
    def guard(self) -> Gate | None:
        """The gate for one style, or None if there is no condition."""
        return None if np.isinf(self.gate).any() else Gate(self.gate, 0.0)


def grade_at(measured: StyleMeasures, limits: Limits, turns: Int64 | int) -> Int64:
    """Return the grades of pictures at the given turns, (...) int64: `NO`, `SOFT` or `YES`.

    Without a signature, the grade is `YES` if the match and the strength both reach their limits.
    """
    at = np.asarray(turns)[..., None]
    match, strength, yes, soft = (
        np.take_along_axis(curve, at, axis=-1)[..., 0]
        for curve in (measured.match, measured.strength, measured.yes, measured.soft)
    )
    plain = np.minimum(match - limits.match, strength - limits.strength)
    yes = np.where(np.isnan(yes), plain, yes)
    soft = np.where(np.isnan(soft), plain, soft)
    return np.asarray(grades(yes, soft), np.int64)


def choose(
    measured: StyleMeasures,
    objective: Objective = "picture",
    limits: Limits = LIMITS,
    is_open: Bools | None = None,
) -> Choice:
    """Apply the rule to each style's curves.

    Args:
        is_open: (n,) bool. Permitted turns. By default, all turns are permitted.
    """
    shape = measured.match.shape
    free = np.broadcast_to(True if is_open is None else is_open, shape)
    if objective == "paper":
        gate, grade = np.broadcast_to(np.inf, shape), np.zeros(shape[:-1], np.int64)
        one = np.broadcast_to(1.0, shape)
        none = np.zeros(shape[:-1])
        return Choice(measured, limits, measured.quality, gate, free, grade, one, none, free)
    painted = np.isnan(measured.yes)
    least = limits.strength if limits.strength > 0 else -np.inf
    depth = measured.strength - least
    yes = np.where(painted, np.minimum(depth, measured.match - limits.match), measured.yes)
    soft = np.where(painted, depth, measured.soft)
    is_yes, is_soft = free & (yes >= 0), free & (soft >= 0)
    some_yes, some = (each.any(axis=-1, keepdims=True) for each in (is_yes, is_soft))
    # Painted styles are chosen by match wherever their strength is sufficient.
    some_yes = some_yes & ~painted
    eligible = np.where(some_yes, is_yes, np.where(some, is_soft, free))
    # Values far from 0 would cause ripples in the interpolation between turns.
    most = np.where(painted, 100.0, 1.0)
    gate = np.clip(np.where(some_yes, yes, soft), -most, most)
    gate = np.where(some, gate, np.inf)
    by_quality = painted & ~some
    curve = np.where(by_quality, measured.quality, measured.match)
    grade = np.where(some_yes, YES, np.where(some, SOFT, NO))[..., 0].astype(np.int64)
    contrast = np.where(by_quality, 1.0, measured.contrast)
    price = np.where(by_quality[..., 0], _PRICE_SHARE * np.abs(curve).max(axis=-1), PRICE)
    return Choice(measured, limits, curve, gate, eligible, grade, contrast, price, free)
