"""What a simulated camera's lenses see: another size, a rotation, spread light, unequal gains."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.core.base import sphere
from app.core.environment.environment import energy, from_radiance, reduce_radiance, solid_angles
from app.core.measure.bracket.alignment.levelling import tilt_rotation
from app.core.measure.read.frame import XmpPose
from app.devices.simulated.optics import column_gains
from benchmarks.light.shots.brackets import bloomed, enlarged
from benchmarks.light.shots.views import view_of
from tests.helpers.shared import SHARED, needs_shared


def _environment(shape: tuple[int, int] = (32, 64), seed: int = 3) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return generator.gamma(0.5, 1.0, (*shape, 3)).astype(np.float32)


def _broad(shape: tuple[int, int] = (128, 256)) -> np.ndarray:
    """A smooth environment whose value tells the direction: X, Y, Z + 1."""
    return sphere.directions(shape) + np.float32(1.0)


@pytest.mark.parametrize("shape", [(64, 128), (84, 168), (33, 66), (168, 336)])
def test_constant_texels_reduce_to_themselves(shape: tuple[int, int]) -> None:
    environment = _environment()
    large = enlarged(environment, shape)
    assert large.shape == (*shape, 3)
    np.testing.assert_allclose(energy(large), energy(environment), rtol=1e-5)
    np.testing.assert_allclose(large, reduce_radiance(environment, shape), rtol=2e-4, atol=1e-5)


def test_whole_factors_repeat_texels() -> None:
    environment = _environment()
    large = enlarged(environment, (96, 192))
    np.testing.assert_array_equal(large, np.repeat(np.repeat(environment, 3, 0), 3, 1))


def test_smooth_is_bilinear_between_the_middles() -> None:
    environment = _environment()
    large = enlarged(environment, (84, 168), smooth=True)
    theirs = cv2.resize(environment, (168, 84), interpolation=cv2.INTER_LINEAR)
    np.testing.assert_allclose(large[3:-3, 3:-3], theirs[3:-3, 3:-3], rtol=1e-3, atol=1e-4)
    # Over the edge the first column is as near to the last one as to the second.
    turned = enlarged(np.roll(environment, 32, axis=1), (84, 168), smooth=True)
    np.testing.assert_allclose(np.roll(turned, 84, axis=1), large, rtol=1e-5)


def test_smaller_is_the_mean_by_solid_angle() -> None:
    environment = _environment()
    np.testing.assert_allclose(
        enlarged(environment, (10, 20), smooth=True), reduce_radiance(environment, (10, 20))
    )


def test_the_same_size_is_untouched() -> None:
    environment = _environment()
    for smooth in (False, True):
        seen = enlarged(environment, (32, 64), smooth=smooth)
        np.testing.assert_array_equal(seen, environment)
        seen[:] = 0.0
        assert environment.any()


def test_read_only_environments_are_fine() -> None:
    place = from_radiance(_environment(), "place")
    seen = view_of(place.radiance, (32, 64)).band(3, 9)
    np.testing.assert_array_equal(seen, place.radiance[3:9])
    seen[:] = 0.0
    np.testing.assert_array_equal(place.radiance, _environment())


def test_any_picture_in_its_own_size() -> None:
    picture = np.random.default_rng(1).random((20, 31, 3)).astype(np.float32)
    np.testing.assert_array_equal(enlarged(picture, (20, 31)), picture)
    with pytest.raises(ValueError, match="2:1"):
        enlarged(picture, (40, 62))
    with pytest.raises(ValueError, match="2:1"):
        view_of(picture, (20, 31), rotation=np.eye(3))
    with pytest.raises(ValueError, match=r"\(H, W, 3\)"):
        enlarged(picture[..., 0], (20, 31))


@pytest.mark.parametrize("smooth", [False, True])
def test_bands_make_up_the_frame(smooth: bool) -> None:
    for rotation in (None, sphere.rotation(20.0, -30.0, 10.0)):
        view = view_of(_environment(), (80, 160), smooth=smooth, rotation=rotation)
        whole = view.band(0, 80)
        parts = [view.band(start, min(start + 7, 80)) for start in range(0, 80, 7)]
        np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-5)


@pytest.mark.parametrize("smooth", [False, True])
def test_no_rotation_is_the_identity(smooth: bool) -> None:
    environment = _environment()
    plain = view_of(environment, (96, 192), smooth=smooth).band(0, 96)
    turned = view_of(environment, (96, 192), smooth=smooth, rotation=np.eye(3)).band(0, 96)
    np.testing.assert_allclose(turned, plain, atol=0.05 if smooth else 0.0)


def test_rotation_takes_the_frames_directions_to_the_environments() -> None:
    rotation = sphere.rotation(25.0, 40.0, -70.0)
    seen = view_of(_broad(), (180, 360), smooth=True, rotation=rotation).band(0, 180)
    wanted = sphere.directions((180, 360)) @ rotation.T
    np.testing.assert_allclose(seen - 1.0, wanted, atol=0.002)


def test_remap_by_the_shift_undoes_it() -> None:
    environment = _broad()
    shift = sphere.rotation(3.0, 2.0, 1.0)
    seen = view_of(environment, (128, 256), rotation=shift).band(0, 128)
    back = sphere.remap_frame(seen, shift)
    np.testing.assert_allclose(back, environment, atol=0.002)


def test_pitch_raises_the_front_lens() -> None:
    # GPano: PosePitchDegrees is the elevation of the picture's centre above the horizon.
    rotation = tilt_rotation(XmpPose(30.0, 0.0))
    np.testing.assert_allclose(
        rotation @ sphere.direction(0.0, 0.0), sphere.direction(0.0, 30.0), atol=1e-12
    )


def test_roll_lowers_the_right_side() -> None:
    # GPano: as roll increases, the horizon rotates counter-clockwise in the image. Right of the
    # centre the picture then shows what is below the horizon: the horizon itself is higher.
    rotation = tilt_rotation(XmpPose(0.0, 20.0))
    right = rotation @ sphere.direction(90.0, 0.0)
    np.testing.assert_allclose(right, sphere.direction(90.0, -20.0), atol=1e-12)
    np.testing.assert_allclose(
        rotation @ sphere.direction(0.0, 0.0), sphere.direction(0.0, 0.0), atol=1e-12
    )


@pytest.mark.parametrize(
    "pose", [XmpPose(-29.0, -35.8), XmpPose(40.0, 40.0, 225.0), XmpPose(-5.0, 170.0)]
)
def test_front_lens_stays_at_azimuth_zero(pose: XmpPose) -> None:
    front = tilt_rotation(pose) @ sphere.direction(0.0, 0.0)
    assert front[0] == pytest.approx(0.0, abs=1e-12)
    assert front[2] > 0.0


@pytest.mark.slow
@needs_shared
def test_real_tilted_frame_has_upright_edges() -> None:
    """A Theta S that states -29.0 / -35.8: undoing it makes the shop's edges vertical."""
    path = SHARED / "theta" / "theta_s_tilted_R0010298.JPG"
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    small = cv2.resize(picture, (2688, 1344), interpolation=cv2.INTER_AREA)
    lean, upright = _upright_lines(small, tilt_rotation(XmpPose(-29.0, -35.8)))
    assert abs(lean) <= 1.0
    # The other order of the two, roll within pitch, leaves them leaning; so do other signs.
    for other in (
        sphere.rotation(0.0, -29.0, -35.8),
        tilt_rotation(XmpPose(29.0, 35.8)),
        tilt_rotation(XmpPose(-29.0, 35.8)),
        tilt_rotation(XmpPose(29.0, -35.8)),
    ):
        _, fewer = _upright_lines(small, other)
        assert fewer < 0.5 * upright


