"""Brightening single lamps of a merged panorama by stops."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.hdr.lights import upsampled

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.core.hdr.frame import Merged
    from app.core.hdr.lights import Light

_MOST_STOPS = 20.0


def apply_gains(merged: Merged, lights: Sequence[Light], gains: Mapping[str, float]) -> Merged:
    """Make lamps brighter or darker than they were measured.

    Of a clipped lamp only what is clipped changes, since the rest is known; of any other, what
    it has above its surroundings.

    Returns
    -------
    Merged
        With new radiance; the clipped lamps that were given a gain no longer count as clipped.

    Raises
    ------
    ProbeError
        If there is no such lamp, or a gain is not a number between -20 and 20 stops.
    """
    known = {light.id: light for light in lights}
    radiance, clipped = merged.radiance.copy(), merged.clipped.copy()
    for name, stops in gains.items():
        light = known.get(name.strip().upper())
        if light is None:
            names = ", ".join(known) if known else "none was found"
            raise ProbeError(f"There is no lamp {name!r} in this place.", f"Lamps: {names}.")
        if not (math.isfinite(stops) and abs(stops) <= _MOST_STOPS):
            raise ProbeError(f"The gain of lamp {light.id} must be from -20 to 20 stops.")
        inside = upsampled(light, clipped.shape)
        part = radiance[inside]
        if light.clipped:
            factor = 1.0 + (2.0**stops - 1.0) * merged.clipped[inside]
            clipped[inside] = 0.0
        else:
            above = 1.0 - light.surround / np.maximum(luminance(part), 1e-30)
            factor = 1.0 + (2.0**stops - 1.0) * np.clip(above, 0.0, 1.0)
        radiance[inside] = part * factor[:, None]
    return replace(merged, radiance=radiance, clipped=clipped)
