"""Sentences on the light that keeps a style out of reach, and on what would help."""

from __future__ import annotations

from typing import Final

from app.core.base.angles import wrap
from app.core.reasons.diagnosis import Diagnosis
from app.core.reasons.light_in_the_way import LightInTheWay, PlaceRegion
from app.core.reasons.mends import Mend
from app.core.solver.shortfall import AreaShortfall, Aspect
from app.core.solver.style_result import StyleResult
from app.core.text import tr
from app.words.lights import NAMES, share_words
from app.words.phrases.turns import turn_words
from app.words.why_out_of_reach import grade_words

_LAMPS: Final[dict[str, str]] = {
    "sun": tr("The sun {where} ({letter})"),
    "lamp": tr("The lamp {where} ({letter})"),
    "window": tr("The window {where} ({letter})"),
    "wall": tr("The bright wall {where} ({letter})"),
    "ground": tr("The bright ground {where} ({letter})"),
    "sky": tr("The bright sky {where} ({letter})"),
    "above": tr("The sky or ceiling {where} ({letter})"),
    "area": tr("The bright area {where} ({letter})"),
}
_REGIONS: Final[dict[str, str]] = {
    PlaceRegion.FLOOR: tr("Light from the floor"),
    PlaceRegion.OVERHEAD: tr("Light from overhead"),
    PlaceRegion.FRONT: tr("Light from the front"),
    PlaceRegion.LEFT: tr("Light from the sitter’s left"),
    PlaceRegion.BEHIND: tr("Light from behind"),
    PlaceRegion.RIGHT: tr("Light from the sitter’s right"),
    PlaceRegion.AROUND: tr("Light from all around"),
}
# Largest angle from the front for each phrase: on the sitter's left, on the sitter's right.
_BESIDE: Final = (
    (25.0, tr("in front"), tr("in front")),
    (65.0, tr("in front, on the sitter’s left"), tr("in front, on the sitter’s right")),
    (115.0, tr("on the sitter’s left"), tr("on the sitter’s right")),
    (155.0, tr("behind, on the sitter’s left"), tr("behind, on the sitter’s right")),
    (180.0, tr("behind"), tr("behind")),
)
_OVERHEAD_DEG: Final = 70.0
# By the last word of an area's name.
_LIT: Final = {
    "edge": tr("{light} gives the edge of the face {share} of its light."),
    "outline": tr("{light} gives the edge of the face {share} of its light."),
    "crown": tr("{light} gives the hair {share} of its light."),
    "hairline": tr("{light} gives the hair {share} of its light."),
    "throat": tr("{light} gives the throat {share} of its light."),
    "lid": tr("{light} gives the eyelids {share} of their light."),
    "lids": tr("{light} gives the eyelids {share} of their light."),
    "forehead": tr("{light} gives the forehead {share} of its light."),
    "cheek": tr("{light} gives the cheek {share} of its light."),
    "cheeks": tr("{light} gives the cheeks {share} of their light."),
}
_FACE: Final = tr("{light} gives the face {share} of its light.")
_SHADOW: Final = tr("{light} fills the shadow: {share} of its light.")
_SHADOWS: Final = frozenset(
    {
        Aspect.NOSE_SHADOW,
        Aspect.CHEEKS,
        Aspect.OPEN_SHADOW,
        Aspect.PATCH,
        Aspect.DARK_PATCH,
        Aspect.SHADOW_SIDE,
        Aspect.UNDER_THE_NOSE,
    }
)
_SAME_DEG: Final = 8.0  # a smaller move of the best turn is not worth words


def in_the_way_sentence(way: LightInTheWay, shortfall: AreaShortfall) -> str:
    """Name the light that keeps a style out of reach, and its share of the light on an area.

    Examples:
        >>> way = LightInTheWay("wall", "A", False, -90.0, 5.0, "right nose", 0.43)
        >>> areas = ("left nose", "right nose")
        >>> short = AreaShortfall(Aspect.NOSE_SHADOW, "Rembrandt", *areas, 0.4, 1.9)
        >>> in_the_way_sentence(way, short)
        'The bright wall on the sitter’s right (A) fills the shadow: 43% of its light.'
    """
    if way.area == shortfall.dark and shortfall.aspect in _SHADOWS:
        words = _SHADOW
    else:
        words = _LIT.get(way.area.split()[-1], _FACE)
    light = _REGIONS.get(way.what)
    if light is None:
        assert way.azimuth_deg is not None
        assert way.elevation_deg is not None
        where = _beside(way.azimuth_deg, way.elevation_deg)
        light = _LAMPS[way.what].format(where=where, letter=way.letter)
    return words.format(light=light, share=share_words(way.share, way.clipped))


