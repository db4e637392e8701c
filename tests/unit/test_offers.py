"""One place in a list for the two sides of a style and for styles with one picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.core.places.offers import Offer, offers, pairs
from app.core.solver.solve import name_equals, solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack_file import load_named_pack
from app.core.styles.styles import NAMES, RARE


@pytest.fixture(scope="module")
def results() -> dict[str, StyleResult]:
    """Results of even light, in which nothing is within reach but flat."""
    even = np.ones((32, 64, 3), np.float32)
    return {one.name: one for one in solve_all(load_named_pack("generic"), even)}


def within(result: StyleResult, grade: str, match: float, turn_deg: float) -> StyleResult:
    """Put a style within reach."""
    return replace(
        result,
        attainable=True,
        grade=grade,  # type: ignore[arg-type]
        match=match,
        turn_refined_deg=turn_deg,
        same_picture=(),
        looks_more_like=None,
    )


def attainable(result: StyleResult) -> bool:
    return result.attainable


def test_pairs_keep_the_order_and_leave_own_styles_alone() -> None:
    names = ("my-loop", "left-loop", "flat", "right-loop", "left-mine")
    assert pairs(names) == (
        Offer("my-loop", ("my-loop",)),
        Offer("left-loop", ("left-loop", "right-loop")),
        Offer("flat", ("flat",)),
        Offer("left-mine", ("left-mine",)),
    )
    assert sum(len(offer.members) for offer in pairs(NAMES)) == len(NAMES)


def test_the_better_side_is_shown(results: dict[str, StyleResult]) -> None:
    left = within(results["left-loop"], "soft", 95.0, 10.0)
    right = within(results["right-loop"], "yes", 70.0, -80.0)
    (offer,) = offers((left, right), attainable)
    assert offer == Offer("right-loop", ("right-loop", "left-loop"))
    (offer,) = offers((left, replace(right, attainable=False)), attainable)
    assert offer.name == "left-loop"


def test_common_styles_then_grade_then_match(results: dict[str, StyleResult]) -> None:
    rare = within(results["silhouette"], "yes", 99.0, 0.0)
    soft = within(results["butterfly"], "soft", 98.0, 40.0)
    good, better = (
        within(results[name], "yes", match, turn)
        for name, match, turn in (("left-loop", 80.0, 80.0), ("left-split", 90.0, 120.0))
    )
    none = results["badger"]
    assert not none.attainable
    assert rare.name in RARE
    order = [one.name for one in offers((none, rare, soft, good, better), attainable)]
    assert order == ["left-split", "left-loop", "butterfly", "silhouette", "badger"]


def test_one_picture_is_offered_once_if_both_grades_agree(
    results: dict[str, StyleResult],
) -> None:
    loop = within(results["left-loop"], "yes", 90.0, 30.0)
    near = within(results["left-rembrandt"], "yes", 85.0, 31.0)
    exposes = dict.fromkeys(results, "face")
    loop, near = name_equals([loop, near], exposes)  # type: ignore[arg-type]
    assert (loop.same_picture, near.same_picture) == (("left-rembrandt",), ("left-loop",))
    assert offers((loop, near), attainable) == (
        Offer("left-loop", ("left-loop", "left-rembrandt")),
    )
    soft = replace(near, grade="soft")
    assert [one.name for one in offers((loop, soft), attainable)] == ["left-loop", "left-rembrandt"]


@pytest.mark.parametrize("change", ["turn", "lens", "exposure", "reach"])
def test_a_picture_is_another_by_turn_lens_or_exposure(
    results: dict[str, StyleResult], change: str
) -> None:
    rim = within(results["left-rim"], "yes", 90.0, 30.0)
    other = within(results["silhouette"], "yes", 85.0, 30.0)
    exposes = {"left-rim": "dark", "silhouette": "dark"}
    same = name_equals([rim, other], exposes)  # type: ignore[arg-type]
    assert same[0].same_picture == ("silhouette",)
    if change == "turn":
        other = replace(other, turn_refined_deg=33.0)
    elif change == "lens":
        other = replace(other, yaw_deg=15.0)
    elif change == "reach":
        other = replace(other, attainable=False)
    else:
        exposes["silhouette"] = "background"
    apart = name_equals([rim, other], exposes)  # type: ignore[arg-type]
    assert [one.same_picture for one in apart] == [(), ()]


def test_the_rule_in_force_decides(results: dict[str, StyleResult]) -> None:
    loop = within(results["left-loop"], "yes", 90.0, 30.0)
    badger = results["badger"]
    order = [one.name for one in offers((loop, badger), lambda one: one.name == "badger")]
    assert order == ["badger", "left-loop"]
