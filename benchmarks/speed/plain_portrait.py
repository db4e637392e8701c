"""A single portrait as on screen; `portrait.portraits` makes many at once."""

from __future__ import annotations

from typing import Final

import numpy as np

from app.core.base import colour
from app.core.base.colour import FloatImage
from app.core.portrait.display_pictures import WELL, scaled

_FACE_COVERAGE: Final = 0.5


def portrait(
    picture: FloatImage, coverage: FloatImage, size: tuple[int, int], skin: float = 1.0
) -> FloatImage:
    """Show a picture of the head on the neutral grey behind every picture.

    Args:
        picture: (N, N, 3) float32. Linear Rec. 709 on black; pixels at the head's edge contain only
            its share.
        coverage: (N, N) float32. Share of each pixel covered by the head.
        size: Rows and columns of the result.
        skin: See `app.core.portrait.gallery_portraits.skin_gains`.

    Returns:
        (rows, columns, 3) float32. sRGB in 0..1. Two such pictures have equal exposure rules and
        can be compared.
    """
    values = np.asarray(picture, np.float32)
    cover = np.clip(np.asarray(coverage, np.float32), 0.0, 1.0)[..., np.newaxis]
    gain = colour.face_exposure(colour.luminance(values)[cover[..., 0] >= _FACE_COVERAGE])
    well = colour.srgb_decode(np.asarray(WELL) / 255.0)
    # Edges are mixed in linear light, as in a camera; scaling is done on display values, where
    # steps look even and a bright rim does not ring.
    shown = colour.develop(values, gain * skin) + (1.0 - cover) * well
    return scaled(colour.srgb_encode(shown), size)
