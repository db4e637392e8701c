"""Light sources for a bake: the texels of an environment, or lamps near the head.

Both are lists of columns. A transport has one column for each texel, and the pictures of the studio
styles have one for each lamp. The rest of the package treats both alike.

This module also converts a full matrix of texel columns to the mirror-symmetric, low-rank form that
ships with the program.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import Table
from app.core.baking.scene import MILLIMETRES_PER_UNIT
from app.core.base.arrays import Float32, Float64, Int64
from app.core.styles.style import StyleLamp


class Columns(Protocol):
    """A list of light sources, each integrated over its own small area."""

    @property
    def count(self) -> int:
        """Number of columns."""
        ...

    def directions(self) -> Float32:
        """Return the unit vectors, (count, 3), from between the eyes to the columns' centres."""
        ...

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """Return one point in a column's area, as seen from a position.

        Args:
            column: Column index for each lane.
            position: Point that receives the light, in scene units.
            s, t: Coordinates in [0, 1). Uniform values cover the column's area evenly.

        Returns:
            direction: Unit vector from the position to the point.
            distance: Distance in scene units, or infinity for texels.
            weight: Radiance times solid angle (steradians) that the column would have at the
                position if every point in the column were like this one.
        """
        ...


@dataclass(frozen=True, slots=True)
class TexelColumns:
    """The texels of an H x W environment at turn 0, each with radiance 1."""

    height: int
    width: int

    @property
    def count(self) -> int:
        """Number of texels."""
        return self.height * self.width

    def directions(self) -> Float32:
        """See `Columns.directions`."""
        elevation = np.pi / 2 - (np.arange(self.height) + 0.5) / self.height * np.pi
        azimuth = ((np.arange(self.width) + 0.5) / self.width - 0.5) * 2 * np.pi
        level, up = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
        shape = (self.height, self.width)
        parts = [-np.sin(azimuth) * level, np.broadcast_to(up, shape), np.cos(azimuth) * level]
        return np.stack(parts, axis=-1).reshape(-1, 3).astype(np.float32)

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """See `Columns.sample`."""
        import drjit as dr
        import mitsuba as mi

        row, place = column // self.width, column % self.width
        upper = dr.cos(mi.Float(row) * (dr.pi / self.height))
        lower = dr.cos(mi.Float(row + 1) * (dr.pi / self.height))
        up = upper + (lower - upper) * t
        azimuth = ((mi.Float(place) + s) / self.width - 0.5) * dr.two_pi
        level = dr.sqrt(dr.maximum(0, 1 - up * up))
        direction = mi.Vector3f(-dr.sin(azimuth) * level, up, dr.cos(azimuth) * level)
        return direction, dr.inf, (upper - lower) * (dr.two_pi / self.width)


class LampColumns:
    """Round, flat lamps at a finite distance that face the point between the eyes.

    A lamp of power 1 gives irradiance 1 at that point, on a surface that faces the lamp.
    """

    def __init__(self, lamps: Sequence[StyleLamp], eye_point: tuple[float, float, float]) -> None:
        toward = np.array([lamp.direction for lamp in lamps])
        distance = np.array([lamp.distance_m * 1000 / MILLIMETRES_PER_UNIT for lamp in lamps])
        radius = distance * np.array(
            [math.tan(math.radians(lamp.diameter_deg / 2)) for lamp in lamps]
        )
        side = np.cross(toward, [0.0, 1.0, 1e-3])
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        self._directions = toward.astype(np.float32)
        self._axes = tuple(Table(axis) for axis in (toward, side, np.cross(side, toward)))
        self._centres = Table(np.array(eye_point) + toward * distance[:, None])
        self._radius = Table(radius)
        # Radiance times area, so that the weight below is an irradiance: E = L A / d^2 = power.
        self._intensity = Table(np.array([lamp.power for lamp in lamps]) * distance**2)

    @property
    def count(self) -> int:
        """Number of lamps."""
        return len(self._directions)

    def directions(self) -> Float32:
        """See `Columns.directions`."""
        return self._directions

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """See `Columns.sample`."""
        import drjit as dr
        import mitsuba as mi

        toward, side, over = (axis.take(column) for axis in self._axes)
        disc = mi.warp.square_to_uniform_disk_concentric(mi.Point2f(s, t))
        radius = self._radius.take(column)
        place = self._centres.take(column) + (side * disc.x + over * disc.y) * radius
        offset = place - position
        squared = dr.squared_norm(offset)
        distance = dr.sqrt(squared)
        direction = offset / distance
        facing = dr.maximum(0, dr.dot(direction, toward))
        return direction, distance, self._intensity.take(column) * facing / squared


