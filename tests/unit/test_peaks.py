"""From curves to turns: ties, refinement, gates, arcs, rivals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.core.base.angles import TURNS, difference, lies_on_arc, turn_of_index
from app.core.solver.peaks import Gate, best_index, find_peak, find_peaks, shift

Float = NDArray[np.float64]
TURN_RAD = 2 * np.pi * np.arange(TURNS) / TURNS
EVERYWHERE = np.ones(TURNS, bool)
MIRRORED = -np.arange(TURNS) % TURNS


def _bump(centre_deg: float, sharpness: float = 4.0) -> Float:
    """A smooth peak of height 1."""
    bump: Float = np.exp(sharpness * (np.cos(TURN_RAD - np.radians(centre_deg)) - 1))
    return bump


def _curve(seed: int) -> Float:
    """A lively band-limited curve."""
    rng = np.random.default_rng(seed)
    curve = np.zeros(TURNS)
    for m in range(1, 12):
        curve += rng.standard_normal() * np.cos(m * TURN_RAD + rng.uniform(0, 7)) / m
    return curve


def test_ties_go_to_the_smaller_turn_then_clockwise() -> None:
    curve = np.zeros(TURNS)
    curve[[5, 60, 32]] = 1.0
    assert best_index(curve, EVERYWHERE) == 60
    curve[4] = 1.0
    assert best_index(curve, EVERYWHERE) == 4
    curve[32] = 1.0 + 5e-7
    assert best_index(curve, EVERYWHERE) == 4
    curve[32] = 1.0 + 5e-6
    assert best_index(curve, EVERYWHERE) == 32


def test_a_flat_curve_means_no_turn_and_the_whole_circle() -> None:
    flat = np.full(TURNS, -3.0) + 1e-9 * _curve(1)
    peak = find_peak(flat, best_index(flat, EVERYWHERE))
    assert (peak.turn_deg, peak.refined_deg) == (0.0, 0.0)
    assert peak.arc_deg == (-180.0, 180.0)


@given(st.floats(-179.9, 179.9))
def test_the_refined_turn_is_the_maximum_between_the_grid_turns(centre: float) -> None:
    curve = _bump(centre)
    peak = find_peak(curve, best_index(curve, EVERYWHERE))
    assert abs(difference(peak.refined_deg, centre)) < 1e-3
    assert abs(difference(peak.turn_deg, centre)) <= 2.82


@given(st.floats(-179.9, 179.9))
def test_arcs_end_where_three_percent_are_lost(centre: float) -> None:
    curve = _bump(centre)
    start, stop = find_peak(curve, best_index(curve, EVERYWHERE)).arc_deg
    half = np.degrees(np.arccos(1 + np.log(0.97) / 4))
    assert abs(difference(centre, start) - half) < 0.05
    assert abs(difference(stop, centre) - half) < 0.05


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_mirrored_curve_gives_mirrored_turns_exactly(seed: int) -> None:
    curve, strength = _curve(seed), _curve(seed + 1)
    gate = Gate(strength, float(np.quantile(strength, 0.4)))
    index = best_index(curve, gate.open)
    here = find_peak(curve, index, gate)
    there = find_peak(curve[MIRRORED], -index % TURNS, Gate(strength[MIRRORED], gate.limit))
    assert abs(difference(there.turn_deg, -here.turn_deg)) == 0.0
    assert abs(difference(there.refined_deg, -here.refined_deg)) < 1e-12
    assert abs(difference(there.arc_deg[0], -here.arc_deg[1])) < 1e-9
    assert abs(difference(there.arc_deg[1], -here.arc_deg[0])) < 1e-9


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nothing_leaves_the_gate(seed: int) -> None:
    curve, strength = _curve(seed), _curve(seed + 1)
    gate = Gate(strength, float(np.quantile(strength, 0.5)))
    for peak in find_peaks(curve, best_index(curve, gate.open), gate):
        assert gate.open[peak.index]
        for angle in (peak.refined_deg, *np.linspace(0.02, 0.98, 9).tolist()):
            inside = peak.refined_deg
            if angle is not peak.refined_deg:
                start, stop = peak.arc_deg
                inside = start + angle * ((stop - start) % 360.0)
            assert shift(strength, inside)[0] >= gate.limit - 1e-3 * np.ptp(strength)
        assert shift(strength, peak.refined_deg)[0] >= gate.limit - 1e-9
        assert abs(difference(peak.refined_deg, peak.turn_deg)) <= 5.625 + 1e-9


def test_a_gate_stops_the_refined_turn_at_its_edge() -> None:
    gate = Gate(20 + 30 * np.cos(TURN_RAD - np.radians(40)), 40.0)
    curve = _bump(-20)
    index = best_index(curve, gate.open)
    edge = 40 - np.degrees(np.arccos(2 / 3))
    peak = find_peak(curve, index, gate)
    assert peak.refined_deg == pytest.approx(edge, abs=1e-6)
    assert peak.arc_deg[0] == pytest.approx(edge, abs=1e-6)


def _lopsided(steepness: float) -> Float:
    """A match of 93 at 0 deg that falls slowly clockwise and fast counter-clockwise."""
    away = np.degrees(np.angle(np.exp(1j * TURN_RAD)))
    return np.asarray(93.0 - np.where(away > 0, 0.12 * away, -steepness * away))


def _shares(arc: tuple[float, float], turn: float) -> tuple[float, float]:
    """Share of an arc's width before and after a turn."""
    width = (arc[1] - arc[0]) % 360.0
    before = (turn - arc[0]) % 360.0 / width
    return before, 1.0 - before


