"""Decoding of brackets, small pictures and samples."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.errors import Cancelled, ProbeError
from app.core.base.progress import Token
from app.core.measure.read.decoding import RawRows, needs_whole_decode
from app.core.measure.read.frame import Bracket, Exposure, Frame
from app.core.measure.read.opened_frame import proxy_shape
from app.core.measure.read.pixels import open_frames, relaid
from app.core.measure.read.remarks import FrameUnread
from app.words.remarks import sentences

SHAPE = (264, 528)


def seen(path: Path) -> NDArray[Any]:
    """What OpenCV decodes."""
    pixels = cv2.imread(str(path))
    assert pixels is not None
    return pixels[..., ::-1].copy()


def picture(seed: int, shape: tuple[int, int] = SHAPE) -> NDArray[Any]:
    noise = np.random.default_rng(seed).random((*shape, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 3.0)
    smooth = (smooth - smooth.min()) / np.ptp(smooth)
    return np.asarray(np.rint(255.0 * smooth), np.uint8)


def bracket(paths: list[Path], shape: tuple[int, int] = SHAPE, kind: str = "uint8") -> Bracket:
    frames = tuple(
        Frame(path, shape, kind, exposure=Exposure(4.0**-index)) for index, path in enumerate(paths)
    )
    return Bracket(frames, tuple(-2.0 * index for index in range(len(paths))))


def jpegs(folder: Path, count: int = 3, **options: int) -> list[Path]:
    flags = [value for pair in options.items() for value in (getattr(cv2, pair[0]), pair[1])]
    paths = [folder / f"{index}.jpg" for index in range(count)]
    for index, path in enumerate(paths):
        assert cv2.imwrite(str(path), picture(index)[..., ::-1], flags)
    return paths


def write(path: Path, pixels: NDArray[Any], kind: str) -> None:
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    height, width, channels = pixels.shape
    assert output.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert output.write_image(pixels)
    output.close()


@pytest.mark.parametrize("memory", [1 << 30, 0])
def test_pixels_are_those_that_opencv_decodes(tmp_path: Path, memory: int) -> None:
    paths = jpegs(tmp_path)
    with open_frames(bracket(paths), memory_bytes=memory) as stack:
        assert stack.in_memory == bool(memory)
        for source, path in zip(stack.sources, paths, strict=True):
            wanted = seen(path)
            np.testing.assert_array_equal(source.rows(0, 100), wanted[:100])
            np.testing.assert_array_equal(source.rows(100, SHAPE[0]), wanted[100:])
            # Once more from the top: a stream begins again.
            np.testing.assert_array_equal(source.rows(0, 8), wanted[:8])


@pytest.mark.parametrize("shape", [(264, 528), (300, 600), (1030, 2060), (90, 100)])
def test_small_pictures_and_samples_do_not_depend_on_where_pixels_come_from(
    tmp_path: Path, shape: tuple[int, int]
) -> None:
    paths = [tmp_path / f"{index}.png" for index in range(2)]
    for index, path in enumerate(paths):
        cv2.imwrite(str(path), picture(index, shape)[..., ::-1])
    with (
        open_frames(bracket(paths, shape)) as held,
        open_frames(bracket(paths, shape), memory_bytes=0) as streamed,
    ):
        rows, columns = held.sample_places.T
        for index in range(2):
            small = held.proxies[index]
            assert small.shape == (*proxy_shape(shape), 3)
            whole = cv2.resize(
                picture(index, shape), proxy_shape(shape)[::-1], interpolation=cv2.INTER_AREA
            )
            np.testing.assert_array_equal(small, whole)
            difference = small.astype(int) - streamed.proxies[index]
            # Rows that lie across two small ones are shared differently.
            exact = shape[0] % small.shape[0] == 0
            assert np.abs(difference).max() <= (0 if exact else 60)
            assert abs(difference.mean()) < 0.5
            np.testing.assert_array_equal(held.samples[index], picture(index, shape)[rows, columns])
        np.testing.assert_array_equal(held.samples, streamed.samples)


def test_samples_cover_the_picture_evenly(tmp_path: Path) -> None:
    shape = (1024, 2048)
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), np.zeros((*shape, 3), np.uint8))
    with open_frames(bracket([path, path], shape)) as stack:
        places = stack.sample_places
    assert 15_000 < len(places) <= 20_000
    cells = places[:, 0] * 4 // shape[0] * 8 + places[:, 1] * 8 // shape[1]
    counts = np.bincount(cells, minlength=32)
    assert counts.min() > 0.9 * counts.mean()
    assert (np.diff(places[:, 0]) > -shape[0]).all()
    assert places.max(axis=0)[0] < shape[0]
    assert places.max(axis=0)[1] < shape[1]


def test_half_a_jpeg_is_left_out_and_named(tmp_path: Path) -> None:
    paths = jpegs(tmp_path)
    data = paths[1].read_bytes()
    paths[1].write_bytes(data[: len(data) // 2])
    for memory in (1 << 30, 0):
        with open_frames(bracket(paths), memory_bytes=memory) as stack:
            assert [frame.path.name for frame in stack.frames] == ["0.jpg", "2.jpg"]
            assert stack.stops == (0.0, -4.0)
            assert paths[1] not in [frame.path for frame in stack.frames]
            assert len(stack.proxies) == len(stack.samples) == 2
            (warning,) = stack.warnings
            assert isinstance(warning, FrameUnread)
            assert "1.jpg" in warning.message


@pytest.mark.parametrize("ending", ["png", "tif", "exr", "hdr"])
def test_half_a_file_of_any_kind_is_left_out(tmp_path: Path, ending: str) -> None:
    kind = {"png": "uint8", "tif": "uint16", "exr": "half", "hdr": "float"}[ending]
    paths = [tmp_path / f"{index}.{ending}" for index in range(3)]
    for path in paths:
        if kind == "uint8":
            write(path, picture(1), kind)
        else:
            write(path, picture(1).astype(np.float32) / 255.0, kind)
    data = paths[0].read_bytes()
    paths[0].write_bytes(data[: len(data) // 2])
    with open_frames(bracket(paths, kind=kind)) as stack:
        assert [frame.path for frame in stack.frames] == paths[1:]


def test_a_missing_end_marker_loses_nothing(tmp_path: Path) -> None:
    paths = jpegs(tmp_path, 2)
    wanted = seen(paths[0])
    paths[0].write_bytes(paths[0].read_bytes()[:-2])
    with open_frames(bracket(paths)) as stack:
        assert len(stack.frames) == 2
        np.testing.assert_array_equal(stack.sources[0].rows(0, SHAPE[0]), wanted)


def test_too_few_good_frames_are_refused(tmp_path: Path) -> None:
    paths = jpegs(tmp_path, 2)
    paths[1].write_bytes(paths[1].read_bytes()[:5000])
    with pytest.raises(ProbeError, match=r"1\.jpg is damaged.*only one frame is left"):
        open_frames(bracket(paths))
    paths[0].unlink()
    with pytest.raises(ProbeError, match=r"Cannot read 0\.jpg.*no frame is left"):
        open_frames(bracket(paths), memory_bytes=0)


def test_a_file_that_changed_its_size_is_left_out(tmp_path: Path) -> None:
    paths = jpegs(tmp_path)
    cv2.imwrite(str(paths[2]), picture(0, (64, 128)))
    with open_frames(bracket(paths)) as stack:
        assert "2.jpg changed while" in sentences(stack.warnings)[0]


@pytest.mark.parametrize("memory", [1 << 30, 0])
def test_cancelling_stops_the_reading(tmp_path: Path, memory: int) -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        open_frames(bracket(jpegs(tmp_path)), memory_bytes=memory, token=token)


def test_progress_is_told_once_per_frame(tmp_path: Path) -> None:
    told: list[float] = []
    open_frames(bracket(jpegs(tmp_path)), report=lambda fraction, _: told.append(fraction)).close()
    assert told == pytest.approx([1 / 3, 2 / 3, 1.0])


def test_progressive_files_are_spooled(tmp_path: Path) -> None:
    plain, progressive = jpegs(tmp_path, 2)
    cv2.imwrite(str(progressive), picture(1)[..., ::-1], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])
    assert not needs_whole_decode(plain)
    assert needs_whole_decode(progressive)
    assert not needs_whole_decode(tmp_path / "missing.jpg")
    with open_frames(bracket([plain, progressive]), memory_bytes=0) as stack:
        assert isinstance(stack.sources[1], RawRows)
        wanted = seen(progressive)
        np.testing.assert_array_equal(stack.sources[1].rows(40, 200), wanted[40:200])


def test_grey_files_alpha_and_16_bits(tmp_path: Path) -> None:
    grey, alpha, deep = (tmp_path / f"{name}.png" for name in ("grey", "alpha", "deep"))
    base = picture(4)
    cv2.imwrite(str(grey), base[..., 0])
    see_through = np.dstack([base[..., ::-1], np.full(SHAPE, 128, np.uint8)])
    cv2.imwrite(str(alpha), see_through)
    write(deep, base.astype(np.uint16) * 257 + 3, "uint16")
    for path, kind, wanted in (
        (grey, "uint8", np.repeat(base[..., :1], 3, axis=2)),
        (alpha, "uint8", base),
        (deep, "uint16", base.astype(np.uint16) * 257 + 3),
    ):
        with open_frames(bracket([path, path], kind=kind)) as stack:
            np.testing.assert_array_equal(stack.sources[0].rows(0, SHAPE[0]), wanted)
            rows, columns = stack.sample_places.T
            coded = np.repeat(base[..., :1], 3, axis=2) if path is grey else base
            np.testing.assert_array_equal(stack.samples[0], coded[rows, columns])


def test_where_float_frames_saturate(tmp_path: Path) -> None:
    light = picture(5).astype(np.float32) / 255.0 * 4.0
    cut, whole = tmp_path / "cut.exr", tmp_path / "whole.exr"
    write(cut, np.minimum(light, 1.5), "float")
    light[3, 4, 1] = 9.0
    write(whole, light, "float")
    for memory in (1 << 30, 0):
        with open_frames(bracket([whole, whole], kind="float"), memory_bytes=memory) as stack:
            assert stack.top == np.inf
        with open_frames(bracket([cut, whole], kind="float"), memory_bytes=memory) as stack:
            assert stack.top == 1.5
            assert stack.proxies[0].dtype == np.uint8
            assert stack.samples[0].max() == 255


def test_turned_frames_are_those_of_the_sphere(tmp_path: Path) -> None:
    paths = jpegs(tmp_path)
    turn = sphere.rotation(3.0, 2.0, 1.0)
    wanted = sphere.remap_frame(seen(paths[1]).copy(), turn)
    for memory in (1 << 30, 0):
        stack = open_frames(bracket(paths), memory_bytes=memory)
        before = stack.samples.copy()
        with relaid(stack, [None, partial(sphere.remap_frame, matrix=turn), None]) as turned:
            np.testing.assert_array_equal(turned.sources[1].rows(0, SHAPE[0]), wanted)
            assert turned.proxies[0] is stack.proxies[0]
            rows, columns = turned.sample_places.T
            np.testing.assert_array_equal(turned.samples[1], wanted[rows, columns])
            np.testing.assert_array_equal(turned.samples[0], before[0])
            np.testing.assert_array_equal(stack.samples, before)


@pytest.mark.parametrize("tile", [16, 64, 100, 512])
@pytest.mark.parametrize("memory", [1 << 30, 0])
def test_tiles_are_read_as_rows(tmp_path: Path, tile: int, memory: int) -> None:
    paths = [tmp_path / "a.exr", tmp_path / "b.exr"]
    light = [picture(seed).astype(np.float32) / 255.0 for seed in (0, 1)]
    for path, pixels in zip(paths, light, strict=True):
        spec = oiio.ImageSpec(SHAPE[1], SHAPE[0], 3, "float")
        spec.tile_width = spec.tile_height = tile
        output = oiio.ImageOutput.create(str(path))
        assert output is not None
        assert output.open(str(path), spec)
        assert output.write_image(pixels)
        output.close()
    with open_frames(bracket(paths, kind="float"), memory_bytes=memory) as stack:
        for source, pixels in zip(stack.sources, light, strict=True):
            np.testing.assert_array_equal(source.rows(0, 70), pixels[:70])
            np.testing.assert_array_equal(source.rows(70, SHAPE[0]), pixels[70:])


def test_a_frame_that_is_half_not_numbers_is_left_out(tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.exr" for name in "abc"]
    for seed, path in enumerate(paths):
        light = picture(seed).astype(np.float32) / 255.0
        light[: SHAPE[0] // (2 if seed == 1 else 100)] = np.nan
        write(path, light, "float")
    with open_frames(bracket(paths, kind="float")) as stack:
        assert "b.exr" not in [frame.path.name for frame in stack.frames]
        assert "50% of it is NaN" in sentences(stack.warnings)[0]
