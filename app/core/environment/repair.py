"""Repair the radiance of a panorama: infinite values, NaN and negative light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.arrays import Bools, Float64
from app.core.base.colour import FloatImage
from app.core.base.errors import EnvironmentFileError
from app.core.base.imaging.image_input import COPY_AGAIN
from app.core.environment.remarks import Repaired
from app.core.text import tr

HALF_MOST: Final = 65504.0
"""Largest half float. Anything brighter was saved as this value or as infinity."""

INFINITE: Final = 3e5
"""Radiance that replaces infinity.

Suns that are too bright for a half float have a radiance of 1e5 to 1e6 if that of the sky is 1.
"""

_MOST_REPAIRED: Final = 0.03  # maximum damaged fraction of the sphere or of the light
BAND_ROWS: Final = 64
"""Number of rows that are changed at a time, to save memory."""


@dataclass(frozen=True, slots=True)
class Repairs:
    """Counts of repaired texels, and the radiance (`level`) that replaced infinite values."""

    nan: int = 0
    infinite: int = 0
    negative: int = 0
    level: float = 0.0

    @property
    def total(self) -> int:
        """Sum of all counts. A texel with two kinds of damage counts twice."""
        return self.nan + self.infinite + self.negative

    def remarks(self, name: str) -> tuple[Repaired, ...]:
        """Return a remark about the repairs, if there were any."""
        if not self.total:
            return ()
        return (Repaired(name, self.nan, self.infinite, self.negative, self.level),)


def repair(radiance: FloatImage, name: str) -> tuple[Repairs, Bools | None]:
    """Make every value finite and non-negative, in place.

    NaN and negative values become 0. Infinite values become the largest finite value, or
    `INFINITE` if that is larger, because a half float is infinite beyond `HALF_MOST` and infinite
    floats mostly come from halves.

    Args:
        radiance: Float32, (H, W, 3). Linear radiance. It is changed in place, band by band, which
            avoids copying a large panorama.

    Returns:
        The counts, and an (H, W) bool mask of the infinite texels, or None if there are none.

    Raises:
        EnvironmentFileError: If the panorama is black, or if more than 3% of the sphere or of the
            light is damaged.
    """
    bands = [radiance[row : row + BAND_ROWS] for row in range(0, len(radiance), BAND_ROWS)]
    areas = np.split(row_areas(*radiance.shape[:2]), range(BAND_ROWS, len(radiance), BAND_ROWS))
    nan = infinite = negative = 0
    largest = unknown = below_zero = 0.0
    for band, area in zip(bands, areas, strict=True):
        finite = np.isfinite(band)
        top = float(np.max(band, where=finite, initial=0.0))
        largest = max(largest, top)
        if finite.all() and float(band.min()) >= 0.0:
            continue
        holes, below = np.isnan(band), band < 0.0
        nan += _texels(holes)
        negative += _texels(below)
        infinite += _texels(np.isposinf(band))
        unknown += float(area @ (~finite).any(axis=-1).sum(axis=1))
        below_zero -= float(area @ np.sum(band, axis=(1, 2), where=below & finite, dtype=float))
        band[holes | below] = 0.0
    if largest <= 0.0:
        raise EnvironmentFileError(
            tr("{name} is completely black.", name=name),
            tr("Choose another panorama."),
        )
    if unknown > _MOST_REPAIRED:
        raise EnvironmentFileError(
            tr(
                "{name} is damaged: {unknown:.0f}% of the sphere is NaN or infinite.",
                name=name,
                unknown=100.0 * unknown,
            ),
            COPY_AGAIN,
        )
    clipped: Bools | None = None
    level = max(largest, INFINITE) if infinite else 0.0
    if infinite:
        clipped = np.asarray(np.isposinf(radiance).any(axis=-1))
        for band in bands:
            band[np.isposinf(band)] = level
    if below_zero:
        light = sum(
            float(a @ b.sum(axis=(1, 2), dtype=float)) for a, b in zip(areas, bands, strict=True)
        )
        if below_zero > _MOST_REPAIRED * light:
            raise EnvironmentFileError(
                tr("{name} is damaged: many of its values are negative.", name=name), COPY_AGAIN
            )
    return Repairs(nan, infinite, negative, level), clipped


def row_areas(height: int, width: int) -> Float64:
    """Return the fraction of the sphere that one texel in each row covers, (H,) float64."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return (edges[:-1] - edges[1:]) / (2.0 * width)


def _texels(bad: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> int:
    return int(np.count_nonzero(bad.any(axis=-1)))
