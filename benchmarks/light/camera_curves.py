"""Camera curves that violate the light probe's assumptions like real cameras do.

Every curve is strictly increasing, maps 0 to 0 and 1 to 1, and is invertible.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray


_STEPS: Final = 65536


@dataclass(frozen=True, slots=True)
class Curve:
    """An invertible camera curve.

    Attributes:
        forward: From linear light in 0..1 (float64 array) to coded values in 0..1.
    """

    name: str
    forward: Callable[[NDArray[np.float64]], NDArray[np.float64]] = field(repr=False)

    def encode(self, linear: ArrayLike) -> NDArray[np.float64]:
        """Encode linear light.

        Args:
            linear: array_like, any shape. Linear light, 1 = saturation; clipped to 0..1.

        Returns:
            float64, same shape. Coded values in 0..1.
        """
        return self.forward(np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0))

    def table(self) -> NDArray[np.uint8]:
        """Return the bytes for equal steps of the square root of linear light.

        Returns:
            (65536,) uint8. Entry i is the byte of linear light (i / 65535)**2, rounded to nearest.
        """
        roots = np.arange(_STEPS) / (_STEPS - 1)
        return np.asarray(np.rint(self.encode(roots**2) * 255.0), dtype=np.uint8)

    def decode(self, coded: ArrayLike) -> NDArray[np.float64]:
        """Invert `encode` by bisection, without a second formula that could disagree with it.

        Args:
            coded: array_like, any shape. Coded values; clipped to 0..1.

        Returns:
            float64, same shape. Linear light in 0..1, within 1e-12.
        """
        wanted = np.clip(np.asarray(coded, dtype=np.float64), 0.0, 1.0)
        low, high = np.zeros_like(wanted), np.ones_like(wanted)
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = self.forward(middle) < wanted
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.asarray(np.where(wanted >= 1.0, 1.0, np.where(wanted <= 0.0, 0.0, high)))

    def response(self) -> NDArray[np.float64]:
        """Return the linear light of each byte, the result of a perfect recovery.

        Returns:
            (256,) float64. Linear light in 0..1, strictly rising.
        """
        return self.decode(np.arange(256) / 255.0)


def _srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Apply IEC 61966-2-1."""
    power = 1.055 * np.power(linear, 1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, power)


def _rec709(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Apply ITU-R BT.709-6, item 1.2, with its exact constants, so that it is continuous."""
    power = 1.09929682680944 * np.power(linear, 0.45) - 0.09929682680944
    return np.where(linear <= 0.018053968510807, 4.5 * linear, power)


def _filmic(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sRGB, then 45 % of the way to 3 t^2 - 2 t^3: darker shadows, brighter highlights."""
    t = _srgb(linear)
    return t + 0.45 * (t * t * (3.0 - 2.0 * t) - t)


def _shoulder(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sRGB of a lifted, rolled-off picture: mid-tones +0.8 stops, highlights flat."""
    rolled = np.expm1(-1.6 * linear) / np.expm1(-1.6)
    return _srgb(rolled)


def _log(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.log1p(200.0 * linear) / np.log1p(200.0))


def _gamma(power: float) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    def forward(linear: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.power(linear, 1.0 / power))

    return forward


SRGB: Final = Curve("srgb", _srgb)
REC_709: Final = Curve("rec709", _rec709)
GAMMA_18: Final = Curve("gamma-1.8", _gamma(1.8))
GAMMA_22: Final = Curve("gamma-2.2", _gamma(2.2))
GAMMA_26: Final = Curve("gamma-2.6", _gamma(2.6))
FILMIC: Final = Curve("filmic", _filmic)
SHOULDER: Final = Curve("shoulder", _shoulder)
LOG: Final = Curve("log", _log)

CURVES: Final = (SRGB, REC_709, GAMMA_18, GAMMA_22, GAMMA_26, FILMIC, SHOULDER, LOG)
"""All curves; sRGB first."""


def curve_named(name: str) -> Curve:
    """Return a curve by its name.

    Args:
        name: For example "srgb" or "gamma-2.6".

    Raises:
        ValueError: If there is none of that name.
    """
    for curve in CURVES:
        if curve.name == name:
            return curve
    raise ValueError(f"there is no curve {name!r}; known: {', '.join(c.name for c in CURVES)}")
