"""What can be said of a place from its light alone: its lamps, and where it is only a lower bound.

A place that is opened again, or a panorama from elsewhere, comes without the clip mask of its
merge. Where its bracket is known, the level at which the darkest frame clipped is known too, and
that is all it takes: what is at that level may have been brighter.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.base.errors import ProbeError
from app.core.hdr.advice import kind_words
from app.core.hdr.frame import Merged
from app.core.hdr.lights import find_lights, light_grid
from app.core.hdr.merge import reference_exposure
from app.core.hdr.sun_finder import find_sun

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Float32
    from app.core.base.colour import FloatImage


_NEAR: Final = 0.985  # of the clip level: the last code before the highest, and rounding in files
_SHOWN: Final = (512, 1024)
_LEAST_SHARE: Final = 0.0005


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp, a window, the sun, as it is listed.

    `kind` is of `kind_words`. Azimuth and elevation are of the centre of its light, the
    diameter of the disc with the same solid angle, degrees. `share` of the place's light, 0 to
    1, is a lower bound where it is clipped.
    """

    letter: str
    kind: str
    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    share: float
    clipped: bool


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """What was found in a place's light.

    `clipped`, (512, 1024) float32, is the share of each texel that is clipped; None where
    nothing is.
    """

    lamps: tuple[Lamp, ...] = ()
    clipped: Float32 | None = field(default=None, repr=False)

    @property
    def clipped_lamps(self) -> tuple[Lamp, ...]:
        """Those that are clipped, the largest share first."""
        return tuple(lamp for lamp in self.lamps if lamp.clipped)


def clip_level(stops: Sequence[float]) -> float | None:
    """Radiance at which the darkest frame of a bracket clips, in the unit of its merge.

    `stops` are true exposures above any common one; None without any.

    >>> clip_level([2.0, 0.0, -2.0])
    4.0
    """
    if not stops:
        return None
    return float(2.0 ** (reference_exposure(stops) - min(stops)))


def clipped_share(radiance: FloatImage, level: float | None) -> Float32:
    """Mark where a panorama, (H, W, 3), is only known from below: (H, W), 1 or 0.

    1 where the largest channel reaches the `level` of `clip_level`; None where nothing is
    clipped.
    """
    if level is None:
        return np.zeros(radiance.shape[:2], np.float32)
    return np.asarray(radiance.max(axis=2) >= _NEAR * level, np.float32)


def find(radiance: FloatImage, level: float | None = None, cd_m2: float | None = None) -> Findings:
    """Look for the lamps of a place, (H, 2 H, 3) linear Rec. 709, and for what is clipped.

    `level` is the radiance at which it clips (`clip_level`), `cd_m2` the luminance of radiance
    1; None where not known.
    """
    lost = clipped_share(radiance, level)
    merged = Merged(
        radiance=radiance,
        clipped=lost,
        dark=np.zeros_like(lost),
        reference_ev=0.0,
        clip_level=level or 2.0 * float(radiance.max()),
        cd_m2=cd_m2,
    )
    try:
        grid = light_grid(merged)
        lights = find_lights(merged, grid)
    except ProbeError:
        return Findings()
    sun = find_sun(merged, lights, grid)
    lamps = tuple(
        Lamp(
            light.id,
            kind_words(light, sun),
            light.azimuth_deg,
            light.elevation_deg,
            light.diameter_deg,
            light.share,
            light.clipped,
        )
        for light in lights
        if light.share >= _LEAST_SHARE
    )
    return Findings(lamps, _shrunk(lost) if lost.any() else None)


def _shrunk(lost: Float32) -> Float32:
    """Reduce a mask for showing it; what covers a part of a texel stays seen."""
    if lost.shape[0] <= _SHOWN[0]:
        return lost
    size = (_SHOWN[1], _SHOWN[0])
    return np.asarray(cv2.resize(lost, size, interpolation=cv2.INTER_AREA), np.float32)
