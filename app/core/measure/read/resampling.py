"""Resample pictures of the sphere.

A `Reduction` scales down panoramas band by band while they are being created, preserving energy. It
computes the same means as `environment.environment.reduce_radiance`, weighted by solid angle along
a column and by width along a row, for any pair of sizes. A band of rows contributes to the rows of
the result that it overlaps, and the contributions add up.

A `Chart` is a square picture centred on a direction, for operations that a panorama's poles and
edges would disturb. The stereographic kind preserves angles (it is conformal), so a function that
is harmonic on it is also harmonic on the sphere. In the equidistant kind, the distance from the
middle is the angle from the centre. Directions are in the coordinate system of
`app.core.base.sphere`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Final, Literal, Self, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64
from app.core.base.colour import FloatImage
from app.core.base.progress import Token
from app.core.base.sphere import direction, wrapped
from app.core.measure.read.pixels import workers

_MOST_PERIOD: Final = 256
_BAND_PIXELS: Final = 400_000


@dataclass(frozen=True, slots=True)
class Reduction:
    """A reduction from one size to another, each given as rows and columns.

    Create a reduction with `Reduction.between`.
    """

    source: tuple[int, int]
    target: tuple[int, int]
    _given_edges: Float64 = field(repr=False)
    _wanted_edges: Float64 = field(repr=False)
    _period: Float32 | None = field(repr=False)

    @classmethod
    def between(cls, source: tuple[int, int], target: tuple[int, int], panorama: bool) -> Self:
        """Prepare a reduction, weighting the rows of a panorama by their solid angle.

        Raises:
            ValueError: If the target has more rows or columns than the source.
        """
        if target[0] > source[0] or target[1] > source[1] or min(target) < 1:
            raise ValueError(f"cannot reduce {source} to {target}")
        common = math.gcd(source[1], target[1])
        period = source[1] // common, target[1] // common
        matrix = _overlaps(*period).T.astype(np.float32) if period[0] <= _MOST_PERIOD else None
        edges = _sines if panorama else lambda rows: 1.0 - np.arange(rows + 1) / rows
        return cls(source, target, edges(source[0]), edges(target[0]), matrix)

    @property
    def whole(self) -> bool:
        """Whether the two sizes are equal, in which case nothing is reduced."""
        return self.source == self.target

    def band_rows(self, pixels: int) -> int:
        """Return the number of rows in a band of about `pixels`, in whole periods if possible."""
        rows = max(1, pixels // self.source[1])
        period = self.source[0] // math.gcd(self.source[0], self.target[0])
        return rows // period * period if period <= rows else rows

    def rows(self, start: int, stop: int) -> tuple[int, Float32]:
        """Return how input rows ``start..stop`` contribute to the rows of the result.

        Returns:
            The first row of the result, and the weights for `reduced`, (k, n, m) float32. Each of
            the k blocks of m rows, in whole periods, contributes to n rows. Over all bands, the
            weights for one row of the result sum to 1.
        """
        height, rows = self.source[0], self.target[0]
        first, last = start * rows // height, -(-stop * rows // height)
        top, bottom = self._wanted_edges[first:last, None], self._wanted_edges[first + 1 :, None]
        bottom = bottom[: last - first]
        edges = self._given_edges[start : stop + 1]
        overlap = np.minimum(top, edges[:-1]) - np.maximum(bottom, edges[1:])
        shares = np.maximum(overlap, 0.0) / (top - bottom)
        shares = shares.astype(np.float32)
        common = math.gcd(height, rows)
        target_step, source_step = rows // common, height // common
        if start % source_step or stop % source_step:
            return first, shares[None]
        # Periods do not overlap, which saves three quarters of the work, or more.
        count = (stop - start) // source_step
        blocks = shares.reshape(count, target_step, count, source_step)
        return first, np.ascontiguousarray(blocks[np.arange(count), :, np.arange(count)])

    def reduced(self, shares: Float32, plane: Float32) -> Float32:
        """Reduce one channel's contiguous rows, (stop - start, W), with the weights from `rows`."""
        narrow = self._columns(plane).reshape(len(shares), -1, self.target[1])
        return np.asarray(shares @ narrow).reshape(-1, self.target[1])

    def _columns(self, plane: Float32) -> Float32:
        """Average rows, (n, W), to the target columns, (n, w)."""
        count, width = plane.shape
        if self._period is not None:
            blocks: Float32 = plane.reshape(-1, self._period.shape[0]) @ self._period
            return blocks.reshape(count, self.target[1])
        # For sizes with almost no common factor, take differences of the running sum at the edges.
        sums = np.zeros((count, width + 1))
        np.cumsum(plane, axis=1, dtype=np.float64, out=sums[:, 1:])
        edges = np.arange(self.target[1] + 1) * (width / self.target[1])
        left = np.minimum(edges.astype(np.intp), width - 1)
        share = edges - left
        at = sums[:, left] * (1.0 - share) + sums[:, left + 1] * share
        means: Float64 = np.diff(at, axis=1) * (self.target[1] / width)
        return np.maximum(means, 0.0).astype(np.float32)


