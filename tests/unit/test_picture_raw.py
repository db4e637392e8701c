"""Raw files of cameras: their largest preview is read, whatever lies around it."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.errors import CoreError
from app.core.localization.picture_file import RAW_ENDINGS, picture_size, read_picture


def jpeg(rows: int, columns: int, level: int) -> bytes:
    done, data = cv2.imencode(".jpg", np.full((rows, columns, 3), level, np.uint8))
    assert done
    return data.tobytes()


def entry(tag: int, kind: int, value: int) -> bytes:
    return struct.pack("<HHII", tag, kind, 1, value)


def raw(preview: bytes, orientation: int = 1) -> bytes:
    """As cameras write: a TIFF with a thumbnail, a preview behind it, and lossless raw data.

    The lossless JPEG states more pixels than any preview.
    """
    thumbnail = bytes(3 * 8 * 6)
    tags = [
        entry(0x100, 4, 8), entry(0x101, 4, 6), entry(0x102, 3, 8), entry(0x103, 3, 1),
        entry(0x106, 3, 2), entry(0x111, 4, 8), entry(0x112, 3, orientation), entry(0x115, 3, 3),
        entry(0x116, 4, 6), entry(0x117, 4, len(thumbnail)),
    ]  # fmt: skip
    start = 8 + len(thumbnail)
    head = b"II*\0" + struct.pack("<I", start) + thumbnail
    head += struct.pack("<H", len(tags)) + b"".join(tags) + bytes(4)
    lossless = b"\xff\xd8\xff\xc3\x00\x11\x0e\x1f\xff\x1f\xff\x03" + bytes(200)
    return head + jpeg(40, 60, 200) + lossless + preview + bytes(64)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


def mean(picture: NDArray[np.uint8]) -> float:
    return float(picture.mean())


@pytest.mark.parametrize("ending", sorted(RAW_ENDINGS))
def test_the_largest_preview_is_read(folder: Path, ending: str) -> None:
    path = folder / f"DSC_1{ending.upper()}"
    path.write_bytes(raw(jpeg(600, 900, 90)))
    before = path.read_bytes()
    found = read_picture(path)
    assert found.size == (900, 600)
    assert mean(found.picture) == pytest.approx(90, abs=2)
    assert picture_size(path) == (900, 600)
    assert path.read_bytes() == before


def test_the_raw_file_says_which_way_is_up(folder: Path) -> None:
    path = folder / "DSC_2.nef"
    path.write_bytes(raw(jpeg(600, 900, 90), orientation=6))
    found = read_picture(path)
    assert found.size == (600, 900)
    assert found.picture.shape == (900, 600, 3)


def test_a_preview_without_a_tiff_around_it(folder: Path) -> None:
    path = folder / "DSCF1.raf"
    path.write_bytes(b"FUJIFILMCCD-RAW 0201" + bytes(80) + jpeg(300, 400, 60) + bytes(40))
    assert read_picture(path).size == (400, 300)


@pytest.mark.parametrize(
    "data",
    [b"II*\0" + bytes(60), b"\xff\xd8\xff" * 400, b"\xff\xd8\xff\xc3" + bytes(90), b"\xff\xd8\xff"],
)
def test_without_a_preview_it_is_said(folder: Path, data: bytes) -> None:
    path = folder / "DSC_3.arw"
    path.write_bytes(data)
    with pytest.raises(CoreError, match="damaged or not a readable picture"):
        read_picture(path)


def test_a_preview_that_ends_too_early(folder: Path) -> None:
    chance = np.random.default_rng(0)
    done, data = cv2.imencode(".jpg", chance.integers(0, 255, (600, 900, 3), np.uint8))
    assert done
    path = folder / "DSC_4.cr2"
    path.write_bytes(b"II*\0" + bytes(60) + data.tobytes()[:20000])
    with pytest.raises(CoreError, match="damaged or incomplete"):
        read_picture(path)
