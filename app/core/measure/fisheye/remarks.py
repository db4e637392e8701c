"""Remarks on pictures with two fisheye circles."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class CirclesStitched(Remark):
    """The circle used as the front, and its upward direction in degrees clockwise from the top."""

    front: str
    up_deg: float


@dataclass(frozen=True, slots=True)
class SeamUnsure(Remark):
    """The circles overlap too little to calibrate the lenses."""
