"""Find and fill the gaps of a panorama.

Stitchers lay half a panorama, or one without its floor, on a black canvas. Darkness that was
photographed is hardly ever black over a whole area, and what is around it is dark, too: canvas is
black to its edge, and ends abruptly. A scene with lamps in a black void is mostly black and stays
as it is.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Floats
from app.core.base.colour import FloatImage
from app.core.base.sphere import bounded, solid_angles, wrapped
from app.core.measure.finish.inpainting import components, fill
from app.core.measure.read.frame import MergedLight

BLACK_OF_LIGHT: Final = 1e-5
"""Of the median of what is not black: what rounding and lossy packing leave of black."""

GOES_ON: Final = 8.0
"""Times brighter than around: what a gap cuts, as a window, goes on in it."""

_WIDEST: Final = 4096
_COLUMNS: Final = 512
_LEAST: Final = 0.01  # of the sphere, of one area
_MOST: Final = 0.75  # of the sphere, of all areas
_ABRUPT: Final = (0.005, 0.05)  # of the median: light just outside the edge; of codes
_AT_EDGE: Final = 0.7  # of the edge, that is so bright


def filled(radiance: FloatImage, unseen: Bools) -> FloatImage:
    """Fill gaps, (H, 2 H) bool, from the light around them.

    Raises:
        ProbeError: When less than a tenth of the sphere was seen.
    """
    if radiance.shape[1] > _WIDEST:
        return _filled_coarsely(radiance, unseen)
    nothing = np.zeros(unseen.shape, np.float32)
    merged = MergedLight(radiance, nothing, nothing, reference_ev=0.0, clip_level=1.0)
    return fill(merged, unseen.astype(np.float32), GOES_ON).radiance


def _filled_coarsely(radiance: FloatImage, unseen: Bools) -> FloatImage:
    """Fill a panorama that has no room beside it for another, in place."""
    share = bounded(unseen.astype(np.float32), _WIDEST)
    small = filled(bounded(radiance, _WIDEST), np.asarray(share > 0.0))
    size = (radiance.shape[1], 1)
    radiance.flags.writeable = True
    for row in np.flatnonzero(unseen.any(axis=1)).tolist():
        line = small[row * len(small) // len(radiance)][None]
        fine = cv2.resize(line, size, interpolation=cv2.INTER_LINEAR)[0]
        radiance[row, unseen[row]] = fine[unseen[row]]
    radiance.flags.writeable = False
    return radiance


def canvas(radiance: FloatImage, black: float | None = None) -> Bools | None:
    """Return a mask, (H, W), of black canvas; None without any.

    Args:
        radiance: Float32, (H, 2 H, 3). Linear radiance, finite, not negative.
        black: Largest value of black in any channel; by default relative to the light.
    """
    if radiance.shape[1] > _WIDEST:
        coarse = canvas(bounded(radiance, _WIDEST), black)
        size = (radiance.shape[1], radiance.shape[0])
        if coarse is None:
            return None
        return cv2.resize(coarse.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    largest = radiance.max(axis=-1)
    bright = largest[largest > 0.0]
    if not bright.size or float(largest.min()) > (black or 0.0) + BLACK_OF_LIGHT * float(
        bright.max()
    ):
        return None
    middle = float(np.median(bright[:: max(bright.size >> 20, 1)]))
    dark = largest <= (BLACK_OF_LIGHT * middle if black is None else black)
    abrupt = middle * _ABRUPT[0 if black is None else 1]
    small, light = _reduced(dark), _reduced_light(largest)
    areas = [part for part in components(small) if _is_canvas(part, light, abrupt)]
    if not areas:
        return None
    marks = np.logical_or.reduce(areas)
    if _share(marks) > _MOST:
        return None
    near = cv2.dilate(wrapped(marks.astype(np.uint8), 2), np.ones((3, 3), np.uint8))[:, 2:-2]
    size = (dark.shape[1], dark.shape[0])
    return np.asarray(dark & (cv2.resize(near, size, interpolation=cv2.INTER_NEAREST) > 0))


def _is_canvas(part: Bools, light: Float32, abrupt: float) -> bool:
    if not _LEAST <= _share(part) <= _MOST:
        return False
    grown = [_grown(part, steps) for steps in (1, 3)]
    edge = light[grown[1] & ~grown[0]]
    return bool(edge.size and (edge >= abrupt).mean() >= _AT_EDGE)


def _grown(part: Bools, steps: int) -> Bools:
    side = 2 * steps + 1
    margin = wrapped(part.astype(np.uint8), side)
    return cv2.dilate(margin, np.ones((side, side), np.uint8))[:, side:-side] > 0


def _reduced(dark: Bools) -> Bools:
    """Texels that are dark all over, at most `_COLUMNS` wide."""
    width = min(dark.shape[1], _COLUMNS)
    share = cv2.resize(dark.astype(np.float32), (width, width // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(share > 0.999)


def _reduced_light(largest: Floats) -> Float32:
    width = min(largest.shape[1], _COLUMNS)
    small = cv2.resize(largest, (width, width // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def _share(part: Bools) -> float:
    """Share of the sphere."""
    areas = solid_angles((part.shape[0], part.shape[1])) * part.shape[1] / (4.0 * np.pi)
    return float((part.mean(axis=1, dtype=np.float64) * areas).sum())
