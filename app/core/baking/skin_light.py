"""Measure the light that enters the skin from each texel and each lamp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.baking.bake_cache import BakeCache, Keep, no_keep
from app.core.baking.exposure import (
    Points,
    expose,
)
from app.core.baking.kernel_lanes import Watch, is_wavefront, part_of, unwatched
from app.core.baking.light_sources import (
    Columns,
    LampColumns,
    TexelColumns,
)
from app.core.baking.quality import Quality
from app.core.baking.random_walk import (
    PROFILE_BINS,
    SceneTables,
    fit_profile,
    lean_scale,
    trace_profile,
)
from app.core.base.arrays import Float32, Float64
from app.core.base.progress import Progress, Report, Task, Token

BATCH_PIXELS = 96
"""Number of pixels in a batch."""
_PROFILE_PIXELS = 1000
_PROFILE_PATHS = 512
# A path through the skin takes about as long as this many shadow rays. The number is used only to
# estimate the time left.
_RAYS_IN_PATH = 50


@dataclass(frozen=True, slots=True)
class BakeJob:
    """The scene and the settings that all parts of a bake share."""

    scene: Any
    tables: SceneTables
    points: Points
    picture: int
    pixels: NDArray[np.int32]
    texels: TexelColumns
    lamps: LampColumns | None
    quality: Quality
    seed: int

    @property
    def columns(self) -> tuple[Columns, ...]:
        """The columns of the matrix: first the texels, then the lamps."""
        return (self.texels,) if self.lamps is None else (self.texels, self.lamps)

    @property
    def shadows(self) -> tuple[int, ...]:
        """Numbers of shadow rays along each side of a column, for texels and for lamps."""
        # Lamps can have many more rays, since they are few compared with thousands of texels.
        return (self.quality.shadows, 4 * self.quality.shadows)[: len(self.columns)]

    @property
    def shadow_rays(self) -> tuple[int, ...]:
        """Numbers of shadow rays from each point to all texels and to all lamps."""
        both = zip(self.columns, self.shadows, strict=True)
        return tuple(columns.count * side**2 for columns, side in both)

    @property
    def count(self) -> int:
        """Total number of columns."""
        return sum(columns.count for columns in self.columns)


@dataclass(frozen=True, slots=True)
class SkinLight:
    """Light that enters the skin.

    Attributes:
        entering: One array per channel, (V, columns) float32. Light that enters the skin at each
            point from each column.
        slant: (3, 3, columns) float32, [channel, axis]. Weight of the lean of a pixel's share of
            the light.
    """

    entering: tuple[Float32, ...]
    slant: Float32


@dataclass(frozen=True, slots=True)
class PartProgress:
    """Reports the progress of a bake that consists of parts, and stops it if it is cancelled."""

    report: Report
    token: Token

    def part(self, start: float, stop: float, task: Task) -> Watch:
        """Return the callback for a part that takes the progress from `start` to `stop`."""

        def watch(share: float) -> None:
            self.report(share, Progress(task))
            self.token.check()

        return part_of(watch, start, stop)


def light_cache(cache: BakeCache, prefix: str) -> Keep:
    """Return the function that caches measured light.

    In a wavefront variant, nothing is cached, since measuring is faster than reading from disk.
    """
    import mitsuba as mi

    return no_keep if is_wavefront(mi) else cache.prefixed(prefix)


def skin_light(job: BakeJob, cache: BakeCache, progress: PartProgress, end: float) -> SkinLight:
    """Measure the exit profile of the skin and the light that enters the skin."""
    measuring = Task.MEASURING_SKIN
    profile = measure_profile(
        job.tables, job.pixels, job.seed, cache.keep, progress.part(0.01, 0.02, measuring)
    )
    return _light(job, profile, cache, progress.part(0.02, end, measuring))


def light_share(job: BakeJob, views: int) -> float:
    """Estimate the fraction of the time spent on the light, as opposed to the views."""
    light = job.points.count * sum(job.shadow_rays)
    paths = len(job.pixels) * job.quality.paths * _RAYS_IN_PATH
    glints = len(job.pixels) * job.quality.glints * job.count
    return light / (light + views * (paths + glints))


def measure_profile(
    tables: SceneTables,
    pixels: NDArray[np.int32],
    seed: int,
    keep: Keep = no_keep,
    watch: Watch = unwatched,
) -> Float64:
    """Fit the exit profile of the skin, (3, MOMENTS), to a few paths from the given pixels."""
    some = pixels[:: max(1, len(pixels) // _PROFILE_PIXELS)]

    def trace() -> Float32:
        total = np.zeros((PROFILE_BINS, 3))
        for start in range(0, len(some), BATCH_PIXELS):
            part = some[start : start + BATCH_PIXELS]
            watching = part_of(watch, start / len(some), (start + len(part)) / len(some))
            total += trace_profile(tables, part, _PROFILE_PATHS, seed + 999 + start, watching)
        return total.astype(np.float32)

    return fit_profile(keep("profile", (PROFILE_BINS, 3), trace).astype(np.float64))


def _light(job: BakeJob, profile: Float64, cache: BakeCache, watch: Watch) -> SkinLight:
    """Measure the light from all columns at all points."""
    parts, weights = [], profile.astype(np.float32)
    ends = np.cumsum([0, *job.shadow_rays]) / sum(job.shadow_rays)
    for number, columns in enumerate(job.columns):
        moments = expose(
            job.scene,
            job.points,
            columns,
            job.shadows[number],
            job.seed + number,
            keep=light_cache(cache, f"light{number}"),
            watch=part_of(watch, ends[number], ends[number + 1]),
        )
        parts.append([sum(a * one for a, one in zip(row, moments, strict=True)) for row in weights])
    directions = np.concatenate([columns.directions() for columns in job.columns])
    return SkinLight(
        entering=tuple(np.concatenate(channel, axis=1) for channel in zip(*parts, strict=True)),
        slant=lean_scale(profile).astype(np.float32)[:, None, None] * directions.T,
    )
