"""The light on a face at a turn: lighting ratio, direction, and glare in the eyes.

**Lighting ratio**: the brightness of the lit side divided by that of the shadow side. Photographers
express it as key plus fill to fill, because the lit cheek receives both lights and the shadow cheek
receives only the fill. The ratio of the two readings is 2 to the power of their difference in stops
(Hunter, Biver and Fuqua, *Light: Science and Magic*, chapter on portraits; Langford, *Basic
Photography*). Both cheeks are measured as with a spot meter, but in the linear picture.

The two areas are mirror images of each other, so skin tone and the shape of the cheeks cancel out
on a symmetrical head. They are on the fronts of the cheeks, away from the eyes, nose and ears and
from the edge of the face with its rim light. As in a spot meter, the light in an area is averaged,
so a shadow that covers half of an area counts half. Only highlights, which are much brighter than
four fifths of the area, are limited.

**Glare**: the measure is veiling luminance. Light from a lamp is scattered in the eye and adds a
veil to the view, L_v = 10 E / theta^2, where E is the illuminance from the lamp at the eye (in lux,
on a surface that faces the gaze) and theta is the angle between lamp and gaze in degrees (Stiles
1929, Holladay 1926; CIE 31-1976 and, up to 30 degrees, CIE 146:2002). The veil is compared with the
eye's adaptation, the background luminance of CIE 117-1995 (unified glare rating), L_b = E_i / pi,
where E_i is the illuminance at the eye without lamps. L_v / L_b does not depend on the exposure,
which is not known for every environment.

Lamps are sources at least fifty times as bright as the background. This covers bare sources, but
not windows or the sky (studies of offices count sources from five times on, Wienold and
Christoffersen 2006, but sitters tolerate a window). Beyond about fifty degrees from the gaze, the
brow hides a lamp (Guth's field of view ends at 53 degrees up).

**The flow of light**: the light vector at a place points in the direction from which most of the
light comes. Its length divided by the mean spherical (scalar) illuminance is the directionality of
the light, from 0 for even light to 4 for one small lamp in the dark (Lynes, Burt, Jackson and
Cuttle, "The flow of light into buildings", Transactions of the IES 31, 1966, 65-91; terms after
Cuttle, *Lighting by Design*, 2003, table 2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.angles import difference
from app.core.base.arrays import Bools, Float32, Float64, Floats, Indices
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage
from app.core.base.sphere import bounded, direction, directions
from app.core.environment.environment import solid_angles
from app.core.measure.finish.findings import Findings
from app.core.measure.finish.lamp_detection import Source
from app.core.solver.transport import Transport

KeySide: TypeAlias = Literal["left", "right", "none"]
"""The brighter side of the face, as named by the sitter."""

EVEN_STOPS: Final = 0.15
"""Difference in stops below which the cheeks count as equal, half of the usual third of a stop."""

DEEPEST_STOPS: Final = 5.0
"""Difference in stops above which a fill light is not visible: the shadow is almost black."""

# Centre of a cheek, in half distances between the eyes: from the middle and below the eyes.
_ASIDE: Final = 1.11
_UNDER: Final = 1.145
_RADIUS: Final = 0.49
# Range of the search for the eyes, in mm from the middle and from the crown, and the position of
# the eyes if none are found.
_ACROSS_MM: Final = (15.0, 50.0)
_DOWN_MM: Final = (65.0, 140.0)
_EYES_MM: Final = (31.0, 103.0)
_EYE_COLOUR: Final = 1.35  # blue over red, relative to the skin's
_LEAST_EYE_PIXELS: Final = 8
_MOST_PERCENTILE: Final = 80.0
_HIGHLIGHT: Final = 1.5  # times that percentile
_SHADOW: Final = 1.0 / 256.0  # of the bright parts of the face: a cheek without light
_BLACK: Final = 1e-6  # of the face's brightest pixel: below it, rendering is unreliable
_BRIGHT_PERCENTILE: Final = 99.0


@dataclass(frozen=True, slots=True)
class LightingRatio:
    """The lighting ratio between the two sides of a face.

    Attributes:
        stops: Ratio of the lit cheek to the shadow cheek, in stops, never negative.
        key_side: The brighter side.
        lit: "cheeks" if light reaches the cheeks, "face" if it reaches only other parts of the
            face, such as rims, or "none" if it reaches no part.
    """

    stops: float
    key_side: KeySide
    lit: Literal["cheeks", "face", "none"] = "cheeks"


def lighting_ratio(
    transport: Transport,
    picture: Floats,
    areas: tuple[Indices, Indices] | None = None,
) -> LightingRatio:
    """Measure the lighting ratio in a picture of the head.

    The result has no side and 0 stops if both cheeks are in shadow, as with rim light alone.

    Args:
        picture: (P, 3) or (P,) float. Linear Rec. 709 picture on the head's pixels
            (`app.core.solver.transport.render`), or its luminance, at any exposure.
        areas: Pixels of the two cheeks, (M,) int each, from `cheeks`. They can be reused for many
            pictures of the same head.

    Raises:
        ValueError: If the picture does not match the transport's pixels, or is not finite.
    """
    values = np.asarray(picture, np.float64)
    if values.shape[:1] != transport.pixels.shape or values.ndim > 2:
        raise ValueError(f"the head has {transport.pixels.size} pixels, not {values.shape}")
    if values.ndim == 2:
        values = values @ np.asarray(transport.header.luminance_weights)
    if not np.isfinite(values).all():
        raise ValueError("the picture is not finite")
    peak = float(values.max(initial=0.0))
    if peak <= 0:
        return LightingRatio(0.0, "none", "none")
    left, right = (_level(values[area]) for area in areas or cheeks(transport))
    bright = float(np.percentile(values[transport.face], _BRIGHT_PERCENTILE))
    if max(left, right) <= _SHADOW * bright:
        return LightingRatio(0.0, "none", "face")
    floor = _BLACK * peak
    stops = math.log2(max(left, floor) / max(right, floor))
    side: KeySide = "left" if stops > 0 else "right"
    if abs(stops) < EVEN_STOPS:
        side = "none"
    return LightingRatio(abs(stops), side)


def cheeks(transport: Transport) -> tuple[Indices, Indices]:
    """Return the pixels of the two cheeks, for comparison.

    Args:
        transport: Transport of a head seen from the front, centred in the picture, with its crown
            at the upper edge of the covered area.

    Returns:
        Indices of the head's pixels, (M,) int each: the sitter's left cheek (on the right in the
        picture), followed by the right cheek.

    Raises:
        ValueError: If there is no head where the cheeks should be.
    """
    row, column = np.divmod(transport.pixels.astype(np.int64), transport.size)
    row, column = row + 0.5, column + 0.5 - transport.size / 2.0
    half, eyes = _eyes(transport, row, column)
    radius = max(_RADIUS * half, 1.5)
    areas = []
    for sign in (1.0, -1.0):
        near = np.hypot(row - eyes - _UNDER * half, column - sign * _ASIDE * half) <= radius
        areas.append(np.flatnonzero(near & transport.face))
    if not all(area.size for area in areas):
        raise ValueError("there is no face where its cheeks should be")
    return areas[0], areas[1]


def _eyes(transport: Transport, row: Float64, column: Float64) -> tuple[float, float]:
    """Return half the distance between the two eyes, and the row of the eyes, in pixels.

    The eyes are found by their colour in even light: the white and the iris are bluer than any
    skin.
    """
    across_mm = 2000.0 * transport.header.distance_m
    step = across_mm * math.tan(math.radians(transport.header.fov_deg) / 2.0) / transport.size
    crown = float(row[transport.face].min(initial=transport.size)) - 0.5
    aside, down = np.abs(column) * step, (row - crown) * step
    even = transport.pixel_basis @ transport.texel_basis.sum(axis=1)
    blueness = even[2] / np.maximum(even[0], 1e-12)
    eye = transport.face & (blueness > _EYE_COLOUR * np.median(blueness[transport.face]))
    eye &= (aside > _ACROSS_MM[0]) & (aside < _ACROSS_MM[1])
    eye &= (down > _DOWN_MM[0]) & (down < _DOWN_MM[1])
    if np.count_nonzero(eye) < _LEAST_EYE_PIXELS:
        return _EYES_MM[0] / step, crown + _EYES_MM[1] / step
    return float(np.abs(column[eye]).mean()), float(row[eye].mean())


def _level(values: Float64) -> float:
    """Return the mean of an area, with its highlights limited."""
    positive = np.maximum(values, 0.0)
    limit = _HIGHLIGHT * float(np.percentile(positive, _MOST_PERCENTILE))
    return float(np.minimum(positive, limit).mean())


class Hardness(Enum):
    """Directionality of the light, from hard to even."""

    HARD = 2.5
    STRONG = 1.5
    SOFT = 0.75
    EVEN = 0.0


@dataclass(frozen=True, slots=True)
class Flow:
    """The flow of light past a face.

    Attributes:
        azimuth_deg: Main direction of the light relative to the face, in degrees, positive towards
            the sitter's left, or 0 for even light.
        elevation_deg: Elevation of this direction, in degrees, positive upwards, or 0 for even
            light.
        strength: Length of the light vector divided by the scalar illuminance, 0 to 4.
    """

    azimuth_deg: float
    elevation_deg: float
    strength: float

    @property
    def hardness(self) -> Hardness:
        """The directionality of the light. Even light comes from no particular direction."""
        return next(one for one in Hardness if self.strength >= one.value)


def light_flow(radiance: Floats, facing_deg: float) -> Flow:
    """Return the flow of light at a turn.

    Args:
        radiance: (H, 2 H, 3) or (H, 2 H) float. The environment, as for `eye_light`, or the result
            of that function.
        facing_deg: Panorama azimuth that the sitter faces, in degrees.
    """
    light = eye_light(radiance)
    shape = (light.shape[0], light.shape[1])
    energy = light.astype(np.float64) * solid_angles(shape)[:, None]
    vector = np.tensordot(energy, directions(shape).astype(np.float64), axes=2)
    scalar = float(energy.sum()) / 4.0
    length = float(np.linalg.norm(vector))
    strength = length / scalar if scalar > 0 else 0.0
    if strength < Hardness.SOFT.value:
        return Flow(0.0, 0.0, strength)
    aside = difference(facing_deg, math.degrees(math.atan2(-vector[0], vector[2])))
    up = math.degrees(math.asin(max(-1.0, min(1.0, float(vector[1]) / length))))
    return Flow(aside, up, strength)


Level: TypeAlias = Literal["none", "noticeable", "strong"]

NOTICEABLE: Final = 0.04
"""Smallest L_v / L_b that a sitter notices, that of the sun in a clear sky, 45 degrees away."""

STRONG: Final = 0.10
"""Smallest L_v / L_b that makes a sitter squint, that of the sun in a clear sky, 33 degrees away.
"""

_WIDEST: Final = 512
_BARE: Final = 50.0  # times the background
_ROUNDS: Final = 3
_WIDEST_DEG: Final = 50.0
_STRONG_DEG: Final = 40.0
_NEAREST_DEG: Final = 1.0  # the formula diverges at 0
_LOWEST_DEG: Final = -3.0  # light below the horizon is a reflection, and eyes turn away from it
_ONE_LAMP_DEG: Final = 6.0
_SAME_SUN_DEG: Final = 6.0


@dataclass(frozen=True, slots=True)
class Glare:
    """The glare in the sitter's eyes at one turn."""

    level: Level
    # azimuth of the worst lamp from the face's direction, positive towards the sitter's left, in
    # degrees
    azimuth_deg: float
    elevation_deg: float  # positive up, in degrees
    veil: float
    kind: Source = "lamp"  # of the worst lamp

    @property
    def warns(self) -> bool:
        """Whether to warn about the glare."""
        return self.level != "none"


