"""The lamps of a place, computed once for the table on Probe, the catchlights and the sheets."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from app.core.measure.finish.findings import Findings, clip_level, find
from app.core.places.place import CaptureFacts
from app.core.solver.place_light import PlaceLight

_PLACES: Final = 2  # the open place, and one for comparison


def lamps_here(light: PlaceLight, capture: CaptureFacts | None) -> Findings:
    """Find the lamps of a place. The first call for a place is too slow for the main thread.

    Args:
        capture: How the light was measured, or None if this is unknown.
    """
    if capture is None:
        return _findings(light, None, None)
    # If nothing was clipped, values at the clipping level are there by chance.
    stops = tuple(frame.ev for frame in capture.frames) if capture.clipped_share else ()
    return _findings(light, clip_level(stops), capture.white_cd_m2)


@lru_cache(maxsize=_PLACES)
def _findings(light: PlaceLight, level: float | None, white: float | None) -> Findings:
    clipped = light.environment.clipped if level is None else None
    return find(light.environment.radiance, level, white, clipped)
