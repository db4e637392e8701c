"""A lamp that was captured in a dark room, and how it looks from the head wherever it is held.

The lamp is an environment with a mask (alpha): 1 where the lamp is, 0 elsewhere. What it gives is
**premultiplied**: where a texel is half lamp, its light is already half. So over a place's own
light L it is composited as eq. 7 of the paper has it,

    L_add + (1 - alpha) L.

L_add is first turned so that the middle of its energy lies straight in front of the face, then
raised by the altitude and swung by the azimuth toward the sitter's left: R = R_y R_x. The lamp is
turned at the size it was captured in, and only then reduced to the size that is searched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage, luminance
from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token, silent
from app.core.base.sphere import directions, remap_frame, rotate_light, rotation
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.solver.environment import SHAPE, energy, enlarge, reduce_radiance, solid_angles
from app.core.solver.environment_file import repair
from app.core.text import tr

LARGEST: Final = (512, 1024)
"""Rows and columns that a captured lamp is kept in: 0.35 deg."""

_FINE_ROWS: Final = 256  # the least that it is turned at


@dataclass(frozen=True, slots=True, eq=False)
class CapturedLamp:
    """A lamp as the probe saw it from where the head will be."""

    name: str
    title: str
    # (H, 2 H, 3), all that was captured, linear Rec. 709, the dark room too; read-only. Panorama
    # frame
    radiance: FloatImage = field(repr=False)
    # (H, 2 H), share of each texel that the lamp covers, 0 to 1; read-only
    alpha: Float32 = field(repr=False)
    # luminance of radiance 1, cd/m2; None where the exposure was not known
    white_cd_m2: float | None = None
    distance_m: float | None = None  # from the probe to the lamp, metres; None where unknown
    camera: str = ""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the panorama."""
        return self.radiance.shape[0], self.radiance.shape[1]

    @property
    def light(self) -> FloatImage:
        """(H, 2 H, 3) float32: the lamp alone, premultiplied, in the unit of `radiance`."""
        return self.radiance * (self.alpha > 0.0)[..., None]

    @property
    def solid_angle_sr(self) -> float:
        """What the lamp covers, seen from the probe."""
        return float(energy(self.alpha))

    @property
    def lux(self) -> float | None:
        """Illuminance of a surface that faces the lamp, at its distance; None where unknown."""
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
    """A captured lamp at all placements, as the face sees it (azimuth 0 = front)."""

    name: str
    title: str
    # (576, H, W, 3), premultiplied radiance, linear Rec. 709; number as in `placements`. cd/m2
    # where `absolute`
    light: FloatImage = field(repr=False)
    # (576, H, W), share of each texel that the lamp hides, 0 to 1
    alpha: Float32 = field(repr=False)
    # from the middle of the head, metres: the lamp holds for this distance only
    distance_m: float | None = None
    absolute: bool = True  # whether the light is in cd/m2; otherwise it is in a unit of its own


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
    """Make a lamp of a capture and its mask, repaired, and reduced where it is very fine.

    `radiance`: (H, 2 H, 3) float32, linear Rec. 709. It is not changed.
    `alpha`: (H, 2 H) float32, mask; values outside 0 to 1 are clipped, what is not a number becomes
    0.
    Raises CoreError when the sizes do not fit, or there is no light within the mask.
    """
    shape = radiance.shape
    if radiance.ndim != 3 or shape[2] != 3 or shape[0] < 1 or shape[1] != 2 * shape[0]:
        raise CoreError(
            tr("{name} is not a full panorama: it has the shape {shape}.", name=name, shape=shape)
        )
    if alpha.shape != shape[:2]:
        raise CoreError(
            tr(
                "The mask of {name} has the shape {mask}, its light {light}.",
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
        # The lamp's own light, so that its edge does not take the room's in.
        lamp = both[..., :3] * (both[..., 3:] > 0)
        edge = reduce_radiance(lamp, LARGEST)
        both = reduce_radiance(both, LARGEST)
        covered = both[..., 3] > 0
        both[covered, :3] = edge[covered]
    light, mask = np.ascontiguousarray(both[..., :3]), np.clip(both[..., 3], 0.0, 1.0)
    if not (light[mask > 0] > 0).any():
        raise CoreError(
            tr("The mask of {name} has no light in it.", name=name), tr("Mark where the lamp is.")
        )
    light.flags.writeable = mask.flags.writeable = False
    return CapturedLamp(name, title or name, light, mask, white_cd_m2, distance_m, camera)


def centroid(light: FloatImage) -> tuple[float, float]:
    """Find the direction of the middle of an environment's energy.

    `light`: (H, W, 3) float32, linear Rec. 709, not all black.
    Panorama frame: of the sum of the directions, weighted by luminance and solid angle.
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
    """Return the rotation that brings the middle of the energy to azimuth 0, elevation 0.

    It swings about the vertical, then lowers: a lamp that stood upright stays upright.

    `light`: (H, W, 3) float32, the lamp alone.
    Returns (3, 3) float64: moves the content, see `app.core.base.sphere`.
    """
    azimuth, elevation = centroid(light)
    return rotation(azimuth, elevation).T


def grey_lamp(lamp: CapturedLamp) -> CapturedLamp:
    """Take the colours out of a lamp, as the paper's search does."""
    grey = luminance(lamp.radiance)
    return replace(lamp, radiance=np.repeat(grey[..., None], 3, axis=2))


def placed(
    lamp: CapturedLamp,
    shape: tuple[int, int] = SHAPE,
    *,
    token: Token | None = None,
    report: Report = silent,
) -> PlacedLamp:
    """Turn a lamp to all placements.

    The energy of the light is kept to 0.1 %.
    Raises ValueError when `shape` does not have one column to each azimuth.
    """
    columns = COUNT // len(ALTITUDES_DEG)
    if shape[1] != columns:
        raise ValueError(f"{shape[1]} columns for {columns} azimuths")
    fine, mask, ahead_of_face = _fine(lamp)
    light = np.empty((COUNT, *shape, 3), np.float32)
    alpha = np.empty((COUNT, *shape), np.float32)
    for row, altitude in enumerate(ALTITUDES_DEG):
        (token or Token()).check()
        report(row / len(ALTITUDES_DEG), tr("Turning the lamp"))
        raised = rotation(0.0, float(altitude)) @ ahead_of_face
        ahead, hidden = _turned(fine, mask, raised, shape)
        for column in range(columns):
            # Toward the sitter's left is to the left in the panorama.
            light[row * columns + column] = np.roll(ahead, -column, axis=1)
            alpha[row * columns + column] = np.roll(hidden, -column, axis=1)
    known = lamp.white_cd_m2 is not None
    return PlacedLamp(lamp.name, lamp.title, light, alpha, lamp.distance_m, known)


def placed_at(
    lamp: CapturedLamp, azimuth_deg: float, altitude_deg: float, shape: tuple[int, int] = SHAPE
) -> tuple[FloatImage, Float32]:
    """Turn a lamp to any one placement.

    Returns `light`: (H, W, 3) float32, as one of `PlacedLamp.light`.
    and `alpha`: (H, W) float32, as one of `PlacedLamp.alpha`.
    """
    light, alpha, ahead = _fine(lamp)
    return _turned(light, alpha, rotation(-azimuth_deg, altitude_deg) @ ahead, shape)


def _fine(lamp: CapturedLamp) -> tuple[Float32, Float32, Float64]:
    """Bring a lamp to the size that it is turned at, in cd/m2 where that is known.

    Returns its light, its mask, and the rotation that brings it straight ahead.
    """
    light = lamp.light
    if lamp.white_cd_m2 is not None:
        light = light * np.float32(lamp.white_cd_m2)
    alpha = lamp.alpha
    times = -(-_FINE_ROWS // lamp.shape[0])
    if times > 1:
        wanted = lamp.shape[0] * times, lamp.shape[1] * times
        light, alpha = enlarge(light, wanted), enlarge(alpha, wanted)
    return light, alpha, centring(light)


def _turned(
    light: Float32, alpha: Float32, matrix: Float64, shape: tuple[int, int]
) -> tuple[Float32, Float32]:
    turned = rotate_light(light, matrix)
    held, got = energy(light), energy(turned)
    # Of a lamp over a pole some 0.1 % is lost.
    turned *= np.divide(held, got, out=np.ones_like(got), where=got > 0).astype(np.float32)
    # Plain interpolation for the mask: an area that is covered stays covered, with 1.
    hidden = np.asarray(remap_frame(alpha, matrix), np.float32)
    covered = reduce_radiance(hidden[..., None], shape)[..., 0]
    return reduce_radiance(turned, shape), np.clip(covered, 0.0, 1.0)
