"""What there is to report of a mirror ball."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class BallDirty(Remark):
    """The share of what the ball shows, 0 to 1, that looks like dirt and was filled."""

    share: float


@dataclass(frozen=True, slots=True)
class BallColoured(Remark):
    """How the ball reflects the colours, which was taken out."""

    red: float
    green: float
    blue: float


@dataclass(frozen=True, slots=True)
class BallSize(Remark):
    """How wide the ball is in the picture, and how finely it resolves."""

    width_px: int
    resolution_deg: float


@dataclass(frozen=True, slots=True)
class BallSmall(Remark):
    """The ball resolves too coarsely."""


@dataclass(frozen=True, slots=True)
class BallBlind(Remark):
    """The share of the sphere, 0 to 1, that the ball does not show, seen from one side or two."""

    share: float
    sides: int


@dataclass(frozen=True, slots=True)
class LensFromBackground(Remark):
    """No file states the focal length; what is behind the ball gave it."""
