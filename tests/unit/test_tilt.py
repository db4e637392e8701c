"""Tilted cameras: which are noticed, which styles they put in doubt, and what is said."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cli import main
from app.core.base.arrays import Float32, Float64
from app.core.base.colour import srgb_encode
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from app.core.base.sphere import angle_of, directions, from_vector, rotate_light, rotation
from app.core.cautions.caution import Caution, Hazard
from app.core.cautions.find_cautions import camera_cautions
from app.core.cautions.lost_match import lost_match
from app.core.cautions.tilt import LOSS, camera_tilt, likeliest_tilt, tilt_caution, tilted_styles
from app.core.environment.environment import Environment, reduce_light
from app.core.environment.environment_file import read_panorama
from app.core.measure.finish.clip_audit import choices
from app.core.measure.finish.findings import Findings
from app.core.measure.ways import measure
from app.core.places.place import CaptureFacts, Place
from app.core.styles.style_pack_file import load_named_pack
from app.ui.screens.probe.capture.camera import CameraBlock
from app.ui.screens.probe.capture.notice import advice_notice
from app.words.measure.doubts import caution_lines, hazard_words, notice_lines
from tests.helpers.exif_bytes import XMP, pose_xmp, segment

SCENES = resources() / "demo" / "scenes"


def scene(name: str) -> Float32:
    """A panorama of a camera that stood level, (512, 1024, 3)."""
    light = read_panorama(SCENES / f"{name}.exr").radiance
    small = cv2.resize(light, (1024, 512), interpolation=cv2.INTER_AREA)
    return np.asarray(np.maximum(small, 0.0), np.float32)


def tilting(tilt_deg: float, azimuth_deg: float) -> Float64:
    """The rotation from a level camera's panorama to that of a tilted one."""
    around = math.radians(azimuth_deg)
    return from_vector(np.array([math.cos(around), 0.0, math.sin(around)]) * math.radians(tilt_deg))


def tilted(light: Float32, tilt_deg: float, azimuth_deg: float = 70.0) -> Float32:
    return tilted_by(light, tilting(tilt_deg, azimuth_deg))


def tilted_by(light: Float32, matrix: Float64) -> Float32:
    return np.maximum(rotate_light(light, matrix), 0.0)


@pytest.mark.parametrize("name", ["studio", "interior", "city"])
def test_level_camera_is_not_noticed(name: str) -> None:
    assert camera_tilt(scene(name)) is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["studio", "interior", "courtyard"])
@pytest.mark.parametrize(("tilt", "azimuth"), [(8.0, -130.0), (12.0, 20.0)])
def test_tilt_is_measured_and_levelled(name: str, tilt: float, azimuth: float) -> None:
    matrix = tilting(tilt, azimuth)
    estimate = camera_tilt(tilted_by(scene(name), matrix))
    assert estimate is not None
    # Directions are a degree apart, and nobody knows how level the camera really was.
    assert estimate.degrees == pytest.approx(tilt, abs=2.0)
    assert angle_of(estimate.levelling @ matrix) < 2.5


def test_small_tilt_is_not_noticed() -> None:
    assert camera_tilt(tilted(scene("studio"), 3.0)) is None


def test_panorama_without_lines_has_no_sure_tilt() -> None:
    sky = np.repeat(1.0 + directions((512, 1024))[..., 1:2], 3, axis=2).astype(np.float32)
    noise = np.random.default_rng(4).gamma(2.0, size=(512, 1024, 3)).astype(np.float32)
    for light in (tilted(sky, 10.0), noise, np.ones((512, 1024, 3), np.float32)):
        assert camera_tilt(light) is None
    assert camera_tilt(tilted(scene("studio"), 8.0)[::4, ::4]) is None


