"""The field of view of a camera that nobody stated, from how a pose enlarges its picture.

What the panorama shows wider than the picture does may be so for two reasons: the lens is wider
than was thought, which enlarges everything by one factor, or the camera stands further from things
than the probe did, which enlarges near things more than far ones and never makes any smaller. So
where all points are enlarged alike it is the lens; else it is what the furthest of them show, which
are hardly any nearer to the probe than to the camera. How much nearer nobody knows: so the lens is
taken that is most likely, and phones and cameras have few.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Float64: TypeAlias = NDArray[np.float64]

ASSUMED_DEG: Final = 60.0
"""Field of view along the longer side of a picture, where it is not known."""

_ALIKE: Final = 0.0045  # standard deviation of the factors where the probe itself stood
_FARTHEST: Final = 0.10  # share of the points that are as good as far away
_LEFT: Final = (0.20, 0.10)  # logarithm of how much those are still enlarged: mean and spread
_LENSES: Final = (  # focal length for a frame of 36 x 24 mm, and of how many in a hundred pictures
    (26.0, 26), (24.0, 20), (28.0, 16), (23.0, 7), (35.0, 10), (50.0, 13), (13.0, 5), (77.0, 5),
    (31.0, 5), (70.0, 2),
)  # fmt: skip
_SAME_LENS: Final = 0.025  # spread of the logarithm of a lens: rounded, bent, steadied
_OTHER_LENS: Final = 0.05  # density of all others
_FRAME_MM: Final = math.hypot(36.0, 24.0)
_LEFT_AWAY: Final = 0.25  # made smaller: a wall at 7 m, as it is from 1.5 m nearer
_FEWEST: Final = 8
_WITHIN: Final = (0.4, 3.5)  # what a lens and parallax can do together


def assumed_fov(size: tuple[int, int]) -> float:
    """Return the horizontal field of view that is assumed where none is known, deg.

    Args:
        size: Columns and rows of the picture, upright.
    """
    half = math.tan(math.radians(ASSUMED_DEG) / 2.0) * size[0] / max(size)
    return math.degrees(2.0 * math.atan(half))


def lens_factor(zooms: Float64, shape: float = 4.0 / 3.0, *, away: bool = False) -> float:
    """Return by what factor of the picture plane a lens is wider than was assumed.

    Args:
        zooms: (N,) float64. By how much each point is enlarged; nan where that cannot be said.
        away: Whether the camera looks away from the sitter: it is then nearer to things than the
            probe was, which makes near things smaller in the panorama and none any larger.
    """
    said = zooms[(zooms > _WITHIN[0]) & (zooms < _WITHIN[1])]
    if len(said) < _FEWEST:
        return 1.0
    low, middle, high = np.quantile(said, [0.25, 0.5, 0.75])
    if away:
        return float(np.quantile(said, 1.0 - _FARTHEST)) * (1.0 + _LEFT_AWAY)
    spread = (high - low) / 1.35 / middle
    if spread < _ALIKE:
        return float(middle)
    share = min((spread - _ALIKE) / _ALIKE, 1.0)
    far = _likely_lens(float(np.quantile(said, _FARTHEST)), shape)
    return float(math.exp((1.0 - share) * math.log(middle) + share * math.log(far)))


def _likely_lens(farthest: float, shape: float) -> float:
    """Return the most likely factor by how much the farthest points are enlarged."""
    left = np.linspace(0.0, 0.8, 401)
    mean, spread = _LEFT
    tangents = math.log(farthest * math.tan(math.radians(ASSUMED_DEG) / 2.0)) - left
    density = np.full_like(left, _OTHER_LENS)
    for focal, count in _LENSES:
        known = math.log(_FRAME_MM / 2.0 / focal * shape / math.hypot(shape, 1.0))
        away = (tangents - known) / _SAME_LENS
        density += count / 100.0 * np.exp(-0.5 * away**2) / (_SAME_LENS * math.sqrt(math.tau))
    best = int(np.argmax(np.log(density) - 0.5 * ((left - mean) / spread) ** 2))
    return farthest * math.exp(-float(left[best]))
