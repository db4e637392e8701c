"""The light that keeps a style out of reach is named, and blocking it does what is claimed."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache, partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.angles import difference, turn_of_index, wrap
from app.core.base.arrays import Float64, Floats
from app.core.base.colour import luminance
from app.core.base.paths import resources
from app.core.environment.environment import (
    Environment,
    from_radiance,
    read_environment,
    reduce,
)
from app.core.measure.finish.findings import Findings, find
from app.core.places.place import AnswerBasis
from app.core.places.place_folder import create_place, read_place, write_place
from app.core.reasons.diagnosis import Diagnosis, diagnose, solver_of
from app.core.reasons.light_in_the_way import (
    NOTABLE,
    NOTABLE_REGION,
    LightInTheWay,
    PlaceRegion,
    lamp_lights,
)
from app.core.reasons.mends import Mend, find_mends
from app.core.reasons.other_spots import results_elsewhere
from app.core.solver.face import AREAS
from app.core.solver.lens.lens_wish import STRAIGHT
from app.core.solver.search import luminance_of
from app.core.solver.shortfall import AreaShortfall, Aspect
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import GRADES
from app.core.solver.transport import render
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from app.words.phrases.light_in_the_way import (
    area_labels,
    help_words,
    in_the_way_sentence,
    mend_sentence,
    needs_label,
)
from tests.helpers.styles_screen import head

SHAPE = (128, 256)
HEAD = head()
PACK = HEAD.pack


def lamp(azimuth_deg: float, elevation_deg: float, power: float = 1.0) -> Float64:
    """A small lamp, relative to a face at turn 0, positive towards the sitter's left."""
    return far_lamp(StyleLamp(azimuth_deg, elevation_deg, 8.0, power, 2.0), SHAPE)


def place(*parts: Floats) -> Environment:
    grey = np.sum(parts, axis=0)
    return from_radiance(np.repeat(grey[..., None], 3, axis=2).astype(np.float32), "lamps")


@cache
def scene(name: str) -> Environment:
    return read_environment(resources() / "demo" / "scenes" / f"{name}.exr")


def answers(environment: Environment) -> dict[str, StyleResult]:
    return {one.name: one for one in solve_all(PACK, reduce(environment))}


def diagnosed(environment: Environment, *names: str) -> dict[str, Diagnosis]:
    light = reduce(environment)
    findings = find(environment.radiance, clipped=environment.clipped)
    results = answers(environment)
    some = [results[name] for name in names or results]
    solve = solver_of(PACK, [], STRAIGHT, "picture", [one.name for one in some], 0.0)
    return diagnose(PACK, lamp_lights(environment, findings, light), some, solve)


def way_of(environment: Environment, name: str) -> LightInTheWay | None:
    return diagnosed(environment, name).get(name, Diagnosis()).way


def rendered(environment: Environment, result: StyleResult) -> Float64:
    """Means of the areas in a rendered picture at the offered turn, which no search took part in.

    The two areas around the head are 0.
    """
    light = reduce(environment, turn_deg=turn_of_index(result.turn_index))
    picture = luminance(render(HEAD.transport, light)).astype(np.float64)
    areas = PACK.areas.reshape(len(AREAS), -1)[:, HEAD.transport.pixels].astype(np.float64)
    means: Float64 = areas @ picture / np.maximum(areas.sum(axis=1), 1e-30)
    return means


def without(environment: Environment, letter: str) -> tuple[Environment, Environment]:
    """The place with a lamp cut out of its panorama, and the lamp alone."""
    findings: Findings = find(environment.radiance, clipped=environment.clipped)
    assert findings.map is not None
    number = [one.letter for one in findings.lamps].index(letter)
    size = environment.shape[::-1]
    mask = cv2.resize(findings.map, size, interpolation=cv2.INTER_NEAREST)[..., None] == number
    parts = (np.where(mask, 0, environment.radiance), np.where(mask, environment.radiance, 0))
    rest, alone = (from_radiance(part.astype(np.float32), "edited") for part in parts)
    return rest, alone


