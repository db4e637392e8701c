"""Remarks on a picture file."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class TwoTimes(Remark):
    """EXIF contains two conflicting exposure times."""

    name: str
    shutter_s: float
    apex_s: float


@dataclass(frozen=True, slots=True)
class TwoApertures(Remark):
    """EXIF contains two conflicting f-numbers."""

    name: str
    aperture: float
    apex: float


@dataclass(frozen=True, slots=True)
class PhoneRendered(Remark):
    """A phone's HDR rendering altered every pixel."""

    name: str


@dataclass(frozen=True, slots=True)
class FrameUnread(Remark):
    """A frame was left out because it cannot be read. `message` is the text of the error."""

    message: str
