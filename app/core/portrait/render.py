"""Render a head in an environment at a turn, for both the command line and the API."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from app.core.base import colour
from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError
from app.core.environment.environment import Environment, reduce
from app.core.measure.finish.findings import find
from app.core.portrait.background import background
from app.core.portrait.catchlights import Catchlight, catchlights
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.gallery_portraits import framing, skin_gains
from app.core.portrait.head_views import load_views_of
from app.core.portrait.light import portrait_light
from app.core.portrait.portrait_file import HAIRS, PLAIN, load_portrait
from app.core.portrait.portrait_head import ROOM
from app.core.solver.transport import Transport, load_named, render, to_image
from app.core.styles.style_pack_file import load_named_pack
from app.core.text import tr

HEIGHTS: Final = (64, 2048)
"""The smallest and the largest height of a portrait, in pixels."""

_ASPECT: Final = 0.8


@dataclass(frozen=True, slots=True)
class HeadPicture:
    """A head in the light of a place.

    Attributes:
        linear: (H, W, 3) float32. Linear Rec. 709, in the same unit as the environment.
        gain: Factor that exposes the face as a photographer would.
        yaw_deg: Yaw of the rendered view, in degrees, positive towards the sitter's own left.
        catchlights: The reflections in the eyes, or an empty tuple for the thumbnail.
    """

    linear: FloatImage = field(repr=False)
    gain: float
    yaw_deg: float = 0.0
    catchlights: tuple[Catchlight, ...] = ()

    @property
    def srgb(self) -> Bytes:
        """The picture, exposed and tone mapped for the screen, (H, W, 3) uint8 sRGB."""
        return colour.to_bytes(colour.tone_map(self.linear, self.gain))


def render_head(
    environment: Environment,
    turn_deg: float,
    head: str = "generic",
    *,
    yaw_deg: float = 0.0,
    height: int | None = None,
    plain: bool = False,
) -> HeadPicture:
    """Render a head in the light of an environment.

    Args:
        turn_deg: Azimuth in the panorama that the sitter faces, in degrees, positive clockwise as
            seen from above.
        head: Name of a built-in head, or path of a baked ``T.npz``.
        yaw_deg: Turn of the face towards the sitter's own left, in degrees. The nearest baked view
            is used.
        height: Height of a portrait in pixels, 64 to 2048, or None for the transport's thumbnail on
            black.
        plain: Whether to draw a portrait without hair, in a single colour, on black.

    Raises:
        TransportError: If the head cannot be read.
        CoreError: If the head has no portrait, or the turn or the height is out of range.
    """
    check_height(height)
    transport = load_named(head)
    yaw = 0.0
    if yaw_deg:
        pack = load_named_pack(head)
        views = load_views_of(pack, head)
        yaw = views.nearest(yaw_deg)
        transport = views.at(yaw, pack.styles).transport if yaw else transport
    light = reduce(environment, transport.environment_shape, wrap(turn_deg - yaw))
    linear = to_image(transport, render(transport, light))
    gain = colour.face_exposure(_face_luminance(transport, linear))
    gain *= skin_gains(transport, [light])[0]
    if height is None:
        return HeadPicture(linear, gain, yaw)
    portrait, reflections = _portrait(
        transport, environment, head, (turn_deg, yaw), (height, round(height * _ASPECT)), plain
    )
    return HeadPicture(portrait, gain, yaw, reflections)


def check_height(height: int | None) -> None:
    """Raise `CoreError` if a portrait would be too small or too large."""
    if height is not None and not HEIGHTS[0] <= height <= HEIGHTS[1]:
        raise CoreError(
            tr(
                "A portrait must be 64 to {most} pixels high, not {size}.",
                most=HEIGHTS[1],
                size=height,
            )
        )


def _portrait(
    transport: Transport,
    environment: Environment,
    head: str,
    directions: tuple[float, float],
    size: tuple[int, int],
    plain: bool,
) -> tuple[FloatImage, tuple[Catchlight, ...]]:
    """Draw the portrait at full size, at the given turn and yaw, and find its catchlights."""
    turn, yaw = directions
    hair = PLAIN if plain else HAIRS[0]
    portrait = load_portrait(transport.header.head, transport.header.skin, hair, yaw)
    if portrait is None or head.endswith(".npz"):
        raise CoreError(
            tr("The head {name} has no full-size portrait.", name=head),
            tr("Leave out --size, or choose a built-in head."),
        )
    light = portrait_light(environment.radiance)
    nose = wrap(turn - yaw)
    picture = portrait_picture(*portrait, light, nose)
    frame = framing(len(picture), size, room=ROOM)
    cut = frame.cut(picture)
    if not plain:
        behind = background(environment.radiance, wrap(turn), frame, transport.header)
        cut += (1 - frame.cut(portrait[0].coverage))[..., None] * behind
    lamps = find(environment.radiance)
    return cut, catchlights(portrait[0], light, picture, nose, lamps)


def _face_luminance(transport: Transport, picture: FloatImage) -> FloatImage:
    values: FloatImage = colour.luminance(picture.reshape(-1, 3)[transport.pixels])[transport.face]
    return values
