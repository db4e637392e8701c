"""The requested position of the lens, and the requested background."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

from app.core.base.angles import wrap
from app.core.solver.shortfall import Obstacle
from app.core.solver.style_result import Lighting

YawWord: TypeAlias = Literal["auto", "short", "broad"]
YawAsked: TypeAlias = float | YawWord

ASIDE: Final[tuple[Literal["short", "broad"], ...]] = ("short", "broad")
"""Kinds of lighting for a face turned away from the lens."""

LIGHTINGS: Final[tuple[Lighting, ...]] = ("front", *ASIDE)


@dataclass(frozen=True, slots=True)
class LensWish:
    """Permitted positions of the lens.

    Attributes:
        yaw: Yaw in degrees, or the criterion for choosing the yaw: the best light, short light or
            broad light.
        background: Clockwise range of azimuths, (from, to), in degrees, that must include the
            middle of the background, or None if any background will do.
    """

    yaw: YawAsked = 0.0
    background: tuple[float, float] | None = None

    def met_by(self, turn_deg: float) -> bool:
        """Return whether the background at a turn is acceptable."""
        if self.background is None:
            return True
        start, end = self.background
        return (turn_deg + 180.0 - start) % 360.0 <= (end - start) % 360.0

    def moved(self, by_deg: float) -> LensWish:
        """Return the wish with its azimuths measured from a different zero."""
        if self.background is None:
            return self
        start, end = self.background
        return replace(self, background=(wrap(start - by_deg), wrap(end - by_deg)))


STRAIGHT: Final = LensWish()
"""The wish for a lens directly in front of the face, with any background."""


def obstacle_of(wish: LensWish) -> Obstacle:
    """Return the reason why no position of the lens meets a wish."""
    if wish.background is not None:
        return Obstacle.BACKGROUND
    if isinstance(wish.yaw, float):
        return Obstacle.FACE_HIDDEN
    return Obstacle.NO_SHORT_LIGHT if wish.yaw == "short" else Obstacle.NO_BROAD_LIGHT
