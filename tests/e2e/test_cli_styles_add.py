"""`turnlight styles add` as a user meets it: a portrait in, a style of one's own out."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cli import main
from app.core.base.paths import resources
from app.core.painting.user_styles import list_user_styles
from app.words.phrases.directions import SIDES
from tests.unit.test_faces import portrait


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    path = tmp_path / "Grandma.png"
    assert cv2.imwrite(str(path), portrait("female", -55.0, 25.0)[..., ::-1])
    return path


def styles(home: Path) -> list[str]:
    found, damaged = list_user_styles(home / "home" / "styles")
    assert damaged == ()
    return [style.title for style in found]


def test_json(photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["styles", "add", "--from", str(photo), "--json"]) == 0
    style = json.loads(capsys.readouterr().out)["style"]
    assert (style["name"], style["title"], style["side"]) == (
        "like-grandma",
        "Like Grandma",
        "right",
    )
    assert style["lamps"][0]["azimuth_deg"] == pytest.approx(-55, abs=12)
    assert style["lamps"][0]["elevation_deg"] == pytest.approx(25, abs=12)
    assert styles(tmp_path) == ["Like Grandma"]


def test_words_and_a_title_of_its_own(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["styles", "add", "--from", str(photo)]) == 0
    assert main(["styles", "add", "--from", str(photo)]) == 0
    assert main(["styles", "add", "--from", str(photo), "--title", "Window"]) == 0
    said = capsys.readouterr().out
    assert "“Like Grandma 2”" in said
    assert SIDES["right"] in said
    assert sorted(styles(tmp_path)) == ["Like Grandma", "Like Grandma 2", "Window"]


def test_what_cannot_be_read_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wall, behind = tmp_path / "wall.png", tmp_path / "behind.png"
    assert cv2.imwrite(str(wall), np.full((480, 640, 3), 140, np.uint8))
    assert cv2.imwrite(str(behind), portrait("generic", 115.0, 15.0)[..., ::-1])
    for path, words in ((wall, "No face"), (behind, "comes from behind")):
        assert main(["styles", "add", "--from", str(path)]) == 2
        assert words in capsys.readouterr().err
    assert styles(tmp_path) == []


def test_it_is_solved_by_its_name(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["styles", "add", "--from", str(photo), "--json"]) == 0
    name = json.loads(capsys.readouterr().out)["style"]["name"]
    room = resources() / "demo" / "scenes" / "interior.exr"
    assert main(["solve", str(room), "--style", name, "left-loop", "--json"]) == 0
    built_in, own = json.loads(capsys.readouterr().out)["styles"]
    assert (built_in["name"], own["name"]) == ("left-loop", name)
    assert own["grade"] is None
    assert len(own["match_curve"]) == 64
    assert own["match"] > 60
    assert main(["solve", str(room), "--style", name]) == 0
    assert "Like " in capsys.readouterr().out
    sheet = tmp_path / "sheet.png"
    assert main(["solve", str(room), "--style", name, "--sheet", str(sheet)]) == 2
    assert "built-in styles only" in capsys.readouterr().err
    assert not sheet.exists()
    assert main(["solve", str(room), "--style", "like-nobody"]) == 2


def test_the_list_is_as_before(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["styles", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["styles"][0]["name"] == "butterfly"
