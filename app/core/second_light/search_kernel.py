"""Search all combinations of turn and lamp placement, for several styles at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from app.core.base.angles import TURNS, wrap
from app.core.base.arrays import Bools, Float64, Floats
from app.core.base.errors import CoreError
from app.core.second_light.contrast import (
    Norms,
    norms,
)
from app.core.second_light.lamp_spot import LampSpot, best_spot, refine
from app.core.second_light.lamp_tables import (
    LampTables,
    SearchPlace,
    lamp_alone,
    left_everywhere,
)
from app.core.second_light.placements import COUNT
from app.core.solver.peaks import Gate, find_peak
from app.core.solver.style_signature import Signatures, stops_of
from app.core.solver.turn_choice import LIMITS, Limits, Objective, StyleMeasures, choose
from app.core.text import tr


@dataclass(frozen=True, slots=True)
class BestSpot:
    """The best combination of turn and placement for one style."""

    row: int
    spot: LampSpot
    # from the spot to the maximum between the places of the grid: turn, azimuth, altitude, in steps
    moves: tuple[float, float, float]
    # (576,), objective at that turn: match, 0 to 100, or quality in the unit of the place's light
    values: Float64 = field(repr=False)
    power: float = 1.0


def seek(
    tables: LampTables,
    place: SearchPlace,
    rows: Sequence[int],
    objective: Objective = "picture",
    limits: Limits = LIMITS,
    is_open: Bools | None = None,
    powers: Sequence[float] = (1.0,),
    *,
    turn: int | None = None,
) -> tuple[BestSpot, ...]:
    """Evaluate every combination for the styles at `rows` and choose the best one for each style.

    Args:
        is_open: (576,) bool. Placements within reach.
        powers: Powers of the lamp to try, as fractions of full power.
        turn: Index of the only turn to evaluate, or None for all turns.

    Raises:
        CoreError: If no placement is within reach.
    """
    if is_open is not None and not is_open.any():
        raise CoreError(
            tr("The lamp cannot be held anywhere within reach."), tr("Move the lamp closer.")
        )
    turns = TURNS if turn is None else 1
    open_ = np.broadcast_to(True if is_open is None else is_open, (turns, COUNT))
    if objective == "paper":
        quality = left_everywhere(tables, place, rows, turn)
        quality += powers[0] * lamp_alone(tables, place, rows)[:, None]
        answers = [
            _best_spot(row, values, open_, powers[0], everywhere=is_open is None)
            for row, values in zip(rows, quality, strict=True)
        ]
        return _count_answers(answers, turn)
    parts = _Parts.of(tables, place, rows, turn)
    best: dict[int, tuple[tuple[int, float], BestSpot]] = {}
    for power in powers:
        sight = parts.at(power)
        for row in rows:
            merit, spot = _choose(sight, row, limits, open_)
            if row not in best or merit > best[row][0]:
                best[row] = merit, spot
    return _count_answers([best[row][1] for row in rows], turn)


def _count_answers(answers: list[BestSpot], turn: int | None) -> tuple[BestSpot, ...]:
    """Restore the turn index if only one turn was evaluated, since it is then in the first row."""
    if turn is None:
        return tuple(answers)
    return tuple(replace(one, spot=LampSpot(turn, one.spot.number)) for one in answers)


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    """Everything needed for the match and the strength, for any power of the lamp."""

    tables: LampTables
    where: dict[int, int]
    remainder: Floats
    alone: Float64
    contrast: Norms

    @classmethod
    def of(
        cls, tables: LampTables, place: SearchPlace, rows: Sequence[int], turn: int | None
    ) -> _Parts:
        """Evaluate the given styles over the face, and the mean and areas of the face."""
        lamp_light = tables.lamp_light
        # Without a signature a style may be chosen by its quality (see `choose`).
        plain = [row for row in rows if not tables.pack.styles[row].signature.relations]
        faces = [tables.face(row) for row in rows]
        columns = [*plain, *faces, tables.count, *tables.areas]
        return cls(
            tables=tables,
            where={row: position for position, row in enumerate(columns)},
            remainder=left_everywhere(tables, place, columns, turn),
            alone=lamp_alone(tables, place, columns),
            contrast=norms(lamp_light.contrast, lamp_light.hidden, place.light, place.scale, turn),
        )

    def at(self, power: float) -> _Sight:
        """Evaluate the face with the lamp at a given power."""
        contrast = self.contrast.at(power)
        # A face without any contrast matches nothing.
        contrast[contrast <= 1e-12 * contrast.max()] = np.inf
        sight = _Sight(self, power, contrast, contrast)
        mean = np.maximum(sight.value(self.tables.count), 1e-30)
        return replace(sight, mean=mean)


@dataclass(frozen=True, eq=False)
class _Sight:
    """The contrast and mean of the face for every combination, with the lamp at one power."""

    parts: _Parts
    power: float
    contrast: Float64
    mean: Float64

    def value(self, row: int) -> Float64:
        """Return the values in a row of `LampTables`, (64 or 1, 576)."""
        position = self.parts.where[row]
        return np.asarray(self.parts.remainder[position] + self.power * self.parts.alone[position])

    @property
    def areas(self) -> Float64:
        """The means of all areas, (A, n)."""
        return np.stack([self.value(row).ravel() for row in self.parts.tables.areas])

    @cached_property
    def stops(self) -> Float64:
        """The means of all areas in stops, (A, n)."""
        return stops_of(self.areas)


def _choose(
    sight: _Sight, row: int, limits: Limits, open_: Bools
) -> tuple[tuple[int, float], BestSpot]:
    """Choose among all combinations by the rule for turns (`app.core.solver.turn_choice`).

    Returns:
        The grade and the match, by which powers are compared, and the best combination.
    """
    pack = sight.parts.tables.pack
    product = sight.value(sight.parts.tables.face(row))
    match = product * (100.0 / float(pack.weight_norm[row])) / sight.contrast
    strength = product * (100.0 / float(pack.studio_ratio[row])) / sight.mean
    signature = Signatures((pack.styles[row].signature,))
    if signature.styles[0].areas:
        signature.take_areas(sight.areas, match.reshape(1, -1), strength.reshape(1, -1))
    yes, soft = signature.slack(sight.stops, match.reshape(1, -1))
    quality = product if signature.styles[0].relations else sight.value(row)
    at = quality.ravel(), match.ravel(), strength.ravel()
    # `refine` works on the match itself.
    measured = StyleMeasures(*at, yes[0], soft[0], np.ones(match.size))
    choice = choose(measured, "picture", limits, open_.ravel())
    gate = None if choice.guard is None else choice.gate.reshape(match.shape)
    curve, eligible = choice.curve.reshape(match.shape), choice.eligible.reshape(match.shape)
    best = best_spot(curve, eligible)
    merit = int(choice.grade), float(match[best.turn, best.number])
    if len(curve) == 1:
        candidate = _best_spot(row, curve, eligible, sight.power, gate=gate)
    else:
        spot, aside = _offer(curve, best, float(choice.price), gate)
        one_turn = None if gate is None else gate[[spot.turn]]
        still = LampSpot(0, spot.number)
        moves = refine(curve[[spot.turn]], still, eligible[[spot.turn]], one_turn)
        candidate = BestSpot(row, spot, (aside, *moves[1:]), curve[spot.turn], sight.power)
    return merit, replace(candidate, values=match[candidate.spot.turn].copy())


def _offer(
    curve: Float64, best: LampSpot, price: float, gate: Float64 | None
) -> tuple[LampSpot, float]:
    """Return the turn to offer at the best placement, by the same rule as without a lamp.

    Returns:
        The spot on the grid, and the offset of the refined turn from this spot, in steps.
    """
    guard = None if gate is None else Gate(gate[:, best.number], 0.0)
    peak = find_peak(curve[:, best.number], best.turn, guard, price=price)
    aside = wrap(peak.refined_deg - peak.turn_deg) * TURNS / 360.0
    return LampSpot(peak.index, best.number), aside


def _best_spot(
    row: int,
    values: Float64,
    eligible: Bools,
    power: float,
    *,
    gate: Float64 | None = None,
    everywhere: bool = False,
) -> BestSpot:
    spot = best_spot(values, None if everywhere else eligible)
    moves = refine(values, spot, eligible, gate)
    return BestSpot(row, spot, moves, values[spot.turn].copy(), power)
