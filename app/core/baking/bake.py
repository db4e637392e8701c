"""Baking the transport of a head: all columns at once, batch by batch of pixels.

T is the sum of two parts. The first surface's own reflection is integrated for each pixel
(`exposure.shine`). What comes out of the skin is a product: the share of its light that each pixel
takes from each point of the skin (`walk`), times the light that the point gets from each column
(`exposure.expose`). The studio pictures of the styles come out of the same product, with lamps as
further columns.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NotRequired, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from app.core.baking.bake_cache import BakeCache, Keep, no_keep
from app.core.baking.columns import (
    Columns,
    LampColumns,
    TexelColumns,
    compress,
    mirror_pixels,
    symmetrise,
    texel_functions,
)
from app.core.baking.exposure import (
    Points,
    expose,
    head_coverage,
    look_at_shape,
    look_from,
    place_points,
    shine,
)
from app.core.baking.kernel_lanes import Watch, at_once, is_wavefront, part_of, unwatched
from app.core.baking.random_walk import (
    PROFILE_BINS,
    SceneTables,
    fit_profile,
    lean_scale,
    scene_tables,
    trace_pixels,
    trace_profile,
)
from app.core.baking.scene import CAMERA_DISTANCE_M, Camera, HeadMesh, build_scene, frame_head
from app.core.baking.skin import Skin
from app.core.base.arrays import Float32, Float64
from app.core.base.progress import Progress, Report, Task, Token
from app.core.portrait.head_views import pack_view
from app.core.solver.head_shape import HeadShape
from app.core.solver.transport import Transport, TransportHeader
from app.core.styles.style import Style

_BATCH_PATHS = 1 << 22
_BATCH_PIXELS = 96
_PROFILE_PIXELS = 1000
_PROFILE_PATHS = 512
_LAYOUT = 4
_VIEW_RANK, _VIEW_TINTS = 200, 176
# Between texels that count alike and texels that count by their light: best in real places.
_VIEW_EVENNESS = 0.3
# A path through the skin takes about as long as this many shadow rays; for the time left only.
_RAYS_IN_PATH = 50


class _How(TypedDict):
    """How to bake.

    Attributes:
        environment: Rows and columns (H, W) of the environment, W = 2 H.
        picture: Pixels along one side of the picture.
    """

    environment: tuple[int, int]
    picture: int
    quality: Quality
    seed: int
    work: Path
    report: Report
    token: Token
    yaws: NotRequired[Sequence[float]]


@dataclass(frozen=True, slots=True)
class Quality:
    """How carefully to bake.

    Attributes:
        paths: Random walks from each pixel.
        glints: Points in each pixel at which the surface's own reflection is taken.
    """

    paths: int
    glints: int
    shadows: int
    rank: int


QUALITIES: dict[str, Quality] = {
    "draft": Quality(paths=512, glints=16, shadows=2, rank=192),
    "quick": Quality(paths=4096, glints=64, shadows=3, rank=256),
    "good": Quality(paths=16384, glints=256, shadows=4, rank=336),
    "best": Quality(paths=65536, glints=512, shadows=6, rank=400),
}


@dataclass(frozen=True, slots=True)
class BakedView:
    """A head as a camera sees it that stands at its side.

    Attributes:
        pixels, coverage: (P,) int32, float32. As those of a transport.
        positions: (P, 3) float32. Where each pixel looks, as in `HeadShape`.
        matrix: (P, H * W, 3) float32. The transport, whole.
        targets: (S, P, 3) float32. As those of `BakeResult`.
    """

    yaw_deg: float
    pixels: NDArray[np.int32]
    coverage: Float32
    positions: Float32
    matrix: Float32
    targets: Float32


@dataclass(frozen=True, slots=True)
class BakeResult:
    """What a bake gives.

    Attributes:
        targets: (S, P, 3) float32. Linear pictures of the styles under their own lamps, on the
            transport's pixels.
        shape: Where each of those pixels looks.
        views: The head turned toward its own left, by each of the yaws that were asked for.
    """

    transport: Transport
    targets: Float32
    shape: HeadShape
    views: tuple[BakedView, ...] = ()


@dataclass(frozen=True, slots=True)
class _BakeJob:
    """Everything that stays the same from part to part."""

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
        """The columns of the matrix: texels first, then lamps."""
        return (self.texels,) if self.lamps is None else (self.texels, self.lamps)

    @property
    def shadows(self) -> tuple[int, ...]:
        """Shadow rays along each side of a column, for texels and lamps."""
        # A lamp is one column among thousands of texels: it can have many more rays.
        return (self.quality.shadows, 4 * self.quality.shadows)[: len(self.columns)]

    @property
    def shadow_rays(self) -> tuple[int, ...]:
        """Shadow rays from each point to all texels, and to all lamps."""
        both = zip(self.columns, self.shadows, strict=True)
        return tuple(columns.count * side**2 for columns, side in both)

    @property
    def count(self) -> int:
        """Number of all columns."""
        return sum(columns.count for columns in self.columns)


@dataclass(frozen=True, slots=True)
class _SkinLight:
    """What reaches the skin, and how the skin takes it.

    Attributes:
        entering: three (V, columns) float32. Light that enters the skin at each point from each
            column, for each channel.
        slant: (3, 3, columns) float32. What the lean of a pixel's share counts: [channel, axis].
    """

    entering: tuple[Float32, ...]
    slant: Float32


@dataclass(frozen=True, slots=True)
class _Progress:
    """Where the parts of a bake report to, and ask whether to continue."""

    report: Report
    token: Token

    def part(self, start: float, stop: float, task: Task) -> Watch:
        """Watch of a part that takes progress from `start` to `stop`."""

        def watch(share: float) -> None:
            self.report(share, Progress(task))
            self.token.check()

        return part_of(watch, start, stop)


@dataclass(frozen=True, slots=True)
class _BakeSetup:
    """A bake whose light is measured, whichever way a camera looks at it."""

    head: HeadMesh
    skin: Skin
    styles: Sequence[Style]
    camera: Camera
    skin_cover: Float32
    job: _BakeJob
    light: _SkinLight
    cache: BakeCache
    progress: _Progress
    measured: float


def bake(head: HeadMesh, skin: Skin, styles: Sequence[Style], **how: Unpack[_How]) -> BakeResult:
    """Compute the transport of a head and the studio pictures of the styles.

    What lights each point of the skin is measured once, whichever way the camera looks at it; each
    of the `yaws` then costs the walk from its own pixels.

    Raises `BakeError` if Mitsuba cannot build the scene; `Cancelled` if the token says so.
    """
    setup = _begin(head, skin, styles, how)
    job, light, yaws = setup.job, setup.light, how.get("yaws", ())
    first = setup.measured + (0.95 - setup.measured) / (1 + len(yaws))
    part = setup.measured, first
    matrix = _matrix(job, light, setup.cache.keep, setup.progress, part)
    transport = _finish(head, skin, setup.camera, setup.skin_cover, job, matrix)
    targets = _targets(styles, matrix[:, job.texels.count :])
    shape = look_at_shape(head, job.scene, job.pixels, job.picture)
    views = tuple(_views(setup, yaws, first))
    setup.cache.clear()
    return BakeResult(transport, targets, shape, views)


def bake_views(
    head: HeadMesh, skin: Skin, styles: Sequence[Style], **how: Unpack[_How]
) -> Iterator[BakedView]:
    """Compute only the views of a head whose transport is baked already; as `bake`."""
    setup = _begin(head, skin, styles, how)
    yield from _views(setup, how.get("yaws", ()), setup.measured)
    setup.cache.clear()


def _begin(head: HeadMesh, skin: Skin, styles: Sequence[Style], how: _How) -> _BakeSetup:
    """Place the points of the skin, and measure the light that reaches them."""
    picture, quality, seed = how["picture"], how["quality"], how["seed"]
    lamps = [lamp for style in styles for lamp in style.lamps]
    camera = frame_head(head, picture)
    key = _key(head, skin, camera, how["environment"], quality, seed, lamps)
    cache = BakeCache(how["work"] / key)
    progress = _Progress(how["report"], how["token"])
    scene = build_scene(head, skin, camera)
    looking = progress.part(0.0, 0.01, Task.VIEWING_HEAD)
    skin_cover = head_coverage(scene, picture, part_of(looking, 0.0, 0.5))
    points = place_points(
        scene,
        head,
        seed,
        keep=_light_cache(cache, "sky"),
        watch=part_of(looking, 0.5, 1.0),
    )
    job = _BakeJob(
        scene=scene,
        tables=scene_tables(scene, head, skin, points, picture),
        points=points,
        picture=picture,
        pixels=np.flatnonzero(skin_cover > 0).astype(np.int32),
        texels=TexelColumns(*how["environment"]),
        lamps=LampColumns(lamps, head.eye_point) if lamps else None,
        quality=quality,
        seed=seed,
    )
    middle = 0.02 + 0.93 * _light_share(job, 1 + len(how.get("yaws", ())))
    light = _measured(job, cache, progress, middle)
    return _BakeSetup(head, skin, styles, camera, skin_cover, job, light, cache, progress, middle)


def _views(setup: _BakeSetup, yaws: Sequence[float], start: float) -> Iterator[BakedView]:
    """Walk from the pixels of cameras at the head's side."""
    ends = np.linspace(start, 0.95, 1 + len(yaws)).tolist()
    for yaw, part in zip(yaws, pairwise(ends), strict=True):
        job, skin_cover, places = _turn_job(setup.job, setup.head, setup.skin, yaw)
        keep = setup.cache.prefixed(f"yaw{yaw:g}")
        matrix = _matrix(job, setup.light, keep, setup.progress, part)
        texels, studio = np.split(matrix, [job.texels.count], axis=1)
        view = yaw, job.pixels, skin_cover, places, texels, _targets(setup.styles, studio)
        yield BakedView(*view)


