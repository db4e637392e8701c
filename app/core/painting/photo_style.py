"""Styles created from the light on a face: "like this photo".

The generic head is lit by lamps in the directions that were estimated from the photo, and its
picture over the face becomes the target. Nothing from the photo itself is kept.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from app.core.base.errors import StyleError
from app.core.faces.light_from_face import FaceLight, Unread
from app.core.painting.canvas import Canvas, from_weights, make_canvas, weights_of
from app.core.painting.user_style import MAX_TITLE, UserStyle, clean_text, light_side
from app.core.solver.transport import Transport, render, to_image
from app.core.solver.weights import region_weights
from app.core.storage.item_library import one_line
from app.core.styles.lamps import SIZES_DEG, Studio, studio_lamps, studio_light
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_pack import StylePack
from app.core.text import tr

_DISTANCE_M: Final = 8.0  # as for the built-in styles' lamps
_LEAST_REGION: Final = 0.5  # of the face region
_ORIGIN: Final = 80


def photo_lamps(light: FaceLight) -> tuple[StyleLamp, ...]:
    """Return lamps that reproduce the light on a face: the key and, if needed, a frontal fill.

    Raises:
        StyleError: If the key's direction is unknown.
    """
    return studio_lamps(*photo_studio(light))


def photo_style(
    light: FaceLight,
    pack: StylePack,
    transport: Transport,
    name: str,
    title: str,
    note: str,
) -> UserStyle:
    """Create a style from the light on a face. `user_styles.add` then names the style.

    Args:
        name: Name of the photo.

    Raises:
        StyleError: If the key's direction is unknown.
    """
    style, studio = photo_studio(light)
    view = render(transport, studio_light(style, studio, transport.environment_shape))
    region = pack.region_on(transport) >= _LEAST_REGION
    start = from_weights(transport, region_weights(view, region.astype(np.float64)))
    beyond = to_image(transport, (~region).astype(np.float32), background=1.0)
    step = start.size // transport.size
    canvas: Canvas = make_canvas(start.weights, np.kron(beyond, np.ones((step, step), np.float32)))
    side, place = light_side(transport, weights_of(canvas, transport))
    return UserStyle(
        "",
        one_line(title)[:MAX_TITLE].strip(),
        side,
        place,
        clean_text(note, "note"),
        pack.header.head,
        one_line(name)[:_ORIGIN],
        canvas.weights,
        canvas.ignore,
    )


_WHY: Final = {
    None: tr("The light on this face cannot be read."),
    Unread.PROFILE: tr("The face is in profile."),
    Unread.HIDDEN: tr("Too little of the face is visible."),
    Unread.FLAT: tr("The light is flat: neither side of the face is brighter."),
    Unread.MIXED: tr("Part of the face is hidden, or several lamps light it."),
}


def photo_studio(light: FaceLight) -> tuple[Style, Studio]:
    """Return the studio key and fill that reproduce the light on a face (see `photo_lamps`)."""
    azimuth, elevation, size = light.azimuth_deg, light.elevation_deg, light.softness_deg
    if light.key == "behind":
        raise StyleError(
            tr(
                "The light in this picture comes from behind, so the face does not show "
                "its direction."
            ),
            tr("Choose a picture of a face lit from the front or the side."),
        )
    if azimuth is None or elevation is None or size is None:
        raise StyleError(
            _WHY[light.reason],
            tr("Choose a photo of someone looking into the lens, lit from one side."),
        )
    size = float(np.clip(size, *SIZES_DEG))
    key = StyleLamp(azimuth, elevation, size, 1.0, _DISTANCE_M)
    return Style("", "", "none", "", "", (key,)), Studio(ratio=light.fill_ratio)
