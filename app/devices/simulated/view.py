"""What a simulated camera sees: an environment enlarged to the frame's size, and rotated.

The truth that a frame can be compared with is `enlarged` of the environment, and for frames of
the environment's own size the environment itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.solver.environment import reduce_radiance

if TYPE_CHECKING:
    from app.core.base.colour import FloatImage

Float64: TypeAlias = NDArray[np.float64]
_Taps: TypeAlias = tuple[NDArray[np.intp], NDArray[np.float32]]
"""First of two neighbouring texels, and the share of the second; one of each per pixel."""


@dataclass(frozen=True, slots=True)
class View:
    """An environment as one frame sees it, ready to be sampled in bands of rows.

    Attributes
    ----------
    shape : tuple[int, int]
        Rows and columns of the frame.
    texels : NDArray[np.float32]
        The environment with one more texel at each side, over the edge and the poles; for
        frames that are not rotated, columns are enlarged already.
    rows : tuple
        Which two of these rows each row of the frame mixes, and in what shares.
    rotation : (3, 3) float64 or None
        From directions in the frame to directions in the environment.
    """

    shape: tuple[int, int]
    texels: FloatImage
    rows: _Taps
    rotation: Float64 | None = None
    smooth: bool = False

    def band(self, start: int, stop: int) -> FloatImage:
        """Sample some rows.

        Parameters
        ----------
        start, stop : int
            First row and the one after the last.

        Returns
        -------
        NDArray[np.float32], (stop - start, W, 3)
            Linear radiance, a new array.
        """
        if self.rotation is not None:
            return self._rotated(start, stop)
        first, share = self.rows[0][start:stop], self.rows[1][start:stop, None, None]
        if not share.any():
            return self.texels[first]
        mixed = self.texels[first + 1]
        mixed *= share
        mixed += self.texels[first] * (1.0 - share)
        return mixed

    def _rotated(self, start: int, stop: int) -> FloatImage:
        height, width = self.shape
        azimuth = 2.0 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
        elevation = np.pi * (0.5 - (np.arange(start, stop) + 0.5) / height)
        level = np.stack([-np.sin(azimuth), np.zeros(width), np.cos(azimuth)], axis=1)
        across = (level @ np.asarray(self.rotation).T).astype(np.float32)
        upward = np.asarray(self.rotation)[:, 1].astype(np.float32)
        vectors = np.cos(elevation).astype(np.float32)[:, None, None] * across
        vectors += np.sin(elevation).astype(np.float32)[:, None, None] * upward
        texels = (self.texels.shape[0] - 2, self.texels.shape[1] - 2)
        columns, rows = sphere.positions(vectors, texels)
        how = cv2.INTER_LINEAR if self.smooth else cv2.INTER_NEAREST
        one = np.float32(1.0)
        sampled = cv2.remap(self.texels, columns + one, rows + one, how)
        return np.asarray(sampled, dtype=np.float32)


def view_of(
    environment: FloatImage,
    shape: tuple[int, int],
    *,
    smooth: bool = False,
    rotation: Float64 | None = None,
) -> View:
    """Prepare an environment for sampling.

    Parameters
    ----------
    environment : NDArray[np.float32], (H, W, 3)
        Linear radiance, any scale.
    shape : tuple[int, int]
        Rows and columns of the frame.
    rotation : (3, 3) float64, optional
        From directions in the frame to directions in the environment; None for no rotation.

    Raises
    ------
    ValueError
        When the environment has no three channels, or sizes differ and one of them is not 2:1.
    """
    if environment.ndim != 3 or environment.shape[2] != 3:
        raise ValueError(f"an environment is (H, W, 3), not {environment.shape}")
    given = (environment.shape[0], environment.shape[1])
    panoramas = given[1] == 2 * given[0] and shape[1] == 2 * shape[0]
    if not panoramas and (given != shape or rotation is not None):
        raise ValueError(f"only 2:1 panoramas can be resized or rotated, not {given} to {shape}")
    texels = np.asarray(environment, dtype=np.float32)
    if shape[0] < given[0]:
        texels = reduce_radiance(texels, shape)
    height, width = texels.shape[:2]
    smooth_at = smooth or shape == (height, width)
    around = np.concatenate([texels[:, -1:], texels, texels[:, :1]], axis=1)
    half = width // 2
    poles = [np.roll(texels[row : row + 1], half, axis=1) for row in (0, height - 1)]
    over = [np.concatenate([pole[:, -1:], pole, pole[:, :1]], axis=1) for pole in poles]
    padded = np.ascontiguousarray(np.concatenate([over[0], around, over[1]]))
    if rotation is None:
        padded = _mix_columns(padded, _taps(width, shape[1], smooth=smooth))
    rows = _taps(height, shape[0], smooth=smooth, spherical=True)
    return View(shape, padded, rows, rotation, smooth_at)


def _mix_columns(padded: FloatImage, taps: _Taps) -> FloatImage:
    first, share = taps
    if not share.any():
        return np.ascontiguousarray(padded[:, first])
    weights = share[:, None]
    return np.ascontiguousarray(padded[:, first] * (1.0 - weights) + padded[:, first + 1] * weights)


def _taps(given: int, wanted: int, *, smooth: bool, spherical: bool = False) -> _Taps:
    """Find the two texels, counted in the padded environment, that each pixel mixes."""
    edges = np.arange(wanted + 1) * (given / wanted)
    if smooth or given == wanted:
        middle = 0.5 * (edges[:-1] + edges[1:]) - 0.5
        first = np.floor(middle + 1e-9)
        share = np.maximum(middle - first, 0.0)
    else:
        first = np.floor(edges[:-1] + 1e-9)
        cut = np.minimum(np.maximum(first + 1.0, edges[:-1]), edges[1:])
        top, cut, bottom = (
            -np.cos(np.pi * at / given) if spherical else at for at in (edges[:-1], cut, edges[1:])
        )
        share = (bottom - cut) / (bottom - top)
    share[share < 1e-9] = 0.0
    return (first + 1).astype(np.intp), share.astype(np.float32)
