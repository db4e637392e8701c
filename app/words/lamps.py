"""Text about lamps: their names and powers, studio lamps, capture, and comparison with a place."""

from __future__ import annotations

import math
from typing import Final

from app.core.second_light.captured_lamps.lamp_file import LampDamage, LampPart
from app.core.second_light.captured_lamps.lamp_mask import LampMask
from app.core.second_light.lamp_presets import part_of, share_of
from app.core.second_light.place_brightness import Comparison, Unknown
from app.core.styles.lamps import RATIO_KEYS, SIZE_KEYS, Studio, parse_softness
from app.core.text import tr, tr_plural

_KINDS: Final = {
    "phone": tr("Phone screen"),
    "torch": tr("Phone torch"),
    "tablet": tr("Tablet screen"),
    "panel": tr("LED panel"),
    "bulb": tr("Table lamp"),
    "flash": tr("Bare flash"),
    "softbox": tr("Softbox"),
}
_SIZES: Final = {
    "hard": tr("Hard"),
    "medium": tr("Medium"),
    "large": tr("Large"),
    "dish@1": tr("Beauty dish at 1 m"),
    "softbox@1": tr("Softbox at 1 m"),
    "umbrella@1.5": tr("Umbrella at 1.5 m"),
    "octabox@1.5": tr("Octabox at 1.5 m"),
    "window@3": tr("Window at 3 m"),
}
SIZE_CHOICES: Final = {
    key: f"{_SIZES[key]} ({parse_softness(key):.0f}°)"
    if key in _SIZES
    else tr("Standard studio lamps")
    for key in SIZE_KEYS
}
"""Lamp sizes to choose from for the studio, by key."""

RATIO_CHOICES: Final = {key: tr("Unchanged") if key == "none" else key for key in RATIO_KEYS}
"""Lighting ratios to choose from for the studio, by key."""

HARDLY_CHANGES: Final = tr("Hardly changes the picture")
"""Verdict on a lamp whose effect on a style cannot be seen."""

GUIDE: Final = (
    tr(
        "Make the room as dark as possible: close the curtains and switch off other lamps "
        "and screens."
    ),
    tr("Put the 360 camera on a stand where the head will be, away from mirrors and shiny tables."),
    tr(
        "Hold the lamp at its working distance, facing the camera, and measure that "
        "distance from the camera."
    ),
    tr(
        "Shoot a bracket with a fixed white balance. The lamp must not be clipped in the "
        "darkest frame."
    ),
    tr(
        "Add the files here. Measure places with the same camera, so that the brightness "
        "of the lamp and of the places is comparable."
    ),
)
"""The steps for capturing a lamp."""

_PARTS: Final = {
    LampPart.NAME: tr("its name"),
    LampPart.DISTANCE: tr("its distance"),
    LampPart.BRIGHTNESS: tr("its brightness"),
    LampPart.ILLUMINANCE: tr("its illuminance"),
    LampPart.CAMERA: tr("its camera"),
    LampPart.CHECKSUM: tr("its checksum"),
}


def lamp_title(name: str, title: str = "") -> str:
    """Return a lamp's own title, or the title of its kind if it has none."""
    return title or _KINDS.get(name, name)


def power_words(power: float, kind: str = "") -> str:
    """Format a lamp's power in the way that the lamp's own display shows it.

    Examples:
        >>> power_words(1.0), power_words(0.5), power_words(0.25), power_words(1.0, "flash")
        ('at full power', 'at half power', 'at 1/4 power', 'at 1/16 power')
    """
    part = part_of(power, kind)
    if part == 1:
        return tr("at full power")
    return tr("at half power") if part == 2 else tr("at {share} power", share=f"1/{part}")


def power_share(power: float, kind: str = "") -> str:
    """Format a power as a fraction of full power, such as "full" or "1/8".

    Examples:
        >>> power_share(1.0), power_share(0.125), power_share(16.0, "flash")
        ('full', '1/8', 'full')
    """
    part = part_of(power, kind)
    return tr("full") if part == 1 else f"1/{part}"


