"""Files whose names are not text are read and written as others are."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cli import main
from app.core.base.imaging.image_input import open_image, read_picture
from app.core.base.imaging.images import write_exr, write_png
from app.core.base.native import native_path, path_from_library, path_in_url, url_of
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.localization.picture_file import read_picture as read_photo
from app.core.measure.film.frames import film_frames
from app.devices.clock import VirtualClock
from app.devices.webcam.files import FilmWriter, VideoFile

ROOT = Path(__file__).resolve().parents[2]
SCENE = resources() / "demo" / "scenes" / "studio.exr"

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere every name of a file is text")
NAMES = [b"caf\xe9", b"\xff\xfe", b"\xed\xb3\xa9", "ışık 写真".encode(), b"a?b=c&d", b"%04d %s"]


def odd(folder: Path, name: bytes, ending: str = "") -> Path:
    return folder / os.fsdecode(name + ending.encode())


def write_film(path: Path) -> Path:
    with FilmWriter(path, 10.0) as writer:
        for shade in range(0, 200, 20):
            writer.add(np.full((48, 64, 3), shade, np.uint8))
    return path


def test_plain_names_are_given_as_they_are(tmp_path: Path) -> None:
    for name in ("a.mp4", "ışık.exr", "写真"):
        assert native_path(tmp_path / name) == str(tmp_path / name)
    assert native_path("relative.png") == "relative.png"


@LINUX
@pytest.mark.parametrize("name", NAMES[:3])
def test_odd_name_becomes_a_plain_one_of_the_same_file(tmp_path: Path, name: bytes) -> None:
    path = odd(tmp_path, name, ".jpg")
    path.write_bytes(b"content")
    plain = native_path(path)
    assert plain.isascii()
    assert plain.endswith(".jpg")
    assert Path(plain).read_bytes() == b"content"
    assert native_path(path) == plain


@LINUX
def test_file_to_write_in_an_odd_folder_has_a_plain_name(tmp_path: Path) -> None:
    folder = odd(tmp_path, b"f\xff")
    folder.mkdir()
    Path(native_path(folder / "new.txt")).write_text("new")
    assert (folder / "new.txt").read_text() == "new"


@LINUX
def test_links_go_when_the_program_ends(tmp_path: Path) -> None:
    code = (
        "import os; from app.core.base.native import native_path;"
        f"print(native_path({os.fspath(tmp_path)!r} + '/\\udcff'))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith(str(tmp_path))
    assert list(tmp_path.iterdir()) == []


@LINUX
def test_name_is_refused_where_no_link_can_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(1, "no links here")

    monkeypatch.setattr("os.symlink", refuse)
    path = odd(tmp_path, b"no\xfflink", ".exr")
    shutil.copy(SCENE, path)
    with pytest.raises(OSError, match="not UTF-8"):
        native_path(path)
    assert open_image(path) is None
    assert main(["solve", str(path)]) == 2


@LINUX
@pytest.mark.parametrize("name", NAMES)
def test_film_of_any_name_is_read(tmp_path: Path, name: bytes) -> None:
    folder = odd(tmp_path, b"in " + name)
    folder.mkdir()
    path = write_film(odd(folder, name, ".mp4"))
    frames = [picture for _, _, picture in film_frames(path, 5, 64)]
    assert len(frames) == 5
    assert frames[-1].mean() > frames[0].mean() + 100
    video = VideoFile(path, VirtualClock(0.0))
    video.connect()
    picture = video.read()
    video.disconnect()
    assert picture is not None
    assert picture.shape == (48, 64, 3)


@LINUX
@pytest.mark.parametrize("name", NAMES)
def test_pictures_of_any_name_are_written_and_read(tmp_path: Path, name: bytes) -> None:
    folder = odd(tmp_path, b"in " + name)
    folder.mkdir()
    picture = np.full((32, 64, 3), 90, np.uint8)
    write_png(odd(folder, name, ".png"), picture)
    again = read_picture(odd(folder, name, ".png"), 1 << 20, 1 << 20)
    assert again is not None
    assert np.array_equal(again, picture)
    assert read_photo(odd(folder, name, ".png")) is not None
    light = np.random.default_rng(3).random((32, 64, 3)).astype(np.float32) + 0.1
    write_exr(odd(folder, name, ".exr"), light)
    assert np.allclose(read_environment(odd(folder, name, ".exr")).radiance, light, rtol=1e-2)


@LINUX
@pytest.mark.parametrize("name", NAMES[:2])
def test_commands_take_files_of_any_name(
    tmp_path: Path, name: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    path, sheet = odd(tmp_path, name, ".exr"), odd(tmp_path, name, ".png")
    shutil.copy(SCENE, path)
    assert main(["solve", str(path), "--style", "left-loop", "--sheet", str(sheet)]) == 0
    assert cv2.imdecode(np.fromfile(sheet, np.uint8), cv2.IMREAD_COLOR) is not None
    text = capsys.readouterr().out
    assert text.isprintable() or not any("\ud800" <= letter <= "\udfff" for letter in text)
    film = write_film(odd(tmp_path, name, ".mp4"))
    assert main(["film", str(film)]) == 2
    assert "face" in capsys.readouterr().err


@LINUX
@pytest.mark.parametrize("name", NAMES)
def test_file_urls_carry_any_name(tmp_path: Path, name: bytes) -> None:
    path = odd(tmp_path, name, " #1.mp4")
    assert path_in_url(url_of(path)) == path


@LINUX
def test_path_is_found_again_where_a_library_shows_replacements(tmp_path: Path) -> None:
    folder = odd(tmp_path, b"f\xff")
    folder.mkdir()
    path = odd(folder, b"caf\xe9", ".mp4")
    path.write_bytes(b"")
    assert path_from_library(f"{tmp_path}/f\ufffd/caf\ufffd.mp4") == path
    gone = f"{tmp_path}/none\ufffd/x.mp4"
    assert path_from_library(gone) == Path(gone)
