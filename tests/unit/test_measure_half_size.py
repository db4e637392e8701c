"""Bright frames at half their size: what is hidden in the mean of four pixels is not lost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import colour
from app.core.base.colour import luminance, srgb_decode, srgb_encode
from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.bracket.curve.response import Response
from app.core.measure.bracket.half_size import anchors, halvable
from app.core.measure.bracket.measure import measure
from app.core.measure.bracket.merge import merge
from app.core.measure.read.decoding import MemoryRows, decode, decode_half
from app.core.measure.read.frame import Bracket, Exposure, Frame, MergedLight
from app.core.measure.read.opened_frame import proxy_shape, shrunk
from app.core.measure.read.pixels import FrameStack, open_frames
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from app.words.remarks import sentences
from benchmarks.light.shots.brackets import make_bracket, write_bracket
from tests.helpers.cases import sample_first

CURVE = Response(
    "sRGB", np.repeat(srgb_decode(np.arange(256) / 255.0).astype(np.float64)[None], 3, axis=0)
)
PAPER = (2.0, 0.0, -2.0)


def codes_of(light: NDArray[Any], stop: float) -> NDArray[np.uint8]:
    return np.asarray(np.rint(255.0 * srgb_encode(light * 2.0**stop)), np.uint8)


def halved(codes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Mean codes of each four pixels, as a JPEG decoder makes them."""
    height, width = codes.shape[:2]
    means = codes.reshape(height // 2, 2, width // 2, 2, 3).mean((1, 3))
    return np.asarray(np.rint(means), np.uint8)


def merged_at_half_size(light: NDArray[Any], stops: tuple[float, ...] = PAPER) -> MergedLight:
    """Merge frames of a known scene, all but the anchors from mean codes."""
    whole = anchors(stops)
    pictures = [
        codes if anchor else halved(codes)
        for anchor, codes in zip(whole, (codes_of(light, stop) for stop in stops), strict=True)
    ]
    shape = (light.shape[0], light.shape[1])
    frames = tuple(Frame(Path(f"{stop}"), shape, exposure=Exposure(2.0**stop)) for stop in stops)
    stack = FrameStack(
        frames=frames,
        stops=stops,
        proxies=tuple(shrunk(picture, proxy_shape(shape)) for picture in pictures),
        samples=np.zeros((len(stops), 1, 3), np.uint8),
        sample_places=np.zeros((1, 2), np.intp),
        top=np.inf,
        sources=tuple(MemoryRows(picture) for picture in pictures),
    )
    half = (shape[0] // 2, shape[1] // 2)
    return merge(stack, CURVE, stops, size=half)


def four_by_four_means(light: NDArray[Any]) -> NDArray[Any]:
    height, width = light.shape[:2]
    return np.asarray(light.reshape(height // 2, 2, width // 2, 2, 3).mean((1, 3)))


@pytest.mark.parametrize("bright", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("dark", [0.02, 0.1])
def test_a_checkerboard_of_pixels_keeps_its_light(bright: float, dark: float) -> None:
    light = np.full((64, 128, 3), dark, np.float32)
    light[::2, ::2] = light[1::2, 1::2] = bright
    merged = merged_at_half_size(light)
    # The mean codes alone would lose a fifth to a half of it.
    np.testing.assert_allclose(merged.radiance, (bright + dark) / 2.0, rtol=0.03)


@pytest.mark.parametrize("lamp", [0.5, 2.0, 3.5])
def test_a_lamp_of_one_pixel_keeps_its_light(lamp: float) -> None:
    light = np.full((64, 128, 3), 0.03, np.float32)
    light[21, 40] = lamp
    merged = merged_at_half_size(light)
    wanted = four_by_four_means(light)
    # A mean code alone would keep between a third and a hundredth of it.
    assert merged.radiance[10, 20, 1] == pytest.approx(wanted[10, 20, 1], rel=0.04)
    assert merged.radiance[10, 21, 1] == pytest.approx(0.03, rel=0.03)


def test_a_lamp_that_clips_everywhere_is_marked_by_its_area() -> None:
    light = np.full((64, 128, 3), 0.03, np.float32)
    light[20, 40:42] = 50.0
    merged = merged_at_half_size(light)
    assert merged.clipped[10, 20] == pytest.approx(0.5, abs=0.01)
    assert np.count_nonzero(merged.clipped) == 1
    assert merged.radiance[10, 20, 1] == pytest.approx((4.0 + 0.03) / 2.0, rel=0.02)


def test_a_long_bracket_keeps_lamps_and_shadows() -> None:
    stops = (2.0, 0.0, -2.0, -4.0, -6.0, -8.0)
    light = np.full((64, 128, 3), 0.01, np.float32)
    light[::2, 64:] = 0.4
    light[21, 40] = 200.0
    merged = merged_at_half_size(light, stops)
    found = merged.radiance * 2.0**-merged.reference_ev
    np.testing.assert_allclose(found[:, 32:-1], 0.205, rtol=0.03)
    assert found[10, 20, 1] == pytest.approx((200.0 + 0.03) / 4.0, rel=0.03)
    assert found[20, 10, 1] == pytest.approx(0.01, rel=0.04)


def test_nothing_changes_where_opencv_has_no_tables_for_16_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    light = np.random.default_rng(0).random((64, 128, 3)).astype(np.float32)
    wide = merged_at_half_size(light).radiance
    monkeypatch.setattr(colour, "wide_tables", lambda: False)
    np.testing.assert_array_equal(merged_at_half_size(light).radiance, wide)


def test_the_darkest_frame_is_an_anchor_and_no_frame_is_far_from_one() -> None:
    stops = (3.0, 1.0, 0.0, -2.0, -5.0, -11.0)
    chosen = [stop for stop, whole in zip(stops, anchors(stops), strict=True) if whole]
    assert min(stops) in chosen
    assert all(any(0.0 <= stop - low <= 4.1 for low in chosen) for stop in stops)


@pytest.mark.slow
@pytest.mark.parametrize("scene", sample_first(["forest", "courtyard", "interior", "night"], 1))
def test_light_is_that_of_the_scene_as_with_whole_frames(scene: str, tmp_path: Path) -> None:
    radiance = read_environment(resources() / "demo" / "scenes" / f"{scene}.exr").radiance
    metered = meter(radiance, THETA_V)
    shots = [replace(metered, shutter_s=metered.shutter_s * 2.0**stop) for stop in PAPER]
    shape = (2688, 5376)
    frames = []
    for name, data in enumerate(make_bracket(radiance, THETA_V, shots, seed=1, shape=shape)):
        (tmp_path / f"{name}.jpg").write_bytes(data)
        frames.append(Frame(tmp_path / f"{name}.jpg", shape, exposure=shots[name]))
    bracket = Bracket(tuple(frames), tuple(shot.ev for shot in shots))

    def light(halves: tuple[bool, ...]) -> MergedLight:
        with open_frames(bracket, halves=halves) as stack:
            return merge(stack, CURVE, stack.stops, size=(1024, 2048))

    half, whole = light((True, True, False)), light(())
    small, large = (reduce_radiance(one.radiance, (32, 64)) for one in (half, whole))
    assert np.abs(small - large).sum() <= 0.001 * large.sum()
    truth = luminance(reduce_radiance(radiance, (32, 64)))
    seen = cv2.resize(whole.clipped, (64, 32), interpolation=cv2.INTER_AREA) == 0.0
    assert seen.mean() > 0.5

    def error(found: NDArray[Any]) -> float:
        quotient = luminance(found)[seen] / truth[seen]
        return float(np.median(np.abs(quotient / np.median(quotient) - 1.0)))

    assert error(small) <= error(large) + 0.0005
    np.testing.assert_allclose(half.clipped_fractions, whole.clipped_fractions, atol=0.01)


def test_a_jpeg_at_half_size_is_the_mean_of_its_codes(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    codes = cv2.GaussianBlur(rng.integers(0, 255, (256, 512, 3)).astype(np.uint8), (0, 0), 4)
    path = tmp_path / "frame.jpg"
    cv2.imwrite(str(path), codes, [cv2.IMWRITE_JPEG_QUALITY, 95])
    frame = Frame(path, (256, 512))
    assert halvable(frame)
    small, full = decode_half(frame, Token()), decode(frame, Token())
    assert np.abs(small.astype(float) - halved(full)).mean() < 1.0
    path.write_bytes(path.read_bytes()[:-200])
    assert not halvable(frame)


@pytest.mark.slow
def test_a_bright_frame_that_is_damaged_inside_is_left_out_and_named(tmp_path: Path) -> None:
    radiance = read_environment(resources() / "demo" / "scenes" / "courtyard.exr").radiance
    metered = meter(radiance, THETA_V)
    shots = [replace(metered, shutter_s=metered.shutter_s * 2.0**stop) for stop in PAPER]
    files = write_bracket(tmp_path, radiance, THETA_V, shots, shape=(2048, 4096))
    data = files[0].read_bytes()
    files[0].write_bytes(data[: len(data) // 2] + b"\xff\xd9")
    probe = measure(files)
    assert len(probe.bracket.frames) == 2
    assert any(files[0].name in warning for warning in sentences(probe.warnings))
