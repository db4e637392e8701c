"""Undo by tiles is exact, knows its size, and refuses what it does not belong to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.painting.canvas import make_canvas
from app.core.painting.stroke import Brush, Stroke, Tool
from app.core.painting.stroke_undo import TILE, apply, cleared, difference, revert

SIZE = 150


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 6))
def test_undo_and_redo_are_exact(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    canvas = make_canvas(rng.uniform(-1, 1, (SIZE, SIZE)), rng.random((SIZE, SIZE)))
    states, changes = [canvas], []
    for _ in range(count):
        tool = list(Tool)[rng.integers(4)]
        brush = Brush(tool, rng.uniform(3, 80), rng.random(), rng.random(), bool(rng.integers(2)))
        stroke = Stroke(states[-1], brush, *rng.uniform(0, SIZE, 2))
        stroke.extend(*rng.uniform(0, SIZE, 2))
        after, change = stroke.commit()
        states.append(after)
        changes.append(change)
    now = states[-1]
    for index in reversed(range(count)):
        now = revert(now, changes[index])
        np.testing.assert_array_equal(now.weights, states[index].weights)
        np.testing.assert_array_equal(now.ignore, states[index].ignore)
    for change in changes:
        now = apply(now, change)
    np.testing.assert_array_equal(now.weights, states[-1].weights)
    np.testing.assert_array_equal(now.ignore, states[-1].ignore)


def test_only_tiles_that_differ_are_kept() -> None:
    canvas = make_canvas(np.zeros((SIZE, SIZE)))
    stroke = Stroke(canvas, Brush(diameter=10, strength=1.0), 70.0, 70.0)
    _, change = stroke.commit()
    assert [(tile.layer, tile.column, tile.row) for tile in change.tiles] == [("weights", 1, 1)]
    assert change.nbytes == 2 * TILE * TILE * 4
    assert change.regions[0].slices == (slice(64, 128), slice(64, 128))
    edge = Stroke(canvas, Brush(diameter=10, strength=1.0), 149.0, 149.0).commit()[1]
    assert edge.nbytes == 2 * (SIZE - 128) ** 2 * 4


def test_a_change_of_another_canvas_is_refused() -> None:
    canvas = make_canvas(np.zeros((SIZE, SIZE)))
    after, change = Stroke(canvas, Brush(strength=1.0), 70.0, 70.0).commit()
    with pytest.raises(ValueError, match="another state"):
        revert(canvas, change)
    with pytest.raises(ValueError, match="another state"):
        apply(after, change)


def test_clearing_is_one_change_that_can_be_taken_back() -> None:
    rng = np.random.default_rng(0)
    start = make_canvas(rng.uniform(-1, 1, (SIZE, SIZE)))
    painted, _ = Stroke(start, Brush(strength=1.0), 70.0, 70.0).commit()
    assert painted.touched
    clear, change = cleared(painted)
    assert not clear.touched
    np.testing.assert_array_equal(revert(clear, change).weights, painted.weights)
    assert not difference(start, start)
