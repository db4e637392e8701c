"""A pinhole camera as a matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.core.localization.views import Lens

__all__ = ["lens_matrix"]


def lens_matrix(lens: Lens) -> NDArray[np.float64]:
    """(3, 3): from camera axes (right, down, front) to pixels, corner at (0, 0)."""
    width, height = lens.size
    focal = lens.focal_px
    return np.array([[focal, 0.0, width / 2.0], [0.0, focal, height / 2.0], [0.0, 0.0, 1.0]])