def mirror_pixels(pixels: NDArray[np.int32], size: int) -> Int64:
    """Return the index of each pixel's mirror image, or the pixel's own index if there is none.

    Args:
        pixels: (P,) int32. Sorted flat indices into a square picture.
        size: Side of that picture, in pixels.

    Returns:
        (P,) int64. Indices in `pixels`.
    """
    mirrored = pixels // size * size + size - 1 - pixels % size
    where = np.searchsorted(pixels, mirrored)
    where = np.minimum(where, len(pixels) - 1)
    is_match = pixels[where] == mirrored
    return np.where(is_match, where, np.arange(len(pixels)))


def symmetrise(matrix: Float32, twin: Int64, texels: TexelColumns) -> tuple[Float32, float]:
    """Average a matrix with its own mirror image.

    The two halves of a symmetric head are traced independently, so their difference also measures
    the noise.

    Args:
        matrix: (P, H * W, 3) float32. Transport matrix.
        twin: (P,) int. Index of each pixel's mirror image.

    Returns:
        symmetric: (P, H * W, 3) float32. The averaged matrix.
        noise: Median over the texels of the RMS noise after averaging, divided by the RMS of the
            picture.
    """
    shape = (len(matrix), texels.height, texels.width, 3)
    mirrored = matrix[twin].reshape(shape)[:, :, ::-1].reshape(matrix.shape)
    noise = float(np.median(texel_noise(matrix, mirrored))) / math.sqrt(2)
    return np.float32(0.5) * (matrix + mirrored), noise


def texel_noise(one: Float32, two: Float32) -> Float64:
    """Estimate the noise in each texel from two independent bakes: RMS difference / sqrt 2 / RMS.

    Args:
        one, two: (P, T, 3) float32. Transport matrices of the same pixels.

    Returns:
        (T,) float64. Relative noise of each texel.
    """
    difference = np.square(one - two).mean(axis=(0, 2), dtype=np.float64)
    power = np.maximum((one * two).mean(axis=(0, 2), dtype=np.float64), 1e-30)
    return np.asarray(np.sqrt(difference / 2 / power))


def compress(matrix: Float32, texels: TexelColumns, rank: int) -> tuple[Float32, Float32, float]:
    """Return the best low-rank form of a transport matrix, weighting all texels' pictures equally.

    Every basis function over the texels is even or odd under mirroring. A mirrored panorama
    therefore produces exactly the mirrored picture.

    Args:
        matrix: (P, H * W, 3) float32. Transport matrix.

    Returns:
        pixel_basis: (3, P, R) float32. Functions over the pixels, for each channel.
        texel_basis: (R, H * W) float32. Functions over the texels, shared by the channels.
        truncation: 95th percentile over the texels of the RMS error divided by the RMS.
    """
    flat = matrix.transpose(0, 2, 1).reshape(-1, texels.count)
    basis, scale = texel_functions([flat], texels, rank)
    flat = flat / scale
    projected = flat @ basis.T
    residual = np.square(flat - projected @ basis).mean(axis=0) / np.square(flat).mean(axis=0)
    pixel_basis = projected.reshape(len(matrix), 3, -1).transpose(1, 0, 2)
    truncation = float(np.sqrt(np.percentile(residual, 95)))
    return np.ascontiguousarray(pixel_basis), basis * scale, truncation


def texel_functions(
    matrices: Sequence[Float32], texels: TexelColumns, rank: int, evenness: float = 1.0
) -> tuple[Float32, Float32]:
    """Find the even and odd functions over the texels that capture most of several matrices.

    Args:
        matrices: Matrices, each (n, H * W) float32.
        evenness: 1 to give every texel's picture the same weight, or 0 to weight each picture by
            its light.

    Returns:
        basis: (rank, H * W) float32. Functions that are orthonormal over texels divided by their
            scale.
        scale: (H * W,) float32. Scale of each texel.
    """
    count, half = texels.count, texels.width // 2
    power = [np.square(one).mean(axis=0, dtype=np.float64) for one in matrices]
    scale = np.sqrt(np.mean(power, axis=0))
    scale = np.maximum(scale, 1e-3 * scale.max())
    mirrored = scale.reshape(texels.height, texels.width)[:, ::-1].ravel()
    scale = ((scale + mirrored) / 2) ** evenness
    gram = np.zeros((count, count))
    for one in matrices:
        flat = one / scale.astype(np.float32)
        gram += flat.T @ flat
    values, functions = [], []
    for sign in (1.0, -1.0):
        to_half = np.zeros((count, texels.height * half))
        grid = np.arange(count).reshape(texels.height, texels.width)
        left, right = grid[:, :half].ravel(), grid[:, ::-1][:, :half].ravel()
        to_half[left, np.arange(len(left))] = np.sqrt(0.5)
        to_half[right, np.arange(len(left))] = sign * np.sqrt(0.5)
        energy, vectors = np.linalg.eigh(to_half.T @ gram @ to_half)
        values.append(energy)
        functions.append((to_half @ vectors).T)
    order = np.argsort(-np.concatenate(values))[:rank]
    return np.concatenate(functions)[order].astype(np.float32), scale.astype(np.float32)
