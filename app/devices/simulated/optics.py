"""Lenses and sensor of a simulated camera: resampling, noise and metering."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import FloatImage, srgb_encode
from app.core.environment.environment import reduce_radiance, solid_angles
from app.core.measure.read.frame import Exposure
from app.devices.simulated.cameras import CameraModel

_BRIGHTEST: Final = 8.0
"""Light above this multiple of saturation always clips, regardless of noise."""


def saturation_cd_m2(exposure: Exposure) -> float:
    """Return the luminance of white that saturates an exposure, in cd/m2 (ISO 12232)."""
    return 1.2 / exposure.factor


def add_sensor_noise(
    share: FloatImage, camera: CameraModel, iso: float, generator: np.random.Generator
) -> None:
    """Replace light with the sensor's counts, including shot noise, read noise and clipping.

    With W electrons at saturation, a pixel that expects n electrons counts a Poisson-distributed
    number of them, plus Gaussian read noise of standard deviation r. The count has mean n, variance
    n + r^2 and third moment n. One normal number z gives all three by the Cornish-Fisher expansion,
    n + s z + n / (6 s^2) (z^2 - 1) with s^2 = n + r^2 (Abramowitz and Stegun 1964, 26.2.49). Where
    n is large, this is a Gaussian. This method is ten times as fast as sampling a Poisson
    distribution.

    Args:
        share: NDArray[np.float32], (..., W, 3), contiguous. Light as a fraction of saturation,
            overwritten with the counted fraction, 0 to 1.

    Raises:
        ValueError: If the array is not contiguous.
    """
    wells = camera.full_well * camera.base_iso / iso / np.asarray(camera.channel_gains)
    # Treat pixels as flat rows, since loops over three channels are slow.
    counts = share.reshape(-1, share.shape[-2] * share.shape[-1])
    if not np.shares_memory(counts, share):
        raise ValueError("noise is added in place, to contiguous arrays only")
    electrons = np.tile(wells, share.shape[-2]).astype(np.float32)
    # Kept above 0, so that a dark pixel without read noise counts 0.
    read = np.float32(max(camera.read_noise**2, 1e-12))
    np.minimum(counts, np.float32(_BRIGHTEST), out=counts)
    counts *= electrons
    normal = _normal(counts.shape, generator)
    variance = counts + read
    skew = counts / variance
    skew *= np.float32(1.0 / 6.0)
    counts -= skew
    skew *= normal
    skew += np.sqrt(variance, out=variance)
    skew *= normal
    counts += skew
    counts *= np.float32(1.0) / electrons
    np.clip(counts, 0.0, 1.0, out=counts)


def _normal(shape: tuple[int, ...], generator: np.random.Generator) -> FloatImage:
    """Draw from 65,536 equally likely normal values, much faster than exact sampling would be."""
    count = math.prod(shape)
    picks = np.frombuffer(generator.bytes(2 * count), dtype="<u2")
    return np.take(_quantiles(), picks, mode="clip").reshape(shape)


@lru_cache(maxsize=1)
def _quantiles() -> FloatImage:
    """Return 65,536 quantiles of the normal distribution, scaled to variance 1."""
    count = 1 << 16
    inverse = NormalDist().inv_cdf
    half = np.array([inverse((index + 0.5) / count) for index in range(count // 2)])
    values = np.concatenate([half, -half[::-1]])
    result: FloatImage = (values / values.std()).astype(np.float32)
    result.flags.writeable = False
    return result


def meter(
    environment: FloatImage,
    camera: CameraModel,
    *,
    scale: float = 1.0,
    target: float = 0.46,
) -> Exposure:
    """Return the exposure with which an automatic camera brings the mean sRGB value to `target`.

    The mean is taken over the sphere, at base ISO and the widest aperture. The exposure time is not
    rounded to the camera's list.

    Args:
        environment: NDArray[np.float32], (H, 2 H, 3). Linear Rec. 709 light, not all black.
        scale: Luminance in cd/m2 of one unit of the environment.
        target: Mean of the encoded values, 0 to 1.

    Returns:
        An exposure whose mean is within 0.001 of `target`, if the environment allows it.
    """
    height, width = environment.shape[:2]
    step = max(height // 256, 1)
    light = np.asarray(environment[::step, ::step], dtype=np.float64) * scale
    weights = solid_angles((height, width))[::step, None, None] + np.zeros(light.shape)
    low, high = -40.0, 40.0
    for _ in range(40):
        stops = 0.5 * (low + high)
        mean = np.average(srgb_encode(light * 2.0**stops), weights=weights)
        low, high = (stops, high) if mean < target else (low, stops)
    aperture = min(camera.apertures)
    unit = Exposure(1.0, camera.base_iso, aperture)
    return Exposure(saturation_cd_m2(unit) * 2.0**low, camera.base_iso, aperture)


_SEAM_DEG: Final = 5.0


def column_gains(width: int, lens_gain: tuple[float, float]) -> NDArray[np.float64]:
    """Return the gain of each column of a panorama. The front lens sees the centre half.

    Returns:
        NDArray[np.float64], (width,). Gains, blended smoothly within 5 degrees of the seams at
        azimuth 90 and -90.
    """
    azimuth = 360.0 * ((np.arange(width) + 0.5) / width - 0.5)
    front = np.clip(0.5 + (90.0 - np.abs(azimuth)) / (2.0 * _SEAM_DEG), 0.0, 1.0)
    front = front * front * (3.0 - 2.0 * front)
    return lens_gain[1] + (lens_gain[0] - lens_gain[1]) * front


Taps: TypeAlias = tuple[NDArray[np.intp], NDArray[np.float32]]
"""The first of two neighbouring texels for each pixel, and the weight of the second."""


@dataclass(frozen=True, slots=True)
class FrameView:
    """An environment prepared for one frame, to be sampled in bands of rows.

    Attributes:
        shape: Rows and columns of the frame.
        texels: (H, columns, 3) float32. The environment with an extra row at each pole, resampled
            to the columns of the frame.
        rows: The two rows mixed for each row of the frame, with their weights.
    """

    shape: tuple[int, int]
    texels: FloatImage
    rows: Taps

    def band(self, start: int, stop: int) -> FloatImage:
        """Sample rows `start` to `stop` as a new (stop - start, W, 3) float32 radiance array."""
        first, share = self.rows[0][start:stop], self.rows[1][start:stop, None, None]
        if not share.any():
            return self.texels[first]
        mixed = self.texels[first + 1]
        mixed *= share
        mixed += self.texels[first] * (1.0 - share)
        return mixed


def view_of(environment: FloatImage, shape: tuple[int, int]) -> FrameView:
    """Prepare an environment for sampling. Each texel has one constant value over its area.

    Args:
        environment: (H, 2 H, 3) float32. Linear radiance, on an arbitrary scale.

    Raises:
        ValueError: If the environment does not have three channels, or if the sizes differ and
            either is not 2:1.
    """
    padded, (height, width) = padded_texels(environment, shape)
    return FrameView(
        shape,
        mix_columns(padded, area_taps(width, shape[1])),
        area_taps(height, shape[0], spherical=True),
    )


def padded_texels(
    environment: FloatImage, shape: tuple[int, int]
) -> tuple[FloatImage, tuple[int, int]]:
    """Add a wrapped texel on each side, and scale down to `shape` if that is smaller.

    Returns:
        The texels as (H + 2, W + 2, 3) float32, and H and W.

    Raises:
        ValueError: As in `view_of`.
    """
    if environment.ndim != 3 or environment.shape[2] != 3:
        raise ValueError(f"an environment is (H, W, 3), not {environment.shape}")
    source_shape = (environment.shape[0], environment.shape[1])
    panoramas = source_shape[1] == 2 * source_shape[0] and shape[1] == 2 * shape[0]
    if not panoramas and source_shape != shape:
        raise ValueError(f"only 2:1 panoramas can be resized, not {source_shape} to {shape}")
    texels = np.asarray(environment, dtype=np.float32)
    if shape[0] < source_shape[0]:
        texels = reduce_radiance(texels, shape)
    height, width = texels.shape[:2]
    around = np.concatenate([texels[:, -1:], texels, texels[:, :1]], axis=1)
    half = width // 2
    poles = [np.roll(texels[row : row + 1], half, axis=1) for row in (0, height - 1)]
    over = [np.concatenate([pole[:, -1:], pole, pole[:, :1]], axis=1) for pole in poles]
    padded = np.ascontiguousarray(np.concatenate([over[0], around, over[1]]))
    return padded, (height, width)


def mix_columns(padded: FloatImage, taps: Taps) -> FloatImage:
    """Resample the columns of an environment to those of a frame."""
    first, share = taps
    if not share.any():
        return np.ascontiguousarray(padded[:, first])
    weights = share[:, None]
    return np.ascontiguousarray(padded[:, first] * (1.0 - weights) + padded[:, first + 1] * weights)


def area_taps(source: int, target: int, *, spherical: bool = False) -> Taps:
    """Return the two texels of the padded environment that the area of each pixel covers."""
    edges = np.arange(target + 1) * (source / target)
    first = np.floor(edges[:-1] + 1e-9)
    cut = np.minimum(np.maximum(first + 1.0, edges[:-1]), edges[1:])
    top, cut, bottom = (
        -np.cos(np.pi * at / source) if spherical else at for at in (edges[:-1], cut, edges[1:])
    )
    share = (bottom - cut) / (bottom - top)
    share[share < 1e-9] = 0.0
    return (first + 1).astype(np.intp), share.astype(np.float32)
