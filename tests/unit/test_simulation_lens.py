"""The simulated lenses: bloom and per-lens gain."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base import sphere
from app.core.solver.environment import energy, solid_angles
from app.devices.simulated.lens import bloomed, column_gains


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
