"""Brackets for a camera's lists: legal values, order, true offsets, and both ends of the range."""

from __future__ import annotations

import itertools
import math
from typing import Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base.errors import ProbeError
from app.core.camera_catalogue import CAMERAS, CameraFacts, CameraLimits, camera_facts
from app.core.measure.plan.planner import Plan, plan
from app.core.measure.plan.remarks import (
    BracketShifted,
    DarkestExposure,
    OffsetMissed,
    WiderSteps,
)
from app.core.measure.read.frame import Exposure
from app.words.remarks import sentences

MODELS = st.sampled_from(CAMERAS)


def limits_of(name: str) -> CameraLimits:
    found = camera_facts(name)
    assert found is not None
    return found.limits


def offsets(made: Plan) -> list[float]:
    return [shot.ev_offset for shot in made.shots]


def check_plan(made: Plan, metered: Exposure, limits: CameraLimits, longest_s: float) -> None:
    """What holds for every plan."""
    first = made.shots[0].exposure
    for shot in made.shots:
        assert shot.exposure.shutter_s in limits.shutters_s
        assert shot.exposure.shutter_s <= longest_s
        assert shot.exposure.iso in limits.isos
        assert shot.exposure.aperture in limits.apertures
        assert (shot.exposure.iso, shot.exposure.aperture) == (first.iso, first.aperture)
        # By the definition of the exposure, not by the property that the planner uses.
        real = (
            math.log2(shot.exposure.shutter_s / metered.shutter_s)
            + math.log2(shot.exposure.iso / metered.iso)
            - 2.0 * math.log2(shot.exposure.aperture / metered.aperture)
        )
        assert shot.ev_offset == pytest.approx(real, abs=1e-9)
    assert len({shot.exposure for shot in made.shots}) == len(made.shots) >= 2
    if not any("bracket is shot" in note for note in sentences(made.notes)):
        assert made.shots[0].wanted_ev == 0.0
    assert abs(made.shots[0].ev_offset - made.shots[0].wanted_ev) <= 0.21
    if len(made.shots) > 2 and made.shots[1].wanted_ev > made.shots[0].wanted_ev:
        assert made.shots[1].ev_offset > made.shots[0].ev_offset
    dark = [shot.ev_offset for shot in made.shots if shot.wanted_ev < 0.0]
    assert dark == sorted(dark, reverse=True)


@given(
    MODELS,
    st.floats(-16.0, 3.0),
    st.sampled_from([64, 100, 125, 400, 1600, 3200]),
    st.sampled_from([2.0, 2.1, 2.4, 3.5, 5.6]),
    st.sampled_from(["paper", "full"]),
    st.integers(2, 19),
    st.sampled_from([0.5, 4.0, 15.0, 30.0]),
)
@settings(max_examples=400, deadline=None)
def test_every_plan_is_legal(
    model: CameraFacts,
    log_time: float,
    iso: int,
    aperture: float,
    kind: str,
    shots: int,
    longest_s: float,
) -> None:
    metered = Exposure(2.0**log_time, float(iso), aperture)
    assert kind in ("paper", "full")
    made = plan(
        metered,
        model.limits,
        "paper" if kind == "paper" else "full",
        shots,
        longest_s=longest_s,
        overhead_s=model.overhead_s,
    )
    check_plan(made, metered, model.limits, longest_s)
    assert len(made.shots) <= (3 if kind == "paper" else max(shots, 2))
    total = sum(shot.exposure.shutter_s for shot in made.shots)
    assert made.expected_s == pytest.approx(total + model.overhead_s * len(made.shots))
    for shot in made.shots:
        # The lists' widest gap is that between 1/8 and 1/6 s.
        missed = abs(shot.ev_offset - shot.wanted_ev)
        told = any(
            isinstance(note, OffsetMissed) and note.wanted_ev == shot.wanted_ev
            for note in made.notes
        )
        assert missed <= 0.21 or told
        assert missed > 1.0 / 6.0 or not told


@pytest.mark.parametrize("model", CAMERAS, ids=lambda model: model.name)
@pytest.mark.parametrize("time", [1 / 1000, 1 / 125, 1 / 30, 1 / 8])
def test_full_goes_down_to_the_camera_s_floor(model: CameraFacts, time: float) -> None:
    limits = model.limits
    metered = Exposure(time, limits.isos[1], limits.apertures[0])
    made = plan(metered, limits, "full", model.max_shots)
    check_plan(made, metered, limits, 4.0)
    darkest = made.shots[-1].exposure
    assert darkest.shutter_s == min(limits.shutters_s)
    assert darkest.iso == min(limits.isos)
    real = sorted(offsets(made), reverse=True)
    assert real[0] == pytest.approx(2.0, abs=0.21)
    steps = [bright - dark for bright, dark in itertools.pairwise(real)]
    assert all(1.6 < step < 2.4 for step in steps[:-1])
    assert 0.3 < steps[-1] < 2.75
    assert len(made.shots) <= model.max_shots
    assert sentences(made.notes) == () or "bright" in sentences(made.notes)[0]


