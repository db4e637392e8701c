"""`turnlight stitch` as a user meets it: photographs in, environment and facts or a sentence."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from app.cli import main
from app.core.base.errors import Cancelled
from app.core.base.paths import resources
from app.core.base.progress import Progress, Token, silent
from app.core.base.sphere import rotation
from app.core.environment.environment import read_environment
from app.core.measure.options import MeasureOptions
from app.core.measure.photos.measure import measure
from app.core.measure.photos.remarks import OneExposure
from app.core.places.intake import sort_out
from app.core.places.open_files import OpenOptions, make_place
from app.core.storage.settings import Settings
from benchmarks.light.stitch_photos import AXES, Taken, photographs_of, placed_off, save, take

SIZE = (480, 360)
COUNT = 9


def ring(name: str, folder: Path, bracket: Any = (0.0,), exif: bool = True) -> Taken:
    """A ring of nine of a demo place."""
    light = read_environment(resources() / "demo" / name).radiance
    light = np.asarray(cv2.resize(light, (1024, 512)), np.float32)
    ways = [rotation(40.0 * k, 4.0 * (-1) ** k, 1.0) @ AXES for k in range(COUNT)]
    return take(folder, light, ways, bracket, exif=exif, size=SIZE)


@pytest.fixture(scope="module")
def cafe(tmp_path_factory: pytest.TempPathFactory) -> Taken:
    return ring("cafe/probe.exr", tmp_path_factory.mktemp("cafe"))


@pytest.fixture(scope="module")
def yard(tmp_path_factory: pytest.TempPathFactory) -> Taken:
    return ring("location/probe-1.exr", tmp_path_factory.mktemp("yard"))


@pytest.fixture(scope="module")
def bracketed(tmp_path_factory: pytest.TempPathFactory) -> Taken:
    return ring("cafe/probe.exr", tmp_path_factory.mktemp("bracket"), (0.0, -3.0))


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main(["stitch", *map(str, words)]) == 2
    return [line for line in capsys.readouterr().err.splitlines() if "%" not in line[:4]][-1]


def test_a_ring_becomes_an_environment_that_says_what_it_lacks(
    cafe: Taken, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "place.exr"
    assert main(["stitch", str(cafe.files[0].parent), "-o", str(target), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["size"] == [2048, 1024]
    # A ring of 53 degrees tall shows at least sin(22 deg) and at most sin(31 deg) of the sphere.
    assert 0.48 < facts["blind"] < 0.62
    assert any("filled" in line for line in facts["warnings"])
    assert any("one exposure" in line for line in facts["warnings"])
    placed = facts["photographs"]
    assert [each["placed"] for each in placed] == [True] * COUNT
    assert placed[0]["azimuth_deg"] == pytest.approx(0.0, abs=0.01)
    assert placed[2]["azimuth_deg"] == pytest.approx(80.0, abs=1.0)
    assert placed[3]["elevation_deg"] == pytest.approx(-4.0, abs=1.0)
    assert placed[0]["fov_deg"] == pytest.approx(70.0, abs=1.0)
    assert {"lamps", "frames", "clipped_energy_fraction", "seconds"} <= facts.keys()
    light = read_environment(target).radiance
    assert light.shape == (1024, 2048, 3)
    assert light.min() > 0.0


def test_exposures_are_merged_and_their_drift_found(bracketed: Taken) -> None:
    found = measure(bracketed.files, MeasureOptions(), Token(), silent)
    off = np.array(found.bracket.stops) - np.array(bracketed.stops)
    assert np.abs(off - np.median(off)).max() < 0.15
    assert max(placed_off(bracketed.rotations, [p.rotation for p in photographs_of(found)])) < 0.5
    assert not any(isinstance(each, OneExposure) for each in found.warnings)


def test_drift_is_found_without_exif(tmp_path: Path) -> None:
    taken = ring("cafe/probe.exr", tmp_path, exif=False)
    found = measure(taken.files, MeasureOptions(), Token(), silent)
    off = np.array(found.bracket.stops) - np.array(taken.stops)
    assert np.abs(off - np.median(off)).max() < 0.15
    assert found.merged.cd_m2 is None


def test_a_photograph_of_elsewhere_is_named_and_left_out(
    cafe: Taken, yard: Taken, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = tmp_path / "odd.jpg"
    odd.write_bytes(yard.files[4].read_bytes())
    words = [*map(str, cafe.files), str(odd), "-o", str(tmp_path / "place.exr"), "--json"]
    assert main(["stitch", *words]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["photographs"][-1] == {
        "file": str(odd),
        "placed": False,
        "azimuth_deg": None,
        "elevation_deg": None,
        "roll_deg": None,
        "fov_deg": None,
    }
    assert any("odd.jpg" in line for line in facts["warnings"])


def test_two_places_are_told_apart(
    cafe: Taken, yard: Taken, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = []
    for number, file in enumerate(yard.files):
        other.append(tmp_path / f"YARD_{number}.jpg")
        other[-1].write_bytes(file.read_bytes())
    target = tmp_path / "place.exr"
    told = refused(capsys, *cafe.files, *other, "-o", target)
    assert "YARD" in told
    assert "IMG" in told
    assert "each place separately" in told
    assert not target.exists()


def test_what_does_not_overlap_is_refused(
    cafe: Taken, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    apart = (cafe.files[0], cafe.files[3], cafe.files[6])
    assert "overlap" in refused(capsys, *apart, "-o", tmp_path / "place.exr")


def test_too_few_and_damaged_files_are_refused(
    cafe: Taken, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "place.exr"
    assert "12–40" in refused(capsys, *cafe.files[:2], "-o", target)
    cut = tmp_path / "cut.jpg"
    cut.write_bytes(cafe.files[0].read_bytes()[:9000])
    assert "cut.jpg" in refused(capsys, cut, *cafe.files[1:], "-o", target)
    blank = tmp_path / "blank.jpg"
    save(blank, np.full((360, 480, 3), 128, np.uint8), None)
    assert "overlap" in refused(capsys, blank, blank, blank, "-o", target)
    assert not target.exists()


def test_stitching_can_be_stopped(cafe: Taken) -> None:
    token = Token()

    def stop(fraction: float, step: Progress) -> None:
        if fraction > 0.35:
            token.cancel()

    with pytest.raises(Cancelled):
        measure(cafe.files, MeasureOptions(), token, stop)


def test_in_the_window_they_are_a_place(cafe: Taken, tmp_path: Path) -> None:
    now = datetime(2026, 11, 28, tzinfo=UTC)
    chosen = sort_out([cafe.files[0].parent], "photos")
    made = make_place(chosen, OpenOptions(tmp_path, now, Settings()), Token(), silent)
    assert made.trouble is None
    assert made.place.capture is not None
    assert made.place.capture.plan == "photos"
    assert len(made.place.capture.frames) == COUNT
    assert made.light.display.shape[1] == 2 * made.light.display.shape[0]
