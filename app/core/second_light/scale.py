"""How bright a place is: what a lamp's light can be added to.

A lamp rescues a style by night that it cannot touch in the sun, so the place's brightness must be
known in cd/m2. An environment that was merged from exposures states it; of any other somebody has
to say how much light falls on the face.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import CoreError
from app.core.base.image_input import open_image
from app.core.solver.environment import solid_angles
from app.core.solver.search_light import luminance_of

Floats: TypeAlias = NDArray[np.floating[Any]]

ASSUMED_LUX: Final = 200.0
"""Vertical illuminance at the face where nothing is known: a lit room."""

_ATTRIBUTE: Final = "whiteLuminance"
_MOST: Final = 1e12
_MOST_LUX: Final = 1e6
_USUAL: Final = "A candle-lit table has 10, a lit room 200, a cloudy day 10,000, the sun 60,000."
_NUMBER: Final = re.compile(r"\d{1,3}(?:[ ,’']\d{3})+|\d+(?:[.,]\d+)?|[.,]\d+")


def illuminance(light: Floats, azimuth_deg: float = 0.0) -> float:
    """Find the vertical illuminance at a face.

    Parameters
    ----------
    light : (H, W, 3) or (H, W) float
        Environment, linear Rec. 709 radiance or luminance.
    azimuth_deg : float, optional
        Azimuth in the panorama that the face looks to, deg.

    Returns
    -------
    float
        Lux where the light is in cd/m2.
    """
    luminance = luminance_of(light)
    height, width = luminance.shape
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5) - math.radians(azimuth_deg)
    facing = np.maximum(np.outer(np.cos(elevation), np.cos(azimuth)), 0.0)
    return float((luminance * facing).sum(axis=1) @ solid_angles((height, width)))


def check_lux(lux: float) -> float:
    """Give an illuminance at the face back, unless there is no such light to photograph in.

    Raises
    ------
    CoreError
        Otherwise.
    """
    if not 0.0 < lux <= _MOST_LUX:
        raise CoreError(f"{lux:g} lux is no light to photograph in.", _USUAL)
    return lux


def read_lux(text: str) -> float:
    """Read an illuminance as somebody types it.

    Raises
    ------
    CoreError
        If it is no number, or no light to photograph in.

    Examples
    --------
    >>> read_lux("450 lx"), read_lux("8,000"), read_lux("2,5"), read_lux("60 000 lux")
    (450.0, 8000.0, 2.5, 60000.0)
    """
    plain = text.strip().lower().replace("\N{NO-BREAK SPACE}", " ")
    number = plain.removesuffix("lux").removesuffix("lx").strip()
    if not _NUMBER.fullmatch(number):
        raise CoreError("This is no number of lux.", "Type what the meter reads, as 450.")
    parts = re.split(r"[ ,’']", number)
    if len(parts) > 1 and all(len(part) == 3 for part in parts[1:]):
        return check_lux(float("".join(parts)))
    return check_lux(float(number.replace(",", ".")))


def stated_white(path: Path | str) -> float | None:
    """Read the luminance of radiance 1 that an OpenEXR file states.

    Returns
    -------
    float or None
        Cd/m2; None where the file states none, or cannot be read.
    """
    source = open_image(Path(path))
    if source is None:
        return None
    value = float(source.spec().get_float_attribute(_ATTRIBUTE, 0.0))
    source.close()
    return value if 0.0 < value <= _MOST else None
