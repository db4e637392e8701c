"""What simulated files say: read back by OpenImageIO and by the probe's own reader."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from app.core.measure.read.frame import Exposure, LensExposure, XmpPose
from app.core.measure.read.makernote import parse_ricoh_note
from app.core.measure.read.metadata import read_header
from app.devices.simulated.cameras import (
    GENERIC,
    SENSORS,
    THETA_S,
    THETA_V,
    THETA_X,
    CameraModel,
)
from app.devices.simulated.exif import Tags, exif_segment, with_segments
from benchmarks.light.shots.brackets import shoot

EXPOSURE = Exposure(0.01666666, 125.0, 2.0)
GREY = np.full((32, 64, 3), 100.0, dtype=np.float32)


def _write(folder: Path, camera: CameraModel, **options: object) -> Path:
    path = folder / "R0010001.JPG"
    path.write_bytes(shoot(GREY, camera, EXPOSURE, **options))  # type: ignore[arg-type]
    return path


def _spec(path: Path) -> oiio.ImageSpec:
    source = oiio.ImageInput.open(str(path))
    assert source is not None
    spec = source.spec()
    source.close()
    return spec


def test_openimageio_reads_exposure_model_and_pose(tmp_path: Path) -> None:
    path = _write(
        tmp_path, THETA_S, tilt=XmpPose(-12.5, 7.3, 225.0), date_time="2026:03:04 05:06:07"
    )
    spec = _spec(path)
    assert spec["ExposureTime"] == pytest.approx(1.0 / 60.0, rel=1e-6)
    assert spec["FNumber"] == pytest.approx(2.0)
    assert spec["Exif:PhotographicSensitivity"] == 125
    assert spec["Exif:ExposureProgram"] == 1
    assert spec["Exif:DateTimeOriginal"] == "2026:03:04 05:06:07"
    assert spec["Exif:PixelXDimension"] == 64
    assert spec["Exif:ColorSpace"] == 1
    assert spec["Orientation"] == 1
    # Blank padded, as files of the S are.
    assert spec["Model"] == "RICOH THETA S".ljust(63)
    assert str(spec["Make"]).strip() == "RICOH"
    assert str(spec["Software"]).strip() == "RICOH THETA S Ver 1.82"
    assert spec["GPano:ProjectionType"] == "equirectangular"
    assert spec["GPano:FullPanoWidthPixels"] == 64
    assert spec["GPano:PosePitchDegrees"] == pytest.approx(-12.5)
    assert spec["GPano:PoseRollDegrees"] == pytest.approx(7.3)
    assert spec["GPano:PoseHeadingDegrees"] == pytest.approx(225.0)


@pytest.mark.parametrize("camera", SENSORS.values(), ids=SENSORS)
def test_the_probe_reads_what_was_meant(camera: CameraModel, tmp_path: Path) -> None:
    path = _write(tmp_path, camera, tilt=XmpPose(-20.0, -35.8), lens_gain=(1.0, 1.28))
    frame = read_header(path).frame
    assert frame.shape == (32, 64)
    assert frame.exposure is not None
    assert frame.exposure.shutter_s == pytest.approx(EXPOSURE.shutter_s, rel=1e-6)
    assert frame.exposure.iso == 125.0
    assert frame.exposure.aperture == 2.0
    assert frame.exposure.known
    assert frame.camera == camera.model.strip()
    assert not frame.tone_mapped
    assert frame.pose == (XmpPose(0.0, 0.0) if camera.levels_itself else XmpPose(-20.0, -35.8))
    if camera.maker_note:
        assert frame.zenith_corrected is camera.levels_itself
        assert [lens.iso for lens in frame.lenses] == [125.0, 160.0]
        for lens in frame.lenses:
            assert lens.shutter_s == pytest.approx(EXPOSURE.shutter_s, rel=1e-6)
    else:
        assert frame.zenith_corrected is None
        assert frame.lenses == ()


def test_layout_is_that_of_real_files() -> None:
    """Byte order, types and counts of the tags as in public files of the S and the X."""
    tags = Tags(
        shape=(32, 64), maker_note=True, zenith_corrected=False, aperture=2.0,
        pose=XmpPose(-29.0, -35.8), lenses=(LensExposure(0.002, 100.0), LensExposure(0.002, 140.0)),
    )  # fmt: skip
    tiff = exif_segment(tags)[10:]
    assert tiff[:8] == b"MM\0*\0\0\0\x08"
    start = tiff.index(b"Ricoh\0\0\0") + 8
    note = _directory(tiff, start)
    assert note[0x0001] == (2, 4, b"Rdc\0")
    theta = _directory(tiff, struct.unpack(">I", note[0x4001][2])[0])
    assert theta[0x0101] == (3, 4, struct.pack(">4H", 100, 0, 140, 0))
    assert theta[0x0103] == (5, 2, struct.pack(">4I", 1, 500, 1, 500))
    # As the tilted sample states: roll first, 324.2, then pitch.
    assert theta[0x0003] == (10, 2, struct.pack(">4i", 3242, 10, -290, 10))
    assert theta[0x0007][:2] == (3, 1)
    newer = exif_segment(replace(tags, lens_words=1))[10:]
    note = _directory(newer, newer.index(b"Ricoh\0\0\0") + 8)
    theta = _directory(newer, struct.unpack(">I", note[0x4001][2])[0])
    assert theta[0x0101] == (3, 2, struct.pack(">2H", 100, 140))
    assert theta[0x0103][:2] == (10, 2)


def test_entries_are_sorted_and_word_aligned() -> None:
    tiff = exif_segment(
        Tags(make="abc", model="de", date_time="2026:01:01 00:00:00", shutter_s=1.3, iso=50,
             maker_note=True, lenses=(LensExposure(1.3, 50.0),) * 2)
    )[10:]  # fmt: skip
    main = _directory(tiff, 8)
    camera_at = struct.unpack(">I", main[0x8769][2])[0]
    assert camera_at % 2 == 0
    camera = _directory(tiff, camera_at)
    for entries in (main, camera):
        assert list(entries) == sorted(entries)
    assert camera[0x829A][2] == struct.pack(">II", 13, 10)
    assert camera[0x8827][2] == struct.pack(">H", 50)


def _directory(tiff: bytes, offset: int) -> dict[int, tuple[int, int, bytes]]:
    """Entries of a TIFF directory: tag to type, count and value."""
    sizes = {2: 1, 3: 2, 4: 4, 5: 8, 7: 1, 10: 8}
    count = struct.unpack_from(">H", tiff, offset)[0]
    entries = {}
    for index in range(count):
        at = offset + 2 + 12 * index
        tag, kind, number = struct.unpack_from(">HHI", tiff, at)
        size = sizes[kind] * number
        place = at + 8 if size <= 4 else struct.unpack_from(">I", tiff, at + 8)[0]
        assert place + size <= len(tiff)
        entries[tag] = (kind, number, tiff[place : place + size])
    assert struct.unpack_from(">I", tiff, offset + 2 + 12 * count)[0] == 0
    return entries


@pytest.mark.parametrize(
    ("seconds", "fraction"),
    [
        (0.00004, (1, 25000)), (0.00007812, (1, 12801)), (0.00015625, (1, 6400)),
        (0.01666666, (1, 60)), (0.07692307, (1, 13)), (0.25, (1, 4)), (0.33333333, (1, 3)),
        (0.4, (2, 5)), (0.625, (5, 8)), (0.76923076, (10, 13)), (1.3, (13, 10)), (60.0, (60, 1)),
    ],
)  # fmt: skip
def test_exposure_times_are_written_as_cameras_do(
    seconds: float, fraction: tuple[int, int]
) -> None:
    tiff = exif_segment(Tags(shutter_s=seconds))[10:]
    camera = _directory(tiff, struct.unpack(">I", _directory(tiff, 8)[0x8769][2])[0])
    assert struct.unpack(">II", camera[0x829A][2]) == fraction


def test_times_off_the_list_keep_six_digits() -> None:
    for seconds in (0.0075305672, 0.123456, 0.41421356, 3.14159265):
        tiff = exif_segment(Tags(shutter_s=seconds))[10:]
        camera = _directory(tiff, struct.unpack(">I", _directory(tiff, 8)[0x8769][2])[0])
        top, bottom = struct.unpack(">II", camera[0x829A][2])
        assert top / bottom == pytest.approx(seconds, rel=1e-6)


def test_files_may_lie(tmp_path: Path) -> None:
    def edit(tags: Tags) -> Tags:
        return replace(tags, iso=800.0, hdr_rendering=True, zenith_corrected=True)

    frame = read_header(_write(tmp_path, THETA_S, edit_tags=edit, tilt=XmpPose(3.0, 4.0))).frame
    assert frame.exposure is not None
    assert frame.exposure.iso == 800.0
    assert frame.tone_mapped
    assert frame.zenith_corrected is True
    assert frame.pose == XmpPose(3.0, 4.0)


@pytest.mark.parametrize("known", [True, False])
def test_files_may_be_silent(known: bool, tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    exposure = replace(EXPOSURE, known=known)
    edit = (lambda tags: replace(tags, shutter_s=None)) if known else None
    path.write_bytes(shoot(GREY, GENERIC, exposure, edit_tags=edit))
    spec = _spec(path)
    assert ("ExposureTime" in spec) is not known
    assert ("FNumber" in spec) is known
    assert ("Exif:PhotographicSensitivity" in spec) is known
    assert "GPano:PosePitchDegrees" not in spec


def test_no_metadata_at_all(tmp_path: Path) -> None:
    spec = _spec(_write(tmp_path, THETA_V, edit_tags=lambda _: None))
    assert "Model" not in spec
    assert "GPano:ProjectionType" not in spec
    assert with_segments(b"\xff\xd8rest", []) == b"\xff\xd8rest"
    assert with_segments(b"\xff\xd8\xff\xdbrest", [b"s"]) == b"\xff\xd8s\xff\xdbrest"


def test_exif_comes_first_and_the_picture_is_untouched() -> None:
    with_tags = shoot(GREY, THETA_X, EXPOSURE)
    without = shoot(GREY, THETA_X, EXPOSURE, edit_tags=lambda _: None)
    assert with_tags[2:4] == b"\xff\xe1"
    assert with_tags[6:12] == b"Exif\0\0"
    one, other = (cv2.imdecode(np.frombuffer(x, np.uint8), 1) for x in (with_tags, without))
    assert one is not None
    assert other is not None
    np.testing.assert_array_equal(one, other)


def test_ordinary_pictures_have_no_panorama_tags(tmp_path: Path) -> None:
    path = tmp_path / "b.jpg"
    path.write_bytes(shoot(np.ones((30, 40, 3), np.float32), GENERIC, EXPOSURE))
    assert "GPano:ProjectionType" not in _spec(path)


def test_a_segment_has_its_limit() -> None:
    with pytest.raises(ValueError, match="fit"):
        exif_segment(Tags(make="x" * 70000))


def test_notes_without_contents_are_read_as_nothing() -> None:
    note = parse_ricoh_note(exif_segment(Tags(maker_note=True))[10:])
    assert note is not None
    assert note.lens_isos == ()
    assert note.zenith_corrected is None
    assert parse_ricoh_note(exif_segment(Tags(iso=100))[10:]) is None


def test_cameras_by_name() -> None:
    assert SENSORS["Z1"].apertures == (2.1, 3.5, 5.6)
    assert list(SENSORS) == ["S", "SC2", "V", "Z1", "X", "generic"]
