"""Which spot is best for a style: the program's ranking against pictures made in the place.

The demo location is modelled, so any spot in it can be judged. More spots are added to its three.
Each gets a panorama by the location's own path tracer, and the program's answers for it; at every
turn offered, the sitter is lit in the place itself, as in `truth_in_place.py` (which
`place_check.py` compares with stock Mitsuba). For the three shipped spots, the pictures of that
benchmark are used. For the shared panoramas, where all light is distant, stock Mitsuba makes the
pictures. Then for every style and every set of three to six spots, the spot that `rank_spots` ranks
first by the panoramas' answers is right if its true match is at most 3 points below the best;
`is_right` defines the best. An interrupted run resumes.

    python benchmarks/answers/best_spot.py --work FOLDER [--scenes FOLDER] [-o FILE.json]
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import platform
import subprocess
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.base.atomic_files import atomic_write_text
from app.core.environment.environment import reduce_radiance
from app.core.places.best_spot import rank_spots
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import GRADES, grades, match_of_areas, stops_of
from app.core.solver.transport import Transport, load_named
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.brute_force import FINE, curves, head_alone, weights_of
from benchmarks.truth.stock import ROOT, generic_head, read_light, rotate, stock_picture
from benchmarks.truth.truth_in_place import SEEDS, areas_of, grey_of, kept, light_at

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

Float32 = NDArray[np.float32]
Row: TypeAlias = dict[str, Any]
Rows: TypeAlias = list[Row]

SHIPPED: Final = ("probe-1", "probe-2", "probe-3")
MORE: Final = {
    "threshold": (0.4, 0.8),
    "mid-hall": (1.0, -4.9),
    "door-edge": (-1.8, -1.2),
    "court-east": (2.5, 3.5),
}
"""x and z in building coordinates, metres; all are free positions on the floor."""
SCENES: Final = (
    "brown_photostudio_02_1k",
    "empty_warehouse_01_1k",
    "st_fagans_interior_1k",
    "leadenhall_market_1k",
)
"""Shared panoramas without a sun, which stock Mitsuba renders with little noise."""
STOCK_PATHS: Final = 256
"""With 24, the noise in the norm of a picture gave matches of 120, which are useless as truth."""
SAMPLES: Final = 12  # rays of each kind from each point of the skin, per seed
GLINTS: Final = 24
PATHS: Final = 4096
SHAPE: Final = (256, 512)  # of a panorama
PASSES: Final = 48
SIZES: Final = (3, 4, 5, 6)
NEAR: Final = 3.0  # points of match


def render_panorama(spot: Any, seed: int) -> Float32:
    """Render a spot, (256, 512, 3) cd/m2."""
    from scenes.demo_location.assemble import World, build_place
    from scenes.demo_location.frame import EYE_HEIGHT, to_world

    at = to_world(spot.building[0], EYE_HEIGHT, spot.building[1])
    return panorama_at(World(build_place(), None), at, seed, SHAPE, PASSES)


def panorama_at(
    world: Any, at: NDArray[np.float64], seed: int, shape: tuple[int, int], passes: int
) -> Float32:
    """Render the demo location at a position, (rows, columns, 3) cd/m2.

    The sun is added separately, since random rays rarely hit it.

    Args:
        at: (3,) float64. World position, in metres.
    """
    import drjit as dr
    import mitsuba as mi

    from scenes.demo_location.rays import panorama_rays
    from scenes.demo_location.tracer import radiance

    sampler = mi.load_dict({"type": "independent"})
    rows = np.arange(shape[0])
    total = np.zeros((*shape, 3))
    for number in range(passes):
        sampler.seed(seed * 4096 + number, shape[0] * shape[1])
        ray = panorama_rays(at, shape, rows, sampler)
        light = radiance(world.tables, sampler, ray)
        free = ~world.scene.ray_test(ray)
        light -= dr.select(free, world.lights.escaped(ray.d)[1], 0)
        total += np.array(light).T.reshape(*shape, 3)
    total /= passes
    count = 4096
    sampler.seed(seed * 4096 + passes, count)
    way = world.lights.sample_sun(sampler.next_2d())
    origin = mi.Point3f(*[float(x) for x in at])
    seen = ~np.array(world.scene.ray_test(mi.Ray3f(dr.repeat(origin, count), way)))
    x, y, z = np.array(way)
    row = ((0.5 - np.arcsin(y) / np.pi) * shape[0]).astype(int)
    column = ((np.arctan2(-x, z) / (2 * np.pi) + 0.5) * shape[1]).astype(int)
    edges = np.sin(np.pi * (0.5 - np.arange(shape[0] + 1) / shape[0]))
    solid = (edges[:-1] - edges[1:]) * 2 * np.pi / shape[1]
    sun = np.array(world.lights.sun_radiance).ravel() / world.lights.sun_density / count
    for r, c in zip(row[seen], column[seen], strict=True):
        total[r, c] += sun / solid[r]
    return np.asarray(total, np.float32)


def pictures_at(work: Path, spot: Any, number: int, turns: Sequence[int], head: Any) -> Float32:
    """Return the sitter in the place at some of 64 turns, two seeds each, (n * SEEDS, P, 3)."""
    from benchmarks.truth.place_light import Sitting, through_skin

    front = np.flatnonzero(head.points.normals[:, 2] > -0.3)
    sitting = Sitting(spot)
    entering = np.zeros((head.points.count, 3, 4, len(turns) * SEEDS), np.float32)
    glints = []
    for at, turn in enumerate(turns):
        sitting.turn(turn * 360 / 64)
        for one in range(SEEDS):
            seed = ((number * 64 + turn) * SEEDS + one) << 16
            name = work / f"{spot.name}-{turn:02d}-{one}"
            skin = kept(
                name.with_suffix(".skin.npy"),
                lambda seed=seed: sitting.entering(head, front, SAMPLES, seed),  # type: ignore[misc]
            )
            top = kept(
                name.with_suffix(".top.npy"),
                lambda seed=seed: sitting.reflected(head, GLINTS, seed),  # type: ignore[misc]
            )
            entering[front, :, :, at * SEEDS + one] = skin
            glints.append(top)
        print(f"{spot.name}: {at + 1} of {len(turns)} turns", flush=True)
    below = through_skin(head, entering, PATHS, 5)
    return np.asarray(below.transpose(2, 0, 1) + np.stack(glints), np.float32)


def told(result: StyleResult) -> Row:
    """Return the program's data for a style at a spot."""
    return {
        "style": result.name,
        "turn_deg": result.turn_deg,
        "grade": result.grade,
        "attainable": result.attainable,
        "match": round(result.match, 3),
        "strength": round(result.strength, 3),
        "arc_deg": [round(each, 2) for each in result.arc_deg],
    }


