"""A captured lamp, and its light on the head at any placement.

A captured lamp is an environment with a mask (alpha), which is 1 on the lamp and 0 elsewhere. Its
light is **premultiplied**: a texel that is half covered by the lamp has half the light. Equation 7
of the paper composites it over the light L of a place:

    L_add + (1 - alpha) L

L_add is rotated so that the centre of its energy is directly in front of the face. It is then
raised by the altitude and turned by the azimuth towards the sitter's left: R = R_y R_x. The lamp is
rotated at full size and then reduced to the size used in the search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage, luminance
from app.core.base.errors import CoreError
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.base.sphere import directions, remap_frame, rotate_light, rotation
from app.core.environment.environment import SHAPE, energy, enlarge, reduce_radiance, solid_angles
from app.core.environment.repair import repair
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.text import tr

LARGEST: Final = (512, 1024)
"""Maximum number of rows and columns of a captured lamp, for texels of 0.35 degrees."""

_FINE_ROWS: Final = 256  # minimum rows for a rotation


@dataclass(frozen=True, slots=True, eq=False)
class CapturedLamp:
    """A lamp as captured from the position of the head."""

    name: str
    title: str
    # (H, 2 H, 3), the whole capture with the dark room, linear Rec. 709, in the panorama's frame;
    # read-only
    radiance: FloatImage = field(repr=False)
    # (H, 2 H), fraction of each texel that the lamp covers, 0 to 1; read-only
    alpha: Float32 = field(repr=False)
    # luminance of radiance 1, in cd/m2, or None if the exposure is unknown
    white_cd_m2: float | None = None
    # distance from the probe to the lamp in metres, or None if unknown
    distance_m: float | None = None
    camera: str = ""

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns of the panorama."""
        return self.radiance.shape[0], self.radiance.shape[1]

    @property
    def light(self) -> FloatImage:
        """The light of the lamp alone, (H, 2 H, 3) float32, premultiplied, in `radiance` units."""
        return self.radiance * (self.alpha > 0.0)[..., None]

    @property
    def solid_angle_sr(self) -> float:
        """The solid angle of the lamp as seen from the probe, in steradians."""
        return float(energy(self.alpha))

    @property
    def lux(self) -> float | None:
        """Illuminance on a surface facing the lamp at its distance, in lux, or None if unknown."""
        if self.white_cd_m2 is None:
            return None
        light = self.light @ np.array(LUMINANCE_WEIGHTS, np.float32)
        azimuth, elevation = centroid(self.light)
        toward = directions(self.shape) @ rotation(azimuth, elevation)[:, 2]
        return float(energy((light * np.maximum(toward, 0.0)).astype(np.float32))) * float(
            self.white_cd_m2
        )


@dataclass(frozen=True, slots=True, eq=False)
class PlacedLamp:
    """A captured lamp at every placement, in the head's frame (azimuth 0 = front)."""

    name: str
    title: str
    # (576, H, W, 3), premultiplied radiance, linear Rec. 709, by number of the placement; in cd/m2
    # if `absolute`
    light: FloatImage = field(repr=False)
    # (576, H, W), fraction of each texel that the lamp hides, 0 to 1
    alpha: Float32 = field(repr=False)
    # distance from the middle of the head, in metres, the only one at which the lamp is valid
    distance_m: float | None = None
    absolute: bool = True  # whether the light is in cd/m2 or in an unknown unit


def make_lamp(
    name: str,
    radiance: FloatImage,
    alpha: Float32,
    *,
    title: str = "",
    white_cd_m2: float | None = None,
    distance_m: float | None = None,
    camera: str = "",
) -> CapturedLamp:
    """Create a lamp from a capture and a mask, repaired and reduced to `LARGEST` or less.

    Args:
        radiance: (H, 2 H, 3) float32. Linear Rec. 709. The array is not changed.
        alpha: (H, 2 H) float32. The mask. Values outside 0 to 1 are clipped, and NaN becomes 0.

    Raises:
        CoreError: If the sizes do not match, or there is no light in the mask.
    """
    shape = radiance.shape
    if radiance.ndim != 3 or shape[2] != 3 or shape[0] < 1 or shape[1] != 2 * shape[0]:
        raise CoreError(
            tr("{name} is not a full panorama: its shape is {shape}.", name=name, shape=shape)
        )
    if alpha.shape != shape[:2]:
        raise CoreError(
            tr(
                "The mask of {name} has the shape {mask}, but its light has the shape {light}.",
                name=name,
                mask=alpha.shape,
                light=shape[:2],
            )
        )
    both = np.empty((*shape[:2], 4), np.float32)
    both[..., :3] = radiance
    repair(both[..., :3], name)
    both[..., 3] = np.clip(np.nan_to_num(alpha, nan=0.0), 0.0, 1.0)
    if shape[0] > LARGEST[0]:
        # Reduce the lamp alone, so that its edge does not absorb light of the room.
        lamp = both[..., :3] * (both[..., 3:] > 0)
        edge = reduce_radiance(lamp, LARGEST)
        both = reduce_radiance(both, LARGEST)
        coverage = both[..., 3] > 0
        both[coverage, :3] = edge[coverage]
    light, mask = np.ascontiguousarray(both[..., :3]), np.clip(both[..., 3], 0.0, 1.0)
    if not (light[mask > 0] > 0).any():
        raise CoreError(
            tr("The mask of {name} has no light in it.", name=name), tr("Mark the lamp.")
        )
    light.flags.writeable = mask.flags.writeable = False
    return CapturedLamp(name, title or name, light, mask, white_cd_m2, distance_m, camera)


