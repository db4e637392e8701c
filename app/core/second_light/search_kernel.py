"""The search itself: all combinations of a turn and a placement, for some styles at once.

The styles and the lamp are transformed once, so that any place is searched in milliseconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS, wrap
from app.core.base.arrays import Bools, Float32, Float64, Floats, Indices
from app.core.base.errors import CoreError, TransportError
from app.core.environment.environment import SHAPE
from app.core.second_light.added_light import AddedLight
from app.core.second_light.contrast import (
    Norms,
    correlate,
    correlate_at,
    hidden_tables,
    norms,
    two_parts,
)
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.solver.face import AREAS
from app.core.solver.peaks import TIE, Gate, find_peak
from app.core.solver.search import curves, quality_curves
from app.core.solver.style_signature import Signatures, stops_of
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS, Limits, Objective, StyleMeasures, choose
from app.core.solver.weights import target_weights
from app.core.styles.style_pack import StylePack
from app.core.text import tr


@dataclass(frozen=True, eq=False)
class LampTables:
    """What a lamp does to a pack's targets, to the face's mean and to its areas.

    All that is linear in light stands in L rows: the S targets over the whole head, the mean of the
    face, its A areas, and the S targets over the face.
    """

    pack: StylePack = field(repr=False)
    lamp_light: AddedLight = field(repr=False)
    # (L, 4096), times two-part light they sum to the values
    linear: Float64 = field(repr=False)
    # (L, 576), values under the lamp alone
    lamp_products: Float64 = field(repr=False)

    # What the lamp hides of each row, see `hidden_tables`. The tables of a large lamp are large:
    # each half is made when its objective first asks. C may be what is left of a hidden sun.
    @cached_property
    def hidden_whole(self) -> tuple[Float64, ...]:
        """Of the targets over the whole head, each (S, M, 64)."""
        return tuple(hidden_tables(self.lamp_light.hidden, self.linear[: self.count]))

    @cached_property
    def hidden_face(self) -> tuple[Float32, ...]:
        """Of all that is taken over the face, each (L - S, M, 64)."""
        rows = self.linear[self.count :].astype(np.float32)
        return tuple(hidden_tables(self.lamp_light.hidden, rows))

    @property
    def count(self) -> int:
        """Number of targets, S, and the position of the mean."""
        return len(self.pack.styles)

    @property
    def areas(self) -> list[int]:
        """Positions of the areas."""
        return list(range(self.count + 1, self.count + 1 + len(AREAS)))

    def face(self, row: int) -> int:
        """Position of a target over the face."""
        return self.count + 1 + len(AREAS) + row


@dataclass(frozen=True, slots=True, eq=False)
class SearchPlace:
    """A place's light as the search of a second light takes it."""

    # (32, 64, 3) float, linear Rec. 709 radiance at turn 0, divided by `scale`
    light: Floats = field(repr=False)
    scale: float
    parts: Float64 = field(repr=False)  # (2, 32, 64), the light in two parts
    # (L, 64), all values without the lamp, at all turns; of the targets only, where only
    # they were asked
    curves: Float64 = field(repr=False)


def lamp_tables(pack: StylePack, transport: Transport, lamp_light: AddedLight) -> LampTables:
    """Hold a lamp against the styles of a head.

    Raises TransportError if they do not belong together.
    """
    linear = _full(pack)
    if lamp_light.light is not None:
        parts = two_parts(lamp_light.light, pack.mixing).reshape(len(lamp_light.light), -1)
        products = linear @ parts.T
    else:
        weights = _pixel_weights(pack, transport)
        blocks = np.array_split(lamp_light.pictures, 9)
        products = np.concatenate([weights @ block.T.astype(np.float64) for block in blocks], 1)
    return LampTables(pack, lamp_light, linear, products)


def see_place(
    tables: LampTables, light: Floats, scale: float, *, targets: bool = False
) -> SearchPlace:
    """Look at a place. `light`: (32, 64, 3) float, linear Rec. 709 radiance at turn 0."""
    pack = tables.pack
    light_values = pack.project(light)
    if targets:
        values = quality_curves(pack.tables, light_values)
    else:
        place_curves = curves(pack.tables, light_values)
        values = np.concatenate(
            [place_curves.quality, place_curves.mean[None], place_curves.others]
        )
    return SearchPlace(light, scale, two_parts(light, pack.mixing), values)


