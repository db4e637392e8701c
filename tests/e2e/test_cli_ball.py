"""`turnlight ball` as a user meets it: photographs of a mirror ball in, an environment out."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.core.base.angles import difference
from app.core.base.progress import Token, silent
from app.core.environment.environment import read_environment
from app.core.measure.ball.mirror_ball import panorama_rows
from app.core.places.intake import sort_out
from app.core.places.open_files import OpenOptions, make_place
from app.core.storage.settings import Settings
from app.words.remarks import sentences
from tests.helpers.mirror_ball import place, traced, write_bracket

SIZE = (500, 750)
STOPS = (2.0, -1.0, -4.0)

pytestmark = pytest.mark.usefixtures("qapp")


@pytest.fixture(scope="module")
def white() -> np.ndarray:
    """The place with white lamps only, so that they are named in the order of their light."""
    made = place().copy()
    made[made.max(axis=-1) > 50.0] = 60.0
    return made


@pytest.fixture(scope="module")
def front(white: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bracket from the photographer's place."""
    folder = tmp_path_factory.mktemp("front")
    write_bracket(folder, traced(white, SIZE, 85.0) / np.float32(4.0), stops=STOPS)
    return folder


@pytest.fixture(scope="module")
def side(white: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bracket from 90 degrees clockwise of it."""
    folder = tmp_path_factory.mktemp("side")
    light = traced(white, SIZE, 85.0, azimuth_deg=90.0) / np.float32(4.0)
    write_bracket(folder, light, stops=STOPS)
    return folder


def test_one_side_says_what_merge_says_and_what_is_blind(
    front: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "place.exr"
    assert main(["ball", str(front), "-o", str(target), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    rows = panorama_rows(facts["ball"]["width_px"] / 2.0)
    assert read_environment(target).shape == (rows, 2 * rows)
    assert {"response", "clipped_energy_fraction", "warnings", "seconds"} <= facts.keys()
    # Behind the ball: its last pixels, some 20 degrees across; and the photographer.
    assert 0.02 < facts["blind"] < 0.08
    assert any("is hidden behind the ball" in note for note in facts["notes"])
    assert any("gaps were twice as bright" in line for line in facts["advice"])
    found = [(lamp["azimuth_deg"], lamp["elevation_deg"]) for lamp in facts["lamps"]]
    for azimuth, elevation in ((60.0, 20.0), (-100.0, -15.0), (-35.0, 55.0)):
        near = [abs(difference(a, azimuth)) < 3.0 and abs(e - elevation) < 3.0 for a, e in found]
        assert any(near), (azimuth, elevation, found)


@pytest.mark.parametrize("told", [["--from", "84"], []])
def test_two_sides_leave_hardly_anything_blind(
    told: list[str], front: Path, side: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "place.exr"
    words = ["ball", str(front), "--second", str(side), *told, "-o", str(target), "--json"]
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["blind"] < 0.005


def test_what_cannot_be_measured_is_said(
    front: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "place.exr"
    plain = np.tile(np.linspace(0.05, 0.5, 300, dtype=np.float32)[:, None], (200, 1, 3))
    write_bracket(tmp_path / "none", plain, stops=STOPS)
    two = traced(place(), SIZE, 60.0, balls=((-0.15, 0.0, 0.0), (0.15, 0.0, 0.0)), samples=1)
    write_bracket(tmp_path / "two", two / np.float32(4.0), stops=STOPS)
    for words, said in (
        ([tmp_path / "none"], "No mirror ball"),
        ([tmp_path / "two"], "2 mirror balls"),
        ([front, "--second", front], "from another side"),
        ([front, "--from", "90"], "--second"),
        ([front, "--second", front, "--from", "180"], "from another side"),
        ([front, "--reflectance", "2"], "--reflectance"),
        ([front, "--pitch", "-80"], "--pitch"),
    ):
        assert main(["ball", *map(str, words), "-o", str(target)]) == 2
        assert said in capsys.readouterr().err
        assert not target.exists()


def test_two_folders_dropped_on_the_window_are_two_sides(
    front: Path, side: Path, tmp_path: Path
) -> None:
    intake = sort_out([side, front], "ball")
    assert intake.own is not None
    assert [len(one) for one in (intake.files, intake.own.more_files)] == [len(STOPS)] * 2
    assert {file.parent for file in intake.own.more_files} == {side}
    now = datetime(2026, 6, 1, 12, tzinfo=UTC)
    opened = make_place(intake, OpenOptions(tmp_path, now, Settings()), Token(), silent)
    assert opened.place.capture is not None
    assert opened.place.capture.plan == "ball"
    assert any("0.0% of the sphere" in note for note in sentences(opened.place.capture.notes))
    assert opened.folder is not None
    assert len(list((opened.folder / "originals").iterdir())) == 2 * len(STOPS)
