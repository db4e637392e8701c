"""Names for the direction that a light comes from.

Each side of the sitter is named twice: as seen by the sitter, and as seen by the camera facing
them. Azimuths follow two conventions. In a panorama, they increase clockwise as seen from above,
towards the right of a person facing azimuth 0. On a face, they increase towards the sitter's left.
"""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

from app.core.base.angles import wrap
from app.core.base.catalogue import tr
from app.core.guidance.who_moves import Mode
from app.words.phrases.quantities import metres, tenths, upper_first

Side: TypeAlias = Literal["left", "right"]

SIDES: Final[dict[str, str]] = {
    "left": tr("sitter’s left (camera right)"),
    "right": tr("sitter’s right (camera left)"),
}
"""The side of the sitter from which a light comes."""

BARE_SIDES: Final[dict[str, str]] = {"left": tr("sitter’s left"), "right": tr("sitter’s right")}
"""Side of the sitter without the camera's side, for use beside a picture that shows both."""

SIDE_LINES: Final[dict[str, str]] = {
    "left": tr("sitter’s left\n(camera right)"),
    "right": tr("sitter’s right\n(camera left)"),
}
"""Side of the sitter, broken into two lines."""

SHORT_SIDES: Final[dict[str, str]] = {"left": tr("sitter’s left"), "right": tr("sitter’s right")}
"""Side of the sitter for a narrow table."""

_LIGHT: Final[dict[str, str]] = {
    "left": tr("Light from the sitter’s left (camera right)"),
    "right": tr("Light from the sitter’s right (camera left)"),
    "behind": tr("Light from behind"),
    "behind, from above": tr("Light from behind and above"),
    "behind, on both sides": tr("Light from behind, on both sides"),
    "both sides, at head height": tr("Light from both sides, at head height"),
    "from overhead": tr("Light from overhead"),
    "in front, above and below": tr("Light in front, above and below"),
    "in front, at eye level": tr("Light in front, at eye level"),
    "in front, from above": tr("Light from in front and above"),
    "in front, from beneath": tr("Light from in front and beneath"),
}
# Keyed by whether the side is the sitter's left, and whether space is tight.
_FROM_FACE: Final = {
    (True, False): tr("{angle} to the sitter’s left (camera right)"),
    (False, False): tr("{angle} to the sitter’s right (camera left)"),
    (True, True): tr("{angle} to sitter’s left (camera right)"),
    (False, True): tr("{angle} to sitter’s right (camera left)"),
}
_SAME_SIDE_DEG: Final = 20  # degrees from the front within which a key is on neither side
_TOLD_DEG: Final = 5  # degrees; a face does not reveal the key's direction more precisely
_PLACES: Final[dict[str, str]] = {
    "behind": tr("behind"),
    "behind, from above": tr("behind, from above"),
    "behind, on both sides": tr("behind, on both sides"),
    "both sides, at head height": tr("both sides, at head height"),
    "from behind": tr("from behind"),
    "from beneath": tr("from beneath"),
    "from both sides": tr("from both sides"),
    "from overhead": tr("from overhead"),
    "from several sides": tr("from several sides"),
    "in front, above and below": tr("in front, above and below"),
    "in front, at eye level": tr("in front, at eye level"),
    "in front, from above": tr("in front, from above"),
    "in front, from beneath": tr("in front, from beneath"),
}
"""Lamp positions of styles without a side, as stated in the style files."""

