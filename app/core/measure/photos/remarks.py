"""Remarks about stitched photos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class OneExposure(Remark):
    """Lamps and windows are clipped."""


@dataclass(frozen=True, slots=True)
class PhotosLeftOut(Remark):
    """Photos that do not overlap the others."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CameraMoved(Remark):
    """Near objects may appear twice."""


@dataclass(frozen=True, slots=True)
class GapsFilled(Remark):
    """Fraction of all directions, 0 to 1, that no photo shows, and where most of that area is."""

    share: float
    where: Literal["overhead", "below", "sides"]
