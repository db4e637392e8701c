"""Words, reach, dimming, scale and lamp files of the second light."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.imaging.images import write_exr, write_hdr
from app.core.environment.environment import solid_angles
from app.core.second_light.captured_lamps.lamp_capture import read_lamp_file
from app.core.second_light.lamp_presets import KINDS, powers_of
from app.core.second_light.lamp_spot import LampSpot, best_spot, refine
from app.core.second_light.place_brightness import illuminance, stated_white
from app.core.second_light.placements import COUNT, above_floor, placement, within_arm
from app.words.lamps import power_words
from tests.helpers.synthetic import lamp_environment


def _number(azimuth_deg: float, altitude_deg: float) -> int:
    every = [placement(number) for number in range(COUNT)]
    return every.index((azimuth_deg, altitude_deg))


def test_reach() -> None:
    near = within_arm(0.3)
    assert near[_number(0.0, 0.0)]
    assert near[_number(90.0, 16.875)]
    assert not near[_number(0.0, -67.5)]  # inside the chest
    arm = within_arm(0.6)
    assert arm[_number(0.0, 0.0)]
    assert not arm[_number(180.0, 0.0)]  # behind the back of the head
    assert not within_arm(1.5).any()
    grid = arm.reshape(9, 64)
    np.testing.assert_array_equal(grid, np.roll(grid[:, ::-1], 1, axis=1))
    assert above_floor(1.0).all()
    low = above_floor(2.0)
    assert not low[_number(0.0, -67.5)]
    assert low[_number(0.0, -33.75)]
    assert above_floor(2.0, ear_height_m=3.0).all()


def test_powers() -> None:
    assert powers_of("bulb") == (1.0,)
    assert powers_of("somebody's lamp") == (1.0,)
    assert powers_of("flash")[0] == 16.0
    for kind in KINDS:
        powers = powers_of(kind)
        assert 1.0 in powers
        assert list(powers) == sorted(powers, reverse=True)
    assert power_words(1 / 64, "panel") == "at 1/64 power"
    assert power_words(16.0, "flash") == "at full power"
    assert power_words(0.5, "flash") == "at 1/32 power"


def test_illuminance_of_a_lamp_and_of_an_even_room() -> None:
    even = np.ones((32, 64, 3), np.float32)
    assert illuminance(even) == pytest.approx(math.pi, rel=0.005)
    lamp = lamp_environment(40.0, 0.0, 2.0, (128, 256))
    power = float((lamp * solid_angles((128, 256))[:, None]).sum())
    assert illuminance(lamp, 40.0) == pytest.approx(power, rel=0.001)
    assert illuminance(lamp, -20.0) == pytest.approx(power / 2, rel=0.01)
    assert illuminance(lamp, 160.0) < 0.2 * power
    assert illuminance(lamp, -140.0) == 0.0


def test_the_stated_white(tmp_path: Path) -> None:
    light = np.ones((16, 32, 3), np.float32)
    write_exr(tmp_path / "with.exr", light, 123.5)
    write_exr(tmp_path / "without.exr", light)
    write_hdr(tmp_path / "other.hdr", light)
    assert stated_white(tmp_path / "with.exr") == pytest.approx(123.5)
    assert stated_white(tmp_path / "without.exr") is None
    assert stated_white(tmp_path / "other.hdr") is None
    assert stated_white(tmp_path / "none.exr") is None


def _write_rgba(path: Path, light: np.ndarray, alpha: np.ndarray, white: float | None) -> None:
    import OpenImageIO as oiio

    both = np.concatenate([light, alpha[..., None]], axis=2).astype(np.float32)
    spec = oiio.ImageSpec(both.shape[1], both.shape[0], 4, "float")
    if white is not None:
        spec.attribute("whiteLuminance", white)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    assert output.write_image(both)
    output.close()


def test_a_lamp_file_with_its_mask(tmp_path: Path) -> None:
    light = np.full((64, 128, 3), 0.01, np.float32)
    alpha = np.zeros((64, 128), np.float32)
    alpha[30:34, 60:66] = 1.0
    light[alpha > 0] = 5.0
    _write_rgba(tmp_path / "lamp.exr", light, alpha, 20.0)
    capture = read_lamp_file(tmp_path / "lamp.exr")
    lamp = capture.lamp
    assert (capture.warnings, capture.mask) == ((), None)
    assert lamp.white_cd_m2 == pytest.approx(20.0)
    np.testing.assert_array_equal(lamp.alpha, alpha)
    assert lamp.light[0, 0].tolist() == [0.0, 0.0, 0.0]


def test_a_lamp_file_without_a_mask_is_searched(tmp_path: Path) -> None:
    light = np.full((128, 256, 3), 0.01, np.float32)
    light[60:70, 120:134] = 5.0
    write_exr(tmp_path / "lamp.exr", light)
    lamp = read_lamp_file(tmp_path / "lamp.exr").lamp
    assert lamp.white_cd_m2 is None
    assert lamp.alpha[65, 127] == 1.0
    assert lamp.alpha[20, 20] == 0.0
    with pytest.raises(EnvironmentFileError):
        read_lamp_file(tmp_path / "nothing.exr")
    write_exr(tmp_path / "even.exr", np.ones((64, 128, 3), np.float32))
    with pytest.raises(CoreError):
        read_lamp_file(tmp_path / "even.exr")


def test_a_parabola_is_refined_exactly() -> None:
    turn, altitude, azimuth = np.meshgrid(np.arange(64), np.arange(9), np.arange(64), indexing="ij")
    t, h, a = turn - 20.3, altitude - 4.2, azimuth - 39.6
    values = 9.0 - 0.01 * (t * t + 2 * h * h + a * a + 0.8 * t * a)
    objective = values.reshape(64, 576)
    spot = best_spot(objective)
    assert spot == LampSpot(20, 4 * 64 + 40)
    allowed = np.ones((64, 576), bool)
    assert refine(objective, spot, allowed) == pytest.approx((0.3, -0.4, 0.2), abs=1e-9)
    # A gate that closes towards the maximum holds the move back.
    gate = (20.1 - turn).reshape(64, 576).astype(float)
    assert refine(objective, spot, allowed, gate)[0] <= 0.1 + 1e-9
    assert refine(objective[[20]], LampSpot(0, spot.number), allowed[[20]])[0] == 0.0


def test_ties_in_order() -> None:
    objective = np.zeros((64, 576))
    equal = [(63, 0), (1, _number(-5.625, 0.0)), (1, _number(5.625, 16.875)), (5, 4 * 64)]
    for spot in equal:
        objective[spot] = 1.0
    assert best_spot(objective) == LampSpot(1, _number(5.625, 16.875))
    objective[1, _number(5.625, -16.875)] = 1.0
    assert best_spot(objective) == LampSpot(1, _number(5.625, 16.875))
    objective[1, _number(5.625, 0.0)] = 1.0
    assert best_spot(objective) == LampSpot(1, _number(5.625, 0.0))
