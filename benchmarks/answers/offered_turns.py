"""Test whether the turn offered has the best grade, and is well inside its tolerance arc.

For each panorama and style, the picture at every one of the 64 grid turns is graded separately,
with a plain loop, and compared with the grade offered. The panorama is then rotated by the refined
turn, which is not on the grid, and graded again. For the tolerance arc: the distance of the turn
offered from the nearer end, as a share of the width, and its cost against the best match within the
arc.

    python -m benchmarks.answers.offered_turns [--places FOLDER ...] [--head NAME] [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS, wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.base.errors import EnvironmentFileError
from app.core.environment.environment import read_environment, reduce_light
from app.core.solver.light_map import LightMap
from app.core.solver.peaks import ARC_SHARE
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import curves, luminance_of
from app.core.solver.solve import PlaceSearch, solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import GRADES
from app.core.solver.turn_choice import LIMITS
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack

_SLACK: Final = 0.5  # points: between the grid turns, the match is interpolated linearly
ROOT: Final = Path(__file__).resolve().parents[2]


def searched(pack: StylePack, light: NDArray[np.float32]) -> PlaceSearch:
    """Measure all styles at all turns of a light, (32, 64, 3)."""
    even, _ = normalised(light, pack.header.environment)
    seen = curves(pack.tables, pack.project(even))
    return PlaceSearch(pack, LIMITS, LightMap(luminance_of(even)), seen)


def grade_of(place: PlaceSearch, row: int, at: int) -> int:
    """Return the index in `GRADES` of the picture at one grid turn."""
    grade = place.verdict(row, at).grade
    assert grade is not None
    return GRADES.index(grade)


def grade_between(pack: StylePack, radiance: NDArray[np.float32], row: int, turn_deg: float) -> int:
    """Return the grade at any turn: rotate the panorama to the nearest column, grade at turn 0."""
    columns = round(turn_deg / 360.0 * radiance.shape[1])
    turned = reduce_light(np.roll(radiance, -columns, axis=1))
    return grade_of(searched(pack, turned), row, 0)


def arc_facts(result: StyleResult) -> dict[str, Any]:
    """Return the position of the turn offered in its arc.

    `margin` is to the nearer end, and `free_margin` to the nearer end that is not set by a grade:
    at an end set by a grade, the match has not lost the 3 % yet.
    """
    start, stop = result.arc_deg
    if (start, stop) == (-180.0, 180.0):
        return {
            "width_deg": 360.0,
            "margin": 0.5,
            "free_margin": 0.5,
            "from_middle_deg": 0.0,
            "lost": 0.0,
        }
    width = (stop - start) % 360.0
    before = (result.turn_refined_deg - start) % 360.0
    turns = np.arange(TURNS + 1) * 360.0 / TURNS
    curve = np.append(result.match_curve, result.match_curve[0])

    def match(turn: float) -> float:
        return float(np.interp(turn % 360.0, turns, curve))

    inside = [match(start + share * width) for share in np.linspace(0, 1, 101).tolist()]
    least = (1.0 - ARC_SHARE) * max(inside) + _SLACK
    sides = (before, start), (width - before, stop)
    free = [side for side, end in sides if match(end) < least] or [0.5 * width]
    return {
        "width_deg": round(width, 2),
        "margin": round(min(before, width - before) / max(width, 1e-9), 3),
        "free_margin": round(min(free) / max(width, 1e-9), 3),
        "from_middle_deg": round(wrap(result.turn_refined_deg - start - width / 2), 2),
        "lost": round(max(inside) - match(result.turn_refined_deg), 3),
        "middle_loses": round(max(inside) - match(start + width / 2), 3),
    }


def judged(pack: StylePack, radiance: NDArray[np.float32], place: str) -> Iterator[dict[str, Any]]:
    """Yield one row for each style of a panorama."""
    light = reduce_light(radiance)
    here = searched(pack, light)
    for row, result in enumerate(solve_all(pack, light)):
        assert result.grade is not None
        grades = [grade_of(here, row, at) for at in range(TURNS)]
        offered = GRADES.index(result.grade)
        better = [at for at, grade in enumerate(grades) if grade > offered]
        between = offered
        if offered:
            between = grade_between(pack, radiance, row, result.turn_refined_deg)
        yield {
            "place": place,
            "style": result.name,
            "grade": result.grade,
            "turn_deg": result.turn_deg,
            "turn_refined_deg": round(result.turn_refined_deg, 2),
            "match": round(result.match, 2),
            "best": GRADES[max(grades)],
            "best_turns": len(better),
            "refined_grade": GRADES[between],
            **arc_facts(result),
        }


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return counts over all pairs of a place and a style."""
    rank = {grade: position for position, grade in enumerate(GRADES)}
    no = [row for row in rows if row["grade"] == "no"]
    reach = [row for row in rows if row["grade"] != "no"]
    return {
        "pairs": len(rows),
        "no": len(no),
        "no_though_another_turn_is_not": sum(row["best"] != "no" for row in no),
        "a_better_grade_elsewhere": sum(rank[row["best"]] > rank[row["grade"]] for row in rows),
        "in_reach": len(reach),
        "refined_turn_graded_lower": sum(
            rank[row["refined_grade"]] < rank[row["grade"]] for row in reach
        ),
        "refined_turn_graded_no": sum(row["refined_grade"] == "no" for row in reach),
        "nearer_than_a_third_to_an_end": sum(row["free_margin"] < 0.332 for row in reach),
        "under_2_degrees_from_an_end": sum(row["margin"] * row["width_deg"] < 2.0 for row in reach),
        "in_the_middle": sum(abs(row["from_middle_deg"]) < 0.5 for row in reach),
        "mean_lost": round(float(np.mean([row["lost"] for row in reach])), 3),
        "most_lost": max(row["lost"] for row in reach),
    }


def main() -> None:
    """Measure, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    shared = Path(os.environ.get("TURNLIGHT_SHARED", ROOT.parent / "shared" / "data"))
    parser.add_argument("--places", type=Path, nargs="*", default=[])
    parser.add_argument("--head", default="generic")
    parser.add_argument("-o", type=Path)
    args = parser.parse_args()
    pack = load_named_pack(args.head)
    rows: list[dict[str, Any]] = []
    for folder in [shared / "hdri", ROOT / "resources" / "demo" / "scenes", *args.places]:
        for path in sorted([*folder.glob("*.hdr"), *folder.glob("*.exr")]):
            try:
                radiance = read_environment(path).radiance
            except EnvironmentFileError as error:
                print(error.message)
                continue
            rows += judged(pack, radiance, f"{folder.name}/{path.stem}")
    facts = {"head": args.head, **summary(rows)}
    print(json.dumps(facts, indent=1))
    if args.o:
        lines = ",\n".join(json.dumps(row) for row in rows)
        body = json.dumps(facts, indent=1)[:-2] + f',\n "rows": [\n{lines}\n]}}\n'
        atomic_write_text(args.o, body)


if __name__ == "__main__":
    main()
