"""The words of a film beside a place: whether both agree, and how it is read."""

from __future__ import annotations

from app.core.measure.film.in_place import Beside
from app.core.text import tr


def beside_words(beside: Beside) -> str:
    """Say whether a film and a panorama agree, and what to do where they do not."""
    if beside.typical_deg is None:
        return tr("Film and panorama offer no style in common: trust the film.")
    if beside.agree:
        return tr("Film and panorama agree: their turns are {deg}° apart.", deg=beside.typical_deg)
    return tr(
        "Film and panorama disagree: their turns are {deg}° apart. Trust the film; if the light "
        "has changed, measure again.",
        deg=beside.typical_deg,
    )


def mirror_words(mirrored: bool, fits: bool | None) -> str:
    """Say how a film is read where the place decides otherwise than the setting; "" where not.

    `fits`: whether only its mirror image shows the place; None where neither does.
    """
    if fits is None or fits == mirrored:
        return ""
    if fits:
        return tr("The film is mirrored: only its mirror image fits the place. It is read as that.")
    return tr("The film fits the place as it is. It is not read as mirrored.")
