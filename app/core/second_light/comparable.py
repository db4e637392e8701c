"""Whether the light of a lamp and the light of a place may be added.

They may when both are known in cd/m2, from the exposures that their frames state. ISO, aperture
and shutter of one camera give that to a few percent from capture to capture; of two cameras only
to about half a stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError

if TYPE_CHECKING:
    from app.core.second_light.captured import CapturedLamp

_MOST_LUX: Final = 1e7
_TYPE_LUX: Final = (
    "Type its illuminance: hold a light meter where the probe stood, facing the lamp. Or capture "
    "it again with files that state ISO, aperture and shutter."
)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Whether a lamp's light can be added to a place's.

    Attributes
    ----------
    possible : bool
        Whether both are known in cd/m2.
    """

    possible: bool
    sentence: str = ""
    hint: str = ""

    def __str__(self) -> str:
        """Return the sentence, followed by the hint where there is one."""
        return f"{self.sentence} {self.hint}".strip()


def compare(
    place_white_cd_m2: float | None, lamp: CapturedLamp, *, place_camera: str = ""
) -> Comparison:
    """Judge whether the captures of a place and of a lamp can be compared.

    Parameters
    ----------
    place_white_cd_m2 : float or None
        Luminance of radiance 1 of the place, cd/m2; None where its exposure is not known.

    Examples
    --------
    >>> import numpy as np
    >>> from app.core.second_light.captured import make_lamp
    >>> light = np.ones((2, 4, 3), np.float32)
    >>> lamp = make_lamp("phone", light, light[..., 0], white_cd_m2=600.0)
    >>> compare(None, lamp).possible
    False
    >>> compare(120.0, lamp).possible
    True
    """
    place_known = _known(place_white_cd_m2)
    if not _known(lamp.white_cd_m2):
        both = "" if place_known else " Nor does the place's."
        return Comparison(
            False,
            f"The brightness of “{lamp.title}” is not known: its files do not state the exposure."
            f"{both}",
            _TYPE_LUX,
        )
    if not place_known:
        return Comparison(
            False,
            "The brightness of the place is not known: its files do not state the exposure, so "
            f"that “{lamp.title}” cannot be added to it.",
            "Say how much light falls on the face there, in lux, or capture the place again.",
        )
    cameras = {place_camera.strip().casefold(), lamp.camera.strip().casefold()}
    if "" not in cameras and len(cameras) == 2:
        return Comparison(
            True,
            f"“{lamp.title}” was captured with another camera ({lamp.camera}) than the place "
            f"({place_camera}): it may be half a stop brighter or darker than shown.",
        )
    return Comparison(True)


def with_lux(lamp: CapturedLamp, lux: float) -> CapturedLamp:
    """Set how bright a lamp is by what a light meter reads where the probe stood.

    Raises
    ------
    CoreError
        When that is no illuminance.
    """
    if not (math.isfinite(lux) and 0.0 < lux <= _MOST_LUX):
        raise CoreError(f"{lux:g} lux is no illuminance of a lamp.", "Type what the meter reads.")
    unit = replace(lamp, white_cd_m2=1.0)
    given = unit.lux
    if not given:
        raise CoreError(f"{lamp.title} gives no light.", "Mark where the lamp is.")
    return replace(lamp, white_cd_m2=lux / given)


def _known(white: float | None) -> bool:
    return white is not None and math.isfinite(white) and white > 0.0