def stops_down(power: float, kind: str = "") -> str:
    """Return how many stops a lamp is turned down, or "" if it is at full power.

    Examples:
        >>> stops_down(0.125), stops_down(0.5), stops_down(1.0)
        ('3 stops down', '1 stop down', '')
    """
    stops = round(-math.log2(share_of(power, kind)))
    return tr_plural("{count} stop down", "{count} stops down", stops) if stops > 0 else ""


def studio_words(studio: Studio) -> str:
    """Return a short description of a studio's lamps.

    Examples:
        >>> studio_words(Studio(30.0, 4.0)), studio_words(Studio())
        ('30°, 4:1', 'standard')
    """
    size = "" if studio.softness_deg is None else f"{studio.softness_deg:.0f}°"
    ratio = "" if studio.ratio is None else f"{studio.ratio:g}:1"
    return ", ".join(filter(None, (size, ratio))) or tr("standard")


def comparison_words(comparison: Comparison) -> str:
    """Explain why a lamp's light cannot be added to a place, and what to do.

    The result is "" if the light can be added and the cameras do not differ.
    """
    return " ".join(filter(None, (comparison_sentence(comparison), _hint(comparison))))


def comparison_sentence(comparison: Comparison) -> str:
    """Return the first sentence of `comparison_words`, or a note that the two cameras differ."""
    title = comparison.title
    if comparison.unknown is Unknown.LAMP:
        return tr(
            "The brightness of “{title}” is unknown: its files do not record the exposure.",
            title=title,
        )
    if comparison.unknown is Unknown.BOTH:
        return tr(
            "The brightness of “{title}” and of the place is unknown: their files do not "
            "record the exposure.",
            title=title,
        )
    if comparison.unknown is Unknown.PLACE:
        return tr(
            "“{title}” cannot be added: the brightness of this place is unknown, because its "
            "files do not record the exposure.",
            title=title,
        )
    if comparison.cameras is None:
        return ""
    lamp, place = comparison.cameras
    return tr(
        "“{title}” was captured with a different camera ({camera}) than the place "
        "({place_camera}). It may be half a stop brighter or darker than shown.",
        title=title,
        camera=lamp,
        place_camera=place,
    )


def _hint(comparison: Comparison) -> str:
    if comparison.unknown is None:
        return ""
    if comparison.unknown is Unknown.PLACE:
        return tr("Enter the light on the face there, in lux, or capture the place again.")
    return tr(
        "Enter the lamp’s illuminance: hold a light meter where the camera was, facing the "
        "lamp. Or capture it again with files that record the ISO, aperture and shutter speed."
    )


def mask_warnings(mask: LampMask | None) -> tuple[str, ...]:
    """List the doubts about a lamp that was detected in its capture."""
    warnings = []
    if mask is not None and mask.in_lit_room:
        warnings.append(
            tr(
                "The room is not dark enough: the lamp is only {contrast:.0f} times "
                "brighter than its surroundings. Close the curtains and switch off other "
                "lights, or check the mask.",
                contrast=mask.contrast,
            )
        )
    if mask is not None and mask.burnt_out:
        warnings.append(
            tr(
                "{clipped:.0f}% of the lamp is clipped in every frame, so it looks "
                "dimmer than it is. Shoot darker frames too.",
                clipped=100 * mask.clipped,
            )
        )
    return tuple(warnings)


def mask_notes(mask: LampMask | None) -> tuple[str, ...]:
    """List the areas that were excluded when a lamp was detected in its capture."""
    if mask is None or not mask.rejected:
        return ()
    return (
        tr_plural(
            "{count} other bright spot looked like a reflection or another light and was left out.",
            "{count} other bright spots looked like reflections or other lights and were left out.",
            mask.rejected,
        ),
    )


def damage_words(damage: LampDamage) -> str:
    """Name the parts of a lamp's text file that cannot be read."""
    parts = ", ".join(_PARTS[part] for part in damage.parts)
    if not parts:
        parts = tr("its description") if damage.error is None else damage.error.message
    return tr("This lamp is damaged. Unreadable: {parts}.", parts=parts)