def left_everywhere(
    tables: LampTables, place: SearchPlace, rows: Sequence[int], turn: int | None = None
) -> Floats:
    """Evaluate what the place gives behind the lamp: eq. 7 without the lamp's own light.

    `rows`: targets wanted, or rows behind them as in `LampTables.lit`.
    Returns (len(rows), 64, 576) float, or (len(rows), 1, 576) at one turn, in the unit of
    `place.light`; float64 where a target over the whole head is among them. With `lamp_alone` it
    sums to eq. 7.
    """
    indices = np.asarray(rows, np.intp)
    is_whole = indices < tables.count
    kind = np.float64 if is_whole.any() else np.float32
    result = np.empty((len(indices), TURNS if turn is None else 1, COUNT), kind)
    for part in (np.flatnonzero(is_whole), np.flatnonzero(~is_whole)):
        # A few at a time, so that what they need stays small.
        for start in range(0, len(part), _BATCH):
            some = part[start : start + _BATCH]
            result[some] = _loss(tables, place, indices[some], turn)
    curves = place.curves[indices] if turn is None else place.curves[indices, turn][:, None]
    return np.subtract(curves[:, :, None], result, out=result, casting="same_kind")


def _loss(tables: LampTables, place: SearchPlace, rows: Indices, turn: int | None) -> Floats:
    """What the lamp hides, of rows that are all targets over the head, or none."""
    hidden, whole = tables.lamp_light.hidden, bool(rows[0] < tables.count)
    every: tuple[Floats, ...] = tables.hidden_whole if whole else tables.hidden_face
    parts = tuple(table[rows - (0 if whole else tables.count)] for table in every)
    if turn is None:
        return correlate(hidden, parts, place.parts)
    return correlate_at(hidden, parts, place.parts, turn)[:, None]


def values_at(tables: LampTables, place: SearchPlace, spot: LampSpot, power: float) -> Float64:
    """Evaluate all rows at one combination, (L,) float64, in the unit of `place.light`."""
    hidden, (altitude, azimuth) = tables.lamp_light.hidden, divmod(spot.number, TURNS)
    parts = np.roll(place.parts, -spot.turn, axis=2).reshape(-1)
    own, share = hidden.own[altitude][:, azimuth], hidden.shares[altitude][:, azimuth]
    parts[own] -= share * parts[own]
    return tables.linear @ parts + tables.lamp_products[:, spot.number] * (power / place.scale)


def lamp_alone(tables: LampTables, place: SearchPlace, rows: Sequence[int]) -> Float64:
    """Return what the lamp's own light gives at full power, (len(rows), 576) float64."""
    return np.asarray(tables.lamp_products[list(rows)] / place.scale)


def _full(pack: StylePack) -> Float64:
    """(L, 4096) all that is linear in light, on the full grid in two parts."""
    rows = np.concatenate([pack.target_rows, pack.mean_rows[None], pack.area_rows, pack.face_rows])
    height = SHAPE[0]
    if pack.header.environment != SHAPE:
        raise TransportError(
            tr("A second light needs a head baked for 64 x 32 texels."), tr("Choose another head.")
        )
    first = rows[:, :height].astype(np.float64)
    second = np.einsum("kh,fkw->fhw", pack.mixtures, rows[:, height:].astype(np.float64))
    return np.concatenate([first, second], axis=1).reshape(len(rows), -1)


def _pixel_weights(pack: StylePack, transport: Transport) -> Float64:
    """(L, P) the same on the head's pixels, made again from the pack's pictures."""
    flat = pack.targets.reshape(len(pack.styles), -1, 3)[:, transport.pixels]
    luminance = flat.astype(np.float64) @ np.asarray(transport.header.luminance_weights)
    region = pack.region_on(transport)
    whole = [target_weights(picture, transport.face) for picture in luminance]
    part = pack.weights_on(transport)
    areas = pack.areas.reshape(len(pack.areas), -1)[:, transport.pixels].astype(np.float64)
    areas /= np.maximum(areas.sum(axis=1, keepdims=True), 1e-30)
    return np.stack([*whole, region / region.sum(), *areas, *part])


_BATCH: Final = 8  # rows

_Kind = TypeVar("_Kind", bound=np.generic)

