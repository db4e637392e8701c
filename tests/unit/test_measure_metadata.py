"""What a picture file says about itself: exposure, camera, pose; and files that are no frames."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.core.base.errors import ProbeError
from app.core.measure.bracket.exposures import metered_exposure
from app.core.measure.read.frame import Exposure, LensExposure, XmpPose
from app.core.measure.read.metadata import read_header
from app.core.measure.read.remarks import TwoApertures, TwoTimes
from tests.helpers.exif_bytes import (
    RATIONAL,
    SHORT,
    SRATIONAL,
    Entry,
    camera_tags,
    exif,
    jpeg,
    pose_xmp,
    tagged,
    text,
)
from tests.helpers.frames import read_frame
from tests.helpers.shared import SHARED, needs_shared

MODEL = 0x0110


def save(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def image(
    path: Path,
    kind: str = "uint8",
    shape: tuple[int, int] = (32, 64),
    full: tuple[int, int] | None = None,
    **tags: object,
) -> Path:
    """Picture written by OpenImageIO; `tags` are attributes with _ for a colon."""
    spec = oiio.ImageSpec(shape[1], shape[0], 3, kind)
    if full:
        spec.full_width, spec.full_height = full
    for name, value in tags.items():
        spec.attribute(name.replace("_", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.full((*shape, 3), 0.5, np.float32)), output.geterror()
    assert output.close()
    return path


def test_a_theta_file_tells_everything(tmp_path: Path) -> None:
    model = tagged(MODEL, text(b"RICOH THETA V   "))
    xmp = pose_xmp(PosePitchDegrees=-1.4, PoseRollDegrees=-7.9, PoseHeadingDegrees=225.0)
    data = jpeg(exif(camera=camera_tags((1, 1000), 64, (20, 10)), main=[model]), xmp)
    frame = read_frame(save(tmp_path / "R0010001.JPG", data))
    assert frame.path == tmp_path / "R0010001.JPG"
    assert frame.shape == (32, 64)
    assert frame.kind == "uint8"
    assert frame.camera == "RICOH THETA V"
    assert frame.exposure == Exposure(0.001, 64.0, 2.0, known=True)
    assert frame.pose == XmpPose(-1.4, -7.9, 225.0)
    assert frame.zenith_corrected is True
    assert frame.lenses == (LensExposure(0.001, 64.0), LensExposure(0.001, 80.0))
    assert frame.tone_mapped is False


def test_little_endian_files_tell_the_same(tmp_path: Path) -> None:
    frames = [
        read_frame(
            save(tmp_path / f"{order == '<'}.jpg", jpeg(exif(camera=camera_tags(), order=order)))
        )
        for order in "<>"
    ]
    assert frames[0].exposure == frames[1].exposure
    assert frames[0].lenses == frames[1].lenses
    assert len(frames[0].lenses) == 2


@pytest.mark.parametrize(
    "shutter",
    [(1, 500), (10, 5000), (1, 25000), (1, 60), (1, 3), (13, 10), (60, 1), (10, 4)],
)
def test_exposure_times_lose_the_noise_of_32_bits(tmp_path: Path, shutter: tuple[int, int]) -> None:
    frame = read_frame(save(tmp_path / "a.jpg", jpeg(exif(None, camera_tags(shutter)))))
    assert frame.exposure is not None
    assert frame.exposure.shutter_s == pytest.approx(shutter[0] / shutter[1], rel=1e-15)


def test_the_camera_s_name_is_stripped_of_padding(tmp_path: Path) -> None:
    model = tagged(MODEL, text(b"  RICOH  THETA S" + b" " * 47 + b"\0"))
    assert read_frame(save(tmp_path / "a.jpg", jpeg(exif(None, main=[model])))).camera == (
        "RICOH THETA S"
    )


def test_a_name_in_no_known_encoding_is_survived(tmp_path: Path) -> None:
    model = tagged(MODEL, text(b"Kamera \xe4\xff\xfe"))
    frame = read_frame(save(tmp_path / "a.jpg", jpeg(exif(None, camera_tags(), [model]))))
    assert frame.exposure is not None
    assert frame.exposure.iso == 64.0


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        (camera_tags(None), None),
        (camera_tags((0, 1)), None),
        (camera_tags((1, 0)), None),
        (camera_tags((4_000_000_000, 1)), None),
        (camera_tags(iso=None), Exposure(0.001, 100.0, 2.0, known=False)),
        (camera_tags(aperture=None), Exposure(0.001, 64.0, 1.0, known=False)),
        (camera_tags(aperture=(0, 10)), Exposure(0.001, 64.0, 1.0, known=False)),
        (camera_tags(iso=None, aperture=None), Exposure(0.001, 100.0, 1.0, known=False)),
    ],
)
def test_missing_and_impossible_values(
    tmp_path: Path, tags: list[Entry], expected: Exposure | None
) -> None:
    assert read_frame(save(tmp_path / "a.jpg", jpeg(exif(None, tags)))).exposure == expected


def test_logarithmic_values_stand_in_for_missing_ones(tmp_path: Path) -> None:
    tags: list[Entry] = [
        (0x8827, SHORT, (100,)),
        (0x9201, SRATIONAL, (8, 1)),
        (0x9202, RATIONAL, (3, 1)),
    ]
    frame = read_frame(save(tmp_path / "a.jpg", jpeg(exif(None, tags))))
    assert frame.exposure is not None
    assert frame.exposure.shutter_s == pytest.approx(1 / 256)
    assert frame.exposure.aperture == pytest.approx(2.83)


def test_iso_beyond_16_bits_is_found(tmp_path: Path) -> None:
    tags = [*camera_tags(iso=65535), (0x8832, 4, (102400,))]
    frame = read_frame(save(tmp_path / "a.jpg", jpeg(exif(None, tags))))
    assert frame.exposure is not None
    assert frame.exposure.iso == 102400.0


def test_contradicting_tags_of_one_file_are_named(tmp_path: Path) -> None:
    agreeing: list[Entry] = [(0x9201, SRATIONAL, (997, 100)), (0x9202, RATIONAL, (2, 1))]
    wrong: list[Entry] = [(0x9201, SRATIONAL, (7, 1)), (0x9202, RATIONAL, (6, 1))]
    good = read_header(save(tmp_path / "a.jpg", jpeg(exif(None, [*camera_tags(), *agreeing]))))
    bad = read_header(save(tmp_path / "b.jpg", jpeg(exif(None, [*camera_tags(), *wrong]))))
    assert good.doubts == ()
    assert bad.doubts == (TwoTimes("b.jpg", 0.001, 1 / 128), TwoApertures("b.jpg", 2.0, 8.0))
    assert bad.shutter_s == 0.001


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [
        ({}, None),
        ({"PosePitchDegrees": -29.0}, XmpPose(-29.0, 0.0)),
        ({"PoseRollDegrees": -35.8}, XmpPose(0.0, -35.8)),
        ({"PoseHeadingDegrees": 90.0}, None),
        ({"PosePitchDegrees": "nan", "PoseRollDegrees": 500.0}, None),
        ({"PosePitchDegrees": "north", "PoseRollDegrees": 3.0}, XmpPose(0.0, 3.0)),
    ],
)
def test_pose_by_photo_sphere_xmp(
    tmp_path: Path, degrees: dict[str, float], expected: XmpPose | None
) -> None:
    data = jpeg(exif(None, camera_tags()), pose_xmp(**degrees))
    assert read_frame(save(tmp_path / "a.jpg", data)).pose == expected


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("a.jpg", "uint8"),
        ("a.png", "uint8"),
        ("a.png", "uint16"),
        ("a.tif", "uint8"),
        ("a.tiff", "uint16"),
        ("a.tif", "float"),
        ("a.exr", "half"),
        ("a.exr", "float"),
        ("a.hdr", "float"),
    ],
)
def test_every_kind_of_file_is_read(tmp_path: Path, name: str, kind: str) -> None:
    frame = read_frame(image(tmp_path / name, kind, ExposureTime=0.25, FNumber=2.0))
    assert frame.shape == (32, 64)
    assert frame.kind == kind
    if name != "a.hdr":  # Radiance has no tag for it.
        assert frame.exposure is not None
        assert frame.exposure.shutter_s == 0.25


def test_a_wrong_ending_does_not_matter(tmp_path: Path) -> None:
    png = image(tmp_path / "a.png", "uint16")
    assert read_frame(png.rename(tmp_path / "b.jpg")).kind == "uint16"


def refusal(path: Path | str) -> str:
    with pytest.raises(ProbeError) as caught:
        read_frame(path)
    assert caught.value.hint or "cannot be read" in caught.value.message
    return str(caught.value)


def test_what_is_no_picture_is_said_so(tmp_path: Path) -> None:
    assert "no file" in refusal(tmp_path / "none.jpg")
    assert "is a folder" in refusal(tmp_path)
    assert "is empty" in refusal(save(tmp_path / "empty.jpg", b""))
    assert "notes.txt is not a readable picture" in refusal(save(tmp_path / "notes.txt", b"hello"))
    assert "is not a readable picture" in refusal(save(tmp_path / "page.jpg", b"<html>" * 100))
    assert "damaged" in refusal(save(tmp_path / "text.hdr", b"hello" * 100))
    assert "is not a readable picture" in refusal(
        save(tmp_path / "a.webp", b"RIFF\0\0\0\0WEBPVP8 ")
    )
    assert "raw" in refusal(save(tmp_path / "a.dng", b"II*\0" + bytes(100)))
    assert "damaged" in refusal(save(tmp_path / "a.tif", b"II*\0" + bytes(100)))
    assert "cannot be read" in refusal("a\0b.jpg")


@pytest.mark.parametrize("share", [0.001, 0.02, 0.1, 0.2])
def test_a_cut_header_is_said_so(tmp_path: Path, share: float) -> None:
    data = jpeg(exif(camera=camera_tags()), shape=(16, 32))
    header = data.index(b"\xff\xda")
    assert "damaged" in refusal(save(tmp_path / "a.jpg", data[: 3 + int(share * header)]))


def test_size_limits(tmp_path: Path) -> None:
    assert "only 8 x 4 pixels" in refusal(image(tmp_path / "small.png", shape=(4, 8)))
    assert read_frame(image(tmp_path / "least.png", shape=(8, 16))).shape == (8, 16)
    assert "16400 x 9 pixels" in refusal(image(tmp_path / "wide.png", shape=(9, 16400)))
    big = bytearray(jpeg(None))
    at = big.index(b"\xff\xc0") + 5
    big[at : at + 4] = (12000).to_bytes(2, "big") + (16000).to_bytes(2, "big")
    assert "16000 x 12000 pixels" in refusal(save(tmp_path / "big.jpg", bytes(big)))


def test_pixels_of_other_kinds_are_refused(tmp_path: Path) -> None:
    assert "int16" in refusal(image(tmp_path / "a.tif", "int16"))


def test_a_cropped_data_window_is_refused(tmp_path: Path) -> None:
    path = image(tmp_path / "a.exr", "half", shape=(32, 32), full=(64, 32))
    assert "only part" in refusal(path)


def test_the_maker_note_tells_fisheye_pictures(tmp_path: Path) -> None:
    data = jpeg(exif([(0x0001, SHORT, (2,))], camera_tags()))
    assert read_frame(save(tmp_path / "a.jpg", data)).fisheye


def test_the_metered_exposure_lies_between_the_lenses(tmp_path: Path) -> None:
    theta: tuple[Entry, ...] = (
        (0x0101, SHORT, (500, 0, 200, 0)),
        (0x0103, RATIONAL, (1, 30, 1, 30)),
    )
    header = read_header(save(tmp_path / "a.jpg", jpeg(exif(theta, camera_tags((1, 30), 500)))))
    metered = metered_exposure(header)
    assert metered is not None
    assert metered.iso == pytest.approx((500 * 200) ** 0.5)
    assert header.frame.exposure is not None
    assert header.frame.exposure.iso == 500.0
    assert metered_exposure(read_header(image(tmp_path / "a.png"))) is None


@given(st.lists(st.tuples(st.integers(2, 700), st.integers(0, 255)), min_size=1, max_size=6))
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_damaged_header_is_read_or_refused(
    tmp_path: Path, changes: list[tuple[int, int]]
) -> None:
    data = bytearray(jpeg(exif(camera=camera_tags()), shape=(8, 16)))
    for place, value in changes:
        data[place] = value
    with contextlib.suppress(ProbeError):
        frame = read_frame(save(tmp_path / "a.jpg", bytes(data)))
        assert frame.exposure is None or frame.exposure.factor > 0.0


@needs_shared
def test_real_files() -> None:
    tilted = read_frame(SHARED / "theta" / "theta_s_tilted_R0010298.JPG")
    assert tilted.shape == (2688, 5376)
    assert tilted.camera == "RICOH THETA S"
    assert tilted.exposure == Exposure(0.002, 100.0, 2.0)
    assert tilted.pose == XmpPose(-29.0, -35.8, 225.0)
    assert tilted.zenith_corrected is False
    assert [lens.iso for lens in tilted.lenses] == [100.0, 140.0]
    level = read_frame(SHARED / "theta" / "theta_v_R0014760.JPG")
    assert level.exposure == Exposure(0.001, 64.0, 2.0)
    assert level.pose == XmpPose(0.0, 0.0)
    assert level.zenith_corrected is True
    church = read_frame(SHARED / "brackets" / "memorial" / "memorial0061.png")
    assert church.shape == (768, 512)
    assert church.exposure is None
    # Lines stand before the one that names the format.
    assert read_frame(SHARED / "brackets" / "memorial" / "memorial.hdr").kind == "float"
