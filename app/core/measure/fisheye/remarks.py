"""Remarks about two fisheye circles."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class CirclesStitched(Remark):
    """Which circle is the front, and its upward direction, deg clockwise from its top."""

    front: str
    up_deg: float


@dataclass(frozen=True, slots=True)
class SeamUnsure(Remark):
    """The circles overlap too little to calibrate the lenses."""
