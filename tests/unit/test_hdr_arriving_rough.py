"""A rough answer from thumbnails: near the true one, marked as rough, or none at all."""

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.base.paths import resources
from app.core.hdr.arriving import rough_environment
from app.core.hdr.camera_table import camera_facts
from app.core.hdr.frame import Exposure
from app.core.hdr.pipeline import measure
from app.core.hdr.planner import plan
from app.core.solver.environment import Environment, read_environment, reduce
from app.core.solver.solve import solve_all
from app.core.solver.style_pack import StylePack, load_named_pack
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from benchmarks.brackets import write_bracket


@lru_cache
def pack() -> StylePack:
    return load_named_pack("generic")


@lru_cache
def shots(scene: str) -> tuple[NDArray[np.float32], tuple[Exposure, ...]]:
    light = read_environment(resources() / "demo" / "scenes" / f"{scene}.exr").radiance
    light = light * np.float32(200.0 / light.mean())  # a bright room, in cd/m2
    known = camera_facts("RICOH THETA V")
    assert known is not None
    planned = plan(meter(light, THETA_V), known.limits, "paper")
    return light, tuple(shot.exposure for shot in planned.shots)


def thumbnails(folder: Path, files: list[Path], width: int = 320, quality: int = 80) -> list[Path]:
    small = []
    for file in files:
        codes = cv2.imread(str(file))
        assert codes is not None
        path = folder / f"thumb-{file.stem}.jpg"
        tiny = cv2.resize(codes, (width, width // 2), interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(path), tiny, [cv2.IMWRITE_JPEG_QUALITY, quality])
        small.append(path)
    return small


def turns(environment: Environment) -> NDArray[np.float64]:
    small = luminance(reduce(environment, pack().header.environment))
    return np.array([style.turn_deg for style in solve_all(pack(), small)])


@pytest.mark.parametrize(("scene", "near"), [("interior", 15), ("courtyard", 15)])
def test_turns_from_thumbnails_are_near_those_of_the_merge(
    scene: str, near: int, tmp_path: Path
) -> None:
    light, exposures = shots(scene)
    files = write_bracket(tmp_path, light, THETA_V, exposures, shape=(512, 1024))
    rough = rough_environment(thumbnails(tmp_path, files), exposures)
    assert rough is not None
    assert rough.frames == 3
    assert rough.radiance.shape == (160, 320, 3)
    assert rough.environment("place").name == "place (rough)"
    probe = measure(files, pack())
    off = turns(rough.environment("place")) - turns(probe.environment("place"))
    off = np.abs((off + 180.0) % 360.0 - 180.0)
    print(f"{scene}: {np.count_nonzero(off <= 11.25)} of {off.size} styles within 11.25 degrees")
    assert np.count_nonzero(off <= 11.25) >= near


@pytest.fixture
def small(tmp_path: Path) -> tuple[list[Path], tuple[Exposure, ...]]:
    light, exposures = shots("studio")
    files = write_bracket(tmp_path, light, THETA_V, exposures, shape=(128, 256))
    return thumbnails(tmp_path, files, 256), exposures


def test_two_of_three_are_enough_and_one_is_not(
    small: tuple[list[Path], tuple[Exposure, ...]],
) -> None:
    paths, exposures = small
    two = rough_environment([None, *paths[1:]], exposures)
    assert two is not None
    assert two.frames == 2
    assert rough_environment([None, None, paths[2]], exposures) is None
    assert rough_environment(paths, [exposures[0], None, None]) is None
    assert rough_environment([], []) is None


def test_exposures_that_are_not_those_of_the_pictures_give_nothing(
    small: tuple[list[Path], tuple[Exposure, ...]],
) -> None:
    paths, exposures = small
    assert rough_environment([paths[0]] * 3, exposures) is None
    assert rough_environment(paths[::-1], exposures) is None
    assert rough_environment(paths, [exposures[0]] * 3) is None


def test_what_is_no_panorama_of_bearable_size_is_left_out(
    small: tuple[list[Path], tuple[Exposure, ...]], tmp_path: Path
) -> None:
    paths, exposures = small
    for width, height in ((64, 32), (256, 256), (4096, 2048)):
        tiny = tmp_path / f"{width}.jpg"
        cv2.imwrite(str(tiny), np.full((height, width, 3), 90, np.uint8))
        assert rough_environment([tiny, tiny, paths[2]], exposures) is None
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(paths[0].read_bytes()[:400])
    assert rough_environment([broken, tmp_path / "missing.jpg", paths[2]], exposures) is None


@pytest.mark.parametrize("code", [255, 0])
def test_mostly_clipped_or_black_gives_nothing(tmp_path: Path, code: int) -> None:
    paths = []
    for number in range(3):
        paths.append(tmp_path / f"{number}.jpg")
        cv2.imwrite(str(paths[-1]), np.full((160, 320, 3), code, np.uint8))
    exposures = [Exposure(4.0**-number) for number in range(3)]
    assert rough_environment(paths, exposures) is None


def test_it_is_linear_and_even_where_all_frames_see(tmp_path: Path) -> None:
    light = np.full((160, 320, 3), 0.02, np.float32)
    light[:, 160:] = 0.16
    exposures = (Exposure(4.0), Exposure(1.0), Exposure(0.25))
    paths = []
    for number, exposure in enumerate(exposures):
        share = np.clip(light * exposure.factor, 0.0, 1.0)
        codes = np.rint(255.0 * np.where(share < 0.0031308, 12.92 * share, 0)).astype(np.uint8)
        curve = 1.055 * share ** (1 / 2.4) - 0.055
        codes = np.where(share < 0.0031308, codes, np.rint(255.0 * curve)).astype(np.uint8)
        paths.append(tmp_path / f"{number}.jpg")
        cv2.imwrite(str(paths[-1]), codes, [cv2.IMWRITE_JPEG_QUALITY, 98])
    rough = rough_environment(paths, exposures)
    assert rough is not None
    ratio = rough.radiance[:, 200:280].mean() / rough.radiance[:, 40:120].mean()
    assert ratio == pytest.approx(8.0, rel=0.05)
    assert rough.radiance.mean() == pytest.approx(1.0, abs=0.02)