def index_of(result: StyleResult) -> int:
    """Return the index of a turn on the grid of 64."""
    return round(result.turn_deg / 360 * 64) % 64


def judged(
    pack: StylePack,
    transport: Transport,
    light: Float32,
    results: Sequence[StyleResult],
    turns: Sequence[int],
    pictures: NDArray[Any],
) -> Rows:
    """Return the true value of each style's offered turn at a spot.

    Args:
        pictures: For each turn by seeds, (n * SEEDS, P, 3), or their luminance without the last
            axis.
    """
    one_by_one = pictures if pictures.ndim == 2 else grey_of(pictures)
    grey = one_by_one.reshape(len(turns), SEEDS, -1).swapaxes(0, 1)
    weights = weights_of(pack, transport)["picture"]
    match = curves(grey, *weights)[1]
    one, two = (curves(np.stack([each, each]), *weights)[1] for each in grey)
    wide = np.zeros((64, grey.shape[2]))
    wide[list(turns)] = grey.mean(axis=0)
    seen = areas_of(pack, transport, wide, light)[:, list(turns)]
    for row, style in enumerate(pack.styles):
        if style.signature.areas:
            match[row] = match_of_areas(style.signature, seen)[0]
    grade = grades(*pack.signatures.slack(stops_of(seen), match))
    rows = []
    for row, result in enumerate(results):
        at = turns.index(index_of(result))
        known = {"truth": float(match[row, at]), "true_grade": GRADES[grade[row, at]]}
        noise = abs(float(one[row, at] - two[row, at])) / 2
        rows.append(told(result) | known | {"noise": noise})
    return rows


