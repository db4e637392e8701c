"""Detect and fill gaps in a panorama.

Stitching programs place a partial panorama, such as one without a floor, on a black canvas. A dark
area in a photo is rarely black throughout, and its surroundings are dark too, whereas a canvas is
black up to its edge and ends abruptly. A scene of lamps in a black void is mostly black and is left
unchanged.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Floats
from app.core.base.colour import FloatImage, largest_channel
from app.core.base.sphere import bounded, solid_angles, wrapped
from app.core.measure.finish.inpainting import components, fill
from app.core.measure.read.frame import MergedLight

BLACK_OF_LIGHT: Final = 1e-5
"""Largest value that counts as black, relative to the median of all other values.

Rounding and lossy compression can turn black into values up to this limit.
"""

GOES_ON: Final = 8.0
"""Maximum brightness of light that is continued into a gap, relative to the gap's surroundings.

Such light may come from a window that is cut off by the gap.
"""

_WIDEST: Final = 4096
_COLUMNS: Final = 512
_LEAST: Final = 0.01  # minimum fraction of the sphere for one area
_MOST: Final = 0.75  # maximum fraction of the sphere for one area, and for all areas together
# minimum light just outside the edge: relative to the median, and in code values
_ABRUPT: Final = (0.005, 0.05)
_AT_EDGE: Final = 0.7  # minimum fraction of the edge that is at least as bright as that


def filled(radiance: FloatImage, unseen: Bools) -> FloatImage:
    """Fill gaps, marked in an (H, 2 H) bool mask, from the light around them.

    Raises:
        ProbeError: If less than a tenth of the sphere is visible.
    """
    if radiance.shape[1] > _WIDEST:
        return _filled_coarsely(radiance, unseen)
    nothing = np.zeros(unseen.shape, np.float32)
    merged = MergedLight(radiance, nothing, nothing, reference_ev=0.0, clip_level=1.0)
    return fill(merged, unseen.astype(np.float32), GOES_ON).radiance


def _filled_coarsely(radiance: FloatImage, unseen: Bools) -> FloatImage:
    """Fill the gaps of a panorama in place when there is no memory for a second panorama."""
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
    """Return a mask, (H, W), of black canvas, or None if there is none.

    Args:
        radiance: (H, 2 H, 3) float32. Linear radiance, finite and non-negative.
        black: Largest value that counts as black in any channel, or None to choose a limit relative
            to the light.
    """
    if radiance.shape[1] > _WIDEST:
        coarse = canvas(bounded(radiance, _WIDEST), black)
        size = (radiance.shape[1], radiance.shape[0])
        if coarse is None:
            return None
        return cv2.resize(coarse.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    largest = largest_channel(radiance)
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
    """Return the texels that are entirely dark, on a grid at most `_COLUMNS` wide."""
    width = min(dark.shape[1], _COLUMNS)
    share = cv2.resize(dark.astype(np.float32), (width, width // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(share > 0.999)


def _reduced_light(largest: Floats) -> Float32:
    width = min(largest.shape[1], _COLUMNS)
    small = cv2.resize(largest, (width, width // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def _share(part: Bools) -> float:
    """Return the fraction of the sphere that a mask covers, 0 to 1."""
    areas = solid_angles((part.shape[0], part.shape[1])) * part.shape[1] / (4.0 * np.pi)
    return float((part.mean(axis=1, dtype=np.float64) * areas).sum())
