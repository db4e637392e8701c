"""A studio style: its name, lamps and signature."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

from app.core.solver.place_light import Expose
from app.core.solver.style_signature import UNSIGNED, Signature

Side: TypeAlias = Literal["left", "right", "none"]
"""The sitter's own side on which the key lamp stands."""


@dataclass(frozen=True, slots=True)
class StyleLamp:
    """One studio lamp, relative to the face.

    Attributes:
        distance_m: Distance from the point midway between the eyes, in metres. It is at least 2 m,
            since nearer lamps do not light the whole face from one direction.
    """

    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    power: float
    distance_m: float

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector to the lamp in the head's frame.

        +X points to the sitter's left, +Y up and +Z out of the face.

        Examples:
            >>> StyleLamp(90.0, 0.0, 10.0, 1.0, 2.0).direction[0]
            1.0
        """
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )


@dataclass(frozen=True, slots=True)
class Style:
    """A named target look.

    Attributes:
        key_elevation_deg, key_azimuth_deg: Ranges (from, to) of the directions, relative to the
            face, from which one lamp alone produces the style, or None for a style that needs
            several lamps. A range from a larger to a smaller azimuth passes behind the head.
        key_diameter_deg: Range of that lamp's diameter, or None if any diameter will do.
        expose: The subject for which a photographer sets the exposure.
    """

    name: str
    title: str
    side: Side
    place: str
    note: str
    lamps: tuple[StyleLamp, ...]
    paper: bool = False
    signature: Signature = UNSIGNED
    key_elevation_deg: tuple[float, float] | None = None
    key_azimuth_deg: tuple[float, float] | None = None
    key_diameter_deg: tuple[float, float] | None = None
    expose: Expose = "face"
