"""The light at a place, prepared for fast pictures and searches at any turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes, Floats
from app.core.base.colour import FloatImage
from app.core.environment.environment import (
    SHAPE,
    Environment,
    reduce_light,
    reduce_radiance,
    solid_angles,
)
from app.core.measure.finish.display import display_panorama
from app.core.solver.search import luminance_of
from app.core.solver.transport import Transport, render, render_all, to_image
from app.core.solver.turn_choice import Objective

_FINE_COLUMNS: Final = 512
_SHOWN_COLUMNS: Final = 2048
_ONE_SIDED: Final = 0.2  # least fraction of the light from one side, for it to have a side


@dataclass(frozen=True, slots=True, eq=False)
class PlaceLight:
    """An environment and its reduced versions.

    Attributes:
        environment: The light as measured, in linear Rec. 709, where column u is at azimuth 360 (u
            - 0.5) degrees in the file.
        fine: (32, 512, 3) float32. Radiance averaged over the rows used in the search, with enough
            columns for any turn.
        searched: (32, 64, 3) float32. Linear Rec. 709 radiance for the search, at turn 0, with the
            photographer at azimuth 0.
        display: (1024, 2048, 3) uint8. sRGB picture of the panorama, exposed for viewing.
    """

    environment: Environment
    fine: FloatImage = field(repr=False)
    searched: FloatImage = field(repr=False)
    display: Bytes = field(repr=False)

    def searched_by(self, objective: Objective) -> Floats:
        """Return the light for an objective: (32, 64, 3), or greyscale (32, 64) for the paper's."""
        return luminance_of(self.searched) if objective == "paper" else self.searched

    @property
    def name(self) -> str:
        """Name of the environment."""
        return self.environment.name


def prepare(environment: Environment) -> PlaceLight:
    """Prepare an environment for pictures at any turn."""
    radiance = environment.radiance
    rows, columns = SHAPE
    fine = reduce_radiance(radiance, (rows, max(_FINE_COLUMNS, columns)))
    searched = reduce_light(radiance, SHAPE)
    width = min(_SHOWN_COLUMNS, max(radiance.shape[1], columns))
    display = display_panorama(radiance, width=width)
    for array in (fine, searched, display):
        array.setflags(write=False)
    return PlaceLight(environment, fine, searched, display)


def turned(light: PlaceLight, turn_deg: float, shape: tuple[int, int] = SHAPE) -> FloatImage:
    """Return the light at a turn, with the sitter's front in the centre.

    Args:
        turn_deg: Azimuth in the panorama that the sitter faces, in degrees.
        shape: Rows and columns of the result.

    Returns:
        (rows, columns, 3) float32. Linear Rec. 709 radiance in panorama coordinates, with the
        sitter's front in the centre.
    """
    return reduce_light(light.fine, shape, turn_deg)


Expose: TypeAlias = Literal["face", "dark", "background"]
"""The subject that a style is exposed for (see `app.core.portrait.exposure`)."""


@dataclass(frozen=True, slots=True)
class Facing:
    """The light at a place for one turn, computed on demand, and the subject to expose for."""

    light: PlaceLight
    turn_deg: float
    expose: Expose = "face"

    def __call__(self) -> FloatImage:
        """Return the light (see `turned`)."""
        return turned(self.light, self.turn_deg)


def picture_at(transport: Transport, light: PlaceLight, turn_deg: float) -> FloatImage:
    """Return the picture of the head at a turn, computed as B = T L (eq. 1).

    Args:
        turn_deg: Azimuth in the panorama that the sitter faces, in degrees.

    Returns:
        (N, N, 3) float32. Linear Rec. 709 on black, in the same unit as the environment.
    """
    return to_image(
        transport, render(transport, turned(light, turn_deg, transport.environment_shape))
    )


def pictures_at(transport: Transport, light: PlaceLight, turns_deg: Sequence[float]) -> FloatImage:
    """Return pictures at several turns, computed in one product (see `picture_at`).

    Args:
        turns_deg: Azimuths in the panorama that the sitter faces, in degrees.

    Returns:
        (n, N, N, 3) float32. Linear Rec. 709 on black.
    """
    shape, size = transport.environment_shape, transport.header.picture
    lights = [turned(light, turn, shape) for turn in turns_deg]
    pictures = np.zeros((len(lights), size * size, 3), np.float32)
    pictures[:, transport.pixels] = render_all(transport, lights)
    return pictures.reshape(len(lights), size, size, 3)


def main_light(light: PlaceLight, facing_deg: float) -> float | None:
    """Return the direction of the main light, relative to the face.

    Args:
        facing_deg: Azimuth in the panorama that the sitter faces, in degrees.

    Returns:
        The azimuth relative to the face, in degrees, positive towards the sitter's left, or None if
        the light comes evenly from all around.
    """
    azimuth = main_azimuth(light.searched)
    # The panorama's azimuth grows towards the sitter's right.
    return None if azimuth is None else wrap(facing_deg - azimuth)


def main_azimuth(radiance: Floats) -> float | None:
    """Return the azimuth of the main light, in degrees, or None if light comes from all around.

    Args:
        radiance: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance or luminance, at any exposure.
    """
    rows, columns = radiance.shape[:2]
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    azimuth = 2.0 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5)
    amount = luminance_of(radiance) * solid_angles((rows, columns))[:, None]
    level = (amount * np.cos(elevation)[:, None]).sum(axis=0)
    east, north = float(level @ np.sin(azimuth)), float(level @ np.cos(azimuth))
    if math.hypot(east, north) < _ONE_SIDED * float(amount.sum()):
        return None
    return math.degrees(math.atan2(east, north))
