"""The offered turns against pictures of the sitter in the place itself.

Turnlight, like the paper, treats all light as distant. At the three spots of the demo location the
sitter is lit here as in the modelled place: every point of the skin by its own light, past her own
body. Of each of 64 turns there are two pictures with independent noise. An interrupted run resumes.

    python benchmarks/truth/truth_in_place.py --work FOLDER [-o FILE.json]
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.environment.environment import read_environment, reduce
from app.core.solver import search
from app.core.solver.face import AREAS, AROUND
from app.core.solver.solve import solve_all
from app.core.solver.style_signature import GRADES, grades, match_of_areas, stops_of
from app.core.solver.transport import Transport, load_named, render
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.brute_force import band_limited, curves, weights_of
from benchmarks.truth.stock import ROOT, rotate

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.solver.turn_choice import Objective
    from benchmarks.truth.place_light import Portrait, Sitting

TURNS: Final = 64
SEEDS: Final = 2
SAMPLES: Final = 16  # rays of each kind from each point of the skin, per seed and round
GLINTS: Final = 32  # rays of each kind from each pixel, per seed and round
# by spot: indoors, where light comes around corners, there is more noise
ROUNDS: Final = (2, 12, 1)
PATHS: Final = 4096
LOCATION: Final = ROOT / "resources" / "demo" / "location"
OBJECTIVES: Final[tuple[Objective, ...]] = ("picture", "paper")
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


def kept(file: Path, make: Callable[[], Float32]) -> Float32:
    """Read an array of an earlier run, or compute and save it."""
    if not file.exists():
        draft = file.with_suffix(".part.npy")
        np.save(draft, make())
        draft.replace(file)
    loaded: Float32 = np.load(file)
    return loaded


def render_places(work: Path, spots: list[int], rounds: tuple[int, ...]) -> None:
    """Compute the missing light at the skin, and the pictures of all turns."""
    select_variant("llvm")
    from benchmarks.truth.place_light import SPOTS, Sitting, portrait

    work.mkdir(parents=True, exist_ok=True)
    head = portrait(load_named("generic").pixels)
    # Points facing away from the camera send almost nothing to it, and are not lit.
    front = np.flatnonzero(head.points.normals[:, 2] > -0.3)
    for number in spots:
        spot, started = SPOTS[number], time.perf_counter()
        sitting = Sitting(spot)
        for column in range(TURNS * SEEDS):
            light_up(work, sitting, head, front, number, column, rounds[number])
            minutes = (time.perf_counter() - started) / 60
            print(f"{spot.name}: {column + 1} of {TURNS * SEEDS}, {minutes:.1f} min", flush=True)
    for number in spots:
        name = SPOTS[number].name
        follow = partial(pictures_of, work, name, rounds[number], head, front)
        kept(pictures_file(work, name, rounds[number]), follow)


def light_up(
    work: Path,
    sitting: Sitting,
    head: Portrait,
    front: NDArray[np.int64],
    number: int,
    column: int,
    rounds: int,
) -> None:
    """Compute the missing parts of one turn and seed."""
    name = f"probe-{number + 1}"
    missing = [
        (each, what)
        for each, what in itertools.product(range(rounds), ("skin", "top"))
        if not part_of(work, name, column, each, what).exists()
    ]
    if missing:
        sitting.turn(column // SEEDS * 360 / TURNS)
    for each, what in missing:
        # From the twelfth round on, seeds of another spot are repeated.
        seed = (((each * len(ROUNDS) + number) * TURNS * SEEDS + column) << 20) % 2**32
        skin = partial(sitting.entering, head, front, SAMPLES, seed)
        glints = partial(sitting.reflected, head, GLINTS, seed)
        kept(part_of(work, name, column, each, what), skin if what == "skin" else glints)


def pictures_file(work: Path, name: str, rounds: int) -> Path:
    """Return the file of a spot's pictures."""
    return work / f"{name}-pictures-{rounds}.npy"


def part_of(work: Path, name: str, column: int, each: int, what: str) -> Path:
    """Return the file of a round's light for a turn and seed."""
    return work / f"{name}-{column:03d}-{what}-{each}.npy"


def pictures_of(
    work: Path, name: str, rounds: int, head: Portrait, front: NDArray[np.int64]
) -> Float32:
    """Return all pictures of a spot, (TURNS * SEEDS, P, 3): light through the skin, and glints."""
    from benchmarks.truth.place_light import through_skin

    def mean(column: int, what: str) -> Float32:
        parts = [np.load(part_of(work, name, column, each, what)) for each in range(rounds)]
        return np.asarray(np.mean(parts, axis=0), np.float32)

    columns = range(TURNS * SEEDS)
    entering = np.zeros((head.points.count, 3, 4, len(columns)), np.float32)
    for column in columns:
        entering[front, :, :, column] = mean(column, "skin")
    below = through_skin(head, entering, PATHS, 5)
    glints = np.stack([mean(column, "top") for column in columns])
    return np.asarray(below.transpose(2, 0, 1) + glints, np.float32)


def light_at(name: str) -> Float32:
    """Return a spot's panorama in the format of the search, (32, 64, 3), cd/m2."""
    facts = json.loads((LOCATION / "location.json").read_text(encoding="utf-8"))
    unit = next(s["cd_per_m2_of_one"] for s in facts["spots"] if s["file"] == f"{name}.exr")
    light = reduce(read_environment(LOCATION / f"{name}.exr"), (32, 64))
    return np.asarray(light * np.float32(unit), np.float32)


def grey_of(pictures: NDArray[Any]) -> Float64:
    """Return the luminance of linear Rec. 709 pictures, without their last axis."""
    return np.asarray(luminance(pictures.astype(np.float64)), np.float64)


