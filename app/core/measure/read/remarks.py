"""Remarks about a picture file."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class TwoTimes(Remark):
    """EXIF states two exposure times."""

    name: str
    shutter_s: float
    apex_s: float


@dataclass(frozen=True, slots=True)
class TwoApertures(Remark):
    """EXIF states two f-numbers."""

    name: str
    aperture: float
    apex: float


@dataclass(frozen=True, slots=True)
class PhoneRendered(Remark):
    """A phone's HDR rendering changed every pixel."""

    name: str


@dataclass(frozen=True, slots=True)
class FrameUnread(Remark):
    """A frame was left out because it cannot be read. `message` is the error's message."""

    message: str