def packed_views(
    views: Sequence[BakedView], transport: Transport
) -> tuple[Float32, dict[float, dict[str, NDArray[Any]]]]:
    """Functions of texels for all views of a head, and the views by yaw, as they are stored.

    Args:
        transport: Of the same head.
    """
    weights = np.asarray(transport.header.luminance_weights, np.float32)
    greys = [view.matrix @ weights for view in views]
    texels = TexelColumns(*transport.environment_shape)
    basis, scale = texel_functions(greys, texels, _VIEW_RANK, _VIEW_EVENNESS)
    parts = {}
    for view, grey in zip(views, greys, strict=True):
        tints = (view.matrix[:, :, channel] - grey for channel in (0, 2))
        parts[view.yaw_deg] = pack_view(
            grey=np.asarray(grey / scale @ basis.T, np.float32),
            tints=np.stack(
                [tint / scale @ basis[:_VIEW_TINTS].T for tint in tints], dtype=np.float32
            ),
            pixels=view.pixels,
            coverage=view.coverage,
            positions=view.positions,
            targets=view.targets @ weights,
            size=transport.size,
        )
    return basis * scale, parts


def _turn_job(
    job: _BakeJob, head: HeadMesh, skin: Skin, yaw: float
) -> tuple[_BakeJob, Float32, Float32]:
    """The job of a camera at the head's side; coverage, (P,), and positions, (P, 3), there."""
    scene = build_scene(head, skin, frame_head(head, job.picture, yaw))
    skin_cover, places = look_from(head, scene, job.picture)
    pixels = np.flatnonzero(skin_cover > 0).astype(np.int32)
    tables = scene_tables(scene, head, skin, job.points, job.picture)
    job_aside = replace(job, scene=scene, tables=tables, pixels=pixels)
    return job_aside, skin_cover[pixels], places[pixels]


