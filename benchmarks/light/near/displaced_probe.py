"""Answers from a camera that stood 60 cm from the head: what they lose, and which are cautioned.

    python -m benchmarks.light.near.displaced_probe --work DIR [--panoramas DIR ...] [-o FILE.json]

The probe is moved by 60 cm in six directions, in three kinds of places. Rooms and streets
(`rooms.py`) and the demo location are ray-traced at both positions. Poly Haven's panoramas are
displaced inside a box as large as the place roughly is, which the estimate is not told; outdoors,
everything is infinitely far away, so no style loses. A style loses if its offered turn has at least
3 points less match at the head than the turn that a probe at the head would offer, in any of the
directions. It should be cautioned (`app.core.cautions.near_light`), and others should not.
Five seeds and every second panorama were used to choose the rules; the others are only reported.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.atomic_files import atomic_write_text
from app.core.base.sphere import directions, positions, wrapped
from app.core.cautions.near_light import near_light
from app.core.environment.environment import Environment, reduce_light
from app.core.measure.finish.clip_audit import choices
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.light.plain_panorama import ROOT, SHARED, light_of, places, same_places

OFFSETS: Final = tuple(0.6 * way for way in np.vstack([np.eye(3), -np.eye(3)]))
"""Positions of the head relative to the probe, in metres."""

SEEDS: Final = 13
CHOSEN_SEEDS: Final = (0, 2, 4, 6, 8)
LOST: Final = 3.0
_PROBE_SHAPE: Final = (128, 256)
_HEAD_SHAPE: Final = (64, 128)
_FINE_SHAPE: Final = (256, 512)
_PASSES: Final = 36
_UNSURE: Final = ("adams_place_bridge", "modern_buildings_2")  # half open: neither box nor sky
_BOXES: Final[dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]]] = {
    # metres: width, height and depth of the room, and position of the camera
    "3 x 4 m": ((3.0, 2.5, 4.0), (1.3, 1.5, 1.8)),
    "5 x 6 m": ((5.0, 2.7, 6.0), (2.0, 1.5, 3.6)),
    "8 x 10 m": ((8.0, 3.5, 10.0), (3.0, 1.5, 6.0)),
    "14 x 20 m": ((14.0, 6.0, 20.0), (6.0, 1.5, 8.0)),
}
CHOSEN_PANORAMAS: Final = (
    *("aristea_wreck_puresky", "blocky_photo_studio", "brown_photostudio_02"),
    *("brown_photostudio_07", "christmas_photo_studio", "dancing_hall", "hilly_terrain"),
    *("leadenhall_market", "narrow_moonlit_road", "peppermint_powerplant", "pm_apartment"),
    *("pm_dawn", "pm_forest", "pm_lobby", "pm_park", "pm_studio", "pm_sunset", "pm_warehouse"),
    *("quarry_01", "sepulchral_chapel_rotunda", "studio_small_05", "vestibule"),
)
"""The panoramas that were used to choose the rules; those named pm are from @pmndrs/assets."""

_SIZES: Final = {  # by a look at each panorama
    "5 x 6 m": ("apartment", "lebombo", "studio_small_05", "drachenfels_cellar", "pm_studio"),
    "8 x 10 m": (
        *("lobby", "fagans", "christmas_photo_studio", "blocky_photo_studio", "brown_photostudio"),
        *("thatch_chapel", "pm_lab"),
    ),
    "14 x 20 m": (
        *("vestibule", "aerodynamics_workshop", "autoshop", "circus", "hall", "leadenhall"),
        *("powerplant", "warehouse", "pm_workshop", "rotunda", "esplanade"),
    ),
}


def losses(probe: Float32, heads: Sequence[Float32], pack: StylePack) -> Float64:
    """Return the points of match that the probe's turns lose at each head, (n, S).

    Args:
        probe: (H, W, 3) float32. Light at the probe.
        heads: (h, w, 3) float32 each. Light at the head.
    """
    shape = pack.header.environment
    found = choices(pack, [reduce_light(light, shape) for light in (probe, *heads)])
    turns, rows = found[0].offer, np.arange(len(pack.styles))
    match = found.measured.match[1:]
    best = np.stack([found[1 + head].offer for head in range(len(heads))])
    there = np.take_along_axis(match, best[..., None], axis=-1)[..., 0]
    return np.asarray(there - match[:, rows, turns])


def case(
    name: str, kind: str, half: int, probe: Float32, heads: Sequence[Float32], pack: StylePack
) -> dict[str, Any]:
    """Return a place's losses by direction, and the styles in the caution.

    Args:
        half: 0 if the place was used to choose the rules, otherwise 1.
        heads: Light at each of `OFFSETS`, or nothing if no style loses.
    """
    light = np.array(probe, np.float32)
    started = time.process_time()
    cautions = near_light(Environment(light, name), pack)
    seconds = time.process_time() - started
    named = [] if not cautions else list(cautions[0].styles or ())
    lost = losses(light, heads, pack) if heads else np.zeros((len(OFFSETS), len(pack.styles)))
    return {
        "name": name,
        "kind": kind,
        "half": half,
        "styles": named,
        "seconds": round(seconds, 3),
        "lost": np.round(lost, 2).tolist(),
    }


def rooms(work: Path, pack: StylePack, seeds: int) -> list[dict[str, Any]]:
    """Return the cases of the ray-traced rooms and streets, rendering what is missing."""
    from app.core.baking.kernel_lanes import select_variant

    select_variant("llvm")
    from benchmarks.light.near.rooms import KINDS, build_room
    from benchmarks.light.near.rooms import panoramas as render_panoramas

    def render(kind: str, seed: int) -> dict[str, Float32]:
        room = build_room(kind, seed)
        probe = render_panoramas(room, [np.zeros(3)], _PROBE_SHAPE)[0]
        heads = render_panoramas(room, OFFSETS, _HEAD_SHAPE)
        return {"probe": probe, "heads": np.stack(heads)}

    cases = []
    for seed in range(seeds):
        for kind in KINDS:
            data = stored(work / f"{kind}-{seed}.npz", partial(render, kind, seed))
            name = f"{kind}-{seed}"
            half = int(seed not in CHOSEN_SEEDS)
            cases.append(case(name, kind, half, data["probe"], list(data["heads"]), pack))
    return cases


def location(work: Path, pack: StylePack) -> list[dict[str, Any]]:
    """Return the cases of the demo location, rendering what is missing."""
    from app.core.baking.kernel_lanes import select_variant

    select_variant("llvm")
    from benchmarks.answers.best_spot import MORE, panorama_at
    from scenes.demo_location.assemble import World, build_place
    from scenes.demo_location.frame import CAFE, EYE_HEIGHT, SPOTS, to_world

    spots = {one.name: one.building for one in (*SPOTS, CAFE)} | MORE
    world: list[Any] = []

    def render(number: int, x: float, z: float) -> dict[str, Float32]:
        if not world:
            world.append(World(build_place(), None))
        at = to_world(x, EYE_HEIGHT, z)
        probe = panorama_at(world[0], at, number, _PROBE_SHAPE, _PASSES)
        heads = [
            panorama_at(world[0], at + offset, 16 * number + k, _HEAD_SHAPE, _PASSES)
            for k, offset in enumerate(OFFSETS)
        ]
        return {"probe": probe, "heads": np.stack(heads)}

    cases = []
    for number, (name, (x, z)) in enumerate(spots.items()):
        data = stored(work / f"location-{name}.npz", partial(render, number, x, z))
        heads = list(data["heads"])
        cases.append(case(name, "demo location", 1, data["probe"], heads, pack))
    return cases


def panoramas(folders: Sequence[Path], pack: StylePack) -> list[dict[str, Any]]:
    """Return the cases of panoramas displaced inside a box, or unchanged outdoors."""
    lights: dict[str, Float32] = {}
    for path in places(tuple(folders)).values():
        lights.setdefault(path.stem, light_of(path))
    for twin in same_places(lights):
        lights.pop(twin)
    cases = []
    for name, light in sorted(lights.items()):
        if any(part in name for part in _UNSURE):
            continue
        half = int(not any(part in name for part in CHOSEN_PANORAMAS))
        size_of = _FINE_SHAPE[::-1]
        small = np.asarray(cv2.resize(light, size_of, interpolation=cv2.INTER_AREA), np.float32)
        sizes = [size for size, parts in _SIZES.items() if any(part in name for part in parts)]
        if not sizes:
            cases.append(case(name, "outdoors", half, light, [], pack))
            continue
        for size in _BOXES:
            kind = "likely box" if size in sizes else f"box {size}"
            found = case(name, kind, half, light, [], pack)
            heads = [boxed(small, size, offset) for offset in OFFSETS]
            lost = np.round(losses(boxed(small, size, np.zeros(3)), heads, pack), 2).tolist()
            cases.append(found | {"lost": lost, "box": size})
    return cases


def boxed(light: Float32, size: str, offset: Float64) -> Float32:
    """Return a panorama displaced inside a box, by following every ray to the box's walls.

    Args:
        light: (256, 512, 3) float32. Panorama at the camera.
        offset: (3,) float64. Position of the head relative to the camera, in metres.
    """
    extent, camera = (np.array(each) for each in _BOXES[size])
    ways, start = directions(_FINE_SHAPE).astype(np.float64), camera + offset
    walls = np.where(ways > 0.0, extent - start, -start)
    distance = (walls / np.where(ways == 0.0, 1e-12, ways)).min(axis=-1)
    points = start + distance[..., None] * ways - camera
    columns, rows = positions(points.astype(np.float32), _FINE_SHAPE)
    rows = np.clip(rows, 0, _FINE_SHAPE[0] - 1)
    return np.asarray(cv2.remap(wrapped(light, 2), columns + 2, rows, cv2.INTER_LINEAR))


def stored(path: Path, render: Callable[[], dict[str, Float32]]) -> dict[str, Float32]:
    """Return the arrays in a file, rendering them first if the file is missing."""
    if not path.exists():
        started = time.perf_counter()
        np.savez(path, allow_pickle=False, **render())
        print(f"{path.stem}: {time.perf_counter() - started:.0f} s", flush=True)
    with np.load(path) as data:
        return {name: data[name] for name in data.files}


def rates(cases: Sequence[dict[str, Any]], pack: StylePack) -> dict[str, Any]:
    """Return the percentages of styles cautioned among those that lose and among the others.

    A style counts once for each place, and is lost if it loses in any direction; `by_direction`
    counts it once for each direction instead.
    """
    names = [style.name for style in pack.styles]
    lost = np.stack([np.array(one["lost"]) > LOST for one in cases])  # (n, directions, S)
    named = np.array([[name in one["styles"] for name in names] for one in cases])
    wide = np.repeat(named[:, None], lost.shape[1], axis=1)
    return {
        "places": len(cases),
        **_shares(lost.any(axis=1), named),
        "by_direction": _shares(lost, wide),
    }


def _shares(lost: Any, named: Any) -> dict[str, Any]:
    def percent(some: Any) -> float | None:
        return round(100.0 * float(some.mean()), 1) if some.size else None

    return {
        "styles": int(lost.size),
        "lost": percent(lost),
        "lost_cautioned": percent(named[lost]),
        "others_cautioned": percent(named[~lost]),
    }


def summary(cases: Sequence[dict[str, Any]], pack: StylePack) -> dict[str, Any]:
    """Return the rates by kind of place, separately for both halves."""
    traced = [one for one in cases if "box" not in one and one["kind"] != "outdoors"]
    seeded = [one for one in traced if one["kind"] != "demo location"]
    groups = {"ray-traced": seeded, "demo location": [one for one in traced if one not in seeded]}
    groups |= {kind: [one for one in cases if one["kind"] == kind] for kind in _kinds(cases)}
    for size in _BOXES:
        groups[f"indoors, {size}"] = [one for one in cases if one.get("box") == size]
    likely = [one for one in cases if one["kind"] in ("likely box", "outdoors")]
    groups["panoramas"] = likely
    groups["all places"] = [*traced, *likely]
    found: dict[str, Any] = {}
    for name, some in groups.items():
        for half, label in enumerate(("chosen on", "held out")):
            part = [one for one in some if one["half"] == half]
            if part:
                found[f"{name}, {label}"] = rates(part, pack)
    seconds = [one["seconds"] for one in cases]
    return found | {"seconds_median": round(float(np.median(seconds)), 3)}


def _kinds(cases: Sequence[dict[str, Any]]) -> list[str]:
    return [kind for kind in dict.fromkeys(one["kind"] for one in cases) if "box " not in kind]


def main() -> None:
    """Render missing light, judge every place, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="where renders are kept")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--panoramas", type=Path, nargs="*", default=[SHARED / "data" / "hdri"])
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/near-light.json")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    pack = load_named_pack("generic")
    cases = rooms(args.work, pack, args.seeds) + location(args.work, pack)
    cases += panoramas(args.panoramas, pack)
    commit = ["git", "rev-parse", "--short", "HEAD"]
    table = summary(cases, pack)
    found = {
        "measured": datetime.now(UTC).strftime("%Y-%m-%d"),
        "commit": subprocess.check_output(commit, cwd=ROOT, text=True).strip(),
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
        "summary": table,
        "places": [
            {
                **{key: one[key] for key in ("name", "kind", "half", "styles")},
                "lost": int((np.array(one["lost"]) > LOST).any(axis=0).sum()),
            }
            for one in cases
        ],
    }
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
    for name, row in table.items():
        print(name, json.dumps(row))


if __name__ == "__main__":
    main()
