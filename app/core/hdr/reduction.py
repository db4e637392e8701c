"""Reducing panoramas while they are being made, band by band, without losing energy.

The same means as `app.core.solver.environment.reduce_radiance`: weighted by solid angle along a
column and by width along a row, for any pair of sizes. A band of rows contributes to the rows of
the result that it overlaps, and the contributions add up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from typing import Self

    from app.core.base.arrays import Float32, Float64


_MOST_PERIOD: Final = 256


@dataclass(frozen=True, slots=True)
class Reduction:
    """From pictures of one size (rows, columns) to another, smaller or equal.

    Make it with `Reduction.between`.
    """

    given: tuple[int, int]
    wanted: tuple[int, int]
    _given_edges: Float64 = field(repr=False)
    _wanted_edges: Float64 = field(repr=False)
    _period: Float32 | None = field(repr=False)

    @classmethod
    def between(cls, given: tuple[int, int], wanted: tuple[int, int], panorama: bool) -> Self:
        """Prepare a reduction; rows of a panorama count by their solid angle.

        ValueError when more rows or columns are wanted than given.
        """
        if wanted[0] > given[0] or wanted[1] > given[1] or min(wanted) < 1:
            raise ValueError(f"cannot reduce {given} to {wanted}")
        common = math.gcd(given[1], wanted[1])
        period = given[1] // common, wanted[1] // common
        matrix = _overlaps(*period).T.astype(np.float32) if period[0] <= _MOST_PERIOD else None
        edges = _sines if panorama else _equal
        return cls(given, wanted, edges(given[0]), edges(wanted[0]), matrix)

    @property
    def whole(self) -> bool:
        """Whether nothing is to be reduced."""
        return self.given == self.wanted

    def band_rows(self, pixels: int) -> int:
        """Rows per band of about so many pixels, in whole periods of rows where they fit."""
        rows = max(1, pixels // self.given[1])
        period = self.given[0] // math.gcd(self.given[0], self.wanted[0])
        return rows // period * period if period <= rows else rows

    def rows(self, start: int, stop: int) -> tuple[int, Float32]:
        """Return what given rows ``start..stop`` contribute to the rows of the result.

        The first row that they touch, and shares, (n, stop - start) float32; over all bands
        those of one row of the result sum to 1.
        """
        height, rows = self.given[0], self.wanted[0]
        first, last = start * rows // height, -(-stop * rows // height)
        top, bottom = self._wanted_edges[first:last, None], self._wanted_edges[first + 1 :, None]
        bottom = bottom[: last - first]
        given = self._given_edges[start : stop + 1]
        overlap = np.minimum(top, given[:-1]) - np.maximum(bottom, given[1:])
        shares = np.maximum(overlap, 0.0) / (top - bottom)
        return first, shares.astype(np.float32)

    def columns(self, plane: Float32) -> Float32:
        """Average one channel's contiguous rows, (n, W), to the columns wanted, (n, w)."""
        count, width = plane.shape
        if self._period is not None:
            blocks: Float32 = plane.reshape(-1, self._period.shape[0]) @ self._period
            return blocks.reshape(count, self.wanted[1])
        # Sizes with hardly a common factor: differences of the running sum at the edges.
        sums = np.zeros((count, width + 1))
        np.cumsum(plane, axis=1, dtype=np.float64, out=sums[:, 1:])
        edges = np.arange(self.wanted[1] + 1) * (width / self.wanted[1])
        left = np.minimum(edges.astype(np.intp), width - 1)
        share = edges - left
        at = sums[:, left] * (1.0 - share) + sums[:, left + 1] * share
        means: Float64 = np.diff(at, axis=1) * (self.wanted[1] / width)
        return np.maximum(means, 0.0).astype(np.float32)


def _sines(rows: int) -> Float64:
    """Sine of elevation of the rows' edges, from 1 down to -1."""
    edges: Float64 = np.cos(np.pi * np.arange(rows + 1) / rows)
    return edges


def _equal(rows: int) -> Float64:
    """Edges of rows that all count the same, from 1 down to 0."""
    return 1.0 - np.arange(rows + 1) / rows


def _overlaps(given: int, wanted: int) -> Float64:
    """Shares (wanted, given) of equal cells in fewer equal cells; each row sums to 1."""
    start = np.arange(wanted)[:, None] * (given / wanted)
    cell = np.arange(given)
    overlap = np.minimum(start + given / wanted, cell + 1) - np.maximum(start, cell)
    shares = np.maximum(overlap, 0.0)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))
