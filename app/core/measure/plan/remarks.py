"""Remarks about a planned bracket."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class OffsetMissed(Remark):
    """An exposure out of the camera's reach, and the nearest one, EV from the metered one."""

    wanted_ev: float
    nearest_ev: float


@dataclass(frozen=True, slots=True)
class DarkestExposure(Remark):
    """The camera's darkest exposure, EV from the metered one."""

    floor_ev: float


@dataclass(frozen=True, slots=True)
class WiderSteps(Remark):
    """Step between the dark frames, wider than usual because there are too few of them."""

    frames: int
    step_ev: float
    usual_ev: float


@dataclass(frozen=True, slots=True)
class BracketShifted(Remark):
    """Shift of the whole bracket from the metered exposure, EV; positive is brighter."""

    middle_ev: float
