"""Turns and grades on real people: what was measured; two places anew where their pictures are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce, reduce_light
from app.core.solver.search import curves
from app.core.solver.solve import measure, solve_all
from app.core.styles.style_pack_file import load_named_pack, pack_names
from benchmarks.faces import check_shot, photos
from benchmarks.faces.people import load_people, run
from tests.helpers.shared import SHARED

Floats = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[2]
PEOPLE = SHARED / "people"


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    text = (ROOT / "benchmarks" / "results" / "people.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


HEADS = pack_names()
# What is said of these heads in words: sheen and large eyes lower the match predicted for them.
LOW = {"female": 6.0, "generic-dark": 8.0}


@pytest.mark.parametrize("head", HEADS)
def test_the_turns_offered_are_right_on_real_people(found: dict[str, Any], head: str) -> None:
    """Flat aside, whose grade looks for evenness and whose match for light from the front."""
    one = found["heads"][head]
    assert len(found["places"]) >= 30
    assert one["mean_percent"] <= 1.0
    assert one["correlation"] >= 0.92
    assert abs(one["bias"]) <= LOW.get(head, 3.0)
    rows = [row for name, row in one["by_style"].items() if name != "flat" and row["graded"]]
    weights = [row["graded"] for row in rows]
    assert sum(weights) >= 100
    for share, least in (("within_3_percent", 95.0), ("within_10_percent", 98.5)):
        assert np.average([row[share] for row in rows], weights=weights) >= least


@pytest.mark.xfail(strict=True, reason="the best grade of flat costs match: 83 % within 3 %")
@pytest.mark.parametrize("head", HEADS)
def test_the_turns_offered_are_right_with_flat(found: dict[str, Any], head: str) -> None:
    one = found["heads"][head]
    assert one["within_3_percent"] >= 95.0
    assert one["within_10_percent"] >= 98.5


@pytest.mark.xfail(strict=True, reason="blind readers see fewer styles than the grades of then")
def test_most_of_what_was_attainable_stays(found: dict[str, Any]) -> None:
    assert found["heads"]["generic"]["kept"]["percent"] >= 60.0


APART = {
    "female": {"butterfly", "right-window"},
    "generic": {"left-rembrandt", "right-rembrandt", "left-window", "right-window"},
    "generic-dark": {"right-rembrandt", "right-window"},
    "generic-light": {"right-rembrandt"},
    "male": {"left-rembrandt", "right-rembrandt", "left-window", "right-window"},
}
"""Styles of which people show another share than the head does: butterfly more, the rest less."""


@pytest.mark.parametrize("head", HEADS)
def test_faces_show_what_the_head_shows(found: dict[str, Any], head: str) -> None:
    """As often as two people agree, less 3 points, or in 85 of 100; the other heads less 9."""
    less = 3.0 if head == "generic" else 9.0
    apart = set()
    for name, row in found["heads"][head]["agreement"].items():
        if row["agree"] < min(85.0, row["people_agree"] - less):
            assert (row["head_says"] > row["people_say"]) == (name != "butterfly"), name
            apart.add(name)
    assert apart <= APART[head]


def test_the_page_says_what_was_found(found: dict[str, Any]) -> None:
    page = (ROOT / "benchmarks" / "people.md").read_text(encoding="utf-8")
    for head, one in found["heads"].items():
        numbers = (one["graded"], one["mean_percent"], one["within_3_percent"])
        assert "| {} | {} | {:.1f} % | {:.1f} % |".format(head, *numbers) in page


@pytest.mark.usefixtures("best_turns")
def test_a_place_that_is_turned_turns_its_answers() -> None:
    """Real panoramas by angles that are no whole texels: grades stay and turns follow.

    By what was measured: 2 of 600 grades far from any limit change, 11 of 48 near one; of the
    turns offered five follow within 2 degrees only, the rest within 0.5.
    """
    pack, rng = load_named_pack("generic"), np.random.default_rng(4)
    changed, loose = [], 0
    apart: list[tuple[float, str, str, str]] = []
    dear: list[tuple[float, str, str, str]] = []
    for path in sorted((resources() / "demo" / "scenes").glob("*.exr")):
        radiance = read_environment(path).radiance
        light = reduce_light(radiance)
        found = curves(pack.tables, pack.project(light))
        slack = measure(pack, found)
        before = solve_all(pack, light)
        for columns in rng.integers(radiance.shape[1], size=3).tolist():
            angle = 360.0 * columns / radiance.shape[1]
            after = solve_all(pack, reduce_light(np.roll(radiance, -columns, axis=1)))
            for row, (one, two) in enumerate(zip(before, after, strict=True)):
                # A grade is that of the turn that is furthest inside its limits.
                near = min(abs(slack.yes[row].max()), abs(slack.soft[row].max())) < 0.05
                loose += near
                if one.grade != two.grade:
                    changed.append((near, path.stem, one.name))
                if "no" in (one.grade, two.grade) or one.grade != two.grade:
                    continue
                if pack.styles[row].signature.areas:
                    continue  # as good all over an arc around the lamp behind
                ways = [p.turn_refined_deg for p in two.peaks if p.match > two.match - 0.5]
                off = min(abs(wrap(w - one.turn_refined_deg + angle)) for w in ways)
                # Far below the best match a grade is had on a few degrees only, or not at all.
                is_dear = one.match < one.match_curve.max() - 3.0
                (dear if is_dear else apart).append((off, path.stem, one.name, str(one.grade)))
    assert len(apart) + len(dear) >= 100
    assert sum(not near for near, *_ in changed) <= 2, changed
    assert sum(bool(near) for near, *_ in changed) <= 0.25 * loose, changed
    assert sum(off > 0.5 for off, *_ in apart) <= 5, apart
    # A soft grade may be had on a few degrees only.
    assert max(one for one in apart if one[3] == "yes")[0] <= 2.1
    assert max(apart)[0] <= 3.5
    assert sum(off > 1.0 for off, *_ in dear) <= 1, dear


@pytest.mark.skipif(not PEOPLE.is_dir(), reason="the people's pictures are not present")
def test_two_places_anew(found: dict[str, Any]) -> None:
    folder = resources() / "demo" / "scenes"
    lights = {
        name: reduce(read_environment(folder / f"{name}.exr")).astype(np.float64)
        for name in ("city", "sunrise")
    }
    pairs, _ = run(load_people(PEOPLE), lights, "generic")
    graded = [pair for pair in pairs if pair["grade"] != "no"]
    assert len(graded) >= 8
    lost = np.concatenate([pair["given_up"] for pair in graded])
    assert lost.mean() <= 1.0
    assert np.mean(lost <= 3.0) >= 0.9


@pytest.mark.slow
@pytest.mark.skipif(not PEOPLE.is_dir(), reason="the people's pictures are not present")
def test_a_lamp_is_read_from_a_photograph() -> None:
    found = photos.lamps(PEOPLE)
    assert found["read"] >= 0.8
    assert found["median_deg"] <= 8
    assert found["p90_deg"] <= 16
    assert found["behind_told"] >= 0.8
    assert found["front_told_behind"] == 0


@pytest.mark.slow
@pytest.mark.skipif(not PEOPLE.is_dir(), reason="the people's pictures are not present")
def test_a_style_is_named_from_a_photograph() -> None:
    found = photos.styles(PEOPLE)
    assert found["first"] >= 0.9
    assert found["among_three"] >= 0.98


@pytest.mark.slow
@pytest.mark.skipif(not PEOPLE.is_dir(), reason="the people's pictures are not present")
def test_the_ratio_is_read_from_a_photograph() -> None:
    found = photos.ratios(PEOPLE)
    assert found["median_stops"] <= 0.2
    assert found["p90_stops"] <= 0.45
    # A fill does not throw the key off.
    assert max(found["key_median_deg"].values()) <= 10


@pytest.mark.slow
@pytest.mark.skipif(not PEOPLE.is_dir(), reason="the people's pictures are not present")
def test_a_shot_is_checked_by_the_face_alone() -> None:
    found = check_shot.measured(PEOPLE, [resources() / "demo" / "scenes"], turns=5)
    assert found["pairs"] >= 3000
    assert found["told"] >= 0.4 * found["pairs"]
    assert found["told_median_deg"] <= 6
    assert found["inside_called_wrong"] <= 0.05
    assert found["beside_called_right"] <= 0.01
    assert found["far_called_right"] <= 0.001
    assert found["wide_told"] == 0


def test_what_was_measured_of_photographs() -> None:
    folder = ROOT / "benchmarks" / "results"
    shot = json.loads((folder / "check-shot.json").read_text(encoding="utf-8"))
    turned = json.loads((folder / "turned-faces.json").read_text(encoding="utf-8"))
    like = json.loads((folder / "faces.json").read_text(encoding="utf-8"))["like_photo"]
    assert shot["told_median_deg"] <= 6
    assert shot["inside_called_wrong"] <= 0.05
    assert shot["beside_called_right"] <= 0.01
    assert turned["found"]["all"]["found"] >= 0.95
    assert turned["found"]["wrong_and_sure"] == []
    assert like["within_arc"] >= 0.8
    assert like["refused"] <= 0.2
