"""What was learnt of a panorama stays beside it: never twice, and never anything unsound."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.localization import features
from app.core.localization.features import HeadingIndex, keep_index, read_index
from app.core.places.files.originals import sweep
from app.core.places.place_folder import create_place, summarise
from app.core.places.place_list import delete_place, restore_place

NAME = "background.points"
PANORAMA: NDArray[np.uint8] = np.random.default_rng(1).integers(0, 255, (64, 128, 3), np.uint8)


@pytest.fixture
def index() -> HeadingIndex:
    chance = np.random.default_rng(2)
    descriptors = chance.random((80, 128), np.float32)
    bearings = chance.random((80, 3), np.float32)
    return HeadingIndex(descriptors, bearings, np.sort(chance.random(80, np.float32)))


def test_it_comes_back_to_the_last_bit(tmp_path: Path, index: HeadingIndex) -> None:
    assert read_index(tmp_path, PANORAMA) is None
    keep_index(tmp_path, PANORAMA, index)
    back = read_index(tmp_path, PANORAMA)
    assert back is not None
    assert np.array_equal(back.descriptors, index.descriptors)
    assert np.array_equal(back.bearings, index.bearings)
    assert np.array_equal(back.azimuths, index.azimuths)
    assert [path.name for path in tmp_path.iterdir()] == [NAME], "nothing half-written is left"


def test_another_panorama_gets_nothing_of_it(tmp_path: Path, index: HeadingIndex) -> None:
    keep_index(tmp_path, PANORAMA, index)
    other = PANORAMA.copy()
    other[30, 40, 1] ^= 1
    assert read_index(tmp_path, other) is None
    assert read_index(tmp_path, PANORAMA.reshape(128, 64, 3)) is None
    keep_index(tmp_path, other, index)
    assert read_index(tmp_path, other) is not None
    assert read_index(tmp_path, PANORAMA) is None, "there is one, for the panorama of the place"


def test_whatever_is_damaged_is_learnt_again(
    tmp_path: Path, index: HeadingIndex, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_index(tmp_path, PANORAMA, index)
    path = tmp_path / NAME
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 1
    for data in (b"", whole[:-1], whole[: len(whole) // 2], bytes(flipped), whole + b"x" * 528):
        path.write_bytes(data)
        assert read_index(tmp_path, PANORAMA) is None
    path.write_bytes(whole)
    assert read_index(tmp_path, PANORAMA) is not None
    # Another way of describing points has another name for its files.
    monkeypatch.setattr(features, "_FORM", b"another form")
    assert read_index(tmp_path, PANORAMA) is None


def test_a_sealed_file_must_hold_numbers_too(tmp_path: Path, index: HeadingIndex) -> None:
    index.descriptors[3, 7] = np.nan
    keep_index(tmp_path, PANORAMA, index)
    assert (tmp_path / NAME).exists()
    assert read_index(tmp_path, PANORAMA) is None


def test_no_more_is_read_or_written_than_there_can_be(
    tmp_path: Path, index: HeadingIndex, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_index(tmp_path, PANORAMA, index)
    monkeypatch.setattr(features, "_MOST_POINTS", 79)
    assert read_index(tmp_path, PANORAMA) is None
    (tmp_path / NAME).unlink()
    keep_index(tmp_path, PANORAMA, index)
    assert not (tmp_path / NAME).exists()


def test_a_place_that_cannot_be_written_to_is_no_trouble(
    tmp_path: Path, index: HeadingIndex
) -> None:
    keep_index(tmp_path / "gone", PANORAMA, index)
    (tmp_path / NAME).mkdir()
    keep_index(tmp_path, PANORAMA, index)
    assert read_index(tmp_path, PANORAMA) is None


def test_it_goes_where_its_place_goes(tmp_path: Path, index: HeadingIndex) -> None:
    root = tmp_path / "places"
    folder = create_place(root, "Yard", datetime(2026, 5, 4, 17, 5, tzinfo=UTC))
    before = summarise(folder)
    keep_index(folder, PANORAMA, index)
    assert summarise(folder) == before, "no list shows anything of it"
    copy = tmp_path / "places" / "copy"
    shutil.copytree(folder, copy)
    assert read_index(copy, PANORAMA) is not None
    trashed = delete_place(folder)
    assert not folder.exists()
    assert read_index(trashed, PANORAMA) is not None
    assert read_index(restore_place(trashed), PANORAMA) is not None
    (root / "other").mkdir()
    keep_index(root / "other", PANORAMA, index)
    assert summarise(root / "other") is None, "it makes no folder a place"


def test_what_a_killed_write_left_is_swept(tmp_path: Path) -> None:
    half = tmp_path / ".background-a1b2c3d4.points"
    half.write_bytes(b"half")
    sweep(tmp_path, half.stat().st_mtime + 10.0)
    assert half.exists()
    sweep(tmp_path, half.stat().st_mtime + 4000.0)
    assert not half.exists()
