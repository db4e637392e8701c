"""Build a panorama from the backgrounds in a video.

The face serves as a grey card: the light that explains the face also determines each frame's
exposure. Lamps and windows are clipped as in any single exposure, and areas that no frame shows are
filled from their surroundings.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.colour import FloatImage, luminance
from app.core.base.sphere import wrapped
from app.core.environment.environment import reduce_radiance
from app.core.measure.film.headings import Background, Headings
from app.core.measure.finish.inpainting import fill
from app.core.measure.photos.mosaic import OrientedPicture, light_around
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import wrapped_blur

SHAPE: Final = (512, 1024)
_MOST: Final = 24  # maximum number of frames, one every 15 degrees
_LEAST: Final = 0.12  # minimum fraction of the sphere from which the rest can be filled
# The camera faces the sitter, so it looks in the direction of the sitter's back.
_BEHIND: Final = np.diag([1.0, -1.0, -1.0])
_CLIPPED: Final = 0.05  # clipped fraction at and above which a texel counts as clipped
_DETAIL: Final = (0.2, 5.0)


def surroundings(
    frames: Sequence[Background], headings: Headings, gains: Float64
) -> tuple[FloatImage, Float32] | None:
    """Combine the backgrounds and fill the rest, or return None if they cover too little.

    Args:
        gains: (n,) float64. Radiance that corresponds to a linear value of 1 in each frame, or NaN
            if unknown.

    Returns:
        The radiance, (512, 1024, 3) float32, with the lens of the first frame in the middle, and a
        mask, (512, 1024) float32, which is 1 where the light is visible and not clipped.
    """
    rows = np.flatnonzero(np.isfinite(gains))
    picks = rows[np.unique(np.linspace(0, len(rows) - 1, _MOST).astype(int))].tolist()
    pictures = [
        OrientedPicture(
            frames[number].picture,
            _BEHIND @ headings.rotations[number],
            headings.focal * max(frames[number].picture.shape[:2]),
            (float(gains[number]),) * 3,
            frames[number].beside,
        )
        for number in picks
    ]
    radiance, coverage, clipped = light_around(pictures, SHAPE)
    if coverage.mean() < _LEAST:
        return None
    merged = MergedLight(
        radiance, clipped, np.zeros_like(clipped), reference_ev=0.0, clip_level=1.0
    )
    sure = (coverage & (clipped < _CLIPPED)).astype(np.float32)
    return fill(merged, (~coverage).astype(np.float32)).radiance, sure


def with_detail(light: Float64, panorama: FloatImage) -> FloatImage:
    """Add a panorama's detail and colours, (h, w, 3), to a light, (H, W), keeping local means."""
    size = (panorama.shape[1], panorama.shape[0])
    texel = panorama.shape[1] / light.shape[1]
    smooth = wrapped_blur(luminance(panorama).astype(np.float32), texel)[..., None]
    detail = np.clip(panorama / np.maximum(smooth, 1e-6), *_DETAIL)
    result = detail * _resized(light.astype(np.float32), size)[..., None]
    for _ in range(2):
        now = luminance(reduce_radiance(np.asarray(result, np.float32), light.shape[:2]))
        ratio = (light / np.maximum(now, 1e-6)).astype(np.float32)
        result = result * _resized(ratio, size)[..., None]
    return np.asarray(result, np.float32)


def _resized(picture: FloatImage, size: tuple[int, int]) -> FloatImage:
    """Resize a panorama without a break at its seam."""
    share = size[0] // picture.shape[1]
    larger = (size[0] + 2 * share, size[1])
    larger_picture = cv2.resize(wrapped(picture, 1), larger, interpolation=cv2.INTER_LINEAR)
    return np.asarray(larger_picture[:, share:-share], np.float32)
