"""Merging, on brackets made from HDR scenes and on small ones made by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance, srgb_decode, srgb_encode
from app.core.base.errors import Cancelled
from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.environment.environment import energy, read_environment, reduce_radiance
from app.core.measure.bracket.curve.response import Response
from app.core.measure.bracket.merge import merge
from app.core.measure.bracket.weighting import Scheme
from app.core.measure.read.frame import Bracket, Exposure, Frame, MergedLight
from app.core.measure.read.pixels import FrameStack, open_frames
from app.devices.simulated.cameras import GENERIC
from app.devices.simulated.optics import meter
from benchmarks.light.shots.brackets import enlarged, make_bracket

SRGB = Response(
    "sRGB", np.repeat(srgb_decode(np.arange(256) / 255.0).astype(np.float64)[None], 3, axis=0)
)
PAPER = (2.0, 0.0, -2.0)
FULL = (2.0, 0.0, -2.0, -4.0, -6.0, -8.0)


def seen(path: Path) -> NDArray[Any]:
    """What OpenCV decodes."""
    pixels = cv2.imread(str(path))
    assert pixels is not None
    return pixels[..., ::-1].copy()


def coded(radiance: NDArray[Any], stop: float, most: int = 255) -> NDArray[Any]:
    kind = np.uint8 if most == 255 else np.uint16
    return np.rint(srgb_encode(radiance * 2.0**stop).astype(np.float64) * most).astype(kind)


def stack_of(
    folder: Path,
    pictures: list[NDArray[Any]],
    stops: tuple[float, ...],
    memory_bytes: int = 1 << 30,
) -> FrameStack:
    """Frames written without loss."""
    frames = []
    for index, (pixels, stop) in enumerate(zip(pictures, stops, strict=True)):
        linear = pixels.dtype == np.float32
        path = folder / f"{index}{'.exr' if linear else '.png'}"
        output = oiio.ImageOutput.create(str(path))
        assert output is not None
        height, width = pixels.shape[:2]
        kind = "float" if linear else str(pixels.dtype)
        assert output.open(str(path), oiio.ImageSpec(width, height, 3, kind))
        assert output.write_image(pixels)
        output.close()
        frames.append(Frame(path, (height, width), kind, Exposure(2.0**stop)))
    return open_frames(Bracket(tuple(frames), stops), memory_bytes=memory_bytes)


def merged_of(
    folder: Path, pictures: list[NDArray[Any]], stops: tuple[float, ...], **options: object
) -> MergedLight:
    with stack_of(folder, pictures, stops) as stack:
        return merge(stack, SRGB, stops, **options)  # type: ignore[arg-type]


def uniform(colour: tuple[float, float, float], shape: tuple[int, int] = (32, 64)) -> NDArray[Any]:
    return np.tile(np.array(colour, np.float32), (*shape, 1))


def scene_bracket(
    folder: Path, name: str, stops: tuple[float, ...]
) -> tuple[NDArray[Any], Bracket, list[NDArray[Any]]]:
    light = read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance
    metered = meter(light, GENERIC)
    shots = [replace(metered, shutter_s=metered.shutter_s * 2.0**stop) for stop in stops]
    shape = (1024, 2048)
    files = make_bracket(light, GENERIC, shots, seed=3, shape=shape, smooth=True)
    frames = []
    for index, (data, shot) in enumerate(zip(files, shots, strict=True)):
        path = folder / f"{index}.jpg"
        path.write_bytes(data)
        frames.append(Frame(path, shape, exposure=shot))
    pictures = [seen(frame.path).copy() for frame in frames]
    bracket = Bracket(tuple(frames), tuple(shot.ev for shot in shots))
    return np.asarray(enlarged(light, shape, smooth=True)), bracket, pictures


def relative(radiance: NDArray[Any], truth: NDArray[Any], good: NDArray[Any]) -> NDArray[Any]:
    wanted = luminance(truth[good]).astype(np.float64)
    return np.abs(luminance(radiance[good]) - wanted) / wanted


@pytest.mark.slow
@pytest.mark.parametrize("name", ["city", "sunrise"])
def test_as_true_as_wanted_and_truer_than_opencv(tmp_path: Path, name: str) -> None:
    truth, bracket, pictures = scene_bracket(tmp_path, name, PAPER)
    with open_frames(bracket) as stack:
        mine = merge(stack, SRGB, stack.stops, size=None)
        plain = merge(stack, SRGB, stack.stops, size=None, scheme="reinhard")
    assert mine.cd_m2 is not None
    good = np.any([picture.max(axis=-1) < 254 for picture in pictures], axis=0)
    good &= pictures[0].max(axis=-1) > 0
    error = relative(mine.radiance * np.float32(mine.cd_m2), truth, good)
    assert np.median(error) <= 0.01
    assert np.percentile(error, 95) <= 0.04
    hat = relative(plain.radiance * np.float32(mine.cd_m2), truth, good)
    assert np.median(error) < np.median(hat)

    times = np.array([2.0**stop for stop in bracket.stops], np.float32)
    curve = np.maximum(SRGB.table.T, 0.5 * SRGB.table[0, 1]).astype(np.float32)[:, None]
    for peer in (cv2.createMergeDebevec(), cv2.createMergeRobertson()):
        other = peer.process(pictures, times, curve)
        other = other / np.median(luminance(other[good]) / luminance(truth[good]))
        theirs = relative(other, truth, good)
        assert np.median(error) <= np.median(theirs)
        assert np.percentile(error, 95) <= np.percentile(theirs, 95)


def test_merged_in_bands_from_files_is_the_same(tmp_path: Path) -> None:
    _, bracket, _ = scene_bracket(tmp_path, "courtyard", FULL[:4])
    with open_frames(bracket) as held, open_frames(bracket, memory_bytes=0) as streamed:
        one = merge(held, SRGB, held.stops, size=(128, 256))
        two = merge(streamed, SRGB, streamed.stops, size=(128, 256))
        whole = merge(streamed, SRGB, streamed.stops, size=None)
    np.testing.assert_array_equal(one.radiance, two.radiance)
    np.testing.assert_array_equal(one.clipped, two.clipped)
    assert one.clipped_fractions == two.clipped_fractions
    # The reduction is of the merged light, and keeps its energy.
    np.testing.assert_allclose(energy(one.radiance), energy(whole.radiance), rtol=1e-4)
    oracle = reduce_radiance(whole.radiance, (128, 256))
    np.testing.assert_allclose(one.radiance, oracle, rtol=1e-3, atol=1e-5)
    clipped = reduce_radiance(whole.clipped[..., None], (128, 256))[..., 0]
    np.testing.assert_allclose(one.clipped, clipped, atol=1e-4)


def test_unit_scale_and_clip_level(tmp_path: Path) -> None:
    light = uniform((0.1, 0.2, 0.3))
    merged = merged_of(tmp_path, [coded(light, stop) for stop in PAPER], PAPER)
    np.testing.assert_allclose(merged.radiance, light, rtol=0.01)
    assert merged.reference_ev == 0.0
    assert merged.clip_level == 4.0
    assert merged.cd_m2 == pytest.approx(1.2)
    assert merged.clipped.max() == merged.dark.max() == 0.0


def test_absolute_scale_is_not_made_up(tmp_path: Path) -> None:
    with stack_of(tmp_path, [coded(uniform((0.2,) * 3), s) for s in PAPER], PAPER) as stack:
        frames = tuple(
            replace(f, exposure=replace(f.exposure, known=False))
            for f in stack.frames
            if f.exposure
        )
        assert merge(replace(stack, frames=frames), SRGB, PAPER).cd_m2 is None


def test_disc_clipped_in_every_frame_is_the_brightest_and_flagged(tmp_path: Path) -> None:
    light = uniform((0.2, 0.2, 0.2), (64, 128))
    yy, xx = np.mgrid[:64, :128]
    away = np.hypot(yy - 30, xx - 60)
    light *= (1.0 + 500.0 * np.exp(-((away / 8.0) ** 2)))[..., None].astype(np.float32)
    for scheme in ("noise", "reinhard"):
        pictures = [coded(light, stop) for stop in PAPER]
        merged = merged_of(tmp_path, pictures, PAPER, scheme=scheme)
        level = merged.radiance.max(axis=-1)
        inside = light.max(axis=-1) > 4.2
        assert np.isfinite(merged.radiance).all()
        np.testing.assert_allclose(level[inside], 4.0, rtol=0.01)
        assert level[~inside].max() <= level[inside].max()
        assert (merged.clipped[inside] == 1.0).all()
        assert (merged.clipped[light.max(axis=-1) < 3.8] == 0.0).all()
        # No ring on the slope: it rises steadily towards the middle.
        slope = level[30, 60:100]
        assert (np.diff(slope) <= 1e-5).all()
        assert merged.clipped_fractions[0] > merged.clipped_fractions[2] > 0.0


def test_black_in_every_frame(tmp_path: Path) -> None:
    light = uniform((0.3, 0.3, 0.3))
    light[:10] = 0.0
    light[10:14] = 2e-4
    merged = merged_of(tmp_path, [coded(light, stop) for stop in PAPER], PAPER)
    assert np.isfinite(merged.radiance).all()
    assert (merged.radiance[:10] == 0.0).all()
    assert (merged.dark[:10] == 1.0).all()
    # Codes of 0 in the two darker frames do not make black what the brightest one sees.
    np.testing.assert_allclose(merged.radiance[10:14], 2e-4, rtol=0.2)
    assert (merged.dark[14:] == 0.0).all()


@pytest.mark.parametrize("scheme", ["noise", "reinhard"])
def test_one_clipped_channel_colours_no_lamp(tmp_path: Path, scheme: Scheme) -> None:
    """Lamps of several whites, from far below to far above clipping, keep their hue or pale."""
    levels = np.exp2(np.linspace(-3.0, 6.0, 256)).astype(np.float32)
    for white in ((1.0, 0.93, 0.85), (0.85, 1.0, 0.9), (0.9, 0.95, 1.0), (1.0, 0.8, 1.0)):
        light = np.tile(levels[None, :, None] * np.array(white, np.float32), (128, 1, 1))
        merged = merged_of(tmp_path, [coded(light, s) for s in PAPER], PAPER, scheme=scheme)
        got = merged.radiance / merged.radiance.max(axis=-1, keepdims=True)
        wanted = np.array(white, np.float32) / max(white)
        assert np.isfinite(got).all()
        assert (got > wanted - 0.025).all()
        below = light[0].max(axis=-1) < 3.7
        np.testing.assert_allclose(
            got[:, below], np.broadcast_to(wanted, got[:, below].shape), atol=0.02
        )
        above = light[0].min(axis=-1) > 4.0
        assert (got[:, above] > 0.98).all()


def test_a_response_that_ends_at_three_values_leaves_clipped_lamps_white(tmp_path: Path) -> None:
    uneven = Response("uneven", SRGB.table * np.array([[1.0], [0.85], [0.95]]))
    codes = np.full((32, 64, 3), 255, np.uint8)
    codes[:, 32:] = (255, 244, 255)
    with stack_of(tmp_path, [codes, codes], (0.0, -2.0)) as stack:
        merged = merge(stack, uneven, stack.stops)
    spread = merged.radiance.max(axis=-1) / merged.radiance.min(axis=-1)
    assert spread[:, :30].max() < 1.001
    assert spread[:, 34:].max() < 1.06
    # Without help the code 244 alone would be 0.77 of the response's end.
    assert (merged.radiance >= uneven.table[1, 244] * 4.0 - 1e-4).all()


def test_a_red_lamp_stays_red(tmp_path: Path) -> None:
    merged = merged_of(tmp_path, [coded(uniform((9.0, 0.6, 0.3)), s) for s in PAPER], PAPER)
    np.testing.assert_allclose(merged.radiance, uniform((4.0, 0.6, 0.3)), rtol=0.03)
    assert (merged.clipped == 1.0).all()


def test_codes_of_16_bits_and_linear_frames_give_the_same_light(tmp_path: Path) -> None:
    generator = np.random.default_rng(8)
    light = np.exp(generator.normal(-1.5, 1.5, (64, 128, 3))).astype(np.float32)
    unclipped = light.max(axis=-1) < 3.5
    for kind in ("uint16", "float", "whole"):
        if kind == "uint16":
            pictures = [coded(light, stop, 65535) for stop in PAPER]
        else:
            top = np.float32(1.0 if kind == "float" else np.inf)
            pictures = [np.minimum(light * np.float32(2.0**stop), top) for stop in PAPER]
        merged = merged_of(tmp_path, pictures, PAPER)
        np.testing.assert_allclose(merged.radiance[unclipped], light[unclipped], rtol=2e-3)
        if kind == "whole":
            np.testing.assert_allclose(merged.radiance, light, rtol=1e-4)
            assert merged.clipped.max() == 0.0
        else:
            assert (merged.clipped[light.max(axis=-1) > 4.0] == 1.0).all()


def test_linear_frames_with_nan_and_infinity_stay_finite(tmp_path: Path) -> None:
    light = uniform((0.2, 0.3, 0.4))
    light *= np.random.default_rng(6).random((32, 64, 1), dtype=np.float32) + np.float32(0.5)
    light[3, 3], light[4, 4], light[5, 5] = np.nan, np.inf, -1.0
    merged = merged_of(tmp_path, [light, light / 4.0], (0.0, -2.0))
    assert np.isfinite(merged.radiance).all()
    assert (merged.radiance >= 0.0).all()
    np.testing.assert_allclose(merged.radiance[10:], light[10:], rtol=1e-3)


def test_untrusted_frames_are_not_used(tmp_path: Path) -> None:
    light = uniform((0.2, 0.2, 0.2), (128, 256))
    other = light.copy()
    other[:, 128:] = 0.9
    pictures = [coded(light, 0.0), coded(other, -1.0)]
    trust = np.ones((128, 256), np.float32)
    trust[:, 128:] = 0.0
    with stack_of(tmp_path, pictures, (0.0, -1.0)) as stack:
        blended = merge(stack, SRGB, stack.stops)
        clean = merge(stack, SRGB, stack.stops, trust=[None, trust])
        nobody = merge(stack, SRGB, stack.stops, trust=[trust * 0.0, trust * 0.0])
    assert blended.radiance[:, 140:].min() > 0.24
    np.testing.assert_allclose(clean.radiance, 0.2, rtol=0.02)
    assert np.isfinite(nobody.radiance).all()
    assert nobody.radiance.min() > 0.1


@pytest.mark.slow
def test_trust_is_interpolated_as_opencv_does(tmp_path: Path) -> None:
    light = uniform((0.2, 0.2, 0.2), (1024, 2048))
    pictures = [coded(light, 0.0), coded(light * 2.0, 0.0)]
    trust = np.random.default_rng(1).random((128, 256)).astype(np.float32)
    wide = cv2.resize(trust, (2048, 1024), interpolation=cv2.INTER_LINEAR)[..., None]
    with stack_of(tmp_path, pictures, (0.0, 0.0)) as stack:
        alone = merge(stack, SRGB, stack.stops, trust=[None, 0.0 * trust], size=None)
        other = merge(stack, SRGB, stack.stops, trust=[0.0 * trust, None], size=None)
        both = merge(stack, SRGB, stack.stops, trust=[None, trust], size=None)
        full = merge(stack, SRGB, stack.stops, size=None)
    # Weights of the two frames from what they give with equal trust.
    ratio = (full.radiance - alone.radiance) / (other.radiance - full.radiance)
    wanted = (alone.radiance + wide * ratio * other.radiance) / (1.0 + wide * ratio)
    np.testing.assert_allclose(both.radiance, wanted, rtol=2e-3)


def test_a_lamp_seen_only_by_an_untrusted_frame_stays_a_lower_bound(tmp_path: Path) -> None:
    light = uniform((3.0, 3.0, 3.0))
    pictures = [coded(light, 0.0), coded(uniform((0.1, 0.1, 0.1)), -2.0)]
    with stack_of(tmp_path, pictures, (0.0, -2.0)) as stack:
        trust = np.zeros((32, 64), np.float32)
        merged = merge(stack, SRGB, stack.stops, trust=[None, trust])
    np.testing.assert_allclose(merged.radiance, 1.0, rtol=0.01)
    assert (merged.clipped == 1.0).all()


def test_corrected_exposures_may_swap_two_frames(tmp_path: Path) -> None:
    light = uniform((0.3, 0.3, 0.3))
    with stack_of(tmp_path, [coded(light, s) for s in (0.0, -2.0, -4.0)], PAPER) as stack:
        merged = merge(stack, SRGB, (0.0, -4.0, -2.0))
    assert merged.reference_ev == -2.0
    assert merged.clip_level == 4.0
    assert np.isfinite(merged.radiance).all()


def test_ordinary_pictures_keep_their_size(tmp_path: Path) -> None:
    light = uniform((0.2, 0.3, 0.4), (60, 50))
    merged = merged_of(tmp_path, [coded(light, stop) for stop in PAPER], PAPER, size=(10, 20))
    assert merged.radiance.shape == (60, 50, 3)


def test_wrong_counts_are_refused(tmp_path: Path) -> None:
    with stack_of(tmp_path, [coded(uniform((0.1,) * 3), s) for s in PAPER], PAPER) as stack:
        with pytest.raises(ValueError, match="2 exposures for 3 frames"):
            merge(stack, SRGB, PAPER[:2])
        with pytest.raises(ValueError, match="1 trust maps for 3 frames"):
            merge(stack, SRGB, PAPER, trust=[None])


@pytest.mark.parametrize("memory", [1 << 30, 0])
def test_cancelling_and_progress(tmp_path: Path, memory: int) -> None:
    light = uniform((0.2, 0.3, 0.4), (1024, 2048))
    pictures = [coded(light, stop) for stop in PAPER]
    with stack_of(tmp_path, pictures, PAPER, memory_bytes=memory) as stack:
        told: list[float] = []
        merge(stack, SRGB, PAPER, report=lambda fraction, _: told.append(fraction))
        assert told == sorted(told)
        assert len(told) > 5
        assert told[-1] == 1.0
        token = Token()
        with pytest.raises(Cancelled):
            merge(stack, SRGB, PAPER, token=token, report=lambda *_: token.cancel())


def test_scaling_the_light_scales_the_result(tmp_path: Path) -> None:
    """Nothing in the weights depends on the absolute exposure."""
    light = np.exp(np.random.default_rng(4).normal(-2.0, 1.0, (64, 128, 3))).astype(np.float32)
    pictures = [coded(light, stop) for stop in PAPER]
    one = merged_of(tmp_path, pictures, PAPER)
    other = merged_of(tmp_path, pictures, tuple(stop - 10.0 for stop in PAPER))
    np.testing.assert_allclose(other.radiance, one.radiance, rtol=1e-5)
