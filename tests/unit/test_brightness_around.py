"""How bright a place looks behind the sitter, against cases that can be worked out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.solver.face import brightness_around

Floats = NDArray[np.float64]


def _halves(shape: tuple[int, int] = (32, 64)) -> Floats:
    """Light of 4 in the left half of the panorama and of 1 in the right half."""
    light = np.ones(shape)
    light[:, : shape[1] // 2] = 4.0
    return light


def _behind(light: Floats) -> Floats:
    return np.asarray(brightness_around(light[None])[0, 0])


def test_even_light_is_as_bright_as_it_is() -> None:
    assert brightness_around(np.full((1, 32, 64), 7.0)) == pytest.approx(7.0)


def test_the_edge_of_two_halves_is_their_geometric_mean() -> None:
    """Straight behind at turn 0 is the seam of both: sqrt(4 x 1)."""
    assert _behind(_halves())[0] == pytest.approx(2.0)
    # A quarter to the right, and the left half is behind: all of it, but for the tails.
    assert _behind(_halves())[TURNS // 4] == pytest.approx(4.0, rel=1e-3)
    assert _behind(_halves())[3 * TURNS // 4] == pytest.approx(1.0, rel=1e-3)


def test_a_turned_place_turns_it() -> None:
    light = np.random.default_rng(3).uniform(0.1, 5.0, (32, 64))
    turned = np.roll(light, -10, axis=1)
    assert _behind(turned) == pytest.approx(np.roll(_behind(light), -10))


def test_a_small_lamp_does_not_make_a_dark_wall_bright() -> None:
    """One texel of a thousand times the wall: the mean would be a hundred of it."""
    light = np.ones((32, 64))
    light[16, 0] = 1000.0
    assert 1.5 < _behind(light)[0] < 5.0


@pytest.mark.parametrize("width", [32, 128])
def test_other_sizes_have_the_same_turns(width: int) -> None:
    theta = 2 * np.pi * ((np.arange(64) + 0.5) / 64 - 0.5)
    smooth = np.exp(np.cos(theta - 0.4))
    other = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    there = np.exp(np.cos(other - 0.4))
    found = _behind(np.repeat(there[None], width // 2, axis=0))
    assert found == pytest.approx(_behind(np.repeat(smooth[None], 32, axis=0)), rel=0.02)


def test_black_is_no_error() -> None:
    assert np.isfinite(brightness_around(np.zeros((1, 32, 64)))).all()