def shipped_rows(pack: StylePack) -> dict[str, Rows]:
    """Return the results of `truth_in_place.py` at the three shipped spots, for current turns."""
    file = ROOT / "benchmarks" / "results" / "truth-in-place.json"
    spots = json.loads(file.read_text(encoding="utf-8"))["spots"]
    out = {}
    for spot in spots:
        known = {r["style"]: r for r in spot["rows"] if r["objective"] == "picture"}
        results = solve_all(pack, light_at(spot["spot"]))
        rows = []
        for result in results:
            row = known[result.name]
            if abs(row["turn_deg"] - result.turn_deg % 360) > 0.01:
                raise ValueError(f"{result.name} at {spot['spot']} is offered at another turn now")
            true = {"truth": row["truth"], "true_grade": row["true_grade"]}
            rows.append(told(result) | true | {"noise": spot["match_noise"]})
        out[spot["spot"]] = rows
    return out


def location_rows(
    work: Path, pack: StylePack, transport: Transport, names: Iterable[str]
) -> tuple[dict[str, Rows], float]:
    """Render the missing pictures of the other spots, and judge them; return rows and seconds."""
    from benchmarks.truth.place_light import Spot, portrait

    out, head, seconds = shipped_rows(pack), None, 0.0
    for name in names:
        number, started = list(MORE).index(name) + len(SHIPPED), time.perf_counter()
        spot, file = Spot(name, name, MORE[name], SHAPE), work / f"{name}-rows.json"
        if not file.exists():
            head = head or portrait(transport.pixels)
            panorama = kept(work / f"{name}-panorama.npy", partial(render_panorama, spot, number))
            light = np.asarray(reduce_radiance(panorama, (32, 64)), np.float32)
            results = solve_all(pack, light)
            turns = sorted({index_of(one) for one in results})
            pictures = pictures_at(work, spot, number, turns, head)
            rows = judged(pack, transport, light, results, turns, pictures)
            took = round(time.perf_counter() - started)
            atomic_write_text(file, json.dumps({"seconds": took, "rows": rows}))
        found = json.loads(file.read_text(encoding="utf-8"))
        out[name], seconds = found["rows"], seconds + found["seconds"]
    return out, seconds


def scene_rows(work: Path, scenes: Path, pack: StylePack, transport: Transport) -> dict[str, Rows]:
    """Do the same for places with only a panorama, all light distant, by stock Mitsuba."""
    head, camera = generic_head()
    out = {}
    for number, name in enumerate(SCENES):
        light = read_light(scenes / f"{name}.hdr")
        results = solve_all(pack, light)
        turns = sorted({index_of(one) for one in results})

        whole = []
        for turn, seed in itertools.product(turns, range(SEEDS)):
            at = (number * 64 + turn) * SEEDS + seed
            seen = partial(stock_picture, head, camera, "medium", rotate(light, turn))
            file = work / f"{name}-{turn:02d}-{seed}.npy"
            whole.append(kept(file, partial(seen, STOCK_PATHS, at, FINE)))
        grey = np.stack([head_alone(each.astype(np.float64), transport) for each in whole])
        out[name] = judged(pack, transport, light, results, turns, grey)
        print(f"{name}: {len(turns)} turns", flush=True)
    return out


