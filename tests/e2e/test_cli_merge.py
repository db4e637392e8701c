"""`turnlight merge` as a user meets it: files in, environment, preview, table, JSON, sentences."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from app.cli import main
from app.core.base.colour import luminance
from app.core.base.paths import resources
from app.core.camera_catalogue import camera_facts
from app.core.environment.environment import read_environment, reduce
from app.core.measure.plan.planner import plan
from app.core.measure.read.frame import Exposure
from app.core.styles.styles import NAMES
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from benchmarks.light.shots.brackets import write_bracket

EV100 = 9.0

pytestmark = pytest.mark.usefixtures("qapp")


@pytest.fixture(scope="module")
def light() -> Any:
    """A real room in cd/m2, at the brightness of a well-lit studio."""
    radiance = read_environment(resources() / "demo" / "scenes" / "studio.exr").radiance
    return radiance * np.float32(meter(radiance, THETA_V).factor * 2.0**EV100)


@pytest.fixture(scope="module")
def paper(light: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's three frames of it."""
    return _shoot(light, "paper", tmp_path_factory.mktemp("paper"))


@pytest.fixture(scope="module")
def full(light: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The full bracket of it."""
    return _shoot(light, "full", tmp_path_factory.mktemp("full"))


def _shoot(light: Any, kind: Any, folder: Path) -> Path:
    model = camera_facts(THETA_V.model)
    assert model is not None
    shots = plan(meter(light, THETA_V), model.limits, kind, model.max_shots).shots
    write_bracket(folder, light, THETA_V, [shot.exposure for shot in shots], seed=3)
    return folder


def _merge(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    assert main(["merge", *map(str, words), "--json"]) == 0
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    return values


def _refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main(["merge", *map(str, words)]) == 2
    error = capsys.readouterr().err
    assert "Traceback" not in error
    return error


def test_json_has_the_documented_keys(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    values = _merge(capsys, paper, "-o", tmp_path / "out.exr")
    assert {"frames", "response", "clipped_energy_fraction", "lamps", "warnings", "seconds"} <= set(
        values
    )
    frames = values["frames"]
    assert [round(frame["ev"] - frames[1]["ev"]) for frame in frames] == [2, 0, -2]
    assert set(frames[0]) == {"file", "shutter_s", "iso", "aperture", "ev", "clipped_fraction"}
    assert frames[0]["clipped_fraction"] > frames[1]["clipped_fraction"] > 0
    assert values["response"] == "sRGB"
    assert 0 < values["clipped_energy_fraction"] < 1
    low, high = values["clipped_energy_range"]
    assert low <= values["clipped_energy_fraction"] * 1.01 < high
    assert values["lamps"][0]["id"] == "A"
    assert any(lamp["clipped"] for lamp in values["lamps"])
    assert values["advice"]


def test_the_environment_is_the_light_that_was_there(
    capsys: pytest.CaptureFixture[str], light: Any, full: Path, tmp_path: Path
) -> None:
    """Up to what every frame clips, each 64 x 32 texel within 5 %, absolute scale included."""
    values = _merge(capsys, full, "-o", tmp_path / "out.exr")
    found = reduce(read_environment(tmp_path / "out.exr")) * values["cd_m2_per_unit"]
    true = reduce(read_environment(_written(light, tmp_path)))
    ratio = luminance(found) / luminance(true)
    assert np.median(np.abs(ratio - 1)) < 0.01
    assert np.percentile(np.abs(ratio - 1), 95) < 0.05


def _written(light: Any, folder: Path) -> Path:
    from app.core.base.imaging.images import write_exr

    write_exr(folder / "true.exr", light)
    return folder / "true.exr"


def test_order_of_the_files_does_not_matter(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    files = sorted(paper.iterdir())
    _merge(capsys, *files, "-o", tmp_path / "one.exr")
    _merge(capsys, *reversed(files), "-o", tmp_path / "two.exr")
    one, two = (read_environment(tmp_path / f"{name}.exr").radiance for name in ("one", "two"))
    np.testing.assert_array_equal(one, two)


def test_originals_stay_as_they_are(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    before = {path: path.read_bytes() for path in paper.iterdir()}
    _merge(capsys, paper, "-o", tmp_path / "out.exr", "--preview", tmp_path / "look.png")
    assert {path: path.read_bytes() for path in paper.iterdir()} == before


def test_exr_states_the_luminance_of_its_unit(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    values = _merge(capsys, paper, "-o", tmp_path / "out.exr")
    source = oiio.ImageInput.open(str(tmp_path / "out.exr"))
    assert source is not None
    stated = source.spec().get_float_attribute("whiteLuminance")
    source.close()
    assert stated == pytest.approx(values["cd_m2_per_unit"], rel=1e-6)


def test_radiance_file_holds_the_same_light(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    _merge(capsys, paper, "-o", tmp_path / "out.exr")
    _merge(capsys, paper, "-o", tmp_path / "out.hdr")
    one, two = (reduce(read_environment(tmp_path / f"out.{end}")) for end in ("exr", "hdr"))
    np.testing.assert_allclose(luminance(one), luminance(two), rtol=0.01)


def test_preview_shows_the_panorama(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    _merge(capsys, paper, "-o", tmp_path / "out.exr", "--preview", tmp_path / "look.png")
    picture = cv2.imread(str(tmp_path / "look.png"))
    assert picture is not None
    assert picture.shape[1] > 2048


def test_lamp_gain_makes_a_lamp_brighter(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    plain = _merge(capsys, paper, "-o", tmp_path / "one.exr")
    name = next(lamp["id"] for lamp in plain["lamps"] if lamp["clipped"])
    _merge(capsys, paper, "-o", tmp_path / "two.exr", "--lamp-gain", f"{name}=3")
    one, two = (
        luminance(reduce(read_environment(tmp_path / f"{each}.exr"))).sum()
        for each in ("one", "two")
    )
    assert two > 1.05 * one


def test_a_mask_is_filled_and_its_effect_told(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    values = _merge(capsys, paper, "-o", tmp_path / "out.exr", "--mask", "nadir:-65")
    assert values["masked"][0]["confidence"] == 1.0
    assert len(values["mask_changes"]) == len(NAMES)
    assert any("Masking changes" in note for note in values["notes"])


def test_times_replace_missing_exif(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    """Other cameras' files: stripped PNG frames, given in the order of the names."""
    for path in sorted(paper.iterdir()):
        pixels = cv2.imread(str(path))
        assert pixels is not None
        cv2.imwrite(str(tmp_path / f"{path.stem}.png"), pixels)
    frames = sorted(tmp_path.glob("*.png"))
    assert "--times" in _refused(capsys, *frames, "-o", tmp_path / "out.exr")
    values = _merge(capsys, *frames, "-o", tmp_path / "out.exr", "--times", "0.01,0.04,0.0025")
    assert [frame["shutter_s"] for frame in values["frames"]] == [0.04, 0.01, 0.0025]
    assert values["cd_m2_per_unit"] is None


def test_full_keeps_the_frames_own_size(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    values = _merge(capsys, paper, "-o", tmp_path / "out.exr", "--full")
    assert values["size"] == [1024, 512]


def test_table_names_frames_and_lamps(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    assert main(["merge", str(paper), "-o", str(tmp_path / "out.exr")]) == 0
    out = capsys.readouterr().out
    assert "R0010001.JPG" in out
    assert ", clipped" in out
    assert "out.exr" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--lamp-gain", "A"], "A=3"),
        (["--lamp-gain", "Z=2"], "no lamp"),
        (["--lamp-lux", "A=bright"], "not a number"),
        (["--mask", "over there"], "mask"),
        (["--times", "1,2"], "3"),
        (["--exposure", "nan"], "not a number"),
    ],
)
def test_wishes_that_cannot_be_met(
    capsys: pytest.CaptureFixture[str],
    paper: Path,
    tmp_path: Path,
    words: list[str],
    said: str,
) -> None:
    error = _refused(capsys, paper, "-o", tmp_path / "out.exr", *words)
    assert said in error
    assert not (tmp_path / "out.exr").exists()


def test_an_exposure_is_never_written_over(
    capsys: pytest.CaptureFixture[str], light: Any, tmp_path: Path
) -> None:
    exposures = [Exposure(t, 100.0, 2.0) for t in (0.01, 0.0025)]
    files = write_bracket(tmp_path, light, THETA_V, exposures)
    copy = files[0].with_suffix(".hdr")
    shutil.copy(files[0], copy)
    assert "one of the input files" in _refused(capsys, copy, files[1], "-o", copy)


def test_other_endings_are_refused(
    capsys: pytest.CaptureFixture[str], paper: Path, tmp_path: Path
) -> None:
    assert ".exr or .hdr" in _refused(capsys, paper, "-o", tmp_path / "out.png")
    assert ".png" in _refused(
        capsys, paper, "-o", tmp_path / "out.exr", "--preview", tmp_path / "look.jpg"
    )