def _upright_lines(picture: np.ndarray, rotation: np.ndarray) -> tuple[float, float]:
    """Median lean in degrees of the nearly upright lines, by length, and the length upright."""
    levelled = np.asarray(sphere.remap_frame(picture, rotation), dtype=np.uint8)
    height = levelled.shape[0]
    found = cv2.createLineSegmentDetector().detect(levelled)[0].reshape(-1, 4)
    along = found[:, 2:] - found[:, :2]
    length = np.hypot(along[:, 0], along[:, 1])
    middle = 0.5 * (found[:, 1] + found[:, 3]) / height
    lean = (np.degrees(np.arctan2(along[:, 0], along[:, 1])) + 90.0) % 180.0 - 90.0
    kept = (length > 60.0) & (np.abs(lean) < 15.0) & (middle > 0.25) & (middle < 0.7)
    lean, length = lean[kept], length[kept]
    order = np.argsort(lean)
    half = np.searchsorted(np.cumsum(length[order]), 0.5 * length.sum())
    return float(lean[order][half]), float(length[np.abs(lean) < 1.5].sum())


def test_bloom_keeps_energy_and_uniform_light() -> None:
    generator = np.random.default_rng(2)
    environment = generator.gamma(0.3, 1.0, (64, 128, 3)).astype(np.float32)
    spread = bloomed(environment, 0.3, 3.0)
    np.testing.assert_allclose(energy(spread), energy(environment), rtol=1e-5)
    np.testing.assert_allclose(bloomed(np.ones((64, 128, 3), np.float32), 0.3, 3.0), 1.0, rtol=1e-5)
    assert (spread >= 0.0).all()