def test_paper_at_an_ordinary_exposure() -> None:
    made = plan(Exposure(1 / 125, 64.0, 2.0), limits_of("V"), "paper", overhead_s=3.0)
    assert [shot.exposure.shutter_s for shot in made.shots] == [0.008, 0.03333333, 0.002]
    assert [shot.wanted_ev for shot in made.shots] == [0.0, 2.0, -2.0]
    assert offsets(made) == pytest.approx([0.0, 2.0589, -2.0], abs=1e-4)
    assert made.expected_s == pytest.approx(9.0433, abs=1e-4)
    assert made.notes == ()


def test_paper_takes_the_lowest_iso_that_the_cap_allows() -> None:
    # 1/2 s at ISO 400: +2 EV at ISO 64 would take 12.5 s, at ISO 200 it takes 4 s.
    made = plan(Exposure(0.5, 400.0, 2.0), limits_of("V"), "paper")
    assert {shot.exposure.iso for shot in made.shots} == {200.0}
    assert made.shots[1].exposure.shutter_s == 4.0
    longer = plan(Exposure(0.5, 400.0, 2.0), limits_of("V"), "paper", longest_s=15.0)
    assert {shot.exposure.iso for shot in longer.shots} == {64.0}


def test_paper_keeps_the_metered_aperture_and_closes_it_in_the_sun() -> None:
    z1 = limits_of("Z1")
    made = plan(Exposure(1 / 640, 80.0, 5.6), z1, "paper")
    assert {shot.exposure.aperture for shot in made.shots} == {5.6}
    bright = plan(Exposure(1 / 16000, 80.0, 2.1), z1, "paper")
    assert {shot.exposure.aperture for shot in bright.shots} == {3.5}
    assert bright.notes == ()
    indoors = plan(Exposure(1 / 30, 200.0, 2.1), z1, "paper")
    assert {shot.exposure.aperture for shot in indoors.shots} == {2.1}


def test_sunlight_on_the_oldest_model_is_told_truly() -> None:
    # ISO 100 and about 1/2400 s: -2 EV wants 1/9600 s, and 1/6400 s is the shortest.
    made = plan(Exposure(1 / 2400, 100.0, 2.0), limits_of("S"), "paper")
    assert made.shots[-1].exposure.shutter_s == 0.00015625
    assert made.shots[-1].ev_offset == pytest.approx(-1.415, abs=1e-3)
    (note,) = made.notes
    assert note == OffsetMissed(-2.0, made.shots[-1].ev_offset)
    full = plan(Exposure(1 / 2400, 100.0, 2.0), limits_of("S"), "full")
    assert len(full.shots) == 3
    assert isinstance(full.notes[0], DarkestExposure)
    assert full.notes[0].floor_ev == pytest.approx(-1.415, abs=1e-3)


def test_night_raises_iso_to_its_end_and_says_what_is_missing() -> None:
    made = plan(Exposure(4.0, 3200.0, 2.4), limits_of("X"), "paper")
    assert [shot.exposure.shutter_s for shot in made.shots] == [4.0, 1.0]
    assert made.notes == (OffsetMissed(2.0, 0.0),)
    darker = plan(Exposure(16.0, 3200.0, 2.4), limits_of("X"), "paper")
    assert [shot.exposure.shutter_s for shot in darker.shots] == [4.0, 1.0]
    assert offsets(darker) == pytest.approx([-2.0, -4.0])
    assert isinstance(darker.notes[0], BracketShifted)
    assert darker.notes[0].middle_ev == pytest.approx(-2.0)


def test_a_place_brighter_than_the_camera_can_take() -> None:
    # As bright as f/16 at 1/6400 s; the camera has f/2 only.
    for kind in ("paper", "full"):
        chosen: Literal["paper", "full"] = "paper" if kind == "paper" else "full"
        made = plan(Exposure(1 / 6400, 100.0, 16.0), limits_of("S"), chosen)
        assert offsets(made) == pytest.approx([6.0, 8.0])
        assert isinstance(made.notes[0], BracketShifted)
        assert made.notes[0].middle_ev > 0.0


def test_full_with_few_frames_spreads_them_and_keeps_the_darkest() -> None:
    many = plan(Exposure(1 / 30, 200.0, 2.1), limits_of("Z1"), "full", 19)
    few = plan(Exposure(1 / 30, 200.0, 2.1), limits_of("Z1"), "full", 5)
    assert len(many.shots) == 9
    assert len(few.shots) == 5
    assert few.shots[-1] == many.shots[-1]
    assert few.shots[:2] == many.shots[:2]
    dark = [0.0, *offsets(few)[2:]]
    steps = [bright - dim for bright, dim in itertools.pairwise(dark)]
    assert steps == pytest.approx([4.62] * 3, abs=0.1)
    (note,) = few.notes
    assert isinstance(note, WiderSteps)
    assert (note.frames, note.usual_ev) == (5, 2.0)
    assert note.step_ev == pytest.approx(4.62, abs=0.1)
    two = plan(Exposure(1 / 30, 200.0, 2.1), limits_of("Z1"), "full", 2)
    assert [shot.wanted_ev for shot in two.shots] == pytest.approx([0.0, -13.85], abs=0.01)