def _light_cache(cache: BakeCache, prefix: str) -> Keep:
    """Where measured light goes: it takes room, and a wavefront finds it again in no time."""
    import mitsuba as mi

    return no_keep if is_wavefront(mi) else cache.prefixed(prefix)


def _measured(job: _BakeJob, cache: BakeCache, progress: _Progress, end: float) -> _SkinLight:
    """Measure how the skin takes light, and the light that reaches its points."""
    measuring = Task.MEASURING_SKIN
    profile = measure_profile(
        job.tables, job.pixels, job.seed, cache.keep, progress.part(0.01, 0.02, measuring)
    )
    return _light(job, profile, cache, progress.part(0.02, end, measuring))


def _matrix(
    job: _BakeJob, light: _SkinLight, keep: Keep, progress: _Progress, part: tuple[float, float]
) -> Float32:
    """Rows of the transport for all pixels, (P, columns, 3)."""
    matrix = np.empty((len(job.pixels), job.count, 3), np.float32)
    following = progress.part(*part, Task.FOLLOWING_LIGHT)
    for start, stop in _batches(len(matrix), job.quality.paths):
        watch = part_of(following, start / len(matrix), stop / len(matrix))
        watch(0.0)

        def batch(start: int = start, stop: int = stop, watch: Watch = watch) -> Float32:
            return _batch(job, light, start, stop, watch)

        matrix[start:stop] = keep(str(start), (stop - start, *matrix.shape[1:]), batch)
    return matrix


