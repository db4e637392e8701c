"""Whole frames: what is decoded from a simulated file is the environment over saturation."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from app.core.base import sphere
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.read.frame import Exposure, XmpPose
from app.devices.simulated.cameras import GENERIC, THETA_S, THETA_V, THETA_X, THETA_Z1
from app.devices.simulated.optics import saturation_cd_m2
from benchmarks.light.camera_curves import CURVES, GAMMA_18, LOG, SRGB, Curve
from benchmarks.light.shots.brackets import develop, enlarged, jpeg, shoot

EXPOSURE = Exposure(1.0 / 60.0, 100.0, 2.0)
LEVEL = saturation_cd_m2(EXPOSURE)


def _decoded(data: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture[..., ::-1])


def _patches() -> np.ndarray:
    """Eight flat patches of 64 x 64, from 1 % to 90 % of saturation, of different colours."""
    levels = np.geomspace(0.01, 0.9, 8)
    colours = np.array([1.0, 0.6, 0.3])
    row = np.stack([np.roll(colours, index) * level for index, level in enumerate(levels)])
    wide = np.repeat(row[None], 256, axis=0)
    return (LEVEL * np.repeat(wide, 64, axis=1)).astype(np.float32)


@pytest.mark.parametrize("curve", CURVES, ids=[curve.name for curve in CURVES])
def test_linear_over_the_whole_range(curve: Curve) -> None:
    """Mean of the decoded, linearised patch equals environment / saturation."""
    environment = _patches()
    data = shoot(environment, GENERIC, EXPOSURE, curve=curve, quality=98, subsampling="4:4:4")
    light = curve.response()[_decoded(data)]
    for index in range(8):
        inner = (slice(16, -16), slice(64 * index + 16, 64 * index + 48))
        wanted = environment[inner][0, 0] / LEVEL
        # 7,168 pixels; half a code of JPEG bias at most.
        slope = np.gradient(curve.response())[np.rint(255.0 * curve.encode(wanted)).astype(int)]
        assert (np.abs(light[inner].mean(axis=(0, 1)) - wanted) < 0.01 * wanted + 0.5 * slope).all()


def test_stops_and_iso_and_aperture_expose_alike() -> None:
    """Twice the time, twice the ISO or an f-number less by root 2: the same light again."""
    environment = np.full((64, 128, 3), 0.1 * LEVEL, dtype=np.float32)
    base = SRGB.response()[develop(environment, GENERIC, EXPOSURE)].mean()
    for other in (
        replace(EXPOSURE, shutter_s=2.0 * EXPOSURE.shutter_s),
        replace(EXPOSURE, iso=200.0),
        replace(EXPOSURE, aperture=2.0 / np.sqrt(2.0)),
    ):
        picture = develop(environment, GENERIC, other)
        assert SRGB.response()[picture].mean() == pytest.approx(2.0 * base, rel=0.005)


def test_scale_is_the_luminance_of_one_unit() -> None:
    environment = np.full((16, 32, 3), 0.2, dtype=np.float32)
    scaled = develop(environment, GENERIC, EXPOSURE, scale=LEVEL, noise=False)
    plain = develop(environment * np.float32(LEVEL), GENERIC, EXPOSURE, noise=False)
    np.testing.assert_array_equal(scaled, plain)
    assert (scaled == round(255.0 * float(SRGB.encode(0.2)))).all()


def test_each_channel_clips_by_itself() -> None:
    environment = np.zeros((16, 32, 3), dtype=np.float32)
    environment[:] = np.array([5.0, 0.5, 0.001]) * LEVEL
    picture = develop(environment, GENERIC, EXPOSURE)
    assert (picture[..., 0] == 255).all()
    assert (picture[..., 1] < 250).all()
    assert (picture[..., 2] < 20).all()
    environment[:] = 1.3 * LEVEL
    assert (develop(environment, THETA_S, EXPOSURE) == 255).all()
    environment[:] = 1e7 * LEVEL
    assert (_decoded(shoot(environment, THETA_S, EXPOSURE)) == 255).all()
    environment[:] = 0.0
    assert develop(environment, THETA_S, EXPOSURE, noise=False).max() == 0


def test_noise_of_a_frame_is_the_sensors() -> None:
    camera = replace(GENERIC, full_well=4000.0, read_noise=6.0)
    environment = np.full((512, 1024, 3), 0.3 * LEVEL, dtype=np.float32)
    light = SRGB.response()[develop(environment, camera, EXPOSURE)]
    wells = 4000.0 / np.array(camera.channel_gains)
    variance = 0.3 / wells + (6.0 / wells) ** 2
    # Rounding to bytes adds a twelfth of a step squared.
    step = float(np.gradient(SRGB.response())[int(255 * SRGB.encode(0.3))])
    np.testing.assert_allclose(light.var(axis=(0, 1)), variance + step**2 / 12.0, rtol=0.02)


def test_seeds() -> None:
    environment = _patches()
    first = shoot(environment, THETA_S, EXPOSURE, seed=1)
    assert first == shoot(environment, THETA_S, EXPOSURE, seed=1)
    assert first != shoot(environment, THETA_S, EXPOSURE, seed=2)
    clean = shoot(environment, THETA_S, EXPOSURE, seed=1, noise=False)
    assert clean == shoot(environment, THETA_S, EXPOSURE, seed=2, noise=False)


def test_lens_gain_brightens_one_half() -> None:
    environment = np.full((64, 128, 3), 0.1 * LEVEL, dtype=np.float32)
    light = SRGB.response()[develop(environment, GENERIC, EXPOSURE, lens_gain=(1.5, 0.75))]
    assert light[:, 44:84].mean() == pytest.approx(0.15, rel=0.01)
    assert light[:, :28].mean() == pytest.approx(0.075, rel=0.01)
    assert light[:, 100:].mean() == pytest.approx(0.075, rel=0.01)


def test_white_balance_and_channel_curves() -> None:
    environment = np.full((64, 128, 3), 0.1 * LEVEL, dtype=np.float32)
    curves = (SRGB, GAMMA_18, LOG)
    picture = develop(
        environment, GENERIC, EXPOSURE, white_balance=(1.5, 1.0, 0.5), curve=curves, noise=False
    )
    for channel, share in enumerate((0.15, 0.1, 0.05)):
        wanted = 255.0 * curves[channel].encode(share)
        assert np.abs(picture[..., channel] - wanted).max() <= 0.51


def test_bloom_lights_the_surroundings() -> None:
    environment = np.zeros((64, 128, 3), dtype=np.float32)
    environment[32, 64] = 1e4 * LEVEL
    plain = develop(environment, GENERIC, EXPOSURE, noise=False)
    spread = develop(environment, GENERIC, EXPOSURE, noise=False, bloom=0.01, bloom_deg=4.0)
    assert (plain > 0).sum() == 3
    assert (spread[30:35, 62:67] > 100).all()


@pytest.mark.parametrize("pose", [XmpPose(0.0, 25.0), XmpPose(-29.0, -35.8), XmpPose(40.0, -12.0)])
def test_tilt_is_undone_by_its_rotation(pose: XmpPose) -> None:
    """A lamp at a known place is found where the pose says, and back after levelling."""
    environment = np.full((256, 512, 3), 0.02 * LEVEL, dtype=np.float32)
    looks = sphere.directions((256, 512)).astype(np.float64)
    lamp = sphere.direction(50.0, 20.0)
    environment[looks @ lamp > np.cos(np.radians(4.0))] = 0.8 * LEVEL
    picture = develop(environment, THETA_S, EXPOSURE, tilt=pose, smooth=True)
    # By hand, with no help from the code under test: the accelerometer of a Theta sees up under
    # the pitch in one plane and under the roll in another; the front lens keeps its azimuth.
    p, r = np.tan(np.radians([pose.pitch_deg, pose.roll_deg]))
    up = np.array([r, 1.0, p]) / np.sqrt(1.0 + p * p + r * r)
    front = np.array([0.0, 0.0, 1.0]) - up * up[2]
    front /= np.linalg.norm(front)
    levelling = np.stack([np.cross(up, front), up, front])
    assert _angle(_lamp(picture), levelling.T @ lamp) < 0.3
    assert _angle(_lamp(np.asarray(sphere.remap_frame(picture, levelling))), lamp) < 0.3


def _lamp(picture: np.ndarray) -> np.ndarray:
    """Direction of the middle of the bright pixels."""
    shape = (picture.shape[0], picture.shape[1])
    weights = (picture[..., 1] > 140) * np.cos(np.linspace(np.pi / 2, -np.pi / 2, shape[0]))[
        :, None
    ]
    middle = np.tensordot(weights, sphere.directions(shape).astype(np.float64), axes=2)
    return np.asarray(middle / np.linalg.norm(middle))


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


def test_cameras_that_level_show_no_tilt() -> None:
    environment = _patches()
    pose = XmpPose(10.0, 5.0)
    straight = develop(environment, THETA_V, EXPOSURE, noise=False)
    np.testing.assert_array_equal(
        develop(environment, THETA_V, EXPOSURE, noise=False, tilt=pose), straight
    )
    off = develop(environment, THETA_V, EXPOSURE, noise=False, tilt=pose, levels=False)
    assert (off != straight).mean() > 0.2


def test_shift_adds_to_the_tilt() -> None:
    environment = sphere.directions((128, 256)) * np.float32(0.3 * LEVEL) + np.float32(0.4 * LEVEL)
    shift = sphere.rotation(12.0, 8.0, -5.0)
    options: dict[str, Any] = {"tilt": XmpPose(20.0, -10.0), "smooth": True, "noise": False}
    tilted = develop(environment, THETA_S, EXPOSURE, **options)
    options["shift"] = shift
    both = develop(environment, THETA_S, EXPOSURE, **options)
    back = np.asarray(sphere.remap_frame(both, shift)).astype(float)
    assert np.abs(back - tilted).max() <= 3.0
    assert np.abs(both.astype(float) - tilted).max() > 15.0


def test_large_frames_of_a_real_scene_agree_with_the_truth() -> None:
    place = read_environment(resources() / "demo" / "scenes" / "interior.exr")
    scale = 100.0
    exposure = Exposure(1.2 / 4.0 / (scale * float(np.percentile(place.radiance, 90))), 100.0, 0.5)
    picture = develop(place.radiance, GENERIC, exposure, scale=scale, shape=(1056, 2112))
    truth = enlarged(place.radiance, (1056, 2112)) * (scale / saturation_cd_m2(exposure))
    light = SRGB.response()[picture].astype(np.float32)
    free = (truth > 0.01) & (truth < 0.9)
    assert free.mean() > 0.5
    ratio = (light / np.maximum(truth, 1e-6))[free]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.003)
    small, whole = (reduce_radiance(np.minimum(x, 1.0), (32, 64)) for x in (light, truth))
    np.testing.assert_allclose(small, whole, rtol=0.02, atol=2e-4)


@pytest.mark.parametrize(
    "options",
    [
        {"quality": 0}, {"quality": 101}, {"subsampling": "4:1:0"}, {"scale": 0.0},
        {"lens_gain": (1.0, 0.0)}, {"white_balance": (1.0, -1.0, 1.0)}, {"shape": (10, 30)},
        {"bloom": 2.0},
    ],
)  # fmt: skip
def test_nonsense_is_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"."):
        shoot(np.ones((16, 32, 3), np.float32), GENERIC, EXPOSURE, **options)


def test_quality_and_subsampling_reach_the_file() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (64, 128, 3), dtype=np.uint8)
    sizes = [len(jpeg(picture, quality)) for quality in (30, 75, 95, 100)]
    assert sizes == sorted(sizes)
    factors = {"4:2:0": 0x22, "4:2:2": 0x21, "4:4:4": 0x11}
    for name, factor in factors.items():
        data = jpeg(picture, 95, name)
        head = data.index(b"\xff\xc0")
        # Start of frame: length, precision, height, width, count, then id and sampling.
        assert data[head + 11] == factor
    np.testing.assert_allclose(_decoded(jpeg(picture, 100, "4:4:4")), picture, atol=6)


def test_full_sizes_of_the_cameras() -> None:
    assert [camera.shape[1] for camera in (THETA_S, THETA_V, THETA_Z1, THETA_X)] == [
        5376, 5376, 6720, 11008,
    ]  # fmt: skip


@pytest.mark.slow
@pytest.mark.alone
def test_a_full_frame_takes_about_a_second() -> None:
    """In units of decoding the very file it makes, since machines differ."""
    environment = read_environment(resources() / "demo" / "scenes" / "forest.exr").radiance
    ratios = []
    for seed in range(3):
        start = time.process_time()
        data = shoot(environment, THETA_S, EXPOSURE, shape=THETA_S.shape, scale=300.0, seed=seed)
        middle = time.process_time()
        _decoded(data)
        ratios.append((middle - start) / (time.process_time() - middle))
    # 0.1 s or so to decode.
    assert min(ratios) < 20.0
