"""A film's header: mirrors that OpenCV leaves out, and the camera that took it."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.progress import Token, silent
from app.core.measure.film import measure as film_way
from app.core.measure.film.film import Film
from app.core.measure.film.frames import film_frames
from app.core.measure.film.movie_header import MovieHeader, read_movie_header
from app.core.places.intake import sort_out
from app.core.places.open_files import OpenOptions, make_place
from app.core.storage.settings import Settings
from app.words.remarks import sentences
from tests.helpers.films import write_film
from tests.unit.test_measure_film import stood_still

ONE = 65536
# Red and green above, blue and white below.
STORED = np.zeros((120, 200, 3), np.uint8)
STORED[:60, :100], STORED[:60, 100:] = (255, 0, 0), (0, 255, 0)
STORED[60:, :100], STORED[60:, 100:] = (0, 0, 255), (255, 255, 255)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = write_film(tmp_path_factory.mktemp("film") / "plain.mp4", (STORED,) * 6)
    return path.read_bytes()


def with_matrix(plain: bytes, a: int, b: int, c: int, d: int) -> bytes:
    """The same film with another matrix in its track (ISO/IEC 14496-12, 8.3.2)."""
    start = plain.index(b"tkhd") + 4 + 40
    matrix = struct.pack(">9i", a * ONE, b * ONE, 0, c * ONE, d * ONE, 0, 0, 0, 1 << 30)
    return plain[:start] + matrix + plain[start + 36 :]


def shown(path: Path) -> NDArray[np.uint8]:
    """What a player shows by the standard: x' = a x + c y, y' = b x + d y."""
    return next(iter(film_frames(path, 2, 1280)))[2]


@pytest.mark.parametrize(
    ("matrix", "right"),
    [
        ((1, 0, 0, 1), STORED),
        ((-1, 0, 0, 1), STORED[:, ::-1]),
        ((1, 0, 0, -1), STORED[::-1]),
        ((-1, 0, 0, -1), STORED[::-1, ::-1]),
        ((0, 1, -1, 0), np.rot90(STORED, -1)),
        ((0, -1, 1, 0), np.rot90(STORED, 1)),
        ((0, 1, 1, 0), STORED.transpose(1, 0, 2)),
        ((0, -1, -1, 0), np.rot90(STORED, 2).transpose(1, 0, 2)),
    ],
)
def test_film_is_shown_as_its_header_says(
    plain: bytes, tmp_path: Path, matrix: tuple[int, int, int, int], right: NDArray[np.uint8]
) -> None:
    path = tmp_path / "film.mp4"
    path.write_bytes(with_matrix(plain, *matrix))
    picture = shown(path)
    assert picture.shape == right.shape
    small = cv2.resize(picture, None, fx=0.1, fy=0.1, interpolation=cv2.INTER_AREA)
    truth = cv2.resize(np.ascontiguousarray(right), None, fx=0.1, fy=0.1)
    assert np.abs(small.astype(int) - truth).mean() < 12


def of_a_front_camera(plain: bytes) -> bytes:
    """The same film whose header names its lens."""
    lens = b"iPhone 15 front camera 2.69mm f/1.9"
    box = struct.pack(">I", 8 + len(lens)) + b"udta" + lens
    start = plain.index(b"moov") - 4
    size = int.from_bytes(plain[start : start + 4])
    end = start + size
    whole = struct.pack(">I", size + len(box)) + plain[start + 4 : end] + box
    return plain[:start] + whole + plain[end:]


def test_front_camera_is_named_by_the_header(plain: bytes, tmp_path: Path) -> None:
    path = tmp_path / "selfie.mp4"
    path.write_bytes(of_a_front_camera(plain))
    assert read_movie_header(path) == MovieHeader(None, front_camera=True)


@pytest.mark.parametrize("mirrored", [False, True])
def test_window_reads_a_film_as_it_is_set(
    plain: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mirrored: bool
) -> None:
    path = tmp_path / "selfie.mp4"
    given: list[tuple[float, float, NDArray[np.uint8]]] = []
    path.write_bytes(of_a_front_camera(plain))
    film = stood_still([float(yaw) for yaw in range(-48, 50, 8)])

    def read(frames: Iterable[tuple[float, float, NDArray[np.uint8]]], *_: object) -> Film:
        given.extend(frames)
        return film

    monkeypatch.setattr(film_way, "read_film", read)
    settings, now = Settings(mirrored=mirrored), datetime(2026, 6, 1, tzinfo=UTC)
    options = OpenOptions(tmp_path / "places", now, settings)
    opened = make_place(sort_out([path]), options, Token(), silent)
    # Green is stored above on the right.
    assert bool(given[0][2][30, 50, 1] > 128) is mirrored
    assert opened.place.capture is not None
    words = " ".join(sentences(opened.place.capture.warnings))
    assert ("turn on Mirrored" in words) is not mirrored


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\0\0\0\x08moov",
        b"\0\0\0\x04moov",
        b"\0\0\0\x01moov" + b"\xff" * 8,
        b"\0\0\0\0moov\0\0\0\x10trak\0\0\0\x08tkhd",
        b"RIFF" + b"\0" * 100,
    ],
)
def test_other_files_say_nothing(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "film.mov"
    path.write_bytes(content)
    assert read_movie_header(path) == MovieHeader()
    assert read_movie_header(tmp_path / "missing.mp4") == MovieHeader()
