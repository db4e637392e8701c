"""Compute the illuminance and colour of direct sunlight.

The illuminance follows IES Calculation Procedures Committee, "Recommended practice for the
calculation of daylight availability" (RP-21), Journal of the IES 13(4), 1984, 381-392. The direct
normal illuminance is E = 127.5 klx exp(-c m), with an extinction c of 0.21 for a clear sky and 0.80
for a partly cloudy one. In that paper, m = 1 / sin(elevation), which is infinite at the horizon.
Here the relative optical air mass is that of Kasten and Young, "Revised optical air mass tables and
approximation formula", Applied Optics 28(22), 1989, 4735-4738, which agrees with 1 / sin(elevation)
to within 1% above 20 degrees.

Haze follows Navvab, Karayel, Ne'eman and Selkowitz, "Analysis of atmospheric turbidity for daylight
calculations", Energy and Buildings 6, 1984, 293-303: E = E0 exp(-a m T) with a = 0.1 / (1 + 0.0045
m) and an illuminance turbidity T, which is about 2.5 in the country and 5 in industrial air
(Tregenza and Sharples, Daylight Algorithms, 1993, algorithm 1.21). T = 5 gives c = 0.50, which is
"hazy" here, and T = 2.1 gives the 0.21 of the clear sky. The model is a mean over many days, and
single readings vary by a factor of about 0.6 to 1.6.
"""

from __future__ import annotations

import math
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.arrays import Float64
from app.core.base.colour import LUMINANCE_WEIGHTS

SkyWord: TypeAlias = Literal["clear", "hazy", "thin cloud"]

SPREAD: Final = (0.6, 1.6)
"""Usual range of the true illuminance, as factors of the model's illuminance."""

SUN_SOLID_ANGLE_SR: Final = 6.8e-5
"""Solid angle of the sun's disc at its mean distance, in sr (angular radius 0.00465 rad)."""

SUN_DIAMETER_DEG: Final = math.degrees(2.0 * math.sqrt(SUN_SOLID_ANGLE_SR / math.pi))
"""Diameter of the sun's disc, in degrees."""

_SOLAR_CONSTANT_LUX: Final = 127_500.0
_EXTINCTION: Final[dict[SkyWord, float]] = {"clear": 0.21, "hazy": 0.50, "thin cloud": 0.80}

# Wavelengths in micrometres that stand for the Rec. 709 primaries in the colour of sunlight.
_WAVELENGTHS: Final = (0.611, 0.549, 0.464)
_WHITE_AIR_MASS: Final = 1.5  # air mass of sunlight that is white in a daylight white balance
_REDDEST_AIR_MASS: Final = 8.0  # beyond this, three wavelengths do not define a colour


def air_mass(elevation_deg: float) -> float:
    """Return the relative optical air mass at sea level (Kasten and Young 1989, eq. 3).

    >>> round(air_mass(90.0), 3), round(air_mass(30.0), 3)
    (1.0, 1.994)
    """
    above = min(max(elevation_deg, 0.0), 90.0)
    return 1.0 / (math.sin(math.radians(above)) + 0.50572 * math.pow(above + 6.07995, -1.6364))


def direct_normal_lux(elevation_deg: float, sky: SkyWord = "clear") -> float:
    """Return the mean illuminance in lux from direct sunlight on a surface facing the sun (RP-21).

    `SPREAD` gives the usual range around this mean.

    >>> round(direct_normal_lux(60.0)), round(direct_normal_lux(60.0, "hazy"))
    (100061, 71602)
    """
    return _SOLAR_CONSTANT_LUX * math.exp(-_EXTINCTION[sky] * air_mass(elevation_deg))


def sun_colour(elevation_deg: float, sky: SkyWord = "clear") -> Float64:
    """Return the colour of direct sunlight at the ground, (3,) linear Rec. 709 with luminance 1.

    Rayleigh scattering follows Leckner, "The spectral distribution of solar radiation at the
    earth's surface", Solar Energy 20, 1978, 143-150, and is 0.008735 w^-4.08 per air mass (w in
    micrometres). The rest of the extinction is due to particles, with the exponent 1.3 of Angstrom
    (1929). Cloud is grey. The sun is white at an air mass of 1.5 and becomes redder the lower it
    is.
    """
    waves = np.array(_WAVELENGTHS)
    particles = min(_EXTINCTION[sky], _EXTINCTION["hazy"]) - 0.1
    depth = 0.008735 * waves**-4.08 + particles * (waves / 0.555) ** -1.3
    white = 0.008735 * waves**-4.08 + (_EXTINCTION["clear"] - 0.1) * (waves / 0.555) ** -1.3
    mass = min(air_mass(elevation_deg), _REDDEST_AIR_MASS)
    light = np.exp(white * _WHITE_AIR_MASS - depth * mass)
    return np.asarray(light / (light @ np.array(LUMINANCE_WEIGHTS)), np.float64)
