"""The answers: turns and signs of single lamps, exposure, mirrors, gates, painted weights."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.core.base.angles import TURNS, difference, wrap
from app.core.base.errors import EnvironmentFileError, StyleError
from app.core.solver import turn_choice
from app.core.solver.peaks import shift
from app.core.solver.shortfall import Cause, LightShortfall, Origin
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import OBJECTIVES, PRICE, Limits, Objective
from app.core.solver.weights import painted, target_weights
from app.core.styles.lamps import far_lamp
from app.core.styles.style_pack_file import load_named_pack
from app.core.styles.styles import mirror_name
from app.words.why_out_of_reach import reason_sentence
from benchmarks.speed.plain_search import matrix, preintegrate
from tests.helpers.painted import solve_painted
from tests.helpers.synthetic import (
    lambert_sphere_transport,
    lamp_environment,
    mirrored,
    synthetic_pack,
)

Float = NDArray[np.float64]
PACK = synthetic_pack()
# A ball shows nothing of light from straight behind.
SINGLE = [style for style in PACK.styles if len(style.lamps) == 1 and style.name != "silhouette"]


def _by_name(light: Float, objective: Objective = "picture") -> dict[str, StyleResult]:
    return {result.name: result for result in solve_all(PACK, light, objective)}


def _scene(seed: int) -> Float:
    rng = np.random.default_rng(seed)
    light: Float = np.exp(0.7 * rng.standard_normal((32, 64)))
    for _ in range(3):
        light += 3 * lamp_environment(rng.uniform(-180, 180), rng.uniform(-50, 70), 12.0)
    return light


@pytest.mark.parametrize("style", SINGLE, ids=lambda style: style.name)
@pytest.mark.parametrize("azimuth", [0.0, 47.8125, -120.0, 178.0])
def test_one_lamp_sets_the_turn_and_its_sign(
    style: object, azimuth: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One lamp at panorama azimuth p: turn p + the lamp's azimuth towards the sitter's left."""
    lamp = style.lamps[0]  # type: ignore[attr-defined]
    light = lamp_environment(azimuth, lamp.elevation_deg)
    result = _by_name(light)[style.name]  # type: ignore[attr-defined]
    wanted = wrap(azimuth + lamp.azimuth_deg)
    monkeypatch.setattr(turn_choice, "PRICE", 0.0)
    best = _by_name(light)[style.name]  # type: ignore[attr-defined]
    assert abs(difference(best.turn_deg, wanted)) <= 4.5
    assert abs(difference(best.turn_refined_deg, wanted)) <= 2.0
    # The turn offered lies in the middle of the arc, which is not the same way to both sides.
    assert result.match_curve[best.turn_index] - result.match <= PRICE
    assert result.attainable
    assert result.shortfall is None


def test_left_split_is_a_quarter_turn_clockwise_of_butterfly() -> None:
    found = _by_name(lamp_environment(30.0, 10.0))
    assert found["left-split"].turn_refined_deg == pytest.approx(120.0, abs=2.0)
    assert found["right-split"].turn_refined_deg == pytest.approx(-60.0, abs=2.0)
    assert found["left-split"].direction == "clockwise"
    assert found["right-split"].direction == "counter-clockwise"


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(OBJECTIVES))
def test_a_mirrored_panorama_gives_the_mirrored_turn(seed: int, objective: Objective) -> None:
    light = _scene(seed)
    here, there = _by_name(light, objective), _by_name(mirrored(light), objective)
    for name, result in here.items():
        other = there[mirror_name(name)]
        assert wrap(other.turn_deg + result.turn_deg) == 0.0
        assert abs(difference(other.turn_refined_deg, -result.turn_refined_deg)) < 1e-9
        assert other.match == pytest.approx(result.match, abs=1e-9)
        assert other.attainable == result.attainable


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 1e-30, 0.37, 1e3, 1e30]))
def test_exposure_changes_nothing_but_the_quality(seed: int, gain: float) -> None:
    light = _scene(seed).astype(np.float32)
    for plain, scaled in zip(
        solve_all(PACK, light), solve_all(PACK, light * np.float32(gain)), strict=True
    ):
        assert scaled.turn_deg == plain.turn_deg
        assert abs(difference(scaled.turn_refined_deg, plain.turn_refined_deg)) < 1e-3
        assert scaled.match == pytest.approx(plain.match, abs=1e-4)
        assert scaled.strength == pytest.approx(plain.strength, abs=1e-4)
        assert scaled.attainable == plain.attainable
        assert type(scaled.shortfall) is type(plain.shortfall)
        assert reason_sentence(scaled.shortfall) == reason_sentence(plain.shortfall)
        # C may be the small difference of large parts, each rounded as light in single precision.
        parts = 1e-6 * gain * float(np.abs(plain.quality_curve).max())
        assert scaled.quality == pytest.approx(plain.quality * gain, rel=1e-5, abs=parts)


