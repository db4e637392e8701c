"""Views of a simulated camera that is tilted or shifted, or of a scene without texels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from app.core.base import sphere
from app.core.base.arrays import Float64
from app.core.base.colour import FloatImage
from app.devices.simulated.optics import FrameView, Taps, area_taps, mix_columns, padded_texels


@dataclass(frozen=True, slots=True)
class RotatedView:
    """An environment as seen by a rotated frame.

    Attributes:
        shape: Rows and columns of the frame.
        texels: (H + 2, W + 2, 3) float32. The environment with one more texel at each side.
        rotation: From directions in the frame to directions in the environment.
        smooth: Whether texels are interpolated linearly.
    """

    shape: tuple[int, int]
    texels: FloatImage
    rotation: Float64
    smooth: bool

    def band(self, start: int, stop: int) -> FloatImage:
        """Sample rows `start` to `stop`: (stop - start, W, 3) float32 radiance, a new array."""
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
) -> FrameView | RotatedView:
    """Prepare an environment for sampling; as `app.devices.simulated.optics.view_of` by default.

    Args:
        environment: (H, 2 H, 3) float32. Linear radiance, any scale.
        smooth: Whether texels are interpolated linearly, which looks like a photo.
        rotation: (3, 3) float64. From directions in the frame to directions in the environment;
            None for no rotation.

    Raises `ValueError` as there, and if a rotated environment is not 2:1.
    """
    if rotation is not None and environment.shape[1] != 2 * environment.shape[0]:
        raise ValueError(f"only 2:1 panoramas can be rotated, not {environment.shape[:2]}")
    padded, (height, width) = padded_texels(environment, shape)
    if rotation is not None:
        return RotatedView(shape, padded, rotation, smooth or shape == (height, width))
    if smooth:
        columns, rows = (_line_taps(*sizes) for sizes in ((width, shape[1]), (height, shape[0])))
    else:
        columns = area_taps(width, shape[1])
        rows = area_taps(height, shape[0], spherical=True)
    return FrameView(shape, mix_columns(padded, columns), rows)


def _line_taps(given: int, wanted: int) -> Taps:
    """Return the two texels whose centres surround each pixel's centre."""
    edges = np.arange(wanted + 1) * (given / wanted)
    middle = 0.5 * (edges[:-1] + edges[1:]) - 0.5
    first = np.floor(middle + 1e-9)
    share = np.maximum(middle - first, 0.0)
    share[share < 1e-9] = 0.0
    return (first + 1).astype(np.intp), share.astype(np.float32)
