"""What there is to report of a planned bracket."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class OffsetMissed(Remark):
    """An exposure out of the camera's reach, and the nearest, EV from the metered one."""

    wanted_ev: float
    nearest_ev: float


@dataclass(frozen=True, slots=True)
class DarkestExposure(Remark):
    """The camera's darkest exposure, EV from the metered one."""

    floor_ev: float


@dataclass(frozen=True, slots=True)
class WiderSteps(Remark):
    """How far apart the dark frames are, for there are too few of them."""

    frames: int
    step_ev: float
    usual_ev: float


@dataclass(frozen=True, slots=True)
class BracketShifted(Remark):
    """By how much the whole bracket is shot brighter than metered, or darker."""

    middle_ev: float
