"""The small picture that the first pass makes is OpenCV's, bit for bit."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.core.measure.read.opened_frame import shrunk


@pytest.mark.parametrize("levels", [(0, 256), (254, 256), (0, 2)])
@pytest.mark.parametrize("shape", [(64, 128), (344, 688), (8, 16)])
def test_an_eighth_of_the_size_is_the_mean_of_each_block(
    shape: tuple[int, int], levels: tuple[int, int]
) -> None:
    chance = np.random.default_rng(sum(shape))
    pixels = chance.integers(*levels, (*shape, 3), dtype=np.uint8)
    small = (shape[0] // 8, shape[1] // 8)
    expected = cv2.resize(pixels, small[::-1], interpolation=cv2.INTER_AREA)
    np.testing.assert_array_equal(shrunk(pixels, small), expected)


def test_other_sizes_and_kinds_are_area_means_too() -> None:
    chance = np.random.default_rng(3)
    deep = chance.integers(0, 1 << 16, (64, 128, 3), dtype=np.uint16)
    assert shrunk(deep, (8, 16)).dtype == np.uint16
    odd = chance.integers(0, 256, (60, 120, 3), dtype=np.uint8)
    assert shrunk(odd, (8, 16)).shape == (8, 16, 3)
    same = shrunk(odd, (60, 120))
    assert same is not odd
    np.testing.assert_array_equal(same, odd)
