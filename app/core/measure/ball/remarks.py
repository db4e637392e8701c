"""Remarks about a mirror ball."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class BallDirty(Remark):
    """Part of the visible ball, `share` from 0 to 1, looks like dirt and was filled."""

    share: float


@dataclass(frozen=True, slots=True)
class BallColoured(Remark):
    """The ball is tinted, and its reflectance in each colour was corrected."""

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
    """Part of the sphere, `share` from 0 to 1, is not visible in the ball from one or two sides."""

    share: float
    sides: int


@dataclass(frozen=True, slots=True)
class LensFromBackground(Remark):
    """No file states the focal length, so it was estimated from the background."""
