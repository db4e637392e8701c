"""Results as JSON and back: the same numbers to the last bit."""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.core.solver.solve import PeakResult, StyleResult, solve_all
from app.core.solver.style_pack import load_named_pack
from app.core.solver.styles import NAMES
from app.core.storage.json_file import Unfit
from app.core.storage.places.place import PlaceError, result_of, results_to_json

VALUES = st.floats(-1e300, 1e300)
TURNS = st.floats(-180.0, 180.0)
ARCS = st.tuples(TURNS, TURNS)
WORDS = st.text(max_size=30)
PEAKS = st.builds(PeakResult, TURNS, TURNS, VALUES, VALUES, VALUES, ARCS)


@st.composite
def curves(draw: st.DrawFn) -> NDArray[np.float64]:
    """64 values: mostly any bits, some of them at the edges of the number range."""
    bits = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).uniform(-1.0, 1.0, 64)
    curve = bits * 10.0 ** draw(st.integers(-300, 290))
    special = draw(st.lists(VALUES, max_size=3))
    curve[: len(special)] = special
    return curve


RESULTS = st.builds(
    StyleResult,
    name=WORDS,
    title=WORDS,
    side=st.sampled_from(["left", "right", "none"]),
    turn_index=st.integers(0, 63),
    turn_deg=TURNS,
    turn_refined_deg=TURNS,
    direction=st.sampled_from(["clockwise", "counter-clockwise", "none"]),
    quality_curve=curves(),
    match_curve=curves(),
    strength_curve=curves(),
    quality=VALUES,
    match=VALUES,
    strength=VALUES,
    attainable=st.booleans(),
    reason=st.none() | WORDS,
    arc_deg=ARCS,
    peaks=st.lists(PEAKS, max_size=3).map(tuple),
)


def bits_of(value: Any) -> Any:
    """Something that is equal only when every float is the same to the last bit."""
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, tuple):
        return tuple(bits_of(each) for each in value)
    if isinstance(value, (StyleResult, PeakResult)):
        return tuple(bits_of(getattr(value, each.name)) for each in fields(value))
    return value


@pytest.fixture(scope="module")
def solved() -> tuple[StyleResult, ...]:
    rng = np.random.default_rng(3)
    return solve_all(load_named_pack("generic"), rng.gamma(0.3, size=(32, 64)), front_deg=33.0)


@settings(deadline=None)
@given(st.lists(RESULTS, max_size=2))
def test_any_results_come_back_to_the_last_bit(results: list[StyleResult]) -> None:
    words = json.dumps(results_to_json(results))
    assert bits_of(tuple(map(result_of, json.loads(words)))) == bits_of(tuple(results))


def test_real_results_come_back_to_the_last_bit(solved: tuple[StyleResult, ...]) -> None:
    again = tuple(map(result_of, json.loads(json.dumps(results_to_json(solved)))))
    assert len(again) == len(NAMES)
    assert bits_of(again) == bits_of(solved)
    assert not again[0].match_curve.flags.writeable


def test_holds_what_other_programs_look_for(solved: tuple[StyleResult, ...]) -> None:
    # The names of the command line's JSON.
    keys = {"name", "title", "turn_deg", "turn_refined_deg", "direction", "quality_curve"}
    keys |= {"match_curve", "strength_curve", "match", "strength", "attainable", "reason"}
    keys |= {"arc_deg", "peaks"}
    first = results_to_json(solved)[0]
    assert keys <= set(first)
    assert first["match_curve"] == solved[0].match_curve.tolist()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["match", "turn_deg", "quality_curve", "arc_deg"])
def test_what_is_no_number_is_not_written(
    solved: tuple[StyleResult, ...], field: str, value: float
) -> None:
    bad: Any = value
    if field == "quality_curve":
        bad = solved[0].quality_curve.copy()
        bad[5] = value
    elif field == "arc_deg":
        bad = (0.0, value)
    with pytest.raises(PlaceError, match="not a number"):
        results_to_json([replace(solved[0], **{field: bad})])


WRONG: list[tuple[str, Any]] = [
    ("name", 3),
    ("turn_index", 64),
    ("turn_index", True),
    ("turn_index", 1.0),
    ("turn_deg", 181.0),
    ("turn_deg", math.nan),
    ("direction", "left"),
    ("direction", ["none"]),
    ("match", None),
    ("match", True),
    ("attainable", 1),
    ("reason", 0),
    ("arc_deg", [1.0]),
    ("arc_deg", [1.0, "2"]),
    ("peaks", {}),
    ("peaks", [3]),
    ("peaks", [{}]),
    ("quality_curve", [0.0] * 63),
    ("quality_curve", [0.0] * 63 + [True]),
    ("quality_curve", [0.0] * 63 + [math.inf]),
    ("quality_curve", [0.0] * 63 + [[1.0]]),
]


@pytest.mark.parametrize(("key", "value"), WRONG)
def test_wrong_values_are_refused(solved: tuple[StyleResult, ...], key: str, value: object) -> None:
    facts = results_to_json(solved)[0]
    result_of(facts)
    with pytest.raises(Unfit):
        result_of(facts | {key: value})
    del facts[key]
    with pytest.raises(Unfit, match=f"lacks {key}"):
        result_of(facts)


@pytest.mark.parametrize("value", [None, [], "x", [None], [[]], {}])
def test_something_else_is_refused(value: object) -> None:
    with pytest.raises(Unfit):
        result_of(value)
