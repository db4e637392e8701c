"""Hard sun on the portrait's bald head against the product form with all points of the skin.

Twelve suns of 0.53 deg in front of the head. The reference traces the bake's own walk from some of
the portrait's pixels, and rays to 64 points of each sun: it has no low-rank part. It is checked
itself under a lamp of 8 deg against stock Mitsuba (`check`).

    python -m benchmarks.truth.portrait_sun sun|check --work FOLDER
                                                                [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.light import lamps_light
from app.core.portrait.portrait_file import PLAIN, load_portrait
from app.core.styles.style import StyleLamp
from benchmarks.truth.stock import ROOT

Float32: TypeAlias = NDArray[np.float32]
SUN_DEG: Final = 0.53
LAMP_DEG: Final = 8.0
FAR_M: Final = 100.0
SUNS: Final = 12
PIXELS: Final = 300
PATHS: Final = 32768
RAYS: Final = 8
"""Along each side of a sun: 64 points."""
GLINTS: Final = 256
STOPS: Final = 6.0
SMALL: Final = 40
"""Pixels along a side of the picture for the check."""
CHECKED: Final = (1, 4, 6, 9)
STOCK_SAMPLES: Final = 8192
"""Of each of two seeds."""


def suns(diameter_deg: float) -> list[StyleLamp]:
    """Return directions spread over the half of the sphere in front of the face."""
    found, golden = [], math.pi * (3 - math.sqrt(5))
    for number in range(SUNS):
        ahead = (number + 0.5) / SUNS
        aside, angle = math.sqrt(1 - ahead**2), 0.4 + number * golden
        azimuth = math.degrees(math.atan2(aside * math.cos(angle), ahead))
        elevation = math.degrees(math.asin(aside * math.sin(angle)))
        found.append(StyleLamp(azimuth, elevation, diameter_deg, 1.0, FAR_M))
    return found


@dataclass(frozen=True, slots=True)
class Reference:
    """Pixels under each lamp, by two independent seeds: (2, n, lamps, 3)."""

    pixels: NDArray[np.int32]
    values: Float32
    lit: NDArray[np.bool_]
    """Whether any part of the pixel's skin sees any part of the lamp, (n, lamps)."""


def product_form(
    camera: Any, lamps: Sequence[StyleLamp], pixels: NDArray[np.int32], paths: int
) -> Reference:
    """Return the light of pixels by the bake's own parts, without its compression."""
    from app.core.baking.exposure import expose, place_points, shine
    from app.core.baking.light_sources import LampColumns
    from app.core.baking.random_walk import lean_scale, scene_tables
    from app.core.baking.scene import build_scene
    from app.core.baking.skin import find_skin
    from app.core.baking.skin_light import measure_profile
    from benchmarks.truth.stock import generic_head

    head, _ = generic_head()
    skin = find_skin("medium")
    scene = build_scene(head, skin, camera)
    points = place_points(scene, head, 3)
    tables = scene_tables(scene, head, skin, points, camera.size)
    columns = LampColumns(lamps, head.eye_point)
    profile = measure_profile(tables, pixels, 5)
    moments = expose(scene, points, columns, RAYS, 11)
    entering = [sum(a * m for a, m in zip(row, moments, strict=True)) for row in profile]
    slant = lean_scale(profile)[:, None, None] * columns.directions().T
    values = np.empty((2, len(pixels), columns.count, 3), np.float32)
    lit = np.zeros((len(pixels), columns.count), bool)
    for seed in range(2):
        glints = shine(scene, camera.size, pixels, columns, GLINTS, 17 + seed)
        values[seed] = glints + _scattered(tables, pixels, paths, seed, (entering, slant))
        lit |= glints.any(axis=2)
    return Reference(pixels, values, lit)


