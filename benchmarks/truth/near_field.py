"""Lamps near the head: the near field from T against a path-traced picture of the same lamp.

Follows light from every other pixel of the face (as on a chessboard) through the skin to lamps of
their true size at their true position, with two seeds, about ten minutes of one processor; an
interrupted run resumes. Then compares the pictures of `core.second_light.added_light` with them,
and writes the result as JSON, and small pictures for tests.

    python benchmarks/truth/near_field.py --work FOLDER [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from app.core.baking.bake_cache import BakeCache
from app.core.baking.exposure import Points, expose, place_points, shine
from app.core.baking.kernel_lanes import Table, select_variant
from app.core.baking.random_walk import (
    PROFILE_BINS,
    fit_profile,
    lean_scale,
    scene_tables,
    trace_pixels,
    trace_profile,
)
from app.core.baking.scene import MILLIMETRES_PER_UNIT, build_scene, head_middle
from app.core.baking.skin import find_skin
from app.core.base.atomic_files import atomic_write, atomic_write_text
from app.core.second_light.added_light import near_picture, prepare_near
from app.core.second_light.lamp_presets import NumbersLamp, parse
from app.core.second_light.placements import direction
from app.core.solver.head_shape import load_shape_of
from app.core.solver.transport import Transport, load_named
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.stock import ROOT, generic_head

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.baking.random_walk import SceneTables

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]

LAMPS = ("phone", "panel", "softbox")
DISTANCES_M = (0.3, 0.6, 1.0, 2.0)
PLACES = {
    "front": (0.0, 0.0),
    "key": (35.0, 45.0),
    "below": (0.0, -45.0),
    "above": (20.0, 67.5),
    "side": (90.0, 0.0),
    "other side": (-60.0, 0.0),
    "behind": (-135.0, 16.875),
}
PATHS = 8192
GLINTS = 1024
SHADOWS = 8
SEEDS = (11, 12)
BATCH = 96
KEPT = ROOT / "tests" / "data" / "near-field.npz"


def cases() -> Iterator[tuple[NumbersLamp, str, float, float]]:
    """Yield every lamp at every distance and position: lamp, name, azimuth, altitude."""
    for kind in LAMPS:
        for metres in DISTANCES_M:
            for name, (azimuth, altitude) in PLACES.items():
                yield parse(f"{kind}@{metres:g}"), name, azimuth, altitude


class HeldLamps:
    """Flat lamps that face the middle of the head, as columns of light; see `Columns`.

    Args:
        middle: (3,) float. Middle of the head, scene units.
        eye_point: (3,) float. Midway between the eyes, scene units.
    """

    def __init__(self, middle: Float64, eye_point: Float64) -> None:
        units = 1000.0 / MILLIMETRES_PER_UNIT
        rows = list(cases())
        held = [lamp for lamp, *_ in rows]
        assert not any(lamp.round for lamp in held)
        toward = np.array([direction(azimuth, altitude) for *_, azimuth, altitude in rows])
        angles = np.radians([azimuth for *_, azimuth, _ in rows])
        side = np.stack([np.cos(angles), 0.0 * angles, -np.sin(angles)], axis=1)
        sizes = np.array([lamp.size_m for lamp in held]) * units
        centres = middle + toward * np.array([[lamp.distance_m * units] for lamp in held])
        seen = centres - eye_point
        self._seen: Float32 = (seen / np.linalg.norm(seen, axis=1, keepdims=True)).astype(
            np.float32
        )
        self._toward, self._centres = Table(toward), Table(centres)
        self._side = Table(side * sizes[:, :1])
        self._over = Table(np.cross(toward, side) * sizes[:, 1:])
        self._flux = Table(np.array([lamp.lux_at_1m for lamp in held]) * units**2)

    @property
    def count(self) -> int:
        """Number of lamps."""
        return len(self._seen)

    def directions(self) -> Float32:
        """Return the unit vectors from between the eyes, (count, 3) float32."""
        return self._seen

    def sample(self, column: Any, position: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
        """See `Columns.sample`."""
        import drjit as dr

        side, over = self._side.take(column), self._over.take(column)
        place = self._centres.take(column) + side * (s - 0.5) + over * (t - 0.5)
        offset = place - position
        squared = dr.squared_norm(offset)
        distance = dr.sqrt(squared)
        direction = offset / distance
        facing = dr.maximum(0, dr.dot(direction, self._toward.take(column)))
        return direction, distance, self._flux.take(column) * facing / squared


def render_all(work: Path, pixels: NDArray[np.int32]) -> Float32:
    """Return the luminance under every lamp by both seeds, (seeds, pixels, lamps), cd/m2."""
    select_variant("llvm")
    head, camera = generic_head()
    skin = find_skin("medium")
    scene = build_scene(head, skin, camera)
    points = place_points(scene, head, 0)
    tables = scene_tables(scene, head, skin, points, camera.size)
    lamps = HeldLamps(head_middle(head), np.array(head.eye_point))
    weights = np.asarray(load_named("generic").header.luminance_weights, np.float32)
    found = []
    for seed in SEEDS:
        shelf = BakeCache(work / f"near-{PATHS}-{SHADOWS}-{lamps.count}-{seed}")
        light = _light(scene, tables, points, lamps, shelf, seed)
        parts = []
        for start in range(0, len(pixels), BATCH):
            some, own = pixels[start : start + BATCH], seed * 1_000_003 + start
            shape = (len(some), lamps.count, 3)
            below = partial(_skin, tables, light, some, own)
            glints = partial(shine, scene, camera.size, some, lamps, GLINTS, own)
            part = shelf.keep(f"skin-{start}", shape, below)
            part = part + shelf.keep(f"glints-{GLINTS}-{start}", shape, glints)
            parts.append(np.asarray(part @ weights, np.float32))
            print(f"seed {seed}: {start + len(some)} of {len(pixels)} pixels", flush=True)
        found.append(np.concatenate(parts))
    return np.stack(found)


def _light(
    scene: Any, tables: SceneTables, points: Points, lamps: HeldLamps, shelf: BakeCache, seed: int
) -> tuple[list[Float32], Float32]:
    """Return the light entering the skin at each point, per channel (V, lamps), and its lean."""
    some = np.arange(0, tables.picture**2, 7, dtype=np.int32)

    def profile() -> Float32:
        return trace_profile(tables, some, 512, seed)

    fitted = fit_profile(shelf.keep("profile", (PROFILE_BINS, 3), profile).astype(np.float64))
    moments = expose(scene, points, lamps, SHADOWS, seed, keep=shelf.prefixed("light"))
    entering = [np.tensordot(row.astype(np.float32), moments, 1) for row in fitted]
    slant = lean_scale(fitted).astype(np.float32)[:, None, None] * lamps.directions().T
    return entering, slant


def _skin(
    tables: SceneTables,
    light: tuple[list[Float32], Float32],
    pixels: NDArray[np.int32],
    seed: int,
) -> Float32:
    """Return the light leaving the skin in some pixels, (n, lamps, 3)."""
    gathered = trace_pixels(tables, pixels, PATHS, seed)
    used = np.flatnonzero(gathered.share.any(axis=(0, 2)))
    share, lean = gathered.share[:, used], gathered.lean[:, used]
    channels = []
    for channel, (everywhere, slant) in enumerate(zip(*light, strict=True)):
        entering = everywhere[used]
        found = share[:, :, channel] @ entering
        for axis in range(3):
            found += (lean[:, :, axis, channel] @ entering) * slant[axis]
        channels.append(found)
    return np.stack(channels, axis=2)


def chessboard(transport: Transport) -> NDArray[np.bool_]:
    """Return the compared pixels of a transport, (P,): every other one of the face."""
    row, column = np.divmod(transport.pixels, transport.size)
    chosen: NDArray[np.bool_] = transport.face & ((row + column) % 2 == 0)
    return chosen


def error(picture: Float64, truth: Float64) -> tuple[float, float]:
    """Return the relative RMSE after the best common scale, per cent, and that scale."""
    scale = float(picture @ truth) / max(float(picture @ picture), 1e-30)
    away = float(np.linalg.norm(scale * picture - truth) / np.linalg.norm(truth))
    return 100.0 * away, scale


def noise(truth: Float64) -> float:
    """Return the relative noise of the mean of two renders, per cent."""
    one, two = truth
    return 100.0 * float(0.5 * np.linalg.norm(one - two) / np.linalg.norm(truth.mean(axis=0)))


def compare(transport: Transport, truth: Float32) -> list[dict[str, object]]:
    """Return one row for each lamp, distance and position."""
    chosen = chessboard(transport)
    near = prepare_near(transport, load_shape_of(transport, "generic"))
    # All skin at the middle of the head: light from the same direction everywhere, as from afar.
    at_middle = replace(near, positions=np.zeros_like(near.positions))
    weights = np.asarray(transport.header.luminance_weights)
    rows: list[dict[str, object]] = []
    for number, (lamp, name, azimuth, altitude) in enumerate(cases()):
        seen = truth[:, :, number].astype(np.float64)
        picture = (near_picture(near, lamp, azimuth, altitude) @ weights)[chosen]
        distant = (near_picture(at_middle, lamp, azimuth, altitude) @ weights)[chosen]
        rmse, scale = error(picture, seen.mean(axis=0))
        rows.append(
            {
                "lamp": lamp.kind,
                "distance_m": lamp.distance_m,
                "place": name,
                "azimuth_deg": azimuth,
                "altitude_deg": altitude,
                "rmse_percent": round(rmse, 2),
                "scale": round(scale, 4),
                "noise_percent": round(noise(seen), 2),
                "as_if_far_percent": round(error(distant, seen.mean(axis=0))[0], 1),
            }
        )
    return rows


def keep_pictures(path: Path, transport: Transport, truth: Float32) -> None:
    """Store the mean of both renders relative to its brightest pixel, for tests."""
    mean = truth.mean(axis=0)
    bright = mean.max(axis=0)
    arrays = {
        "pixels": transport.pixels[chessboard(transport)],
        "bright": bright.astype(np.float32),
        "pictures": np.round(65535 * np.maximum(mean / bright, 0.0)).astype(np.uint16).T,
    }

    def write(target: Path) -> None:
        with target.open("wb") as stream:
            np.savez_compressed(stream, allow_pickle=False, **arrays)

    path.parent.mkdir(parents=True, exist_ok=True)
    atomic_write(path, write)


def main() -> None:
    """Render missing pictures, compare, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="where renders are kept")
    parser.add_argument(
        "-o", "--output", type=Path, default=ROOT / "benchmarks" / "results" / "near-field.json"
    )
    args = parser.parse_args()
    transport = load_named("generic")
    truth = render_all(args.work, transport.pixels[chessboard(transport)])
    rows = compare(transport, truth)
    keep_pictures(KEPT, transport, truth)
    result = {
        "head": transport.header.head,
        "skin": transport.header.skin,
        "transport_sha256": load_named_pack("generic").header.transport_sha256,
        "paths_per_pixel": PATHS,
        "seeds": len(SEEDS),
        "pixels": int(np.count_nonzero(chessboard(transport))),
        "worst_percent": max(row["rmse_percent"] for row in rows),  # type: ignore[type-var]
        "rows": rows,
    }
    atomic_write_text(args.output, json.dumps(result, indent=1) + "\n")
    for row in rows:
        print(*row.values())


if __name__ == "__main__":
    main()