def light_in_bands(
    size: tuple[int, int],
    samples: int,
    whole: int,
    band: Callable[[int, int], tuple[Float32, Float32]],
    token: Token,
) -> tuple[Float32, Float32]:
    """Build a panorama of light, (*size, 3), and fractions, (*size, 2), band by band.

    Args:
        samples: Number of rows and columns in a band per row and column of the result.
        whole: Number by which a band's row count must be divisible.
        band: Function that computes rows ``start..stop`` of the light and the fractions at
            `samples` times the resolution.

    Raises:
        Cancelled: If the token is cancelled.
    """
    fine = size[0] * samples, size[1] * samples
    reduction = Reduction.between(fine, size, panorama=True)
    rows = max(_BAND_PIXELS // fine[1] // whole, 1) * whole
    result = np.zeros((*size, 5), np.float32)

    def small(start: int) -> tuple[int, list[Float32]]:
        token.check()
        stop = min(start + rows, fine[0])
        first, parts = reduction.rows(start, stop)
        planes: Iterable[Any] = (plane for part in band(start, stop) for plane in cv2.split(part))
        return first, [reduction.reduced(parts, np.asarray(plane, np.float32)) for plane in planes]

    with ThreadPoolExecutor(workers(fine[0])) as pool:
        for first, planes in pool.map(small, range(0, fine[0], rows)):
            for channel, plane in enumerate(planes):
                result[first : first + len(plane), :, channel] += plane
    return result[..., :3], result[..., 3:]


def _sines(rows: int) -> Float64:
    """Return the sine of the elevation at each edge between rows, from 1 down to -1."""
    return np.asarray(np.cos(np.pi * np.arange(rows + 1) / rows))


def _overlaps(source: int, target: int) -> Float64:
    """Return the weights, (target, source), of equal cells in fewer cells. Each row sums to 1."""
    start = np.arange(target)[:, None] * (source / target)
    cell = np.arange(source)
    overlap = np.minimum(start + source / target, cell + 1) - np.maximum(start, cell)
    shares = np.maximum(overlap, 0.0)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


Kind: TypeAlias = Literal["stereographic", "equidistant"]

_MARGIN: Final = 2


def azimuth_elevation(vector: Float64) -> tuple[float, float]:
    """Return the azimuth and elevation of a vector, (3,), in degrees."""
    x, y, z = (float(part) for part in vector)
    return float(np.degrees(np.arctan2(-x, z))), float(np.degrees(np.arctan2(y, np.hypot(x, z))))


@dataclass(frozen=True, slots=True)
class Chart:
    """A square picture of the sphere around a direction, `side` pixels wide.

    Attributes:
        centre: Azimuth and elevation of the middle, in degrees.
        reach_deg: Angle from the middle to the midpoint of each edge, in degrees, below 180.
    """

    centre: tuple[float, float]
    reach_deg: float
    side: int
    kind: Kind = "stereographic"

    @property
    def axes(self) -> Float64:
        """Unit vectors that point right, up and outwards on the chart, (3, 3), one per row.

        Up points towards the zenith or, if the chart is at the nadir, towards its own azimuth.
        """
        azimuth, elevation = np.radians(self.centre[0]), np.radians(self.centre[1])
        right = direction(self.centre[0] + 90.0, 0.0)
        flat = np.sin(elevation)
        up = np.array([flat * np.sin(azimuth), np.cos(elevation), -flat * np.cos(azimuth)])
        return np.stack([right, up, direction(*self.centre)])

    def distances(self) -> FloatImage:
        """Return each pixel's angle from the middle, (side, side), in degrees."""
        x, y = self._grid()
        return np.degrees(self._angle(np.hypot(x, y))).astype(np.float32)

    def sample(self, panorama: NDArray[Any]) -> NDArray[Any]:
        """Sample a panorama, (H, W) or (H, W, C), at the chart's pixels.

        Sampling is bilinear and crosses the seam. The result is float32 or uint8, matching the
        input.
        """
        height, width = panorama.shape[:2]
        x, y = self._grid()
        radius = np.hypot(x, y)
        angle = self._angle(radius)
        flat = np.sin(angle) / np.maximum(radius, 1e-9)
        right, up, out = self.axes.astype(np.float32)
        where = [flat * (x * right[k] + y * up[k]) + np.cos(angle) * out[k] for k in range(3)]
        azimuth = np.arctan2(-where[0], where[2])
        elevation = np.arctan2(where[1], np.hypot(where[0], where[2]))
        column = (azimuth / (2.0 * np.pi) + 0.5) * width - 0.5 + _MARGIN
        row = (0.5 - elevation / np.pi) * height - 0.5
        wide, border = wrapped(panorama, _MARGIN), cv2.BORDER_REPLICATE
        column, row = column.astype(np.float32), row.astype(np.float32)
        return np.asarray(cv2.remap(wide, column, row, cv2.INTER_LINEAR, borderMode=border))

    def place(self, shape: tuple[int, int], rows: slice) -> tuple[FloatImage, FloatImage]:
        """Return the positions of a panorama's rows on the chart.

        Returns:
            The columns and rows, (rows, W) float32 each, where whole numbers are pixel centres.
            Texels that are not on the chart have positions outside its edges.
        """
        x, y, z = self._coordinates(shape, rows)
        if self.kind == "stereographic":
            # tan(angle / 2) / sin(angle) = 1 / (1 + cos(angle))
            scale = 1.0 / np.maximum(1.0 + z, np.float32(1e-4))
        else:
            across = np.hypot(x, y)
            scale = np.arctan2(across, z) / np.maximum(across, np.float32(1e-9))
        scale *= np.float32(self.side / 2.0 / self._edge())
        half = np.float32(self.side / 2.0 - 0.5)
        return x * scale + half, half - y * scale

    def _coordinates(self, shape: tuple[int, int], rows: slice) -> list[FloatImage]:
        """Return the components of the texels' directions along the chart's axes."""
        height, width = shape
        elevation = np.pi * (0.5 - (np.arange(height)[rows] + 0.5) / height)
        azimuth = 2.0 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
        flat = np.cos(elevation).astype(np.float32)[:, np.newaxis]
        upward = np.sin(elevation)[:, np.newaxis]
        parts = []
        for axis in self.axes:
            around = np.cos(azimuth) * axis[2] - np.sin(azimuth) * axis[0]
            parts.append(flat * around.astype(np.float32) + (axis[1] * upward).astype(np.float32))
        return parts

    def _edge(self) -> float:
        reach = float(np.radians(self.reach_deg))
        return float(np.tan(reach / 2.0)) if self.kind == "stereographic" else reach

    def _grid(self) -> tuple[FloatImage, FloatImage]:
        """Return the pixels' coordinates, to the right and upwards, in the unit of `_edge`."""
        steps = (2.0 * (np.arange(self.side) + 0.5) / self.side - 1.0) * self._edge()
        x, y = np.meshgrid(steps.astype(np.float32), -steps.astype(np.float32))
        return x, y

    def _angle(self, radius: FloatImage) -> FloatImage:
        """Convert a distance on the chart to the angle from the middle, in radians."""
        if self.kind == "equidistant":
            return np.minimum(radius, np.float32(np.pi))
        return np.asarray(2.0 * np.arctan(radius), np.float32)


def wrapped_blur(picture: FloatImage, sigma: float) -> FloatImage:
    """Blur a panorama, (H, W) or (H, W, C), across its seam. `sigma` is in pixels."""
    room = min(int(np.ceil(3.0 * sigma)) + 1, picture.shape[1])
    border = cv2.BORDER_REPLICATE
    soft = cv2.GaussianBlur(wrapped(picture, room), (0, 0), sigma, borderType=border)
    return np.asarray(soft[:, room:-room], np.float32)


def log_light(light: Float32) -> Float32:
    """Return the logarithm of luminance, in stops, with a floor that depends on the picture.

    Args:
        light: (H, W) float32. Luminance on an arbitrary scale.
    """
    floor = 0.2 * float(np.percentile(light, 5.0)) + 0.02 * float(np.median(light)) + 1e-9
    return np.asarray(np.log2(light + np.float32(floor)), np.float32)


def likeness(looks: Sequence[Float32], weights: Sequence[Float32], shift: int) -> float:
    """Return the correlation of two panoramas over their shared area, with the second rotated.

    Args:
        looks, weights: One pair of pictures and one pair of weights, (H, W) float32 each.
        shift: Rotation of the second panorama, in columns.
    """
    weight = weights[0] * np.roll(weights[1], shift, axis=1)
    total = max(float(weight.sum()), 1e-9)
    off = [t - float((t * weight).sum()) / total for t in (looks[0], np.roll(looks[1], shift, 1))]
    moments = [float((weight * a * b).sum()) for a, b in (off, off[:1] * 2, off[1:] * 2)]
    return moments[0] / math.sqrt(max(moments[1] * moments[2], 1e-12))