def eye_light(radiance: Floats) -> FloatImage:
    """Reduce an environment for `glare`, so that it can be reused for several turns.

    Args:
        radiance: (H, 2 H, 3) or (H, 2 H) float. Linear Rec. 709 radiance, or luminance, at any
            exposure, in panorama coordinates.

    Returns:
        (h, 2 h) float32. The luminance, at most 256 x 512.

    Raises:
        ValueError: If the environment is not a panorama.
    """
    light = np.asarray(radiance, np.float32)
    if light.ndim == 3 and light.shape[2] == 3:
        # A matrix of one row needs only one pass, without a copy.
        light = np.asarray(cv2.transform(light, np.array([LUMINANCE_WEIGHTS])), np.float32)
    if light.ndim != 2 or light.shape[1] != 2 * light.shape[0]:
        raise ValueError(f"a panorama has the shape (H, 2 H), not {light.shape}")
    return bounded(light, _WIDEST)


def glare(
    radiance: Floats,
    facing_deg: float,
    sun: tuple[float, float] | None = None,
    findings: Findings | None = None,
) -> Glare:
    """Estimate the glare in the eyes of a sitter who looks at the photographer.

    Args:
        radiance: (H, 2 H, 3) or (H, 2 H) float. The environment, as for `eye_light`, or the result
            of that function.
        facing_deg: Panorama azimuth that the sitter faces, in degrees, which is the turn plus the
            azimuth of the front.
        sun: Panorama azimuth and elevation of the sun, in degrees, for recognising the sun, or None
            if unknown.
        findings: Lamps at the place, for naming the worst one.
    """
    light = eye_light(radiance)
    shape = (light.shape[0], light.shape[1])
    gaze = direction(facing_deg, 0.0)
    cosine = _directions(shape) @ gaze.astype(np.float32)
    onto_eye = light * np.maximum(cosine, 0.0) * _areas(shape)
    bare = _bare(light, onto_eye, cosine, shape)
    background = float(onto_eye[~bare].sum()) / math.pi
    elevations = 90.0 - 180.0 * (np.arange(shape[0], dtype=np.float32) + 0.5) / shape[0]
    lamps = np.nonzero(bare & (elevations > _LOWEST_DEG)[:, None])
    away = np.degrees(np.arccos(np.clip(cosine[lamps].astype(np.float64), -1.0, 1.0)))
    near = away < _WIDEST_DEG
    if background <= 0 or not near.any():
        return Glare("none", 0.0, 0.0, 0.0)
    rows, columns, away = lamps[0][near], lamps[1][near], away[near]
    veils = 10.0 * onto_eye[rows, columns] / np.maximum(away, _NEAREST_DEG) ** 2 / background
    vectors = _directions(shape)[rows, columns].astype(np.float64)
    return _judge(vectors, veils, facing_deg, sun, findings)