def test_full_closes_the_aperture_for_a_darker_floor() -> None:
    z1 = limits_of("Z1")
    made = plan(Exposure(1 / 30, 200.0, 2.1), z1, "full", 19)
    assert {shot.exposure.aperture for shot in made.shots} == {5.6}
    quick = plan(Exposure(1 / 30, 200.0, 2.1), z1, "full", 19, longest_s=0.4)
    assert {shot.exposure.aperture for shot in quick.shots} == {2.1}


def test_lists_in_any_order_make_the_same_plan() -> None:
    limits = limits_of("Z1")
    turned = CameraLimits(limits.shutters_s[::-1], limits.isos[::-1] * 2, (3.5, 5.6, 2.1))
    metered = Exposure(1 / 47, 250.0, 3.5)
    assert plan(metered, limits, "paper") == plan(metered, turned, "paper")
    assert plan(metered, limits, "full") == plan(metered, turned, "full")


def test_unusable_requests_are_refused() -> None:
    limits, metered = limits_of("V"), Exposure(1 / 60, 100.0, 2.0)
    with pytest.raises(ProbeError, match="does not record"):
        plan(Exposure(1 / 60, known=False), limits, "paper")
    for shots in (1, 0, -3, 20):
        with pytest.raises(ProbeError, match="2 to 19 frames"):
            plan(metered, limits, "full", shots)
    for longest in (0.0, 1e-6, math.nan, math.inf):
        with pytest.raises(ProbeError, match="cannot expose for"):
            plan(metered, limits, "paper", longest_s=longest)
    with pytest.raises(ProbeError, match="two different exposures"):
        plan(metered, CameraLimits((1 / 60,), (100.0,), (2.0,)), "paper")
    for shutters in ((), (0.0,), (math.nan,), (math.inf,), (-1.0, 1.0)):
        with pytest.raises(ProbeError, match="shutter speeds"):
            CameraLimits(shutters, (100.0,), (2.0,))
    with pytest.raises(ProbeError, match="ISO values"):
        CameraLimits((1.0,), (), (2.0,))
    with pytest.raises(ProbeError, match="apertures"):
        CameraLimits((1.0,), (100.0,), ())


@pytest.mark.parametrize(
    ("name", "shutters", "isos", "apertures", "count"),
    [
        ("S", (0.00015625, 60.0), (100.0, 1600.0), (2.0,), 13),
        ("SC", (0.000125, 60.0), (100.0, 1600.0), (2.0,), 13),
        ("V", (0.00004, 60.0), (64.0, 3200.0), (2.0,), 18),
        ("Z1", (0.00004, 60.0), (80.0, 6400.0), (2.1, 3.5, 5.6), 20),
        ("X", (0.0000625, 60.0), (50.0, 3200.0), (2.4,), 19),
    ],
)
def test_the_makers_documented_ranges(
    name: str,
    shutters: tuple[float, float],
    isos: tuple[float, float],
    apertures: tuple[float, ...],
    count: int,
) -> None:
    model = camera_facts(name)
    assert model is not None
    limits = model.limits
    assert (min(limits.shutters_s), max(limits.shutters_s)) == shutters
    assert (min(limits.isos), max(limits.isos)) == isos
    assert limits.apertures == apertures
    assert len(limits.isos) == count
    for values in (limits.shutters_s, limits.isos):
        assert list(values) == sorted(set(values))
        steps = [math.log2(b / a) for a, b in itertools.pairwise(values)]
        assert all(0.2 < step < 0.45 for step in steps[:-1])  # V and Z1 jump from 30 to 60 s.


def test_values_that_only_one_model_has() -> None:
    for model in CAMERAS:
        newer = model.name in ("X", "A1")
        assert (0.00007812 in model.limits.shutters_s) == newer
        assert (40.0 in model.limits.shutters_s) == newer
        if min(model.limits.shutters_s) < 0.00008:
            assert (0.00008 in model.limits.shutters_s) != newer


def test_models_are_found_by_the_names_they_give() -> None:
    for name, expected in (
        ("RICOH THETA S  ", "S"),
        ("RICOH THETA SC2", "SC2"),
        ("RICOH THETA SC2B", "SC2"),
        ("RICOH360 THETA A1", "A1"),
        ("THETA Z1", "Z1"),
        ("x", "X"),
    ):
        found = camera_facts(name)
        assert found is not None
        assert found.name == expected
    for name in ("", "RICOH THETA", "RICOH THETA m15", "Insta360 X3"):
        assert camera_facts(name) is None
