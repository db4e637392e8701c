"""Whether a bright lamp shines into the sitter's eyes at a turn.

The measure is veiling luminance: light of a lamp scattered in the eye lays a veil over what is
looked at, L_v = 10 E / theta^2 with E the lamp's illuminance at the eye (lux, on a surface that
faces the gaze) and theta the angle between lamp and gaze in degrees (Stiles 1929, Holladay 1926;
CIE 31-1976 and, up to 30 degrees, CIE 146:2002). It is compared with what the eye is adapted to,
the background luminance of CIE 117-1995 (unified glare rating), L_b = E_i / pi, where E_i is the
illuminance at the eye of everything that is no lamp. L_v / L_b is free of exposure, which an
environment does not always state.

Lamps are what is fifty times as bright as the background: bare sources, not windows or sky
(studies of offices count from five times on, Wienold and Christoffersen 2006, but sitters bear a
window). Beyond some fifty degrees from the gaze the brow hides a lamp (Guth's field of view ends at
53 degrees up).

The flow of light: the light vector of a place points to where most of its light comes from; its
length over the mean spherical (scalar) illuminance says how directional the light is, from 0 for
even light to 4 for one small lamp in the dark (Lynes, Burt, Jackson and Cuttle, "The flow of light
into buildings", Transactions of the IES 31, 1966, 65-91; words after Cuttle, *Lighting by Design*,
2003, table 2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.angles import difference
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage
from app.core.base.sphere import direction, directions
from app.core.solver.environment import solid_angles

if TYPE_CHECKING:
    from app.core.base.arrays import Bools, Float32, Float64, Floats

_WORDS: Final = (
    (2.5, "hard light with deep shadows"),
    (1.5, "strong light with clear shadows"),
    (0.75, "soft light with open shadows"),
    (0.0, "nearly even light"),
)


@dataclass(frozen=True, slots=True)
class Flow:
    """The flow of light past a face."""

    # where most of the light comes from, relative to the face: positive toward the sitter's left,
    # deg
    azimuth_deg: float
    elevation_deg: float  # positive up, deg
    strength: float
    words: str


def light_flow(radiance: Floats, facing_deg: float) -> Flow:
    """Find the flow of light at a turn.

    `radiance`: (H, 2 H, 3) or (H, 2 H) float, environment as of
    `app.core.portrait.glare.eye_light`, or its result.
    `facing_deg`: panorama azimuth that the sitter faces, deg.
    """
    light = eye_light(radiance)
    shape = (light.shape[0], light.shape[1])
    energy = light.astype(np.float64) * solid_angles(shape)[:, None]
    vector = np.tensordot(energy, directions(shape).astype(np.float64), axes=2)
    scalar = float(energy.sum()) / 4.0
    length = float(np.linalg.norm(vector))
    strength = length / scalar if scalar > 0 else 0.0
    words = next(text for least, text in _WORDS if strength >= least)
    if strength < _WORDS[2][0]:
        return Flow(0.0, 0.0, strength, f"{words.capitalize()} from all around")
    aside = difference(facing_deg, math.degrees(math.atan2(-vector[0], vector[2])))
    up = math.degrees(math.asin(max(-1.0, min(1.0, float(vector[1]) / length))))
    if abs(up) > 75.0:
        place = "from overhead" if up > 0 else "from beneath"
        return Flow(aside, up, strength, f"{words.capitalize()} {place}")
    from_words = face_direction_words(aside, up)
    return Flow(aside, up, strength, f"{words.capitalize()} from {from_words}")


Level: TypeAlias = Literal["none", "noticeable", "strong"]

NOTICEABLE: Final = 0.04
"""Least L_v / L_b that a sitter notices; the sun in a clear sky has it 45 degrees off."""

STRONG: Final = 0.10
"""Least L_v / L_b that makes a sitter squint; the sun in a clear sky has it some 33 degrees off."""

_GRID: Final = (256, 512)
_BARE: Final = 50.0  # times the background
_ROUNDS: Final = 3
_WIDEST_DEG: Final = 50.0
_STRONG_DEG: Final = 40.0
_NEAREST_DEG: Final = 1.0  # the formula has no end at 0
_LOWEST_DEG: Final = -3.0  # what is under the horizon is a reflection, and eyes are lowered from it
_ONE_LAMP_DEG: Final = 6.0
_SAME_SUN_DEG: Final = 6.0


@dataclass(frozen=True, slots=True)
class Glare:
    """Glare in the sitter's eyes at one turn."""

    level: Level
    # of the worst lamp, relative to the face: positive toward the sitter's left, deg
    azimuth_deg: float
    elevation_deg: float  # positive up, deg
    veil: float
    words: str

    @property
    def warns(self) -> bool:
        """Whether there is anything to warn of."""
        return self.level != "none"


def eye_light(radiance: Floats) -> FloatImage:
    """Reduce an environment to what `glare` looks at; worth keeping where many turns are asked.

    `radiance`: (H, 2 H, 3) or (H, 2 H) float, linear Rec. 709 radiance, or luminance, any exposure;
    panorama frame.
    Returns (h, 2 h) float32: luminance, at most 256 x 512.
    Raises ValueError if it is not a panorama.
    """
    light = np.asarray(radiance, np.float32)
    if light.ndim == 3 and light.shape[2] == 3:
        # A matrix of one row: one pass without a copy.
        light = np.asarray(cv2.transform(light, np.array([LUMINANCE_WEIGHTS])), np.float32)
    if light.ndim != 2 or light.shape[1] != 2 * light.shape[0]:
        raise ValueError(f"a panorama has the shape (H, 2 H), not {light.shape}")
    if light.shape[0] > _GRID[0]:
        small = cv2.resize(light, (_GRID[1], _GRID[0]), interpolation=cv2.INTER_AREA)
        light = np.asarray(small, np.float32)
    return light


