"""Where the light comes from at a turn, and how strongly it models: the flow of light.

The light vector of a place points to where most of its light comes from; its length over the mean
spherical (scalar) illuminance says how directional the light is, from 0 for even light to 4 for
one small lamp in the dark (Lynes, Burt, Jackson and Cuttle, "The flow of light into buildings",
Transactions of the IES 31, 1966, 65-91; words after Cuttle, *Lighting by Design*, 2003, table 2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.base.angles import difference
from app.core.base.sphere import directions
from app.core.portrait.glare import eye_light, face_direction_words
from app.core.solver.environment import solid_angles

if TYPE_CHECKING:
    from numpy.typing import NDArray

_WORDS: Final = (
    (2.5, "hard light with deep shadows"),
    (1.5, "strong light with clear shadows"),
    (0.75, "soft light with open shadows"),
    (0.0, "nearly even light"),
)


@dataclass(frozen=True, slots=True)
class Flow:
    """The flow of light past a face.

    Attributes
    ----------
    azimuth_deg : float
        Where most of the light comes from, relative to the face: positive toward the sitter's
        left, deg.
    elevation_deg : float
        Positive up, deg.
    """

    azimuth_deg: float
    elevation_deg: float
    strength: float
    words: str


def light_flow(radiance: NDArray[np.floating[Any]], facing_deg: float) -> Flow:
    """Find the flow of light at a turn.

    Parameters
    ----------
    radiance : (H, 2 H, 3) or (H, 2 H) float
        Environment as of `app.core.portrait.glare.eye_light`, or its result.
    facing_deg : float
        Panorama azimuth that the sitter faces, deg.

    Raises
    ------
    ValueError
        If it is not a panorama.
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
