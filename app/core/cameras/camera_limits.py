"""The exposure settings that a camera accepts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from app.core.base.errors import ProbeError
from app.core.text import tr


@dataclass(frozen=True, slots=True)
class CameraLimits:
    """Exposure settings that a camera accepts in its manual program.

    Exposure times are in seconds, exactly as they must be sent to the camera. The values may be in
    any order.

    Raises:
        ProbeError: If a list is empty or contains an invalid value.
    """

    shutters_s: tuple[float, ...]
    isos: tuple[float, ...]
    apertures: tuple[float, ...]

    def __post_init__(self) -> None:
        if not _valid(self.shutters_s):
            raise ProbeError(tr("The camera sent an empty or invalid list of shutter speeds."))
        if not _valid(self.isos):
            raise ProbeError(tr("The camera sent an empty or invalid list of ISO values."))
        if not _valid(self.apertures):
            raise ProbeError(tr("The camera sent an empty or invalid list of apertures."))


def _valid(values: Sequence[float]) -> bool:
    return bool(values) and all(0.0 < value < math.inf for value in values)
