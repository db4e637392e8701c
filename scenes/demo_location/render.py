"""Render in short passes that are saved on disk, so that the work can be interrupted."""

from __future__ import annotations

import json
import os
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import mitsuba as mi  # noqa: TID253 - a module that only a rendering process imports
import numpy as np
from numpy.typing import NDArray

from scenes.demo_location.assemble import World, build_place, sitter_parts
from scenes.demo_location.frame import (
    CAFE,
    EYE_HEIGHT,
    SPOTS,
    STANDS,
    TURNS,
    VIEW_SIZE,
    Spot,
    Stand,
    to_world,
)
from scenes.demo_location.rays import panorama_rays, rows_of_pass, view_rays
from scenes.demo_location.tracer import first_hit, radiance

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["DEPTH_SIZE", "Panorama", "Studio", "View", "load_panorama", "load_view"]

Floats = NDArray[np.float32]
DEPTH_SIZE: Final = (256, 192)
_CHUNK: Final = 1 << 20  # rays at once
_GUIDES: Final = 4  # passes that also record albedo and normal


@dataclass(slots=True)
class Panorama:
    """Sum of the passes of one panorama.

    Attributes:
        total: (H, W, 3). Sum of radiance, cd/m2.
        counts: (H,). Samples in every texel of a row.
    """

    total: Floats
    counts: NDArray[np.int64]
    passes: int
    seconds: float

    @property
    def picture(self) -> Floats:
        """Mean radiance, (H, W, 3)."""
        return np.asarray(self.total / np.maximum(self.counts, 1)[:, None, None], np.float32)


@dataclass(slots=True)
class View:
    """Sums of one view: radiance, albedo and normal, and its depth."""

    total: Floats
    albedo: Floats
    normal: Floats
    depth: Floats
    spp: int
    guides: int
    seconds: float


def _save(path: Path, **arrays: Any) -> None:
    draft = path.with_name(f"{path.stem}.{os.getpid()}.part")
    with draft.open("wb") as stream:
        np.savez(stream, **arrays)
    draft.replace(path)


def load_panorama(work: Path, spot: Spot) -> Panorama | None:
    """Read the saved passes of a panorama; None if there are none."""
    path = work / f"{spot.name}.npz"
    if not path.is_file():
        return None
    with np.load(path) as kept:
        meta = json.loads(str(kept["meta"]))
        return Panorama(kept["total"], kept["counts"], meta["passes"], meta["seconds"])


def _view_path(work: Path, stand: Stand, turn: int, distance: float) -> Path:
    return work / stand.folder / f"{turn:03d}-{round(distance * 100):03d}.npz"


def load_view(work: Path, stand: Stand, turn: int, distance: float) -> View | None:
    """Read the saved passes of a view; None if there are none."""
    path = _view_path(work, stand, turn, distance)
    if not path.is_file():
        return None
    with np.load(path) as kept:
        meta = json.loads(str(kept["meta"]))
        total, albedo, normal, depth = (
            kept[k].astype(np.float32) for k in ("total", "albedo", "normal", "depth")
        )
        return View(total, albedo, normal, depth, meta["spp"], meta["guides"], meta["seconds"])