KEY, GLOW = lamp(60.0, 40.0), np.full(SHAPE, 1e-4)
FILL = lamp(-60.0, 0.0, 0.3)


def test_a_fill_lamp_is_named_and_blocking_it_gives_the_style() -> None:
    environment = place(KEY, FILL, GLOW * KEY.max())
    before, alone = answers(environment), answers(place(KEY, GLOW * KEY.max()))
    assert (before["left-rembrandt"].grade, alone["left-rembrandt"].grade) == ("no", "yes")
    diagnosis = diagnosed(environment, "left-rembrandt")["left-rembrandt"]
    way = diagnosis.way
    assert way is not None
    # The fill is the weaker of the two lamps, and stands at panorama azimuth 60.
    assert (way.what, way.letter) == ("lamp", "B")
    assert way.azimuth_deg is not None
    assert way.azimuth_deg + 60.0 == pytest.approx(
        turn_of_index(before["left-rembrandt"].turn_index), abs=1.5
    )
    assert way.share > 0.5
    assert way.blocked is not None
    assert way.blocked.grade == "yes"
    assert abs(difference(way.blocked.turn_refined_deg, 0.0)) < 3.0
    assert [(each.how, each.grade) for each in diagnosis.mends] == [("block", "yes")]


def test_the_mirrored_place_names_the_mirrored_lamp() -> None:
    environment = place(KEY, FILL, GLOW)
    mirrored = from_radiance(np.ascontiguousarray(environment.radiance[:, ::-1]), "mirrored")
    here, there = way_of(environment, "left-rembrandt"), way_of(mirrored, "right-rembrandt")
    assert here is not None
    assert there is not None
    assert here.azimuth_deg is not None
    assert there.azimuth_deg == pytest.approx(-here.azimuth_deg, abs=0.01)
    assert there.share == pytest.approx(here.share, abs=1e-3)


def test_even_light_names_no_lamp_and_no_side() -> None:
    for name, diagnosis in diagnosed(place(np.ones(SHAPE))).items():
        assert diagnosis.way is not None, name
        assert diagnosis.way.what is PlaceRegion.AROUND, name
        assert diagnosis.mends == (), name


def test_broad_fill_comes_from_all_around() -> None:
    """A uniform glow is no lamp and no region, however strong it is."""
    environment = place(KEY, np.full(SHAPE, 0.004 * KEY.max()))
    result = answers(environment)["left-rembrandt"]
    assert isinstance(result.shortfall, AreaShortfall)
    way = way_of(environment, "left-rembrandt")
    assert way is not None
    assert (way.what, way.letter, way.azimuth_deg, way.blocked) == (
        PlaceRegion.AROUND,
        "",
        None,
        None,
    )
    # Seen from the dark area, the glow is what remains without the key.
    glow = rendered(place(np.full(SHAPE, 0.004 * KEY.max())), result)
    whole = rendered(environment, result)
    dark = AREAS.index(result.shortfall.dark)
    assert way.share == pytest.approx(glow[dark] / whole[dark], rel=0.02)


def test_a_wide_wall_is_named_by_its_side() -> None:
    """A wall that is hardly brighter than the sphere on average is no lamp."""
    wall = np.zeros(SHAPE)
    wall[40:88, 128 + 20 : 128 + 108] = 1.0  # panorama azimuth 28 to 152: the sitter's right
    environment = place(KEY, 0.002 * KEY.max() * wall, GLOW * KEY.max())
    way = way_of(environment, "left-rembrandt")
    assert way is not None
    assert (way.what, way.letter) == (PlaceRegion.RIGHT, "")
    assert way.share >= NOTABLE_REGION
    assert way.blocked is not None
    assert way.blocked.grade == "yes"