_LEVEL_DEG: Final = 3.0
_OVERHEAD_DEG: Final = 70.0
_HIGH_DEG, _LOW_DEG = 30.0, -20.0
# Largest angle from the front for each phrase: on the left, on the right.
_IN_ROOM: Final = (
    (25.0, tr("in front"), tr("in front")),
    (65.0, tr("in front on the left"), tr("in front on the right")),
    (115.0, tr("on the left"), tr("on the right")),
    (155.0, tr("behind on the left"), tr("behind on the right")),
    (180.0, tr("behind"), tr("behind")),
)
_AROUND_SITTER: Final = (
    (25.0, tr("in front"), tr("in front")),
    (
        65.0,
        tr("in front, sitter’s left (camera right)"),
        tr("in front, sitter’s right (camera left)"),
    ),
    (115.0, SIDES["left"], SIDES["right"]),
    (155.0, tr("behind, sitter’s left (camera right)"), tr("behind, sitter’s right (camera left)")),
    (180.0, tr("behind"), tr("behind")),
)
_HELD: Final = (
    (8.0, tr("in front"), tr("in front")),
    (
        30.0,
        tr("in front, a little to the sitter’s left (camera right)"),
        tr("in front, a little to the sitter’s right (camera left)"),
    ),
    (
        60.0,
        tr("half in front, half to the sitter’s left (camera right)"),
        tr("half in front, half to the sitter’s right (camera left)"),
    ),
    (
        82.0,
        tr("to the sitter’s left (camera right), a little in front"),
        tr("to the sitter’s right (camera left), a little in front"),
    ),
    (
        98.0,
        tr("to the sitter’s left (camera right)"),
        tr("to the sitter’s right (camera left)"),
    ),
    (
        120.0,
        tr("to the sitter’s left (camera right), a little behind"),
        tr("to the sitter’s right (camera left), a little behind"),
    ),
    (
        150.0,
        tr("half behind, half to the sitter’s left (camera right)"),
        tr("half behind, half to the sitter’s right (camera left)"),
    ),
    (
        172.0,
        tr("behind, a little to the sitter’s left (camera right)"),
        tr("behind, a little to the sitter’s right (camera left)"),
    ),
    (180.0, tr("behind"), tr("behind")),
)


LIGHTINGS: Final[dict[str, str]] = {
    "front": tr("front"),
    "short": tr("short"),
    "broad": tr("broad"),
}
"""Names of the lighting on a turned face.

Short light falls on the side of the face turned away from the lens, and broad light on the side
turned towards it.
"""


def aside_words(yaw_deg: float) -> str:
    """Describe where the nose points relative to the lens, or return "" if it points at the lens.

    Examples:
        >>> aside_words(30.0), aside_words(0.0)
        ('nose 30° to their left', '')
    """
    size = round(abs(yaw_deg))
    if not size:
        return ""
    if yaw_deg > 0:
        return tr("nose {size}° to their left", size=size)
    return tr("nose {size}° to their right", size=size)


def lit_aside_words(yaw_deg: float, lighting: str) -> str:
    """Describe the nose direction and the lighting, or return "" if the nose points at the lens.

    Examples:
        >>> lit_aside_words(30.0, "short")
        'short, nose 30° to their left'
    """
    aside = aside_words(yaw_deg)
    return f"{LIGHTINGS[lighting]}, {aside}" if aside and lighting != "front" else aside


def lit_aside_brief(yaw_deg: float, lighting: str) -> str:
    """Name the light on a turned face, or the nose direction if the light has no name.

    Examples:
        >>> lit_aside_brief(30.0, "short"), lit_aside_brief(30.0, "front")
        ('short', 'nose 30° to their left')
    """
    aside = aside_words(yaw_deg)
    return LIGHTINGS[lighting] if aside and lighting != "front" else aside


LENS_CHOICES: Final[dict[str, str]] = {
    "0": tr("Face to the lens"),
    "auto": tr("Best for each style"),
    "short": tr("Short light"),
    "broad": tr("Broad light"),
    **{f"{yaw}": upper_first(aside_words(yaw)) for yaw in (15, 30, 45, -15, -30, -45)},
}
"""Lens positions to choose from, keyed by the value of ``--yaw``."""


def lens_words(yaw_deg: float) -> str:
    """Tell the photographer where to put the lens for a face turned to the sitter's left.

    Examples:
        >>> lens_words(30.0)
        'Stand 30° to the sitter’s right of their nose'
    """
    size = round(abs(yaw_deg))
    if yaw_deg > 0:
        return tr("Stand {size}° to the sitter’s right of their nose", size=size)
    return tr("Stand {size}° to the sitter’s left of their nose", size=size)


