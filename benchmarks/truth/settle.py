"""Second look at the turns that brute force left undecided, with many more paths.

`brute_force.py` names, for every scene and style, the best of 64 noisy pictures; the best of many
noisy numbers is better than its true value. If it seems better than the chosen turn by more than 1
% of the range, both turns are rendered again here, independently of the nomination. Both use the
same random numbers, batch by batch, so that most of the noise of their difference cancels. An
interrupted run resumes, and adds its results to the same JSON.

If the search has changed since the first look and chooses another turn, that turn is recorded
first: at the best of the 64 nothing is lost, and any other is settled like an open pair.

    python benchmarks/truth/settle.py --scenes FOLDER --work FOLDER [--batches 40]
"""

from __future__ import annotations

import argparse
import json
import time
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.core.baking.kernel_lanes import select_variant
from app.core.base.angles import difference
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.solver.solve import solve_all
from app.core.solver.transport import Transport, load_named, render
from app.core.solver.turn_choice import (
    Limits,
    Objective,
)
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.brute_force import FINE, TURNS, curves, head_alone, weights_of
from benchmarks.truth.stock import ROOT, generic_head, read_light, rotate, stock_picture

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benchmarks.truth.brute_force import Weights

LIMIT = 0.01
OBJECTIVES: dict[str, Objective] = {"quality": "paper", "match": "picture"}
PATHS = 512
# Seeds of the first look are below 2 * TURNS.
FIRST_SEED = 10_000
WHICH = ("turn", "best")


def batch(scenes: Path, work: Path, scene: str, turn: int, number: int) -> NDArray[np.float32]:
    """Return one picture with the random numbers of this batch, cached on disk."""
    file = work / f"settle-{scene}-{PATHS}-{turn:02d}-{number:03d}.npy"
    if not file.exists():
        head, camera = generic_head()
        light = rotate(read_light(scenes / f"{scene}.hdr"), turn)
        picture = stock_picture(head, camera, "medium", light, PATHS, FIRST_SEED + number, FINE)
        partial = file.with_suffix(".part.npy")
        np.save(partial, picture)
        partial.replace(file)
    loaded: NDArray[np.float32] = np.load(file)
    return loaded


@lru_cache(maxsize=1)
def styles() -> tuple[Transport, StylePack, Weights]:
    """Return the shipped transport and pack, and the weights of every style on its pixels."""
    transport, pack = load_named("generic"), load_named_pack("generic")
    return transport, pack, weights_of(pack, transport)


def curve_of(pictures: NDArray[np.float64], style: str, measure: str) -> NDArray[np.float64]:
    """Return quality or match of a style in pictures, in the format of `curves`."""
    _, pack, weights = styles()
    every, region = weights["paper" if measure == "quality" else "picture"]
    both = curves(pictures, every[pack.index(style)][None], region)
    return np.asarray(both[0 if measure == "quality" else 1][0])


def own_range(light: NDArray[np.float32], style: str, measure: str) -> float:
    """Return the range of the transport's own curve, the reference of shares."""
    transport, _, _ = styles()
    own = np.stack([luminance(render(transport, rotate(light, k))) for k in range(TURNS)])
    return float(np.ptp(curve_of(np.stack([own, own]).astype(np.float64), style, measure)))


def given_up(pictures: NDArray[np.float64], style: str, measure: str) -> float:
    """Return the loss of the chosen turn against the rival, in units of the measure.

    Args:
        pictures: (B, 2, P) float. Batches by (chosen, rival) by pixels, luminance.
    """
    halves = np.stack([pictures[::2].mean(axis=0), pictures[1::2].mean(axis=0)])
    chosen, rival = curve_of(halves, style, measure)
    return float(rival - chosen)


def settle(scenes: Path, work: Path, row: dict[str, Any], measure: str, batches: int) -> None:
    """Render both turns of a pair and write the result into its row."""
    turns = [round(row[f"{measure}_{which}_deg"] / 360 * TURNS) % TURNS for which in WHICH]
    transport, _, _ = styles()
    pictures = np.array(
        [
            [
                head_alone(batch(scenes, work, row["scene"], t, b).astype(np.float64), transport)
                for t in turns
            ]
            for b in range(batches)
        ]
    )
    scale = own_range(read_light(scenes / f"{row['scene']}.hdr"), row["style"], measure)
    groups = np.array_split(np.arange(batches), 10)
    without = [
        given_up(np.delete(pictures, group, axis=0), row["style"], measure) for group in groups
    ]
    spread = np.sqrt((len(groups) - 1) * np.var(without))
    row[f"{measure}_settled"] = {
        "given_up": given_up(pictures, row["style"], measure) / scale,
        "standard_error": float(spread / scale),
        "paths_per_pixel": PATHS * batches,
    }


def follow(scenes: Path, rows: list[dict[str, Any]]) -> list[tuple[dict[str, Any], str]]:
    """Record the pack's current turns; return the pairs to settle."""
    pack = load_named_pack("generic")
    found: list[tuple[dict[str, Any], str]] = []
    for measure, objective in OBJECTIVES.items():
        for row in rows:
            light = read_light(scenes / f"{row['scene']}.hdr")
            (now,) = solve_all(
                pack, light, objective, limits=Limits(0.0, 0.0), styles=[row["style"]]
            )
            best = row[f"{measure}_best_deg"]
            if abs(difference(now.turn_deg, row[f"{measure}_turn_deg"])) > 1.0:
                row[f"{measure}_turn_deg"] = now.turn_deg
                row.pop(f"{measure}_settled", None)
                # Unknown until it is settled, unless it is the very best.
                same = abs(difference(now.turn_deg, best)) < 1.0
                row[f"{measure}_given_up"] = 0.0 if same else None
            given = row[f"{measure}_given_up"]
            if f"{measure}_settled" not in row and (given is None or given > LIMIT):
                found.append((row, measure))
    return found


def main() -> None:
    """Settle every open pair, and write after each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--batches", type=int, default=40)
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "brute-force.json"
    )
    args = parser.parse_args()
    select_variant("llvm")
    args.work.mkdir(parents=True, exist_ok=True)
    found = json.loads(args.o.read_text(encoding="utf-8"))
    started = time.perf_counter()
    for row, measure in follow(args.scenes, found["rows"]):
        settle(args.scenes, args.work, row, measure, args.batches)
        atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
        minutes = (time.perf_counter() - started) / 60
        print(row["scene"], row["style"], measure, row[f"{measure}_settled"], f"{minutes:.1f} min")
    for measure in OBJECTIVES:
        known = [row[f"{measure}_given_up"] for row in found["rows"]]
        found["worst"][f"{measure}_given_up"] = max(each for each in known if each is not None)
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
