"""The verdict about a place: the flow of its light, its best styles, and their words."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from app.core.base.arrays import Float32
from app.core.places.place_verdict import PlaceVerdict, place_verdict
from app.core.portrait.ratio_and_glare import Flow, Hardness
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import Grade
from app.core.styles.styles import DEEP, NAMES, RARE, load_styles, mirror_name
from app.words.phrases.directions import direction_words
from app.words.phrases.place_verdict import place_verdict_words, style_within_sentence
from tests.helpers.synthetic import lamp_environment

SHAPE = (32, 64)
EVEN = np.ones(SHAPE, np.float32)
CURVE = np.zeros(64)


def results_of(**grades: tuple[Grade, float]) -> tuple[StyleResult, ...]:
    """Make a result for every built-in style, out of reach unless a grade and match are given."""
    results = []
    for style in load_styles():
        grade, match = grades.get(style.name.replace("-", "_"), ("no", 10.0))
        results.append(
            StyleResult(
                name=style.name,
                title=style.title,
                side=style.side,
                turn_index=0,
                turn_deg=0.0,
                turn_refined_deg=0.0,
                direction="none",
                quality_curve=CURVE,
                match_curve=CURVE,
                strength_curve=CURVE,
                quality=1.0,
                match=match,
                strength=50.0,
                attainable=grade != "no",
                arc_deg=(0.0, 0.0),
                peaks=(),
                grade=grade,
            )
        )
    return tuple(results)


def verdict_of(
    results: tuple[StyleResult, ...], light: Float32 = EVEN, front_deg: float = 0.0
) -> PlaceVerdict:
    verdict = place_verdict(results, light, front_deg)
    assert verdict is not None
    return verdict


@pytest.mark.parametrize(("front", "azimuth"), [(0.0, 90.0), (60.0, 30.0), (180.0, -90.0)])
def test_flow_of_one_hard_lamp_is_named_from_the_photographers_front(
    front: float, azimuth: float
) -> None:
    lamp = lamp_environment(90.0, 10.0, 8.0, SHAPE).astype(np.float32)
    results = results_of()
    verdict = verdict_of(results, lamp, front)
    # Panorama azimuths are clockwise, and the flow's is counter-clockwise.
    assert verdict.flow is not None
    assert verdict.flow.azimuth_deg == pytest.approx(-azimuth, abs=3.0)
    assert verdict.flow.hardness is Hardness.HARD
    words = place_verdict_words(verdict, results)
    assert direction_words(azimuth, 10.0) in words.split(".")[0]
    assert direction_words(-azimuth, 10.0) not in words


def test_even_sphere_has_no_direction() -> None:
    results = results_of(flat=("yes", 90.0))
    verdict = verdict_of(results)
    assert verdict.flow is not None
    assert verdict.flow.hardness is Hardness.EVEN
    words = place_verdict_words(verdict, results)
    assert not any(direction_words(azimuth, 0.0) in words for azimuth in range(-150, 181, 30))
    assert style_within_sentence(results[NAMES.index("flat")]) in words


def test_styles_are_in_order_of_match_with_one_of_each_pair_and_rare_ones_last() -> None:
    verdict = verdict_of(
        results_of(
            silhouette=("yes", 99.0),
            left_loop=("yes", 80.0),
            right_loop=("yes", 85.0),
            butterfly=("yes", 90.0),
            left_window=("soft", 95.0),
            right_window=("yes", 70.0),
            flat=("soft", 60.0),
            right_split=("soft", 65.0),
        )
    )
    # The window on the right is yes, so the better match on the left, which is soft, is left out.
    assert verdict.yes == ("butterfly", "right-loop", "right-window", "silhouette")
    assert verdict.soft == ("right-split", "flat")


@pytest.mark.parametrize("name", NAMES)
def test_deep_shadows_need_a_style_with_deep_shadows(name: str) -> None:
    grades: dict[str, tuple[Grade, float]] = {name.replace("-", "_"): ("soft", 80.0)}
    verdict = verdict_of(results_of(**grades))
    assert verdict.deep_shadows == (name in DEEP)


def test_styles_with_deep_shadows_have_no_lamp_in_front() -> None:
    for style in load_styles():
        nearest = min(abs(lamp.azimuth_deg) for lamp in style.lamps)
        # A lamp within 55 degrees of the nose reaches both cheeks; from 80 degrees on, no lamp
        # reaches across the nose.
        if nearest < 55.0:
            assert style.name not in DEEP, style.name
        if nearest > 80.0:
            assert style.name in DEEP, style.name
        assert (style.name in DEEP) == (mirror_name(style.name) in DEEP)


def test_words_name_three_styles_and_soft_ones_apart() -> None:
    results = results_of(
        left_rembrandt=("yes", 90.0),
        left_loop=("yes", 80.0),
        flat=("soft", 95.0),
        butterfly=("soft", 75.0),
        clamshell=("soft", 70.0),
    )
    words = place_verdict_words(verdict_of(results), results)
    named = [one.name for one in results if style_within_sentence(one) in words]
    assert {one.removeprefix("right-").removeprefix("left-") for one in named} >= {
        "rembrandt",
        "loop",
        "flat",
    }
    assert "butterfly" not in words
    assert "clamshell" not in words
    assert words.index("Rembrandt") < words.index("loop") < words.index("flat")


def test_place_without_styles_suggests_a_next_step() -> None:
    results = results_of()
    verdict = verdict_of(results)
    assert (verdict.yes, verdict.soft, verdict.deep_shadows) == ((), (), False)
    without = place_verdict_words(verdict, results)
    one = results_of(flat=("yes", 90.0))
    assert without != place_verdict_words(verdict_of(one), one)
    assert not any(style_within_sentence(result) in without for result in results)


def test_no_verdict_from_some_of_the_styles() -> None:
    assert place_verdict(results_of()[:-1], EVEN, 0.0) is None


def test_rare_styles_are_named_after_wanted_ones_in_words() -> None:
    verdict = PlaceVerdict(Flow(0.0, 0.0, 0.0), ("flat",), ("top",), deep_shadows=False)
    assert "top" in RARE
    words = place_verdict_words(verdict, results_of())
    assert words.index("flat") < words.index("top")


def test_titles_of_the_users_styles_keep_their_capitals() -> None:
    own = dataclasses.replace(results_of()[0], name="mine", title="My Light")
    assert style_within_sentence(own) == "My Light"