def test_the_key_itself_is_not_in_the_way() -> None:
    """A deep shadow needs fill: nothing is gained by blocking the lamp that casts it."""
    environment = place(lamp(35.0, 35.0), GLOW)
    for name, diagnosis in diagnosed(environment).items():
        if diagnosis.way is not None and diagnosis.way.letter:
            assert not name.endswith(("loop", "rembrandt", "split")), name


@pytest.mark.parametrize("name", ["studio", "interior", "courtyard", "night"])
def test_the_prediction_is_that_of_the_edited_panorama(name: str) -> None:
    environment, results = scene(name), answers(scene(name))
    lamps = 0
    edited: dict[str, tuple[Environment, Environment, dict[str, StyleResult]]] = {}
    for style, diagnosis in diagnosed(environment).items():
        way, result = diagnosis.way, results[style]
        shortfall = result.shortfall
        if way is None or not way.letter or not isinstance(shortfall, AreaShortfall):
            continue
        if way.letter not in edited:
            rest, alone = without(environment, way.letter)
            edited[way.letter] = rest, alone, answers(rest)
        rest, alone, after = edited[way.letter]
        assert way.blocked is not None
        assert way.stops is not None
        assert way.blocked.grade == after[style].grade
        assert abs(difference(way.blocked.turn_refined_deg, after[style].turn_refined_deg)) < 1.0
        whole, lamp_alone = rendered(environment, result), rendered(alone, result)
        area = AREAS.index(way.area)
        assert way.share >= NOTABLE
        assert way.share == pytest.approx(lamp_alone[area] / whole[area], abs=0.01)
        bright, dark = AREAS.index(shortfall.bright), AREAS.index(shortfall.dark)
        left = rendered(rest, result)
        if left[bright] > 0:  # not the background
            assert way.stops == pytest.approx(np.log2(left[bright] / left[dark]), abs=0.05)
        towards = way.stops - shortfall.value_stops
        assert (towards > 0) == (shortfall.value_stops < shortfall.limit_stops)
        lamps += 1
    assert lamps >= 5


def test_grey_light_is_diagnosed_too() -> None:
    environment = place(KEY, FILL, GLOW * KEY.max())
    colour, grey = reduce(environment), luminance_of(reduce(environment))
    findings = find(environment.radiance)
    solve = solver_of(PACK, [], STRAIGHT, "picture", ["left-rembrandt"], 0.0)
    ways = []
    for light in (colour, grey):
        result = solve(light)
        diagnosis = diagnose(PACK, lamp_lights(environment, findings, light), result, solve)
        ways.append(diagnosis["left-rembrandt"].way)
    assert ways[0] is not None
    assert ways[1] is not None
    assert ways[0].letter == ways[1].letter == "B"
    assert ways[0].share == pytest.approx(ways[1].share, abs=0.01)


def graded(grade: str, match: float = 80.0, name: str = "left-loop") -> StyleResult:
    result = answers(place(KEY, FILL, GLOW))[name]
    number = GRADES.index(grade)
    return replace(result, grade=GRADES[number], attainable=number > 0, match=match)


def test_only_a_better_grade_is_a_mend() -> None:
    soft, yes, no = graded("soft"), graded("yes"), graded("no")
    way = LightInTheWay("lamp", "B", False, -60.0, 0.0, "right nose", 0.4, 1.2, soft)
    assert [each.grade for each in find_mends(no, way)] == ["soft"]
    assert find_mends(soft, way) == ()
    assert find_mends(yes, way, {"Kitchen": yes}) == ()
    assert find_mends(no, None, {"Kitchen": no}) == ()


def test_the_best_other_spot_is_offered() -> None:
    spots = {"Kitchen": graded("soft", 90.0), "Stairs": graded("yes", 80.0), "Hall": graded("no")}
    (mend,) = find_mends(graded("no"), None, spots)
    assert (mend.how, mend.spot, mend.grade) == ("spot", "Stairs", "yes")


