"""Sentences about locating a photo at a place, and about capturing a place again."""

from __future__ import annotations

import math
from typing import Final

from app.core.localization.photo_location import PHOTO_ENDINGS, PhotoSearch
from app.core.localization.recapture_registration import Registration
from app.core.text import tr
from app.words.phrases.turns import direction_words

PHOTO_FILTER: Final = tr("Photos") + f" (*{' *'.join(sorted(PHOTO_ENDINGS))})"
"""Filter for photos in file dialogs."""


def photo_warnings(search: PhotoSearch) -> list[str]:
    """List the warnings that arose when a photo was located."""
    if search.stated_deg is None:
        return []
    fov_deg = search.heading.fov_deg
    widths = {"found": f"{fov_deg:.0f}°", "stated": f"{search.stated_deg:.0f}°"}
    if fov_deg < search.stated_deg:
        return [
            tr(
                "The photo seems to be cropped: it is {found} wide, but its EXIF data "
                "say {stated}.",
                **widths,
            )
        ]
    return [
        tr(
            "The photo was taken with a different lens than its EXIF data say: it is "
            "{found} wide, not {stated}.",
            **widths,
        )
    ]


def registration_words(registered: Registration) -> str:
    """Describe how a second capture aligns with the first, and what was carried over from it."""
    if not registered.trusted:
        return tr(
            "This looks like a different spot, so nothing was carried over. Drag the "
            "marker to where you stand."
        )
    tilt, yaw = f"{registered.tilt_deg:.0f}°", registered.yaw_deg
    if not registered.turned:
        if registered.tilted:
            return tr(
                "Same spot, camera tilt changed by {tilt}. Your position and all marks are kept.",
                tilt=tilt,
            )
        return tr("Same spot, same camera direction. Your position and all marks are kept.")
    size = f"{abs(yaw):.0f}°" if abs(yaw) >= 9.95 else f"{abs(yaw):.1f}°"
    turn = {"size": size, "direction": direction_words(math.copysign(1.0, yaw))}
    if registered.tilted:
        return tr(
            "Same spot, camera turned {size} {direction}, tilt changed by {tilt}. Your "
            "position and all marks are kept.",
            tilt=tilt,
            **turn,
        )
    return tr(
        "Same spot, camera turned {size} {direction}. Your position and all marks are kept.",
        **turn,
    )
