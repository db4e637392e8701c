"""Linear HDR panoramas of the light at a place, and their energy-preserving reduction.

A panorama is equirectangular, with row 0 at the zenith. Azimuth is 0 at the centre column and
positive to the right (clockwise as seen from above). Texel (i, j) of an H x W environment covers
the area u in [j/W, (j+1)/W), v in [i/H, (i+1)/H), and its radiance is constant over that area.
`app.core.environment.environment_file` reads the file formats.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.colour import FloatImage
from app.core.base.errors import EnvironmentFileError
from app.core.base.imaging.image_input import CLIPPED, UNSEEN
from app.core.base.remarks import Remark
from app.core.base.sphere import bounded, row_edges
from app.core.base.sphere import solid_angles as solid_angles
from app.core.environment.clipping import plateau
from app.core.environment.environment_file import read_panorama
from app.core.environment.holes import canvas, filled
from app.core.environment.remarks import ClippedFile, FromOnePhoto, LayerChosen, PartUnseen
from app.core.environment.repair import Repairs, repair
from app.core.text import tr

_Mark = TypeVar("_Mark", bound=np.generic)
SHAPE: Final = (32, 64)
"""Rows and columns of the environment that the search uses."""

_ROUNDS: Final = 60
_FINE: Final = 4096  # maximum columns for sums over a panorama


@dataclass(frozen=True, slots=True)
class Environment:
    """A repaired panorama of the light at one place.

    Attributes:
        radiance: (H, 2 H, 3) float32, read-only. Linear Rec. 709 relative radiance, which is
            finite, non-negative and not zero everywhere.
        rough: Whether the file states that much of the light is estimated.
        clipped: (H, 2 H) float32. Clipped fraction of each texel, or None if nothing is clipped.
            Clipped light is a lower bound, or an estimate if `rough` is true.
        unseen: (H, 2 H) bool. Gaps that were filled from their surroundings, or None if there were
            no gaps.
        layer, layers: The layer that was read, and the names of all layers. Both are empty if the
            file has only one layer.
    """

    radiance: FloatImage = field(repr=False)
    name: str
    repairs: Repairs = field(default_factory=Repairs)
    rough: bool = False
    clipped: Float32 | None = field(default=None, repr=False)
    unseen: Bools | None = field(default=None, repr=False)
    layer: str = ""
    layers: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the panorama."""
        return self.radiance.shape[0], self.radiance.shape[1]

    @property
    def shares(self) -> dict[str, Float32]:
        """Extra channels for a file, by name: the clipped fractions and the gaps."""
        return kept_shares(self.clipped, self.unseen)

    @property
    def blind(self) -> float:
        """Fraction of the sphere that lies in gaps, 0 to 1."""
        if self.unseen is None:
            return 0.0
        areas = solid_angles(self.shape) / (4.0 * np.pi)
        return float((self.unseen.sum(axis=1) * areas).sum())

    @property
    def clipped_light(self) -> float:
        """Fraction of the light that comes from clipped texels, 0 to 1."""
        if self.clipped is None:
            return 0.0
        light = bounded(self.radiance, _FINE).mean(axis=-1)
        return float(energy(light * bounded(self.clipped, _FINE))) / float(energy(light))

    @property
    def warnings(self) -> tuple[Remark, ...]:
        """Remarks about the file's layer, repairs, estimated light and gaps."""
        remarks: list[Remark] = list(self.repairs.remarks(self.name))
        if self.layers:
            others = tuple(each for each in self.layers if each != self.layer)
            remarks.append(LayerChosen(self.name, self.layer, others))
        if self.rough:
            remarks.append(FromOnePhoto(self.name))
        elif self.clipped is not None:
            remarks.append(ClippedFile(self.name))
        if self.unseen is not None:
            remarks.append(PartUnseen(self.name, self.blind))
        return tuple(remarks)


def kept_shares(clipped: Float32 | None, unseen: Bools | None) -> dict[str, Float32]:
    """Return the extra channels, (H, W) each, for `app.core.base.imaging.images.write_exr`."""
    planes: dict[str, Float32] = {}
    if clipped is not None and clipped.any():
        planes[CLIPPED] = clipped
    if unseen is not None:
        planes[UNSEEN] = unseen.astype(np.float32)
    return planes


def read_environment(path: Path | str, layer: str = "") -> Environment:
    """Read a linear panorama, repair it and fill its gaps.

    Args:
        layer: Name of the layer to read, or "" for the default layer (see `choose_layer`).

    Raises:
        EnvironmentFileError: If the file is missing, empty, damaged, not an HDR image, not 2:1, too
            small, too large or all black.
    """
    panorama = read_panorama(path, layer)
    environment = from_radiance(panorama.radiance, panorama.name)
    clipped = panorama.clipped
    if clipped is None:
        marks = plateau(environment.radiance)
        clipped = None if marks is None else marks.astype(np.float32)
    unseen = _either(panorama.unseen, canvas(environment.radiance))
    return replace(
        environment,
        radiance=environment.radiance if unseen is None else filled(environment.radiance, unseen),
        rough=panorama.rough,
        clipped=_either(clipped, environment.clipped),
        unseen=unseen,
        layer=panorama.layer,
        layers=panorama.layers,
    )


