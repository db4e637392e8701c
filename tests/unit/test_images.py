"""Writing pictures."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from app.core.base.atomic_files import DiskTrouble, atomic_write, disk_trouble
from app.core.base.errors import CoreError
from app.core.base.imaging import images
from app.core.base.imaging.images import write_exr, write_png


def test_png_keeps_every_byte(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 256, (7, 9, 3), np.uint8)
    atomic_write(tmp_path / "a.png", lambda path: write_png(path, picture, 192))
    read = oiio.ImageBuf(str(tmp_path / "a.png"))
    np.testing.assert_array_equal(read.get_pixels("uint8"), picture)
    assert read.spec().get_float_attribute("XResolution") == pytest.approx(192, abs=1)


def test_exr_keeps_every_float_and_the_channel_names(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).random((7, 9, 3)).astype(np.float32) * 1e6
    atomic_write(tmp_path / "a.exr", lambda path: write_exr(path, picture))
    read = oiio.ImageBuf(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(read.get_pixels("float"), picture)
    assert tuple(read.spec().channelnames) == ("R", "G", "B")


def test_pictures_that_are_views_are_written_as_seen(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8)
    write_png(tmp_path / "a.png", picture[::-1, ::2])
    read = oiio.ImageBuf(str(tmp_path / "a.png")).get_pixels("uint8")
    np.testing.assert_array_equal(read, picture[::-1, ::2])


@pytest.mark.parametrize("name", ["missing/a.png", "a.unknown"])
def test_what_cannot_be_written_is_said(tmp_path: Path, name: str) -> None:
    with pytest.raises(CoreError, match="Cannot write"):
        write_png(tmp_path / name, np.zeros((2, 2, 3), np.uint8))


@pytest.mark.skipif(sys.platform == "win32", reason="there is no limit on the size of files")
def test_exr_reports_a_full_disk_by_its_code(tmp_path: Path) -> None:
    import resource

    picture = np.random.default_rng(0).random((64, 128, 3)).astype(np.float32)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(CoreError) as refused:
            write_exr(tmp_path / "a.exr", picture)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert disk_trouble(refused.value) is DiskTrouble.FULL
    assert list(tmp_path.iterdir()) == []


def test_exr_that_does_not_read_back_is_no_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(images, "_reads_back", lambda *_: False)
    with pytest.raises(CoreError) as refused:
        write_exr(tmp_path / "a.exr", np.ones((4, 8, 3), np.float32))
    assert disk_trouble(refused.value) is None