@pytest.mark.parametrize("row", [64, 30, 98])
def test_bloom_is_round_and_as_wide_as_asked(row: int) -> None:
    environment = np.zeros((128, 256, 3), dtype=np.float32)
    environment[row, 100] = 1.0
    spread = bloomed(environment, 0.25, 4.0)[..., 0].astype(np.float64)
    kept = spread[row, 100] * solid_angles((128, 256))[row]
    looks = sphere.directions((128, 256)).astype(np.float64)
    angle = np.degrees(np.arccos(np.clip(looks @ looks[row, 100], -1.0, 1.0)))
    weights = spread * solid_angles((128, 256))[:, None]
    weights[row, 100] = 0.0
    assert kept / (kept + weights.sum()) == pytest.approx(0.76, abs=0.015)
    # Both axes have the standard deviation asked for: the mean square distance is twice its square.
    assert np.average(angle**2, weights=weights) == pytest.approx(2.0 * 4.0**2, rel=0.06)


def test_bloom_passes_over_the_edge_and_the_pole() -> None:
    environment = np.zeros((64, 128, 3), dtype=np.float32)
    environment[32, 0] = environment[0, 20] = 1.0
    spread = bloomed(environment, 1.0, 5.0)[..., 1]
    np.testing.assert_allclose(spread[32, 1], spread[32, -1], rtol=1e-3)
    np.testing.assert_allclose(spread[1, 20], spread[0, 84], rtol=0.1)
    assert spread[0, 84] > 0.0


@pytest.mark.parametrize(("part", "sigma"), [(-0.1, 1.0), (1.1, 1.0), (0.1, 0.0)])
def test_bloom_refuses_nonsense(part: float, sigma: float) -> None:
    with pytest.raises(ValueError, match="bloom"):
        bloomed(np.ones((4, 8, 3), np.float32), part, sigma)


def test_front_lens_has_the_centre_half() -> None:
    gains = column_gains(720, (1.5, 1.0))
    azimuth = 360.0 * ((np.arange(720) + 0.5) / 720 - 0.5)
    np.testing.assert_allclose(gains[np.abs(azimuth) < 85.0], 1.5)
    np.testing.assert_allclose(gains[np.abs(azimuth) > 95.0], 1.0)
    np.testing.assert_allclose(gains, gains[::-1])
    seam = gains[(azimuth > 80.0) & (azimuth < 100.0)]
    assert (np.diff(seam) <= 0.0).all()
    assert np.abs(np.diff(seam)).max() < 0.05
    np.testing.assert_array_equal(column_gains(64, (1.0, 1.0)), 1.0)
