"""`turnlight photo` as a user meets it: a photograph in, faces and their light out."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cli import main
from tests.unit.test_faces import portrait


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
    assert "to the sitter’s left (camera right)" in said
    assert "looks like Rembrandt (sitter's left)" in said


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


def test_nobody(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wall.png"
    assert cv2.imwrite(str(path), np.full((480, 640, 3), 140, np.uint8))
    assert main(["photo", str(path)]) == 0
    assert "There is no face" in capsys.readouterr().out
    assert main(["photo", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"faces": []}


def test_no_photograph(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "notes.jpg"
    path.write_text("no picture")
    assert main(["photo", str(path)]) == 2
    assert "notes.jpg" in capsys.readouterr().err
    assert main(["photo", str(tmp_path / "gone.jpg")]) == 2
