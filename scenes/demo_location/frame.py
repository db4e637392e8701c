"""The world's frame, and the positions of spots, photographer and sun.

World: metres, +Y up, origin on the floor under the first spot. Azimuth 0 is +Z, azimuth 90 deg is
-X, so that azimuth grows clockwise seen from above, as everywhere in Turnlight, and a Mitsuba
``envmap`` without ``to_world`` agrees with it. The place itself is modelled in building coordinates
(x along the court's wall, z from the hall into the court) and rotated into the world.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CAFE",
    "EYE_HEIGHT",
    "SPOTS",
    "STANDS",
    "SUN_AZIMUTH",
    "SUN_ELEVATION",
    "TURNS",
    "VIEW_FOV",
    "VIEW_SIZE",
    "Spot",
    "Stand",
    "direction",
    "to_world",
    "view_pose",
    "world_matrix",
]

Floats = NDArray[np.float64]

EYE_HEIGHT: Final = 1.60
TURNS: Final = tuple(range(0, 360, 5))
VIEW_FOV: Final = 60.0  # degrees, horizontal
VIEW_SIZE: Final = (512, 384)
YAW: Final = 155.0  # azimuth of the building's direction +z
SUN_AZIMUTH: Final = 155.0 - 42.0
SUN_ELEVATION: Final = 47.0


@dataclass(frozen=True, slots=True)
class Spot:
    """A position of the probe.

    Attributes:
        name: File name without its suffix.
        words: Description for people.
        building: x and z in building coordinates, metres.
        shape: Rows and columns of its panorama.
    """

    name: str
    words: str
    building: tuple[float, float]
    shape: tuple[int, int]


SPOTS: Final = (
    Spot("probe-1", "In the shade just inside the wide doors", (0.3, -2.9), (2048, 4096)),
    Spot("probe-2", "Deep in the hall, between side window and lamps", (3.4, -6.3), (1024, 2048)),
    Spot("probe-3", "Out in the court, in the sun", (-2.6, 5.2), (1024, 2048)),
)


@dataclass(frozen=True, slots=True)
class Stand:
    """Position of the sitter for a set of views.

    Attributes:
        folder: Folder of its views, in ``resources/demo/``.
        distances: (n,). From the sitter to the photographer's camera, metres.
    """

    folder: str
    spot: Spot
    distances: tuple[float, ...]

    @property
    def at(self) -> tuple[float, float]:
        """World x and z, metres."""
        x, _, z = to_world(self.spot.building[0], 0.0, self.spot.building[1])
        return float(x), float(z)


CAFE: Final = Spot("cafe", "By the back wall of the hall", (3.4, -7.4), (1024, 2048))
"""Spot of the demo; the others are for tests and benchmarks."""

STANDS: Final = (
    Stand("location/views", SPOTS[0], (1.2, 1.8, 2.5)),
    Stand("cafe", CAFE, (1.2,)),
)


def direction(azimuth_deg: float, elevation_deg: float = 0.0) -> Floats:
    """Return the unit vector of a direction in the world, (3,)."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    return np.array([-np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def world_matrix() -> Floats:
    """Return the 4 x 4 matrix from building coordinates to the world."""
    z, y = direction(YAW), np.array([0.0, 1.0, 0.0])
    turn = np.stack([np.cross(y, z), y, z], axis=1)
    x0, z0 = SPOTS[0].building
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    matrix[:3, 3] = -turn @ np.array([x0, 0.0, z0])
    return matrix


def to_world(x: float, y: float, z: float) -> Floats:
    """Convert a point from building coordinates to the world, (3,)."""
    return np.asarray(world_matrix() @ np.array([x, y, z, 1.0]))[:3]


def view_pose(stand: Stand, turn_deg: float, distance: float) -> tuple[Floats, Floats]:
    """Return the pose of the photographer's camera, which looks at the sitter.

    Returns:
        position: (3,). World position, metres.
        rotation: (3, 3). World to camera: rows are the image's right, its down, and the optical
            axis.
    """
    axis = -direction(turn_deg)
    x, z = stand.at
    position = distance * direction(turn_deg) + np.array([x, EYE_HEIGHT, z])
    down = np.array([0.0, -1.0, 0.0])
    return position, np.stack([np.cross(down, axis), down, axis])
