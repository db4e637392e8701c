"""Photographs kept with a place: whole or not at all, doubted when read, removed and restored."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.places.files import shots as places_shots
from app.core.places.files.shots import (
    SHOTS,
    Shot,
    add_shot,
    mark_shot,
    photo_of,
    purge_shots,
    read_shots,
    thumbnail_of,
)
from app.core.places.place import PlaceError
from app.core.places.remarks import PhotosLost

SHOT = Shot(
    name="IMG_1.JPG",
    added_at="2026-11-21T14:05:00+01:00",
    found=True,
    style="left-loop",
    title="Left loop",
    goal_facing_deg=96.0,
    taken_at="2026-11-21T14:03:20",
    heading_deg=-87.25,
    facing_deg=93.4,
    sitter_deg=0.65,
    fov_deg=61.0,
    focal_mm=28.0,
    confidence=0.93,
    outside_deg=0,
    match=81,
    best=82,
)
PICTURE = np.full((300, 400, 3), (200, 120, 40), np.uint8)


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    folder = tmp_path / "card"
    folder.mkdir()
    path = folder / "IMG_1.JPG"
    assert cv2.imwrite(str(path), PICTURE[..., ::-1])
    return path


@pytest.fixture
def place(tmp_path: Path) -> Path:
    folder = tmp_path / "place"
    folder.mkdir()
    return folder


def test_what_is_kept_is_what_is_read(place: Path, photo: Path) -> None:
    before = photo.read_bytes()
    kept = add_shot(place, photo, SHOT, PICTURE)
    assert kept == replace(SHOT, key="shot-0001", file="IMG_1.JPG")
    assert read_shots(place) == ((kept,), ())
    assert photo.read_bytes() == before == photo_of(place, kept).read_bytes()
    shown = thumbnail_of(place, kept)
    assert shown is not None
    assert shown.shape == (288, 384, 3)
    # sRGB, not exchanged.
    np.testing.assert_allclose(shown.mean((0, 1)), (200, 120, 40), atol=4)
    assert {each.name for each in fields(Shot)} == {*places_shots._CHECKS, "key"}


def test_the_same_photo_for_the_same_style_is_kept_once(place: Path, photo: Path) -> None:
    first = add_shot(place, photo, SHOT, PICTURE)
    again = add_shot(place, photo, replace(SHOT, match=70), PICTURE)
    other = add_shot(place, photo, replace(SHOT, style="flat", title="Flat"), PICTURE)
    assert (first.key, again.key, other.key) == ("shot-0001", "shot-0001", "shot-0002")
    assert [one.match for one in read_shots(place)[0]] == [70, 81]
    assert len(list((place / "shots" / "originals").iterdir())) == 1


def test_removed_and_brought_back_and_gone_for_good(place: Path, photo: Path) -> None:
    first = add_shot(place, photo, SHOT, PICTURE)
    second = add_shot(place, photo, replace(SHOT, style="flat"), PICTURE)
    mark_shot(place, first.key, removed=True)
    assert read_shots(place)[0] == (second,)
    mark_shot(place, first.key, removed=False)
    assert read_shots(place)[0] == (first, second)
    mark_shot(place, first.key, removed=True)
    assert purge_shots(place) == 1
    assert thumbnail_of(place, first) is None
    # The other one is of the same file.
    assert photo_of(place, second).is_file()
    mark_shot(place, second.key, removed=True)
    assert purge_shots(place) == 1
    assert not photo_of(place, second).exists()
    assert photo.is_file()
    with pytest.raises(PlaceError, match="no longer in the place"):
        mark_shot(place, first.key, removed=False)
    assert purge_shots(place) == 0


def test_a_damaged_file_gives_what_is_whole_and_is_kept(place: Path, photo: Path) -> None:
    add_shot(place, photo, SHOT, PICTURE)
    second = add_shot(place, photo, replace(SHOT, style="flat"), PICTURE)
    text = (place / SHOTS).read_text()
    (place / SHOTS).write_text(text.replace('"heading_deg":-87.25', '"heading_deg":-8725', 1))
    shots, remarks = read_shots(place)
    assert shots == (second,)
    assert len(remarks) == 1
    assert isinstance(remarks[0], PhotosLost)
    # Nothing is thrown away while something cannot be read.
    mark_shot(place, second.key, removed=True)
    assert purge_shots(place) == 0
    third = add_shot(place, photo, replace(SHOT, style="top"), PICTURE)
    assert third.key == "shot-0003"
    assert "-8725" in (place / f"{SHOTS}.bak").read_text()
    assert "-8725" in (place / SHOTS).read_text()


@pytest.mark.parametrize(
    "value",
    [
        '{"file": "../../etc/passwd"}',
        '{"file": ".hidden"}',
        '{"file": "a/b.jpg"}',
        '{"file": "a\\\\b.jpg"}',
        '{"match": 101}',
        '{"match": true}',
        '{"taken_at": "yesterday"}',
        '{"facing_deg": 1e9}',
        '{"confidence": NaN}',
        '{"found": 1}',
        "7",
        "[]",
    ],
)
def test_what_no_photo_can_be_is_left_out(place: Path, photo: Path, value: str) -> None:
    kept = add_shot(place, photo, SHOT, PICTURE)
    facts = json.loads((place / SHOTS).read_text())
    new = json.loads(value)
    facts["shot-0002"] = facts[kept.key] | new if isinstance(new, dict) else new
    (place / SHOTS).write_text(json.dumps(facts))
    shots, remarks = read_shots(place)
    assert shots == (kept,)
    assert len(remarks) == 1


def test_what_a_newer_version_wrote_is_kept(place: Path, photo: Path) -> None:
    kept = add_shot(place, photo, SHOT, PICTURE)
    facts = json.loads((place / SHOTS).read_text())
    facts[kept.key]["stars"] = 5
    facts["sorted_by"] = "match"
    (place / SHOTS).write_text(json.dumps(facts))
    mark_shot(place, kept.key, removed=True)
    facts = json.loads((place / SHOTS).read_text())
    assert (facts[kept.key]["stars"], facts["sorted_by"]) == (5, "match")
    assert facts[kept.key]["removed"] is True


@pytest.mark.parametrize("junk", [b"", b"\0" * 50, b"[1, 2]", b"{", b"\xff\xfe"])
def test_junk_is_no_list_and_no_traceback(place: Path, junk: bytes) -> None:
    (place / SHOTS).write_bytes(junk)
    shots, remarks = read_shots(place)
    assert shots == ()
    assert len(remarks) == 1
    assert purge_shots(place) == 0


def test_nothing_is_listed_when_the_disk_refuses(
    place: Path, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = add_shot(place, photo, SHOT, PICTURE)
    before = (place / SHOTS).read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", full)
        with pytest.raises(PlaceError, match="not saved"):
            add_shot(place, photo, replace(SHOT, style="flat"), PICTURE)
    assert (place / SHOTS).read_bytes() == before
    assert read_shots(place) == ((kept,), ())


def test_a_photo_that_is_gone_is_said_to_be(place: Path, photo: Path) -> None:
    photo.unlink()
    with pytest.raises(PlaceError, match="cannot be read"):
        add_shot(place, photo, SHOT, PICTURE)
    assert read_shots(place) == ((), ())


def test_a_small_picture_that_is_none(place: Path, photo: Path) -> None:
    kept = add_shot(place, photo, SHOT, PICTURE)
    small = place / "shots" / f"{kept.key}.jpg"
    small.write_bytes(b"nothing of a picture")
    assert thumbnail_of(place, kept) is None
    assert cv2.imwrite(str(small), np.zeros((900, 900, 3), np.uint8))
    assert thumbnail_of(place, kept) is None
