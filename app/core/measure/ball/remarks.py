"""Remarks about a mirror ball."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class BallDirty(Remark):
    """Fraction of the visible ball, 0 to 1, that looks like dirt and was filled."""

    share: float


@dataclass(frozen=True, slots=True)
class BallColoured(Remark):
    """Reflectance of the ball by colour, which was corrected."""

    red: float
    green: float
    blue: float


@dataclass(frozen=True, slots=True)
class BallSize(Remark):
    """Width of the ball in the picture, and its resolution."""

    width_px: int
    resolution_deg: float


@dataclass(frozen=True, slots=True)
class BallSmall(Remark):
    """The ball's resolution is too coarse."""


@dataclass(frozen=True, slots=True)
class BallBlind(Remark):
    """Fraction of the sphere, 0 to 1, that the ball does not show from one side or two."""

    share: float
    sides: int


@dataclass(frozen=True, slots=True)
class LensFromBackground(Remark):
    """No file states the focal length; it was estimated from the background."""
