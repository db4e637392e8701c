"""The demo location for tests: its panorama as shown, made once."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.measure.finish.display import display_panorama

__all__ = ["demo_panorama"]


@cache
def demo_panorama(spot: int = 1) -> NDArray[np.uint8]:
    """Return the display panorama of one of the demo location's spots, (1024, 2048, 3) sRGB."""
    environment = read_environment(resources() / "demo" / "location" / f"probe-{spot}.exr")
    return display_panorama(environment.radiance, width=2048)
