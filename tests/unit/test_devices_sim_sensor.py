"""The simulated sensor: linear, as noisy as counting electrons is, clipped where it is full."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.core.measure.read.frame import Exposure
from app.devices.simulated.cameras import GENERIC, THETA_S
from app.devices.simulated.optics import add_sensor_noise, saturation_cd_m2

PLAIN = replace(GENERIC, full_well=10000.0, read_noise=5.0, channel_gains=(1.0, 1.0, 1.0))


def _counted(share: float, camera: object = PLAIN, iso: float = 100.0, seed: int = 1) -> np.ndarray:
    values = np.full((300, 500, 3), share, dtype=np.float32)
    add_sensor_noise(values, camera, iso, np.random.default_rng(seed))  # type: ignore[arg-type]
    return values.astype(np.float64)


@pytest.mark.parametrize(
    ("share", "iso"), [(0.01, 100), (0.1, 100), (0.9, 100), (0.1, 800), (0.5, 800), (0.8, 800)]
)
def test_mean_is_linear_and_variance_is_shot_plus_read(share: float, iso: float) -> None:
    well = 10000.0 * 100.0 / iso
    values = _counted(share, iso=iso)
    variance = share / well + (5.0 / well) ** 2
    # The cases stay clear of black and white, where clipping would narrow the distribution.
    assert 4.0 * np.sqrt(variance) < min(share, 1.0 - share)
    assert values.mean() == pytest.approx(share, abs=5.0 * np.sqrt(variance / values.size))
    assert values.var() == pytest.approx(variance, rel=0.01)


@pytest.mark.parametrize("electrons", [4.0, 12.0, 60.0, 2000.0])
def test_noise_has_the_moments_of_counted_electrons(electrons: float) -> None:
    """Against electrons counted one by one by numpy's Poisson generator."""
    camera = replace(PLAIN, read_noise=3.0)
    # Far from black, where the clipping of negative counts would hide the distribution.
    ours = _counted(electrons / 10000.0, camera) * 10000.0
    generator = np.random.default_rng(7)
    theirs = generator.poisson(electrons, ours.shape) + generator.normal(0.0, 3.0, ours.shape)
    theirs = np.maximum(theirs, 0.0)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.005)
    assert ours.std() == pytest.approx(theirs.std(), rel=0.01)
    skews = [(((x - x.mean()) / x.std()) ** 3).mean() for x in (ours, theirs)]
    assert skews[0] == pytest.approx(skews[1], abs=0.03)
    assert np.percentile(ours, [5, 50, 95]) == pytest.approx(
        np.percentile(theirs, [5, 50, 95]), rel=0.02, abs=0.25
    )


def test_red_and_blue_are_noisier_by_their_gains() -> None:
    values = _counted(0.4, replace(PLAIN, channel_gains=(1.8, 1.0, 1.6), read_noise=0.0))
    variances = values.var(axis=(0, 1))
    np.testing.assert_allclose(variances / variances[1], [1.8, 1.0, 1.6], rtol=0.03)


def test_clips_at_saturation_and_at_black() -> None:
    assert (_counted(1.2) == 1.0).all()
    assert (_counted(1e9) == 1.0).all()
    dark = _counted(0.0)
    assert dark.min() == 0.0
    assert dark.max() < 6.0 * 5.0 / 10000.0
    # Half of a dark frame's noise is below black, and lost.
    assert (dark == 0.0).mean() == pytest.approx(0.5, abs=0.01)


def test_nothing_counted_without_light_and_read_noise() -> None:
    assert (_counted(0.0, replace(PLAIN, read_noise=0.0)) < 1e-8).all()


def test_seeds_repeat_and_differ() -> None:
    np.testing.assert_array_equal(_counted(0.3), _counted(0.3))
    assert (_counted(0.3) != _counted(0.3, seed=2)).mean() > 0.9


def test_neighbours_are_independent() -> None:
    values = _counted(0.3)[..., 1] - 0.3
    for other in (np.roll(values, 1, axis=1), np.roll(values, 1, axis=0)):
        correlation = float((values * other).mean() / values.var())
        assert abs(correlation) < 0.015


def test_only_in_place() -> None:
    values = np.zeros((4, 8, 3), dtype=np.float32)[:, ::2]
    with pytest.raises(ValueError, match="contiguous"):
        add_sensor_noise(values, PLAIN, 100.0, np.random.default_rng(0))


def test_saturation_follows_iso_12232() -> None:
    # 78 N^2 / (q t S), q = 0.65: f/2, 1/6400 s, ISO 100 saturate at 30,720 cd/m2.
    exposure = Exposure(1.0 / 6400.0, 100.0, 2.0)
    assert saturation_cd_m2(exposure) == pytest.approx(78.0 * 4.0 * 6400.0 / 65.0)
    assert saturation_cd_m2(replace(exposure, known=False)) == saturation_cd_m2(exposure)


def test_theta_s_signal_to_noise() -> None:
    """At half of saturation: the root of 3,000 electrons and 4 more of read noise."""
    values = _counted(0.5, THETA_S)[..., 1]
    assert 0.5 / values.std() == pytest.approx(3000.0 / np.sqrt(3016.0), rel=0.01)
