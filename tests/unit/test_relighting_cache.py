"""A prepared light gives what the full matrix gives, at every turn and for every size."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.errors import EnvironmentFileError
from app.core.solver.relighting_cache import (
    counted_light,
    light_table,
    painted_curves,
    table_picture,
)
from app.core.solver.solve import solve_on_table
from app.core.solver.transport import render, to_image
from app.core.solver.weights import painted
from benchmarks.speed.plain_search import matrix
from tests.helpers.painted import solve_painted
from tests.helpers.synthetic import lambert_sphere_transport

TRANSPORT = lambert_sphere_transport()


def _light(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.exp(1.5 * rng.standard_normal((32, 64, 3)))


def _luminance(light: np.ndarray) -> np.ndarray:
    return np.asarray(light @ np.asarray(TRANSPORT.header.luminance_weights))


def test_curves_are_those_of_the_full_matrix() -> None:
    rng = np.random.default_rng(8)
    count = len(TRANSPORT.pixels)
    values, ignored = rng.uniform(-1, 1, count), rng.random(count) < 0.3
    weights = painted(TRANSPORT, values, ignored)
    luminance = 1e4 * _luminance(_light(1))
    result = solve_painted(TRANSPORT, weights, luminance)
    full = matrix(TRANSPORT).astype(np.float64)
    target = np.maximum(weights.weights @ full, 0)
    studio = (weights.weights @ full) @ target / ((weights.active / weights.count) @ full @ target)
    f = weights.weights
    for turn in range(0, 64, 5):
        lit = full @ np.roll(luminance, -turn, axis=1).ravel()
        face = lit[weights.active]
        assert result.quality_curve[turn] == pytest.approx(f @ lit, rel=2e-5, abs=1e-4 * lit.mean())
        match = 100 * np.corrcoef(values[weights.active], face)[0, 1]
        assert result.match_curve[turn] == pytest.approx(match, abs=2e-3)
        strength = 100 * (f @ lit) / face.mean() / studio
        assert result.strength_curve[turn] == pytest.approx(strength, abs=2e-3)


def test_one_light_serves_many_paintings() -> None:
    rng = np.random.default_rng(2)
    light = _light(2)
    table = light_table(TRANSPORT, light, pictures=True)
    for _ in range(3):
        weights = painted(TRANSPORT, rng.uniform(-1, 1, len(TRANSPORT.pixels)))
        once = solve_painted(TRANSPORT, weights, light)
        again = solve_on_table(table, weights, counted=counted_light(table, weights.active))
        np.testing.assert_allclose(again.match_curve, once.match_curve, atol=1e-6)
        np.testing.assert_allclose(again.strength_curve, once.strength_curve, atol=1e-6)
        np.testing.assert_allclose(again.quality_curve, once.quality_curve, atol=1e-6)
        assert again.turn_refined_deg == once.turn_refined_deg


@pytest.mark.parametrize("turn", [0, 7, 63])
def test_pictures_at_grid_turns_are_renders(turn: int) -> None:
    light = _light(3)
    table = light_table(TRANSPORT, light, pictures=True)
    picture = table_picture(table, 5.625 * turn)
    expected = to_image(TRANSPORT, render(TRANSPORT, np.roll(light, -turn, axis=1)))
    np.testing.assert_allclose(picture, expected, atol=2e-5 * expected.max())


def test_pictures_between_turns_lie_between() -> None:
    light = _light(4)
    table = light_table(TRANSPORT, light, pictures=True)
    one, two = table_picture(table, -5.625), table_picture(table, 0.0)
    np.testing.assert_allclose(table_picture(table, -5.625 / 2), (one + two) / 2, rtol=1e-4)
    np.testing.assert_array_equal(table_picture(table, 360.0), two)


def test_without_colours_there_are_no_pictures() -> None:
    table = light_table(TRANSPORT, _luminance(_light(5)))
    with pytest.raises(ValueError, match="no pictures"):
        table_picture(table, 0.0)


def test_weights_that_are_the_same_everywhere_ask_for_nothing() -> None:
    table = light_table(TRANSPORT, _luminance(_light(6)))
    weights = painted(TRANSPORT, np.full(len(TRANSPORT.pixels), 0.1))
    found = painted_curves(table, weights)
    assert found.norm == 0
    assert found.studio == 0
    result = solve_on_table(table, weights)
    assert (result.match, result.strength, result.turn_deg) == (0.0, 0.0, 0.0)


def test_everything_ignored_is_an_answer_too() -> None:
    table = light_table(TRANSPORT, _luminance(_light(6)))
    count = len(TRANSPORT.pixels)
    weights = painted(TRANSPORT, np.linspace(0, 1, count), np.ones(count, bool))
    result = solve_on_table(table, weights)
    assert not result.attainable
    assert np.isfinite(result.match_curve).all()


@pytest.mark.parametrize(
    "light", [np.zeros((32, 64)), np.full((32, 64), np.nan), np.ones((16, 32))]
)
def test_lights_of_no_use_are_refused(light: np.ndarray) -> None:
    with pytest.raises(EnvironmentFileError):
        light_table(TRANSPORT, light)
    with pytest.raises(EnvironmentFileError):
        light_table(TRANSPORT, np.repeat(light[..., None], 3, axis=2))
    with pytest.raises(EnvironmentFileError):
        light_table(TRANSPORT, np.repeat(light[..., None], 2, axis=2))
    with pytest.raises(EnvironmentFileError, match="colours"):
        light_table(TRANSPORT, np.ones((32, 64)), pictures=True)