class Studio:
    """The built place; its passes add to the files in the work folder."""

    def __init__(self, work: Path, heads: Path):
        self.work = work
        self.heads = heads
        for stand in STANDS:
            (work / stand.folder).mkdir(parents=True, exist_ok=True)
        self.place = build_place()
        self.sampler = mi.load_dict({"type": "independent"})
        self._worlds: dict[bool, World] = {}

    def _world(self, sitter: bool) -> World:
        if sitter not in self._worlds:
            parts = sitter_parts(self.heads) if sitter else None
            self._worlds = {sitter: World(self.place, parts)}
        return self._worlds[sitter]

    def panorama_pass(self, spot: Spot) -> Panorama:
        """Add one sample to the texels of a panorama."""
        started = time.monotonic()
        world = self._world(False)
        kept = load_panorama(self.work, spot)
        if kept is None:
            zero = np.zeros((*spot.shape, 3), np.float32)
            kept = Panorama(zero, np.zeros(spot.shape[0], np.int64), 0, 0.0)
        position = to_world(spot.building[0], EYE_HEIGHT, spot.building[1])
        rows = rows_of_pass(spot.shape[0], kept.passes)
        step = max(1, _CHUNK // spot.shape[1])
        for first in range(0, len(rows), step):
            chunk = rows[first : first + step]
            seed = ([*SPOTS, CAFE].index(spot) * 4096 + kept.passes) * 64 + first // step
            self.sampler.seed(seed, len(chunk) * spot.shape[1])
            rays = panorama_rays(position, spot.shape, chunk, self.sampler)
            light = _array(radiance(world.tables, self.sampler, rays))
            kept.total[chunk] += light.reshape(len(chunk), spot.shape[1], 3)
        kept.counts[rows] += 1
        kept.passes += 1
        kept.seconds += time.monotonic() - started
        meta = json.dumps({"passes": kept.passes, "seconds": kept.seconds})
        _save(self.work / f"{spot.name}.npz", total=kept.total, counts=kept.counts, meta=meta)
        return kept

    def view_spp(self, stand: Stand, turn: int) -> int:
        """Return the samples that every view of a turn has."""
        kept = [load_view(self.work, stand, turn, distance) for distance in stand.distances]
        return min(0 if view is None else view.spp for view in kept)

    def turn_pass(self, stand: Stand, turn: int, spp: int) -> None:
        """Add samples to the views of a turn until they have `spp`."""
        world = self._world(True)
        world.turn(float(turn), stand.at)
        for distance in stand.distances:
            view = load_view(self.work, stand, turn, distance)
            view = view or self._first(world, stand, turn, distance)
            started = time.monotonic()
            while view.spp < spp:
                self._sample(world, view, stand, turn, distance)
            view.seconds += time.monotonic() - started
            meta = json.dumps({"spp": view.spp, "guides": view.guides, "seconds": view.seconds})
            _save(
                _view_path(self.work, stand, turn, distance),
                total=view.total,
                albedo=view.albedo.astype(np.float16),
                normal=view.normal.astype(np.float16),
                depth=view.depth,
                meta=meta,
            )

    def _first(self, world: World, stand: Stand, turn: int, distance: float) -> View:
        width, height = DEPTH_SIZE
        ray, cosine = view_rays(stand, turn, distance, DEPTH_SIZE, mi.Point2f(0.5, 0.5))
        far, _, _ = first_hit(world.surfaces, ray)
        depth = np.array(far * cosine, np.float32).reshape(height, width)
        blank = np.zeros((VIEW_SIZE[1], VIEW_SIZE[0], 3), np.float32)
        return View(blank, blank.copy(), blank.copy(), depth, 0, 0, 0.0)

    def _sample(self, world: World, view: View, stand: Stand, turn: int, distance: float) -> None:
        width, height = VIEW_SIZE
        number = TURNS.index(turn) * len(stand.distances) + stand.distances.index(distance)
        first = 5_000_000 * (1 + STANDS.index(stand))
        self.sampler.seed(first + number * 4096 + view.spp, width * height)
        ray, _ = view_rays(stand, turn, distance, VIEW_SIZE, self.sampler.next_2d())
        light = _array(radiance(world.tables, self.sampler, ray)).reshape(height, width, 3)
        # Views are denoised anyway; a limit on single samples keeps fireflies out of the denoiser.
        view.total += np.minimum(light, 60_000.0)
        if view.guides < _GUIDES:
            _, albedo, normal = first_hit(world.surfaces, ray)
            view.albedo += _array(albedo).reshape(height, width, 3)
            view.normal += _array(normal).reshape(height, width, 3)
            view.guides += 1
        view.spp += 1


def _array(colours: Any) -> Floats:
    found = np.array(colours, np.float32)
    return np.ascontiguousarray(found.T if found.shape[0] == 3 else found)
