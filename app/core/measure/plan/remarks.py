"""Remarks on a planned bracket."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class OffsetMissed(Remark):
    """An exposure that the camera cannot make was replaced with the nearest possible one.

    Attributes:
        wanted_ev, nearest_ev: Target and actual exposure, in EV relative to the metered exposure.
    """

    wanted_ev: float
    nearest_ev: float


@dataclass(frozen=True, slots=True)
class DarkestExposure(Remark):
    """The camera's darkest exposure, in EV relative to the metered one."""

    floor_ev: float


@dataclass(frozen=True, slots=True)
class WiderSteps(Remark):
    """The step between the dark frames is wider than usual because there are too few frames."""

    frames: int
    step_ev: float
    usual_ev: float


@dataclass(frozen=True, slots=True)
class BracketShifted(Remark):
    """The whole bracket is offset from the metered exposure.

    Attributes:
        middle_ev: Offset in EV, which is positive if the bracket is brighter.
    """

    middle_ev: float