_NOSE: Final = {
    Mode.WALK: (
        tr("Nose {size}° to your left, eyes to me"),
        tr("Nose {size}° to your right, eyes to me"),
    ),
    Mode.SELFIE: (
        tr("Nose {size}° to your left, eyes to the lens"),
        tr("Nose {size}° to your right, eyes to the lens"),
    ),
}
_NOSE_MORE: Final = {
    Mode.WALK: (
        tr("Nose further to your left, eyes to me"),
        tr("Nose further to your right, eyes to me"),
    ),
    Mode.SELFIE: (tr("Eyes to the lens"), tr("Eyes to the lens")),
}
_NOSE_FURTHER: Final = {
    Mode.WALK: (
        tr("Nose {size}° further to their left"),
        tr("Nose {size}° further to their right"),
    ),
    Mode.SELFIE: (
        tr("Nose {size}° further to your left"),
        tr("Nose {size}° further to your right"),
    ),
}


def sitter_words(yaw_deg: float, mode: Mode = Mode.WALK, *, further: bool = False) -> str:
    """Tell the sitter where to point the nose, relative to the lens or to the current direction.

    Examples:
        >>> sitter_words(30.0), sitter_words(-15.0, Mode.SELFIE)
        ('Nose 30° to your left, eyes to me', 'Nose 15° to your right, eyes to the lens')
        >>> sitter_words(-12.0, further=True)
        'Nose further to your right, eyes to me'
    """
    words = (_NOSE_MORE if further else _NOSE)[mode][yaw_deg < 0]
    return words.format(size=round(abs(yaw_deg)))


def nose_words(off_deg: float, mode: Mode = Mode.WALK) -> str:
    """Tell the photographer how far the nose still has to turn towards the sitter's left.

    Examples:
        >>> nose_words(12.0), nose_words(-8.0, Mode.SELFIE), nose_words(0.0)
        ('Nose 12° further to their left', 'Nose 8° further to your right', 'Nose in position')
    """
    if not off_deg:
        return tr("Nose in position")
    return _NOSE_FURTHER[mode][off_deg < 0].format(size=round(abs(off_deg)))


def direction_words(azimuth_deg: float, elevation_deg: float, *, of_sitter: bool = False) -> str:
    """Describe the direction of a light for a person facing azimuth 0 of the panorama.

    Args:
        azimuth_deg: Azimuth in degrees, positive clockwise.
        elevation_deg: Elevation in degrees, positive up.
        of_sitter: Whether the sitter faces azimuth 0. If so, each side is named both from the
            sitter's view and from the camera's.

    Examples:
        >>> direction_words(3.0, 40.0), direction_words(90.0, 5.0), direction_words(-140.0, 0.0)
        ('in front, high', 'on the right', 'behind on the left')
        >>> direction_words(-140.0, 0.0, of_sitter=True)
        'behind, sitter’s left (camera right)'
    """
    if abs(elevation_deg) >= _OVERHEAD_DEG:
        return tr("overhead") if elevation_deg > 0 else tr("underfoot")
    where = _sector(_AROUND_SITTER if of_sitter else _IN_ROOM, -azimuth_deg)
    if elevation_deg >= _HIGH_DEG:
        return tr("{where}, high", where=where)
    return tr("{where}, low", where=where) if elevation_deg <= _LOW_DEG else where


def face_direction_words(azimuth_deg: float, elevation_deg: float, *, brief: bool = False) -> str:
    """Describe a direction as seen from the sitter's face, in degrees.

    Args:
        azimuth_deg: Azimuth in degrees, positive towards the sitter's left.
        elevation_deg: Elevation in degrees, positive up.
        brief: Whether to shorten the text for a narrow line.

    Examples:
        >>> face_direction_words(12.0, 30.2), face_direction_words(-0.3, -8.0)
        ('12° to the sitter’s left (camera right), 30° up', 'straight ahead, 8° down')
    """
    aside, up = round(azimuth_deg), round(elevation_deg)
    if aside == 0:
        side = tr("straight ahead")
    elif abs(aside) == 180:
        side = tr("straight behind")
    else:
        side = _FROM_FACE[aside > 0, brief].format(angle=f"{abs(aside)}°")
    height = tr("at eye level") if up == 0 else elevation_words(up)
    return tr("{side}, {height}", side=side, height=height)


def elevation_words(elevation_deg: float) -> str:
    """Format an elevation in whole degrees.

    Examples:
        >>> elevation_words(30.2), elevation_words(-8.0), elevation_words(0.3)
        ('30° up', '8° down', 'level')
    """
    up = round(elevation_deg)
    if up == 0:
        return tr("level")
    return tr("{angle} up", angle=f"{up}°") if up > 0 else tr("{angle} down", angle=f"{-up}°")


