"""The lighting ratio of a rendered face: how much brighter the lit side is than the shadow side.

Photographers state it as key plus fill over fill: the lit cheek has both lights, the shadow cheek
the fill alone, and the ratio of the two readings is 2 to the power of their difference in stops
(Hunter, Biver and Fuqua, *Light: Science and Magic*, chapter on portraits; Langford, *Basic
Photography*). A spot meter would be held to both cheeks; so does this, on the linear picture.

The two areas are each other's mirror image, so that on a symmetric head skin tone and the shape of
the cheeks cancel. They lie on the fronts of the cheeks, away from eyes, nose, ears and the face's
edge, where rims are. As in a spot meter the light of an area is averaged, so that a shadow that
covers half of it counts half; only highlights, brighter by far than four fifths of the area, are
held down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from app.core.base.arrays import Float64, Floats, Indices
    from app.core.solver.transport import Transport

KeySide: TypeAlias = Literal["left", "right", "none"]
"""The sitter's own side that is brighter."""

CONVENTION: Final = "key plus fill : fill"
"""What the two numbers of a ratio stand for, to be shown beside them."""

EVEN_STOPS: Final = 0.15
"""Below this the cheeks are alike: half of the third of a stop that meters and lamps work in."""

DEEPEST_STOPS: Final = 5.0
"""Above this nobody sees a second light: the shadow is as good as black."""

# The middle of a cheek, in half distances between the eyes: from the middle and below the eyes.
_ASIDE: Final = 1.11
_UNDER: Final = 1.145
_RADIUS: Final = 0.49
# Where eyes are sought, mm from the middle and from the crown; and taken to be if none are found.
_ACROSS_MM: Final = (15.0, 50.0)
_DOWN_MM: Final = (65.0, 140.0)
_EYES_MM: Final = (31.0, 103.0)
_EYE_COLOUR: Final = 1.35  # blue over red, of the skin's
_LEAST_EYE_PIXELS: Final = 8
_MOST_PERCENTILE: Final = 80.0
_HIGHLIGHT: Final = 1.5  # times that percentile
_SHADOW: Final = 1.0 / 256.0  # of the bright parts of the face: a cheek that no lamp reaches
_BLACK: Final = 1e-6  # of the face's brightest pixel: below, renderers know nothing
_BRIGHT_PERCENTILE: Final = 99.0
_NO_RATIO: Final = "Both cheeks are in shadow: there is no ratio between them."
_SIDES: Final[dict[KeySide, str]] = {
    "left": "sitter’s left (camera right)",
    "right": "sitter’s right (camera left)",
}


@dataclass(frozen=True, slots=True)
class LightingRatio:
    """How the two sides of a face compare."""

    stops: float  # lit cheek over shadow cheek, in stops; never negative
    ratio: str
    key_side: KeySide
    words: str


def lighting_ratio(
    transport: Transport,
    picture: Floats,
    areas: tuple[Indices, Indices] | None = None,
) -> LightingRatio:
    """Read the lighting ratio off a picture of the head.

    `picture`: (P, 3) or (P,) float, linear Rec. 709 picture on the head's pixels
    (`app.core.solver.transport.render`), or its luminance; any exposure.
    `areas`: two (M,) int, from `cheeks`, where many pictures of one head are read.
    There is no side and 0 stops where both cheeks are in shadow, as when only rims are lit.
    Raises ValueError if the picture has not the transport's pixels, or is not finite.
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
        return LightingRatio(0.0, "1:1", "none", "No light reaches the face.")
    left, right = (_level(values[area]) for area in areas or cheeks(transport))
    bright = float(np.percentile(values[transport.face], _BRIGHT_PERCENTILE))
    if max(left, right) <= _SHADOW * bright:
        return LightingRatio(0.0, "1:1", "none", _NO_RATIO)
    floor = _BLACK * peak
    stops = math.log2(max(left, floor) / max(right, floor))
    side: KeySide = "left" if stops > 0 else "right"
    if abs(stops) < EVEN_STOPS:
        side = "none"
    return LightingRatio(abs(stops), ratio_words(abs(stops)), side, _words(abs(stops), side))


def cheeks(transport: Transport) -> tuple[Indices, Indices]:
    """Find the pixels that are read, on the fronts of the cheeks.

    `transport`: of a head seen from in front, its middle in the middle of the picture, its crown at
    the upper edge of what it covers.
    Returns positions in the head's pixels, (M,) int: the sitter's left cheek (image right), and
    the other.
    Raises ValueError if there is no head where the cheeks should be.
    """
    row, column = np.divmod(transport.pixels.astype(np.int64), transport.size)
    row, column = row + 0.5, column + 0.5 - transport.size / 2.0
    half, eyes = _eyes(transport, row, column)
    radius = max(_RADIUS * half, 1.5)
    found = []
    for sign in (1.0, -1.0):
        near = np.hypot(row - eyes - _UNDER * half, column - sign * _ASIDE * half) <= radius
        found.append(np.flatnonzero(near & transport.face))
    if not all(area.size for area in found):
        raise ValueError("there is no face where its cheeks should be")
    return found[0], found[1]


def _eyes(transport: Transport, row: Float64, column: Float64) -> tuple[float, float]:
    """Half the distance between the eyes, and their row, in pixels.

    Eyes are known by their colour in even light: white and iris are bluer than any skin.
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


def ratio_words(stops: float) -> str:
    """Write stops as a ratio.

    Examples:
        >>> ratio_words(2.0), ratio_words(0.6), ratio_words(0.02), ratio_words(4.2)
        ('4:1', '1.5:1', '1:1', '18:1')
    """
    ratio = 2.0 ** min(stops, 20.0)
    number = f"{ratio:.1f}".removesuffix(".0") if ratio < 9.95 else f"{ratio:.0f}"
    return f"{number}:1"


def _level(values: Float64) -> float:
    """Mean of an area, its highlights held down."""
    positive = np.maximum(values, 0.0)
    limit = _HIGHLIGHT * float(np.percentile(positive, _MOST_PERCENTILE))
    return float(np.minimum(positive, limit).mean())


def _words(stops: float, side: KeySide) -> str:
    number = f"{stops:.1f} stop{'' if f'{stops:.1f}' == '1.0' else 's'}"
    if side == "none":
        return f"{number}, {ratio_words(stops)} ({CONVENTION}), both cheeks alike"
    where = f"key on the {_SIDES[side]}"
    if stops > DEEPEST_STOPS:
        limit = f"more than {DEEPEST_STOPS:.0f} stops, over {ratio_words(DEEPEST_STOPS)}"
        return f"{limit} ({CONVENTION}), {where}; no fill on the other cheek"
    return f"{number}, {ratio_words(stops)} ({CONVENTION}), {where}"
