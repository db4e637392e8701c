"""How much a second light changes the picture, as far as the eye can see.

A lamp may move a style across a limit while both pictures look the same. The change is therefore
measured on the developed pictures, in CIE 1976 lightness L*: as the mean over the tenth of the
face's area that changes most. A lamp shapes a part of the face, so the mean over the whole face
would hide a filled shadow, and the brightest pixel would follow noise. The part may have any shape,
since a rim or the edge of a shadow is long and thin. A slight blur comes first, so that a single
pixel does not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from app.core.base import colour
from app.core.base.arrays import Bools, Float32, Floats
from app.core.base.colour import FloatImage
from app.core.portrait.display_pictures import WELL
from app.core.solver.transport import FACE_COVERAGE

VISIBLE: Final = 4.6
"""Change of L* from which the difference between two pictures of a face is visible.

This is two just-noticeable differences of 2.3 in CIELAB (M. Mahy, L. Van Eycken and A. Oosterlinck,
Evaluation of uniform color spaces developed after the adoption of CIELAB and CIELUV, Color Research
& Application 19(2), 1994). One such difference is visible along a common edge; here the pictures
are side by side.
"""

_PART: Final = 0.1  # of the face's area
_BLUR: Final = 0.015  # standard deviation, of the picture's side
_LINEAR: Final = 216.0 / 24389.0  # CIE 15:2004: below this, L* is proportional to luminance
_SLOPE: Final = 24389.0 / 27.0


@dataclass(frozen=True, slots=True)
class VisibleChange:
    """The change of a picture in L*, from 0 to 100, where it changes most."""

    delta_lightness: float

    @property
    def visible(self) -> bool:
        """Whether the eye sees the change."""
        return self.delta_lightness >= VISIBLE


def lightness(picture: Floats) -> Float32:
    """Return the CIE 1976 lightness L* of an exposed picture after its highlights are compressed.

    Args:
        picture: (..., 3) float. Exposed linear Rec. 709 light. Display white is 1.

    Returns:
        (...) float32, 0 to 100.

    Examples:
        >>> [round(float(value), 1) for value in lightness(np.array([[0.184] * 3, [0.005] * 3]))]
        [50.0, 4.5]
    """
    tone = colour.luminance(colour.develop(picture))
    curve = 116.0 * np.cbrt(tone) - 16.0
    return np.where(tone > _LINEAR, curve, _SLOPE * tone).astype(np.float32)


def head_lightness(picture: Floats, coverage: Floats) -> Float32:
    """Return L* of exposed pixels of a head, (n, 3), on the grey behind it, as (n,) float32.

    Args:
        coverage: (n,) float. Fraction of each pixel that the head covers.
    """
    behind = (1.0 - coverage)[:, np.newaxis] * colour.srgb_decode(WELL[0] / 255.0)
    return lightness(picture + behind)


def lightness_change(
    before: Float32, after: Float32, head: Bools, face_pixels: int
) -> VisibleChange:
    """Compare the lightness of a head in two pictures.

    Args:
        before, after: (n,) float32. L* of the head's pixels, in row-major order.
        head: (N, N) bool. The head's pixels.
        face_pixels: Area of the face, in pixels.
    """
    change = np.zeros(head.shape, np.float32)
    change[head] = after - before
    sigma = _BLUR * len(change)
    weight = cv2.GaussianBlur(head.astype(np.float32), (0, 0), sigma)
    smooth = np.abs(cv2.GaussianBlur(change, (0, 0), sigma)[head] / weight[head])
    count = min(max(round(_PART * face_pixels), 1), smooth.size)
    most = np.partition(smooth, smooth.size - count)[smooth.size - count :]
    return VisibleChange(float(most.mean()))


def visible_change(
    without: FloatImage, with_lamp: FloatImage, coverage: FloatImage, face_pixels: int
) -> VisibleChange:
    """Compare two exposed pictures of a head.

    Args:
        without, with_lamp: (N, N, 3) float32. Exposed linear Rec. 709 light on black. Display white
            is 1.
        coverage: (N, N) float32. Fraction of each pixel that the head covers.
        face_pixels: Area of the face, in pixels.
    """
    head = coverage >= FACE_COVERAGE
    before, after = (head_lightness(each[head], coverage[head]) for each in (without, with_lamp))
    return lightness_change(before, after, head, face_pixels)
