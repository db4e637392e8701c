"""Panoramas that a phone has stitched are laid where they belong, or asked about."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.cli import main
from app.core.base.colour import srgb_encode
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.measure.read.metadata import read_header
from tests.helpers.exif_bytes import pose_xmp, segment

WIDE = 1440  # of the whole panorama


@pytest.fixture(scope="module")
def whole() -> NDArray[np.float32]:
    """Linear light below clipping, (720, 1440, 3)."""
    light = read_environment(resources() / "demo" / "cafe" / "probe.exr").radiance
    light = np.asarray(
        cv2.resize(light, (WIDE, WIDE // 2), interpolation=cv2.INTER_AREA), np.float32
    )
    return np.asarray(np.minimum(light * 0.3 / np.quantile(light, 0.9), 0.9), np.float32)


def write(file: Path, light: Any, **tags: float) -> Path:
    codes = np.rint(255.0 * srgb_encode(light)).astype(np.uint8)[..., ::-1]
    data = cv2.imencode(".jpg", codes, [cv2.IMWRITE_JPEG_QUALITY, 96])[1].tobytes()
    xmp = segment(0xE1, b"http://ns.adobe.com/xap/1.0/\0" + pose_xmp(**tags)) if tags else b""
    file.write_bytes(data[:2] + xmp + data[2:])
    return file


def cylinder(whole: Any, fov_deg: float, shape: tuple[int, int]) -> Any:
    """What a phone stitches of a turn by an angle."""
    azimuth = (np.arange(shape[1]) + 0.5) / shape[1] * fov_deg - fov_deg / 2.0
    up = (shape[0] / 2.0 - np.arange(shape[0]) - 0.5) * math.radians(fov_deg) / shape[1]
    columns = (azimuth / 360.0 + 0.5) * WIDE - 0.5
    rows = (0.5 - np.arctan(up) / math.pi) * WIDE / 2.0 - 0.5
    maps = [each.astype(np.float32) for each in np.meshgrid(columns, rows)]
    return cv2.remap(whole, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)


def stitched(
    file: Path, capsys: pytest.CaptureFixture[str], *words: str
) -> tuple[dict[str, Any], Any]:
    target = file.with_suffix(".exr")
    assert main(["stitch", str(file), "-o", str(target), "--sun", "leave", "--json", *words]) == 0
    return json.loads(capsys.readouterr().out), read_environment(target).radiance


def off(light: Any, whole: Any, rows: slice, columns: slice) -> float:
    """Median relative difference of areas of a degree inside a part of the panorama."""
    size = (WIDE // 4, WIDE // 8)
    one, other = (cv2.resize(each, size, interpolation=cv2.INTER_AREA) for each in (light, whole))
    part = (slice(rows.start // 4, rows.stop // 4), slice(columns.start // 4, columns.stop // 4))
    return float(np.median(np.abs(one[part] / other[part] - 1.0)))


def test_a_part_is_laid_where_gpano_says(whole: Any, tmp_path: Path, capsys: Any) -> None:
    part = whole[200:520, 300:1100]
    tags = {
        "CroppedAreaImageWidthPixels": 800,
        "CroppedAreaImageHeightPixels": 320,
        "CroppedAreaLeftPixels": 300,
        "CroppedAreaTopPixels": 200,
        "FullPanoWidthPixels": 1440,
        "FullPanoHeightPixels": 720,
    }
    file = write(tmp_path / "part.jpg", part, **tags)
    assert read_header(file).frame.area_deg == pytest.approx((-105.0, 95.0, 40.0, -40.0))
    facts, light = stitched(file, capsys)
    assert facts["blind"] == pytest.approx(1.0 - 200 / 360 * math.sin(math.radians(40.0)), abs=0.01)
    assert (
        off(light, whole, slice(220, 500), slice(320, 1080)) < 0.03
    )  # half a degree aside it is 0.06


def test_a_wide_picture_whose_ends_meet_goes_all_around(
    whole: Any, tmp_path: Path, capsys: Any
) -> None:
    file = write(tmp_path / "turn.jpg", cylinder(whole, 360.0, (320, WIDE)))
    facts, light = stitched(file, capsys)
    tall = math.atan(160 * 2.0 * math.pi / WIDE)
    assert facts["blind"] == pytest.approx(1.0 - math.sin(tall), abs=0.01)
    assert facts["photographs"][0]["fov_deg"] == 360.0
    assert (
        off(light, whole, slice(240, 480), slice(20, 1420)) < 0.03
    )  # half a degree aside it is 0.06


def test_where_its_ends_do_not_meet_its_width_is_asked_for(
    whole: Any, tmp_path: Path, capsys: Any
) -> None:
    file = write(tmp_path / "half.jpg", cylinder(whole, 180.0, (320, 1000)))
    assert main(["stitch", str(file), "-o", str(tmp_path / "half.exr")]) == 2
    assert "--fov" in capsys.readouterr().err
    words = ["stitch", str(file), "-o", str(tmp_path / "half.exr"), "--fov", "400"]
    assert main(words) == 2
    assert "360" in capsys.readouterr().err
    _, light = stitched(file, capsys, "--fov", "180")
    assert (
        off(light, whole, slice(250, 470), slice(380, 1060)) < 0.03
    )  # half a degree aside it is 0.06


def test_one_ordinary_photograph_is_refused(whole: Any, tmp_path: Path, capsys: Any) -> None:
    file = write(tmp_path / "one.jpg", whole[:, :960])
    assert main(["stitch", str(file), "-o", str(tmp_path / "one.exr")]) == 2
    assert "One photo" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["FullPanoWidthPixels", "CroppedAreaImageHeightPixels"])
def test_sizes_that_make_no_sense_are_passed_over(whole: Any, tmp_path: Path, name: str) -> None:
    tags = dict.fromkeys(("CroppedAreaLeftPixels", "CroppedAreaTopPixels"), 0.0)
    tags |= dict.fromkeys(("CroppedAreaImageWidthPixels", "FullPanoWidthPixels"), 100.0)
    tags |= dict.fromkeys(("CroppedAreaImageHeightPixels", "FullPanoHeightPixels"), 50.0)
    assert read_header(write(tmp_path / "a.jpg", whole, **tags)).frame.area_deg is not None
    odd = write(tmp_path / "b.jpg", whole, **(tags | {name: 0.0}))
    assert read_header(odd).frame.area_deg is None