def placement_words(
    azimuth_deg: float,
    altitude_deg: float,
    distance_m: float | None = None,
    skin_m: float | None = None,
) -> str:
    """Describe the position of a handheld lamp, with no full stop at the end.

    Args:
        azimuth_deg: Azimuth from the centre of the head in degrees, positive towards the sitter's
            left.
        altitude_deg: Altitude from the centre of the head in degrees, positive up.
        distance_m: Distance of the lamp in metres, or None to leave it out.
        skin_m: Shortest distance from the lamp to the skin in metres, or None to leave it out.

    Examples:
        >>> placement_words(105.0, 20.0, 0.3, 0.21)  # doctest: +ELLIPSIS
        'to the sitter’s left (camera right), a little behind, raised 20°, 30 cm from the ...
    """
    parts = [_sector(_HELD, azimuth_deg), _altitude(altitude_deg)]
    if distance_m is not None:
        parts.append(tr("{distance} from the middle of the head", distance=metres(distance_m)))
    if skin_m is not None:
        parts.append(tr("about {distance} from the skin", distance=metres(skin_m, rough=True)))
    return ", ".join(parts)


def light_words(side: str, place: str = "") -> str:
    """Describe where a style's light comes from, as a side (for sitter and camera) or a position.

    Examples:
        >>> light_words("left"), light_words("none", "from overhead")
        ('Light from the sitter’s left (camera right)', 'Light from overhead')
        >>> light_words("none", "both sides, at head height")
        'Light from both sides, at head height'
    """
    words = _LIGHT.get(side) or _LIGHT.get(place)
    if words is not None or not place:
        return words or ""
    if place.startswith("both sides"):
        return tr("Light from {place}", place=place)
    return tr("Light {place}", place=place)


def place_words(side: str, place: str) -> str:
    """Return the side of a style's lamps (for sitter and camera) or the position given in its file.

    Examples:
        >>> place_words("left", ""), place_words("none", "from overhead")
        ('sitter’s left (camera right)', 'from overhead')
    """
    return SIDES.get(side) or _PLACES.get(place, place)


def _sector(sectors: tuple[tuple[float, str, str], ...], azimuth_deg: float) -> str:
    """Return the phrase for an azimuth, given in degrees and positive towards the left."""
    azimuth = wrap(azimuth_deg)
    _, left, right = next(each for each in sectors if abs(azimuth) <= each[0])
    return left if azimuth > 0 else right


def _altitude(altitude_deg: float) -> str:
    if abs(altitude_deg) < _LEVEL_DEG:
        return tr("at the height of the ears")
    angle = f"{abs(altitude_deg):.0f}°"
    if altitude_deg > 0:
        return tr("raised {angle}", angle=angle)
    return tr("lowered {angle}", angle=angle)


def key_words(key_deg: float, promised_deg: float) -> str:
    """Describe how a key light deviates from the promised one, or return "" if it does not.

    Args:
        key_deg, promised_deg: Azimuths relative to the face, in degrees, positive towards the
            sitter's left.

    Examples:
        >>> key_words(52, 40), key_words(-20, -40), key_words(40, -40), key_words(41, 40)
        ('Key 12° too far around', 'Key 20° too frontal', 'Key on the other side', '')
    """
    farther = round(abs(key_deg) - abs(promised_deg))
    if key_deg * promised_deg < 0 and abs(key_deg - promised_deg) > _SAME_SIDE_DEG:
        return tr("Key on the other side")
    if abs(farther) < _TOLD_DEG:
        return ""
    if farther > 0:
        return tr("Key {size}° too far around", size=farther)
    return tr("Key {size}° too frontal", size=-farther)


def ratio_words(stops: float, promised_stops: float) -> str:
    """Format the ratio between the two cheeks, together with the promised ratio.

    Examples:
        >>> ratio_words(1.42, 2.0)
        'Ratio 1.4 stops, promised 2.0'
    """
    return tr(
        "Ratio {stops} stops, promised {promised}",
        stops=tenths(stops),
        promised=tenths(promised_stops),
    )
