"""Choose the pictures to be labelled: which style, place, turn and head.

For every style, about a third of the pictures are graded yes, soft and no by the rule of the day,
with most of the last two near the limits. The turns are those that are offered, second peaks, and
turns 20 to 40 degrees away from either.

    python -m benchmarks.labels.choose PLACE ... -o RECIPE.json
"""

from __future__ import annotations

import argparse
import json
import random
from collections import defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from app.core.base.angles import TURNS, turn_of_index
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.environment.environment import read_environment, reduce_light
from app.core.solver.solve import solve_all
from app.core.solver.style_signature import GRADES, NO, SOFT, YES
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.answers.offered_turns import searched

HEADS: Final = ("generic", "female", "generic-dark")
PER_CLASS: Final = {YES: 24, SOFT: 26, NO: 27}
_NEAR: Final = 0.6  # stops outside the limits of soft that still count as near
_ASIDE: Final = (4, 5, 6, 7)  # grid turns: 22 to 39 degrees
_ALIKE: Final = 0.97  # correlation of two panoramas that show one place


@dataclass(frozen=True, slots=True)
class Candidate:
    """A picture that may be labelled.

    Attributes:
        kind: "offered", "peak" or "aside".
        grade: Index in `GRADES`, by the rule of the day.
        slack: Stops inside the limits of soft, negative outside.
    """

    style: str
    place: str
    head: str
    turn_deg: float
    kind: str
    grade: int
    slack: float


def distinct_places(places: list[Path]) -> list[Path]:
    """Leave out panoramas that show the same place as an earlier one."""
    distinct: list[tuple[Path, Any]] = []
    for path in places:
        light = np.log(luminance(reduce_light(read_environment(path).radiance)) + 1e-4).ravel()
        light = (light - light.mean()) / light.std()
        if all(float(np.mean(light * other)) < _ALIKE for _, other in distinct):
            distinct.append((path, light))
        else:
            print(f"{path.name}: left out, like an earlier one")
    return [path for path, _ in distinct]


def candidates(path: Path, head: str, chance: random.Random) -> list[Candidate]:
    """List the pictures of a place: for every style, the offered turn and others."""
    pack, pictures = load_named_pack(head), []
    light = reduce_light(read_environment(path).radiance)
    search = searched(pack, light)
    for row, result in enumerate(solve_all(pack, light)):
        offered = round(result.turn_refined_deg / 360.0 * TURNS) % TURNS
        turns = [(offered, "offered")]
        turns += [
            (round(peak.turn_refined_deg / 360.0 * TURNS) % TURNS, "peak")
            for peak in result.peaks[1:2]
        ]
        aside = [chance.choice(_ASIDE) * side for side in (1, -1)]
        turns += [((at + by) % TURNS, "aside") for at, _ in turns[:1] for by in aside]
        for at, kind in turns:
            grade = search.verdict(row, at).grade
            assert grade is not None
            pictures.append(
                Candidate(
                    result.name,
                    path.stem,
                    head,
                    float(result.turn_refined_deg) if kind == "offered" else turn_of_index(at),
                    kind,
                    GRADES.index(grade),
                    float(search.measured.soft[row, at]),
                )
            )
    return pictures


def choose(every: list[Candidate], chance: random.Random) -> list[Candidate]:
    """Choose pictures of each style and grade, from as many places as possible."""
    sample: list[Candidate] = []
    by_class: dict[tuple[str, int], list[Candidate]] = defaultdict(list)
    for one in every:
        by_class[one.style, one.grade].append(one)
    for (_, grade), pool in sorted(by_class.items()):
        chance.shuffle(pool)
        if grade == NO:
            # Two thirds near the limit, the others anywhere.
            pool.sort(key=lambda one: one.slack < -_NEAR)
            near = [one for one in pool if one.slack >= -_NEAR]
            far = [one for one in pool if one.slack < -_NEAR]
            count = PER_CLASS[NO]
            sample += _spread(near, count * 2 // 3) + _spread(far, count - count * 2 // 3)
        else:
            sample += _spread(pool, PER_CLASS[grade])
    chance.shuffle(sample)
    return sample


def _spread(pool: list[Candidate], count: int) -> list[Candidate]:
    """Take candidates in rounds, one of each place at a time."""
    sample: list[Candidate] = []
    rest = list(pool)
    while rest and len(sample) < count:
        places: set[str] = set()
        for one in list(rest):
            if one.place not in places and len(sample) < count:
                places.add(one.place)
                sample.append(one)
                rest.remove(one)
    return sample


def main() -> None:
    """Choose the pictures, and write their recipe."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()
    chance = random.Random(args.seed)
    places = distinct_places(sorted(args.places))
    every = []
    for number, path in enumerate(places):
        every += candidates(path, HEADS[number % len(HEADS)], chance)
        print(path.stem, len(every), flush=True)
    rows = [asdict(one) for one in choose(every, chance)]
    recipe = {"seed": args.seed, "places": [path.stem for path in places], "pictures": rows}
    atomic_write_text(args.output, json.dumps(recipe, indent=1) + "\n")
    print(f"{len(rows)} pictures of {len(places)} places")


if __name__ == "__main__":
    main()