def test_exposure_and_size_do_not_matter() -> None:
    light = tilted(scene("interior"), 9.0)
    one = likeliest_tilt(light)
    bright = likeliest_tilt(light * np.float32(512.0))
    large = likeliest_tilt(np.repeat(np.repeat(light, 2, axis=0), 2, axis=1))
    assert bright.degrees == pytest.approx(one.degrees, abs=0.01)
    assert angle_of(large.levelling @ one.levelling.T) < 2.0


def test_caution_lists_the_styles_that_lose_when_the_camera_is_levelled() -> None:
    pack, level = load_named_pack("generic"), scene("studio")
    light = tilted(level, 12.0)
    (caution,) = tilt_caution(Environment(light, "studio"), pack)
    assert caution.hazard is Hazard.TILT
    assert caution.amount == pytest.approx(12.0, abs=2.0)
    assert caution in camera_cautions(Environment(light, "studio"), pack)
    assert caution.styles is not None
    shape = pack.header.environment
    choice = choices(pack, [reduce_light(one, shape) for one in (light, level)])
    # Those that clearly lose in the level panorama itself, which the caution does not have.
    clearly = lost_match(choice)[0] > 2.0 * LOSS
    lose = {style.name for style, hit in zip(pack.styles, clearly, strict=True) if hit}
    assert lose
    assert len(lose & {*caution.styles}) > 0.6 * len(lose)
    assert set(caution.styles) < {style.name for style in pack.styles}


def test_levelling_by_nothing_affects_no_style() -> None:
    pack, level = load_named_pack("generic"), scene("studio")
    estimate = likeliest_tilt(level)
    assert estimate.degrees == 0.0
    assert tilted_styles(level, estimate, pack) == ()


def test_tilt_is_described_with_its_size_and_effect() -> None:
    tilt = Caution(Hazard.TILT, 8.0, ("top",))
    assert "8°" in hazard_words(tilt)
    lines = caution_lines((tilt,), ("top", "flat"))
    assert lines[0] == hazard_words(tilt)
    assert "top" in lines[1]
    assert "flat" not in lines[1]


def test_probe_notice_has_the_tilt() -> None:
    tilt = Caution(Hazard.TILT, 8.0, ())
    here = Place(
        "Here",
        datetime(2026, 6, 21, 12, tzinfo=UTC),
        capture=CaptureFacts(plan="files", cautions=(tilt,)),
    )
    notice = advice_notice(here, Findings(), None, CameraBlock())
    assert notice is not None
    assert (notice.tone, notice.title) == ("advice", hazard_words(tilt))
    assert notice_lines((tilt,)) == (notice.title,)


def test_solve_lists_the_tilt_and_doubts_its_styles(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "leaning.exr"
    write_exr(file, tilted(scene("studio"), 9.0))
    assert main(["solve", str(file), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    (tilt,) = (one for one in values["cautions"] if one["hazard"] == "tilt")
    assert tilt["amount"] == pytest.approx(9.0, abs=2.0)
    doubted = {one["name"] for one in values["styles"] if "tilt" in one["depends_on"]}
    assert doubted == {*tilt["styles"]}
    assert hazard_words(Caution(Hazard.TILT, tilt["amount"])) in values["advice"]


def test_single_photo_is_levelled_by_its_pose_and_cautioned_without_one(tmp_path: Path) -> None:
    light = tilted_by(scene("interior"), rotation(0.0, 9.0).T)
    codes = np.rint(255.0 * srgb_encode(np.minimum(light / light.mean() * 0.3, 1.0)))
    _, data = cv2.imencode(".jpg", codes.astype(np.uint8)[..., ::-1])
    pose = segment(0xE1, XMP + pose_xmp(PosePitchDegrees=9.0, PoseRollDegrees=0.0))
    plain = bytes(data)
    for name, content in (("plain", plain), ("posed", plain[:2] + pose + plain[2:])):
        file = tmp_path / f"{name}.jpg"
        file.write_bytes(content)
        tilt = camera_tilt(measure("single", [file]).environment(name).radiance)
        assert (tilt is None) == (name == "posed"), name
