"""Tests of recognising the sun, putting it back, and lamps measured with a light meter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference
from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.environment.environment import energy, read_environment, reduce_radiance
from app.core.measure.finish.clip_audit import given_up
from app.core.measure.finish.lamp_detection import find_lights
from app.core.measure.finish.remarks import LampMetered
from app.core.measure.finish.restoration import restore, set_illuminance
from app.core.measure.finish.sun import find_sun, is_sun, sun_core
from app.core.measure.finish.sunlight import SkyWord, direct_normal_lux
from app.core.measure.read.frame import MergedLight
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.words.remarks import remark_words
from benchmarks.speed.plain_search import choose
from tests.helpers.probes import away_deg, clip, place, sunny_place

SCENES = Path(__file__).resolve().parents[2] / "resources" / "demo" / "scenes"
# Luminance, cd/m2, at which the darkest frames of a Theta S, SC2, V, X and Z1 clip.
FLOORS = (30_700.0, 60_000.0, 187_000.0, 220_000.0, 1_180_000.0)
NO_SUN = ("courtyard", "forest", "interior", "night", "studio")
UNIT = 5_000.0


@pytest.fixture(scope="module")
def pack() -> StylePack:
    return load_named_pack("generic")


def seen(cd_m2: NDArray[np.float32], floor: float) -> MergedLight:
    """What a camera holds of luminances, in units of 5,000 cd/m2."""
    return clip(cd_m2 / np.float32(UNIT), floor / UNIT, cd_m2=UNIT)


def direct_lux(merged: MergedLight, azimuth: float, elevation: float) -> float:
    """Normal illuminance from within 2.5 deg."""
    near = away_deg(merged.clipped.shape, azimuth, elevation) <= 2.5
    return float(energy(luminance(merged.radiance) * near)) * UNIT


@pytest.mark.parametrize("floor", FLOORS)
@pytest.mark.parametrize("elevation", [8.0, 25.0, 60.0])
def test_sun_over_open_ground_is_recognised(floor: float, elevation: float) -> None:
    lux = direct_normal_lux(elevation)
    merged = seen(sunny_place(elevation, -100.0, lux), floor)
    sun = find_sun(merged, find_lights(merged))
    assert sun is not None
    core = sun_core(sun, merged)
    assert abs(difference(core.azimuth_deg, -100.0)) < 0.6
    assert core.elevation_deg == pytest.approx(elevation, abs=1.0)


@pytest.mark.parametrize("azimuth", [0.0, 90.0, 179.9, -179.7])
def test_sun_is_recognised_at_the_seam(azimuth: float) -> None:
    merged = seen(sunny_place(30.0, azimuth), FLOORS[2])
    sun = find_sun(merged, find_lights(merged))
    assert sun is not None
    assert abs(difference(sun_core(sun, merged).azimuth_deg, azimuth)) < 0.4


@pytest.mark.slow
@pytest.mark.parametrize("sky", get_args(SkyWord))
@pytest.mark.parametrize("shape", [(512, 1024), (1024, 2048)])
def test_restored_sun_has_the_models_illuminance(sky: SkyWord, shape: tuple[int, int]) -> None:
    truth = sunny_place(45.0, 60.0, shape=shape)
    merged = seen(truth, FLOORS[2])
    result = restore(merged, find_lights(merged), sky)
    core_lux = direct_normal_lux(45.0, sky)
    assert result.light == "A"
    assert result.illuminance_lux == pytest.approx(core_lux, rel=5e-3)
    assert direct_lux(result.merged, 60.0, 45.0) == pytest.approx(core_lux, rel=5e-3)
    assert result.range_lux == pytest.approx((0.6 * core_lux, 1.6 * core_lux), rel=5e-3)
    # Its light survives the reduction that the search works on.
    gained = energy(luminance(result.merged.radiance)) - energy(luminance(merged.radiance))
    small = reduce_radiance(result.merged.radiance) - reduce_radiance(merged.radiance)
    assert energy(luminance(small)) == pytest.approx(float(gained), rel=1e-3)
    assert float(gained) * UNIT == pytest.approx(core_lux - result.held_lux, rel=1e-3)


def test_restored_sun_is_as_small_as_the_sun() -> None:
    merged = seen(sunny_place(45.0, 60.0, shape=(1024, 2048)), FLOORS[0])
    result = restore(merged, find_lights(merged), "clear")
    changed = (result.merged.radiance != merged.radiance).any(axis=2)
    away = away_deg((1024, 2048), 60.0, 45.0)
    assert away[changed].max() < 1.0
    assert (result.merged.radiance >= merged.radiance).all()
    assert not result.merged.clipped[away < 1.0].any()
    assert result.remark is not None
    assert "95 klx" in remark_words(result.remark)


def test_nothing_is_done_when_the_user_says_so_or_no_sun_is_there() -> None:
    merged = seen(sunny_place(), FLOORS[2])
    left = restore(merged, find_lights(merged), "leave")
    assert left.light is None
    assert left.merged is merged
    assert left.remark is None
    unknown = replace(merged, cd_m2=None)
    assert restore(unknown, find_lights(unknown), "clear").light is None


@pytest.mark.slow
@pytest.mark.parametrize("name", NO_SUN)
def test_no_bundled_scene_without_a_sun_is_given_one(name: str) -> None:
    radiance = read_environment(SCENES / f"{name}.exr").radiance
    mean = float(luminance(reduce_radiance(radiance)).mean())
    for level in (10.0, 100.0, 1_000.0, 6_000.0, 20_000.0):
        for floor in FLOORS:
            merged = seen(radiance * np.float32(level / mean), floor)
            assert restore(merged, find_lights(merged), "clear").light is None, (level, floor)


def test_a_lamp_in_a_bright_room_is_not_the_sun() -> None:
    # As bright, small and round as the sun, in a room as bright as day.
    room = place([(60.0, 40.0, 0.6, 1e9)], (512, 1024), fill=6_000.0)
    merged = seen(room, FLOORS[2])
    lights = find_lights(merged)
    assert lights[0].clipped
    assert not any(is_sun(light, merged) for light in lights)


def test_two_suns_are_none() -> None:
    one, other = sunny_place(40.0, 60.0), sunny_place(35.0, -90.0)
    merged = seen(np.maximum(one, other), FLOORS[2])
    assert find_sun(merged, find_lights(merged)) is None


def test_a_dim_frame_cannot_show_the_sun() -> None:
    merged = seen(sunny_place() * np.float32(0.01), 3_000.0)
    assert find_sun(merged, find_lights(merged)) is None


@pytest.mark.parametrize("floor", [FLOORS[0], FLOORS[2], FLOORS[4]])
@pytest.mark.parametrize("factor", [0.6, 1.0, 1.6])
def test_sunrise_answers_come_back(pack: StylePack, floor: float, factor: float) -> None:
    """Bundled sunrise, its disc clipped by 7 to 13 stops."""
    radiance = read_environment(SCENES / "sunrise.exr").radiance
    row, column = np.unravel_index(int(luminance(radiance).argmax()), radiance.shape[:2])
    azimuth, elevation = 360.0 * ((column + 0.5) / 1024 - 0.5), 90.0 - 180.0 * (row + 0.5) / 512
    near = away_deg((512, 1024), float(azimuth), float(elevation)) <= 2.5
    disc = float(energy(luminance(radiance) * near))
    truth = radiance * np.float32(factor * direct_normal_lux(float(elevation)) / disc)
    merged = seen(truth, floor)
    result = restore(merged, find_lights(merged), "clear")
    assert result.light is not None
    light = luminance(reduce_radiance(truth))
    answers = choose(pack, luminance(reduce_radiance(result.merged.radiance))).turns
    lost = given_up(choose(pack, light), answers)
    # Of all styles but one on both of its sides.
    assert np.count_nonzero(lost <= 0.02) >= len(lost) - 2


def test_a_metered_lamp_has_its_illuminance() -> None:
    room = place([(60.0, 20.0, 10.0, 80_000.0), (-90.0, 0.0, 20.0, 900.0)], (512, 1024), 50.0)
    truth = float(energy(luminance(room) * (luminance(room) > 10_000.0)))
    merged = clip(room / np.float32(100.0), 100.0, cd_m2=100.0)
    lights = find_lights(merged)
    lamp = next(light for light in lights if light.clipped)
    result = set_illuminance(merged, lamp, truth)
    assert result.light == lamp.id
    back = luminance(result.merged.radiance)[merged.clipped > 0] * 100.0
    # A surface facing the lamp sees its edge at 5 deg: cos is 0.996.
    assert back == pytest.approx(80_000.0, rel=5e-3)
    assert not result.merged.clipped.any()
    outside = merged.clipped == 0
    assert np.array_equal(result.merged.radiance[outside], merged.radiance[outside])
    assert result.remark is not None
    assert isinstance(result.remark, LampMetered)
    assert result.remark.lux == pytest.approx(truth)


def test_colour_of_a_metered_lamp_is_kept() -> None:
    room = place([(60.0, 20.0, 10.0, 80_000.0)], (256, 512), 50.0)
    room *= np.array([1.2, 1.0, 0.6], np.float32)
    merged = clip(room / np.float32(100.0), 700.0, cd_m2=100.0)
    lamp = find_lights(merged)[0]
    result = set_illuminance(merged, lamp, 5_000.0)
    inside = merged.clipped > 0
    before, after = merged.radiance[inside], result.merged.radiance[inside]
    assert after[:, 0] / after[:, 2] == pytest.approx(before[:, 0] / before[:, 2], rel=1e-4)


def test_metered_values_are_checked() -> None:
    merged = clip(place([(60.0, 20.0, 10.0, 900.0)]), 100.0, cd_m2=100.0)
    lamp = find_lights(merged)[0]
    for lux in (0.0, -5.0, float("nan"), float("inf")):
        with pytest.raises(ProbeError, match="positive number of lux"):
            set_illuminance(merged, lamp, lux)
    with pytest.raises(ProbeError, match=r"provides at least .* more than the 10"):
        set_illuminance(merged, lamp, 10.0)
    with pytest.raises(ProbeError, match="shutter, ISO and aperture"):
        set_illuminance(replace(merged, cd_m2=None), lamp, 500.0)
