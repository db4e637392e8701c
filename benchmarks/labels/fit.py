"""Fit the limits of the grades to labelled pictures, leaving places out.

For each style, alike for left and right: by how many stops all relations of its signature must be
exceeded, or may be missed, for yes and for soft, and the least match for each. These four numbers
are searched on a grid for the most pictures graded like their label. Figures are those of places
that were left out, in five folds.

    python -m benchmarks.labels.fit PLACE ... [-o FILE.json]
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write_text
from app.core.environment.environment import read_environment, reduce_light
from app.core.solver.face import AREAS
from app.core.solver.style_signature import Signature, stops_of
from app.core.styles.style_pack_file import load_named_pack
from app.core.styles.styles import load_styles, mirror_name
from benchmarks.answers.offered_turns import searched
from benchmarks.labels.readings import Labels, agreement, load

FOLDS: Final = 5
_HERE: Final = Path(__file__).resolve().parent
_SHIFTS: Final = tuple(np.arange(-0.6, 1.21, 0.1).round(2).tolist())
_MATCHES: Final = tuple(range(30, 98, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Measures:
    """What the program measures in each picture.

    Attributes:
        room: (pictures, styles) float64. Stops inside the limits of yes, by the worst relation.
        match: (pictures, styles) float64.
    """

    room: NDArray[np.float64]
    match: NDArray[np.float64]
    grade: NDArray[np.int8]


def room_of(signature: Signature, stops: dict[str, float]) -> float:
    """Return the stops inside the limits of the worst relation."""
    return min(
        min(stops[r.bright] - stops[r.dark] - r.least, r.most - stops[r.bright] + stops[r.dark])
        for r in signature.relations
    )


def measure(labels: Labels, places: dict[str, Path]) -> Measures:
    """Measure every labelled picture for every style, at exactly its turn."""
    shape = (len(labels.recipe), len(labels.styles))
    room, match = np.zeros(shape), np.zeros(shape)
    grade = np.zeros(shape, np.int8)
    by_place: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, one in enumerate(labels.recipe):
        by_place[one["place"], one["head"]].append(index)
    for (place, head), indices in by_place.items():
        pack, radiance = load_named_pack(head), read_environment(places[place]).radiance
        for index in indices:
            columns = round(labels.recipe[index]["turn_deg"] / 360.0 * radiance.shape[1])
            search = searched(pack, reduce_light(np.roll(radiance, -columns, axis=1)))
            areas = search.curves.others[: len(AREAS), :1]
            stops = dict(zip(AREAS, stops_of(areas)[:, 0].tolist(), strict=True))
            match[index] = search.measured.match[:, 0]
            for row, style in enumerate(pack.styles):
                room[index, row] = room_of(style.signature, stops)
                verdict = search.verdict(row, 0).grade
                grade[index, row] = ("no", "soft", "yes").index(verdict or "no")
    return Measures(room, match, grade)


Limits = tuple[float, float, float, float]
"""Shift for yes, shift for soft, match for yes, match for soft."""


def grades_by(limits: Limits, room: NDArray[Any], match: NDArray[Any]) -> NDArray[np.int8]:
    """Grade pictures of a style by its limits."""
    yes, soft, match_yes, match_soft = limits
    is_soft = (room >= soft) & (match >= match_soft)
    is_yes = is_soft & (room >= yes) & (match >= match_yes)
    return (is_soft.astype(np.int8) + is_yes).astype(np.int8)


def fit_limits(
    room: NDArray[Any], match: NDArray[Any], label: NDArray[Any], weight: NDArray[Any]
) -> Limits:
    """Search the limits with the most weight of pictures graded like their label."""
    best, score = (0.0, -0.3, 80.0, 70.0), -1.0
    for soft, match_soft in itertools.product(_SHIFTS, _MATCHES):
        is_soft = (room >= soft) & (match >= match_soft)
        # What is not soft is no, whatever the limits of yes.
        base = float(weight[~is_soft & (label == 0)].sum())
        if base + float(weight[is_soft & (label > 0)].sum()) <= score:
            continue
        for yes, match_yes in itertools.product(
            (s for s in _SHIFTS if s >= soft), (m for m in _MATCHES if m >= match_soft)
        ):
            is_yes = is_soft & (room >= yes) & (match >= match_yes)
            hits = float(weight[is_yes & (label == 2)].sum())
            hits += float(weight[is_soft & ~is_yes & (label == 1)].sum())
            if base + hits > score:
                best, score = (yes, soft, float(match_yes), float(match_soft)), base + hits
    return best


def sample(labels: Labels, style: str) -> tuple[list[int], list[int]]:
    """Return the pictures chosen for a style or its mirror image, and their style's row."""
    names = {style, mirror_name(style)}
    indices = [k for k, one in enumerate(labels.recipe) if one["style"] in names]
    return indices, [labels.styles.index(labels.recipe[k]["style"]) for k in indices]


def main() -> None:
    """Fit, and report the figures of places left out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    styles = tuple(style.name for style in load_styles())
    labels = load(_HERE, styles)
    measures = measure(labels, {path.stem: path for path in args.places})
    majority, ceiling = labels.majority, agreement(labels)
    folds = {
        place: number % FOLDS
        for number, place in enumerate(sorted({one["place"] for one in labels.recipe}))
    }
    facts: dict[str, Any] = {}
    now_hits, new_hits, table = [], [], np.zeros((3, 3), int)
    for style in styles:
        if style.startswith("right-"):
            continue
        indices, rows = sample(labels, style)
        room, match = measures.room[indices, rows], measures.match[indices, rows]
        label, now = majority[indices, rows], measures.grade[indices, rows]
        fold = np.array([folds[labels.recipe[k]["place"]] for k in indices])
        weight = np.ones(len(label))
        new = np.zeros_like(now)
        for out in range(FOLDS):
            inside = fold != out
            limits = fit_limits(room[inside], match[inside], label[inside], weight[inside])
            new[~inside] = grades_by(limits, room[~inside], match[~inside])
        now_hits += (now == label).tolist()
        new_hits += (new == label).tolist()
        np.add.at(table, (new, label), 1)
        facts[style] = {
            "pictures": len(label),
            "labels": np.bincount(label, minlength=3).tolist(),
            "now": float(np.mean(now == label)),
            "left_out": float(np.mean(new == label)),
            "readers": ceiling.get(style, float("nan")),
            "limits": fit_limits(room, match, label, weight),
        }
        print(style, facts[style], flush=True)
    print("all: now", np.mean(now_hits), "left out", np.mean(new_hits), "readers", ceiling["all"])
    print("rows: graded no, soft, yes; columns: label\n", table)
    if args.output is not None:
        atomic_write_text(args.output, json.dumps(facts, indent=1) + "\n")


if __name__ == "__main__":
    main()