def test_other_spots_are_those_of_the_same_day_and_head(tmp_path: Path) -> None:
    noon = datetime(2026, 11, 21, 12, tzinfo=UTC)
    basis, results = AnswerBasis(), (graded("yes"),)

    def save(name: str, when: datetime, **facts: object) -> Path:
        folder = create_place(tmp_path, name, when)
        saved = {"asked": basis, "results": results, **facts}
        write_place(folder, replace(read_place(folder), **saved))  # type: ignore[arg-type]
        return folder

    here = save("Here", noon)
    save("Stairs", noon + timedelta(hours=1))
    save("Yesterday", noon - timedelta(days=1))
    save("Another head", noon, asked=replace(basis, head="female"))
    save("Not solved", noon, asked=None, results=())
    again = create_place(tmp_path, "Later", noon, spot=read_place(here).spot)
    write_place(again, replace(read_place(again), asked=basis, results=results))
    find_spots = partial(results_elsewhere, tmp_path, here, read_place(here))
    assert {name: one.grade for name, one in find_spots("generic", "left-loop").items()} == {
        "Stairs": "yes"
    }
    assert find_spots("generic", "top") == {}


SHADOW = AreaShortfall(Aspect.SHADOW_SIDE, "Split", "left half", "right half", 0.4, 2.4)


@pytest.mark.parametrize(
    ("azimuth_deg", "part"),
    [(0.0, "in front"), (90.0, "sitter’s left"), (-90.0, "sitter’s right"), (180.0, "behind")],
)
def test_a_lamp_is_placed_as_the_sitter_would(azimuth_deg: float, part: str) -> None:
    way = LightInTheWay("wall", "C", False, azimuth_deg, 0.0, "right half", 0.43)
    words = in_the_way_sentence(way, SHADOW)
    assert part in words
    assert "bright wall" in words
    assert "(C)" in words
    assert "43%" in words


def test_a_share_of_clipped_light_is_a_lower_bound() -> None:
    way = LightInTheWay("sun", "A", True, 0.0, 30.0, "right half", 0.43)
    assert "at least 43%" in in_the_way_sentence(way, SHADOW)


def test_only_a_dark_area_is_a_shadow() -> None:
    dark = LightInTheWay("lamp", "A", False, 0.0, 0.0, "right half", 0.43)
    bright = replace(dark, area="left half")
    assert "shadow" in in_the_way_sentence(dark, SHADOW)
    assert "shadow" not in in_the_way_sentence(bright, SHADOW)


def test_a_mend_says_its_turn_only_if_it_moves() -> None:
    mend = Mend("block", "soft", 60.0)
    assert "60°" in mend_sentence(mend, "Split", 20.0)
    assert "60°" not in mend_sentence(mend, "Split", wrap(57.0))


def test_words_are_empty_without_a_diagnosis() -> None:
    assert help_words(Diagnosis(), graded("no")) == ""


@pytest.mark.parametrize(
    ("stops", "labels"), [(0.42, ("+0.4", "0")), (-0.77, ("0", "+0.8")), (0.04, ("0", "0"))]
)
def test_the_brighter_area_has_the_number(stops: float, labels: tuple[str, str]) -> None:
    assert area_labels(replace(SHADOW, value_stops=stops)) == labels


@pytest.mark.parametrize("limit", [2.4, 0.0, -1.2])
@pytest.mark.parametrize("value", [-3.0, -0.4, 0.7, 2.9])
def test_no_label_has_a_negative_number(value: float, limit: float) -> None:
    shortfall = replace(SHADOW, value_stops=value, limit_stops=limit)
    assert not set("-−") & set(needs_label(shortfall))
    assert f"{abs(limit):.1f}" in needs_label(shortfall)


def test_a_value_never_reads_as_its_limit() -> None:
    near = replace(SHADOW, value_stops=2.38)
    assert "2.38" in needs_label(near)
    assert "2.4" in needs_label(near)
