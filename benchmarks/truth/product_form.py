"""T against renders of the same scene by stock Mitsuba, and against plain path tracing.

Lights the exported scene with five indoor environments and eight lamps of 15 degrees radius, two
seeds each, renders it with ``volpathmis`` and compares with T's picture; then compares twelve
single texels with plain backward path tracing, which fills exactly those texels; then the noise of
T with that of a second bake with another seed.

    python benchmarks/truth/product_form.py --scenes FOLDER --second T2.npz --work FOLDER
                                              [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.core.baking.exposure import vertex_points
from app.core.baking.kernel_lanes import select_variant
from app.core.baking.light_sources import texel_noise
from app.core.baking.random_walk import scene_tables
from app.core.baking.scene import build_scene
from app.core.baking.skin import find_skin
from app.core.base.atomic_files import atomic_write_text
from app.core.solver.transport import Transport, load_named, load_transport, render
from benchmarks.speed.plain_search import matrix
from benchmarks.truth.plain_walk import trace_plainly
from benchmarks.truth.stock import INDOORS, ROOT, generic_head, read_light, stock_picture

if TYPE_CHECKING:
    from collections.abc import Callable

Float64 = NDArray[np.float64]
SHAPE = (32, 64)
# Azimuth (to the sitter's left) and elevation of the lamps, in degrees.
LAMPS = ((0, 0), (0, 45), (45, 45), (90, 10), (135, 20), (-60, 0), (0, -45), (-120, 30))
RADIUS_DEG = 15.0
# Paths find a lamp by chance alone (`stock_picture`), so its pictures need more of them than those
# of a whole place.
LAMP_FACTOR = 4


def directions() -> Float64:
    """Return unit vectors to the texels' centres in the head frame at turn 0, (H, W, 3)."""
    elevation = np.pi / 2 - (np.arange(SHAPE[0]) + 0.5) / SHAPE[0] * np.pi
    azimuth = ((np.arange(SHAPE[1]) + 0.5) / SHAPE[1] - 0.5) * 2 * np.pi
    level, up = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
    x, z = -np.sin(azimuth) * level, np.cos(azimuth) * level
    return np.stack([x, np.broadcast_to(up, SHAPE), z], axis=-1)


