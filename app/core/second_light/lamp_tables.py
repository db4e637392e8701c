"""Styles and a lamp, transformed once, so that any place is searched in milliseconds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import TransportError
from app.core.second_light.hidden import correlate, correlate_at, hidden_tables, two_parts
from app.core.solver.environment import SHAPE
from app.core.solver.lamps import lamp_weights
from app.core.solver.search import curves, quality_curves
from app.core.solver.weights import target_weights

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.second_light.added import AddedLight
    from app.core.solver.style_pack import StylePack
    from app.core.solver.transport import Transport

Float64: TypeAlias = NDArray[np.float64]
Floats: TypeAlias = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class LampTables:
    """What a lamp does to a pack's targets, to the face's mean and to single lamps' maps.

    Attributes
    ----------
    lit : (S + 1 + K, 576) float64
        Values under the lamp alone: S targets, the mean of the face, K lamp maps.
    hidden : tuple of (S + 1 + K, M, 64) float64
        The same of what it hides, see `app.core.second_light.hidden`.
    """

    pack: StylePack = field(repr=False)
    added: AddedLight = field(repr=False)
    lit: Float64 = field(repr=False)
    hidden: tuple[Float64, ...] = field(repr=False)

    @property
    def count(self) -> int:
        """Number of targets, S, and the position of the mean."""
        return len(self.pack.styles)


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A place's light as the search of a second light takes it.

    Attributes
    ----------
    light : (32, 64, 3) float
        Linear Rec. 709 radiance at turn 0, divided by `scale`.
    parts : (2, 32, 64) float64
        The light in two parts.
    curves : (S + 1 + K, 64) float64
        All values without the lamp, at all turns; of the targets only, where only they were asked.
    """

    light: Floats = field(repr=False)
    scale: float
    parts: Float64 = field(repr=False)
    curves: Float64 = field(repr=False)


def lamp_tables(pack: StylePack, transport: Transport, added: AddedLight) -> LampTables:
    """Hold a lamp against the styles of a head.

    Raises
    ------
    TransportError
        If they do not belong together.
    """
    linear = _full(pack)
    if added.light is not None:
        parts = two_parts(added.light, pack.mixing).reshape(len(added.light), -1)
        lit = linear @ parts.T
    else:
        weights = _pixel_weights(pack, transport)
        lit = np.concatenate([weights @ part.T.astype(np.float64) for part in _batches(added)], 1)
    return LampTables(pack, added, lit, hidden_tables(added.hidden, linear))


def see_place(tables: LampTables, light: Floats, scale: float, *, targets: bool = False) -> Place:
    """Look at a place.

    Parameters
    ----------
    light : (32, 64, 3) float
        Linear Rec. 709 radiance at turn 0.
    """
    pack = tables.pack
    seen = pack.seen(light)
    if targets:
        values = quality_curves(pack.tables, seen)
    else:
        found = curves(pack.tables, seen)
        values = np.concatenate([found.quality, found.mean[None], found.lamps])
    return Place(light, scale, two_parts(light, pack.mixing), values)


def left_everywhere(
    tables: LampTables, place: Place, rows: Sequence[int], turn: int | None = None
) -> Float64:
    """Evaluate what the place gives behind the lamp: eq. 7 without the lamp's own light.

    Parameters
    ----------
    rows : sequence of int
        Targets wanted, or rows behind them as in `LampTables.lit`.

    Returns
    -------
    (len(rows), 64, 576) float64, or (len(rows), 1, 576) at one turn
        In the unit of `place.light`. With `lamp_alone` it sums to eq. 7.
    """
    wanted = list(rows)
    chosen = tables.hidden if len(wanted) == len(tables.lit) else _rows(tables, wanted)
    hidden = tables.added.hidden
    if turn is not None:
        lost = correlate_at(hidden, chosen, place.parts, turn)
        return (place.curves[wanted, turn][:, None] - lost)[:, None]
    found = correlate(hidden, chosen, place.parts)
    for value, curve in zip(found, place.curves[wanted], strict=True):
        np.subtract(curve[:, None], value, out=value)
    return found


def lamp_alone(tables: LampTables, place: Place, rows: Sequence[int]) -> Float64:
    """Return what the lamp's own light gives at full power, (len(rows), 576) float64."""
    found: Float64 = tables.lit[list(rows)] / place.scale
    return found


def _rows(tables: LampTables, wanted: list[int]) -> tuple[Float64, ...]:
    return tuple(table[wanted] for table in tables.hidden)


def _full(pack: StylePack) -> Float64:
    """(S + 1 + K, 4096) all that is linear in light, on the full grid in two parts."""
    rows = np.concatenate([pack.target_rows, pack.mean_rows[None], pack.lamp_rows])
    height = SHAPE[0]
    if pack.header.environment != SHAPE:
        raise TransportError(
            "A second light needs a head baked for 64 x 32 texels.", "Choose another head."
        )
    first = rows[:, :height].astype(np.float64)
    second = np.einsum("kh,fkw->fhw", pack.mixtures, rows[:, height:].astype(np.float64))
    return np.concatenate([first, second], axis=1).reshape(len(rows), -1)


def _pixel_weights(pack: StylePack, transport: Transport) -> Float64:
    """(S + 1 + K, P) the same on the head's pixels, made again from the pack's pictures."""
    face = transport.face
    flat = pack.targets.reshape(len(pack.styles), -1, 3)[:, transport.pixels]
    luminance = flat.astype(np.float64) @ np.asarray(transport.header.luminance_weights)
    weights = np.stack([target_weights(picture, face) for picture in luminance])
    singles = lamp_weights(transport, pack.styles, luminance, weights)
    if not np.array_equal([one.style for one in singles], pack.lamp_style):
        raise TransportError("The styles of this head belong to another one.", "Bake it again.")
    rows = [*weights, face / np.count_nonzero(face), *(one.weights for one in singles)]
    return np.stack(rows)


def _batches(added: AddedLight) -> list[NDArray[np.float32]]:
    return np.array_split(added.pictures, 9)
