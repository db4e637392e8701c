"""Captured lamps: centred, turned the right way, their energy kept, composited as eq. 7 has it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.base.errors import CoreError
from app.core.base.sphere import directions, rotate_light
from app.core.environment.environment import energy, reduce_radiance
from app.core.second_light.captured_lamps.captured_lamp import (
    LARGEST,
    CapturedLamp,
    PlacedLamp,
    centring,
    centroid,
    grey_lamp,
    make_lamp,
    place_lamp,
    placed_at,
)
from app.core.second_light.placements import placement
from tests.helpers.dark_room import Lamp, coverage, phone, room

Float32 = NDArray[np.float32]
SHAPE = (256, 512)


def captured(lamp: Lamp, white: float | None = 1.0, shape: tuple[int, int] = SHAPE) -> CapturedLamp:
    light, _ = room(lamp, 0.05, shape=shape)
    mask, _ = coverage(lamp, (2 * shape[0], 2 * shape[1]))
    alpha = reduce_radiance(mask[..., None].astype(np.float32), shape)[..., 0]
    # At the edge only the lamp's own share, as an exact capture in a black room would have it.
    light *= (alpha >= 0.5)[..., None]
    return make_lamp(lamp.form, light, alpha, white_cd_m2=white, distance_m=0.3)


@pytest.fixture(scope="module")
def lopsided() -> PlacedLamp:
    """A long lamp that is bright at its upper end, captured behind the camera."""
    lamp = captured(Lamp("box", (0.1, 0.4), 170.0, 35.0))
    up = directions(lamp.shape)[..., 1]
    light = lamp.radiance * np.maximum(up - 0.2, 0.0)[..., None]
    return place_lamp(make_lamp("long", light, lamp.alpha, white_cd_m2=2.0))


CAPTURES = [
    Lamp("box", (0.117, 0.25)),
    Lamp("box", (0.117, 0.25), 178.0, -30.0, 20.0, colour=(1.8, 0.8, 0.3)),
    Lamp("disc", (0.3, 0.3), 40.0, 88.0),
    Lamp("ring", (0.5, 0.5), -100.0, -70.0),
    Lamp("disc", (0.03, 0.03), 10.0, 5.0),
    Lamp("softbox", (0.9, 0.9), -60.0, 10.0),
]


@pytest.mark.parametrize("lamp", CAPTURES, ids=lambda lamp: f"{lamp.form} {lamp.azimuth_deg:g}")
def test_energy_is_kept_and_the_middle_is_where_the_lamp_is_held(lamp: Lamp) -> None:
    own = captured(lamp, white=3.0)
    before = 3.0 * energy(own.light)
    for azimuth, altitude in ((0.0, 0.0), (90.0, 0.0), (-45.0, 33.75), (0.0, -67.5), (180.0, 67.5)):
        light, alpha = placed_at(own, azimuth, altitude)
        np.testing.assert_allclose(energy(light), before, rtol=1e-3)
        assert float(energy(alpha)) == pytest.approx(own.solid_angle_sr, rel=0.01)
        assert alpha.min() >= 0.0
        assert alpha.max() <= 1.0
        there, height = centroid(light)
        # The panorama grows towards the sitter's right. Texels are 5.6 deg.
        off = (there + azimuth + 180.0) % 360.0 - 180.0
        assert abs(off) * np.cos(np.radians(height)) < 0.2
        assert height == pytest.approx(altitude, abs=0.6)


def test_first_rotation_brings_the_middle_to_the_front() -> None:
    own = captured(Lamp("softbox", (0.4, 0.3), -150.0, 50.0, 30.0))
    front = rotate_light(own.light, centring(own.light))
    assert centroid(front) == pytest.approx((0.0, 0.0), abs=0.02)
    np.testing.assert_allclose(energy(front), energy(own.light), rtol=1e-3)


def test_toward_the_sitters_left_is_left_in_the_panorama(lopsided: PlacedLamp) -> None:
    straight, left = lopsided.light[4 * 64], lopsided.light[4 * 64 + 8]
    assert placement(4 * 64 + 8) == (45.0, 0.0)
    assert centroid(left)[0] == pytest.approx(-45.0, abs=0.3)
    np.testing.assert_array_equal(left, np.roll(straight, -8, axis=1))


def test_it_is_raised_first_and_swung_then(lopsided: PlacedLamp) -> None:
    """R_y R_x: raised over the front, its upper end stays above its middle wherever it is held."""
    for number in (8 * 64, 8 * 64 + 16, 40):
        azimuth, altitude = placement(number)
        there, height = centroid(lopsided.light[number])
        assert there == pytest.approx(-azimuth, abs=0.5)
        assert height == pytest.approx(altitude, abs=0.5)
    # Upright at the front: all its light lies in the columns of the middle.
    columns = lopsided.light[8 * 64].sum(axis=(0, 2))
    side = lopsided.light[8 * 64 + 16].sum(axis=(0, 2))
    np.testing.assert_array_equal(side, np.roll(columns, -16))


def test_a_lamp_that_stood_upright_stays_upright() -> None:
    """It is swung about the vertical and lowered, never rolled."""
    own = captured(Lamp("box", (0.05, 0.4), 120.0, 30.0))
    light, _ = placed_at(own, 0.0, 0.0)
    tall = (light.sum(axis=-1) > 0.1 * light.sum(axis=-1).max()).nonzero()
    assert np.ptp(tall[0]) >= 3 * np.ptp(tall[1])


def test_all_placements_are_those_one_by_one() -> None:
    own = captured(Lamp("dish", (0.3, 0.2), 77.0, -20.0, 15.0))
    every = place_lamp(own)
    assert every.light.shape == (576, 32, 64, 3)
    assert every.alpha.shape == (576, 32, 64)
    for number in (0, 63, 64 * 4, 64 * 6 + 21, 575):
        light, alpha = placed_at(own, *placement(number))
        np.testing.assert_allclose(every.light[number], light, atol=0.02 * light.max())
        np.testing.assert_allclose(every.alpha[number], alpha, atol=0.02)


def test_light_is_in_cd_m2_where_that_is_known() -> None:
    lamp = phone(0.3)
    known = placed_at(captured(lamp, white=2.5), 0.0, 0.0)[0]
    unknown = placed_at(captured(lamp, white=None), 0.0, 0.0)[0]
    np.testing.assert_allclose(known, 2.5 * unknown, rtol=1e-5)
    assert place_lamp(captured(lamp)).absolute
    assert not place_lamp(captured(lamp, white=None)).absolute


def test_illuminance_is_that_of_a_rectangle() -> None:
    # A phone of 600 cd/m2 at 0.3 m, by the formula for a rectangle opposite: two corners' factors.
    a, b = 0.035 / 0.3, 0.075 / 0.3
    corner = a / np.hypot(1, a) * np.arctan(b / np.hypot(1, a))
    corner += b / np.hypot(1, b) * np.arctan(a / np.hypot(1, b))
    exact = 600.0 * 4.0 * corner / 2.0
    assert captured(phone(0.3, 20.0, 10.0), shape=(512, 1024)).lux == pytest.approx(exact, rel=0.01)
    assert captured(phone(0.3), white=None).lux is None


def test_a_lamp_hides_what_is_behind_it() -> None:
    own = captured(Lamp("disc", (0.6, 0.6)))
    light, alpha = placed_at(own, 0.0, 0.0)
    scene = np.full((32, 64, 3), 7.0, np.float32)
    mixed = light + (np.float32(1.0) - alpha)[..., None] * scene
    middle, back = mixed[15:17, 31:33], mixed[15:17, :2]
    np.testing.assert_allclose(middle, np.broadcast_to(light[15:17, 31:33], middle.shape))
    np.testing.assert_array_equal(back, np.float32(7.0))


def test_the_room_outside_the_mask_gives_nothing() -> None:
    light, truth = room(phone(0.3), 0.1, shape=SHAPE)
    lamp = make_lamp("phone", light, truth.astype(np.float32))
    assert not lamp.light[~truth].any()
    np.testing.assert_array_equal(lamp.light[truth], light[truth])


@pytest.mark.slow
def test_a_grey_lamp_has_the_same_luminance() -> None:
    lamp = captured(CAPTURES[1])
    grey = grey_lamp(lamp)
    assert not np.ptp(grey.radiance, axis=2).any()
    np.testing.assert_allclose(luminance(grey.radiance), luminance(lamp.radiance), rtol=1e-5)
    assert np.ptp(lamp.light, axis=2).max() > 0.1 * lamp.light.max()


def test_fine_captures_are_reduced_with_their_light() -> None:
    lamp = Lamp("disc", (0.02, 0.02), 30.0, 10.0)
    fine, truth = room(lamp, 0.01, shape=(1024, 2048), finer=1)
    own = make_lamp("bulb", fine, truth.astype(np.float32))
    assert own.shape == LARGEST
    np.testing.assert_allclose(energy(own.light), energy(fine * truth[..., None]), rtol=1e-5)
    assert own.solid_angle_sr == pytest.approx(float(energy(truth.astype(np.float32))), rel=1e-5)


def test_bad_captures_are_refused_in_words() -> None:
    light = np.ones((8, 16, 3), np.float32)
    with pytest.raises(CoreError, match="not a full panorama"):
        make_lamp("x", light[:, :9], light[:, :9, 0])
    with pytest.raises(CoreError, match="mask of x has the shape"):
        make_lamp("x", light, light[:4, :, 0])
    with pytest.raises(CoreError, match="no light in it"):
        make_lamp("x", light, np.zeros((8, 16), np.float32))
    with pytest.raises(ValueError, match="columns"):
        place_lamp(make_lamp("x", light, light[..., 0]), (16, 32))


def test_damaged_numbers_are_repaired() -> None:
    light = np.ones((8, 16, 3), np.float32)
    light[0, 0] = np.nan
    light[1, 1] = -3.0
    alpha = np.ones((8, 16), np.float32)
    alpha[2, 2], alpha[3, 3] = np.nan, 4.0
    lamp = make_lamp("x", light, alpha)
    assert np.isfinite(lamp.radiance).all()
    assert lamp.radiance.min() == 0.0
    assert lamp.alpha[2, 2] == 0.0
    assert lamp.alpha[3, 3] == 1.0
    assert np.isnan(light[0, 0]).all()  # What was given is as it was.
