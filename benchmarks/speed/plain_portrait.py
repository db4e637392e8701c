"""A portrait as the screens show one, by itself: `portrait.portraits` makes many at once."""

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
    """Show a picture of the head on the neutral grey that lies behind every picture.

    Args:
        picture: Float32, (N, N, 3). Linear Rec. 709 on black; pixels at the head's edge
            hold its share only.
        coverage: Float32, (N, N). Share of each pixel covered by the head.
        size: Rows and columns wanted.
        skin: See `app.core.portrait.gallery_portraits.skin_gains`.

    Returns:
        Float32, (rows, columns, 3). sRGB in 0..1. Two such pictures are exposed alike
        and may be compared.
    """
    values = np.asarray(picture, np.float32)
    cover = np.clip(np.asarray(coverage, np.float32), 0.0, 1.0)[..., np.newaxis]
    gain = colour.face_exposure(colour.luminance(values)[cover[..., 0] >= _FACE_COVERAGE])
    well = colour.srgb_decode(np.asarray(WELL) / 255.0)
    # Edges are mixed in linear light, as a camera would; scaling is done on what is shown, where
    # steps look even and a bright rim does not ring.
    shown = colour.develop(values, gain * skin) + (1.0 - cover) * well
    return scaled(colour.srgb_encode(shown), size)
