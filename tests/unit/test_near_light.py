"""Light that is near: rooms seen from inside, moved light, and the styles that are cautioned."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.arrays import Float32, Float64
from app.core.base.sphere import direction, directions, solid_angles
from app.core.cautions.caution import Hazard
from app.core.cautions.near_light import DISTANCES_M, moved_light, near_light
from app.core.cautions.surroundings import (
    CAMERA_HEIGHT_M,
    SHAPE,
    SurfaceMap,
    estimate_surroundings,
)
from app.core.environment.environment import Environment
from app.core.styles.style_pack_file import load_named_pack

FINE = (64, 128)
HORIZON = SHAPE[0] // 2 - 1


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Float32:
    """A panorama of an empty room with a corner at `low` and one at `high`, in metres."""
    ways = directions(SHAPE).astype(np.float64)
    walls = np.where(ways > 0.0, high, low) / ways
    level = np.where(ways[..., 1] > 0, 0.8, 0.2)
    nearest = walls.argmin(axis=-1)
    light = np.where(nearest == 1, level, np.where(nearest == 0, 0.5, 0.55))
    return np.repeat(light[..., None], 3, axis=2).astype(np.float32)


def lit(panorama: Float32, azimuth: float, elevation: float, radius: float = 12.0) -> Float32:
    """The same with a round lamp."""
    lamp = directions(SHAPE) @ direction(azimuth, elevation) > np.cos(np.radians(radius))
    return np.where(lamp[..., None], np.float32(60.0), panorama)


def meadow(lamp_radius: float = 0.0) -> Float32:
    """A panorama of open ground under a blue sky, with or without a sun."""
    up = directions(SHAPE)[..., 1:2]
    sky = np.array([0.5, 0.8, 1.4]) * (1.2 - 0.5 * up)
    panorama = np.where(up > 0.0, sky, [0.25, 0.3, 0.15]).astype(np.float32)
    return lit(panorama, 50.0, 35.0, lamp_radius) if lamp_radius else panorama


def around(distance: float) -> SurfaceMap:
    """The inside of a ball."""
    return SurfaceMap(np.full(SHAPE, distance), directions(SHAPE).astype(np.float64))


def total(light: Float32) -> tuple[float, Float64]:
    """Energy of a light, and the unit vector towards its middle."""
    shape = (light.shape[0], light.shape[1])
    energy = light.mean(axis=-1) * solid_angles(shape)[:, None]
    middle = (energy[..., None] * directions(shape)).sum(axis=(0, 1))
    return float(energy.sum()), middle / np.linalg.norm(middle)


@pytest.mark.parametrize("share", [-0.5, 0.3, 0.5])
def test_lamp_grows_with_the_inverse_square_of_its_distance(share: float) -> None:
    way = direction(40.0, 20.0)
    lamp = lit(np.zeros((*SHAPE, 3), np.float32), 40.0, 20.0, 8.0)
    before, _ = total(moved_light(lamp, around(2.0), np.zeros(3), FINE))
    after, middle = total(moved_light(lamp, around(2.0), 2.0 * share * way, FINE))
    assert after / before == pytest.approx((1.0 - share) ** -2, rel=0.06)
    assert middle @ way > np.cos(np.radians(1.0))


@pytest.mark.parametrize("offset", [(0.6, 0.0, 0.0), (0.0, -0.6, 0.0), (0.2, 0.3, -0.4)])
def test_lamp_is_seen_in_its_direction_from_the_head(offset: tuple[float, float, float]) -> None:
    lamp = lit(np.zeros((*SHAPE, 3), np.float32), -70.0, 10.0, 4.0)
    _, middle = total(moved_light(lamp, around(1.5), np.array(offset), FINE))
    expected = 1.5 * direction(-70.0, 10.0) - offset
    assert middle @ expected / np.linalg.norm(expected) > np.cos(np.radians(1.5))


def test_even_light_stays_even() -> None:
    even = np.full((*SHAPE, 3), 0.4, np.float32)
    surroundings = estimate_surroundings(box((-1.5, -1.5, -2.0), (2.0, 1.1, 2.5)))
    moved = moved_light(even, surroundings, np.array([0.3, 0.2, -0.4]), (32, 64))
    assert moved == pytest.approx(0.4, rel=1e-5)


@pytest.mark.parametrize("size", [1.0, 1.6, 2.5])
def test_walls_are_where_the_floor_ends(size: float) -> None:
    low, high = (-1.4 * size, -CAMERA_HEIGHT_M, -size), (size, 1.2, 1.8 * size)
    found = estimate_surroundings(lit(box(low, high), 30.0, 0.0))
    ways = directions(SHAPE).astype(np.float64)
    true = (np.where(ways > 0.0, high, low) / ways).min(axis=-1)
    error = np.abs(np.log(found.distance / true))
    assert np.median(error[HORIZON]) < 0.06
    assert np.median(error) < 0.06


def test_sky_and_sun_are_far_away() -> None:
    for panorama in (meadow(), meadow(2.0)):
        found = estimate_surroundings(panorama)
        assert found.distance[directions(SHAPE)[..., 1] > 0.1].min() > 1e3
        assert found.distance[-1] == pytest.approx(CAMERA_HEIGHT_M, rel=0.01)


def test_lamp_close_beside_the_head_is_cautioned() -> None:
    pack = load_named_pack("generic")
    closet = lit(box((-0.6, -1.5, -1.5), (2.4, 1.1, 2.0)), 80.0, 15.0, 25.0)
    (caution,) = near_light(Environment(closet, "closet"), pack)
    assert caution.hazard is Hazard.NEAR_LIGHT
    assert caution.amount == DISTANCES_M[0]
    assert caution.styles is not None
    assert len(caution.styles) > len(pack.styles) // 2
    assert set(caution.styles) <= {style.name for style in pack.styles}


@pytest.mark.parametrize("lamp_radius", [0.0, 1.5, 5.0])
def test_sky_is_not_cautioned(lamp_radius: float) -> None:
    environment = Environment(meadow(lamp_radius), "meadow")
    assert near_light(environment, load_named_pack("generic")) == ()


def test_exposure_and_size_do_not_matter() -> None:
    pack = load_named_pack("generic")
    room = lit(box((-1.6, -1.5, -1.5), (1.2, 1.1, 2.2)), 80.0, 15.0)
    (small,) = near_light(Environment(room, "room"), pack)
    large = np.repeat(np.repeat(room, 3, axis=0), 3, axis=1) * np.float32(1e-4)
    assert near_light(Environment(large, "room"), pack) == (small,)
    assert near_light(Environment(room[::4, ::4], "room"), pack) == ()
