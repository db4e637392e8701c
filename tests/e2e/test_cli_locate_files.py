"""`turnlight locate` with photographs as they come from phones and from disks."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.cli import main
from app.commands import locate as command
from app.core.localization.features import HeadingIndex
from app.core.localization.views import Lens, look
from tests.helpers.cases import sample_first
from tests.helpers.demo_place import demo_panorama
from tests.helpers.photos import demo_index, photo_bytes

Bytes = NDArray[np.uint8]
AT_DEG = 95.0
TILT_DEG = 5.0
LENS = Lens(60.0, (1200, 900))
FOCAL_MM = 30  # 60 degrees of a picture of 4 : 3


@cache
def seen() -> Bytes:
    """What a phone sees of the demo location, upright."""
    return look(demo_panorama(), AT_DEG, LENS, TILT_DEG)


@pytest.fixture(autouse=True)
def learnt_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def known(*_: object, **__: object) -> HeadingIndex:
        return demo_index()

    monkeypatch.setattr(command, "build_index", known)
    monkeypatch.setattr(command, "read_shown_panorama", lambda _: None)


def located(capsys: pytest.CaptureFixture[str], photo: Path, *words: str) -> dict[str, Any]:
    assert main(["locate", "place.exr", str(photo), *words, "--json"]) == 0
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    return values


def refused(capsys: pytest.CaptureFixture[str], photo: Path) -> str:
    assert main(["locate", "place.exr", str(photo)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "Traceback" not in told.err
    return told.err


def check(found: dict[str, Any], within_deg: float = 0.3) -> None:
    assert found["status"] == "found"
    assert found["heading_deg"] == pytest.approx(AT_DEG, abs=within_deg)
    assert found["pitch_deg"] == pytest.approx(TILT_DEG, abs=2.0 * within_deg)
    assert found["roll_deg"] == pytest.approx(0.0, abs=2.0 * within_deg)


@pytest.mark.slow
@pytest.mark.parametrize("orientation", sample_first([6, 3, 1, 2, 4, 5, 7, 8], 1))
def test_whichever_way_it_is_stored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], orientation: int
) -> None:
    photo = tmp_path / "photo.jpg"
    photo.write_bytes(photo_bytes(seen(), orientation, FOCAL_MM))
    found = located(capsys, photo)
    check(found)
    assert found["fov_deg"] == pytest.approx(60.0, abs=0.2)
    assert not found["mirrored"]


@pytest.mark.slow
@pytest.mark.parametrize("orientation", sample_first([6, 1], 1))
def test_an_upright_phone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], orientation: int
) -> None:
    """12 megapixels, 72 deg along the long side, whether the tag or the pixels are turned."""
    lens = Lens(2 * np.degrees(np.arctan(np.tan(np.radians(36.0)) * 0.75)), (3024, 4032))
    picture = look(demo_panorama(), AT_DEG, lens, TILT_DEG)
    photo = tmp_path / "photo.jpg"
    photo.write_bytes(photo_bytes(picture, orientation, 24))
    check(located(capsys, photo))
    photo.write_bytes(photo_bytes(picture, orientation, None))
    check(located(capsys, photo), 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("focal_mm", sample_first([None, 77, 13, 26], 1))
def test_the_focal_length_is_only_a_hint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], focal_mm: int | None
) -> None:
    """Digital zoom, a crop, the wrong lens: what EXIF says is tried, and then nothing."""
    photo = tmp_path / "photo.jpg"
    photo.write_bytes(photo_bytes(seen(), 1, focal_mm))
    check(located(capsys, photo), 0.5)


@pytest.mark.slow
def test_a_mirrored_selfie(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo = tmp_path / "selfie.jpg"
    tilted = look(demo_panorama(), AT_DEG, LENS, TILT_DEG)
    photo.write_bytes(photo_bytes(np.ascontiguousarray(tilted[:, ::-1]), 1, FOCAL_MM))
    found = located(capsys, photo)
    check(found)
    assert found["mirrored"]
    assert main(["locate", "place.exr", str(photo)]) == 0
    assert "mirrored" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    sample_first(["16.tif", "webp", "alpha.png", "grey.jpg", "grey.png", "16.png"], 1),
)
def test_other_kinds(tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str) -> None:
    stored: Any = np.ascontiguousarray(seen()[..., ::-1])
    if kind.startswith("grey"):
        stored = cv2.cvtColor(stored, cv2.COLOR_BGR2GRAY)
    elif kind.startswith("alpha"):
        stored = cv2.cvtColor(stored, cv2.COLOR_BGR2BGRA)
    elif kind.startswith("16"):
        stored = stored.astype(np.uint16) * 257
    photo = tmp_path / f"photo.{kind}"
    assert cv2.imwrite(str(photo), stored)
    check(located(capsys, photo), 0.5)


@pytest.mark.slow
def test_fifty_megapixels(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    large = cv2.resize(seen(), (8160, 6120), interpolation=cv2.INTER_LINEAR)
    photo = tmp_path / "photo.jpg"
    photo.write_bytes(photo_bytes(np.asarray(large, np.uint8), 1, FOCAL_MM))
    check(located(capsys, photo))


@pytest.mark.parametrize("brand", [b"heic", b"mif1", b"avif"])
def test_the_pictures_of_iphones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], brand: bytes
) -> None:
    photo = tmp_path / "IMG_0001.HEIC"
    photo.write_bytes(b"\0\0\0\x24ftyp" + brand + b"\0\0\0\0mif1heic" + bytes(500))
    told = refused(capsys, photo)
    assert "IMG_0001.HEIC" in told
    assert "Most Compatible" in told


def test_what_is_too_small_or_cut_off(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = photo_bytes(seen())
    photo = tmp_path / "photo.jpg"
    for share in (0.02, 0.3, 0.9):
        photo.write_bytes(whole[: round(len(whole) * share)])
        assert "photo.jpg is damaged" in refused(capsys, photo)
    small = np.ascontiguousarray(seen()[:150, :150])
    photo.write_bytes(photo_bytes(small))
    assert "150 x 150 pixels" in refused(capsys, photo)
    photo.write_bytes(photo_bytes(small[:8, :8]))
    assert "8 x 8 pixels" in refused(capsys, photo)
