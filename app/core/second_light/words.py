"""Where a lamp is held, in words for whoever holds it."""

from __future__ import annotations

import math
import re
from typing import Final

from app.core.base.angles import wrap
from app.core.base.errors import CoreError

_LEVEL_DEG: Final = 3.0
_DISTANCE: Final = re.compile(r"(\d{1,5}(?:[.,]\d{1,6})?) *(m|cm)?")
# Up to which angle from the front each stands; "{side}" is the sitter's left or right.
_SECTORS: Final = (
    (8.0, "in front"),
    (30.0, "in front, a little {side}"),
    (60.0, "half in front, half {side}"),
    (82.0, "{side}, a little in front"),
    (98.0, "{side}"),
    (120.0, "{side}, a little behind"),
    (150.0, "half behind, half {side}"),
    (172.0, "behind, a little {side}"),
    (180.0, "behind"),
)


def placement_words(
    azimuth_deg: float,
    altitude_deg: float,
    distance_m: float | None = None,
    skin_m: float | None = None,
) -> str:
    """Say where a lamp is held.

    Parameters
    ----------
    azimuth_deg, altitude_deg : float
        From the middle of the head, deg, positive toward the sitter's left and upward.
    distance_m : float, optional
        From the middle of the head, metres.
    skin_m : float, optional
        Shortest way from the lamp to the skin, metres.

    Returns
    -------
    str
        Without a full stop.

    Examples
    --------
    >>> placement_words(105.0, 20.0, 0.3, 0.21)  # doctest: +ELLIPSIS
    "to the sitter's left (camera right), a little behind, raised 20°, 30 cm from the middle of...
    """
    azimuth = wrap(azimuth_deg)
    side = "left (camera right)" if azimuth > 0 else "right (camera left)"
    sector = next(words for most, words in _SECTORS if abs(azimuth) <= most)
    parts = [sector.format(side=f"to the sitter's {side}"), _height(altitude_deg)]
    if distance_m is not None:
        parts.append(f"{metres(distance_m)} from the middle of the head")
    if skin_m is not None:
        parts.append(f"about {metres(skin_m, rough=True)} from the skin")
    return ", ".join(parts)


def metres(distance_m: float, *, rough: bool = False) -> str:
    """Write a distance: in centimetres below one metre.

    Parameters
    ----------
    rough : bool, optional
        Whether to the nearest 5 cm from 10 cm on.

    Examples
    --------
    >>> metres(0.304), metres(0.217, rough=True), metres(1.25)
    ('30 cm', '20 cm', '1.2 m')
    """
    centimetres = round(100.0 * distance_m)
    if rough and centimetres >= 10:
        centimetres = 5 * round(20.0 * distance_m)
    return f"{centimetres} cm" if centimetres < 100 else f"{centimetres / 100.0:.1f} m"


def read_metres(text: str) -> float:
    """Read a distance as somebody types it: metres, or centimetres where it says so.

    Raises
    ------
    CoreError
        If it is none.

    Examples
    --------
    >>> read_metres("0.4"), read_metres("40 cm"), read_metres("1,2 m")
    (0.4, 0.4, 1.2)
    """
    found = _DISTANCE.fullmatch(text.strip().lower())
    if found is None:
        raise CoreError("This is no distance.", "Type metres, as 0.4, or centimetres, as 40 cm.")
    value = float(found[1].replace(",", "."))
    return value / 100.0 if found[2] == "cm" else value


def _height(altitude_deg: float) -> str:
    if abs(altitude_deg) < _LEVEL_DEG:
        return "at the height of the ears"
    return f"{'raised' if altitude_deg > 0 else 'lowered'} {abs(altitude_deg):.0f}°"


def lux_words(lux: float) -> str:
    """Write an illuminance with two figures.

    Examples
    --------
    >>> lux_words(213.4), lux_words(61234.0), lux_words(4.87)
    ('210 lx', '61,000 lx', '4.9 lx')
    """
    digits = 1 - math.floor(math.log10(max(lux, 1e-3)))
    value = round(lux, digits)
    return f"{value:,.0f} lx" if value == round(value) else f"{value:.{digits}f} lx"
