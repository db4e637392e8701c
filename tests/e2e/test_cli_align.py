"""`turnlight align`: known turns, files of every kind, and what it says of bad ones."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.cli import main
from app.commands import align as command
from app.core.base.imaging.image_input import upright
from app.core.localization.picture_file import read_picture
from app.core.localization.views import Lens, look
from tests.helpers.demo_place import demo_panorama
from tests.helpers.lens_matrix import lens_matrix

Bytes = NDArray[np.uint8]
LENS: Final = Lens(60.0, (640, 480))
KEYS: Final = {"status", "homography", "inliers", "overlap", "turn_error_deg"}
INVERSE: Final = {1: 1, 2: 2, 3: 3, 4: 4, 5: 5, 6: 8, 7: 7, 8: 6}


def save(path: Path, picture: Bytes, orientation: int = 1, focal_mm: int = 0) -> Path:
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, "uint8")
    spec.attribute("Orientation", orientation)
    spec.attribute("CompressionQuality", 95)
    if focal_mm:
        spec.attribute("Exif:FocalLengthIn35mmFilm", focal_mm)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    assert output.write_image(np.ascontiguousarray(picture))
    output.close()
    return path


@pytest.fixture(autouse=True)
def nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "find_sitter", lambda *_, **__: None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The goal at azimuth 100, and views of it from azimuth 88 and from behind."""
    path = tmp_path_factory.mktemp("align")
    save(path / "target.png", look(demo_panorama(), 100.0, LENS))
    save(path / "view.jpg", look(demo_panorama(), 88.0, LENS))
    save(path / "behind.png", look(demo_panorama(), -80.0, LENS))
    return path


