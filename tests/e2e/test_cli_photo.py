"""`turnlight photo` as a user meets it: a photograph in, faces and their light out."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cli import main
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.places.files.light import store_environment
from app.words.phrases.directions import SIDES
from tests.helpers.photos import photo_bytes
from tests.unit.test_faces import portrait
from tests.unit.test_facing import taken


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """A portrait under one lamp, twice as large as it is read."""
    picture = np.full((2400, 3200, 3), 120, np.uint8)
    large = cv2.resize(portrait("generic", 60.0, 40.0), (2400, 2400))
    picture[:, 400:2800] = large
    path = tmp_path / "portrait.jpg"
    assert cv2.imwrite(str(path), picture[..., ::-1])
    return path


def test_in_words(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["photo", str(photo)]) == 0
    said = capsys.readouterr().out
    assert SIDES["left"] in said
    assert "looks like Rembrandt (sitter’s left)" in said


def test_in_json(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["photo", str(photo), "--json"]) == 0
    (face,) = json.loads(capsys.readouterr().out)["faces"]
    left, top, right, bottom = face["box"]
    # In pixels of the file: from forehead to chin it is as tall as the portrait's, times its scale.
    assert bottom - top == pytest.approx(385 * 2400 / 640, rel=0.1)
    assert 400 < left < right < 2800
    assert (face["status"], face["reason"], face["key"]) == ("read", None, "front")
    assert face["key_azimuth_deg"] == pytest.approx(60, abs=12)
    assert face["key_elevation_deg"] == pytest.approx(40, abs=12)
    assert abs(face["yaw_deg"]) < 5
    assert face["styles"][0]["name"] == "left-rembrandt"


@pytest.fixture
def selfie(tmp_path: Path) -> Path:
    """The same lamp, at the sitter's left, in a mirror image; the face is at the left, too."""
    picture = np.full((900, 1400, 3), 120, np.uint8)
    picture[100:740, 700:1340] = portrait("generic", 60.0, 40.0)
    path = tmp_path / "selfie.jpg"
    lens = b"iPhone 15 front camera 2.69mm f/1.9"
    path.write_bytes(photo_bytes(np.ascontiguousarray(picture[:, ::-1]), lens=lens))
    return path


def test_mirrored_photo_has_its_key_at_the_true_side(
    selfie: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["photo", str(selfie), "--mirrored", "--json"]) == 0
    out, err = capsys.readouterr()
    facts = json.loads(out)
    (face,) = facts["faces"]
    assert facts["mirrored"] is True
    assert err == ""
    assert face["key_azimuth_deg"] == pytest.approx(60, abs=12)
    # The box is where the face is in the file.
    left, _, right, _ = face["box"]
    assert 60 < left < right < 700


def test_front_camera_without_the_switch_is_pointed_out(
    selfie: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["photo", str(selfie), "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["mirrored"] is None
    assert json.loads(out)["faces"][0]["key_azimuth_deg"] == pytest.approx(-60, abs=12)
    assert "add --mirrored" in err


@pytest.mark.parametrize(
    ("azimuth", "fired", "told"),
    [(0.0, 1, True), (0.0, 16, False), (60.0, 1, False), (0.0, None, None)],
)
def test_flash_is_told_where_it_fired_and_lights_from_the_lens(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    azimuth: float,
    fired: int | None,
    told: bool | None,
) -> None:
    path = tmp_path / "flash.jpg"
    path.write_bytes(photo_bytes(portrait("female", azimuth, 5.0), flash=fired))
    assert main(["photo", str(path), "--json"]) == 0
    (face,) = json.loads(capsys.readouterr().out)["faces"]
    assert (face["key"], face["flash"]) == ("front", told)
    assert main(["photo", str(path)]) == 0
    assert ("flash" in capsys.readouterr().out) is bool(told)


@pytest.fixture
def in_a_room(tmp_path: Path) -> Path:
    """A portrait in the demo's room, the sitter turned 71 degrees, on grey: no background shows."""
    path = tmp_path / "room.jpg"
    assert cv2.imwrite(str(path), taken("generic", "interior", 71.0)[..., ::-1])
    return path


ROOM = resources() / "demo" / "scenes" / "interior.exr"


def test_with_a_place_the_turn_is_told(in_a_room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["photo", str(in_a_room), "--place", str(ROOM), "--style", "left-split"]
    assert main([*asked, "--json"]) == 0
    (face,) = json.loads(capsys.readouterr().out)["faces"]
    assert face["turn_deg"] == pytest.approx(71, abs=10)
    assert face["style"] == "left-split"
    assert face["ratio_promised_stops"] > face["ratio_stops"]
    assert face["key_difference_deg"] < -10
    assert face["grade"] == "no"
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert "too frontal. Ratio 1.0 stops, promised " in said
    assert re.search(r"^ +Split .*: no\. ", said, re.M)


def test_the_best_style_of_a_saved_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "split.jpg"
    assert cv2.imwrite(str(path), taken("generic", "sunrise", 125.0)[..., ::-1])
    folder = tmp_path / "place"
    folder.mkdir()
    store_environment(folder, read_environment(ROOM.with_name("sunrise.exr")).radiance)
    assert main(["photo", str(path), "--place", str(folder), "--json"]) == 0
    (face,) = json.loads(capsys.readouterr().out)["faces"]
    assert (face["style"], face["in_the_light"]) == ("left-split", True)
    assert face["turn_deg"] == pytest.approx(125, abs=10)


def test_without_a_place_it_is_the_studio(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["photo", str(photo), "--style", "left-rembrandt", "--json"]) == 0
    (face,) = json.loads(capsys.readouterr().out)["faces"]
    assert face["grade"] in ("yes", "soft")
    assert (face["turn_deg"], face["in_the_light"]) == (None, None)


@pytest.mark.parametrize(
    ("more", "words"),
    [(["--style", "rembrant"], "rembrant"), (["--place", "nowhere.exr"], "nowhere.exr")],
)
def test_what_is_not_there(
    photo: Path, more: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["photo", str(photo), *more]) == 2
    assert words in capsys.readouterr().err


def test_nobody(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wall.png"
    assert cv2.imwrite(str(path), np.full((480, 640, 3), 140, np.uint8))
    assert main(["photo", str(path)]) == 0
    assert "No face" in capsys.readouterr().out
    assert main(["photo", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"faces": [], "mirrored": None}


def test_no_photograph(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "notes.jpg"
    path.write_text("no picture")
    assert main(["photo", str(path)]) == 2
    assert "notes.jpg" in capsys.readouterr().err
    assert main(["photo", str(tmp_path / "gone.jpg")]) == 2
