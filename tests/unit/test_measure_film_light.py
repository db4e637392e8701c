"""Light found from a head at its turns, each in an exposure of its own."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.angles import TURNS
from app.core.base.arrays import Float32, Float64
from app.core.environment.environment import solid_angles
from app.core.faces.face_on_head import head_map
from app.core.measure.film.deconvolution import FaceTurns, FilmedLight, find_light, gather
from app.core.solver.search import luminance_of
from app.core.solver.solve import solve_all
from app.core.solver.transport import render
from app.core.styles.style_pack_file import load_named_pack
from tests.unit.test_facing import place

SHAPE = (32, 64)


def lamp(row: int, column: int) -> Float64:
    light = np.full(SHAPE, 0.05)
    light[row - 1 : row + 2, column - 1 : column + 2] += 30.0
    return light


def turning(light: Float64, seed: int = 0) -> tuple[Float64, Float32]:
    """Turns and the head's pictures there, (64, N * N), exposures at random."""
    head, chance = head_map(), np.random.default_rng(seed)
    greys = np.zeros((TURNS, head.side**2), np.float32)
    for turn in range(TURNS):
        lit = render(head.transport, np.roll(light, -turn, axis=1).astype(np.float32))
        greys[turn, head.transport.pixels] = lit * 2 ** chance.uniform(-1, 1)
    return np.arange(TURNS) * 360 / TURNS, greys


def filmed(light: Float64, shown: slice = slice(None)) -> tuple[FaceTurns, FilmedLight]:
    turns, greys = turning(light)
    every = np.ones(greys[shown].shape, bool)
    found = gather(turns[shown], greys[shown], every, np.ones(len(turns[shown])))
    return found, find_light(found)


@pytest.mark.parametrize(("row", "column"), [(10, 20), (16, 50), (5, 33)])
def test_a_lamp_is_found_where_it_stands(row: int, column: int) -> None:
    turns, found = filmed(lamp(row, column))
    assert turns.turns.all()
    weighed = found.luminance * solid_angles(SHAPE)[:, None]
    down, across = np.unravel_index(int(weighed.argmax()), SHAPE)
    assert abs(int(down) - row) <= 2
    assert abs(int(across) - column) <= 2
    assert found.misfit < 0.2


def test_the_answers_are_those_of_the_place() -> None:
    pack, light = load_named_pack("generic"), luminance_of(place("sunrise").searched)
    _, found = filmed(np.asarray(light, np.float64))
    truth = solve_all(pack, place("sunrise").searched)
    answers = solve_all(pack, np.repeat(found.luminance[..., None], 3, 2).astype(np.float32))
    lost = [
        float((own.match_curve.max() - own.match_curve[one.turn_index]) / np.ptp(own.match_curve))
        for own, one in zip(truth, answers, strict=True)
        if own.attainable and one.attainable
    ]
    assert len(lost) >= 4
    assert np.mean(np.array(lost) <= 0.03) >= 0.9


def test_turns_that_were_not_filmed_are_told() -> None:
    turns, found = filmed(lamp(10, 32), slice(0, 16))
    assert 15 <= turns.turns.sum() <= 18
    assert np.isfinite(found.luminance).all()


def test_exposure_leaves_no_trace() -> None:
    light = lamp(12, 40)
    (turns, one), (_, other) = turning(light, 1), turning(light, 2)
    every = np.ones(one.shape, bool)
    first, second = (find_light(gather(turns, g, every, np.ones(TURNS))) for g in (one, other))
    assert np.abs(first.luminance - second.luminance).max() < 0.02 * first.luminance.max()
