"""``turnlight lamp`` from files of a dark room to the library and the trash."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app import cli
from app.core.base.imaging.images import write_exr
from tests.helpers.dark_room import bracket, phone, room


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def call(capsys: pytest.CaptureFixture[str], *words: str) -> Any:
    assert cli.main(["lamp", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_from_a_dark_room_to_the_trash(
    tmp_path: Path, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    light, _ = room(phone(0.3, 60.0), 0.05, shape=(256, 512))
    files = [str(file) for file in bracket(tmp_path / "shots", light, 600.0)]
    kept = call(capsys, "add", "My phone", *files, "--distance", "0.3")
    assert kept["name"] == "my-phone"
    assert kept["distance_m"] == 0.3
    # 600 cd/m2 on 7 x 15 cm at 30 cm, by the formula for a rectangle opposite.
    assert kept["lux"] == pytest.approx(66.7, rel=0.04)
    assert kept["azimuth_deg"] == pytest.approx(60.0, abs=0.5)
    assert call(capsys, "list")["lamps"][0]["lux"] == pytest.approx(kept["lux"])
    half = call(capsys, "mask", "my-phone", "--clear", "box:60,90,-90,90")
    assert half["solid_angle_sr"] == pytest.approx(kept["solid_angle_sr"] / 2.0, rel=0.1)
    gone = call(capsys, "remove", "my-phone")
    assert Path(gone["trash"]).is_relative_to(home / "lamps")
    assert call(capsys, "list") == {"lamps": [], "damaged": []}


def test_what_was_said_of_a_lamp_is_corrected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    light, _ = room(phone(0.3, 60.0), 0.05, shape=(128, 256))
    path = tmp_path / "lamp.exr"
    write_exr(path, light)
    kept = call(capsys, "add", "P", str(path))
    assert kept["lux"] is None
    assert kept["distance_m"] is None
    changed = call(capsys, "change", "p", "--title", "Phone", "--distance", "0.3", "--lux", "66")
    assert (changed["name"], changed["title"], changed["distance_m"]) == ("p", "Phone", 0.3)
    assert changed["lux"] == pytest.approx(66.0)
    assert call(capsys, "list")["lamps"][0]["title"] == "Phone"
    for words in ((), ("--distance", "far"), ("--distance", "900"), ("--lux", "-1")):
        assert cli.main(["lamp", "change", "p", *words]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert call(capsys, "list")["lamps"][0]["distance_m"] == 0.3


def test_tables_and_the_guide(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["lamp", "guide"]) == 0
    assert "dark" in capsys.readouterr().out
    assert cli.main(["lamp", "list"]) == 0
    assert "No lamps yet." in capsys.readouterr().out
    light, _ = room(phone(0.3), 0.02, shape=(128, 256))
    assert cli.main(["lamp", "add", "P", *map(str, bracket(tmp_path, light, 600.0))]) == 0
    told = capsys.readouterr()
    assert "lux" in told.out
    assert "--distance" in told.err


@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied"), NotADirectoryError()])
def test_a_folder_of_lamps_that_cannot_be_read_is_said(
    error: OSError,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = tmp_path / "home" / "lamps"
    listdir = os.listdir

    def refused(path: Any) -> list[str]:
        if Path(path) == folder:
            raise error
        return listdir(path)

    monkeypatch.setenv("TURNLIGHT_HOME", str(folder.parent))
    monkeypatch.setattr(os, "listdir", refused)
    assert cli.main(["lamp", "list"]) == 0
    why = error.strerror or "NotADirectoryError"
    said = capsys.readouterr().out
    assert said == f"{folder}: The folder cannot be read: {why.lower()}.\n"


def test_exposures_without_iso_ask_for_a_meter(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    light, _ = room(phone(0.3), 0.02, shape=(128, 256))
    silent = tmp_path / "silent"
    edits = [lambda tags: replace(tags, iso=None, aperture=None)] * 4
    files = [str(file) for file in bracket(silent, light, 600.0, edits=edits)]
    kept = call(capsys, "add", "P", *files, "--distance", "0.3")
    assert kept["lux"] is None
    assert any("The brightness of “P”" in words for words in kept["warnings"])
    metered = call(capsys, "add", "P", *files, "--distance", "0.3", "--lux", "64")
    assert metered["lux"] == pytest.approx(64.0)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["add", "P", "missing.jpg"], "missing.jpg"),
        (["add", "P", "missing.exr"], "no file"),
        (["remove", "nothing"], "There is no lamp 'nothing'"),
        (["mask", "nothing", "--clear", "nadir:-10"], "There is no lamp"),
        (["add", "P", "a.jpg", "--set", "lamp.png"], "corrected with boxes"),
        (["add", "P", "a.jpg", "--clear", "nadir:-10"], "corrected with boxes"),
        (["add", "P", "a.jpg", "--distance", "near"], "not a distance"),
        (["add", "P", "a.jpg", "--distance", "1e300"], "cannot be used"),
        (["add", "P", "a.jpg", "--lux", "-3"], "not an illuminance"),
        ([], "ACTION"),
    ],
)
def test_bad_wishes_end_in_one_sentence(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["lamp", *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert "Traceback" not in told