def asked(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    assert main(["align", *map(str, words), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert set(answer) >= KEYS
    assert isinstance(answer, dict)
    return answer


def truth(azimuth_deg: float, lens: Lens = LENS) -> NDArray[np.float64]:
    a = np.radians(azimuth_deg)
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    return np.asarray(lens_matrix(LENS) @ turn @ np.linalg.inv(lens_matrix(lens)))


def place(matrix: Any, x: float, y: float) -> NDArray[np.float64]:
    point = np.array(matrix) @ [x, y, 1.0]
    return np.asarray(point[:2] / point[2])


def test_view_pixels_go_to_target_pixels(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The goal is 12 deg further clockwise: the error is positive, the view lies to the left."""
    answer = asked(capsys, folder / "target.png", folder / "view.jpg")
    assert answer["status"] == "found"
    assert answer["turn_error_deg"] == pytest.approx(12.0, abs=0.2)
    assert answer["overlap"] == pytest.approx(0.8, abs=0.05)
    assert answer["inliers"] >= 20
    for x, y in ((320.0, 240.0), (400.0, 100.0), (500.0, 400.0)):
        expected = place(truth(-12.0), x, y)
        assert place(answer["homography"], x, y) == pytest.approx(expected, abs=2.0)
    back = asked(capsys, folder / "view.jpg", folder / "target.png")
    assert back["turn_error_deg"] == pytest.approx(-12.0, abs=0.2)


def test_the_table_and_the_overlay(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    overlay = tmp_path / "over.png"
    words = [str(folder / "target.png"), str(folder / "view.jpg"), "-o", str(overlay)]
    assert main(["align", *words, "--opacity", "100"]) == 0
    out = capsys.readouterr().out
    assert "° clockwise" in out
    assert str(overlay) in out
    laid, target = read_picture(overlay).picture, read_picture(folder / "target.png").picture
    assert laid.shape == target.shape
    away = np.abs(laid.astype(int) - target).mean(axis=2)
    # Right of the view's edge the target is untouched; where both are, they agree.
    assert away[:, 560:].max() == 0
    assert np.median(away[100:380, 40:400]) < 6.0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["over.png"]


def test_unsure_is_an_answer_and_writes_nothing(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    overlay = tmp_path / "over.png"
    answer = asked(capsys, folder / "target.png", folder / "behind.png", "-o", overlay)
    assert answer["status"] == "unsure"
    assert answer["homography"] is None
    assert answer["turn_error_deg"] is None
    assert answer["overlay"] is None
    assert not list(tmp_path.iterdir())
    assert main(["align", str(folder / "target.png"), str(folder / "behind.png")]) == 0
    assert "Unsure" in capsys.readouterr().out


@pytest.mark.parametrize("orientation", range(1, 9))
def test_every_orientation_is_turned_upright(
    folder: Path, tmp_path: Path, orientation: int, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = look(demo_panorama(), 88.0, LENS)
    stored = upright(picture, INVERSE[orientation])
    assert (stored.shape == picture.shape) == (orientation < 5)
    path = save(tmp_path / "turned.jpg", stored, orientation)
    answer = asked(capsys, folder / "target.png", path)
    assert answer["turn_error_deg"] == pytest.approx(12.0, abs=0.2)


def test_other_sizes_and_fields(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A larger and wider view; its pixels are those of the file. 26 mm: 69 deg of a 4:3 picture."""
    lens = Lens(69.4, (1600, 1200))
    path = save(tmp_path / "large.jpg", look(demo_panorama(), 95.0, lens), focal_mm=25)
    answer = asked(capsys, folder / "target.png", path, "--fov", 60)
    assert answer["turn_error_deg"] == pytest.approx(5.0, abs=0.2)
    expected = place(truth(-5.0, lens), 800.0, 600.0)
    assert place(answer["homography"], 800.0, 600.0) == pytest.approx(expected, abs=2.0)
    assert read_picture(path).fov_deg == pytest.approx(69.4, abs=0.1)
    assert read_picture(folder / "view.jpg").fov_deg is None
    twice = asked(capsys, folder / "target.png", folder / "view.jpg", "--fov", 30)
    assert twice["turn_error_deg"] == pytest.approx(5.6, abs=0.2)


@pytest.mark.parametrize("kind", ["webp", "tif", "grey.png", "alpha.png", "16.png"])
def test_other_kinds_of_files(
    folder: Path, tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = np.ascontiguousarray(look(demo_panorama(), 88.0, LENS)[..., ::-1])
    stored: Any = picture
    if kind == "grey.png":
        stored = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    elif kind == "alpha.png":
        stored = cv2.cvtColor(picture, cv2.COLOR_BGR2BGRA)
    elif kind == "16.png":
        stored = picture.astype(np.uint16) * 257
    assert cv2.imwrite(str(tmp_path / f"view.{kind}"), stored)
    answer = asked(capsys, folder / "target.png", tmp_path / f"view.{kind}")
    assert answer["turn_error_deg"] == pytest.approx(12.0, abs=0.2)


def test_the_sitter_beside_the_axis(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from app.core.localization.sitter import Sitter

    column = 0.5 + 0.5 * np.tan(np.radians(12.0)) / np.tan(np.radians(30.0))
    sitter = Sitter(float(column), 12.0, (column - 0.05, 0.4, column + 0.05, 0.6))
    monkeypatch.setattr(command, "find_sitter", lambda *_, **__: sitter)
    answer = asked(capsys, folder / "target.png", folder / "view.jpg")
    assert answer["turn_error_deg"] == pytest.approx(0.0, abs=0.2)
    assert answer["sitter_deg"] == 12.0


def bad_files(folder: Path, tmp_path: Path) -> dict[str, Path]:
    whole = (folder / "view.jpg").read_bytes()
    made = {
        "empty.jpg": b"",
        "words.jpg": b"This is no picture." * 50,
        "half.jpg": whole[: len(whole) // 3],
        "head.png": (folder / "target.png").read_bytes()[:60],
        "lie.png": (folder / "target.png").read_bytes()[:16] + b"\xff" * 8 + b"\0" * 200,
    }
    for name, data in made.items():
        (tmp_path / name).write_bytes(data)
    small = np.zeros((20, 30, 3), np.uint8)
    assert cv2.imwrite(str(tmp_path / "small.png"), small)
    assert cv2.imwrite(str(tmp_path / "light.hdr"), np.ones((64, 64, 3), np.float32))
    return {name: tmp_path / name for name in (*made, "small.png", "light.hdr", "none.jpg", ".")}


NAMES: Final = [
    "empty.jpg",
    "words.jpg",
    "half.jpg",
    "head.png",
    "lie.png",
    "small.png",
    "light.hdr",
    "none.jpg",
    ".",
]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("first", [True, False])
def test_bad_files_end_in_a_sentence(
    folder: Path, tmp_path: Path, name: str, first: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    bad, good = bad_files(folder, tmp_path)[name], folder / "view.jpg"
    words = (bad, good) if first else (good, bad)
    overlay = tmp_path / "over.png"
    assert main(["align", *map(str, words), "-o", str(overlay)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("turnlight: ")
    assert "Traceback" not in said.err
    assert not overlay.exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_not_waited_for(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe.jpg")
    assert main(["align", str(folder / "view.jpg"), str(tmp_path / "pipe.jpg")]) == 2
    assert "not a picture file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--fov", "0"), "--fov"),
        (("--fov", "nan"), "--fov"),
        (("--view-fov", "190"), "--view-fov"),
        (("--opacity", "120"), "--opacity"),
        (("--opacity", "nan"), "--opacity"),
        (("-o", "over.jpg"), "overlays are .png"),
        (("-o", "missing/over.png"), "does not exist"),
    ],
)
def test_bad_words(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    both = [str(folder / "target.png"), str(folder / "view.jpg")]
    assert main(["align", *both, *words]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_never_over_an_input(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "target.png"
    target.write_bytes((folder / "target.png").read_bytes())
    link = tmp_path / "link.png"
    link.symlink_to(target)
    for output in (target, link):
        assert main(["align", str(target), str(folder / "view.jpg"), "-o", str(output)]) == 2
        assert "one of the input files" in capsys.readouterr().err
        assert main(["align", str(folder / "view.jpg"), str(target), "-o", str(output)]) == 2
    assert target.read_bytes() == (folder / "target.png").read_bytes()
