"""Light of a place as a portrait needs it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app.core.portrait.light import (
    GLINTS,
    SHARP,
    SHEEN,
    blurred,
    grid,
    lamps_light,
    portrait_light,
    soft_light,
)
from app.core.styles.style import StyleLamp

ROWS, COLUMNS = 256, 512


def solid_angles() -> np.ndarray:
    edges = np.cos(np.arange(ROWS + 1) * np.pi / ROWS)
    return np.repeat((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / COLUMNS, COLUMNS, axis=1)


def with_disc(azimuth: float, elevation: float, radius: float, value: float) -> np.ndarray:
    """An even sky of 1 with a disc in it; degrees."""
    up = np.pi / 2 - (np.arange(ROWS) + 0.5)[:, None] / ROWS * np.pi
    round_ = ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5) * 2 * np.pi - math.radians(azimuth)
    at = math.radians(elevation)
    cosine = np.sin(up) * math.sin(at) + np.cos(up) * math.cos(at) * np.cos(round_)
    sky = np.ones((ROWS, COLUMNS, 3), np.float32)
    sky[cosine > math.cos(math.radians(radius))] = value
    return sky


@pytest.mark.parametrize("azimuth", [-179.5, -100.0, 0.0, 63.0])
@pytest.mark.parametrize("elevation", [-20.0, 30.0, 60.0])
def test_a_bright_disc_is_found_as_a_lamp(azimuth: float, elevation: float) -> None:
    sky = with_disc(azimuth, elevation, 3.0, 500.0)
    (lamp,) = portrait_light(sky).lamps
    apart = (math.degrees(lamp.azimuth) - azimuth + 180) % 360 - 180
    assert abs(apart) * math.cos(math.radians(elevation)) < 0.6
    assert math.degrees(lamp.elevation) == pytest.approx(elevation, abs=0.6)
    assert math.degrees(lamp.radius) == pytest.approx(3.0, abs=0.7)
    wanted = (sky[..., 0] * solid_angles())[sky[..., 0] > 1].sum()
    assert lamp.flux[0] == pytest.approx(wanted, rel=0.05)


def test_no_light_is_lost_between_lamps_and_sky() -> None:
    sky = with_disc(50.0, 20.0, 2.0, 900.0) * [1.0, 0.9, 0.7]
    light = portrait_light(sky)
    soft = (soft_light(light, 33.0) * grid()[3][:, None]).sum(axis=0)
    whole = (sky * solid_angles()[..., None]).sum(axis=(0, 1))
    np.testing.assert_allclose(soft + sum(lamp.flux for lamp in light.lamps), whole, rtol=2e-3)


def string_of_lamps() -> np.ndarray:
    """Twelve lamps of one texel each along the horizon, the later the dimmer."""
    sky = np.full((ROWS, COLUMNS, 3), 0.01, np.float32)
    for number in range(12):
        sky[120:122, 40 * number + 10 : 40 * number + 12] = 2000.0 - 50 * number
    return sky


def test_lamps_beyond_the_sharp_ones_stay_in_the_soft_light() -> None:
    sky = string_of_lamps()
    light = portrait_light(sky)
    assert len(light.lamps) == 12
    soft = (soft_light(light, 0.0) * grid()[3][:, None]).sum(axis=0)
    whole = (sky * solid_angles()[..., None]).sum(axis=(0, 1))
    sharp = sum(lamp.flux for lamp in light.lamps[:SHARP])
    np.testing.assert_allclose(soft + sharp, whole, rtol=2e-3)


def test_sheen_holds_all_light_but_of_lamps_that_are_mirrored_one_by_one() -> None:
    sky = string_of_lamps()
    light = portrait_light(sky)
    edges = np.cos(np.arange(SHEEN[0] + 1) * np.pi / SHEEN[0])
    solid = (edges[:-1] - edges[1:]) * 2 * np.pi / SHEEN[1]
    # Aslant, and from straight above.
    mirrored = (light.sheen[:, 1:-1] * solid[:, None, None]).sum(axis=(0, 1)).reshape(2, 3)
    whole = (sky * solid_angles()[..., None]).sum(axis=(0, 1))
    alone = sum(lamp.flux for lamp in light.lamps[:GLINTS])
    np.testing.assert_allclose(mirrored + alone, [whole, whole], rtol=0.02)


@pytest.mark.parametrize("diameter", [0.5, 20.0, 24.0, 50.0])
def test_a_studio_lamp_is_sharp_or_soft_and_all_there(diameter: float) -> None:
    light = lamps_light([StyleLamp(-40.0, 30.0, diameter, 1.0, 3.0)])
    soft = (soft_light(light, 0.0) * grid()[3][:, None]).sum(axis=0)
    sharp = sum(lamp.flux for lamp in light.lamps)
    np.testing.assert_allclose(soft + sharp, 1.0, rtol=2e-3)
    assert bool(light.lamps) == (diameter < 22)


@pytest.mark.parametrize("diameter", [0.5, 4.0, 20.0, 50.0])
def test_eyes_mirror_all_light_of_a_studio_lamp(diameter: float) -> None:
    light = lamps_light([StyleLamp(-40.0, 30.0, diameter, 1.0, 3.0)])
    seen = light.panorama[:, 1:-1]
    edges = np.cos(np.arange(len(seen) + 1) * np.pi / len(seen))
    solid = (edges[:-1] - edges[1:]) * 2 * np.pi / seen.shape[1]
    total = (seen * solid[:, None, None]).sum(axis=(0, 1))
    np.testing.assert_allclose(total, 1.0, rtol=0.02)


def test_black_has_no_lamps_and_stars_do_not_count() -> None:
    assert portrait_light(np.zeros((64, 128, 3))).lamps == ()
    stars = np.full((ROWS, COLUMNS, 3), 0.01, np.float32)
    stars[::4, ::4] = 50
    assert portrait_light(stars).lamps == ()


def test_a_lamp_at_the_seam_is_one() -> None:
    (lamp,) = portrait_light(with_disc(180.0, 10.0, 3.0, 500.0)).lamps
    assert abs(abs(math.degrees(lamp.azimuth)) - 180) < 0.6


def test_a_turn_is_a_shift_of_the_panorama() -> None:
    sky = np.random.default_rng(4).gamma(2.0, size=(ROWS, COLUMNS, 3)).astype(np.float32)
    turned = np.roll(sky, -64, axis=1)
    np.testing.assert_allclose(
        soft_light(portrait_light(sky), 45.0), soft_light(portrait_light(turned), 0.0), rtol=1e-4
    )


def test_sheen_of_even_light_is_even_and_of_a_spot_is_centred_there() -> None:
    np.testing.assert_allclose(blurred(np.ones((*SHEEN, 3), np.float32), 0.3), 1, rtol=1e-5)
    spot = np.zeros((*SHEEN, 3), np.float32)
    spot[20, 100] = 1
    blur = blurred(spot, 0.3)[..., 0]
    assert abs(np.unravel_index(blur.argmax(), blur.shape)[0] - 20) <= 1
    assert np.unravel_index(blur.argmax(), blur.shape)[1] == 100
    assert blur[20, 100] > 20 * blur[20, 36]


def test_a_studio_lamp_stands_on_the_side_that_the_style_says() -> None:
    lamp = StyleLamp(40.0, 30.0, 10.0, 2.0, 1.5)
    (found,) = lamps_light([lamp]).lamps
    # The sitter's left is the panorama's left: azimuths there run the other way.
    assert math.degrees(found.azimuth) == pytest.approx(-40.0)
    assert math.degrees(found.radius) == pytest.approx(5.0)
    np.testing.assert_allclose(found.flux, 2.0)
