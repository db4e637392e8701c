"""Remarks on a mirror ball."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class BallDirty(Remark):
    """Part of the visible ball, a fraction `share` from 0 to 1, looks like dirt and was filled."""

    share: float


@dataclass(frozen=True, slots=True)
class BallColoured(Remark):
    """The ball is tinted, and its reflectance was corrected for each colour."""

    red: float
    green: float
    blue: float


@dataclass(frozen=True, slots=True)
class BallSize(Remark):
    """The width of the ball in the picture, and the resolution of its panorama."""

    width_px: int
    resolution_deg: float


@dataclass(frozen=True, slots=True)
class BallSmall(Remark):
    """The resolution of the ball's panorama is too low."""


@dataclass(frozen=True, slots=True)
class BallBlind(Remark):
    """Part of the sphere, a fraction `share` from 0 to 1, cannot be seen in the ball."""

    share: float
    sides: int


@dataclass(frozen=True, slots=True)
class LensFromBackground(Remark):
    """No file records the focal length, so it was estimated from the background."""
