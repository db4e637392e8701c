"""The exposure of a portrait: for the face, for a dark face, or for the background.

Photographers expose for the subject of a style. The rule for each style was chosen from blind
readings of the same pictures under each rule (`benchmarks/labels/exposures.json`).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from app.core.base.arrays import Floats
from app.core.base.colour import face_exposure, luminance
from app.core.solver.place_light import Expose

_DARK: Final = 0.145  # luminance of L* 45
_BRIGHT: Final = 0.66  # luminance of L* 85


def head_exposure(face: Floats, rule: Expose = "face", skin: float = 1.0) -> float:
    """Return the gain that exposes a picture of the head for the face.

    Args:
        face: (n,) float. Luminance of the face's pixels.
        rule: "dark" keeps the median of the face at L* 45 or below, so that a bright edge stands
            out. Any other rule follows `app.core.base.colour.face_exposure`.
        skin: Exposure factor for the skin tone (see `gallery_portraits.skin_gains`).
    """
    gain = face_exposure(face) * skin
    median = float(np.median(face)) if rule == "dark" and face.size else 0.0
    return min(gain, _DARK / median) if median > 0.0 else gain


def background_exposure(view: Floats) -> float | None:
    """Return the gain that brings the median of a background to L* 85, or None if it is black.

    Args:
        view: (n, 3) float. The visible pixels of the background, in linear Rec. 709.
    """
    middle = float(np.median(luminance(view))) if view.size else 0.0
    return _BRIGHT / middle if middle > 0.0 else None
