"""Bake the transport of a head, in batches of pixels and for all columns at once.

The transport T is the sum of two parts. The reflection from the surface is integrated for each
pixel (`exposure.shine`). The light from inside the skin is the product of two matrices: the
fraction of the light entering at each point on the skin that reaches each pixel (`random_walk`),
and the light that enters at that point from each column (`skin_light`). Lamps are additional
columns, which produce the studio pictures of the styles.
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

from app.core.baking.bake_cache import BakeCache, Keep
from app.core.baking.baked_view import BakedView
from app.core.baking.exposure import (
    head_coverage,
    look_at_shape,
    look_from,
    place_points,
    shine,
)
from app.core.baking.kernel_lanes import Watch, at_once, part_of
from app.core.baking.light_sources import (
    LampColumns,
    TexelColumns,
    compress,
    mirror_pixels,
    symmetrise,
)
from app.core.baking.quality import Quality
from app.core.baking.random_walk import (
    scene_tables,
    trace_pixels,
)
from app.core.baking.scene import CAMERA_DISTANCE_M, Camera, HeadMesh, build_scene, frame_head
from app.core.baking.skin import Skin
from app.core.baking.skin_light import (
    BATCH_PIXELS,
    BakeJob,
    PartProgress,
    SkinLight,
    light_cache,
    light_share,
    skin_light,
)
from app.core.base.arrays import Float32
from app.core.base.progress import Report, Task, Token
from app.core.solver.head_shape import HeadShape
from app.core.solver.transport import Transport, TransportHeader
from app.core.styles.style import Style

_BATCH_PATHS = 1 << 22
_LAYOUT = 4


class _How(TypedDict):
    """Settings of a bake.

    Attributes:
        environment: Rows and columns (H, W) of the environment, with W = 2 H.
        picture: Side of the square picture, in pixels.
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
class BakeResult:
    """A baked head.

    Attributes:
        targets: (S, P, 3) float32. Linear picture of the head as lit by each style's own lamps, at
            the transport's pixels.
        shape: Position on the head at each of those pixels.
        views: Views of the head, one for each requested yaw. The head is turned towards its own
            left.
    """

    transport: Transport
    targets: Float32
    shape: HeadShape
    views: tuple[BakedView, ...] = ()


@dataclass(frozen=True, slots=True)
class _BakeSetup:
    """A bake whose light has been measured and which is ready for cameras in any direction."""

    head: HeadMesh
    skin: Skin
    styles: Sequence[Style]
    camera: Camera
    skin_cover: Float32
    job: BakeJob
    light: SkinLight
    cache: BakeCache
    progress: PartProgress
    measured: float


