"""What the simulated camera sees: honest exposures, honest files."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.colour import srgb_decode
from app.core.environment.environment import solid_angles
from app.core.measure.read.frame import Exposure
from app.core.measure.read.metadata import read_header
from app.devices.simulated.cameras import Personality
from app.devices.simulated.optics import saturation_cd_m2
from app.devices.simulated.scene import Scene, Take, automatic
from tests.faulty_camera.models import PERSONALITIES, personality_named
from tests.helpers.simulated import room

ALL = [pytest.param(person, id=person.name) for person in PERSONALITIES]
STAMP = "2026:06:21 12:00:00"


def _decoded(data: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture[..., ::-1])


def _flat(level: float) -> Scene:
    return Scene(np.full((16, 32, 3), level, np.float32))


@pytest.mark.parametrize("person", ALL)
@pytest.mark.parametrize("level", [0.05, 3.0, 100.0, 5000.0])
def test_metering_is_honest(person: Personality, level: float) -> None:
    scene = _flat(level)
    exposure, gains = automatic(scene, person, {"exposureProgram": 2})
    assert exposure.iso in person.isos
    assert exposure.aperture in person.apertures
    assert person.shutters[0] <= exposure.shutter_s <= 8.0
    take = Take(exposure, (16, 32), 1, STAMP, lens_gain=gains)
    mean = _decoded(scene.frame(person.camera, take)).mean() / 255.0
    # The lenses of some get up to 0.7 stops of their own, and times lie on a list.
    assert mean == pytest.approx(0.46, abs=0.1)
    assert (exposure.shutter_s in person.shutters) or not person.snaps


def test_iso_rises_in_the_dark_and_the_aperture_closes_in_the_sun() -> None:
    person = personality_named("Z1")
    dark, _ = automatic(_flat(1.0), person, {"exposureProgram": 2, "isoAutoHighLimit": 1600})
    assert 80 < dark.iso <= 1600
    assert dark.shutter_s <= 0.05 or dark.iso == 1600
    bright, _ = automatic(_flat(20000.0), person, {"exposureProgram": 2})
    assert (bright.iso, bright.aperture) == (80, 5.6)


def test_compensation_and_the_other_programs() -> None:
    scene, person = _flat(100.0), personality_named("Z1")
    plain, _ = automatic(scene, person, {"exposureProgram": 2})
    lighter, _ = automatic(scene, person, {"exposureProgram": 2, "exposureCompensation": 2.0})
    assert lighter.ev - plain.ev == pytest.approx(2.0, abs=0.3)
    for settings in (
        {"exposureProgram": 4, "shutterSpeed": 0.002},
        {"exposureProgram": 9, "iso": 400},
        {"exposureProgram": 3, "aperture": 3.5},
    ):
        exposure, _ = automatic(scene, person, settings)
        assert exposure.ev == pytest.approx(plain.ev, abs=0.4)
        wanted = {"shutterSpeed": exposure.shutter_s, "iso": exposure.iso}
        wanted["aperture"] = exposure.aperture
        assert all(wanted[key] == value for key, value in settings.items() if key in wanted)


def test_times_of_an_s_are_round_fractions_off_the_list() -> None:
    person = personality_named("S")
    times = [
        automatic(_flat(level), person, {"exposureProgram": 2})[0].shutter_s
        for level in (80.0, 170.0, 1100.0, 9000.0)
    ]
    assert any(time not in person.shutters for time in times)
    assert all(abs(1.0 / time - round(1.0 / time)) < 1e-6 for time in times)


def test_a_frame_is_the_environment_over_saturation() -> None:
    # Grey, so that the file's colour subsampling does not matter.
    light = np.repeat(room().environment.mean(-1, keepdims=True), 3, axis=-1)
    person = personality_named("Z1")
    exposure = Exposure(0.004, 100, 2.1)
    take = Take(exposure, (light.shape[0], light.shape[1]), 1, STAMP)
    picture = _decoded(Scene(light).frame(person.camera, take))
    truth = light.astype(np.float64) / saturation_cd_m2(exposure)
    kept = (truth > 0.02) & (truth < 0.9)
    seen = srgb_decode(picture / 255.0)
    assert seen[kept].mean() == pytest.approx(truth[kept].mean(), rel=0.03)


@pytest.mark.parametrize("person", ALL)
def test_files_say_what_was_done(person: Personality, tmp_path: Path) -> None:
    take = Take(Exposure(0.01666666, 200, person.apertures[-1]), (32, 64), 3, STAMP, program=2)
    path = tmp_path / "R0010001.JPG"
    path.write_bytes(room().frame(person.camera, take))
    frame = read_header(path).frame
    assert frame.exposure is not None
    assert frame.exposure.shutter_s == pytest.approx(1.0 / 60.0)
    assert (frame.exposure.iso, frame.exposure.aperture) == (200.0, person.apertures[-1])
    assert frame.camera.strip() == person.camera.model.strip()
    assert frame.shape == (32, 64)


def test_noise_differs_from_frame_to_frame_and_not_from_run_to_run() -> None:
    person = personality_named("Z1")
    takes = [Take(Exposure(0.004, 100, 2.1), (32, 64), number, STAMP) for number in (1, 2)]
    first, second = (room().frame(person.camera, take) for take in takes)
    assert first != second
    assert Scene(room().environment).frame(person.camera, takes[0]) == first
    assert Scene(room().environment, seed=1).frame(person.camera, takes[0]) != first


def test_white_balance_floats_unless_it_is_fixed() -> None:
    person, scene = personality_named("V"), _flat(50.0)
    exposure = Exposure(0.004, 100, 2.0)
    ratios = []
    for fixed in (True, False):
        for number in range(4):
            take = Take(exposure, (64, 128), number, STAMP, fixed_balance=fixed)
            mean = srgb_decode(_decoded(scene.frame(person.camera, take)) / 255.0).mean((0, 1))
            ratios.append(mean[0] / mean[1])
    assert np.ptp(ratios[:4]) < 0.01
    assert np.ptp(ratios[4:]) > 0.015


def test_the_brighter_side_gets_less_iso() -> None:
    light = np.ones((16, 32, 3), np.float32)
    light[:, 8:24] = 8.0
    person = personality_named("S")
    front, back = automatic(Scene(light), person, {"exposureProgram": 2})[1]
    assert front < back
    light[:, 8:24] = 0.1
    front, back = automatic(Scene(light), person, {"exposureProgram": 2})[1]
    assert front > back
    assert automatic(Scene(light), person, {"exposureProgram": 1})[1] == (1.0, 1.0)


def test_thumbnails_are_small_and_of_the_same_exposure() -> None:
    person = personality_named("Z1")
    means = []
    for time in (0.001, 0.004, 0.016):
        take = Take(Exposure(time, 100, 2.1), (3360, 6720), 1, STAMP)
        data = room().thumbnail(person.camera, take, (160, 320))
        assert len(data) < 40_000
        picture = _decoded(data)
        assert picture.shape == (160, 320, 3)
        weights = solid_angles((160, 320))[:, None, None] + np.zeros(picture.shape)
        means.append(np.average(picture, weights=weights))
    assert all(a < b for a, b in pairwise(means))
