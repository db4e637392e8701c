"""The simulated turn: a scripted photographer follows only the tracker's number.

Each run draws a goal (a style that the demo location's first spot gives, with its tolerance arc), a
start, a photographer and a phone. His camera's view is rendered from the location's views,
disturbed like a phone's, and processed by the tracker; he knows only the guidance's words. Runs are
saved as they end, so that an interrupted script resumes.

    python -m benchmarks.heading.simulated_turn [--runs 200] [--aside [--words]] [-o FILE.json]

With --aside the goals have the nose aside of the lens: the photographer passes on the screen's
instruction, and the sitter turns by about that much. With --words no face is read.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from app.core.base.angles import difference
from app.core.base.atomic_files import atomic_write_text
from benchmarks.heading.scripted_turn.turn_runs import Run, demo_world, draw, run_turn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.heading.scripted_turn.turn_loop import Outcome

ROOT = Path(__file__).resolve().parents[2]


MARKS = ("<!-- table -->", "<!-- end of table -->")


def row(run: Run, outcome: Outcome, spent_s: float) -> dict[str, Any]:
    """Return one line of the file."""
    told = np.abs(outcome.told_errors_deg)
    numbers = {
        "run": run.number,
        "style": run.style,
        "goal_deg": run.goal.turn_deg,
        "arc_deg": list(run.goal.arc_deg or ()),
        "start_deg": run.start_deg,
        "fov_deg": run.fov_deg,
        "fov_known": run.fov_known,
        "habits": asdict(run.habits),
        "phone": asdict(run.phone),
        "shutter_s": run.shutter_s,
        "done": outcome.done,
        "turn_deg": outcome.turn_deg,
        "error_deg": outcome.error_deg,
        "inside": outcome.inside,
        "first_error_deg": None
        if outcome.first_deg is None
        else difference(outcome.first_deg, run.goal.turn_deg),
        "first_inside": outcome.first_inside,
        "seconds": outcome.seconds,
        "walks": outcome.walks,
        "looked": outcome.looked,
        "unsure": outcome.unsure,
        "told_median_deg": float(np.median(told)) if told.size else None,
        "told_p95_deg": float(np.percentile(told, 95)) if told.size else None,
        "told_worst_deg": float(told.max()) if told.size else None,
        "yaw_deg": outcome.yaw_deg,
        "yaw_goal_deg": run.goal.yaw_deg,
        "as_wanted": bool(run.yaw_arc_deg[0] <= outcome.yaw_deg <= run.yaw_arc_deg[1]),
        "cpu_s": spent_s,
    }
    return json.loads(json.dumps(numbers), parse_float=lambda text: round(float(text), 4))  # type: ignore[no-any-return]


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the values of the table."""
    errors = np.abs([r["error_deg"] for r in rows])
    first = [r for r in rows if r["first_inside"] is not None]
    looked = sum(r["looked"] for r in rows)
    return {
        "runs": len(rows),
        "inside": float(np.mean([r["inside"] for r in rows])),
        "done": float(np.mean([r["done"] for r in rows])),
        "mean_error_deg": float(errors.mean()),
        "median_error_deg": float(np.median(errors)),
        "worst_error_deg": float(errors.max()),
        "within_3_deg": float(np.mean(errors <= 3.0)),
        "seconds": float(np.median([r["seconds"] for r in rows])),
        "seconds_p95": float(np.percentile([r["seconds"] for r in rows], 95)),
        "walks": float(np.mean([r["walks"] for r in rows])),
        "first_light": len(first),
        "first_light_inside": float(np.mean([r["first_inside"] for r in first])) if first else 0.0,
        "first_light_mean_error_deg": float(np.mean([abs(r["first_error_deg"]) for r in first]))
        if first
        else 0.0,
        "yaw_mean_error_deg": float(
            np.mean([abs(r.get("yaw_deg", 0.0) - r.get("yaw_goal_deg", 0.0)) for r in rows])
        ),
        "as_wanted": float(np.mean([r["inside"] and r.get("as_wanted", True) for r in rows])),
        "looked": looked,
        "unsure": sum(r["unsure"] for r in rows) / max(looked, 1),
        "told_median_deg": float(np.median([r["told_median_deg"] or 180.0 for r in rows])),
        "told_p95_deg": float(np.median([r["told_p95_deg"] or 180.0 for r in rows])),
    }