def test_uniform_light_gives_no_style_and_no_turn() -> None:
    for result in solve_all(PACK, np.full((32, 64), 5.0)):
        assert not result.attainable
        assert result.turn_deg == 0.0
        assert result.direction == "none"
        assert isinstance(result.shortfall, LightShortfall)
        assert (result.shortfall.cause, result.shortfall.measure) == (Cause.EVEN, "contrast")


def test_two_lamp_styles_are_found_with_two_lamps() -> None:
    pair = lamp_environment(105.0, 0.0) + lamp_environment(-85.0, 0.0)
    both = _by_name(pair)["badger"]
    assert both.attainable
    assert both.strength > 90
    assert both.turn_refined_deg == pytest.approx(10.0, abs=2.0)


@pytest.mark.parametrize("name", ["badger", "left-loop-rim", "left-rim", "left-split", "butterfly"])
def test_the_weaker_lamp_decides_the_grade(name: str) -> None:
    """One lamp of a badger or of a loop with rim is none; a lamp from behind is nothing else."""
    pack = load_named_pack("generic")
    for weak, wanted in ((1.0, "yes"), (0.0, "no")):
        lamps = list(pack.styles[pack.index(name)].lamps)
        if len(lamps) == 1 and weak == 0.0:
            continue
        lamps[-1] = replace(lamps[-1], power=lamps[-1].power * weak)
        light = np.sum([far_lamp(lamp, (32, 64)) for lamp in lamps], axis=0)
        (result,) = solve_all(pack, light, styles=[name])
        assert result.grade == wanted, (weak, result.shortfall)


def test_light_from_below_is_missed() -> None:
    result = _by_name(lamp_environment(0.0, 50.0, fill=0.05))["below"]
    assert not result.attainable
    assert isinstance(result.shortfall, LightShortfall)
    assert result.shortfall.cause is Cause.NO_LIGHT
    assert result.shortfall.origin is Origin.BELOW


def test_fill_lowers_the_strength_steadily() -> None:
    strengths = [
        _by_name(lamp_environment(20.0, 35.0, fill=fill))["left-loop"].strength
        for fill in (0.0, 0.01, 0.05, 0.2, 1.0, 5.0)
    ]
    assert all(a > b for a, b in pairwise(strengths))


def test_the_objectives_differ_where_they_should() -> None:
    """C also rewards a face that is merely brighter in the right half."""
    light = lamp_environment(0.0, 10.0)
    picture, paper = _by_name(light)["left-split"], _by_name(light, "paper")["left-split"]
    assert picture.match >= paper.match
    assert paper.quality >= picture.quality
    assert paper.quality == pytest.approx(paper.quality_curve.max())


def test_without_sufficient_strength_the_quality_decides() -> None:
    light = _scene(4)
    for weak, paper in zip(
        solve_all(PACK, light, limits=Limits(strength=1e6)),
        solve_all(PACK, light, "paper"),
        strict=True,
    ):
        assert weak.turn_deg == paper.turn_deg
        assert not weak.attainable


def test_the_chosen_turn_has_sufficient_strength_where_there_is_one() -> None:
    for seed in range(5):
        for result in solve_all(PACK, _scene(seed)):
            good = (result.strength_curve >= 20) & (result.match_curve >= 45)
            assert result.attainable == good.any()
            if result.name in {style.name for style in SINGLE}:
                assert result.strength >= 20 or (result.strength_curve < 20).all()


@pytest.mark.usefixtures("best_turns")
def test_no_least_strength_opens_the_best_match_of_all() -> None:
    for result in solve_all(PACK, _scene(3), limits=Limits(0.0, 0.0)):
        assert result.match == pytest.approx(result.match_curve.max(), abs=1e-4)


def test_values_at_the_turn_are_those_of_the_curves() -> None:
    for result in solve_all(PACK, _scene(6)):
        index = result.turn_index
        assert result.turn_deg == wrap(5.625 * index)
        assert result.match == result.match_curve[index]
        assert result.strength == result.strength_curve[index]
        assert result.quality == pytest.approx(result.quality_curve[index])
        assert len(result.quality_curve) == TURNS
        assert result.peaks[0].turn_deg == result.turn_deg
        assert result.peaks[0].arc_deg == result.arc_deg
        assert np.abs(result.match_curve).max() <= 100.0 + 1e-3


