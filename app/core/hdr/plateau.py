"""Clipped light in a panorama that says nothing of it: many texels at one maximum.

Where a file was clipped, whatever was brighter has the same value in the end. Measured light hardly
ever has: of 42 panoramas none has texels within 0.2 % of its maximum that outnumber those just
below. Half floats, Radiance's shared exponent and resampling spread the value by up to a percent,
so wider bands are tried, too, where more texels are needed. Lossy compression overshoots: then the
common value is somewhat below the maximum (`benchmarks/marred_panoramas.py`).

A panel of even radiance, as renderers make them, has a plateau too, but ends abruptly all around.
Around whatever was clipped some light is nearly as bright.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Floats
from app.core.base.colour import FloatImage
from app.core.base.sphere import wrapped

# Width of the band under the maximum; least texels in it; least share of those in and under it.
_BANDS: Final = ((0.002, 2, 0.5), (0.01, 6, 0.5), (0.03, 12, 0.6))
_BANDS_OF_ONE: Final = ((0.002, 3, 0.5), (0.01, 12, 0.5), (0.03, 24, 0.6))  # of one channel
_BELOW: Final = 0.9  # of the band's lower end
_LOSSY: Final = 0.02  # width to both sides of the common value
_LOSSY_LEAST, _LOSSY_ABOVE = 20, 0.1  # texels in the band; share of them that may be above it
_LEAST_PANEL: Final = 10  # texels: a small clipped lamp may end as abruptly
_NEAR: Final = 0.25  # of the plateau
_RANKS: Final = (3, 10, 30, 100, 300, 1000, 3000)


def plateau(radiance: FloatImage) -> Bools | None:
    """Mark the texels that share the maximum of all channels or of one, (H, W); None where few do.

    Args:
        radiance: Float32, (H, W, 3). Linear radiance, finite.
    """
    marks = None
    for channel in range(-1, 3):
        plane = radiance.max(axis=-1) if channel < 0 else radiance[..., channel]
        level = _level(plane, _BANDS if channel < 0 else _BANDS_OF_ONE)
        if level is not None:
            here = np.asarray(plane >= level)
            marks = here if marks is None else np.asarray(marks | here)
    return None if marks is None or _is_panel(marks, radiance) else marks


def _is_panel(marks: Bools, radiance: FloatImage) -> bool:
    """Whether nothing beyond a plateau's very edge, two texels wide, comes near it."""
    if int(marks.sum()) < _LEAST_PANEL:
        return False
    plane = radiance.max(axis=-1)
    bright = (plane >= _NEAR * float(plane[marks].min())).astype(np.uint8)
    near = cv2.dilate(wrapped(marks.astype(np.uint8), 2), np.ones((5, 5), np.uint8))[:, 2:-2]
    return not (bright & ~near.astype(np.bool_)).any()


def _level(plane: Floats, bands: tuple[tuple[float, int, float], ...]) -> float | None:
    """Lower end of the values that a plane, (H, W), was clipped to; None where it was not."""
    top = float(plane.max())
    if top <= 0.0:
        return None
    near = np.sort(plane[plane >= 0.75 * top])

    def count(low: float) -> int:
        return len(near) - int(np.searchsorted(near, low))

    for width, texels, share in bands:
        low = top * (1.0 - width)
        if count(low) >= max(texels, share * count(low * _BELOW)):
            return low
    for value in (float(near[-1 - rank]) for rank in _RANKS if rank < len(near)):
        low, above = value * (1.0 - _LOSSY), count(np.nextafter(value * (1.0 + _LOSSY), np.inf))
        band = count(low) - above
        below = count(low * _BELOW) - count(low)
        if band >= max(_LOSSY_LEAST, below) and above <= _LOSSY_ABOVE * band:
            return low
    return None
