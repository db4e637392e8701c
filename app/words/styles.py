"""Text of a style: its side or position, its full title, and how certain its turn is."""

from __future__ import annotations

from app.core.painting.user_style import UserStyle
from app.core.styles.certainty import spread_of
from app.core.styles.style import Style, StyleLamp
from app.core.text import tr
from app.words.phrases.directions import face_direction_words, place_words


def side_words(style: Style | UserStyle) -> str:
    """Return the side of a style's lamps (for sitter and camera) or the lamps' position."""
    return place_words(style.side, style.place)


def full_title(style: Style) -> str:
    """Return a title that tells left from right, such as "Loop, sitter’s left (camera right)"."""
    return f"{style.title}, {side_words(style)}" if style.side != "none" else style.title


def caution_words(style: str) -> str | None:
    """Warn, without a full stop, that a style's turn is less certain. Return None if it is not."""
    spread_deg = spread_of(style)
    if spread_deg is None:
        return None
    return tr(
        "Less certain: this style varies with the sitter. On other heads and skin tones, "
        "the best turn was {spread_deg:.0f}° away on average",
        spread_deg=spread_deg,
    )


def photo_title(name: str) -> str:
    """Return the title of a style created from a photo."""
    return tr("Like {name}", name=name)


def photo_note(lamps: tuple[StyleLamp, ...], *, read: bool = True) -> str:
    """Describe the position and size of a key light, and the amount of fill.

    Args:
        lamps: The key light, followed by a fill light if there is one.
        read: Whether all values were read from a photo and have not been edited since.
    """
    key = lamps[0]
    lamp = {
        "where": face_direction_words(key.azimuth_deg, key.elevation_deg),
        "size": f"{key.diameter_deg:.0f}°",
    }
    if len(lamps) == 1:
        if read:
            return tr("Read from a photo: key {where}, {size} across; no fill.", **lamp)
        return tr("Set by hand, based on a photo: key {where}, {size} across; no fill.", **lamp)
    ratio = f"{round(1.0 + key.power / lamps[-1].power, 1):g}:1"
    if read:
        return tr(
            "Read from a photo: key {where}, {size} across; frontal fill, {ratio}.",
            ratio=ratio,
            **lamp,
        )
    return tr(
        "Set by hand, based on a photo: key {where}, {size} across; frontal fill, {ratio}.",
        ratio=ratio,
        **lamp,
    )
