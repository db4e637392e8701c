"""What a lamp hides of the place behind it, at all turns and placements at once.

With E the place's light, a the share of each texel that the lamp hides, and Phi anything that is
linear in light (a pre-integrated target, say), the hidden part at turn t and azimuth k is

    sum over texels of a(texel) Phi(texel) E(texel turned by t).

A lamp hides a few texels only, and the same ones relative to itself whatever its azimuth. Seen
from the lamp, light depends on t - k alone: per altitude one matrix of 64 views of the place, and
one product with the targets as each azimuth has them, hold all 64 x 64 combinations, exactly.

Light and what is linear in it come in two parts here, see `app.core.solver.search_light`, both on
the full grid: (2, H, W), flat in that order.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from app.core.base.angles import TURNS
from app.core.base.errors import CoreError
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.solver.environment import SHAPE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from app.core.base.arrays import Float64, Floats, Int64

_Float = TypeVar("_Float", bound=np.floating[Any])

_TEXELS: Final = SHAPE[0] * SHAPE[1]
_LEAST: Final = 1e-6
_MOST: Final = 768  # texels that a lamp may hide around one altitude: three eighths of them all
_STEPS: Final = np.arange(TURNS)
# Where turn t and azimuth k find their product: view t - k, azimuth k.
_ORDER: Final[Int64] = ((_STEPS[:, None] - _STEPS) % TURNS * TURNS + _STEPS).ravel()


@dataclass(frozen=True, slots=True, eq=False)
class Hidden:
    """Texels that a lamp hides, per altitude; M of them, both parts of light."""

    # tuple of (64, M) int64, position in the place's light of what stands behind the lamp, per
    # turn minus azimuth
    views: tuple[Int64, ...] = field(repr=False)
    # tuple of (M, 64) int64, position in the head's frame, per azimuth
    own: tuple[Int64, ...] = field(repr=False)
    # each (M, 64), how much of each is hidden, 0 to 1, per azimuth
    shares: tuple[Float64, ...] = field(repr=False)


def find_hidden(alpha: Floats) -> Hidden:
    """Find what a lamp hides.

    `alpha`: (576, 32, 64) float, share of each texel that the lamp hides, in the head's frame, per
    placement.
    Raises CoreError if it hides so much that it is no lamp.
    """
    views, own, shares = [], [], []
    for rows in alpha.reshape(len(ALTITUDES_DEG), TURNS, *SHAPE):
        # Toward the sitter's left is toward the left of the panorama.
        still = np.stack([np.roll(a, k, axis=1) for k, a in enumerate(rows)])
        row, column = np.nonzero((still > _LEAST).any(axis=0))
        if len(row) > _MOST:
            raise CoreError(
                "This lamp hides nearly everything around the head.",
                "Correct its mask: only the lamp itself belongs to it.",
            )
        views.append(_both(row * SHAPE[1] + (column + _STEPS[:, None]) % TURNS, 1))
        own.append(_both(row[:, None] * SHAPE[1] + (column[:, None] - _STEPS) % TURNS, 0))
        share = still[:, row, column].T.astype(np.float64)
        shares.append(np.concatenate([share, share]))
    return Hidden(tuple(views), tuple(own), tuple(shares))


def hidden_tables(hidden: Hidden, linear: NDArray[_Float]) -> tuple[NDArray[_Float], ...]:
    """Take what is linear in light to where a lamp hides it.

    `linear`: (F, 4096) float, times two-part light it sums to F values.
    Returns tuple of (F, M, 64) float: per altitude, in the type of `linear`, for `correlate`.
    """
    return tuple(each_table(hidden, linear))


def each_table(hidden: Hidden, linear: NDArray[_Float]) -> Iterator[NDArray[_Float]]:
    """Give the tables of `hidden_tables` one after the other: all together they are large."""
    for own, share in zip(hidden.own, hidden.shares, strict=True):
        table = linear[:, own]
        table *= share.astype(linear.dtype)
        yield table


def correlate(hidden: Hidden, tables: Sequence[Float64], light: Float64) -> Float64:
    """Sum up the hidden part at all turns and placements.

    `tables`: sequence of (F, M, 64) float64, from `hidden_tables`.
    `light`: (2, 32, 64) float64, of the place, at turn 0.
    Returns (F, 64, 576) float64: per turn and placement.
    """
    flat = light.reshape(-1)
    found = np.empty((len(tables[0]), len(tables), TURNS, TURNS))
    for altitude, (views, table) in enumerate(zip(hidden.views, tables, strict=True)):
        np.matmul(flat[views], table, out=found[:, altitude])
    return by_turn(found)


def by_turn(found: Float64) -> Float64:
    """Sort values that are known by turn minus azimuth.

    `found`: (F, 9, 64, 64) float64, per altitude, turn minus azimuth, and azimuth.
    Returns (F, 64, 576) float64: per turn and placement.
    """
    count = len(found)
    sorted_ = np.empty((count, TURNS, len(ALTITUDES_DEG), TURNS))
    for altitude in range(len(ALTITUDES_DEG)):
        flat = found[:, altitude].reshape(count, -1)
        sorted_[:, :, altitude] = flat[:, _ORDER].reshape(count, TURNS, TURNS)
    return sorted_.reshape(count, TURNS, COUNT)


def correlate_at(hidden: Hidden, tables: Sequence[Float64], light: Float64, turn: int) -> Float64:
    """Sum up the hidden part at one turn.

    Returns (F, 576) float64.
    """
    flat = light.reshape(-1)
    turned = (turn - _STEPS) % TURNS
    rows = [
        np.einsum("km,fmk->fk", flat[views[turned]], table)
        for views, table in zip(hidden.views, tables, strict=True)
    ]
    return np.concatenate(rows, axis=1)


def two_parts(light: Floats, mixing: Float64) -> Float64:
    """Split light into the two parts of `app.core.solver.search_light`, on the full grid.

    `light`: (..., H, W, 3) float, linear Rec. 709 radiance.
    `mixing`: (2, 3) float64, of the head.
    Returns (..., 2, H, W) float64: in the unit of `light`.
    """
    red, green, blue = (light[..., channel].astype(np.float64) for channel in range(3))
    # Texel by texel, so that mirrored light gives exactly the mirrored parts.
    return np.stack([r * red + g * green + b * blue for r, g, b in mixing], axis=-3)


def _both(texels: Int64, axis: int) -> Int64:
    return np.concatenate([texels, texels + _TEXELS], axis=axis).astype(np.int64)