def test_the_middle_of_the_arc_is_offered_where_it_costs_less_than_the_price() -> None:
    curve = _lopsided(0.3)
    best = find_peak(curve, int(curve.argmax()))
    offered = find_peak(curve, int(curve.argmax()), price=1.0)
    assert offered.arc_deg == best.arc_deg
    assert _shares(offered.arc_deg, offered.refined_deg) == pytest.approx((0.5, 0.5), abs=1e-6)
    lost = shift(curve, best.refined_deg)[0] - shift(curve, offered.refined_deg)[0]
    assert 0.0 < lost < 1.0
    assert abs(difference(offered.turn_deg, offered.refined_deg)) <= 2.82


@pytest.mark.parametrize("steepness", [0.5, 1.0, 3.0])
def test_a_dear_middle_leaves_a_third_of_the_arc_to_the_nearer_end(steepness: float) -> None:
    curve = _lopsided(steepness)
    best = find_peak(curve, 0)
    offered = find_peak(curve, 0, price=0.1)
    before, after = _shares(best.arc_deg, best.refined_deg)
    assert before < 1 / 3 < after
    before, after = _shares(offered.arc_deg, offered.refined_deg)
    assert before == pytest.approx(1 / 3, abs=1e-6)


def test_the_turn_offered_may_stay_near_an_end_that_is_a_grade_s() -> None:
    curve = 90.0 + 5.0 * _bump(0)
    gate = Gate(np.sin(TURN_RAD - np.radians(8.0)), 0.0)
    index = best_index(curve, gate.open)
    best, cheap, dear = (find_peak(curve, index, gate, price=p) for p in (0.0, 1e-3, 5.0))
    assert best.refined_deg == pytest.approx(8.0, abs=0.1)
    assert best.refined_deg <= cheap.refined_deg < best.refined_deg + 2.0
    assert _shares(dear.arc_deg, dear.refined_deg) == pytest.approx((0.5, 0.5), abs=1e-6)


def test_the_turn_offered_stays_among_those_that_are_open() -> None:
    curve = _lopsided(2.0)
    is_open = np.isin(np.arange(TURNS), [63, 0, 1])
    offered = find_peak(curve, 0, price=1.0, is_open=is_open)
    assert find_peak(curve, 0, price=1.0).refined_deg > 6.0
    assert offered.refined_deg == pytest.approx(5.625)
    assert offered.turn_deg == 5.625


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 0.3))
def test_a_mirrored_curve_has_the_mirrored_turn_offered(seed: int, price: float) -> None:
    curve, strength = 10.0 + _curve(seed), _curve(seed + 1)
    gate = Gate(strength, float(np.quantile(strength, 0.4)))
    index = best_index(curve, gate.open)
    here = find_peak(curve, index, gate, price=price)
    mirrored = Gate(strength[MIRRORED], gate.limit)
    there = find_peak(curve[MIRRORED], -index % TURNS, mirrored, price=price)
    assert abs(difference(there.turn_deg, -here.turn_deg)) == 0.0
    assert abs(difference(there.refined_deg, -here.refined_deg)) < 1e-6
    assert gate.open[here.index]
    assert lies_on_arc(here.refined_deg, here.arc_deg)
    assert abs(difference(here.refined_deg, here.turn_deg)) <= 5.625 + 1e-9


def test_rivals_are_listed_best_first_with_their_own_arcs() -> None:
    curve = _bump(10) + 0.8 * _bump(-120) + 0.5 * _bump(130)
    peaks = find_peaks(curve, best_index(curve, EVERYWHERE))
    assert [round(p.refined_deg) for p in peaks] == [10, -120, 130]
    for peak in peaks:
        assert lies_on_arc(peak.refined_deg, peak.arc_deg)
        width = (peak.arc_deg[1] - peak.arc_deg[0]) % 360
        assert 8 < width < 30


def test_ripples_are_no_rivals() -> None:
    curve = _bump(10, 1.0) + 0.002 * np.cos(14 * TURN_RAD)
    assert len(find_peaks(curve, best_index(curve, EVERYWHERE))) == 1


def test_the_chosen_turn_comes_first_even_when_another_is_higher() -> None:
    curve = _bump(0) + 2 * _bump(180)
    assert find_peaks(curve, 0)[0].index == 0


def test_a_negative_curve_still_has_an_arc_around_its_maximum() -> None:
    curve = _bump(45) - 5
    peak = find_peak(curve, best_index(curve, EVERYWHERE))
    assert lies_on_arc(45.0, peak.arc_deg)
    assert peak.refined_deg == pytest.approx(45, abs=1e-3)


@settings(deadline=None)
@given(st.floats(-400, 400), st.integers(0, 1000))
def test_shifting_moves_the_curve_and_back(turn: float, seed: int) -> None:
    curve = _curve(seed)
    np.testing.assert_allclose(shift(shift(curve, turn), -turn), curve, atol=1e-9)


def test_shifting_by_whole_turns_keeps_the_values() -> None:
    curve = _curve(3)
    np.testing.assert_array_equal(shift(curve, turn_of_index(7)), np.roll(curve, -7))
    np.testing.assert_allclose(shift(_bump(30), 12.3), _bump(17.7), atol=1e-6)
