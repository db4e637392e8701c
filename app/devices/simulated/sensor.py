"""The sensor of a simulated camera: what saturates it, and what it counts."""

from __future__ import annotations

import math
from functools import lru_cache
from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.colour import srgb_encode
from app.core.hdr.frame import Exposure
from app.core.solver.environment import solid_angles

if TYPE_CHECKING:
    from app.core.base.colour import FloatImage
    from app.devices.simulated.cameras import CameraModel

_BRIGHTEST: Final = 8.0
"""Light above this share of saturation clips whatever the noise is."""


def saturation_cd_m2(exposure: Exposure) -> float:
    """Luminance of white that saturates an exposure.

    Returns:
        cd/m2; see `app.core.hdr.frame.Exposure.saturation_cd_m2`.
    """
    return 1.2 / exposure.factor


def add_sensor_noise(
    share: FloatImage, camera: CameraModel, iso: float, generator: np.random.Generator
) -> None:
    """Replace light by what a sensor counts of it: shot noise, read noise, clipping.

    With W electrons at saturation, a pixel that expects n electrons counts a Poisson number of
    them plus Gaussian read noise of standard deviation r: mean n, variance n + r^2, third moment
    n. One normal number z gives all three by the Cornish-Fisher expansion,
    n + s z + n / (6 s^2) (z^2 - 1) with s^2 = n + r^2 (Abramowitz and Stegun 1964, 26.2.49),
    which is a Gaussian where n is large, and ten times as fast as counting.

    Args:
        share: NDArray[np.float32], (..., W, 3). Light as a share of saturation; overwritten by the
            counted share, 0 to 1. Contiguous.

    Raises:
        ValueError: When the array is not contiguous.
    """
    wells = camera.full_well * camera.base_iso / iso / np.asarray(camera.channel_gains)
    # As rows, since loops over three channels at a time would be slow.
    counts = share.reshape(-1, share.shape[-2] * share.shape[-1])
    if not np.shares_memory(counts, share):
        raise ValueError("noise is added in place, to contiguous arrays only")
    electrons = np.tile(wells, share.shape[-2]).astype(np.float32)
    # Never 0, so that what expects nothing and has no read noise counts nothing.
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
    """Draw normal numbers from 65,536 equally likely ones: several times as fast as exact ones."""
    count = math.prod(shape)
    chosen = np.frombuffer(generator.bytes(2 * count), dtype="<u2")
    return np.take(_quantiles(), chosen, mode="clip").reshape(shape)


@lru_cache(maxsize=1)
def _quantiles() -> FloatImage:
    """Quantiles of the normal distribution in the middle of 65,536 equal shares, variance 1."""
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
    """Find the exposure that an automatic camera would choose: mean sRGB value at `target`.

    The mean is taken over the sphere, at base ISO and the widest aperture; the exposure time is
    whatever it takes and lies on no list of the camera's.

    Args:
        environment: NDArray[np.float32], (H, 2 H, 3). Linear Rec. 709 light, not all black.
        scale: Luminance in cd/m2 of one unit.
        target: Mean of the coded values, 0 to 1.

    Returns:
        With that mean within 0.001, where the environment allows it.
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