def glare(
    radiance: Floats,
    facing_deg: float,
    sun: tuple[float, float] | None = None,
) -> Glare:
    """Judge the glare in the eyes of a sitter who looks at the photographer.

    `radiance`: (H, 2 H, 3) or (H, 2 H) float, environment as of `eye_light`, or its result.
    `facing_deg`: panorama azimuth that the sitter faces, the turn plus the azimuth of the front,
    deg.
    `sun`: panorama azimuth and elevation of the sun where it is known, deg, so that it is called by
    its name.
    """
    light = eye_light(radiance)
    shape = (light.shape[0], light.shape[1])
    gaze = direction(facing_deg, 0.0)
    cosine = _directions(shape) @ gaze.astype(np.float32)
    onto_eye = light * np.maximum(cosine, 0.0) * _areas(shape)
    bare = _bare(light, onto_eye, cosine, shape)
    background = float(onto_eye[~bare].sum()) / math.pi
    lamps = np.nonzero(bare & (_elevations(shape) > _LOWEST_DEG))
    away = np.degrees(np.arccos(np.clip(cosine[lamps].astype(np.float64), -1.0, 1.0)))
    near = away < _WIDEST_DEG
    if background <= 0 or not near.any():
        return _no_glare(0.0)
    rows, columns, away = lamps[0][near], lamps[1][near], away[near]
    veils = 10.0 * onto_eye[rows, columns] / np.maximum(away, _NEAREST_DEG) ** 2 / background
    return _judge(_directions(shape)[rows, columns].astype(np.float64), veils, facing_deg, sun)


def _bare(light: FloatImage, onto_eye: Float32, cosine: Float32, shape: tuple[int, int]) -> Bools:
    """Mark texels that are lamps: what is 50 times as bright as all that is no lamp."""
    front = cosine > 0
    total, weight = float(onto_eye.sum()), math.pi
    bare = np.zeros(shape, bool)
    for _ in range(_ROUNDS):
        level = _BARE * total / weight
        bare = front & (light > level)
        total = float(onto_eye[~bare].sum())
    return bare


def _judge(
    vectors: Float64, veils: Float64, facing_deg: float, sun: tuple[float, float] | None
) -> Glare:
    """Find the worst lamp and name it."""
    veil = float(veils.sum())
    worst = vectors[int(np.argmax(veils))]
    one = vectors @ worst > math.cos(math.radians(_ONE_LAMP_DEG))
    centre = (vectors[one] * veils[one, None]).sum(axis=0)
    centre /= np.linalg.norm(centre)
    azimuth = math.degrees(math.atan2(-centre[0], centre[2]))
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, float(centre[1])))))
    aside = difference(facing_deg, azimuth)
    away = math.degrees(math.acos(float(np.clip(centre @ direction(facing_deg, 0.0), -1.0, 1.0))))
    if veil < NOTICEABLE:
        return _no_glare(veil, aside, elevation)
    is_sun = sun is not None and float(centre @ direction(*sun)) > math.cos(
        math.radians(_SAME_SUN_DEG)
    )
    name = "The sun" if is_sun else "A bright lamp"
    place = face_direction_words(aside, elevation)
    if veil >= STRONG and away <= _STRONG_DEG:
        words = f"{name} shines into the sitter’s eyes at this turn: {place}. Expect squinting."
        return Glare("strong", aside, elevation, veil, words)
    words = f"{name} is in the sitter’s view at this turn: {place}. The eyes may narrow."
    return Glare("noticeable", aside, elevation, veil, words)


def _no_glare(veil: float, azimuth_deg: float = 0.0, elevation_deg: float = 0.0) -> Glare:
    words = "No bright lamp shines into the sitter’s eyes at this turn."
    return Glare("none", azimuth_deg, elevation_deg, veil, words)


def face_direction_words(azimuth_deg: float, elevation_deg: float) -> str:
    """Say where a direction lies from the sitter's face.

    `azimuth_deg`: relative to the face, positive toward the sitter's left, deg.
    `elevation_deg`: positive up, deg.

    Examples:
        >>> face_direction_words(12.0, 30.2)
        '12° to the sitter’s left (camera right), 30° up'
        >>> face_direction_words(-0.3, -8.0)
        'straight ahead, 8° down'
    """
    aside, up = round(azimuth_deg), round(elevation_deg)
    if aside == 0:
        side = "straight ahead"
    elif abs(aside) == 180:
        side = "straight behind"
    else:
        side = f"{abs(aside)}° to the sitter’s " + (
            "left (camera right)" if aside > 0 else "right (camera left)"
        )
    height = "at eye level" if up == 0 else f"{abs(up)}° {'up' if up > 0 else 'down'}"
    return f"{side}, {height}"


@lru_cache(maxsize=4)
def _directions(shape: tuple[int, int]) -> Float32:
    found = directions(shape)
    found.flags.writeable = False
    return found


@lru_cache(maxsize=4)
def _areas(shape: tuple[int, int]) -> Float32:
    return solid_angles(shape).astype(np.float32)[:, None]


@lru_cache(maxsize=4)
def _elevations(shape: tuple[int, int]) -> Float32:
    rows = 90.0 - 180.0 * (np.arange(shape[0], dtype=np.float32) + 0.5) / shape[0]
    return np.broadcast_to(rows[:, None], shape)
