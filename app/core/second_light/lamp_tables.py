"""A lamp and a place, in the form used by the search for a second light.

The styles and the lamp are transformed once. Any place can then be searched in milliseconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Float32, Float64, Floats, Indices
from app.core.base.errors import TransportError
from app.core.environment.environment import SHAPE
from app.core.second_light.added_light import AddedLight
from app.core.second_light.contrast import (
    correlate,
    correlate_at,
    hidden_tables,
    two_parts,
)
from app.core.second_light.lamp_spot import LampSpot
from app.core.second_light.placements import COUNT
from app.core.solver.face import AREAS, AROUND
from app.core.solver.search import curves, quality_curves
from app.core.solver.transport import Transport
from app.core.solver.weights import target_weights
from app.core.styles.style_pack import StylePack
from app.core.text import tr


@dataclass(frozen=True, eq=False)
class LampTables:
    """The effect of a lamp on a pack's targets, and on the mean and the areas of the face.

    Everything that is linear in light is stored in L rows: the S targets over the whole head, the
    mean of the face, its A areas, and the S targets over the face.
    """

    pack: StylePack = field(repr=False)
    lamp_light: AddedLight = field(repr=False)
    # (L, 4096); the product with two-part light gives the values
    linear: Float64 = field(repr=False)
    # (L, 576), values under the lamp alone
    lamp_products: Float64 = field(repr=False)

    # The light that the lamp hides (see `hidden_tables`). The tables of a large lamp are large, so
    # each half is computed when it is first needed. The first half has double precision, since C
    # may be the small remainder of a hidden sun.
    @cached_property
    def hidden_whole(self) -> tuple[Float64, ...]:
        """The tables of the targets over the whole head, (S, M, 64) each."""
        return tuple(hidden_tables(self.lamp_light.hidden, self.linear[: self.count]))

    @cached_property
    def hidden_face(self) -> tuple[Float32, ...]:
        """The tables of everything over the face, (L - S, M, 64) each."""
        rows = self.linear[self.count :].astype(np.float32)
        return tuple(hidden_tables(self.lamp_light.hidden, rows))

    @property
    def count(self) -> int:
        """The number of targets, S, which is also the row of the mean."""
        return len(self.pack.styles)

    @property
    def areas(self) -> list[int]:
        """The rows of the areas."""
        return list(range(self.count + 1, self.count + 1 + len(AREAS)))

    def face(self, row: int) -> int:
        """Return the row of a target over the face."""
        return self.count + 1 + len(AREAS) + row


@dataclass(frozen=True, slots=True, eq=False)
class SearchPlace:
    """A place's light, prepared for the search for a second light."""

    # (32, 64, 3) float, linear Rec. 709 radiance at turn 0, divided by `scale`
    light: Floats = field(repr=False)
    scale: float
    parts: Float64 = field(repr=False)  # (2, 32, 64), the light in two parts
    # (L, 64), all values without the lamp, at all turns, or only the targets' values if no others
    # are needed
    curves: Float64 = field(repr=False)


def lamp_tables(pack: StylePack, transport: Transport, lamp_light: AddedLight) -> LampTables:
    """Prepare a lamp for the styles of a head.

    Raises:
        TransportError: If the head was baked for environments of a different size.
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
    """Prepare the light of a place for the search.

    Args:
        light: (32, 64, 3) float. Linear Rec. 709 radiance at turn 0.
        targets: Whether only the targets over the whole head are needed.
    """
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
    """Evaluate the light of the place that the lamp does not hide.

    The sum of the result and that of `lamp_alone` is eq. 7.

    Args:
        rows: Rows of `LampTables`.
        turn: Index of the only turn to evaluate, or None for all turns.

    Returns:
        (len(rows), 64, 576) float, or (len(rows), 1, 576) for a single turn, in the same unit as
        `place.light`. The type is float64 if a target over the whole head is among the rows.
    """
    indices = np.asarray(rows, np.intp)
    is_whole = indices < tables.count
    kind = np.float64 if is_whole.any() else np.float32
    result = np.empty((len(indices), TURNS if turn is None else 1, COUNT), kind)
    for part in (np.flatnonzero(is_whole), np.flatnonzero(~is_whole)):
        # Process a few rows at a time to save memory.
        for start in range(0, len(part), _BATCH):
            some = part[start : start + _BATCH]
            result[some] = _loss(tables, place, indices[some], turn)
    curves = place.curves[indices] if turn is None else place.curves[indices, turn][:, None]
    return np.subtract(curves[:, :, None], result, out=result, casting="same_kind")


def _loss(tables: LampTables, place: SearchPlace, rows: Indices, turn: int | None) -> Floats:
    """Evaluate the light that the lamp hides, for rows of which all or none are targets."""
    hidden, whole = tables.lamp_light.hidden, bool(rows[0] < tables.count)
    every: tuple[Floats, ...] = tables.hidden_whole if whole else tables.hidden_face
    parts = tuple(table[rows - (0 if whole else tables.count)] for table in every)
    if turn is None:
        return correlate(hidden, parts, place.parts)
    return correlate_at(hidden, parts, place.parts, turn)[:, None]


def values_at(tables: LampTables, place: SearchPlace, spot: LampSpot, power: float) -> Float64:
    """Evaluate all rows for one combination, (L,) float64, in the same unit as `place.light`."""
    hidden, (altitude, azimuth) = tables.lamp_light.hidden, divmod(spot.number, TURNS)
    parts = np.roll(place.parts, -spot.turn, axis=2).reshape(-1)
    own, share = hidden.own[altitude][:, azimuth], hidden.shares[altitude][:, azimuth]
    parts[own] -= share * parts[own]
    values = tables.linear @ parts + tables.lamp_products[:, spot.number] * (power / place.scale)
    around = tables.areas[AROUND]
    values[around] = place.curves[around, spot.turn]
    return values


def lamp_alone(tables: LampTables, place: SearchPlace, rows: Sequence[int]) -> Float64:
    """Evaluate the lamp's own light at full power, (len(rows), 576) float64."""
    return np.asarray(tables.lamp_products[list(rows)] / place.scale)


def _full(pack: StylePack) -> Float64:
    """Return all rows on the full grid, in two parts, (L, 4096)."""
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
    """Return all rows on the pixels of the head, (L, P), from the pictures in the pack."""
    flat = pack.targets.reshape(len(pack.styles), -1, 3)[:, transport.pixels]
    luminance = flat.astype(np.float64) @ np.asarray(transport.header.luminance_weights)
    region = pack.region_on(transport)
    whole = [target_weights(picture, transport.face) for picture in luminance]
    part = pack.weights_on(transport)
    areas = pack.areas.reshape(len(pack.areas), -1)[:, transport.pixels].astype(np.float64)
    areas /= np.maximum(areas.sum(axis=1, keepdims=True), 1e-30)
    return np.stack([*whole, region / region.sum(), *areas, *part])


_BATCH: Final = 8  # rows
