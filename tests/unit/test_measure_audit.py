"""Tests of the clip audit: what is missing, which answers depend on it, and what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.base.errors import EnvironmentFileError
from app.core.environment.environment import energy, read_environment, reduce_radiance
from app.core.measure.finish.clip_audit import DOUBT, GAINS, Audit, audit, given_up
from app.core.measure.finish.corrections import apply_gains
from app.core.measure.finish.findings import (
    Findings,
    LampFinding,
    advise,
    darker_frames,
    find,
    sources_of,
)
from app.core.measure.finish.lamp_detection import Source, find_lights
from app.core.measure.finish.remarks import (
    BlindMatters,
    LampClipped,
    MaybeSun,
    MoreLampsClipped,
    Remedy,
)
from app.core.measure.finish.restoration import restore
from app.core.measure.read.frame import MergedLight
from app.core.solver.solve import solve_all
from app.core.solver.turn_choice import LIMITS, OBJECTIVES, Limits, Objective
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.words.phrases.directions import direction_words
from app.words.remarks import remark_words, sentences
from benchmarks.speed.plain_search import choose
from tests.helpers.probes import clip, place, sunny_place

SCENES = Path(__file__).resolve().parents[2] / "resources" / "demo" / "scenes"
NAMES = ("city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset")


def _safe(found: Audit) -> tuple[str, ...]:
    """Styles whose turn and reach do not depend on what is clipped."""
    styles = found.style_changes
    return tuple(s.name for s in styles if not s.in_doubt and s.reach_stops is None)


@pytest.fixture(scope="module")
def pack() -> StylePack:
    return load_named_pack("generic")


def scene(name: str) -> NDArray[np.float32]:
    """Bundled scene with a mean luminance of 0.2."""
    radiance = read_environment(SCENES / f"{name}.exr").radiance
    light = luminance(radiance)
    scaled: NDArray[np.float32] = radiance * np.float32(0.2 / np.minimum(light, 20.0).mean())
    return scaled


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_turns_are_those_of_solve(pack: StylePack, objective: Objective) -> None:
    random = np.random.default_rng(7)
    lights = [luminance(reduce_radiance(scene(name))) for name in NAMES]
    lights += [random.gamma(0.2, 1.0, (32, 64)).astype(np.float32) for _ in range(4)]
    lights.append(np.ones((32, 64), np.float32))
    for light in lights:
        wanted = [style.turn_index for style in solve_all(pack, light, objective)]
        assert choose(pack, light, objective).offer.tolist() == wanted


def test_given_up_is_zero_for_the_best_turn_and_a_share_of_the_range(pack: StylePack) -> None:
    light = luminance(reduce_radiance(scene("studio")))
    truth = choose(pack, light, "paper")
    assert given_up(truth, truth.turns).max() == 0.0
    worst = truth.curve.argmin(axis=1)
    assert given_up(truth, worst) == pytest.approx(1.0)
    assert given_up(choose(pack, light * 1000.0, "paper"), worst) == pytest.approx(1.0)


def test_black_light_is_refused(pack: StylePack) -> None:
    with pytest.raises(EnvironmentFileError, match="black"):
        choose(pack, np.zeros((32, 64)))


def test_unclipped_place_is_safe(pack: StylePack) -> None:
    merged = clip(scene("studio"))
    result = audit(merged, find_lights(merged), pack)
    assert result.clipped_energy_range[0] == 0.0
    assert result.clipped_energy_range == (0.0, 0.0)
    assert result.advice == ()
    assert result.in_doubt == ()
    assert len(_safe(result)) == len(pack.styles)


def test_what_no_frame_shows_counts_as_twice_as_bright(pack: StylePack) -> None:
    radiance = place([(40.0, 20.0, 20.0, 20.0), (-140.0, 20.0, 20.0, 18.0)], (256, 512))
    merged = clip(radiance)
    unseen = np.zeros((256, 512), np.float32)
    plain = audit(merged, find_lights(merged), pack, blind=unseen)
    assert plain.in_doubt == ()
    (advice,) = plain.advice
    assert isinstance(advice, BlindMatters)
    assert advice.names == ()
    unseen[:, :128] = 1.0  # the lamp behind, which would be the stronger one then
    found = audit(merged, find_lights(merged), pack, blind=unseen)
    brighter = reduce_radiance(radiance * (1.0 + unseen[..., None]))
    for style, true in zip(found.style_changes, solve_all(pack, brighter), strict=True):
        case = next(each for each in style.cases if each.light == "blind")
        assert case.turn_deg == true.turn_deg
        assert style.in_doubt == (case.given_up > DOUBT)
    assert found.in_doubt
    assert isinstance(found.advice[-1], BlindMatters)
    assert found.advice[-1].names


def test_share_is_a_lower_bound_and_the_range_ends_six_stops_up(pack: StylePack) -> None:
    radiance = place([(40.0, 20.0, 10.0, 64.0 * 8.0)], (512, 1024))
    merged = clip(radiance, 8.0)
    result = audit(merged, find_lights(merged), pack)
    total = energy(merged.radiance)[0]
    lost = energy(merged.radiance * merged.clipped[..., None])[0]
    assert result.clipped_energy_range[0] == pytest.approx(lost / total, rel=2e-3)
    truth = energy(radiance * merged.clipped[..., None])[0] / energy(radiance)[0]
    high = result.clipped_energy_range[1]
    assert high == pytest.approx(truth, rel=2e-3)


def test_range_of_a_sun_ends_where_the_sky_model_does(pack: StylePack) -> None:
    merged = clip(sunny_place() / np.float32(10_000.0), 20.0, cd_m2=10_000.0)
    result = audit(merged, find_lights(merged), pack)
    assert 0.5 < result.clipped_energy_range[1] < 0.95
    assert any("No camera can record it" in line for line in sentences(result.advice))


def test_cases_are_what_gains_would_give(pack: StylePack) -> None:
    # The audit's own shortcut (64 x 32 maps) against brightening the panorama for real.
    merged = clip(place([(40.0, 30.0, 10.0, 900.0), (-100.0, 10.0, 14.0, 6.0)], (512, 1024)), 8.0)
    lights = find_lights(merged)
    result = audit(merged, lights, pack)
    clipped = next(light for light in lights if light.clipped)
    turns = choose(pack, luminance(reduce_radiance(merged.radiance))).turns
    for stops in GAINS:
        brighter = apply_gains(merged, lights, {clipped.id: stops})
        truth = choose(pack, luminance(reduce_radiance(brighter.radiance)))
        for row, style in enumerate(result.style_changes):
            case = next(c for c in style.cases if (c.light, c.stops) == (clipped.id, stops))
            assert case.given_up == pytest.approx(given_up(truth, turns)[row], abs=5e-3)


@pytest.mark.parametrize("limits", [LIMITS, Limits(60.0, 30.0)])
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_reach_changes_where_solving_a_brighter_place_says_so(
    pack: StylePack, objective: Objective, limits: Limits
) -> None:
    rivals = place([(40.0, 25.0, 8.0, 900.0), (-70.0, 25.0, 14.0, 30.0)], (512, 1024))
    merged = clip(rivals, 20.0)
    lights = find_lights(merged)
    result = audit(merged, lights, pack, objective=objective, limits=limits)
    flipped: dict[str, float] = {}
    now = in_reach(pack, merged, objective, limits)
    assert {style.name: style.in_reach for style in result.style_changes} == now
    for light in [light.id for light in lights if light.clipped]:
        for stops in (*GAINS, 10.0):
            there = in_reach(pack, apply_gains(merged, lights, {light: stops}), objective, limits)
            for name in [name for name in there if there[name] != now[name]]:
                flipped[name] = min(stops, flipped.get(name, 99.0))
    assert flipped
    assert not all(now.values())
    for style in result.style_changes:
        if style.name in flipped:
            assert style.reach_stops is not None
            assert style.reach_stops <= flipped[style.name]
            assert style.name not in _safe(result)
    words = " ".join(sentences(result.advice))
    assert "into reach" in words or "out of reach" in words


def in_reach(
    pack: StylePack, merged: MergedLight, objective: Objective, limits: Limits
) -> dict[str, bool]:
    light = luminance(reduce_radiance(merged.radiance))
    return {r.name: r.attainable for r in solve_all(pack, light, objective, limits=limits)}


def test_a_sun_in_frames_of_unknown_exposure_is_asked_about(pack: StylePack) -> None:
    known = clip(sunny_place() / np.float32(10_000.0), 20.0, cd_m2=10_000.0)
    unknown = replace(known, cd_m2=None)
    advice = audit(unknown, find_lights(unknown), pack).advice
    assert sum(isinstance(each, MaybeSun) for each in advice) == 1
    room = clip(place([(40.0, 30.0, 10.0, 900.0), (-100.0, 10.0, 14.0, 6.0)], (512, 1024)), 8.0)
    advice = audit(room, find_lights(room), pack).advice
    assert not any(isinstance(each, MaybeSun) for each in advice)


def test_rival_lamps_put_answers_in_doubt_and_a_lone_lamp_does_not(pack: StylePack) -> None:
    lone = clip(place([(40.0, 25.0, 8.0, 4000.0)]), 500.0)
    result = audit(lone, find_lights(lone), pack)
    assert "left-split" in _safe(result)
    assert "left-loop" in _safe(result)
    rivals = clip(place([(40.0, 25.0, 8.0, 4000.0), (-70.0, 25.0, 14.0, 170.0)]), 100.0)
    rivals = replace(
        rivals, clipped=rivals.clipped * (place([(40.0, 25.0, 8.0, 1.0)])[..., 0] > 0.5)
    )
    result = audit(rivals, find_lights(rivals), pack)
    assert result.in_doubt
    style = next(s for s in result.style_changes if s.in_doubt)
    assert style.worst > DOUBT
    assert {case.light for case in style.cases} == {"all", "B"}
    assert max(case.given_up for case in style.cases) <= style.worst
    assert result.in_doubt + _safe(result)
    assert any(style.name in line or "every style" in line for line in sentences(result.advice))


def test_likely_range_of_a_restored_sun_is_tried(pack: StylePack) -> None:
    merged = clip(sunny_place(35.0, 60.0, 60_000.0) / np.float32(5_000.0), 37.0, cd_m2=5_000.0)
    restored = restore(merged, find_lights(merged), "clear")
    assert restored.light == "A"
    light = luminance(reduce_radiance(restored.merged.radiance))
    result = audit(restored.merged, (), pack, environment=light, restoration=restored)
    turns = choose(pack, light).turns
    for row, style in enumerate(result.style_changes):
        assert [case.light for case in style.cases] == ["A", "A"]
        assert [round(2.0**case.stops, 6) for case in style.cases] == [0.6, 1.6]
        for case, end in zip(style.cases, restored.range_lux, strict=True):
            share = (end - restored.held_lux) / (restored.illuminance_lux - restored.held_lux)
            added = restored.merged.radiance - merged.radiance
            truth = luminance(reduce_radiance(merged.radiance + np.float32(share) * added))
            assert case.given_up == pytest.approx(
                given_up(choose(pack, truth), turns)[row], abs=1e-3
            )
    without = audit(restored.merged, (), pack, environment=light)
    assert all(not style.cases for style in without.style_changes)
    assert without.in_doubt == ()


@pytest.mark.slow
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_every_bad_answer_is_flagged(pack: StylePack, objective: Objective) -> None:
    """Bundled places, clipped from 1 to 15 stops deep: no answer off by more than 10 % is safe."""
    bad, doubted, pairs = 0, 0, 0
    for name in NAMES:
        radiance = scene(name)
        truth = choose(pack, luminance(reduce_radiance(radiance)), objective)
        for stops in (0.0, 2.0, 4.0, 7.0):
            merged = clip(radiance, 2.0**stops)
            if not merged.clipped.any():
                continue
            light = luminance(reduce_radiance(merged.radiance))
            lost = given_up(truth, choose(pack, light, objective).turns)
            result = audit(
                merged, find_lights(merged), pack, objective=objective, environment=light
            )
            for style, share in zip(result.style_changes, lost, strict=True):
                pairs, bad = pairs + 1, bad + (share > 0.1)
                doubted += style.in_doubt
                assert style.in_doubt or share <= 0.1, (name, stops, style.name, share)
    assert bad > 20  # the test would be empty otherwise
    assert doubted < 0.85 * pairs  # and an audit that doubts everything says nothing


def test_directions_in_words() -> None:
    wanted = {
        (0.0, 0.0): "in front",
        (-10.0, 45.0): "in front, high",
        (45.0, 0.0): "in front on the right",
        (-90.0, 10.0): "on the left",
        (90.0, -30.0): "on the right, low",
        (135.0, 0.0): "behind on the right",
        (-179.0, 31.0): "behind, high",
        (190.0, 0.0): "behind",
        (12.0, 80.0): "overhead",
        (12.0, -80.0): "underfoot",
    }
    for (azimuth, elevation), words in wanted.items():
        assert direction_words(azimuth, elevation) == words


def named(
    radiance: NDArray[np.float32], cd_m2: float | None = None, level: float = 8.0
) -> MergedLight:
    return clip(radiance, level, cd_m2)


def test_words_fit_shape_and_size() -> None:
    window = place([], (512, 1024))
    window[200:290, 700:780] = 100.0
    lamp = place([(-100.0, 30.0, 5.0, 100.0)], (512, 1024))
    for radiance, kind, where in (
        (window, "window", "on the right"),
        (lamp, "lamp", "on the left"),
    ):
        merged = named(radiance)
        lights = find_lights(merged)
        assert sources_of(merged, lights)[0] == kind
        (line,) = advise(merged, lights, None, None)
        assert f"The {kind} {where}" in remark_words(line)
    ceiling = place([(0.0, 85.0, 60.0, 100.0)])
    assert find(ceiling).lamps[0].kind == "above"


def _lit(
    rows: tuple[float, float],
    columns: tuple[float, float],
    value: float = 100.0,
    sky: tuple[float, float, float] = (1.0, 1.0, 1.0),
    ground: float = 1.0,
) -> NDArray[np.float32]:
    """A place with a bright rectangle between elevations and azimuths, deg."""
    radiance = np.empty((256, 512, 3), np.float32)
    radiance[:128], radiance[128:] = sky, ground
    top, bottom = (round((0.5 - angle / 180.0) * 256) for angle in rows[::-1])
    left, right = (round((0.5 + angle / 360.0) * 512) for angle in columns)
    radiance[top:bottom, left:right] = value
    return radiance


@pytest.mark.parametrize(
    ("rows", "columns", "kind"),
    [
        ((-25.0, 25.0), (10.0, 40.0), "window"),  # to under the horizon: still a window
        ((-27.0, 1.0), (80.0, 100.0), "window"),
        ((-12.0, 3.0), (30.0, 110.0), "wall"),  # long and low, across the horizon: no ground
        ((-70.0, -20.0), (0.0, 80.0), "ground"),
        ((-16.0, -6.0), (0.0, 14.0), "area"),  # too near the horizon to tell ground from wall
        ((-40.0, -37.0), (0.0, 3.0), "lamp"),  # small: a lamp, or its reflection
        ((50.0, 75.0), (0.0, 120.0), "above"),
    ],
)
def test_light_is_named_by_where_it_is_and_how_large(
    rows: tuple[float, float], columns: tuple[float, float], kind: Source
) -> None:
    lamp = find(_lit(rows, columns)).lamps[0]
    assert lamp.kind == kind


def test_ground_is_dim() -> None:
    # A bare source as large as a patch of floor: brighter than any floor in its light.
    lamp = find(_lit((-32.0, -18.0), (0.0, 16.0), 1e6)).lamps[0]
    assert lamp.kind != "ground"


def test_sun_shines_in_a_sky_bluer_than_itself() -> None:
    disc, blue = ((40.0, 41.4), (30.0, 31.4)), (0.5, 1.0, 2.0)
    assert find(_lit(*disc, 3e4, blue)).lamps[0].kind == "sun"
    # A bare bulb in a room is no sun: its own light comes back from the walls.
    assert find(_lit(*disc, 3e4)).lamps[0].kind == "lamp"
    assert find(_lit((-41.4, -40.0), disc[1], 3e4, blue)).lamps[0].kind == "lamp"


def test_bright_part_of_an_open_sky_is_no_window() -> None:
    radiance = _lit((20.0, 45.0), (0.0, 40.0), 30.0, (8.0, 8.0, 9.0), 0.5)
    assert find(radiance).lamps[0].kind == "sky"


@pytest.mark.parametrize(
    ("kinds", "light"),
    [
        ([("sun", 0.5), ("window", 0.2)], "sun"),
        ([("lamp", 0.3)], "lamp"),
        ([("lamp", 0.1), ("lamp", 0.1), ("lamp", 0.08)], "lamps"),
        ([("window", 0.1), ("window", 0.1), ("lamp", 0.15)], "window"),
        ([("window", 0.1), ("wall", 0.6)], "soft"),
        ([], "soft"),
    ],
)
def test_what_most_shapes_a_face(kinds: list[tuple[Source, float]], light: str) -> None:
    lamps = [LampFinding("A", kind, 0.0, 20.0, 5.0, share, False) for kind, share in kinds]
    assert Findings(tuple(lamps)).light == light


def test_frames_follow_from_what_such_lights_reach() -> None:
    window = place([], (512, 1024))
    window[200:290, 700:780] = 100.0
    counts = []
    for unit in (30.0, 300.0, 3000.0, 30_000.0):
        merged = named(window, unit)
        light = find_lights(merged)[0]
        counts.append(darker_frames(light, merged, "window"))
    assert counts == [4, 3, 1, 1]
    merged = named(window)
    assert darker_frames(find_lights(merged)[0], merged, "window") == 2


def test_advice_knows_the_cameras_floor() -> None:
    window = place([], (512, 1024))
    window[200:290, 700:780] = 100.0
    merged = named(window)
    lights = find_lights(merged)
    told = [advise(merged, lights, None, room)[0] for room in (None, 0.2, 2.0, 9.0)]
    asked = [
        (one.remedy, one.frames, one.room_stops) for one in told if isinstance(one, LampClipped)
    ]
    darker = Remedy.DARKER_FRAMES
    assert [asked[0], *asked[2:]] == [(darker, 2, None), (darker, 1, 2.0), (darker, 2, None)]
    assert asked[1][0] is Remedy.GAIN


def test_many_clipped_lamps_are_summed_up() -> None:
    lamps = [(azimuth, 20.0, 5.0, 100.0) for azimuth in (-150.0, -90.0, -30.0, 30.0, 90.0)]
    merged = named(place(lamps, (512, 1024)))
    lines = advise(merged, find_lights(merged), None, None)
    assert len(lines) == 4
    assert lines[-1] == MoreLampsClipped(2)
