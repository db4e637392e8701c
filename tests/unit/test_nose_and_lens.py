"""The instruments of nose and lens: what they hold the program against is right by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.transport import render
from benchmarks.answers.nose_and_lens import (
    best_grade,
    inside,
    is_swapped,
    left_of_nose,
    lit_halves,
    lit_otherwise,
    one_lamp_cases,
)
from benchmarks.truth.lens_against_stock import (
    apart,
    halved,
    load_head,
    over_pairs,
    over_pictures,
    short_way,
    tables_of,
)
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment


def test_sides_of_the_nose_by_hand() -> None:
    """At the panorama's centre the sitter's right is where azimuths grow."""
    assert not left_of_nose(90.0, 0.0)
    assert left_of_nose(-90.0, 0.0)
    assert left_of_nose(170.0, -170.0)
    assert not left_of_nose(-170.0, 170.0)


def test_a_swapped_name_is_noticed() -> None:
    head = load_head()
    lamp = np.repeat(lamp_environment(20.0, 30.0, 12.0)[..., None], 3, axis=2)
    found = 0
    for one in solve_lens(head.pack, tables_of(head), lamp, LensWish("short")):
        if one.lighting != "short":
            continue
        found += 1
        assert not is_swapped(one, 20.0)
        assert is_swapped(replace(one, lighting="broad"), 20.0)
        assert not is_swapped(replace(one, lighting="front"), 20.0)
    assert found > 5


def test_the_lit_half_is_noticed() -> None:
    head = load_head()
    light = np.repeat(lamp_environment(0.0, 20.0, 12.0)[..., None], 3, axis=2).astype(np.float32)
    halves = lit_halves(head.pack, light)
    # With the nose clockwise of the lamp, the lamp is to the sitter's left.
    assert halves[8] > 1.0
    assert halves[-8] < -1.0
    for one in solve_lens(head.pack, tables_of(head), light, LensWish("broad")):
        if one.attainable and one.lighting == "broad":
            assert not lit_otherwise(one, halves), one.name


def test_lamps_are_where_they_are_said_to_be() -> None:
    for azimuth, light in one_lamp_cases(20):
        column = np.argmax(light.sum(axis=(0, 2)))
        assert abs((360.0 * (column + 0.5) / 64 - 180.0 - azimuth + 180.0) % 360.0 - 180.0) < 32.0
        assert light.shape == (32, 64, 3)


def test_windows_may_wrap_around() -> None:
    assert inside(-175.0, (160.0, -160.0))
    assert not inside(150.0, (160.0, -160.0))
    assert inside(20.0, (0.0, 40.0))


def test_the_best_grade_is_looked_for_everywhere() -> None:
    grades = np.zeros(64, np.int64)
    grades[4] = 2  # nose at 22.5: straight on its background is at -157.5
    seen = np.array([True, True, False])
    yaws = (-30.0, 0.0, 30.0)
    assert best_grade(grades, seen, yaws, (-177.5, -137.5)) == 2
    assert best_grade(grades, seen, yaws, (152.5, -167.5)) == 2  # lens at -7.5
    assert best_grade(grades, seen, yaws, (-147.5, -107.5)) == 0  # only from where it is not seen
    assert best_grade(grades, ~seen & False, yaws, (-177.5, -137.5)) == -1


def test_halved_pictures_are_means_of_four() -> None:
    transport = lambert_sphere_transport()
    light = np.random.default_rng(1).random((32, 64, 3)).astype(np.float32)
    small, size = halved(transport), transport.size
    whole = np.zeros((size * size, 3))
    whole[transport.pixels] = render(transport, light)
    means = whole.reshape(size // 2, 2, size // 2, 2, 3).mean(axis=(1, 3)).reshape(-1, 3)
    np.testing.assert_allclose(render(small, light), means[small.pixels], rtol=1e-4, atol=1e-6)
    assert small.coverage.max() <= 1.0
    outside = np.ones(len(means), bool)
    outside[small.pixels] = False
    assert not means[outside].any()


@pytest.mark.parametrize("seeds", [2, 5])
def test_noise_of_renders_is_taken_out(seeds: int) -> None:
    rng = np.random.default_rng(3)
    truth = rng.random((4000, 3)) + 0.5
    found = apart(1.05 * truth, truth + 0.3 * rng.standard_normal((seeds, *truth.shape)))
    assert found["ratio"] == pytest.approx([1.05] * 3, abs=0.02)
    assert found["square"] == pytest.approx(0.05**2, abs=3 * found["square_error"])
    assert found["noise"] == pytest.approx(0.3 / np.sqrt((truth**2).mean()), rel=0.05)
    rows = [{"place": "leadenhall_market", **found}] * 4
    assert over_pictures(rows)["all"]["rmse"] == pytest.approx(0.05, abs=0.02)


def test_steps_go_the_short_way() -> None:
    assert short_way(63) == -1
    assert short_way(-33) == 31
    assert over_pairs([])["rule"]["pairs"] == 0
