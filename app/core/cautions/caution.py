"""A caution about a measurement, whatever its cause."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Hazard(StrEnum):
    """A reason why the light at the sitter may differ from the panorama."""

    LENS_STEP = "lens step"
    """The lenses of a 360 camera differ in brightness. The amount is in stops."""

    NEAR_LIGHT = "near light"
    """The camera was not where the head will be. The amount is the distance in metres."""

    TILT = "tilt"
    """The camera was not level. The amount is in degrees."""

    CLIPPED = "clipped"
    """Light is clipped. The amount is the clipped fraction of all light, 0 to 1."""

    UNSEEN = "unseen"
    """Gaps were filled. The amount is the fraction of the sphere in gaps, 0 to 1."""

    ROUGH = "rough"
    """Light was estimated from one photo. The amount is the estimated fraction, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Caution:
    """A hazard at a place and the styles that it affects.

    Attributes:
        amount: Size of the hazard, in the hazard's unit, or None if it is unknown.
        styles: Names of the styles whose answer may change, possibly none of them, or None if the
            hazard concerns every style.
    """

    hazard: Hazard
    amount: float | None = None
    styles: tuple[str, ...] | None = None

    def concerns(self, name: str) -> bool:
        """Return whether a style's answer may change."""
        return self.styles is None or name in self.styles


def hazards_of(cautions: Iterable[Caution], name: str) -> tuple[Hazard, ...]:
    """Return the hazards on which a style's answer depends."""
    return tuple(caution.hazard for caution in cautions if caution.concerns(name))
