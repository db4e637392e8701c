"""Pictures that other decoders read: their files come through the one door, with its bounds."""

from __future__ import annotations

import ast
import os
import struct
import sys
import threading
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import app
from app.core.base.imaging.image_input import picture_bytes
from app.core.places.files.frames import small_picture
from app.core.places.files.shots import Shot, thumbnail_of
from app.ui.presenters.places_list import _thumbnail

SHOT = Shot("a.jpg", "2026-11-21T14:05:00", True, "loop", "Loop", 0.0, key="shot-0001")
PICTURE = np.full((160, 320, 3), (30, 90, 200), np.uint8)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="files as on POSIX")


def _shot(path: Path) -> Any:
    (path.parent / "shots").mkdir(exist_ok=True)
    (path.parent / "shots" / "shot-0001.jpg").symlink_to(path)
    return thumbnail_of(path.parent, SHOT)


READERS: dict[str, Callable[[Path], Any]] = {
    "a tile of the capture": small_picture,
    "the list of places": _thumbnail,
    "the list of photographs": _shot,
}


def in_time(read: Callable[[Path], Any], path: Path) -> Any:
    """Call it in a thread, so that a wait without end fails the test instead of stopping it."""
    answers: list[Any] = []
    thread = threading.Thread(target=lambda: answers.append(read(path)), daemon=True)
    thread.start()
    thread.join(120.0)
    assert answers, "it waits, or has raised"
    return answers[0]


def huge(path: Path) -> Path:
    """Write a PNG of 60,000 x 60,000 pixels into a few bytes."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    rows = zlib.compress(bytes(1000))
    parts = (chunk(b"IHDR", head), chunk(b"IDAT", rows), chunk(b"IEND", b""))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    return path


def written(path: Path) -> Path:
    done, data = cv2.imencode(".jpg", PICTURE[..., ::-1])
    assert done
    path.write_bytes(data.tobytes())
    return path


@pytest.mark.parametrize("reader", READERS)
def test_a_picture_is_read(reader: str, tmp_path: Path) -> None:
    found = in_time(READERS[reader], written(tmp_path / "sound.jpg"))
    assert found is not None
    assert np.abs(found.reshape(-1, 3).mean(0) - (30, 90, 200)).max() < 3.0


@pytest.mark.parametrize("reader", READERS)
def test_what_no_picture_should_be_is_left_out(reader: str, tmp_path: Path) -> None:
    read = READERS[reader]
    cases: dict[str, Callable[[Path], object]] = {
        "a pipe": os.mkfifo,
        "too many pixels": huge,
        "a folder": Path.mkdir,
        "a link to itself": lambda path: path.symlink_to(path),
        "a device": lambda path: path.symlink_to("/dev/zero"),
        "nothing": lambda path: path.write_bytes(b""),
        "half a picture's head": lambda path: path.write_bytes(b"\xff\xd8\xff\xe0\0\x10JFIF"),
        "missing": lambda path: None,
    }
    for case, make in cases.items():
        folder = tmp_path / case
        folder.mkdir()
        make(folder / "picture.jpg")
        assert in_time(read, folder / "picture.jpg") is None, case


def test_bounds_of_bytes_and_of_pixels(tmp_path: Path) -> None:
    path = written(tmp_path / "a.jpg")
    size, pixels = path.stat().st_size, 160 * 320
    data = picture_bytes(path, size, pixels)
    assert data is not None
    assert data.tobytes() == path.read_bytes()
    assert picture_bytes(path, size - 1, pixels) is None
    assert picture_bytes(path, size, pixels - 1) is None


def test_no_file_is_given_to_a_decoder_by_its_name() -> None:
    """Only benchmarks of their own files decode past the door."""
    root = Path(app.__file__).parent
    for path in sorted(root.rglob("*.py")):
        if path.is_relative_to(root / "core" / "bench"):
            continue
        named = {
            node.attr
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.value.id == "cv2"
        }
        assert not named & {"imread", "imreadmulti", "imreadanimation"}, path
