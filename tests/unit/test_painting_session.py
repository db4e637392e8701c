"""The live answer: exact, history-free, with the right side and sign, and fast."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from app.core.painting.canvas import (
    Advice,
    blank,
    canvas_size,
    from_weights,
    head_values,
    make_canvas,
)
from app.core.painting.painting_session import Answer, PaintSession
from app.core.painting.stroke import Brush, Tool
from app.core.painting.stroke_undo import cleared
from app.core.solver.relighting_cache import LightTable, light_table
from app.core.solver.transport import load_named, render, to_image
from app.core.solver.weights import painted
from tests.helpers.painted import solve_painted
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment

TRANSPORT = lambert_sphere_transport()
SIZE = canvas_size(TRANSPORT)


def _scene(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    lamps = lamp_environment(40.0, 25.0) + 0.5 * lamp_environment(-110.0, 10.0, 20.0)
    colour = np.array([1.0, 0.8, 0.6])
    return np.asarray(lamps[..., None] * colour + 0.05 * rng.random((32, 64, 3)))


def _table(scene: np.ndarray) -> LightTable:
    return light_table(TRANSPORT, scene, pictures=True)


def _expect_same(answer: Answer, session: PaintSession, scene: np.ndarray) -> None:
    """Compare with an answer counted from nothing but the canvas."""
    weights = painted(TRANSPORT, *head_values(session.canvas, TRANSPORT))
    expected = solve_painted(TRANSPORT, weights, scene)
    result = answer.result
    assert result is not None
    np.testing.assert_allclose(result.match_curve, expected.match_curve, atol=1e-6)
    np.testing.assert_allclose(result.strength_curve, expected.strength_curve, atol=1e-6)
    np.testing.assert_allclose(result.quality_curve, expected.quality_curve, atol=1e-6)
    assert result.turn_refined_deg == pytest.approx(expected.turn_refined_deg, abs=1e-6)
    whole = weights.preintegrated(TRANSPORT)
    np.testing.assert_allclose(answer.preintegrated, whole, atol=1e-6 * np.abs(whole).max())


def test_every_segment_answers_as_if_counted_from_scratch() -> None:
    scene = _scene()
    rng = np.random.default_rng(1)
    session = PaintSession(TRANSPORT, blank(TRANSPORT), _table(scene))
    for index in range(12):
        tool = list(Tool)[index % 4]
        brush = Brush(tool, rng.uniform(5, 160), rng.random(), rng.random(), mirror=index % 3 == 0)
        session.begin(brush, *rng.uniform(0, SIZE, 2))
        for _ in range(3):
            session.extend(*rng.uniform(0, SIZE, 2))
            session.extend(*rng.uniform(0, SIZE, 2))
            _expect_same(session.answer(), session, scene)
        session.commit()
        _expect_same(session.answer(), session, scene)


def test_undo_gives_the_very_same_answer() -> None:
    scene = _scene(3)
    session = PaintSession(TRANSPORT, blank(TRANSPORT), _table(scene))
    session.begin(Brush(strength=1.0), 0.3 * SIZE, 0.4 * SIZE)
    session.commit()
    before = session.answer().result
    session.begin(Brush(Tool.DARKER, strength=0.9), 0.6 * SIZE, 0.4 * SIZE)
    session.extend(0.7 * SIZE, 0.6 * SIZE)
    session.answer()
    change = session.commit()
    changed = session.answer().result
    session.revert(change)
    after = session.answer().result
    assert before is not None
    assert after is not None
    assert changed is not None
    np.testing.assert_array_equal(after.match_curve, before.match_curve)
    session.apply(change)
    again = session.answer().result
    assert again is not None
    np.testing.assert_array_equal(again.match_curve, changed.match_curve)


def test_aborting_a_stroke_leaves_nothing() -> None:
    session = PaintSession(TRANSPORT, blank(TRANSPORT), _table(_scene()))
    before = session.weights.values
    session.begin(Brush(strength=1.0), 0.5 * SIZE, 0.5 * SIZE)
    states = [session.stroking]
    assert session.canvas.touched
    session.answer()
    session.abort()
    assert [*states, session.stroking] == [True, False]
    np.testing.assert_array_equal(session.weights.values, before)
    assert not session.commit()
    assert session.extend(1.0, 1.0) == ()


@pytest.mark.parametrize("lamp_deg", [0.0, 45.0, -100.0])
@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_brighter_on_one_side_turns_that_side_toward_the_lamp(
    lamp_deg: float, side: str, sign: float
) -> None:
    """A lamp at p that is wanted on the sitter's left means a turn clockwise of p."""
    light = lamp_environment(lamp_deg, 0.0, fill=0.02)
    session = PaintSession(TRANSPORT, blank(TRANSPORT), light_table(TRANSPORT, light))
    # The sitter's left is the picture's right.
    bright, dark = (0.75, 0.25) if side == "left" else (0.25, 0.75)
    for tool, at in ((Tool.BRIGHTER, bright), (Tool.DARKER, dark)):
        session.begin(Brush(tool, 0.4 * SIZE, strength=1.0), at * SIZE, 0.3 * SIZE)
        session.extend(at * SIZE, 0.7 * SIZE)
        session.commit()
    answer = session.answer()
    assert answer.advice is None
    assert answer.result is not None
    turned = (answer.result.turn_refined_deg - lamp_deg + 180) % 360 - 180
    # Half the face, softly: less than the 90 deg of split, as more of the face is to be lit.
    assert 45.0 <= sign * turned <= 95.0
    if lamp_deg == 0.0:
        expected = "clockwise" if side == "left" else "counter-clockwise"
        assert answer.result.direction == expected
    # The pre-integrated target is positive on the sitter's left: panorama left of the centre.
    left_half = answer.preintegrated[:, :32].sum() - answer.preintegrated[:, 32:].sum()
    assert np.sign(left_half) == sign