def lamp_light(azimuth_deg: float, elevation_deg: float) -> NDArray[np.float32]:
    """Return an environment with one round lamp of radiance 1."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    toward = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    inside = directions() @ toward > np.cos(np.radians(RADIUS_DEG))
    return np.repeat(inside[..., None], 3, axis=2).astype(np.float32)


def compare(ours: tuple[Float64, Float64], theirs: tuple[Float64, Float64]) -> dict[str, float]:
    """Return the difference of two bakes' pictures from two references, free of all noise.

    The errors of one bake against one reference and of the other bake against the other have
    independent noise, so the mean of their product contains only the errors of both bakes.

    Args:
        ours, theirs: two (P, 3) float. Linear pictures on the face.

    Returns:
        ``colour``: worst channel's relative difference of the mean; ``rmse``: RMS difference / RMS
        beyond noise, 0 if hidden by noise; ``rmse_2_sigma``: its upper bound at two standard
        errors; ``noise``: of the references' mean.
    """
    (one, two), (first, second) = ours, theirs
    power = float((first * second).mean())
    products = (one - first) * (two - second) + (two - first) * (one - second)
    squares = products.mean(axis=1) / 2
    square, error = float(squares.mean()), float(squares.std() / np.sqrt(len(squares)))
    colour = np.abs((one + two).mean(axis=0) / (first + second).mean(axis=0) - 1)
    return {
        "colour": float(colour.max()),
        "rmse": float(np.sqrt(max(0.0, square) / power)),
        "rmse_2_sigma": float(np.sqrt(max(0.0, square + 2 * error) / power)),
        "noise": float(np.sqrt(np.square(first - second).mean() / 4 / power)),
    }


def against_stock(
    bakes: tuple[Transport, Transport], scenes: Path, work: Path, paths: int
) -> list[dict[str, object]]:
    """Compare environments and lamps with ``volpathmis``."""
    head, camera = generic_head()
    transport = bakes[0]
    # The background share of a covered pixel shows the environment in stock Mitsuba: leave it out.
    whole = transport.face & (transport.coverage > 0.999)
    lights = {Path(name).stem: read_light(scenes / name) for name in INDOORS}
    lights |= {f"lamp {a} {e}": lamp_light(a, e) for a, e in LAMPS}
    rows = []
    for name, light in lights.items():
        lamp = name.startswith("lamp")
        count = paths * (LAMP_FACTOR if lamp else 1)
        picture = partial(
            stock_picture, head, camera, "medium", light, count, sample_light=not lamp
        )
        # The name states the rendering: pictures with Mitsuba's own roulette are too dark.
        how = "by chance" if lamp else "late roulette"
        one, two = (
            kept(work / f"{name} {count} {how} {seed}.npy", partial(picture, seed=seed))
            .reshape(-1, 3)[transport.pixels][whole]
            .astype(np.float64)
            for seed in range(2)
        )
        first, second = (render(bake, light)[whole].astype(np.float64) for bake in bakes)
        rows.append({"light": name, **compare((first, second), (one, two))})
        print(rows[-1], flush=True)
    return rows


def plain_matrix(transport: Transport, work: Path, paths: int, seed: int) -> NDArray[np.float32]:
    """Return T by plain backward path tracing, (P, H * W, 3): every texel exactly, with noise."""

    def trace() -> NDArray[np.float32]:
        head, camera = generic_head()
        skin = find_skin("medium")
        scene = build_scene(head, skin, camera)
        tables = scene_tables(scene, head, skin, vertex_points(head), camera.size)
        parts = []
        for start in range(0, len(transport.pixels), 256):
            pixels = transport.pixels[start : start + 256]
            parts.append(trace_plainly(tables, pixels, paths, seed * 1_000_000 + start, SHAPE))
        return np.concatenate(parts)

    return kept(work / f"plain-{paths}-{seed}.npy", trace)


def against_plain(
    bakes: tuple[Transport, Transport], work: Path, paths: int
) -> list[dict[str, object]]:
    """Compare twelve single texels with plain backward path tracing of the same scene."""
    chosen = [(r, c) for r in (6, 11, 16, 21) for c in (20, 32, 45)]
    flat = [r * SHAPE[1] + c for r, c in chosen]
    face = bakes[0].face
    one, two = (
        plain_matrix(bakes[0], work, paths, seed)[face][:, flat].astype(np.float64)
        for seed in (1, 2)
    )
    rows = []
    for k, (row, column) in enumerate(chosen):
        ours = tuple(
            np.stack([matrix(bake, c)[face, flat[k]] for c in range(3)], axis=-1).astype(np.float64)
            for bake in bakes
        )
        result = compare((ours[0], ours[1]), (one[:, k], two[:, k]))
        rows.append({"texel": [row, column], **result})
        print(rows[-1], flush=True)
    return rows


def noise(transport: Transport, second: Transport) -> dict[str, float]:
    """Return the noise per texel of two bakes, over texels that light the face."""
    one, two = (
        np.stack([matrix(t, c) for c in range(3)], axis=-1)[t.face] for t in (transport, second)
    )
    lit = (one.mean(axis=2) > 0.05 * one.mean(axis=2).max(axis=0)).mean(axis=0) > 0.05
    above = np.repeat(90 - (np.arange(SHAPE[0]) + 0.5) / SHAPE[0] * 180 > -60, SHAPE[1])
    values = texel_noise(one, two)[lit & above]
    return {
        "texels": int(values.size),
        "median": float(np.median(values)),
        "p95": float(np.percentile(values, 95)),
        "worst": float(values.max()),
        "share_up_to_3_percent": float((values <= 0.03).mean()),
    }


def kept(file: Path, make: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
    """Compute an array once and keep it on disk."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        partial = file.with_suffix(".part.npy")
        np.save(partial, make())
        partial.replace(file)
    loaded: NDArray[np.float32] = np.load(file)
    return loaded


def main() -> None:
    """Run all comparisons and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, required=True)
    parser.add_argument("--second", type=Path, required=True, help="a bake with another seed")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--paths", type=int, default=1024)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks" / "results" / "truth.json")
    args = parser.parse_args()
    select_variant("llvm")
    transport = load_named("generic")
    bakes = transport, load_transport(args.second)
    result = {
        "transport_sha256": transport.digest,
        "paths_per_pixel": args.paths,
        "noise": noise(*bakes),
        "single_texels": against_plain(bakes, args.work, 16 * args.paths),
        "stock": against_stock(bakes, args.scenes, args.work, args.paths),
    }
    atomic_write_text(args.o, json.dumps(result, indent=1) + "\n")
    print(json.dumps(result["noise"]))


if __name__ == "__main__":
    main()
