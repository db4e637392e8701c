"""Reduction in bands, held against the reduction of whole panoramas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.environment.environment import energy, reduce_radiance
from app.core.measure.read.resampling import Reduction


def reduced(
    plane: NDArray[Any], wanted: tuple[int, int], bands: int, panorama: bool
) -> NDArray[Any]:
    reduction = Reduction.between(plane.shape, wanted, panorama)
    result = np.zeros(wanted, np.float32)
    for start in range(0, plane.shape[0], bands):
        stop = min(start + bands, plane.shape[0])
        first, shares = reduction.rows(start, stop)
        part = reduction.reduced(shares, plane[start:stop])
        result[first : first + part.shape[0]] += part
    return result


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ((672, 1344), (256, 512)),
        ((512, 1024), (32, 64)),
        ((336, 672), (32, 64)),
        ((101, 202), (30, 60)),
        ((337, 674), (100, 199)),
        ((64, 128), (64, 128)),
        ((64, 128), (1, 1)),
    ],
)
@pytest.mark.parametrize("bands", [8, 13, 5000])
def test_the_same_as_the_reduction_of_the_whole(
    given: tuple[int, int], wanted: tuple[int, int], bands: int
) -> None:
    plane = np.random.default_rng(1).random(given, dtype=np.float32)
    # A small sun in the middle of things, and one on the first row.
    plane[given[0] // 3, given[1] // 5] = 1e5
    plane[0, 3] = 1e4
    small = reduced(plane, wanted, bands, panorama=True)
    oracle = reduce_radiance(plane[..., None], wanted)[..., 0]
    np.testing.assert_allclose(small, oracle, rtol=2e-4, atol=1e-6)
    np.testing.assert_allclose(energy(small), energy(plane), rtol=1e-5)


def test_ordinary_pictures_count_all_rows_the_same() -> None:
    plane = np.random.default_rng(2).random((60, 80), dtype=np.float32)
    small = reduced(plane, (20, 40), 7, panorama=False)
    np.testing.assert_allclose(small, plane.reshape(20, 3, 40, 2).mean(axis=(1, 3)), rtol=1e-5)


def test_bands_are_whole_periods_where_they_fit() -> None:
    reduction = Reduction.between((2688, 5376), (1024, 2048), True)
    assert reduction.band_rows(45_000) == 8
    assert reduction.band_rows(45_000 * 5) == 21
    assert Reduction.between((5504, 11008), (1024, 2048), True).band_rows(1) == 1


def test_enlarging_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot reduce"):
        Reduction.between((32, 64), (64, 128), True)
