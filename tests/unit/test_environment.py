"""Reduction, rotation and repair of environments."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base.errors import EnvironmentFileError
from app.core.environment import environment as env
from app.core.environment.remarks import ClippedFile, Repaired
from benchmarks.truth.stock import rotate
from tests.helpers.pace import units
from tests.helpers.people import mean_luminance

SIZES = st.sampled_from([(1, 2), (3, 6), (5, 10), (16, 32), (32, 64), (37, 74), (50, 100)])


def some_radiance(shape: tuple[int, int], seed: int = 0) -> np.ndarray:
    """Radiance with a range of a million to one, (H, W, 3) float32."""
    rng = np.random.default_rng(seed)
    return np.exp(rng.normal(0.0, 3.0, (*shape, 3))).astype(np.float32)


@pytest.mark.parametrize("shape", [(1, 2), (2, 4), (7, 14), (32, 64), (512, 1024)])
def test_solid_angles_sum_to_the_sphere(shape: tuple[int, int]) -> None:
    angles = env.solid_angles(shape)
    assert angles.sum() * shape[1] == pytest.approx(4.0 * np.pi, rel=1e-13)
    np.testing.assert_array_equal(angles, angles[::-1])
    assert (angles > 0.0).all()


def test_solid_angle_of_the_polar_row_is_the_spherical_cap() -> None:
    cap = 2.0 * np.pi * (1.0 - np.cos(np.pi / 32))
    assert env.solid_angles((32, 64))[0] * 64 == pytest.approx(cap, rel=1e-10)


@given(SIZES, SIZES, st.floats(-720.0, 720.0))
@settings(max_examples=60, deadline=None)
def test_reduction_keeps_the_energy(
    given_shape: tuple[int, int], wanted: tuple[int, int], turn: float
) -> None:
    radiance = some_radiance(given_shape)
    reduced = env.reduce_radiance(radiance, wanted, turn)
    assert reduced.shape == (*wanted, 3)
    assert reduced.dtype == np.float32
    np.testing.assert_allclose(env.energy(reduced), env.energy(radiance), rtol=1e-6)
    assert (reduced >= 0.0).all()
    assert reduced.max() <= radiance.max() * (1 + 1e-6)


@given(SIZES, SIZES, st.floats(-360.0, 360.0))
@settings(max_examples=40, deadline=None)
def test_a_constant_panorama_stays_constant(
    given_shape: tuple[int, int], wanted: tuple[int, int], turn: float
) -> None:
    reduced = env.reduce_radiance(np.full((*given_shape, 3), 3.7, np.float32), wanted, turn)
    np.testing.assert_allclose(reduced, 3.7, rtol=1e-6)


@pytest.mark.parametrize("row", [0, 1, 15, 16, 30, 31])
def test_one_bright_texel_ends_where_it_belongs(row: int) -> None:
    radiance = np.zeros((512, 1024, 3), np.float32)
    radiance[row * 16 + 3, 200] = 1e5
    reduced = env.reduce_radiance(radiance)
    assert np.argwhere(reduced[..., 0]).tolist() == [[row, 200 // 16]]
    fine, coarse = env.solid_angles((512, 1024)), env.solid_angles((32, 64))
    expected = 1e5 * fine[row * 16 + 3] / coarse[row]
    assert reduced[row, 12, 1] == pytest.approx(expected, rel=1e-6)


def test_reduction_by_whole_factors_matches_a_plain_weighted_mean() -> None:
    radiance = some_radiance((64, 128))
    weights = env.solid_angles((64, 128))[:, None, None]
    summed = (radiance * weights).reshape(32, 2, 64, 2, 3).sum(axis=(1, 3))
    plain = summed / (2.0 * weights.reshape(32, 2, 1, 1).sum(axis=1))
    np.testing.assert_allclose(env.reduce_radiance(radiance), plain, rtol=2e-6)


def test_own_size_is_kept_to_the_bit() -> None:
    radiance = some_radiance((32, 64))
    np.testing.assert_array_equal(env.reduce_radiance(radiance), radiance)


@given(st.integers(-200, 200))
@settings(max_examples=30, deadline=None)
def test_turning_by_whole_texels_is_a_rotation(columns: int) -> None:
    radiance = some_radiance((48, 96))
    turned = env.reduce_radiance(radiance, turn_deg=columns * 5.625)
    np.testing.assert_allclose(turned, rotate(env.reduce_radiance(radiance), columns), rtol=2e-6)


def test_turn_brings_the_faced_azimuth_to_the_centre() -> None:
    # A lamp at azimuth +90 (three quarters across) is in front after a turn of 90 clockwise.
    radiance = np.zeros((64, 128, 3), np.float32)
    radiance[32, 96] = 1.0
    turned = env.reduce_radiance(radiance, (64, 128), 90.0)
    assert np.argwhere(turned[..., 0]).tolist() == [[32, 64]]


def test_any_turn_is_the_limit_of_fine_rotations() -> None:
    # 33.3 degrees of 3600 columns are 333 of them: the exact answer by rolling, then reducing.
    radiance = some_radiance((8, 3600))[:, :, :1]
    rolled = env.reduce_radiance(rotate(radiance, 333), (8, 16))
    np.testing.assert_allclose(env.reduce_radiance(radiance, (8, 16), 33.3), rolled, rtol=2e-6)


@given(SIZES, st.floats(-360.0, 360.0))
@settings(max_examples=40, deadline=None)
def test_mirroring_commutes_with_reduction(shape: tuple[int, int], turn: float) -> None:
    radiance = some_radiance(shape)
    mirrored = env.reduce_radiance(np.ascontiguousarray(radiance[:, ::-1]), turn_deg=-turn)
    expected = env.reduce_radiance(radiance, turn_deg=turn)[:, ::-1]
    np.testing.assert_allclose(mirrored, expected, rtol=1e-5, atol=1e-9)


@given(st.integers(1, 5), st.integers(1, 5))
@settings(max_examples=20, deadline=None)
def test_enlarging_then_reducing_gives_back_the_same(down: int, across: int) -> None:
    radiance = some_radiance((8, 16))
    larger = env.enlarge(radiance, (8 * down, 16 * across))
    np.testing.assert_allclose(env.reduce_radiance(larger, (8, 16)), radiance, rtol=1e-6)
    assert set(np.unique(larger)) == set(np.unique(radiance))


@pytest.mark.parametrize("shape", [(12, 32), (16, 24), (4, 16), (0, 0)])
def test_enlarging_by_a_fraction_is_refused(shape: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="whole multiple"):
        env.enlarge(some_radiance((8, 16)), shape)


def test_repairs_are_counted_by_texel() -> None:
    radiance = np.ones((16, 32, 3), np.float32)
    radiance[3, 4] = 5.0
    radiance[0, 0] = np.nan
    radiance[0, 1, 2] = np.nan
    radiance[1, 1, 0] = np.inf
    radiance[2, 2] = -0.5
    radiance[2, 3, 1] = -np.inf
    place = env.from_radiance(radiance, "hall")
    assert (place.repairs.nan, place.repairs.infinite, place.repairs.negative) == (2, 1, 2)
    assert place.radiance[0, 0].tolist() == [0.0, 0.0, 0.0]
    assert place.radiance[0, 1].tolist() == [1.0, 1.0, 0.0]
    assert place.radiance[1, 1].tolist() == [300000.0, 1.0, 1.0]
    assert place.radiance[2, 2:4].min() == 0.0
    assert np.isfinite(place.radiance).all()
    assert place.warnings == (Repaired("hall", 2, 1, 2, 300_000.0), ClippedFile("hall"))


def test_a_sound_panorama_has_no_warning_and_is_read_only() -> None:
    place = env.from_radiance(np.ones((8, 16, 3), np.float32), "hall")
    assert place.warnings == ()
    assert place.repairs.total == 0
    assert place.shape == (8, 16)
    with pytest.raises(ValueError, match="read-only"):
        place.radiance[0, 0, 0] = 1.0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1000.0])
def test_a_panorama_that_would_mostly_be_made_up_is_refused(value: float) -> None:
    rows, columns = 64, 128
    light = np.ones((rows, columns, 3), np.float32)
    light[:, :3] = value  # 2.3 % of the sphere
    if value != -1000.0:
        assert env.from_radiance(light.copy(), "hall").repairs.total == 3 * rows
    light[:, 3:5] = value  # 3.9 %
    with pytest.raises(EnvironmentFileError, match="hall is damaged"):
        env.from_radiance(light, "hall")
    # As many texels at a pole are next to nothing of the sphere.
    light = np.ones((rows, columns, 3), np.float32)
    light[:2] = max(value, -1.0)
    assert env.from_radiance(light, "hall").repairs.total == 2 * columns


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_nothing_but_black_is_refused(value: float) -> None:
    with pytest.raises(EnvironmentFileError, match="black"):
        env.from_radiance(np.full((16, 32, 3), value, np.float32), "cellar")


@pytest.mark.parametrize("shape", [(16, 16, 3), (16, 32, 4), (16, 32), (0, 0, 3)])
def test_arrays_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(EnvironmentFileError, match="not a full panorama"):
        env.from_radiance(np.ones(shape, np.float32), "hall")


def test_mean_luminance_weighs_by_solid_angle() -> None:
    radiance = np.zeros((2, 4, 3), np.float32)
    radiance[0] = 2.0
    assert mean_luminance(radiance) == pytest.approx(1.0, rel=1e-6)


def test_the_largest_float_does_not_overflow() -> None:
    radiance = np.full((64, 128, 3), np.finfo(np.float32).max, np.float32)
    assert np.isfinite(env.reduce_radiance(radiance)).all()


@pytest.mark.slow
@pytest.mark.alone
def test_reducing_a_1k_panorama_costs_less_than_60_units() -> None:
    radiance = some_radiance((512, 1024))
    assert units(lambda: env.reduce_radiance(radiance, turn_deg=10.0)) < 60
