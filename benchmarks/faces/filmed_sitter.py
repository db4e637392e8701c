"""Films of the rendered sitter against pictures of her in the place itself, at all 64 turns.

The demo's views are films: 72 pictures around her, path-traced with near light and her own body.
The turns from the film alone are compared with the true curves of `truth_in_place.py`, which light
every point of her skin at its position. Renders missing pictures (a quarter of an hour for the
first place, half an hour for the second); an interrupted run resumes.

    DRJIT_LIBLLVM_PATH=... python -m benchmarks.faces.filmed_sitter --work FOLDER [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write_text
from app.core.environment.environment import read_environment, reduce
from app.core.measure.film.film import read_film
from app.core.solver.style_signature import GRADES, grades, match_of_areas, stops_of
from app.core.solver.transport import load_named
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.brute_force import band_limited, curves, weights_of
from benchmarks.truth.stock import ROOT
from benchmarks.truth.truth_in_place import (
    SEEDS,
    TURNS,
    areas_of,
    grey_of,
    kept,
    light_up,
    pictures_file,
    pictures_of,
)

DEMO: Final = ROOT / "resources" / "demo"
UNIT: Final = np.float32(200.0)  # cd/m2 per unit of both panoramas
# Number of the spot, its panorama, rounds of rays, and the films: their folder and centimetres.
PLACES: Final = (
    (0, "location/probe-1", 2, "location/views", (120, 180)),
    (3, "cafe/probe", 4, "cafe", (120,)),
)


def pictures(work: Path, number: int, rounds: int) -> NDArray[np.float32]:
    """Return the true pictures at a spot, (TURNS * SEEDS, P, 3), rendering missing ones."""
    file = pictures_file(work, f"probe-{number + 1}", rounds)
    if file.exists():
        return np.asarray(np.load(file), np.float32)
    from app.core.baking.kernel_lanes import select_variant

    select_variant("llvm")
    from benchmarks.truth.place_light import CAFE, SPOTS, Sitting, portrait

    work.mkdir(parents=True, exist_ok=True)
    head = portrait(load_named("generic").pixels)
    front = np.flatnonzero(head.points.normals[:, 2] > -0.3)
    sitting = Sitting((*SPOTS, CAFE)[number])
    for column in range(TURNS * SEEDS):
        light_up(work, sitting, head, front, number, column, rounds)
    name = f"probe-{number + 1}"
    return kept(file, lambda: pictures_of(work, name, rounds, head, front))


def frames(views: str, distance_cm: int) -> Iterator[tuple[float, float, NDArray[np.uint8]]]:
    """Yield the views at one distance as a film of slightly more than one turn."""
    turns = [*range(0, 360, 5), 0, 5, 10]
    for number, turn in enumerate(turns):
        picture = cv2.imread(str(DEMO / views / f"view-{turn:03d}-{distance_cm}.webp"))
        assert picture is not None
        yield 0.5 * number, number / len(turns), np.array(picture[..., ::-1], np.uint8)


def judged(work: Path, number: int, probe: str, rounds: int, films: list[Any]) -> Iterator[Any]:
    """Yield the turns offered by each film at a spot, and their true value."""
    transport, pack = load_named("generic"), load_named_pack("generic")
    light = reduce(read_environment(DEMO / f"{probe}.exr"), (32, 64)) * UNIT
    grey = grey_of(pictures(work, number, rounds)).reshape(TURNS, SEEDS, -1).swapaxes(0, 1)
    match = band_limited(curves(grey, *weights_of(pack, transport)["picture"])[1])
    seen = areas_of(pack, transport, grey.mean(axis=0), np.asarray(light, np.float32))
    for row, style in enumerate(pack.styles):
        if style.signature.areas:
            match[row] = match_of_areas(style.signature, seen)[0]
    grade = grades(*pack.signatures.slack(stops_of(seen), match))
    around = np.arange(TURNS) * 360 / TURNS
    for views, distance_cm in films:
        film = read_film(frames(views, distance_cm))
        for row, one in enumerate(film.results(pack)):
            if one.grade not in ("yes", "soft"):
                continue
            turn = one.turn_refined_deg % 360
            here = float(np.interp(turn, around, match[row], period=360))
            best = float(match[row].max())
            yield {
                "film": f"{views}, {distance_cm} cm",
                "style": one.name,
                "grade": one.grade,
                "true_grade": GRADES[grade[row, round(turn / 360 * TURNS) % TURNS]],
                "turn_deg": round(turn, 1),
                "best_turn_deg": float(around[int(match[row].argmax())]),
                "given_up": round(100 * (best - here) / best, 2),
            }


def main() -> None:
    """Render missing pictures, judge the films, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/filmed-sitter.json")
    args = parser.parse_args()
    rows = [
        row
        for number, probe, rounds, views, distances in PLACES
        for row in judged(args.work, number, probe, rounds, [(views, far) for far in distances])
    ]
    for row in rows:
        print(row)
    within = sum(row["given_up"] <= 5 for row in rows)
    found = {"pairs": len(rows), "within_5_percent": within, "rows": rows}
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
