"""Which of several places is ranked first."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from app.core.places.best_spot import rank_spots
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack_file import load_named_pack


@pytest.fixture(scope="module")
def one() -> StyleResult:
    light = np.random.default_rng(5).gamma(0.3, size=(32, 64))
    return replace(solve_all(load_named_pack("generic"), light)[0], attainable=True, grade="yes")


def ranked(one: StyleResult, *spots: dict[str, Any]) -> tuple[int, ...]:
    return rank_spots([replace(one, **spot) for spot in spots])


def test_a_better_grade_goes_first_whatever_the_match(one: StyleResult) -> None:
    no = {"attainable": False, "grade": "no", "match": 95.0}
    soft, yes = {"grade": "soft", "match": 56.0}, {"grade": "yes", "match": 47.0}
    assert ranked(one, no, soft, yes) == (2, 1, 0)
    assert ranked(one, {**no, "match": 20.0}, no) == (1, 0)


def test_then_the_match(one: StyleResult) -> None:
    assert ranked(one, {"match": 81.0}, {"match": 95.0}, {"match": 88.0}) == (1, 2, 0)


def test_equal_matches_are_told_apart_by_leeway_then_by_strength(
    one: StyleResult,
) -> None:
    narrow = {"match": 86.12, "arc_deg": (10.0, 24.0)}
    wide = {"match": 86.1, "arc_deg": (170.0, -170.0)}
    assert ranked(one, narrow, wide) == (1, 0)
    weak = {**wide, "strength": 20.0}
    assert ranked(one, weak, {**wide, "strength": 60.0}) == (1, 0)


def test_a_painted_style_has_no_grade_and_is_in_reach_or_not(one: StyleResult) -> None:
    out = {"attainable": False, "grade": None, "match": 64.0}
    assert ranked(one, out, {"grade": None, "match": 46.0}) == (1, 0)


def test_equals_keep_their_order_and_none_is_no_error(one: StyleResult) -> None:
    assert ranked(one, {}, {}, {}) == (0, 1, 2)
    assert rank_spots(()) == ()
