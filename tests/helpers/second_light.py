"""Lamps and a head's shape for tests of the second light, on the head that needs no baking."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.core.second_light.added_light import AddedLight, from_captured, from_numbers
from app.core.second_light.captured_lamps.captured_lamp import PlacedLamp
from app.core.second_light.contrast import FaceBasis, prepare_face
from app.core.second_light.lamp_presets import NumbersLamp, parse
from app.core.second_light.placements import placement
from app.core.solver.head_shape import HeadShape
from app.core.solver.transport import Transport
from app.core.styles.style_pack import StylePack
from benchmarks.speed.plain_search import matrix
from tests.helpers.synthetic import (
    lambert_sphere_transport,
    lamp_direction,
    solid_angles,
    synthetic_pack,
    synthetic_shape,
    texel_directions,
)

Float64 = NDArray[np.float64]


def coloured_place(seed: int = 3, strength: float = 1.2) -> NDArray[np.float32]:
    """(32, 64, 3) lively coloured radiance, with two bright lights in it."""
    rng = np.random.default_rng(seed)
    light = np.exp(strength * rng.standard_normal((32, 64, 3)))
    light[9:11, 20:22] += (300.0, 260.0, 200.0)
    light[14, 50] += (60.0, 80.0, 120.0)
    return light.astype(np.float32)


@lru_cache(maxsize=2)
def placed_lamp(gain: float = 400.0, lopsided: bool = False) -> PlacedLamp:
    """A round warm lamp of 22 deg; lopsided, it has a dim half and is no mirror image of itself."""
    fine = texel_directions(128, 256)
    area = np.broadcast_to(solid_angles(128, 256)[:, None], (128, 256))
    light = np.zeros((576, 32, 64, 3), np.float32)
    alpha = np.zeros((576, 32, 64), np.float32)
    whole = area.reshape(32, 4, 64, 4).sum(axis=(1, 3))
    for number in range(0, 576, 64):
        altitude = placement(number)[1]
        toward = lamp_direction(0.0, altitude)
        inside = (fine @ toward >= np.cos(np.radians(11.0))).astype(float)
        bright = inside * np.where(fine[..., 0] > 0.03, 0.3, 1.0) if lopsided else inside
        share = (inside * area).reshape(32, 4, 64, 4).sum(axis=(1, 3)) / whole
        shine = (bright * area).reshape(32, 4, 64, 4).sum(axis=(1, 3)) / whole
        for azimuth in range(64):
            alpha[number + azimuth] = np.roll(share, -azimuth, axis=1)
            rolled = np.roll(shine, -azimuth, axis=1)[..., None]
            light[number + azimuth] = gain * rolled * (1.1, 1.0, 0.7)
    return PlacedLamp("round", "Round lamp", light, np.minimum(alpha, 1.0), 0.5)


@lru_cache(maxsize=1)
def face_basis() -> FaceBasis:
    """Of the head that needs no baking."""
    return prepare_face(
        lambert_sphere_transport(), synthetic_pack().region_on(lambert_sphere_transport())
    )


@lru_cache(maxsize=4)
def captured(gain: float = 400.0, lopsided: bool = False) -> AddedLight:
    """The round lamp, prepared for that head."""
    lamp = placed_lamp(gain, lopsided)
    return from_captured(lambert_sphere_transport(), lamp, face=face_basis())


@lru_cache(maxsize=4)
def from_word(word: str) -> tuple[NumbersLamp, AddedLight]:
    """A lamp from numbers, prepared for that head."""
    lamp = parse(word)
    return lamp, from_numbers(
        lambert_sphere_transport(), synthetic_shape(), lamp, face=face_basis()
    )


def full_targets(pack: StylePack) -> Float64:
    """(S, 32, 64, 3) F of every style per channel, as the pack counts it."""
    rows = pack.target_rows.astype(np.float64)
    second = np.einsum("kh,skw->shw", pack.mixtures, rows[:, 32:])
    first = rows[:, :32]
    return np.stack(
        [pack.mixing[0, c] * first + pack.mixing[1, c] * second for c in range(3)], axis=-1
    )


def composite(added: AddedLight, place: NDArray[np.floating], turn: int, number: int) -> Float64:
    """(32, 64, 3) eq. 7's environment as one would write it down."""
    turned = np.roll(place.astype(np.float64), -turn, axis=1)
    shown = (1.0 - added.alpha[number].astype(np.float64))[..., None] * turned
    whole: Float64 = shown if added.light is None else shown + added.light[number]
    return whole


def pack() -> StylePack:
    """Styles of that head."""
    return synthetic_pack()


def answers_per_steradian(transport: Transport) -> Float64:
    """(P, 32, 64) luminance of T per steradian, less what the low rank dips below black."""
    found = np.zeros((len(transport.pixels), 32, 64))
    for channel, weight in enumerate(transport.header.luminance_weights):
        found += weight * np.maximum(matrix(transport, channel), 0.0).reshape(found.shape)
    return found / solid_angles(32, 64)[:, None]


def plain_near(
    per_steradian: Float64, shape: HeadShape, lamp: NumbersLamp, azimuth_deg: float, up_deg: float
) -> Float64:
    """(P,) luminance under a lamp of white light near the head, as the formula is written.

    For each piece of the lamp and each pixel: T per steradian from the piece's direction, between
    the texels' centres, times luminance, area and the cosine at the lamp over the squared way.
    """
    toward = lamp_direction(-azimuth_deg, up_deg)
    side = lamp_direction(-azimuth_deg - 90.0, 0.0)
    over = np.cross(toward, side)
    seen = [
        2.0 * np.degrees(np.arctan(size / 2.0 / max(lamp.distance_m - 0.1, 0.1)))
        for size in lamp.size_m
    ]
    wide, tall = (int(np.clip(np.ceil(one / 7.0), 2, 8)) for one in seen)
    area = lamp.size_m[0] * lamp.size_m[1] / (wide * tall)
    pixel = np.arange(len(per_steradian))
    picture = np.zeros(len(pixel))
    for i in range(wide):
        for j in range(tall):
            x, y = ((i + 0.5) / wide - 0.5), ((j + 0.5) / tall - 0.5)
            place = toward * lamp.distance_m
            place = place + side * x * lamp.size_m[0] + over * y * lamp.size_m[1]
            way = place - shape.positions.astype(np.float64)
            length = np.linalg.norm(way, axis=1)
            way /= length[:, None]
            column = (np.arctan2(-way[:, 0], way[:, 2]) / (2 * np.pi) + 0.5) * 64 - 0.5
            row = np.clip((0.5 - np.arcsin(way[:, 1]) / np.pi) * 32 - 0.5, 0.0, 31.0)
            left, upper = np.floor(column).astype(int), np.minimum(row.astype(int), 30)
            answer = np.zeros(len(pixel))
            for down, weight in ((0, 1 - (row - upper)), (1, row - upper)):
                for right, share in ((0, 1 - (column - left)), (1, column - left)):
                    texel = per_steradian[pixel, upper + down, (left + right) % 64]
                    answer += weight * share * texel
            facing = np.maximum(way @ toward, 0.0)
            picture += answer * lamp.luminance * area * facing / length**2
    return picture