_MIDDLE: Final = len(ALTITUDES_DEG) // 2


@dataclass(frozen=True, slots=True)
class LampSpot:
    """A turn and a placement of the lamp."""

    turn: int
    number: int


def best_spot(objective: Float64, eligible: Bools | None = None) -> LampSpot:
    """Choose the largest value.

    Among those within a millionth of it: the smaller turn, then clockwise; then the smaller
    azimuth of the lamp, toward the sitter's left first; then the smaller altitude, upward first.

    `objective`: (64, 576) or (1, 576) float64, per turn and placement.
    """
    values = (
        objective.ravel() if eligible is None else np.where(eligible, objective, -np.inf).ravel()
    )
    top = int(np.argmax(values))
    ties = np.flatnonzero(values >= values[top] - TIE * abs(values[top]))
    if len(ties) > 1:
        top = int(min(ties.tolist(), key=_rank))
    return LampSpot(*divmod(top, COUNT))


def _rank(place: int) -> tuple[int, ...]:
    turn, number = divmod(place, COUNT)
    altitude, azimuth = divmod(number, TURNS)
    height = altitude - _MIDDLE
    return (
        min(turn, TURNS - turn),
        turn,
        min(azimuth, TURNS - azimuth),
        azimuth,
        abs(height),
        -height,
    )


def refine(
    objective: Float64, spot: LampSpot, eligible: Bools, gate: Float64 | None = None
) -> tuple[float, float, float]:
    """Look between the grid's places for the maximum, by a parabola through the neighbours.

    `objective`: (64, 576) or (1, 576) float64, per turn and placement; of one turn only, the turn
    stays as it is.
    `gate`: of the same shape. Stays at 0 or above, interpolated alike.
    How far from the spot: turn, azimuth and altitude, in steps of the grid, at most half of one
    each.
    """
    cube = _around(objective, spot)
    free = _free(_around(eligible, spot))
    free[0] &= len(objective) > 1
    free[1] &= 0 < spot.number // TURNS < len(ALTITUDES_DEG) - 1
    slope, bend = _parabola(cube)
    scale = float(np.abs(cube).max())
    moves = np.zeros(3)
    if float(np.ptp(cube)) <= TIE * scale or not free.any():
        return (0.0, 0.0, 0.0)
    part = np.ix_(free, free)
    if float(np.linalg.eigvalsh(bend[part]).max()) < 0:
        moves[free] = np.linalg.solve(bend[part], -slope[free])
    if np.abs(moves).max() > 0.5 or not moves.any():
        # Each way for itself where together they lead too far.
        sharp = np.minimum(np.diag(bend), -1e-12 * max(scale, 1e-30))
        moves = np.where(free, np.clip(-slope / sharp, -0.5, 0.5), 0.0)
    if gate is not None:
        moves = _inside(_around(gate, spot), moves)
    turn, altitude, azimuth = moves.tolist()
    return turn, azimuth, altitude


def _around(values: NDArray[_Kind], spot: LampSpot) -> NDArray[_Kind]:
    """(3, 3, 3) values around a spot: turn, altitude, azimuth; the ends repeat in altitude."""
    altitude, azimuth = divmod(spot.number, TURNS)
    steps = np.arange(-1, 2)
    rows = np.clip(altitude + steps, 0, len(ALTITUDES_DEG) - 1)
    grid = values.reshape(-1, len(ALTITUDES_DEG), TURNS)
    return grid[np.ix_((spot.turn + steps) % len(grid), rows, (azimuth + steps) % TURNS)]


def _free(eligible: Bools) -> Bools:
    """(3,) whether both neighbours along a way may be chosen."""
    lines = (eligible[:, 1, 1], eligible[1, :, 1], eligible[1, 1, :])
    return np.array([bool(line.all()) for line in lines])


def _parabola(cube: Float64) -> tuple[Float64, Float64]:
    """(3,) slope and (3, 3) bend in the middle of a cube."""
    middle = cube[1, 1, 1]
    slope, bend = np.zeros(3), np.zeros((3, 3))
    for one in range(3):
        line = np.moveaxis(cube, one, 0)[:, 1, 1]
        slope[one] = 0.5 * (line[2] - line[0])
        bend[one, one] = (line[2] - middle) + (line[0] - middle)
        for other in range(one):
            face = np.moveaxis(cube, (one, other), (0, 1))[:, :, 1]
            cross = (face[2, 2] + face[0, 0]) - (face[2, 0] + face[0, 2])
            bend[one, other] = bend[other, one] = 0.25 * cross
    return slope, bend