def _either(one: NDArray[_Mark] | None, other: NDArray[_Mark] | None) -> NDArray[_Mark] | None:
    """Return the larger value at each texel of two planes, either of which may be None."""
    if one is None or other is None:
        return other if one is None else one
    return np.asarray(np.maximum(one, other))


def from_radiance(radiance: FloatImage, name: str) -> Environment:
    """Create an environment from radiance, repairing it in place.

    Args:
        radiance: (H, 2 H, 3) float32. Linear Rec. 709 radiance. Since panoramas are large, the
            array is not copied but repaired in place and made read-only.

    Raises:
        EnvironmentFileError: If all texels are black, NaN or infinite, or if the shape is not 2:1.
    """
    shape = radiance.shape
    if radiance.ndim != 3 or shape[2] != 3 or shape[0] < 1 or shape[1] != 2 * shape[0]:
        raise EnvironmentFileError(
            tr(
                "{name} is not a full panorama: its shape is {shape}, not (H, 2 H, 3).",
                name=name,
                shape=shape,
            )
        )
    repairs, infinite = repair(radiance, name)
    radiance.flags.writeable = False
    clipped = None if infinite is None else infinite.astype(np.float32)
    return Environment(radiance, name, repairs, clipped=clipped)


def energy(radiance: Floats) -> Float64:
    """Integrate radiance over the sphere.

    Args:
        radiance: (H, W, ...) float. Radiance per texel.

    Returns:
        (...) float64. Sum of radiance times solid angle, in steradians.
    """
    sums = radiance.sum(axis=1, dtype=np.float64)
    return np.tensordot(solid_angles((radiance.shape[0], radiance.shape[1])), sums, axes=1)


def reduce(
    environment: Environment, shape: tuple[int, int] = SHAPE, turn_deg: float = 0.0
) -> FloatImage:
    """Reduce an environment to the size of the transport, as the sitter sees it at the given turn.

    Args:
        shape: Rows and columns of the result, which may be larger than the panorama.
        turn_deg: Turn, in degrees, clockwise as seen from above.

    Returns:
        (rows, columns, 3) float32. See `reduce_light`.
    """
    return reduce_light(environment.radiance, shape, turn_deg)


def reduce_radiance(
    radiance: FloatImage, shape: tuple[int, int] = SHAPE, turn_deg: float = 0.0
) -> FloatImage:
    """Average radiance over larger (or smaller) texels, weighting it by solid angle.

    Each texel of the result is the mean of the piecewise constant input over its area. Overlaps are
    measured in the sine of the elevation and in azimuth, so the integral of radiance over the
    sphere is preserved for any pair of sizes and any turn. At turn t the sitter faces azimuth t, so
    column u of the result is column u + t/360 of the panorama. A turn by k whole texels equals
    ``rotate(reduce_radiance(radiance, shape), k)`` exactly.

    Args:
        radiance: (H, W, C) float32. Linear radiance.
        shape: Rows and columns of the result.
        turn_deg: Turn, in degrees, clockwise as seen from above.

    Returns:
        (rows, columns, C) float32. Linear radiance on the same scale.
    """
    height, width, _ = radiance.shape
    rows = _row_weights(height, shape[0])
    return _mixed(radiance, rows, _column_weights(width, shape[1], turn_deg))


def reduce_light(
    radiance: FloatImage, shape: tuple[int, int] = SHAPE, turn_deg: float = 0.0
) -> FloatImage:
    """Reduce a panorama for the search and for pictures, preserving the directions of small lamps.

    If the panorama is at least twice as fine as the result, each of its texels is divided between
    the two nearest rows and columns of the result. Otherwise, `reduce_radiance` averages the
    panorama. Both methods preserve the energy and keep even light even. The arguments and the
    result are those of `reduce_radiance`.
    """
    height, width, _ = radiance.shape
    rows, columns = shape
    if height < 2 * rows or width < 2 * columns:
        return reduce_radiance(radiance, shape, turn_deg)
    return _mixed(radiance, _shared_rows(height, rows), _shared_columns(width, columns, turn_deg))