def judge(
    name: str, rounds: int, pictures: Float32, transport: Transport, pack: StylePack
) -> dict[str, Any]:
    """Compare the turns offered at a spot with the best of its true pictures.

    Styles that are judged by areas are judged by the same areas here. Changes from turn to turn
    that are faster than light on a face allows are removed from the true curves, as in
    `brute_force.py`; outdoors, almost without noise, there are none.
    """
    weights, face = weights_of(pack, transport), transport.face
    grey = grey_of(pictures).reshape(TURNS, SEEDS, -1).swapaxes(0, 1)
    quality = band_limited(curves(grey, *weights["paper"])[0])
    match = band_limited(curves(grey, *weights["picture"])[1])
    light = light_at(name)
    seen = areas_of(pack, transport, grey.mean(axis=0), light)
    by_areas = [row for row, style in enumerate(pack.styles) if style.signature.areas]
    for row in by_areas:
        match[row] = match_of_areas(pack.styles[row].signature, seen)[0]
    grade = grades(*pack.signatures.slack(stops_of(seen), match))
    far = np.stack([grey_of(render(transport, rotate(light, t))) for t in range(TURNS)])
    alike = [
        float(np.corrcoef(grey[:, t].mean(axis=0)[face], far[t][face])[0, 1]) for t in range(TURNS)
    ]
    alone = [band_limited(curves(np.stack([one, one]), *weights["picture"])[1]) for one in grey]
    rows = [
        row
        for objective, truth in zip(OBJECTIVES, (match, quality), strict=True)
        for row in offered(pack, light, objective, truth, grade)
    ]
    faces = np.setdiff1d(np.arange(len(pack.styles)), by_areas)
    noise = float(np.std((alone[0] - alone[1])[faces]) / 2)  # of the mean of both pictures
    names = {pack.styles[row].name for row in faces}
    values = [
        r["truth"]
        for r in rows
        if r["attainable"] and r["objective"] == OBJECTIVES[0] and r["style"] in names
    ]
    return {
        "spot": name,
        "correlation_of_pictures": {"median": float(np.median(alike)), "least": min(alike)},
        "brightness_near_to_distant": float(grey[:, :, face].mean() / far[:, face].mean()),
        "rounds": rounds,
        "match_noise": noise,
        "match_noise_share": noise / float(np.mean(values)),
        "rows": rows,
    }


def areas_of(pack: StylePack, transport: Transport, grey: Float64, light: Float32) -> Float64:
    """Return means of areas in true pictures, (A, TURNS); around the head, the panorama's."""
    areas = pack.areas.reshape(len(pack.areas), -1)[:, transport.pixels].astype(np.float64)
    means = areas @ grey.T / np.maximum(areas.sum(axis=1), 1e-30)[:, None]
    means[AROUND] = search.curves(pack.tables, pack.project(light)).others[: len(AREAS)][AROUND]
    return np.asarray(means)


def offered(
    pack: StylePack, light: Float32, objective: Objective, truth: Float64, grade: NDArray[np.intp]
) -> list[dict[str, Any]]:
    """Return the true value of every style's offered turn; `truth` and `grade` are (S, TURNS)."""
    rows = []
    results = solve_all(pack, light, objective)
    for result, curve, true_grade in zip(results, truth, grade, strict=True):
        turn = round(result.turn_deg / 360 * TURNS) % TURNS
        rows.append(
            {
                "style": result.name,
                "objective": objective,
                "attainable": result.attainable,
                "grade": result.grade,
                "true_grade": GRADES[true_grade[turn]],
                "turn_deg": result.turn_deg % 360,
                "best_turn_deg": float(np.argmax(curve) * 360 / TURNS),
                "truth": float(curve[turn]),
                "best": float(curve.max()),
                "share": float(curve[turn] / curve.max()),
            }
        )
    return rows


def summary(spots: list[dict[str, Any]]) -> dict[str, Any]:
    """Count the quality of the offered turns of attainable styles."""
    out: dict[str, Any] = {}
    for objective in OBJECTIVES:
        every = [row for spot in spots for row in spot["rows"] if row["objective"] == objective]
        rows = [row for row in every if row["attainable"]]
        # A picture may have the signature, and still look more like another style.
        alike = [row["attainable"] == (row["true_grade"] != "no") for row in every]
        shares = np.array([row["share"] for row in rows])
        out[objective] = {
            "attainable": len(rows),
            "within_3_percent": float(np.mean(shares >= 0.97)),
            "within_10_percent": float(np.mean(shares >= 0.90)),
            "grade_agrees": float(np.mean(alike)),
            "itself_the_best": float(np.mean([r["turn_deg"] == r["best_turn_deg"] for r in rows])),
        }
    return out


def main() -> None:
    """Render missing pictures, judge, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--spots", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--rounds", type=int, nargs=3, default=ROUNDS, help="of each spot")
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "truth-in-place.json"
    )
    args = parser.parse_args()
    render_places(args.work, args.spots, tuple(args.rounds))
    transport, pack = load_named("generic"), load_named_pack("generic")
    names = [f"probe-{number + 1}" for number in args.spots]
    files = [
        pictures_file(args.work, name, args.rounds[number])
        for name, number in zip(names, args.spots, strict=True)
    ]
    spots = [
        judge(name, args.rounds[number], np.load(file), transport, pack)
        for name, number, file in zip(names, args.spots, files, strict=True)
    ]
    found = {"transport_sha256": transport.digest, "summary": summary(spots), "spots": spots}
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
    print(json.dumps(found["summary"], indent=1))


if __name__ == "__main__":
    main()