def chosen(rows: Sequence[Row]) -> Row:
    """Return the row of the spot that the program ranks first."""
    known: list[Any] = [
        SimpleNamespace(
            rank=GRADES.index(row["grade"] or ("yes" if row["attainable"] else "no")),
            match=row["match"],
            strength=row["strength"],
            arc_deg=tuple(row["arc_deg"]),
        )
        for row in rows
    ]
    return rows[rank_spots(known)[0]]


READINGS: Final = ("within_3_of_highest", "has_it_and_within_3", "same_grade_and_within_3")


def is_right(rows: Sequence[Row]) -> tuple[bool, bool, bool]:
    """Return whether the first spot is right, for three definitions of "the best" true picture.

    The first is the highest match, whether or not the picture has the style. The second is the
    highest match of those that have it, yes or soft, and the first spot must have it too; the
    third is the best grade with its highest match. If no true picture has the style, the last two
    equal the first.
    """
    first, grade = chosen(rows), GRADES.index
    found = []
    for least in ("no", "soft", max((row["true_grade"] for row in rows), key=grade)):
        there = [row for row in rows if grade(row["true_grade"]) >= grade(least)] or list(rows)
        near = first["truth"] >= max(row["truth"] for row in there) - NEAR
        found.append(near and first in there)
    return found[0], found[1], found[2]


def cases(spots: dict[str, Rows]) -> Iterator[tuple[int, list[Row]]]:
    """Yield every style at every set of 3 to 6 spots: number of spots, and their rows."""
    names = list(spots)
    for size in SIZES:
        for some in itertools.combinations(names, size):
            for rows in zip(*(spots[name] for name in some), strict=True):
                yield size, list(rows)


def named(found: list[tuple[bool, ...]]) -> Iterator[tuple[str, tuple[bool, ...]]]:
    """Yield, by definition, whether each case is right."""
    return zip(READINGS, zip(*found, strict=True), strict=True)


def summary(spots: dict[str, Rows]) -> dict[str, Any]:
    """Return the shares of cases in which the first spot is right."""
    out: dict[str, Any] = {}
    for size, rows in cases(spots):
        reach = any(row["attainable"] for row in rows)
        for key in ("all", f"of {size}", "one in reach" if reach else "none in reach"):
            out.setdefault(key, []).append(is_right(rows))
    every = [row for rows in spots.values() for row in rows]
    off = np.abs([row["match"] - row["truth"] for row in every])
    shares = {
        key: {"cases": len(found)}
        | {reading: round(float(np.mean(each)), 4) for reading, each in named(found)}
        for key, found in sorted(out.items())
    }
    return shares | {
        "match_off": {
            "median": round(float(np.median(off)), 2),
            "95 %": round(float(np.quantile(off, 0.95)), 2),
        },
        "noise": round(float(np.median([row["noise"] for row in every])), 2),
        "grade_agrees": round(
            float(np.mean([r["attainable"] == (r["true_grade"] != "no") for r in every])), 4
        ),
    }


def main() -> None:
    """Render missing pictures, judge, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--scenes", type=Path, help="folder of the shared panoramas")
    parser.add_argument("--spots", nargs="+", default=list(MORE))
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks" / "results" / "best-spot.json")
    args = parser.parse_args()
    select_variant("llvm")
    args.work.mkdir(parents=True, exist_ok=True)
    transport, pack = load_named("generic"), load_named_pack("generic")
    location, seconds = location_rows(args.work, pack, transport, args.spots)
    groups, started = {"location": location}, time.perf_counter()
    if args.scenes is not None:
        groups["scenes"] = scene_rows(args.work, args.scenes, pack, transport)
    asked = ["git", "rev-parse", "--short", "HEAD"]
    found = {
        "commit": subprocess.check_output(asked, cwd=ROOT, text=True).strip(),
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
        "seconds": round(seconds + time.perf_counter() - started),
        "transport_sha256": transport.digest,
        "paths_of_stock": STOCK_PATHS,
        "summary": {name: summary(spots) for name, spots in groups.items()},
        "spots": groups,
    }
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
    print(json.dumps(found["summary"], indent=1))


if __name__ == "__main__":
    main()
