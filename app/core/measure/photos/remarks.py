"""Remarks on stitched photos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class OneExposure(Remark):
    """All photos have the same exposure, so lamps and windows are clipped."""


@dataclass(frozen=True, slots=True)
class PhotosLeftOut(Remark):
    """Some photos do not overlap the others."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CameraMoved(Remark):
    """The camera moved between photos, so nearby objects may appear twice."""


@dataclass(frozen=True, slots=True)
class GapsFilled(Remark):
    """No photo shows part of the sphere, `share` from 0 to 1, which lies mostly at `where`."""

    share: float
    where: Literal["overhead", "below", "sides"]
