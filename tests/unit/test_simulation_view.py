"""What the simulated camera sees: enlargement, tilt and shift."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.core.base import sphere
from app.core.hdr.align import tilt_rotation
from app.core.hdr.frame import Pose
from app.core.simulation.view import enlarged, view_of
from app.core.solver.environment import energy, from_radiance, reduce_radiance
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
    rotation = tilt_rotation(Pose(30.0, 0.0))
    np.testing.assert_allclose(
        rotation @ sphere.direction(0.0, 0.0), sphere.direction(0.0, 30.0), atol=1e-12
    )


def test_roll_lowers_the_right_side() -> None:
    # GPano: as roll increases, the horizon rotates counter-clockwise in the image. Right of the
    # centre the picture then shows what is below the horizon: the horizon itself is higher.
    rotation = tilt_rotation(Pose(0.0, 20.0))
    right = rotation @ sphere.direction(90.0, 0.0)
    np.testing.assert_allclose(right, sphere.direction(90.0, -20.0), atol=1e-12)
    np.testing.assert_allclose(
        rotation @ sphere.direction(0.0, 0.0), sphere.direction(0.0, 0.0), atol=1e-12
    )


@pytest.mark.parametrize("pose", [Pose(-29.0, -35.8), Pose(40.0, 40.0, 225.0), Pose(-5.0, 170.0)])
def test_front_lens_stays_at_azimuth_zero(pose: Pose) -> None:
    front = tilt_rotation(pose) @ sphere.direction(0.0, 0.0)
    assert front[0] == pytest.approx(0.0, abs=1e-12)
    assert front[2] > 0.0


@needs_shared
def test_real_tilted_frame_has_upright_edges() -> None:
    """A Theta S that states -29.0 / -35.8: undoing it makes the shop's edges vertical."""
    path = SHARED / "theta" / "theta_s_tilted_R0010298.JPG"
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    small = cv2.resize(picture, (2688, 1344), interpolation=cv2.INTER_AREA)
    lean, upright = _upright_lines(small, tilt_rotation(Pose(-29.0, -35.8)))
    assert abs(lean) <= 1.0
    # The other order of the two, roll within pitch, leaves them leaning; so do other signs.
    for other in (
        sphere.rotation(0.0, -29.0, -35.8),
        tilt_rotation(Pose(29.0, 35.8)),
        tilt_rotation(Pose(-29.0, 35.8)),
        tilt_rotation(Pose(29.0, -35.8)),
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
