"""The values that a camera accepts for exposure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from app.core.base.errors import ProbeError
from app.core.text import tr


@dataclass(frozen=True, slots=True)
class CameraLimits:
    """Values that a camera accepts in its manual program.

    Exposure times are in seconds, exactly as they must be sent, in any order. An invalid list
    raises `ProbeError`.
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