def _inside(gate: Float64, moves: Float64) -> Float64:
    """Go back toward the middle until the gate is open."""
    slope, bend = _parabola(gate)
    for _ in range(6):
        if gate[1, 1, 1] + slope @ moves + 0.5 * moves @ bend @ moves >= 0:
            return moves
        moves = 0.5 * moves
    return np.zeros(3)


@dataclass(frozen=True, slots=True)
class BestSpot:
    """The best combination for one style."""

    row: int
    spot: LampSpot
    # from there to the maximum between the grid's places: turn, azimuth, altitude, in steps
    moves: tuple[float, float, float]
    # (576,), the objective at that turn: match of 100, or quality in the unit of the place's light
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
    """Evaluate all combinations for some styles and choose.

    `is_open`: (576,) bool, placements that can be reached.
    Raises CoreError if no placement is allowed.
    """
    if is_open is not None and not is_open.any():
        raise CoreError(tr("The lamp cannot be held anywhere within reach."), tr("Hold it nearer."))
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
    """Where only one turn was looked at, it is the first: give it its number."""
    if turn is None:
        return tuple(answers)
    return tuple(replace(one, spot=LampSpot(turn, one.spot.number)) for one in answers)


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    """All that match and strength are made of, before the lamp's power is known."""

    tables: LampTables
    where: dict[int, int]
    remainder: Floats
    alone: Float64
    contrast: Norms

    @classmethod
    def of(
        cls, tables: LampTables, place: SearchPlace, rows: Sequence[int], turn: int | None
    ) -> _Parts:
        """Evaluate styles over the face, its mean and its areas."""
        lamp_light = tables.lamp_light
        # Without a signature a style may be chosen by its quality, see `choose`.
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
        """See them with the lamp at a power."""
        contrast = self.contrast.at(power)
        # A face without any contrast matches nothing.
        contrast[contrast <= 1e-12 * contrast.max()] = np.inf
        sight = _Sight(self, power, contrast, contrast)
        mean = np.maximum(sight.value(self.tables.count), 1e-30)
        return replace(sight, mean=mean)


@dataclass(frozen=True, eq=False)
class _Sight:
    """The face at all combinations, at one power: its contrast and its mean."""

    parts: _Parts
    power: float
    contrast: Float64
    mean: Float64

    def value(self, row: int) -> Float64:
        """(64 or 1, 576) value of a row of `LampTables.lit`."""
        position = self.parts.where[row]
        return np.asarray(self.parts.remainder[position] + self.power * self.parts.alone[position])

    @property
    def areas(self) -> Float64:
        """(A, n) means of all areas."""
        return np.stack([self.value(row).ravel() for row in self.parts.tables.areas])

    @cached_property
    def stops(self) -> Float64:
        """The same, stops."""
        return stops_of(self.areas)


def _choose(
    sight: _Sight, row: int, limits: Limits, open_: Bools
) -> tuple[tuple[int, float], BestSpot]:
    """Choose among all combinations as among turns (`app.core.solver.turn_choice`).

    How far that got: the grade, and the match.
    """
    pack = sight.parts.tables.pack
    product = sight.value(sight.parts.tables.face(row))
    match = product * (100.0 / float(pack.weight_norm[row])) / sight.contrast
    strength = product * (100.0 / float(pack.studio_ratio[row])) / sight.mean
    signature = Signatures((pack.styles[row].signature,))
    if signature.styles[0].areas:
        signature.take_areas(sight.areas, match.reshape(1, -1), strength.reshape(1, -1))
    yes, nearly = signature.slack(sight.stops, match.reshape(1, -1))
    quality = product if signature.styles[0].relations else sight.value(row)
    at = quality.ravel(), match.ravel(), strength.ravel()
    # `refine` works on match itself.
    measured = StyleMeasures(*at, yes[0], nearly[0], np.ones(match.size))
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
    """The turn offered with the lamp held where it is best, by the rule without a lamp.

    Returns:
        The spot on the grids, and how many steps the turn lies from it.
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
