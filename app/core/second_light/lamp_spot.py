"""The best combination of turn and lamp placement, refined between the points of the grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float64
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.solver.peaks import TIE

_Kind = TypeVar("_Kind", bound=np.generic)

_MIDDLE: Final = len(ALTITUDES_DEG) // 2


@dataclass(frozen=True, slots=True)
class LampSpot:
    """A turn, and a placement of the lamp."""

    turn: int
    number: int


def best_spot(objective: Float64, eligible: Bools | None = None) -> LampSpot:
    """Return the spot with the largest value.

    Values within a millionth of the largest count as equal. Among equal values, the spot with the
    smallest turn is chosen (clockwise before counter-clockwise). If the turns are equal too, the
    smallest azimuth of the lamp is chosen (the sitter's left before the right), and then the
    smallest altitude (up before down).

    Args:
        objective: (64, 576) or (1, 576) float64. Values by turn and placement.
        eligible: Mask of the same shape. Spots where the mask is False are excluded.
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
    """Find the maximum between the points of the grid, by a parabola through the neighbours.

    Args:
        objective: (64, 576) or (1, 576) float64. Values by turn and placement. A single turn is not
            refined.
        gate: Values of the same shape. When interpolated in the same way, they must remain at 0 or
            above.

    Returns:
        The offsets from the spot in turn, azimuth and altitude, each at most half a grid step.
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
        # Move along one axis at a time if all axes together lead too far.
        sharp = np.minimum(np.diag(bend), -1e-12 * max(scale, 1e-30))
        moves = np.where(free, np.clip(-slope / sharp, -0.5, 0.5), 0.0)
    if gate is not None:
        moves = _inside(_around(gate, spot), moves)
    turn, altitude, azimuth = moves.tolist()
    return turn, azimuth, altitude


def _around(values: NDArray[_Kind], spot: LampSpot) -> NDArray[_Kind]:
    """Return values around a spot, (3, 3, 3), by turn, altitude (repeated at the ends), azimuth."""
    altitude, azimuth = divmod(spot.number, TURNS)
    steps = np.arange(-1, 2)
    rows = np.clip(altitude + steps, 0, len(ALTITUDES_DEG) - 1)
    grid = values.reshape(-1, len(ALTITUDES_DEG), TURNS)
    return grid[np.ix_((spot.turn + steps) % len(grid), rows, (azimuth + steps) % TURNS)]


def _free(eligible: Bools) -> Bools:
    """Return a mask, (3,), of the axes along which both neighbours are eligible."""
    lines = (eligible[:, 1, 1], eligible[1, :, 1], eligible[1, 1, :])
    return np.array([bool(line.all()) for line in lines])


def _parabola(cube: Float64) -> tuple[Float64, Float64]:
    """Return the slope, (3,), and the curvature, (3, 3), at the centre of a cube of values."""
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
    """Halve the moves until the gate is open at the resulting position."""
    slope, bend = _parabola(gate)
    for _ in range(6):
        if gate[1, 1, 1] + slope @ moves + 0.5 * moves @ bend @ moves >= 0:
            return moves
        moves = 0.5 * moves
    return np.zeros(3)