def bake(head: HeadMesh, skin: Skin, styles: Sequence[Style], **how: Unpack[_How]) -> BakeResult:
    """Compute the transport of a head and the studio pictures of the styles.

    The light that enters the skin is measured once for all cameras. Each of the `yaws` then adds
    the random walks from its own pixels.

    Raises:
        BakeError: If Mitsuba cannot build the scene.
        Cancelled: If the token is cancelled.
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
    """Compute only the views of a head, with the same arguments and errors as `bake`."""
    setup = _begin(head, skin, styles, how)
    yield from _views(setup, how.get("yaws", ()), setup.measured)
    setup.cache.clear()


def _begin(head: HeadMesh, skin: Skin, styles: Sequence[Style], how: _How) -> _BakeSetup:
    """Place points on the skin and measure the light that enters at each of them."""
    picture, quality, seed = how["picture"], how["quality"], how["seed"]
    lamps = [lamp for style in styles for lamp in style.lamps]
    camera = frame_head(head, picture)
    key = _key(head, skin, camera, how["environment"], quality, seed, lamps)
    cache = BakeCache(how["work"] / key)
    progress = PartProgress(how["report"], how["token"])
    scene = build_scene(head, skin, camera)
    looking = progress.part(0.0, 0.01, Task.VIEWING_HEAD)
    skin_cover = head_coverage(scene, picture, part_of(looking, 0.0, 0.5))
    points = place_points(
        scene,
        head,
        seed,
        keep=light_cache(cache, "sky"),
        watch=part_of(looking, 0.5, 1.0),
    )
    job = BakeJob(
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
    middle = 0.02 + 0.93 * light_share(job, 1 + len(how.get("yaws", ())))
    light = skin_light(job, cache, progress, middle)
    return _BakeSetup(head, skin, styles, camera, skin_cover, job, light, cache, progress, middle)


def _views(setup: _BakeSetup, yaws: Sequence[float], start: float) -> Iterator[BakedView]:
    """Yield the views as seen by cameras at the side of the head."""
    ends = np.linspace(start, 0.95, 1 + len(yaws)).tolist()
    for yaw, part in zip(yaws, pairwise(ends), strict=True):
        job, skin_cover, places = _turn_job(setup.job, setup.head, setup.skin, yaw)
        keep = setup.cache.prefixed(f"yaw{yaw:g}")
        matrix = _matrix(job, setup.light, keep, setup.progress, part)
        texels, studio = np.split(matrix, [job.texels.count], axis=1)
        view = yaw, job.pixels, skin_cover, places, texels, _targets(setup.styles, studio)
        yield BakedView(*view)


def _turn_job(
    job: BakeJob, head: HeadMesh, skin: Skin, yaw: float
) -> tuple[BakeJob, Float32, Float32]:
    """Prepare a bake for a camera at the side of the head.

    Returns:
        The job, and the coverage, (P,), and position on the head, (P, 3), of each pixel.
    """
    scene = build_scene(head, skin, frame_head(head, job.picture, yaw))
    skin_cover, places = look_from(head, scene, job.picture)
    pixels = np.flatnonzero(skin_cover > 0).astype(np.int32)
    tables = scene_tables(scene, head, skin, job.points, job.picture)
    job_aside = replace(job, scene=scene, tables=tables, pixels=pixels)
    return job_aside, skin_cover[pixels], places[pixels]


def _matrix(
    job: BakeJob, light: SkinLight, keep: Keep, progress: PartProgress, part: tuple[float, float]
) -> Float32:
    """Compute the transport for all pixels, (P, columns, 3)."""
    matrix = np.empty((len(job.pixels), job.count, 3), np.float32)
    following = progress.part(*part, Task.FOLLOWING_LIGHT)
    for start, stop in _batches(len(matrix), job.quality.paths):
        watch = part_of(following, start / len(matrix), stop / len(matrix))
        watch(0.0)

        def batch(start: int = start, stop: int = stop, watch: Watch = watch) -> Float32:
            return _batch(job, light, start, stop, watch)

        matrix[start:stop] = keep(str(start), (stop - start, *matrix.shape[1:]), batch)
    return matrix


def _batches(pixels: int, paths: int) -> Iterator[tuple[int, int]]:
    step = max(1, min(BATCH_PIXELS, at_once(_BATCH_PATHS) // paths))
    for start in range(0, pixels, step):
        yield start, min(start + step, pixels)


def _batch(job: BakeJob, light: SkinLight, start: int, stop: int, watch: Watch) -> Float32:
    """Compute the transport for one batch of pixels, (n, columns, 3)."""
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
    """Return the name of the cache folder that belongs to exactly these settings."""
    facts = [asdict(item) for item in (skin, camera, quality, *lamps)]
    total = hashlib.sha256(json.dumps([_LAYOUT, environment, seed, facts]).encode())
    for mesh in (head.skin, head.eyes):
        if mesh is not None:
            total.update(mesh.vertices.tobytes() + mesh.faces.tobytes() + mesh.normals.tobytes())
            total.update(b"" if mesh.colours is None else mesh.colours.tobytes())
    return total.hexdigest()[:16]


def _finish(
    head: HeadMesh, skin: Skin, camera: Camera, skin_cover: Float32, job: BakeJob, matrix: Float32
) -> Transport:
    """Make the transport symmetric if the head is symmetric, then compress it."""
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
    """Sum the pictures of the lamps, (P, lamps, 3), to form those of the styles, (S, P, 3)."""
    targets = np.empty((len(styles), len(pictures), 3), np.float32)
    end = 0
    for target, style in zip(targets, styles, strict=True):
        begin, end = end, end + len(style.lamps)
        pictures[:, begin:end].sum(axis=1, out=target)
    return targets