def centroid(light: FloatImage) -> tuple[float, float]:
    """Return the azimuth and elevation of the centre of an environment's energy, in degrees.

    The centre is the sum of all directions, weighted by luminance and solid angle, in panorama
    coordinates.

    Args:
        light: (H, W, 3) float32. Linear Rec. 709, not entirely black.
    """
    shape = light.shape[0], light.shape[1]
    bright = light @ np.array(LUMINANCE_WEIGHTS, np.float32)
    weight = bright * solid_angles(shape)[:, None]
    middle = np.einsum("hw,hwk->k", weight, directions(shape).astype(np.float64))
    return (
        math.degrees(math.atan2(-middle[0], middle[2])),
        math.degrees(math.atan2(middle[1], math.hypot(middle[0], middle[2]))),
    )


def centring(light: FloatImage) -> Float64:
    """Return the rotation that moves the centre of the energy to azimuth 0 and elevation 0.

    The rotation is first about the vertical axis and then downwards, which keeps an upright lamp
    upright.

    Args:
        light: (H, W, 3) float32. The light of the lamp alone.

    Returns:
        (3, 3) float64. The rotation, which moves the content (see `app.core.base.sphere`).
    """
    azimuth, elevation = centroid(light)
    return rotation(azimuth, elevation).T


def grey_lamp(lamp: CapturedLamp) -> CapturedLamp:
    """Return the lamp with grey light, as in the paper's search."""
    grey = luminance(lamp.radiance)
    return replace(lamp, radiance=np.repeat(grey[..., None], 3, axis=2))


def place_lamp(
    lamp: CapturedLamp,
    shape: tuple[int, int] = SHAPE,
    *,
    token: Token | None = None,
    report: Report = silent,
) -> PlacedLamp:
    """Rotate a lamp to every placement, preserving its energy to within 0.1%.

    Raises:
        ValueError: If `shape` does not have one column for each azimuth.
    """
    columns = COUNT // len(ALTITUDES_DEG)
    if shape[1] != columns:
        raise ValueError(f"{shape[1]} columns for {columns} azimuths")
    fine, mask, ahead_of_face = _fine(lamp)
    light = np.empty((COUNT, *shape, 3), np.float32)
    alpha = np.empty((COUNT, *shape), np.float32)
    for row, altitude in enumerate(ALTITUDES_DEG):
        (token or Token()).check()
        report(row / len(ALTITUDES_DEG), Progress(Task.TURNING_LAMP))
        raised = rotation(0.0, float(altitude)) @ ahead_of_face
        ahead, hidden = _rotate(fine, mask, raised, shape)
        for column in range(columns):
            # Towards the sitter's left is to the left in the panorama.
            light[row * columns + column] = np.roll(ahead, -column, axis=1)
            alpha[row * columns + column] = np.roll(hidden, -column, axis=1)
    has_white = lamp.white_cd_m2 is not None
    return PlacedLamp(lamp.name, lamp.title, light, alpha, lamp.distance_m, has_white)


def placed_at(
    lamp: CapturedLamp, azimuth_deg: float, altitude_deg: float, shape: tuple[int, int] = SHAPE
) -> tuple[FloatImage, Float32]:
    """Rotate a lamp to one placement.

    Returns:
        The light, (H, W, 3) float32, and the alpha, (H, W) float32, as in `PlacedLamp`.
    """
    light, alpha, ahead = _fine(lamp)
    return _rotate(light, alpha, rotation(-azimuth_deg, altitude_deg) @ ahead, shape)


def _fine(lamp: CapturedLamp) -> tuple[Float32, Float32, Float64]:
    """Enlarge a lamp for rotations, with its light in cd/m2 if the unit is known.

    Returns:
        The lamp's light, its mask, and the rotation that moves the lamp directly to the front.
    """
    light = lamp.light
    if lamp.white_cd_m2 is not None:
        light = light * np.float32(lamp.white_cd_m2)
    alpha = lamp.alpha
    times = -(-_FINE_ROWS // lamp.shape[0])
    if times > 1:
        fine_shape = lamp.shape[0] * times, lamp.shape[1] * times
        light, alpha = enlarge(light, fine_shape), enlarge(alpha, fine_shape)
    return light, alpha, centring(light)


def _rotate(
    light: Float32, alpha: Float32, matrix: Float64, shape: tuple[int, int]
) -> tuple[Float32, Float32]:
    rotated = rotate_light(light, matrix)
    energy_before, got = energy(light), energy(rotated)
    # A lamp over a pole loses about 0.1%.
    rotated *= np.divide(energy_before, got, out=np.ones_like(got), where=got > 0).astype(
        np.float32
    )
    # Plain interpolation keeps a covered area at 1.
    hidden = np.asarray(remap_frame(alpha, matrix), np.float32)
    hidden_share = reduce_radiance(hidden[..., None], shape)[..., 0]
    return reduce_radiance(rotated, shape), np.clip(hidden_share, 0.0, 1.0)
