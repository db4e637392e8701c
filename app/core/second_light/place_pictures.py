"""Pictures of a head without and with a lamp, exposed for the subject of each style."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from app.core.base.angles import turn_of_index
from app.core.base.arrays import Float32, Floats
from app.core.base.colour import luminance
from app.core.portrait.background import background_gain
from app.core.portrait.exposure import head_exposure
from app.core.portrait.gallery_portraits import skin_gains
from app.core.second_light.added_light import AddedLight
from app.core.second_light.lamp_spot import LampSpot
from app.core.second_light.visible_change import (
    VisibleChange,
    head_lightness,
    lightness_change,
)
from app.core.solver.place_light import Expose
from app.core.solver.transport import FACE_COVERAGE, Transport, render, render_all, to_image


@dataclass(frozen=True, slots=True, eq=False)
class PlacePictures:
    """A head in the light of a place alone, at some turns."""

    transport: Transport = field(repr=False)
    light: Float32 = field(repr=False)  # (32, 64, 3), linear Rec. 709 radiance at turn 0
    face_pixels: int  # area of the face
    pictures: dict[int, Float32] = field(repr=False)  # (P, 3) at each index of a turn, in its unit
    skin: dict[int, float] = field(repr=False)  # factor of `skin_gains` at each of these turns

    def change(self, expose: Expose, turns: tuple[int, int], with_lamp: Float32) -> VisibleChange:
        """Return what a lamp adds to the picture, for a style that is exposed for a subject.

        The picture with the lamp is compared with two pictures without it: at the best turn, and at
        the same turn. The smaller change counts. If another turn gives the same picture, or if the
        turn makes all the difference, the lamp does not help.

        Args:
            turns: Indices of the style's turn without the lamp and with it.
            with_lamp: (P, 3) float32. Picture in the light of the place and the lamp, at the second
                turn.
        """
        head = self._coverage >= FACE_COVERAGE
        after = self._lightness(expose, turns[1], with_lamp)
        without = [self._lightness(expose, turn, self.pictures[turn]) for turn in set(turns)]
        changes = [lightness_change(one, after, head, self.face_pixels) for one in without]
        return min(changes, key=lambda change: change.delta_lightness)

    def _lightness(self, expose: Expose, turn: int, picture: Float32) -> Float32:
        """Return L* of the head in a picture, (P, 3), that is exposed like `Head.exposures`."""
        gain, transport, face = None, self.transport, self.transport.face
        if expose == "background":
            azimuth = turn_of_index(turn)
            gain = background_gain(self.light, azimuth, self._coverage, transport.header)
        pixels = picture[face]
        if gain is None:
            gain = head_exposure(luminance(pixels), expose, self.skin[turn])
        return head_lightness(pixels * np.float32(gain), transport.coverage[face])

    @property
    def _coverage(self) -> Float32:
        return to_image(self.transport, self.transport.coverage)


def place_pictures(
    transport: Transport, light: Floats, turns: Sequence[int], face_pixels: int
) -> PlacePictures:
    """Render a head in the light of a place, at turns given by their index, in one product.

    Args:
        light: (32, 64, 3) float. Linear Rec. 709 radiance at turn 0.
    """
    light, indices = np.asarray(light, np.float32), sorted(set(turns))
    lights = [np.roll(light, -turn, axis=1) for turn in indices]
    pictures = render_all(transport, lights)
    skin = skin_gains(transport, lights)
    return PlacePictures(
        transport,
        light,
        face_pixels,
        dict(zip(indices, pictures, strict=True)),
        dict(zip(indices, skin, strict=True)),
    )


def lamp_pictures(
    transport: Transport,
    light: Floats,
    lamp_light: AddedLight,
    spots: Sequence[LampSpot],
    powers: Sequence[float],
) -> Float32:
    """Render a head in the light of a place and a lamp at several spots.

    The luminance of a near lamp's picture is exact; its colour is that of the skin in even light.

    Args:
        light: (32, 64, 3) float. Linear Rec. 709 radiance at turn 0, in cd/m2.

    Returns:
        (n, P, 3) float32, in the same unit.
    """
    near = lamp_light.light is None
    lights = [
        lamp_light.over(np.roll(light, -spot.turn, axis=1), spot.number, 0.0 if near else power)
        for spot, power in zip(spots, powers, strict=True)
    ]
    pictures = render_all(transport, lights)
    if near:
        tint = render(transport, np.ones((*transport.environment_shape, 3), np.float32))
        tint = tint * lamp_light.glow.astype(np.float32)
        tint /= np.maximum(luminance(tint), np.float32(1e-30))[:, np.newaxis]
        for picture, spot, power in zip(pictures, spots, powers, strict=True):
            picture += np.float32(power) * lamp_light.pictures[spot.number][:, np.newaxis] * tint
    return pictures
