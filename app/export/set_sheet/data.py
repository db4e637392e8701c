"""What a set sheet shows: plain data, ready to be drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from app.core.base.colour import FloatImage
    from app.core.portrait.glare import Flow, Glare
    from app.core.portrait.ratio import LightingRatio

Bytes: TypeAlias = NDArray[np.uint8]

_LEAST_SHARE: Final = 0.03
_MOST_LAMPS: Final = 4


@dataclass(frozen=True, slots=True)
class SheetLamp:
    """A light of the place, as marked on plan and panorama.

    Attributes
    ----------
    azimuth_deg, elevation_deg : float
        In the panorama's frame, deg.
    share : float
        Of all the light of the place, 0 to 1.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float
    share: float
    sun: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class SetSheet:
    """One page: a style at a place.

    Attributes
    ----------
    turn_deg : float
        From where the photographer stands at the start, deg, positive clockwise seen from above.
    arc_deg : tuple of float
        Tolerance arc (from, to), clockwise, deg.
    picture : NDArray[np.float32], (N, N, 3)
        Linear Rec. 709 picture of the head here, on black.
    coverage : NDArray[np.float32], (N, N)
        Share of each pixel that the head covers.
    panorama : NDArray[np.uint8], (H, 2 H, 3)
        SRGB panorama as measured; 2,048 columns or more look sharp.
    target : NDArray[np.float32], (N, N, 3), or None
        Linear picture under the style's own lamps; None for a painted style.
    painted : NDArray[np.uint8], (h, h, 3), or None
        SRGB picture of what was painted, shown instead of a target.
    front_deg : float
        Panorama azimuth at which the photographer stands at the start, deg.
    reason : str or None
        Why the style is out of reach here; None where it is in reach.
    ratio, glare, flow : optional
        Of the picture and the light at this turn; None leaves the line out.
    """

    title: str
    side: str
    turn_deg: float
    arc_deg: tuple[float, float]
    match: float
    strength: float
    picture: FloatImage = field(repr=False)
    coverage: FloatImage = field(repr=False)
    panorama: Bytes = field(repr=False)
    place: str
    target: FloatImage | None = field(default=None, repr=False)
    painted: Bytes | None = field(default=None, repr=False)
    light: str = ""
    front_deg: float = 0.0
    lamps: tuple[SheetLamp, ...] = ()
    reason: str | None = None
    limit: float = 45.0
    ratio: LightingRatio | None = None
    glare: Glare | None = None
    flow: Flow | None = None
    made: str = ""
    age: str = ""
    head: str = ""
    notes: str = ""

    @property
    def shown(self) -> tuple[SheetLamp, ...]:
        """The lamps that are drawn: the sun, and up to four with a fair share of the light."""
        fair = [lamp for lamp in self.lamps if lamp.sun or lamp.share >= _LEAST_SHARE]
        return tuple(sorted(fair, key=lambda lamp: not lamp.sun)[:_MOST_LAMPS])
