"""The brightness of a place, for adding the light of a lamp.

A lamp that rescues a style at night has no effect in the sun, so the brightness of the place must
be known in cd/m2. An environment that was merged from exposures records it. For any other
environment, the user has to enter the illuminance at the face.

The light of a lamp and the light of a place can be added if both are known in cd/m2, from the
exposures recorded in their frames. For a single camera, ISO, aperture and shutter give the scale to
within a few percent from capture to capture. For two cameras, they give it only to about half a
stop.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.arrays import Floats
from app.core.base.errors import CoreError
from app.core.base.imaging.image_input import open_image
from app.core.environment.environment import solid_angles
from app.core.solver.search import luminance_of
from app.core.text import tr

if TYPE_CHECKING:
    from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp


_MOST_LAMP_LUX: Final = 1e7


class Unknown(Enum):
    """The brightness that is not known in cd/m2, either that of the lamp or that of the place."""

    LAMP = auto()
    PLACE = auto()
    BOTH = auto()


@dataclass(frozen=True, slots=True)
class Comparison:
    """The result of comparing the scales of a lamp and a place.

    Attributes:
        unknown: The unknown brightness, or None if both are known.
        title: Title of the lamp.
        cameras: Cameras used for the lamp and for the place, or None if they are the same.
    """

    unknown: Unknown | None = None
    title: str = ""
    cameras: tuple[str, str] | None = None

    @property
    def possible(self) -> bool:
        """Whether the place and the lamp are both known in cd/m2."""
        return self.unknown is None


def compare(
    place_white_cd_m2: float | None, lamp: CapturedLamp, *, place_camera: str = ""
) -> Comparison:
    """Compare the scale of a place's capture with that of a lamp's capture.

    Args:
        place_white_cd_m2: Luminance that corresponds to a radiance of 1 at the place, in cd/m2, or
            None if its exposure is unknown.

    Examples:
        >>> import numpy as np
        >>> from app.core.second_light.captured_lamps.captured_lamp import make_lamp
        >>> light = np.ones((2, 4, 3), np.float32)
        >>> lamp = make_lamp("phone", light, light[..., 0], white_cd_m2=600.0)
        >>> compare(None, lamp).possible
        False
        >>> compare(120.0, lamp).possible
        True
    """
    place_known = _has_scale(place_white_cd_m2)
    if not _has_scale(lamp.white_cd_m2):
        return Comparison(Unknown.LAMP if place_known else Unknown.BOTH, lamp.title)
    if not place_known:
        return Comparison(Unknown.PLACE, lamp.title)
    cameras = {place_camera.strip().casefold(), lamp.camera.strip().casefold()}
    if "" not in cameras and len(cameras) == 2:
        return Comparison(None, lamp.title, (lamp.camera, place_camera))
    return Comparison(None, lamp.title)


def with_lux(lamp: CapturedLamp, lux: float) -> CapturedLamp:
    """Set the brightness of a lamp from a light meter reading taken at the probe's position.

    Raises:
        CoreError: If the reading is out of range.
    """
    if not (math.isfinite(lux) and 0.0 < lux <= _MOST_LAMP_LUX):
        raise CoreError(
            tr("No lamp gives {lux:g} lux.", lux=lux),
            tr("Enter the reading of your light meter."),
        )
    unit = replace(lamp, white_cd_m2=1.0)
    face_lux = unit.lux
    if not face_lux:
        raise CoreError(tr("{title} emits no light.", title=lamp.title), tr("Mark the lamp."))
    return replace(lamp, white_cd_m2=lux / face_lux)


def _has_scale(white: float | None) -> bool:
    return white is not None and math.isfinite(white) and white > 0.0


ASSUMED_LUX: Final = 200.0
"""Vertical illuminance assumed at the face, in lux, which is that of a lit room."""

_ATTRIBUTE: Final = "whiteLuminance"
_MOST: Final = 1e12
_MOST_LUX: Final = 1e6
_NUMBER: Final = re.compile(r"\d{1,3}(?:[ ,’']\d{3})+|\d+(?:[.,]\d+)?|[.,]\d+")


def illuminance(light: Floats, azimuth_deg: float = 0.0) -> float:
    """Return the vertical illuminance at a face, in lux if the light is in cd/m2.

    Args:
        light: (H, W, 3) or (H, W) float. Environment, as linear Rec. 709 radiance or luminance.
        azimuth_deg: Panorama azimuth towards which the face looks, in degrees.
    """
    luminance = luminance_of(light)
    height, width = luminance.shape
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5) - math.radians(azimuth_deg)
    facing = np.maximum(np.outer(np.cos(elevation), np.cos(azimuth)), 0.0)
    return float((luminance * facing).sum(axis=1) @ solid_angles((height, width)))


def check_lux(lux: float) -> float:
    """Check that an illuminance at the face, in lux, is plausible, and return it.

    Raises:
        CoreError: If the illuminance is implausible.
    """
    if not 0.0 < lux <= _MOST_LUX:
        raise CoreError(
            tr("{lux:g} lux is not a plausible light level.", lux=lux),
            tr("Typical values: candle-lit table 10, lit room 200, cloudy day 10,000, sun 60,000."),
        )
    return lux


def read_lux(text: str) -> float:
    """Parse an illuminance entered by the user, in lux.

    Raises:
        CoreError: If the text is not a number, or if the number is implausible.

    Examples:
        >>> read_lux("450 lx"), read_lux("8,000"), read_lux("2,5"), read_lux("60 000 lux")
        (450.0, 8000.0, 2.5, 60000.0)
    """
    plain = text.strip().lower().replace("\N{NO-BREAK SPACE}", " ")
    number = plain.removesuffix("lux").removesuffix("lx").strip()
    if not _NUMBER.fullmatch(number):
        raise CoreError(
            tr("This is not a valid lux value."),
            tr("Enter the reading of your light meter, such as 450."),
        )
    parts = re.split(r"[ ,’']", number)
    if len(parts) > 1 and all(len(part) == 3 for part in parts[1:]):
        return check_lux(float("".join(parts)))
    return check_lux(float(number.replace(",", ".")))


def stated_white(path: Path | str) -> float | None:
    """Read the luminance that corresponds to a radiance of 1 from an OpenEXR file.

    Returns:
        The luminance, in cd/m2, or None if the file records none or cannot be read.
    """
    source = open_image(Path(path))
    if source is None:
        return None
    value = float(source.spec().get_float_attribute(_ATTRIBUTE, 0.0))
    source.close()
    return value if 0.0 < value <= _MOST else None