@pytest.mark.parametrize("front", [90.0, -33.3, 400.0])
def test_the_front_moves_every_turn(front: float) -> None:
    light = _scene(8)
    for plain, moved in zip(
        solve_all(PACK, light), solve_all(PACK, light, front_deg=front), strict=True
    ):
        assert moved.turn_deg == wrap(plain.turn_deg - front)
        assert moved.turn_refined_deg == wrap(plain.turn_refined_deg - front)
        np.testing.assert_allclose(moved.quality_curve, shift(plain.quality_curve, front))
        assert moved.arc_deg == (wrap(plain.arc_deg[0] - front), wrap(plain.arc_deg[1] - front))
        assert moved.match == plain.match
        assert moved.turn_index == plain.turn_index


def test_styles_can_be_chosen() -> None:
    found = solve_all(PACK, _scene(1), styles=["below", "butterfly"])
    assert [result.name for result in found] == ["butterfly", "below"]
    with pytest.raises(StyleError, match="no target"):
        solve_all(PACK, _scene(1), styles=["disco"])


@pytest.mark.parametrize(
    "light", [np.zeros((32, 64)), np.full((32, 64), np.nan), np.full((32, 64), np.inf)]
)
def test_environments_without_light_are_refused(light: Float) -> None:
    with pytest.raises(EnvironmentFileError, match="black"):
        solve_all(PACK, light)


def test_an_environment_of_another_size_is_refused() -> None:
    with pytest.raises(EnvironmentFileError, match=r"needs \(32, 64\)"):
        solve_all(PACK, np.ones((16, 32)))


def test_painted_weights_solve_like_the_style_they_copy() -> None:
    transport = lambert_sphere_transport()
    target = PACK.target("left-loop").reshape(-1, 3)[transport.pixels]
    luminance = target @ np.array([0.2126, 0.7152, 0.0722])
    weights = painted(transport, target_weights(luminance, transport.face))
    light = _scene(2)
    result = solve_painted(transport, weights, light)
    style = _by_name(light)["left-loop"]
    quality = style.quality_curve / np.ptp(style.quality_curve)
    np.testing.assert_allclose(
        result.quality_curve / np.ptp(result.quality_curve), quality, atol=2e-3
    )
    # The style is judged over the face, painted weights wherever they are painted.
    assert result.turn_deg == pytest.approx(style.turn_deg, abs=6.0)


def test_painted_match_counts_only_the_pixels_that_are_not_ignored() -> None:
    transport = lambert_sphere_transport()
    rng = np.random.default_rng(5)
    values, ignored = rng.random(len(transport.pixels)), rng.random(len(transport.pixels)) < 0.3
    weights = painted(transport, values, ignored)
    light = _scene(3)
    result = solve_painted(transport, weights, light)
    active = weights.active
    for turn in (0, 17, 40):
        lit = (matrix(transport) @ np.roll(light, -turn, axis=1).ravel())[active]
        expected = 100 * np.corrcoef(values[active], lit)[0, 1]
        assert result.match_curve[turn] == pytest.approx(expected, abs=0.01)
    assert result.name == "painted"


@pytest.mark.parametrize("shape", [(16, 32), (64, 128)])
def test_other_environment_sizes_give_the_same_turns(shape: tuple[int, int]) -> None:
    pack = synthetic_pack(20, shape)
    light = lamp_environment(47.8, 35.0, 12.0, shape)
    found = {result.name: result for result in solve_all(pack, light)}
    assert found["left-loop"].turn_refined_deg == pytest.approx(82.8, abs=3.0)
    assert found["butterfly"].turn_refined_deg == pytest.approx(47.8, abs=2.0)
    transport = lambert_sphere_transport(20, shape)
    target = pack.target("left-loop").reshape(-1, 3)[transport.pixels]
    luminance = target @ np.array([0.2126, 0.7152, 0.0722])
    weights = painted(transport, target_weights(luminance, transport.face))
    result = solve_painted(transport, weights, light)
    assert abs(difference(result.turn_deg, found["left-loop"].turn_deg)) <= 5.625
    assert result.match == pytest.approx(found["left-loop"].match, abs=1.0)


def test_blank_painting_is_unattainable_and_says_so() -> None:
    transport = lambert_sphere_transport()
    result = solve_painted(transport, painted(transport, np.ones(len(transport.pixels))), _scene(1))
    assert not result.attainable
    assert result.turn_deg == 0.0
    assert isinstance(result.shortfall, LightShortfall)
    assert (result.shortfall.measure, result.shortfall.value) == ("match", 0.0)


def test_quality_is_the_sum_over_the_pre_integrated_target() -> None:
    transport, light = lambert_sphere_transport(), _scene(9)
    target = PACK.target("top").reshape(-1, 3)[transport.pixels]
    f = target_weights(target @ np.array([0.2126, 0.7152, 0.0722]), transport.face)
    expected = float((preintegrate(transport, f) * light).sum())
    result = _by_name(light)["top"]
    assert result.quality_curve[0] == pytest.approx(expected, rel=2e-3)
