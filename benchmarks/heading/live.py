"""Accuracy of the live heading, how often it is sure, and how often it is sure of nonsense.

Pictures of the demo location with parallax and the sitter in front, crops of panoramas, and pairs
that do not belong together, all disturbed as by a phone; with the field of view known and unknown.

    python benchmarks/heading/live.py [--scenes FOLDER] [--count N] [--wrong N] [-o FILE.json]
        [--page benchmarks/heading.md]
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from app.core.base.angles import difference
from app.core.base.atomic_files import atomic_write_text
from app.core.localization.confidence import LEAST_CONFIDENCE, trust
from app.core.localization.heading import HeadingMatch, Sight, compare, find_heading, see
from app.core.localization.heading_conversion import offset_angle
from benchmarks.heading.heading_cases import (
    LOCATION,
    SHARED,
    Case,
    crop_cases,
    cut_out,
    demo_spots,
    demo_views,
    learnt,
    location,
    location_cases,
    nothing_cases,
    scenes,
)  # fmt: skip
from benchmarks.heading.heading_turn import turn_rows, turn_table

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from app.core.localization.features import HeadingIndex

TEST = 2  # seed
HARDER = 2.5
OTHERS = 3
MARKS = ("<!-- table: benchmarks/heading/live.py -->", "<!-- end of table -->")
AFAR = "the same building, 5 to 13 m away"
EDGES = (0.80, 0.85, 0.95, 0.99, 1.0001)


class Rows:
    """Answers, one per picture and question."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []

    def add(
        self, kind: str, case: Case, found: HeadingMatch | None, *, wrong: bool = False
    ) -> None:
        row: dict[str, Any] = {"kind": kind, "wrong": wrong, "confidence": 0.0, "off": 180.0}
        if found is not None:
            heading, pitch, roll = found.pose.angles_deg
            absurd = abs(pitch) > 40.0 or abs(roll) > 25.0
            row["evidence"] = found.evidence
            row["confidence"] = 0.0 if absurd else trust(found.evidence)
            if not wrong:
                row["off"] = abs(difference(heading, case.heading_deg))
                sitter = _seen_at(case, found.fov_deg)
                true_turn = case.heading_deg + case.sitter_deg
                row["turn_off"] = abs(difference(heading + sitter, true_turn))
                row["fov_off"] = abs(found.fov_deg - case.fov_deg)
        self.rows.append(row)

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [row for row in self.rows if row["kind"] == kind]


def _seen_at(case: Case, fov_deg: float) -> float:
    """Return the sitter's angle for an assumed field of view."""
    half = math.tan(math.radians(case.sitter_deg)) / math.tan(math.radians(case.fov_deg / 2.0))
    return offset_angle(0.5 + half / 2.0, 1, fov_deg)


def ask(rows: Rows, name: str, case: Case, sight: Sight, index: HeadingIndex) -> None:
    """Search with a known and with an unknown field of view."""
    found = compare(sight, index, case.fov_deg, None, case.sitter_deg)
    rows.add(f"{name}, field of view known", case, found)
    found = compare(sight, index, None, None, case.assumed_sitter_deg)
    rows.add(f"{name}, unknown", case, found)


def ask_wrongly(
    rows: Rows,
    case: Case,
    sight: Sight,
    maps: dict[str, HeadingIndex],
    chance: np.random.Generator,
) -> None:
    """Search in the same place without the picture's content, and in three other places."""
    fov = case.fov_deg if chance.random() < 0.5 else None
    sitter = case.sitter_deg if fov is not None else case.assumed_sitter_deg
    if case.place:
        found = compare(sight, cut_out(maps[case.place], case), fov, None, sitter)
        rows.add("wrong: another direction", case, found, wrong=True)
    others = [name for name in maps if name != case.place]
    kind = "wrong: another place" if case.place else "wrong: wall, sky, hand, pattern"
    for name in chance.choice(others, min(OTHERS, len(others)), replace=False):
        found = compare(sight, maps[str(name)], fov, None, sitter)
        rows.add(kind, case, found, wrong=True)


def hard_questions(
    rows: Rows, case: Case, sight: Sight, index: HeadingIndex, chance: np.random.Generator
) -> None:
    """Search as in the field: the sitter found to 2 deg or not at all, the lens known or not."""
    noise = chance.normal(0.0, 2.0) if case.place == LOCATION else 0.0
    rows.add("hard", case, compare(sight, index, case.fov_deg, None, case.sitter_deg + noise))
    rows.add("hard", case, compare(sight, index, None, None, case.assumed_sitter_deg + noise))
    fov = case.fov_deg if chance.random() < 0.5 else None
    rows.add("hard", case, compare(sight, index, fov, None, None))