def _bare(light: FloatImage, onto_eye: Float32, cosine: Float32, shape: tuple[int, int]) -> Bools:
    """Return a mask of the lamps' texels, 50 times as bright as the light without lamps."""
    front = cosine > 0
    total, weight = float(onto_eye.sum()), math.pi
    bare = np.zeros(shape, bool)
    for _ in range(_ROUNDS):
        level = _BARE * total / weight
        bare = front & (light > level)
        total = float(onto_eye[~bare].sum())
    return bare


def _judge(
    vectors: Float64,
    veils: Float64,
    facing_deg: float,
    sun: tuple[float, float] | None,
    findings: Findings | None,
) -> Glare:
    """Find the lamp that causes the most glare, and name it."""
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
        return Glare("none", aside, elevation, veil)
    is_sun = sun is not None and float(centre @ direction(*sun)) > math.cos(
        math.radians(_SAME_SUN_DEG)
    )
    lamp = None if findings is None else findings.at(azimuth, elevation, _ONE_LAMP_DEG)
    kind: Source = "sun" if is_sun else "lamp" if lamp is None else lamp.kind
    level: Level = "strong" if veil >= STRONG and away <= _STRONG_DEG else "noticeable"
    return Glare(level, aside, elevation, veil, kind)


@lru_cache(maxsize=4)
def _directions(shape: tuple[int, int]) -> Float32:
    result = directions(shape)
    result.flags.writeable = False
    return result


@lru_cache(maxsize=4)
def _areas(shape: tuple[int, int]) -> Float32:
    return solid_angles(shape).astype(np.float32)[:, None]