def test_picture_is_at_the_refined_turn_and_front_moves_the_numbers_only() -> None:
    scene = _scene(2)
    start = from_weights(TRANSPORT, np.linspace(-0.5, 0.5, len(TRANSPORT.pixels)))
    plain = PaintSession(TRANSPORT, start, _table(scene)).answer()
    moved = PaintSession(TRANSPORT, start, _table(scene), front_deg=30.0).answer()
    assert plain.result is not None
    assert moved.result is not None
    assert plain.picture is not None
    assert moved.picture is not None
    gap = plain.result.turn_refined_deg - moved.result.turn_refined_deg
    assert gap % 360 == pytest.approx(30.0, abs=1e-6)
    np.testing.assert_array_equal(plain.picture, moved.picture)
    place = plain.result.turn_refined_deg / 5.625
    below, share = int(np.floor(place)), place % 1
    pictures = [render(TRANSPORT, np.roll(scene, -k, axis=1)) for k in (below, below + 1)]
    mixed = (1 - share) * pictures[0] + share * pictures[1]
    expected = to_image(TRANSPORT, mixed)
    np.testing.assert_allclose(plain.picture, expected, atol=1e-4 * expected.max())


def test_without_a_place_there_is_still_a_target() -> None:
    session = PaintSession(TRANSPORT, blank(TRANSPORT))
    answer = session.answer()
    assert (answer.result, answer.picture) == (None, None)
    assert answer.preintegrated.shape == (32, 64)
    session.set_light(light_table(TRANSPORT, lamp_environment(0.0, 0.0)))
    lit = session.answer()
    assert lit.result is not None
    assert lit.picture is None


def test_what_is_missing_is_said() -> None:
    session = PaintSession(TRANSPORT, blank(TRANSPORT))
    assert session.answer().advice is Advice.NOTHING_PAINTED
    session.begin(Brush(strength=1.0), 0.3 * SIZE, 0.5 * SIZE)
    session.commit()
    assert session.answer().advice is Advice.ONE_SIDED
    session.begin(Brush(Tool.DARKER, strength=1.0), 0.7 * SIZE, 0.5 * SIZE)
    session.commit()
    assert session.answer().advice is None
    session.replace(cleared(session.canvas)[0])
    assert session.answer().advice is Advice.NOTHING_PAINTED
    session.begin(Brush(Tool.IGNORE, 3 * SIZE, softness=0.0), 0.5 * SIZE, 0.5 * SIZE)
    session.commit()
    assert session.answer().advice is Advice.ONE_SIDED


def test_a_canvas_of_another_size_is_brought_to_the_heads() -> None:
    layer = np.zeros((100, 100))
    layer[:, 50:] = 0.5
    session = PaintSession(TRANSPORT, make_canvas(layer))
    assert session.canvas.size == SIZE
    assert session.canvas.weights[:, : SIZE // 2 - 4].max() == 0
    assert session.canvas.weights[:, SIZE // 2 + 4 :].min() == 0.5


@pytest.mark.slow
@pytest.mark.alone
def test_a_segment_is_many_times_faster_than_starting_over() -> None:
    transport = load_named("generic")
    rng = np.random.default_rng(9)
    scene = np.exp(rng.standard_normal((32, 64, 3)))
    table = light_table(transport, scene, pictures=True)
    session = PaintSession(transport, blank(transport), table)
    session.begin(Brush(strength=0.8, mirror=True), 100.0, 100.0)
    place = iter(range(1000))

    def segment() -> None:
        angle = 0.12 * next(place)
        session.extend(200 + 100 * np.cos(angle), 200 + 120 * np.sin(angle))
        session.answer()

    def over_again() -> None:
        weights = painted(transport, *head_values(session.canvas, transport))
        solve_painted(transport, weights, scene)
        render(transport, scene)

    assert _best(over_again, 6) >= 3 * _best(segment, 25)


def _best(call: Callable[[], None], count: int) -> float:
    times = []
    for _ in range(count):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return min(times)