def ask_from_afar(
    rows: Rows, case: Case, maps: dict[str, HeadingIndex], chance: np.random.Generator
) -> None:
    """Search in the same building from metres away: a heading is right only in its own place."""
    sight = see(case.picture)
    fov = case.fov_deg if chance.random() < 0.5 else None
    for name, index in maps.items():
        if name != case.place:
            rows.add(AFAR, case, compare(sight, index, fov, None, 0.0))


def accuracy(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return median, 95th percentile and largest error of the accepted answers."""
    sure = [row for row in rows if row["confidence"] >= LEAST_CONFIDENCE]
    off = np.array([row["off"] for row in sure])
    turn = np.array([row["turn_off"] for row in sure])
    fov = np.array([row["fov_off"] for row in sure])
    return {
        "pictures": len(rows),
        "accepted": round(len(sure) / len(rows), 4),
        "median_deg": round(float(np.median(off)), 3),
        "p95_deg": round(float(np.percentile(off, 95)), 3),
        "largest_deg": round(float(off.max()), 2),
        "turn_median_deg": round(float(np.median(turn)), 3),
        "turn_p95_deg": round(float(np.percentile(turn, 95)), 3),
        "fov_median_deg": round(float(np.median(fov)), 2),
    }


def reliability(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the share of answers within 3 deg, by confidence."""
    table = []
    for low, high in itertools.pairwise(EDGES):
        inside = [row for row in rows if low <= row["confidence"] < high]
        if not inside:
            continue
        right = float(np.mean([row["off"] <= 3.0 for row in inside]))
        mean = float(np.mean([row["confidence"] for row in inside]))
        table.append(
            {
                "from": low,
                "to": min(high, 1.0),
                "answers": len(inside),
                "mean_confidence": round(mean, 3),
                "right": round(right, 3),
            }
        )
    return table


def speed(case: Case, index: HeadingIndex) -> dict[str, float]:
    """Return the best of several rounds, ms, as the program runs it: wall and CPU time."""
    result = {}
    for name, near in (("tracking", case.heading_deg), ("searching", None)):
        spent: list[tuple[float, float]] = []
        for _ in range(15):
            wall, cpu = time.perf_counter(), time.process_time()
            find_heading(case.picture, index, case.fov_deg, near_deg=near)
            spent.append((time.perf_counter() - wall, time.process_time() - cpu))
        best = np.array(spent).min(axis=0) * 1000.0
        result[f"{name}_ms"] = round(float(best[0]), 1)
        result[f"{name}_processor_ms"] = round(float(best[1]), 1)
    return result


def measure(folder: Path | None, count: int, wrong: int) -> dict[str, Any]:
    """Return all rows of the table."""
    chance = np.random.default_rng(TEST)
    lights, light = scenes(folder), location()
    maps = learnt({**lights, LOCATION: light})
    views = demo_views(light)
    rows = Rows()
    each = 1 + OTHERS
    timed: Case | None = None
    for name, cases in (
        ("location", location_cases(views, chance, count)),
        ("crops", crop_cases(lights, chance, count)),
    ):
        for number, case in enumerate(cases):
            timed = timed or case
            sight = see(case.picture)
            ask(rows, name, case, sight, maps[case.place])
            if number * 2 * each < wrong * 0.82:
                ask_wrongly(rows, case, sight, maps, chance)
    spots = demo_spots()
    spot_maps = {LOCATION: maps[LOCATION]} | learnt(
        {name: one for name, one in spots.items() if name != LOCATION}
    )
    for case in crop_cases(spots, chance, count // 2):
        ask_from_afar(rows, case, spot_maps, chance)
    for case in nothing_cases(chance, round(wrong * 0.2 / OTHERS)):
        ask_wrongly(rows, case, see(case.picture), maps, chance)
    hard = Rows()
    tested = {name: one for name, one in lights.items() if name.endswith("_1k")} or lights
    for case in _hard_cases(views, tested, chance, count // 2):
        hard_questions(hard, case, see(case.picture), maps[case.place], chance)
    assert timed is not None
    # By cell, there are only a sixth of them.
    turn = turn_rows(views, maps[LOCATION], np.random.default_rng(TEST + 1), 3 * count)
    return _table(rows, hard, len(lights)) | {"turn": turn} | speed(timed, maps[LOCATION])


def _hard_cases(
    views: Any, lights: dict[str, NDArray[np.float32]], chance: np.random.Generator, count: int
) -> Iterable[Case]:
    for harder in (1.0, HARDER):
        yield from location_cases(views, chance, count // 2, harder)
        yield from crop_cases(lights, chance, count // 2, harder)


def _table(rows: Rows, hard: Rows, places: int) -> dict[str, Any]:
    right = sorted({row["kind"] for row in rows.rows if not row["wrong"]} - {AFAR})
    wrong = sorted({row["kind"] for row in rows.rows if row["wrong"]})
    return {
        "panoramas": places,
        "right": {kind: accuracy(rows.of(kind)) for kind in right},
        "wrong": {
            kind: {
                "pairs": len(rows.of(kind)),
                "accepted": sum(row["confidence"] >= LEAST_CONFIDENCE for row in rows.of(kind)),
            }
            for kind in wrong
        },
        AFAR: {
            "pairs": len(rows.of(AFAR)),
            "accepted": sum(row["confidence"] >= LEAST_CONFIDENCE for row in rows.of(AFAR)),
            "accepted_and_wrong": sum(
                row["confidence"] >= LEAST_CONFIDENCE and row["off"] > 3.0 for row in rows.of(AFAR)
            ),
        },
        "reliability": reliability(hard.rows + rows.of(AFAR)),
    }


def markdown(values: dict[str, Any]) -> str:
    """Return the tables of benchmarks/heading.md."""
    lines = [
        "| pictures | number | accepted | heading: median | 95 % | largest | turn: median | 95 % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind, row in values["right"].items():
        lines.append(
            f"| {kind} | {row['pictures']} | {100 * row['accepted']:.1f} % "
            f"| {row['median_deg']:.2f}° | {row['p95_deg']:.2f}° | {row['largest_deg']:.1f}° "
            f"| {row['turn_median_deg']:.2f}° | {row['turn_p95_deg']:.2f}° |"
        )
    lines += ["", *turn_table(values["turn"])]
    lines += ["", "| pairs that do not belong together | number | accepted |", "|---|---|---|"]
    for kind, row in values["wrong"].items():
        lines.append(f"| {kind.removeprefix('wrong: ')} | {row['pairs']} | {row['accepted']} |")
    pairs, taken = (
        sum(row[key] for row in values["wrong"].values()) for key in ("pairs", "accepted")
    )
    lines.append(f"| all | {pairs} | {taken} ({100 * taken / pairs:.2f} %) |")
    afar = values[AFAR]
    lines += [
        "",
        f"Of {afar['pairs']} pairs of *{AFAR}*, {afar['accepted']} are accepted, "
        f"{afar['accepted_and_wrong']} of them more than 3° off.",
        "",
        "| confidence | answers | mean confidence | within 3° |",
        "|---|---|---|---|",
    ]
    for row in values["reliability"]:
        lines.append(
            f"| {100 * row['from']:.0f} to {100 * row['to']:.0f} % | {row['answers']} "
            f"| {100 * row['mean_confidence']:.1f} % | {100 * row['right']:.1f} % |"
        )
    lines += [
        "",
        "One frame of 640 x 480, processor time (by the clock on 2 cores that others use too): "
        f"{values['tracking_processor_ms']:.0f} ms ({values['tracking_ms']:.0f} ms) near the last "
        f"heading, {values['searching_processor_ms']:.0f} ms ({values['searching_ms']:.0f} ms) "
        "anywhere.",
    ]
    return "\n".join(lines)


def write_page(page: Path, values: dict[str, Any]) -> None:
    """Insert the tables between the page's markers."""
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(MARKS[0])
    _, after = rest.split(MARKS[1])
    table = f"{MARKS[0]}\n{markdown(values)}\n{MARKS[1]}"
    atomic_write_text(page, before + table + after)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=Path, default=SHARED)
    parser.add_argument("--count", type=int, default=216, help="pictures of each kind")
    parser.add_argument("--wrong", type=int, default=2000, help="pairs that do not belong together")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--page", type=Path, help="benchmarks/heading.md, to replace its tables")
    args = parser.parse_args()
    cv2.setNumThreads(2)
    result = measure(args.scenes, args.count, args.wrong)
    text = json.dumps(result, indent=1)
    print(text)
    if args.output:
        atomic_write_text(args.output, text + "\n")
    if args.page:
        write_page(args.page, result)


if __name__ == "__main__":
    main()