def table(told: dict[str, Any]) -> str:
    """Return the summary as Markdown, with the runs that ended outside the arc."""
    entries = [
        ("runs", f"{told['runs']}", ""),
        ("ended within the tolerance arc", f"{told['inside']:.1%}", "at least 98 %"),
        (
            "error against the goal, mean (median, worst)",
            f"{told['mean_error_deg']:.2f}° ({told['median_error_deg']:.2f}°,"
            f" {told['worst_error_deg']:.2f}°)",
            "mean at most 3°",
        ),
        ("within 3° of the goal", f"{told['within_3_deg']:.1%}", ""),
        ("“Hold it” within 60 s", f"{told['done']:.1%}", ""),
        (
            "time, median (95th percentile)",
            f"{told['seconds']:.0f} s ({told['seconds_p95']:.0f} s)",
            "",
        ),
        ("set off, mean", f"{told['walks']:.1f} times", ""),
        (
            "was in the light when that was first said to him standing",
            f"{told['first_light_inside']:.1%}",
            "",
        ),
        (
            "tracker’s turn less the truth at the picture, median (95th percentile) of a run",
            f"{told['told_median_deg']:.2f}° ({told['told_p95_deg']:.2f}°)",
            "",
        ),
        ("pictures without an answer", f"{told['unsure']:.1%} of {told['looked']}", ""),
    ]
    lines = ["| | measured | bar |", "|---|---|---|"]
    return "\n".join([*lines, *(f"| {a} | {b} | {c} |" for a, b, c in entries)])


def into_page(page: Path, text: str) -> None:
    """Insert the table into the page, if there is one."""
    if not page.exists():
        return
    before, mark, rest = page.read_text("utf-8").partition(MARKS[0])
    _, end, after = rest.partition(MARKS[1])
    if mark and end:
        atomic_write_text(page, f"{before}{mark}\n{text}\n{end}{after}")


def line(entry: dict[str, Any]) -> str:
    """Format one run for printing."""
    return (
        f"{entry['run']:3d} {entry['style']:18s} from {entry['start_deg']:7.1f} to"
        f" {entry['goal_deg']:7.1f}: {'held' if entry['done'] else 'TIME'}"
        f" {'inside' if entry['inside'] else 'OUTSIDE'} {entry['error_deg']:+6.2f} deg,"
        f" {entry['seconds']:5.1f} s, {entry['walks']} walks, unsure"
        f" {entry['unsure']}/{entry['looked']}, told {entry['told_median_deg']}"
        f" p95 {entry['told_p95_deg']} ({entry['cpu_s']:.0f} s)"
    )


def main() -> None:
    """Run missing runs, print the table, write the file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds that he has")
    parser.add_argument("--known", type=float, default=0.5, help="share of known fields of view")
    parser.add_argument("--aside", action="store_true", help="the nose is aside of the lens")
    parser.add_argument("--words", action="store_true", help="no face is read")
    parser.add_argument("--told-sitter", action="store_true", help="do not look for the sitter")
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "simulated-turn.json"
    )
    given = parser.parse_args()
    cv2.setNumThreads(1)
    rows: list[dict[str, Any]] = []
    if given.o.exists():
        rows = json.loads(given.o.read_text("utf-8"))["rows"]
    have = {r["run"] for r in rows}
    place = demo_world(aside=given.aside)
    for number in range(given.first, given.runs):
        if number in have:
            continue
        run, began = draw(number, place, given.known), time.process_time()
        outcome = run_turn(run, place, given.limit, given.told_sitter, not given.words)
        rows.append(row(run, outcome, time.process_time() - began))
        print(line(rows[-1]), flush=True)
        rows.sort(key=lambda r: int(r["run"]))
        told = {"summary": summary(rows), "rows": rows}
        atomic_write_text(given.o, json.dumps(told, indent=1) + "\n")
    text = table(summary(rows))
    print(text)
    into_page(given.o.with_suffix(".md"), text)


if __name__ == "__main__":
    main()
