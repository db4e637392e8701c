"""The lamps of a place, computed once for the table on Probe, catchlights and sheets."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from app.core.measure.finish.findings import Findings, clip_level, find
from app.core.places.place import CaptureFacts
from app.core.solver.place_light import PlaceLight

_PLACES: Final = 2  # the open one, and one beside it


def lamps_here(light: PlaceLight, capture: CaptureFacts | None) -> Findings:
    """Find the lamps of a place. Slow the first time: not for the main thread.

    Args:
        capture: How the light was measured; None where that is not known.
    """
    if capture is None:
        return _findings(light, None, None)
    # A bracket that held all the light has nothing at its level but chance.
    stops = tuple(frame.ev for frame in capture.frames) if capture.clipped_share else ()
    return _findings(light, clip_level(stops), capture.white_cd_m2)


@lru_cache(maxsize=_PLACES)
def _findings(light: PlaceLight, level: float | None, white: float | None) -> Findings:
    clipped = light.environment.clipped if level is None else None
    return find(light.environment.radiance, level, white, clipped)
