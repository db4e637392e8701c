"""The mask of a captured lamp against the lamp that is known to be there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.base.sphere import directions
from app.core.environment.environment import energy, read_environment, reduce_radiance
from app.core.second_light.captured_lamps.captured_lamp import make_lamp
from app.core.second_light.captured_lamps.lamp_capture import capture_lamp
from app.core.second_light.captured_lamps.lamp_mask import edit_mask, find_mask
from app.devices.simulated.cameras import SENSORS
from tests.helpers.cases import sample_first
from tests.helpers.dark_room import Lamp, bracket, coverage, overlap, phone, room

LAMPS = {
    "phone at 30 cm": phone(0.3),
    "phone over the seam": phone(0.3, 178.0, 20.0),
    "phone at 60 cm, overhead": phone(0.6, 30.0, 86.0),
    "panel of bulbs, below": Lamp("leds", (0.3, 0.2), 60.0, -70.0, 10.0),
    "softbox at 30 cm": Lamp("softbox", (0.9, 0.9), -170.0, 30.0),
    "softbox at 1 m": Lamp("softbox", (0.4, 0.3), 90.0, 60.0, 30.0),
    "ring over the seam": Lamp("ring", (0.5, 0.5), 180.0, -10.0),
    "ring underfoot": Lamp("ring", (0.3, 0.3), 0.0, -88.0),
    "bulb in a dish": Lamp("dish", (0.3, 0.3), -179.0, 70.0),
    "small disc": Lamp("disc", (0.04, 0.04), 100.0, 10.0),
    "tube": Lamp("box", (0.6, 0.03), 150.0, 45.0, 30.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.02, 0.1])
@pytest.mark.parametrize("name", sample_first(LAMPS, 2))
def test_lamps_among_walls_mirrors_and_highlights(name: str, share: float) -> None:
    light, truth = room(LAMPS[name], share, seed=len(name))
    random = np.random.default_rng(1)
    noisy = light * (1.0 + 0.02 * random.standard_normal(light.shape))
    found = find_mask(np.maximum(noisy, 0.0).astype(np.float32))
    assert overlap(found.alpha, truth) >= 0.95
    assert found.rejected >= 1
    assert found.in_lit_room == (found.contrast < 10.0)


@pytest.mark.slow
@pytest.mark.parametrize("scene", sample_first(["night", "interior", "city"], 1))
def test_lamps_in_a_real_place_with_a_tenth_of_their_light(scene: str) -> None:
    """The place's own lamps are up to hundreds of times brighter than the captured one."""
    place = read_environment(resources() / "demo" / "scenes" / f"{scene}.exr").radiance
    place = reduce_radiance(place, (512, 1024))
    for lamp in (LAMPS["softbox at 1 m"], phone(0.3, 178.0, 20.0)):
        light, truth = room(lamp, 1e-9, reflections=False)
        there = place * np.float32(0.1 * energy(light)[1] / energy(place)[1])
        mixed = np.where(truth[..., None], light, there).astype(np.float32)
        assert overlap(find_mask(mixed).alpha, truth) >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize("strength", [0.2, 0.5])
def test_a_reflection_that_touches_the_lamp_is_left_out(strength: float) -> None:
    for lamp in (phone(0.3), Lamp("softbox", (0.4, 0.3), 10.0, 20.0)):
        light, truth = room(lamp, 0.1, seed=3)
        down = 2.0 * np.degrees(np.arctan(lamp.half[1])) - 0.2
        where, pattern = coverage(
            replace(lamp, elevation_deg=lamp.elevation_deg - down), truth.shape
        )
        image = where & ~truth
        light[image] = (strength * lamp.level * pattern[image])[:, None]
        assert overlap(find_mask(light).alpha, truth) >= 0.95


def test_a_wall_that_the_window_lights_is_not_the_lamp() -> None:
    lamp = phone(0.3)
    light, truth = room(lamp, 0.05, seed=3)
    light[(directions(truth.shape)[..., 0] > 0.5) & ~truth] *= 3.0
    assert overlap(find_mask(light).alpha, truth) >= 0.95


CAPTURES = {
    "phone, V": (phone(0.3, 175.0, -5.0), "V", 64.0, (4.0, 2.0, 0.0, -2.0)),
    "phone at ISO 1600, Z1": (phone(0.6, 20.0, 10.0), "Z1", 1600.0, (2.0, 0.0, -2.0)),
    "ring at ISO 3200": (Lamp("ring", (0.3, 0.3), 0.0, -80.0), "generic", 3200.0, (4.0, 2.0, 0.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.02, 0.1])
@pytest.mark.parametrize("name", sample_first(CAPTURES, 1))
def test_whole_captures_with_noise_glow_and_jpeg(name: str, share: float, tmp_path: Path) -> None:
    lamp, camera, iso, stops = CAPTURES[name]
    light, truth = room(lamp, share, seed=5)
    files = bracket(
        tmp_path,
        light,
        lamp.level,
        camera=SENSORS[camera],
        iso=iso,
        stops=stops,
        bloom=0.02,
        bloom_deg=1.5,
    )
    found = capture_lamp(files, title="Mine", distance_m=0.3)
    assert overlap(found.lamp.alpha, truth) >= 0.9
    assert found.lamp.title == "Mine"
    assert found.lamp.distance_m == 0.3
    assert found.lamp.camera == SENSORS[camera].model.strip()
    white = found.lamp.white_cd_m2
    assert white is not None
    # The exposure that the files state gives the lamp's own luminance.
    level = float(found.lamp.radiance[truth].mean()) * white
    assert level == pytest.approx(float(light[truth].mean()), rel=0.03)


def test_a_lamp_burnt_out_in_every_frame_is_told(tmp_path: Path) -> None:
    lamp = phone(0.3)
    light, truth = room(lamp, 0.02, reflections=False)
    files = bracket(tmp_path, light, lamp.level / 16.0, stops=(2.0, 0.0))
    found = capture_lamp(files)
    assert found.mask is not None
    assert found.mask.burnt_out
    assert overlap(found.lamp.alpha, truth) >= 0.9


def test_rooms_without_a_lamp_are_refused() -> None:
    for light in (np.ones((64, 128, 3), np.float32), np.zeros((64, 128, 3), np.float32)):
        with pytest.raises(CoreError, match="No lamp stands out"):
            find_mask(light)


def test_masks_are_corrected_by_hand() -> None:
    light, truth = room(phone(0.3), 0.05)
    lamp = make_lamp("phone", light, truth.astype(np.float32), distance_m=0.3, camera="V")
    less = edit_mask(lamp, (-90.0, 0.0, -90.0, 90.0), is_lamp=False)
    assert less.solid_angle_sr == pytest.approx(lamp.solid_angle_sr / 2.0, rel=0.02)
    assert not less.alpha[:, :512].any()
    more = edit_mask(less, (-20.0, 0.0, -30.0, 30.0), is_lamp=True)
    assert more.alpha[256, 470] == 1.0
    # What was captured there is light again: correcting loses nothing.
    np.testing.assert_array_equal(more.light[256, 470], light[256, 470])
    assert (more.distance_m, more.camera) == (0.3, "V")
    with pytest.raises(CoreError, match="no light"):
        edit_mask(lamp, (-180.0, 180.0, -90.0, 89.0), is_lamp=False)
