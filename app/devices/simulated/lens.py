"""The two lenses of a simulated camera: the light they spread, and their gains."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.solver.environment import energy

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.base.colour import FloatImage

_SEAM_DEG: Final = 5.0


def bloomed(environment: FloatImage, part: float, sigma_deg: float) -> FloatImage:
    """Spread a part of the light as a lens does, by a Gaussian of constant angular width.

    Along rows the width in columns grows as the texels narrow towards the poles; along columns
    the spread passes over the poles. A uniform environment stays uniform, and the energy is kept.

    Parameters
    ----------
    environment : NDArray[np.float32], (H, 2 H, 3)
        Linear radiance.
    part : float
        Share of the light that is spread, 0 to 1.
    sigma_deg : float
        Standard deviation in degrees, > 0.

    Returns
    -------
    NDArray[np.float32], (H, 2 H, 3)
        Linear radiance with the same energy in each channel.

    Raises
    ------
    ValueError
        When the share or the width is out of range.
    """
    if not 0.0 <= part <= 1.0 or sigma_deg <= 0.0:
        raise ValueError("bloom is a share from 0 to 1, its width greater than 0")
    height, width = environment.shape[:2]
    over = np.roll(environment[::-1], width // 2, axis=1)
    meridians = np.concatenate([environment, over]).astype(np.float32)
    waves = np.fft.rfftfreq(2 * height) * (sigma_deg * height / 180.0)
    down = np.fft.rfft(meridians, axis=0) * _gaussian(waves)[:, None, None]
    column_wise = np.fft.irfft(down, n=2 * height, axis=0)[:height]
    level = np.sin(np.pi * (np.arange(height) + 0.5) / height)
    waves = np.outer(1.0 / level, np.fft.rfftfreq(width) * (sigma_deg * width / 360.0))
    across = np.fft.rfft(column_wise, axis=1) * _gaussian(waves)[:, :, None]
    spread = np.maximum(np.fft.irfft(across, n=width, axis=1), 0.0).astype(np.float32)
    wanted, held = energy(environment), energy(spread)
    spread *= np.divide(wanted, held, out=np.ones_like(wanted), where=held > 0).astype(np.float32)
    return np.asarray(environment + np.float32(part) * (spread - environment), dtype=np.float32)


def column_gains(width: int, lens_gain: tuple[float, float]) -> NDArray[np.float64]:
    """Gain of each column of a panorama: the front lens sees the centre half of them.

    Returns
    -------
    NDArray[np.float64], (width,)
        Gains, blended smoothly within 5 degrees of the seams at azimuth 90 and -90.
    """
    azimuth = 360.0 * ((np.arange(width) + 0.5) / width - 0.5)
    front = np.clip(0.5 + (90.0 - np.abs(azimuth)) / (2.0 * _SEAM_DEG), 0.0, 1.0)
    front = front * front * (3.0 - 2.0 * front)
    return lens_gain[1] + (lens_gain[0] - lens_gain[1]) * front


def _gaussian(waves: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transform of a Gaussian, for frequency times standard deviation."""
    return np.exp(-2.0 * (np.pi * np.minimum(waves, 4.0)) ** 2)
