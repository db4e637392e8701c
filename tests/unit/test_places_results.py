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

from app.core.places.place import PlaceError
from app.core.places.saved.result_json import result_of, results_to_json
from app.core.solver.face import AREAS
from app.core.solver.shortfall import (
    AreaShortfall,
    Aspect,
    Cause,
    LensShortfall,
    LightShortfall,
    Obstacle,
    Origin,
    SavedReason,
)
from app.core.solver.solve import solve_all
from app.core.solver.style_result import PeakResult, StyleResult
from app.core.storage.json_file import Unfit
from app.core.styles.style_pack_file import load_named_pack
from app.core.styles.styles import NAMES
from app.words.why_out_of_reach import reason_card, reason_sentence

VALUES = st.floats(-1e300, 1e300)
TURNS = st.floats(-180.0, 180.0)
ARCS = st.tuples(TURNS, TURNS)
WORDS = st.text(max_size=30)
PEAKS = st.builds(PeakResult, TURNS, TURNS, VALUES, VALUES, VALUES, ARCS)

AREAS_SHORT = st.builds(
    AreaShortfall,
    aspect=st.sampled_from(Aspect),
    style=WORDS,
    bright=st.sampled_from(AREAS),
    dark=st.sampled_from(AREAS),
    value_stops=VALUES,
    limit_stops=VALUES,
)
PLACED = st.builds(
    LightShortfall,
    cause=st.sampled_from([Cause.NO_LIGHT, Cause.ONE_LAMP]),
    measure=st.sampled_from(["match", "contrast"]),
    value=VALUES,
    limit=VALUES,
    origin=st.sampled_from(Origin),
)
LIGHT_SHORT = PLACED | st.builds(
    LightShortfall,
    cause=st.sampled_from(sorted({*Cause} - {Cause.NO_LIGHT, Cause.ONE_LAMP})),
    measure=st.sampled_from(["match", "contrast"]),
    value=VALUES,
    limit=VALUES,
)
LENS_SHORT = st.builds(LensShortfall, st.sampled_from(Obstacle))
SAVED = st.builds(SavedReason, WORDS)


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
    shortfall=st.none() | AREAS_SHORT | LIGHT_SHORT | LENS_SHORT | SAVED,
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


def test_the_former_name_of_a_grade_is_read(solved: tuple[StyleResult, ...]) -> None:
    kept = {**results_to_json([replace(solved[0], grade="soft")])[0], "grade": "nearly"}
    assert result_of(kept).grade == "soft"


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


AREA = {
    "kind": "areas",
    "aspect": "cheeks",
    "style": "Loop",
    "bright": AREAS[0],
    "dark": AREAS[1],
    "value_stops": 0.2,
    "limit_stops": 0.5,
}
LIGHT = {"kind": "light", "cause": "even light", "measure": "match", "value": 3.0, "limit": 45.0}


@pytest.mark.parametrize(
    "cause",
    [
        0,
        "too dark",
        [],
        {},
        {"kind": []},
        {"kind": "light"},
        {**AREA, "aspect": "nose"},
        {**AREA, "aspect": ["cheeks"]},
        {**AREA, "dark": "ear"},
        {**AREA, "value_stops": math.nan},
        {**AREA, "style": "x" * 201},
        {**LIGHT, "origin": None, "cause": "no light from there"},
        {**LIGHT, "origin": "below"},
        {**LIGHT, "origin": None, "measure": "quality"},
        {"kind": "lens", "obstacle": "wall"},
        {"kind": "saved", "sentence": "x" * 2001},
    ],
)
def test_wrong_causes_are_refused(solved: tuple[StyleResult, ...], cause: object) -> None:
    facts = results_to_json(solved)[0]
    assert result_of(facts | {"cause": AREA}).shortfall is not None
    assert result_of(facts | {"cause": LIGHT | {"origin": None}}).shortfall is not None
    with pytest.raises(Unfit):
        result_of(facts | {"cause": cause})


@pytest.mark.parametrize("key", ["reason", "shortfall"])
def test_sentences_of_earlier_places_are_read(solved: tuple[StyleResult, ...], key: str) -> None:
    facts = results_to_json(solved)[0]
    del facts["cause"], facts["reason"]
    sentence = "No strong light from below here: match 14 of 100"
    old = result_of(facts | {"reason": None, "shortfall": None} | {key: sentence})
    assert old.shortfall == SavedReason(sentence)
    assert reason_sentence(old.shortfall) == reason_card(old.shortfall) == sentence
    again = result_of(json.loads(json.dumps(results_to_json([old])[0])))
    assert again.shortfall == old.shortfall
    assert result_of(facts | {"reason": None, "shortfall": None}).shortfall is None
    wrong: object
    for wrong in (0, [], "x" * 2001):
        with pytest.raises(Unfit):
            result_of(facts | {key: wrong})


def test_no_sentence_is_saved(solved: tuple[StyleResult, ...]) -> None:
    lacks = [one for one in solved if one.shortfall is not None]
    assert lacks
    for one, facts in zip(lacks, results_to_json(lacks), strict=True):
        assert facts["reason"] is None
        assert reason_sentence(one.shortfall) not in json.dumps(facts, ensure_ascii=False)


@pytest.mark.parametrize("value", [None, [], "x", [None], [[]], {}])
def test_something_else_is_refused(value: object) -> None:
    with pytest.raises(Unfit):
        result_of(value)