def _mixed(
    radiance: FloatImage, rows: tuple[tuple[int, Float64], ...], columns: Float64
) -> FloatImage:
    """Combine the input rows into each output row, then combine the columns with a matrix.

    Args:
        rows: The first input row for each output row, and the weights of that input row and the
            ones below it.
        columns: (input columns, output columns) float64. Weights of the columns.
    """
    height, width, channels = radiance.shape
    bands = np.empty((len(rows), width * channels))
    if len(rows) == height:
        bands[:] = radiance.reshape(height, -1)
    else:
        # Combine the rows first, in one pass over a large panorama. This gives double precision
        # without a double-precision copy.
        for row, (start, weights) in enumerate(rows):
            part = radiance[start : start + weights.size].reshape(weights.size, -1)
            bands[row] = weights @ part
    grid = bands.reshape(len(rows), width, channels)
    mixed = np.einsum("rwc,wk->rkc", grid, columns, optimize=True)
    return np.ascontiguousarray(mixed, dtype=np.float32)


def enlarge(radiance: FloatImage, shape: tuple[int, int]) -> FloatImage:
    """Repeat texels without interpolation, for reference renders of exactly these texels.

    Args:
        radiance: (H, W, ...) float32. Radiance of the environment.
        shape: Rows and columns of the result, which must be whole multiples of H and W.

    Returns:
        (rows, columns, ...) float32. The same light on a finer grid.

    Raises:
        ValueError: If the sizes are not whole multiples.
    """
    down, down_rest = divmod(shape[0], radiance.shape[0])
    across, across_rest = divmod(shape[1], radiance.shape[1])
    if down_rest or across_rest or not (down and across):
        raise ValueError(f"{shape} is not a whole multiple of {radiance.shape[:2]}")
    return np.repeat(np.repeat(radiance, down, axis=0), across, axis=1)


@lru_cache(maxsize=16)
def _row_weights(height: int, rows: int) -> tuple[tuple[int, Float64], ...]:
    """Return the first input row that each output row overlaps, and the weights of the input rows.

    The weights start with that input row and sum to 1 for each output row.
    """
    source_edges, target_edges = row_edges(height), row_edges(rows)
    result = []
    for row in range(rows):
        first = row * height // rows
        last = -(-(row + 1) * height // rows)
        upper = np.minimum(source_edges[first:last], target_edges[row])
        lower = np.maximum(source_edges[first + 1 : last + 1], target_edges[row + 1])
        # Edges that coincide in exact arithmetic may differ in the last bit.
        overlap = np.maximum(upper - lower, 0.0)
        result.append((first, overlap / overlap.sum()))
    return tuple(result)


@lru_cache(maxsize=16)
def _shared_rows(height: int, rows: int) -> tuple[tuple[int, Float64], ...]:
    """Return weights as `_row_weights` does, but divide each input row between two output rows."""
    area, target_edges = -np.diff(row_edges(height)), row_edges(rows)
    place = (np.arange(len(area)) + 0.5) * rows / len(area) - 0.5
    shares = np.maximum(1.0 - np.abs(np.clip(place, 0, rows - 1) - np.arange(rows)[:, None]), 0.0)
    energy = shares * area
    # Rows differ in area, so output and input rows are scaled alternately until the totals of both
    # are right.
    for _ in range(_ROUNDS):
        energy *= (-np.diff(target_edges) / energy.sum(axis=1))[:, None]
        energy *= area / energy.sum(axis=0)
    energy = 0.5 * (energy + energy[::-1, ::-1])
    energy /= energy.sum(axis=1, keepdims=True)
    firsts = (energy > 0).argmax(axis=1).tolist()
    return tuple(
        (first, row[first:][: int((row > 0).sum())])
        for first, row in zip(firsts, energy, strict=True)
    )


def _shared_columns(width: int, columns: int, turn_deg: float) -> Float64:
    """Return weights as `_column_weights` does, but divide each input column between two."""
    shift = turn_deg * width / 360.0
    away = (np.arange(width)[:, None] + 0.5 - shift) * columns / width - 0.5 - np.arange(columns)
    away = np.abs((away + columns / 2) % columns - columns / 2)
    shares = np.maximum(1.0 - away, 0.0)
    return np.asarray(shares / shares.sum(axis=0))


def _column_weights(width: int, columns: int, turn_deg: float) -> Float64:
    """Return the weights of the input columns in the output columns, (width, columns).

    Each column of the matrix sums to 1.
    """
    # In units of input columns, and within [0, width) since turning is periodic.
    shift = (turn_deg * width / 360.0) % width
    nearest = round(shift)
    if abs(shift - nearest) < 1e-9 * width:
        shift = float(nearest)
    step = width / columns
    matrix = np.zeros((width, columns))
    column = np.arange(columns)
    start, stop = shift + column * step, shift + (column + 1) * step
    first, last = np.floor(start).astype(np.intp), np.ceil(stop).astype(np.intp)
    for index in (first + k for k in range(int((last - first).max()))):
        overlap = np.minimum(index + 1.0, stop) - np.maximum(index, start)
        matrix[index % width, column] += np.maximum(overlap, 0.0)
    return np.asarray(matrix / matrix.sum(axis=0))
