"""`turnlight locate` as a user meets it: a panorama and a photograph in, an angle or none out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from app.cli import main
from app.core.base.paths import resources
from app.core.localization.views import Lens, look
from tests.helpers.demo_place import demo_panorama

Bytes = NDArray[np.uint8]
PANORAMA = resources() / "demo" / "location" / "probe-1.exr"
VIEWS = resources() / "demo" / "location" / "views"


def write_jpeg(path: Path, picture: Bytes, **tags: object) -> Path:
    """A photograph with tags of EXIF."""
    spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, "uint8")
    for name, value in tags.items():
        spec.attribute(name.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out is not None
    assert out.open(str(path), spec)
    assert out.write_image(np.ascontiguousarray(picture))
    out.close()
    return path


def locate(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    assert main(["locate", *map(str, words), "--json"]) == 0
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    return values


@pytest.fixture(scope="module")
def panorama(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The place as a 360 camera's own JPEG."""
    return write_jpeg(tmp_path_factory.mktemp("place") / "r0010.jpg", demo_panorama())


@pytest.mark.slow
def test_a_view_with_the_sitter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = cv2.imread(str(VIEWS / "view-080-180.webp"))
    assert picture is not None
    photo = write_jpeg(tmp_path / "photo.jpg", np.asarray(picture[..., ::-1], np.uint8))
    for words in ((), ("--fov", "60")):
        found = locate(capsys, PANORAMA, photo, *words)
        assert found["status"] == "found"
        assert found["heading_deg"] == pytest.approx(-100.0, abs=1.0)
        assert found["pitch_deg"] == pytest.approx(0.0, abs=1.0)
        assert found["roll_deg"] == pytest.approx(0.0, abs=1.0)
        assert found["inliers"] > 20
        assert 0.9 < found["confidence"] <= 1.0
    assert found["fov_deg"] == 60.0


@pytest.mark.slow
def test_a_large_upright_photograph_by_its_exif(
    tmp_path: Path, panorama: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Stored sideways with a tag, as phones do; 26 mm on the short side are 53 deg."""
    shown = look(demo_panorama(), 70.0, Lens(53.06, (1512, 2016)), 6.0)
    stored = np.rot90(shown)
    tags = {"Orientation": 6, "Exif__FocalLengthIn35mmFilm": 26}
    photo = write_jpeg(tmp_path / "photo.jpg", np.ascontiguousarray(stored), **tags)
    found = locate(capsys, panorama, photo)
    assert found["heading_deg"] == pytest.approx(70.0, abs=0.3)
    assert found["pitch_deg"] == pytest.approx(6.0, abs=0.3)
    assert found["fov_deg"] == pytest.approx(53.06, abs=0.1)


@pytest.mark.slow
def test_a_cropped_photograph_keeps_a_wrong_focal_length(
    tmp_path: Path, panorama: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = look(demo_panorama(), -70.0, Lens(30.0, (1200, 900)))
    photo = write_jpeg(tmp_path / "photo.jpg", shown, Exif__FocalLengthIn35mmFilm=14)
    found = locate(capsys, panorama, photo)
    assert found["heading_deg"] == pytest.approx(-70.0, abs=0.5)


@pytest.mark.slow
def test_another_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo = write_jpeg(tmp_path / "p.jpg", look(demo_panorama(2), 30.0, Lens(60.0, (640, 480))))
    found = locate(capsys, resources() / "demo" / "scenes" / "studio.exr", photo)
    assert found["status"] == "unsure"
    assert found["heading_deg"] is None
    assert main(["locate", str(resources() / "demo" / "scenes" / "studio.exr"), str(photo)]) == 0
    assert capsys.readouterr().out.startswith("Unsure:")


@pytest.mark.slow
def test_the_table(tmp_path: Path, panorama: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo = write_jpeg(tmp_path / "p.jpg", look(demo_panorama(), -30.0, Lens(60.0, (640, 480))))
    assert main(["locate", str(panorama), str(photo)]) == 0
    told = capsys.readouterr()
    assert "heading            −30.0°" in told.out
    assert "Learning the background" in told.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{place}", "{none}.jpg"], "There is no file"),
        (["{none}.exr", "{photo}"], "There is no file"),
        (["{photo}", "{photo}"], "twice as wide as it is high"),
        (["{place}", "{text}"], "text.jpg"),
        (["{place}", "{photo}", "--fov", "0"], "not a field of view"),
        (["{place}", "{photo}", "--fov", "nan"], "not a field of view"),
        (["{blank}", "{photo}"], "too little detail"),
    ],
)
def test_what_is_wrong_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    photo = write_jpeg(tmp_path / "photo.jpg", np.full((300, 400, 3), 99, np.uint8))
    blank = write_jpeg(tmp_path / "blank.jpg", np.full((512, 1024, 3), 99, np.uint8))
    (tmp_path / "text.jpg").write_text("no picture")
    names = {
        "place": str(PANORAMA),
        "photo": str(photo),
        "blank": str(blank),
        "text": str(tmp_path / "text.jpg"),
        "none": str(tmp_path / "none"),
    }
    assert main(["locate", *(word.format(**names) for word in words)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert said in told.err
    assert "Traceback" not in told.err
