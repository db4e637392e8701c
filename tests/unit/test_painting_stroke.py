"""Strokes: their profile, saturation, mirror images, and independence of how events came."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.core.painting.canvas import Canvas, Region, make_canvas
from app.core.painting.stroke import Brush, Stroke, Tool, cover

SIZE = 96
Point = tuple[float, float, float]


def blank(size: int = SIZE) -> Canvas:
    return make_canvas(np.zeros((size, size)))


def random_canvas(seed: int = 3) -> Canvas:
    rng = np.random.default_rng(seed)
    return make_canvas(
        rng.uniform(-1, 1, (SIZE, SIZE)),
        rng.random((SIZE, SIZE)),
        rng.uniform(-1, 1, (SIZE, SIZE)),
        rng.random((SIZE, SIZE)),
    )


def painted(canvas: Canvas, brush: Brush, path: list[Point]) -> Canvas:
    stroke = Stroke(canvas, brush, *path[0])
    for point in path[1:]:
        stroke.extend(*point)
    return stroke.commit()[0]


def smoothstep(distance: NDArray[np.float64], inner: float, outer: float) -> NDArray[np.float64]:
    rest = np.clip((outer - distance) / (outer - inner), 0, 1)
    return rest * rest * (3 - 2 * rest)


def centres() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5)
    return x, y


@pytest.mark.parametrize(("tool", "sign"), [(Tool.BRIGHTER, 1), (Tool.DARKER, -1)])
def test_a_dot_has_the_profile_of_its_brush(tool: Tool, sign: int) -> None:
    brush = Brush(tool, diameter=40, strength=0.6, softness=0.7)
    after = painted(blank(), brush, [(50.0, 30.0, 1.0)])
    x, y = centres()
    expected = 0.6 * sign * smoothstep(np.hypot(x - 50, y - 30), 6.0, 20.0)
    np.testing.assert_allclose(after.weights, expected, atol=1e-5)
    assert after.weights.flat[np.argmax(np.abs(after.weights))] == pytest.approx(0.6 * sign)


def test_a_line_fades_with_the_distance_from_it() -> None:
    brush = Brush(diameter=20, strength=1.0, softness=0.5)
    after = painted(blank(), brush, [(20.0, 40.0, 1.0), (70.0, 40.0, 1.0)])
    x, y = centres()
    distance = np.hypot(np.maximum(np.maximum(20 - x, x - 70), 0), y - 40)
    np.testing.assert_allclose(after.weights, smoothstep(distance, 5.0, 10.0), atol=1e-5)


@pytest.mark.parametrize("tiny", [4e-66, 1e-30, 1e-9])
def test_a_pen_that_rests_paints_a_dot(tiny: float) -> None:
    region = Region(0, 0, 8, 8)
    dot = cover(Brush(), (4.0, 4.0), (4.0, 4.0), region)
    np.testing.assert_array_equal(cover(Brush(), (4.0, 4.0), (4.0, 4.0 + tiny), region), dot)


def test_hard_brush_fades_over_one_pixel() -> None:
    brush = Brush(diameter=20, strength=1.0, softness=0.0)
    after = painted(blank(), brush, [(48.0, 48.0, 1.0)])
    x, y = centres()
    distance = np.hypot(x - 48, y - 48)
    assert (after.weights[distance <= 9] == 1).all()
    assert (after.weights[distance >= 10] == 0).all()


def test_one_stroke_saturates_and_a_second_goes_on() -> None:
    brush = Brush(diameter=30, strength=0.3)
    there = [(20.0, 48.0, 1.0), (70.0, 48.0, 1.0)]
    once = painted(blank(), brush, there)
    back_and_forth = painted(blank(), brush, [*there, *there, *there])
    np.testing.assert_allclose(back_and_forth.weights, once.weights, atol=1e-6)
    twice = painted(once, brush, there)
    np.testing.assert_allclose(twice.weights, 1 - (1 - once.weights) ** 2, atol=1e-6)
    assert twice.weights.max() == pytest.approx(0.51)


def between(start: Point, stop: Point, share: float) -> Point:
    x, y, pressure = (a + (b - a) * share for a, b in zip(start, stop, strict=True))
    return x, y, pressure


path_points = st.lists(
    st.tuples(st.floats(-20, 116), st.floats(-20, 116), st.floats(0, 1)), min_size=1, max_size=5
)


@settings(max_examples=60, deadline=None)
@given(
    path_points,
    st.lists(st.floats(0.02, 0.98), max_size=6),
    st.booleans(),
    st.sampled_from(list(Tool)),
    st.floats(2, 60),
)
def test_where_the_path_is_cut_does_not_matter(
    path: list[Point], cuts: list[float], pen: bool, tool: Tool, diameter: float
) -> None:
    brush = Brush(tool, diameter=diameter, strength=0.8, softness=0.8, pen_pressure=pen)
    finer = [path[0]]
    for start, stop in pairwise(path):
        finer += [between(start, stop, share) for share in sorted(cuts)]
        finer.append(stop)
    canvas = random_canvas()
    whole, cut = painted(canvas, brush, path), painted(canvas, brush, finer)
    np.testing.assert_allclose(cut.weights, whole.weights, atol=2e-4)
    np.testing.assert_allclose(cut.ignore, whole.ignore, atol=2e-4)


@pytest.mark.parametrize("tool", list(Tool))
@pytest.mark.parametrize("size", [96, 97])
def test_mirror_is_exact(tool: Tool, size: int) -> None:
    rng = np.random.default_rng(5)
    half = rng.uniform(-1, 1, (size, size))
    even = np.abs(half + half[:, ::-1]) / 2
    canvas = make_canvas(even, even, even[::-1], even[::-1])
    brush = Brush(tool, diameter=31, strength=0.7, mirror=True, pen_pressure=True)
    path = [(30.3, 20.0, 0.2), (51.7, 44.4, 0.9), (90.0, 80.0, 0.4)]
    after = painted(canvas, brush, path)
    np.testing.assert_array_equal(after.weights, after.weights[:, ::-1])
    np.testing.assert_array_equal(after.ignore, after.ignore[:, ::-1])
    assert not np.array_equal(after.weights, canvas.weights) or tool is Tool.IGNORE


def test_a_mirrored_path_gives_the_mirrored_stroke() -> None:
    brush = Brush(diameter=31, strength=0.7)
    path = [(30.25, 20.0, 1.0), (51.75, 44.5, 1.0)]
    other = [(SIZE - x, y, p) for x, y, p in path]
    one, two = painted(blank(), brush, path), painted(blank(), brush, other)
    np.testing.assert_allclose(one.weights, two.weights[:, ::-1], atol=1e-6)


def test_pressure_counts_only_when_the_brush_says_so() -> None:
    path = [(48.0, 48.0, 0.5)]
    with_pen = painted(blank(), Brush(strength=0.8, pen_pressure=True), path)
    without = painted(blank(), Brush(strength=0.8), path)
    assert with_pen.weights.max() == pytest.approx(0.4, abs=1e-4)
    assert without.weights.max() == pytest.approx(0.8, abs=1e-4)


def test_pressing_harder_on_the_spot_counts() -> None:
    brush = Brush(strength=1.0, pen_pressure=True)
    after = painted(blank(), brush, [(48.0, 48.0, 0.1), (48.0, 48.0, 0.9), (48.0, 48.0, 0.0)])
    assert after.weights.max() == pytest.approx(0.9, abs=1e-4)


def test_pressure_fades_along_the_path() -> None:
    brush = Brush(diameter=10, strength=1.0, pen_pressure=True)
    after = painted(blank(), brush, [(10.0, 48.5, 0.0), (90.0, 48.5, 1.0)])
    along = after.weights[48, 12:88]
    expected = (np.arange(12, 88) + 0.5 - 10) / 80
    # The largest pressure of a cell of two pixels, and of all the cells the full radius reaches.
    np.testing.assert_allclose(along, expected, atol=(2 + brush.full_radius + 2) / 80)


def test_ignore_restore_and_painting_over_it() -> None:
    start = random_canvas()
    canvas = make_canvas(start.weights, np.zeros((SIZE, SIZE)), start.start_weights)
    dot = [(48.0, 48.0, 1.0)]
    ignored = painted(canvas, Brush(Tool.IGNORE, strength=0.1, softness=0.0), dot)
    assert ignored.ignore[48, 48] == 1.0
    np.testing.assert_array_equal(ignored.weights, canvas.weights)
    again = painted(ignored, Brush(Tool.BRIGHTER, strength=0.1, softness=0.0), dot)
    assert again.ignore[48, 48] == 0.0
    restored = painted(ignored, Brush(Tool.RESTORE, strength=1.0, softness=0.0), dot)
    assert restored.weights[48, 48] == pytest.approx(canvas.start_weights[48, 48], abs=1e-6)
    assert restored.ignore[48, 48] == 0.0


def test_regions_hold_all_that_changes() -> None:
    brush = Brush(diameter=12, mirror=True, pen_pressure=True)
    stroke = Stroke(random_canvas(), brush, 20.0, 20.0, 0.3)
    seen = stroke.canvas.weights.copy()
    regions = stroke.extend(40.0, 33.0, 0.9)
    assert len(regions) == 2
    changed = stroke.canvas.weights != seen
    assert changed.any()
    for region in regions:
        changed[region.slices] = False
    assert not changed.any()


@pytest.mark.parametrize("place", [(math.nan, 3.0), (3.0, math.inf)])
def test_places_that_are_no_numbers_are_passed_over(place: tuple[float, float]) -> None:
    stroke = Stroke(blank(), Brush(), *place, math.nan)
    assert stroke.extend(*place) == ()
    after, change = stroke.commit()
    assert not change
    assert not after.touched


def test_far_outside_nothing_happens_quickly() -> None:
    stroke = Stroke(blank(), Brush(diameter=2, pen_pressure=True), 1e30, 1e30, 0.1)
    stroke.extend(-1e30, 1e30, 1.0)
    assert not stroke.commit()[1]


def test_a_stroke_that_is_given_up_never_touches_the_canvas() -> None:
    canvas = random_canvas()
    kept = canvas.weights.copy()
    Stroke(canvas, Brush(strength=1.0), 40.0, 40.0)
    np.testing.assert_array_equal(canvas.weights, kept)
    with pytest.raises(ValueError, match="read-only"):
        canvas.weights[0, 0] = 1


@given(st.floats(-5, 500), st.floats(-2, 3), st.floats(-2, 3))
@settings(max_examples=25, deadline=None)
def test_no_brush_leaves_the_scale(diameter: float, strength: float, softness: float) -> None:
    brush = Brush(Tool.DARKER, diameter, strength, softness)
    after = painted(random_canvas(), brush, [(40.0, 40.0, 1.0), (60.0, 20.0, 1.0)])
    assert np.isfinite(after.weights).all()
    assert np.abs(after.weights).max() <= 1
    assert after.ignore.min() >= 0
    assert after.ignore.max() <= 1
