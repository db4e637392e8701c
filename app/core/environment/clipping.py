"""Detect clipping that a panorama does not declare by finding many texels that share one maximum.

Clipping gives all brighter light the same value. Unclipped light is hardly ever that even: of 42
panoramas, none has more texels within 0.2% of its maximum than just below that band. Half floats,
Radiance's shared exponent and resampling spread the value by up to a percent, so wider bands, which
require more texels, are tried as well. Lossy compression overshoots, which leaves the common value
slightly below the maximum (`benchmarks/light/marred_panoramas.py`).

An evenly bright panel in a rendered picture is also a plateau, but its edges are abrupt all around.
Clipped light is always surrounded by some light that is nearly as bright.
"""

from __future__ import annotations

import math
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Floats
from app.core.base.colour import FloatImage, largest_channel
from app.core.base.sphere import wrapped

# Relative width of the band below the maximum, minimum number of texels in it, and minimum ratio of
# these to the texels in the band and just below it.
_BANDS: Final = ((0.002, 2, 0.5), (0.01, 6, 0.5), (0.03, 12, 0.6))
# The same for a single channel.
_BANDS_OF_ONE: Final = ((0.002, 3, 0.5), (0.01, 12, 0.5), (0.03, 24, 0.6))
_BELOW: Final = 0.9  # lower limit of values just below the band, relative to the band's lower end
_LOSSY: Final = 0.02  # relative width of the band on each side of the common value
# Minimum number of texels in the band, and maximum number above it as a fraction of these.
_LOSSY_LEAST, _LOSSY_ABOVE = 20, 0.1
_LEAST_PANEL: Final = 10  # texels; a small clipped lamp may have equally abrupt edges
_NEAR: Final = 0.25  # brightness, relative to the plateau, that counts as nearly as bright
_ALL: Final = -1  # stands for the largest of the three channels
_ROWS: Final = 256
_RANKS: Final = (3, 10, 30, 100, 300, 1000, 3000)


def plateau(radiance: FloatImage) -> Bools | None:
    """Return a mask, (H, W), of the clipped texels, or None if too few texels share a value.

    The common value is the maximum of one channel, or of the largest channel.

    Args:
        radiance: (H, W, 3) float32. Linear radiance, finite.
    """
    levels = [
        _level(_near(radiance, channel), _BANDS if channel == _ALL else _BANDS_OF_ONE)
        for channel in range(_ALL, 3)
    ]
    if all(math.isinf(level) for level in levels):
        return None
    marks = np.zeros(radiance.shape[:2], np.bool_)
    for rows in _row_bands(radiance):
        for channel, level in enumerate(levels, _ALL):
            marks[rows] |= _plane(radiance[rows], channel) >= level
    return None if _is_panel(marks, radiance) else marks


def _row_bands(radiance: FloatImage) -> list[slice]:
    """Return bands of rows, since a large panorama leaves no memory for another full-size plane."""
    return [slice(row, row + _ROWS) for row in range(0, len(radiance), _ROWS)]


def _plane(band: FloatImage, channel: int) -> Floats:
    return np.asarray(largest_channel(band) if channel == _ALL else band[..., channel])


def _is_panel(marks: Bools, radiance: FloatImage) -> bool:
    """Return whether a plateau is much brighter than every texel more than two texels from it."""
    if int(marks.sum()) < _LEAST_PANEL:
        return False
    near = cv2.dilate(wrapped(marks.astype(np.uint8), 2), np.ones((5, 5), np.uint8))[:, 2:-2] > 0
    bands = _row_bands(radiance)
    lowest = min(
        float(_plane(radiance[rows], _ALL).min(where=marks[rows], initial=np.inf)) for rows in bands
    )
    return not any(
        ((_plane(radiance[rows], _ALL) >= _NEAR * lowest) & ~near[rows]).any() for rows in bands
    )


def _near(radiance: FloatImage, channel: int) -> Floats:
    """Return a channel's values within 25% of its maximum, in ascending order."""
    bands = _row_bands(radiance)
    top = max(float(_plane(radiance[rows], channel).max()) for rows in bands)
    if top <= 0.0:
        return np.empty(0)
    parts = []
    for rows in bands:
        plane = _plane(radiance[rows], channel)
        parts.append(plane[plane >= 0.75 * top])
    return np.sort(np.concatenate(parts))


def _level(near: Floats, bands: tuple[tuple[float, int, float], ...]) -> float:
    """Return the lowest value that counts as clipped, or infinity if nothing was clipped."""
    if not near.size:
        return math.inf
    top = float(near[-1])

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
    return math.inf