def _beside(azimuth_deg: float, elevation_deg: float) -> str:
    """Describe a direction relative to the sitter's face, as seen by the sitter."""
    if abs(elevation_deg) >= _OVERHEAD_DEG:
        return tr("overhead") if elevation_deg > 0 else tr("underfoot")
    azimuth = wrap(azimuth_deg)
    left, right = next(words for most, *words in _BESIDE if abs(azimuth) <= most)
    return left if azimuth > 0 else right


def in_the_way_name(way: LightInTheWay) -> str:
    """Return the name of the light in the way, as in the list of lamps."""
    return _REGIONS[way.what] if isinstance(way.what, PlaceRegion) else NAMES[way.what]


def mend_sentence(mend: Mend, title: str, turn_deg: float) -> str:
    """State what would improve the grade of a style.

    Args:
        title: Title of the style.
        turn_deg: The turn that is offered now, in degrees.

    Examples:
        >>> mend_sentence(Mend("block", "soft", 41.0), "Rembrandt", 40.0)
        'Blocking it would give Rembrandt, soft.'
    """
    values = {"style": title, "grade": grade_words(mend.grade, True)}
    if mend.how == "spot":
        values |= {"spot": mend.spot}
        if mend.grade == "yes":
            return tr("“{spot}” gives {style}.", **values)
        return tr("“{spot}” gives {style}, {grade}.", **values)
    moved = abs(wrap(mend.turn_deg - turn_deg)) >= _SAME_DEG
    values |= {"turn": turn_words(mend.turn_deg)}
    if mend.grade == "yes":
        if moved:
            return tr("Blocking it would give {style} at {turn}.", **values)
        return tr("Blocking it would give {style}.", **values)
    if moved:
        return tr("Blocking it would give {style}, {grade}, at {turn}.", **values)
    return tr("Blocking it would give {style}, {grade}.", **values)


def help_words(diagnosis: Diagnosis, result: StyleResult) -> str:
    """Name the light in the way of a style and what would help, or return "" if nothing is known.

    Args:
        result: The result that is explained.
    """
    sentences, way, shortfall = [], diagnosis.way, result.shortfall
    if way is not None and isinstance(shortfall, AreaShortfall):
        sentences.append(in_the_way_sentence(way, shortfall))
    turn_deg = result.turn_refined_deg
    sentences += [mend_sentence(mend, result.title, turn_deg) for mend in diagnosis.mends]
    return " ".join(sentences)


def area_labels(shortfall: AreaShortfall) -> tuple[str, str]:
    """Label the bright and the dark area in stops: the brighter one, and 0 for the other.

    Examples:
        >>> area_labels(AreaShortfall(Aspect.HEIGHT, "Top", "forehead", "lids", 0.4, 1.1))
        ('+0.4', '0')
        >>> area_labels(AreaShortfall(Aspect.HEIGHT, "Top", "forehead", "lids", -0.77, 1.1))
        ('0', '+0.8')
    """
    label = f"{abs(shortfall.value_stops):.1f}"
    label = "0" if label == "0.0" else f"+{label}"
    return (label, "0") if shortfall.value_stops >= 0 else ("0", label)


def needs_label(shortfall: AreaShortfall) -> str:
    """Format the difference between two areas and its limit, in stops, without negative numbers.

    Examples:
        >>> areas = ("forehead", "lids")
        >>> needs_label(AreaShortfall(Aspect.HEIGHT, "Top", *areas, 0.4, 1.1))
        'Has 0.4, needs 1.1'
        >>> needs_label(AreaShortfall(Aspect.HEIGHT, "Top", *areas, -0.9, -2.2))
        'Has 0.9, needs 2.2'
    """
    value, limit = shortfall.value_stops, shortfall.limit_stops
    below = value < limit
    if limit < 0 or (limit == 0 and value < 0):
        value, limit, below = -value, -limit, not below
    digits = 2 if f"{value:.1f}" == f"{limit:.1f}" else 1
    values = {"value": f"{value:.{digits}f}", "limit": f"{limit + 0.0:.1f}"}
    if value < 0:
        return tr("Needs {limit}", **values)
    if below:
        return tr("Has {value}, needs {limit}", **values)
    return tr("Has {value}, allows {limit}", **values)