def _scattered(
    tables: Any, pixels: NDArray[np.int32], paths: int, seed: int, light: tuple[Any, Any]
) -> Float32:
    from app.core.baking.random_walk import trace_pixels

    entering, slant = light
    out = np.zeros((len(pixels), entering[0].shape[1], 3), np.float32)
    step, started = max(1, (1 << 20) // paths), time.perf_counter()
    for start in range(0, len(pixels), step):
        some = slice(start, start + step)
        found = trace_pixels(tables, pixels[some], paths, 1_000_003 * (seed + 1) + start)
        for channel in range(3):
            out[some, :, channel] = found.share[:, :, channel] @ entering[channel]
            for axis in range(3):
                lean = found.lean[:, :, axis, channel] @ entering[channel]
                out[some, :, channel] += lean * slant[channel][axis]
        if start % (16 * step) == 0:
            print(f"{start} of {len(pixels)}, {time.perf_counter() - started:.0f} s", flush=True)
    return out


def sun(work: Path) -> dict[str, Any]:
    """Compare the app's pictures in hard sun with the reference."""
    select_variant("llvm")
    from benchmarks.truth.portrait_scene import framed_head

    known = load_portrait("generic", "medium", PLAIN)
    assert known is not None
    whole = known[0].coverage
    lamps = suns(SUN_DEG)
    pictures = [portrait_picture(*known, lamps_light([lamp]), 0.0) for lamp in lamps]
    pixels = np.random.default_rng(4).choice(np.flatnonzero(whole > 0.999), PIXELS, replace=False)
    file = work / "sun.npz"
    if not file.exists():
        _, _, camera = framed_head()
        found = product_form(camera, lamps, np.sort(pixels).astype(np.int32), PATHS)
        np.savez(file, pixels=found.pixels, values=found.values, lit=found.lit)
    kept = np.load(file)
    ours = np.stack([p.reshape(-1, 3)[kept["pixels"]] for p in pictures], axis=1)
    black = [_black(picture[whole > 0.5]) for picture in pictures]
    return {
        "black_pixels": sum(black),
        "negative_pixels": int(sum((picture < 0).any(axis=2).sum() for picture in pictures)),
        **errors(ours, kept["values"], kept["lit"]),
    }


def _black(pixels: Float32) -> int:
    """Count pixels within six stops of the brightest with a channel at or below 0."""
    near = luminance(pixels) >= luminance(pixels).max() / 2**STOPS
    return int((pixels[near] <= 0).any(axis=1).sum())


def stock_pictures(camera: Any, lamp: StyleLamp, samples: int) -> Float32:
    """Render the bald head under one lamp by stock Mitsuba, two seeds: (2, rows, columns, 3)."""
    import mitsuba as mi

    from app.core.baking.scene import MILLIMETRES_PER_UNIT, build_scene
    from app.core.baking.skin import find_skin
    from benchmarks.truth.stock import generic_head

    head, _ = generic_head()
    eye, away = np.array(head.eye_point), lamp.distance_m * 1000 / MILLIMETRES_PER_UNIT
    wide = math.tan(math.radians(lamp.diameter_deg / 2))
    place = eye + away * np.array(lamp.direction)
    there = mi.ScalarTransform4f().look_at(place.tolist(), eye.tolist(), [0.1, 1, 0.1])
    radiance = {"type": "rgb", "value": lamp.power / (math.pi * wide**2)}
    disc = {
        "type": "disk",
        "to_world": there @ mi.ScalarTransform4f().scale([away * wide, away * wide, 1]),
        "emitter": {"type": "area", "radiance": radiance},
    }
    scene = build_scene(head, find_skin("medium"), camera, {"lamp": disc})
    # Russian roulette is allowed here: paths hit so small a lamp only by explicit sampling.
    way = mi.load_dict({"type": "volpathmis"})
    step, found = 512, []
    for seed in range(2):
        parts = [
            np.array(mi.render(scene, integrator=way, spp=step, seed=1000 * seed + n), np.float32)
            for n in range(samples // step)
        ]
        found.append(np.mean(parts, axis=0))
    return np.stack(found)


def check(work: Path) -> dict[str, Any]:
    """Compare the reference itself under a lamp of 8 deg with stock Mitsuba, in a small picture."""
    select_variant("llvm")
    from app.core.baking.exposure import head_coverage
    from app.core.baking.scene import build_scene
    from app.core.baking.skin import find_skin
    from benchmarks.truth.portrait_scene import framed_head

    head, _, whole = framed_head()
    camera = replace(whole, size=SMALL)
    covered = head_coverage(build_scene(head, find_skin("medium"), camera), SMALL)
    pixels = np.flatnonzero(covered > 0.999).astype(np.int32)
    lamps = [suns(LAMP_DEG)[number] for number in CHECKED]
    file = work / "check.npz"
    if not file.exists():
        found = product_form(camera, lamps, pixels, PATHS // 8)
        np.savez(file, values=found.values, lit=found.lit)
    kept, stock = dict(np.load(file)), []
    for number, lamp in zip(CHECKED, lamps, strict=True):
        picture = work / f"stock-{number}.npy"
        if not picture.exists():
            np.save(picture, stock_pictures(camera, lamp, STOCK_SAMPLES))
        stock.append(np.load(picture).reshape(2, -1, 3)[:, pixels])
    theirs = np.stack(stock, axis=2)
    mine, (one, two) = kept["values"].mean(axis=0), luminance(theirs)
    truth = (one + two) / 2
    # By the reference's own level, which has less noise, so that no bin collects pixels that noise
    # made dark.
    own = luminance(mine)
    level, rows = np.log2(own.max(axis=0) / np.maximum(own, 1e-12)), []
    for least, most in ((0, 1), (1, 2), (2, 3), (3, 6)):
        some = (level >= least) & (level < most)
        total = float(truth[some].sum())
        noise = float(np.sqrt(np.square(one - two)[some].sum())) / 2 / total
        ratio = float(own[some].sum()) / total
        rows.append(
            {"stops": [least, most], "count": int(some.sum()), "ratio": ratio, "noise": noise}
        )
    colour = mine.sum(axis=0) / theirs.mean(axis=0).sum(axis=0)
    return {"colour": np.round(colour, 4).tolist(), "by_stops": rows}


def errors(ours: Float32, values: Float32, lit: NDArray[np.bool_]) -> dict[str, Any]:
    """Return errors in stops, on the shadow side and within six stops of the brightest."""
    mine, one, two = (luminance(v).astype(np.float64) for v in (ours, *values))
    truth = (one + two) / 2
    near = truth >= truth.max(axis=0) / 2**STOPS
    stops = np.abs(np.log2(np.maximum(mine, 1e-12) / np.maximum(truth, 1e-12)))
    noise = (one - two) / 2 / np.maximum(truth, 1e-12)
    rows = []
    for lamp in range(truth.shape[1]):
        shade = near[:, lamp] & ~lit[:, lamp]
        rows.append(_percentiles(stops[shade, lamp]))
    shade = near & ~lit
    return {
        "shadow": _percentiles(stops[shade]),
        "shadow_noise": float(np.sqrt((noise[shade] ** 2).mean())),
        "all": _percentiles(stops[near]),
        "all_noise": float(np.sqrt((noise[near] ** 2).mean())),
        "by_direction": rows,
    }


def _percentiles(stops: Float32) -> dict[str, float]:
    if len(stops) == 0:
        return {"count": 0}
    parts = {f"p{q}": round(float(np.percentile(stops, q)), 4) for q in (50, 90, 95, 99)}
    return {"count": len(stops), **parts}


def main() -> None:
    """Command line entry."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("sun", "check"))
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/portrait-sun.json")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    result = {"sun": sun, "check": check}[args.what](args.work)
    known = json.loads(args.o.read_text(encoding="utf-8")) if args.o.exists() else {}
    atomic_write_text(args.o, json.dumps({**known, args.what: result}, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