def _light_share(job: _BakeJob, views: int) -> float:
    """About which share of the work it is to measure the light, for the time left."""
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
    """Exit profile of the skin as fitted, (3, MOMENTS), from a few paths of some pixels."""
    some = pixels[:: max(1, len(pixels) // _PROFILE_PIXELS)]

    def trace() -> Float32:
        total = np.zeros((PROFILE_BINS, 3))
        for start in range(0, len(some), _BATCH_PIXELS):
            part = some[start : start + _BATCH_PIXELS]
            watching = part_of(watch, start / len(some), (start + len(part)) / len(some))
            total += trace_profile(tables, part, _PROFILE_PATHS, seed + 999 + start, watching)
        return total.astype(np.float32)

    return fit_profile(keep("profile", (PROFILE_BINS, 3), trace).astype(np.float64))


def _light(job: _BakeJob, profile: Float64, cache: BakeCache, watch: Watch) -> _SkinLight:
    """Measure the light of all columns at all points."""
    parts, weights = [], profile.astype(np.float32)
    ends = np.cumsum([0, *job.shadow_rays]) / sum(job.shadow_rays)
    for number, columns in enumerate(job.columns):
        moments = expose(
            job.scene,
            job.points,
            columns,
            job.shadows[number],
            job.seed + number,
            keep=_light_cache(cache, f"light{number}"),
            watch=part_of(watch, ends[number], ends[number + 1]),
        )
        parts.append([sum(a * one for a, one in zip(row, moments, strict=True)) for row in weights])
    directions = np.concatenate([columns.directions() for columns in job.columns])
    return _SkinLight(
        entering=tuple(np.concatenate(channel, axis=1) for channel in zip(*parts, strict=True)),
        slant=lean_scale(profile).astype(np.float32)[:, None, None] * directions.T,
    )


def _batches(pixels: int, paths: int) -> Iterator[tuple[int, int]]:
    step = max(1, min(_BATCH_PIXELS, at_once(_BATCH_PATHS) // paths))
    for start in range(0, pixels, step):
        yield start, min(start + step, pixels)


def _batch(job: _BakeJob, light: _SkinLight, start: int, stop: int, watch: Watch) -> Float32:
    """Rows of the transport for some pixels, (n, columns, 3)."""
    pixels, seed = job.pixels[start:stop], job.seed * 1_000_003 + start
    first, last = part_of(watch, 0.0, 0.5), part_of(watch, 0.5, 1.0)
    totals = trace_pixels(job.tables, pixels, job.quality.paths, seed, first)
    texels_hit = np.flatnonzero(totals.share.any(axis=(0, 2)))
    share, lean = totals.share[:, texels_hit], totals.lean[:, texels_hit]
    glints = job.quality.glints
    matrix = np.concatenate(
        [
            shine(job.scene, job.picture, pixels, columns, glints, seed, last)
            for columns in job.columns
        ],
        axis=1,
    )
    for channel, everywhere in enumerate(light.entering):
        entering = everywhere[texels_hit]
        matrix[:, :, channel] += share[:, :, channel] @ entering
        for axis, slant in enumerate(light.slant[channel]):
            matrix[:, :, channel] += (lean[:, :, axis, channel] @ entering) * slant
    return matrix


def _key(
    head: HeadMesh,
    skin: Skin,
    camera: Camera,
    environment: tuple[int, int],
    quality: Quality,
    seed: int,
    lamps: Sequence[Any],
) -> str:
    """Name of the folder of batches that belong to exactly these settings."""
    facts = [asdict(item) for item in (skin, camera, quality, *lamps)]
    total = hashlib.sha256(json.dumps([_LAYOUT, environment, seed, facts]).encode())
    for mesh in (head.skin, head.eyes):
        if mesh is not None:
            total.update(mesh.vertices.tobytes() + mesh.faces.tobytes() + mesh.normals.tobytes())
            total.update(b"" if mesh.colours is None else mesh.colours.tobytes())
    return total.hexdigest()[:16]


def _finish(
    head: HeadMesh, skin: Skin, camera: Camera, skin_cover: Float32, job: _BakeJob, matrix: Float32
) -> Transport:
    """Symmetrise, compress and describe the columns of the texels."""
    coverage, full, noise = skin_cover[job.pixels], matrix[:, : job.texels.count], float("nan")
    if head.symmetric:
        twin = mirror_pixels(job.pixels, camera.size)
        full, noise = symmetrise(full, twin, job.texels)
        coverage = np.float32(0.5) * (coverage + coverage[twin])
    pixel_basis, texel_basis, truncation = compress(full, job.texels, job.quality.rank)
    header = TransportHeader(
        head=head.name,
        skin=skin.name,
        environment=(job.texels.height, job.texels.width),
        picture=camera.size,
        rank=len(texel_basis),
        fov_deg=camera.fov_deg,
        distance_m=CAMERA_DISTANCE_M,
        paths_per_pixel=job.quality.paths,
        seed=job.seed,
        noise=noise,
        truncation=truncation,
        symmetric=head.symmetric,
    )
    return Transport(header, job.pixels, coverage, pixel_basis, texel_basis)


def _targets(styles: Sequence[Style], pictures: Float32) -> Float32:
    """Pictures of the styles, (S, P, 3), from those of all their lamps, (P, lamps, 3)."""
    targets = np.empty((len(styles), len(pictures), 3), np.float32)
    end = 0
    for target, style in zip(targets, styles, strict=True):
        begin, end = end, end + len(style.lamps)
        pictures[:, begin:end].sum(axis=1, out=target)
    return targets
