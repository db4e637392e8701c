"""Transport by plain backward path tracing: the reference for the product form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import Tally, unwatched
from app.core.baking.random_walk import follow

if TYPE_CHECKING:
    from app.core.baking.random_walk import Meeting, SceneTables

Float32: TypeAlias = NDArray[np.float32]


def trace_plainly(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    paths: int,
    seed: int,
    environment: tuple[int, int],
) -> Float32:
    """Return the transport of some pixels by plain backward path tracing: unbiased, and noisy.

    The paths are those of `trace_pixels`; each adds its weight to the texel of its escape.

    Returns:
        (n, H * W, 3) float32.
    """
    texels = environment[0] * environment[1]
    strays = Strays(environment, Tally(len(pixels) * texels))
    follow(tables, pixels, paths, seed, strays, unwatched)
    found = strays.tally.sums(len(pixels), texels)
    found /= np.float32(paths)
    return found


@dataclass(frozen=True, slots=True)
class Strays:
    """Adds paths to the texels of their escape."""

    environment: tuple[int, int]
    tally: Tally

    def on_hit(self, at: Meeting) -> None:
        """Do nothing."""

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """See `Finder.escaped`."""
        height, width = self.environment
        texel = _texel_of(direction, self.environment)
        self.tally.add(slot * (height * width) + texel, value, active)


def _texel_of(direction: Any, environment: tuple[int, int]) -> Any:
    """Return the texel of a direction in the head frame, at turn 0."""
    import drjit as dr
    import mitsuba as mi

    height, width = environment
    u = 0.5 + dr.atan2(-direction.x, direction.z) / dr.two_pi
    v = dr.acos(dr.clip(direction.y, -1, 1)) / dr.pi
    row = dr.minimum(mi.UInt32(v * height), height - 1)
    return row * width + dr.minimum(mi.UInt32(u * width), width - 1)
