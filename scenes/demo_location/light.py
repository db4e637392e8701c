"""Sky and sun in absolute units: radiance whose luminance is in cd/m2."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from scenes.demo_location.frame import SUN_AZIMUTH, SUN_ELEVATION, direction
from scenes.demo_location.noise import fractal, smooth

__all__ = ["SUN_RADIUS_DEG", "sky", "sun_radiance"]

Floats = NDArray[np.float32]
SUN_RADIUS_DEG: Final = 0.2665
_LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722])
_SUN_LUX: Final = 78_000.0  # on a surface that faces the sun
_ZENITH: Final = 3_300.0  # cd/m2, without clouds
_CIE_CLEAR: Final = (-1.0, -0.32, 10.0, -3.0, 0.45)  # CIE S 011, type 12, as published


def sun_radiance() -> tuple[float, float, float]:
    """Return the radiance of the sun's disc, linear Rec. 709."""
    solid = 2 * np.pi * (1 - np.cos(np.radians(SUN_RADIUS_DEG)))
    tint = np.array([1.10, 0.99, 0.80])
    r, g, b = _SUN_LUX / solid * tint / (tint @ _LUMINANCE)
    return float(r), float(g), float(b)


def sky(seed: int, shape: tuple[int, int] = (512, 1024)) -> Floats:
    """Return a clear summer sky with a few clouds above dull ground, (H, W, 3)."""
    rows, columns = shape
    v, u = np.meshgrid(
        (np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij"
    )
    elevation, azimuth = np.pi * (0.5 - v), 2 * np.pi * (u - 0.5)
    ray = np.stack(
        [
            -np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
            np.cos(azimuth) * np.cos(elevation),
        ],
        axis=2,
    )
    up = np.maximum(ray[..., 1], 0.012)
    cosine = np.clip(ray @ direction(SUN_AZIMUTH, SUN_ELEVATION), -1, 1)
    a, b, c, d, e = _CIE_CLEAR
    away = np.arccos(cosine)
    zenith_away = np.radians(90 - SUN_ELEVATION)

    def scatter(x: np.ndarray | float) -> np.ndarray:
        return np.asarray(1 + c * (np.exp(d * x) - np.exp(d * np.pi / 2)) + e * np.cos(x) ** 2)

    value = (1 + a * np.exp(b / up)) * scatter(away)
    value /= (1 + a * np.exp(b)) * scatter(zenith_away)
    hazy = np.exp(-up / 0.16)[..., None]
    blue, pale = np.array([0.42, 0.70, 1.32]), np.array([0.88, 1.0, 1.16])
    tint = blue + (pale - blue) * np.clip(hazy + 0.55 * np.exp(-away / 0.22)[..., None], 0, 1)
    picture = _ZENITH * value[..., None] * tint / (tint @ _LUMINANCE)[..., None]
    picture = _clouds(picture, ray, up, away, seed)
    ground = 1_300 * np.array([0.9, 1.0, 0.72])
    below = smooth(0.012, -0.012, ray[..., 1].astype(np.float32))[..., None]
    return (picture + (ground - picture) * below).astype(np.float32)


def _clouds(
    picture: NDArray[np.float64], ray: NDArray[np.float64], up: NDArray[np.float64],
    away: NDArray[np.float64], seed: int,
) -> NDArray[np.float64]:  # fmt: skip
    field = fractal(np.random.default_rng(seed), (1024, 1024), (9, 9), 0.58)
    wisps = fractal(np.random.default_rng(seed + 1), (1024, 1024), (5, 28), 0.62)
    scale = 70.0
    x = (ray[..., 0] / (up + 0.09) * scale).astype(int) % 1024
    z = (ray[..., 2] / (up + 0.09) * scale).astype(int) % 1024
    body = (
        smooth(0.75, 1.6, field[z, x])[..., None]
        * smooth(0.012, 0.1, up.astype(np.float32))[..., None]
    )
    bright = 9_000 + 9_000 * np.exp(-away / 0.35)
    shade = 0.62 + 0.38 * smooth(2.3, 0.9, field[z, x])
    body = body * smooth(0.05, 0.2, away.astype(np.float32))[..., None]
    cloud = (bright * shade)[..., None] * np.array([1.0, 1.0, 1.02])
    veil = 0.28 * smooth(0.3, 2.2, wisps[z, x])[..., None]
    return np.asarray(picture + (cloud - picture) * np.clip(body + veil, 0, 0.97), float)
