"""Choosing one of 36,864 combinations, and refining it between the grid's places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.solver.peaks import TIE

Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

_Kind = TypeVar("_Kind", bound=np.generic)

_MIDDLE: Final = len(ALTITUDES_DEG) // 2


@dataclass(frozen=True, slots=True)
class Spot:
    """A turn and a placement of the lamp."""

    turn: int
    number: int


def best_spot(objective: Float64, allowed: Mask | None = None) -> Spot:
    """Choose the largest value.

    Among those within a millionth of it: the smaller turn, then clockwise; then the smaller
    azimuth of the lamp, toward the sitter's left first; then the smaller altitude, upward first.

    Parameters
    ----------
    objective : (64, 576) or (1, 576) float64
        Per turn and placement.
    """
    values = objective.ravel() if allowed is None else np.where(allowed, objective, -np.inf).ravel()
    top = int(np.argmax(values))
    size = max(float(objective.max()), -float(objective.min()))
    ties = np.flatnonzero(values >= values[top] - TIE * size)
    if len(ties) > 1:
        top = int(min(ties.tolist(), key=_rank))
    return Spot(*divmod(top, COUNT))


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
    objective: Float64, spot: Spot, allowed: Mask, gate: Float64 | None = None
) -> tuple[float, float, float]:
    """Look between the grid's places for the maximum, by a parabola through the neighbours.

    Parameters
    ----------
    objective : (64, 576) or (1, 576) float64
        Per turn and placement; of one turn only, the turn stays as it is.
    gate : float64, optional
        Of the same shape. Stays at 0 or above, interpolated alike.

    Returns
    -------
    tuple of float
        How far from the spot: turn, azimuth and altitude, in steps of the grid, at most half of
        one each.
    """
    cube = _around(objective, spot)
    free = _free(_around(allowed, spot))
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


def _around(values: NDArray[_Kind], spot: Spot) -> NDArray[_Kind]:
    """(3, 3, 3) values around a spot: turn, altitude, azimuth; the ends repeat in altitude."""
    altitude, azimuth = divmod(spot.number, TURNS)
    steps = np.arange(-1, 2)
    rows = np.clip(altitude + steps, 0, len(ALTITUDES_DEG) - 1)
    grid = values.reshape(-1, len(ALTITUDES_DEG), TURNS)
    return grid[np.ix_((spot.turn + steps) % len(grid), rows, (azimuth + steps) % TURNS)]


def _free(allowed: Mask) -> Mask:
    """(3,) whether both neighbours along a way may be chosen."""
    lines = (allowed[:, 1, 1], allowed[1, :, 1], allowed[1, 1, :])
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
