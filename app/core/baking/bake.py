"""Baking the transport of a head: all columns at once, batch by batch of pixels.

T is the sum of two parts. The first surface's own reflection is integrated for each pixel
(`exposure.shine`). What comes out of the skin is a product: the share of its light that each pixel
takes from each point of the skin (`walk`), times the light that the point gets from each column
(`exposure.expose`). The studio pictures of the styles come out of the same product, with lamps as
further columns.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import zipfile
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from app.core.baking.columns import Columns, LampColumns, TexelColumns
from app.core.baking.exposure import MOMENTS, expose, shine
from app.core.baking.points import Points, place_points
from app.core.baking.reduction import compress, mirror_pixels, symmetrise
from app.core.baking.scene import CAMERA_DISTANCE_M, Camera, HeadMesh, build_scene, frame_head
from app.core.baking.walk import (
    PROFILE_BINS,
    SceneTables,
    fit_profile,
    lean_scale,
    scene_tables,
    trace_pixels,
)
from app.core.files import atomic_write
from app.core.transport import Transport, TransportHeader

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from app.core.baking.skin import Skin
    from app.core.progress import Report, Token
    from app.core.styles import Style

__all__ = ["QUALITIES", "Baked", "Quality", "bake"]

Float32 = NDArray[np.float32]
_BATCH_PATHS = 1 << 22
_BATCH_PIXELS = 96
_PROFILE_PATHS = 512
_COVER_STEPS = 16
_LAYOUT = 4


@dataclass(frozen=True, slots=True)
class Quality:
    """How carefully to bake.

    Attributes
    ----------
    paths : int
        Random walks from each pixel.
    glints : int
        Points in each pixel at which the surface's own reflection is taken.
    shadows : int
        Shadow rays along each side of a texel, for every point of the skin.
    rank : int
        Number of basis pictures that are kept.
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
class Baked:
    """What a bake gives.

    Attributes
    ----------
    transport : Transport
    targets : (S, P, 3) float32
        Linear pictures of the styles under their own lamps, on the transport's pixels.
    """

    transport: Transport
    targets: Float32


@dataclass(frozen=True, slots=True)
class _Job:
    """Everything that stays the same from batch to batch."""

    scene: Any
    tables: SceneTables
    points: Points
    camera: Camera
    columns: tuple[Columns, ...]
    light: tuple[Float32, Float32, Float32]
    lean_scale: NDArray[np.float64]
    quality: Quality
    seed: int


def bake(
    head: HeadMesh,
    skin: Skin,
    styles: Sequence[Style],
    *,
    environment: tuple[int, int],
    picture: int,
    quality: Quality,
    seed: int,
    work: Path,
    report: Report,
    token: Token,
) -> Baked:
    """Compute the transport of a head and the studio pictures of the styles.

    Parameters
    ----------
    head : HeadMesh
    skin : Skin
    styles : sequence of Style
    environment : tuple of int
        Rows and columns (H, W) of the environment, W = 2 H.
    picture : int
        Pixels along one side of the picture.
    quality : Quality
    seed : int
    work : Path
        Folder for finished batches; a bake that was stopped goes on from there.
    report, token
        Progress and cancellation.

    Returns
    -------
    Baked

    Raises
    ------
    BakeError
        If Mitsuba cannot build the scene.
    Cancelled
        If `token` says so.
    """
    camera = frame_head(head, picture)
    scene = build_scene(head, skin, camera)
    report(0.0, "Looking at the head")
    covered = _coverage(scene, camera)
    pixels = np.flatnonzero(covered > 0).astype(np.int32)
    points = place_points(scene, head, seed)
    tables = scene_tables(scene, head, skin, points, picture)
    lamps = [lamp for style in styles for lamp in style.lamps]
    texels = TexelColumns(*environment)
    columns: tuple[Columns, ...] = (texels,)
    if lamps:
        columns = (texels, LampColumns(lamps, head.eye_point))
    report(0.01, "Measuring where light reaches the skin")
    some = pixels[:: max(1, len(pixels) // 1000)]
    profile = fit_profile(_look(tables, some, seed))
    light = _light(scene, points, columns, profile, quality, seed, token)
    scale = lean_scale(profile)
    job = _Job(scene, tables, points, camera, columns, light, scale, quality, seed)
    folder = work / _key(head, skin, camera, environment, quality, seed, lamps)
    matrix = np.empty((len(pixels), texels.count + len(lamps), 3), np.float32)
    for start, stop in _batches(len(pixels), quality.paths):
        report(0.1 + 0.85 * start / len(pixels), "Following light through the skin")
        token.check()
        matrix[start:stop] = _resumable(job, pixels[start:stop], folder / f"{start}.npz", start)
    report(0.95, "Compressing")
    baked = _finish(head, skin, styles, camera, covered, pixels, matrix, texels, quality, seed)
    _tidy(folder)
    return baked


def _coverage(scene: Any, camera: Camera) -> Float32:
    """Share of each pixel that the head covers, (N * N,), on a symmetric grid of rays."""
    import drjit as dr
    import mitsuba as mi

    side = camera.size * _COVER_STEPS
    index = dr.arange(mi.UInt32, side * side)
    film = mi.Point2f((mi.Float(index % side) + 0.5) / side, (mi.Float(index // side) + 0.5) / side)
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    hit = np.array(scene.ray_test(ray)).reshape(camera.size, _COVER_STEPS, camera.size, -1)
    covered: Float32 = hit.mean(axis=(1, 3), dtype=np.float32).ravel()
    return covered


def _look(tables: SceneTables, pixels: NDArray[np.int32], seed: int) -> NDArray[np.float64]:
    """Exit profile of the skin, from a few paths of some pixels."""
    total = np.zeros((PROFILE_BINS, 3))
    for start in range(0, len(pixels), _BATCH_PIXELS):
        part = pixels[start : start + _BATCH_PIXELS]
        total += trace_pixels(tables, part, _PROFILE_PATHS, seed + 999 + start).profile
    return total


def _light(
    scene: Any,
    points: Points,
    columns: Sequence[Columns],
    profile: NDArray[np.float64],
    quality: Quality,
    seed: int,
    token: Token,
) -> tuple[Float32, Float32, Float32]:
    """Light that enters the skin at each point from each column, (V, columns) per channel."""
    parts = []
    for number, column in enumerate(columns):
        token.check()
        # A lamp is one column among thousands of texels: it can have many more rays.
        samples = quality.shadows if number == 0 else 4 * quality.shadows
        moments = expose(scene, points, column, samples, seed + number)
        weights = profile.astype(np.float32)
        parts.append([sum(weights[c, m] * moments[m] for m in range(MOMENTS)) for c in range(3)])
    r, g, b = (np.concatenate([part[c] for part in parts], axis=1) for c in range(3))
    return r, g, b


def _batches(pixels: int, paths: int) -> Iterator[tuple[int, int]]:
    step = max(1, min(_BATCH_PIXELS, _BATCH_PATHS // paths))
    for start in range(0, pixels, step):
        yield start, min(start + step, pixels)


def _resumable(job: _Job, pixels: NDArray[np.int32], file: Path, start: int) -> Float32:
    try:
        with np.load(file, allow_pickle=False) as stored:
            done: Float32 = stored["matrix"]
        if done.shape == (len(pixels), sum(c.count for c in job.columns), 3):
            return done
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        pass
    matrix = _batch(job, pixels, start)
    file.parent.mkdir(parents=True, exist_ok=True)

    def write(target: Path) -> None:
        with target.open("wb") as stream:
            np.savez(stream, allow_pickle=False, matrix=matrix)

    atomic_write(file, write)
    return matrix


def _batch(job: _Job, pixels: NDArray[np.int32], start: int) -> Float32:
    """Rows of the transport for some pixels, (n, columns, 3)."""
    gathered = trace_pixels(job.tables, pixels, job.quality.paths, job.seed * 1_000_003 + start)
    used = np.flatnonzero(gathered.share.any(axis=(0, 2)))
    share = gathered.share[:, used]
    matrix = np.concatenate(
        [
            shine(
                job.scene,
                job.tables.sensor,
                job.camera.size,
                pixels,
                column,
                job.quality.glints,
                job.seed * 1_000_003 + start,
            )
            for column in job.columns
        ],
        axis=1,
    )
    directions = np.concatenate([column.directions() for column in job.columns])
    lean = gathered.lean[:, used]
    for channel in range(3):
        light = job.light[channel][used]
        matrix[:, :, channel] += share[:, :, channel] @ light
        for axis in range(3):
            slant = directions[:, axis] * np.float32(job.lean_scale[channel])
            matrix[:, :, channel] += (lean[:, :, axis, channel] @ light) * slant
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
    head: HeadMesh,
    skin: Skin,
    styles: Sequence[Style],
    camera: Camera,
    covered: Float32,
    pixels: NDArray[np.int32],
    matrix: Float32,
    texels: TexelColumns,
    quality: Quality,
    seed: int,
) -> Baked:
    coverage, pictures, full = covered[pixels], matrix[:, texels.count :], matrix[:, : texels.count]
    noise = float("nan")
    if head.symmetric:
        twin = mirror_pixels(pixels, camera.size)
        full, noise = symmetrise(full, twin, texels)
        coverage = np.float32(0.5) * (coverage + coverage[twin])
    pixel_basis, texel_basis, truncation = compress(full, texels, quality.rank)
    header = TransportHeader(
        head=head.name,
        skin=skin.name,
        environment=(texels.height, texels.width),
        picture=camera.size,
        rank=len(texel_basis),
        fov_deg=camera.fov_deg,
        distance_m=CAMERA_DISTANCE_M,
        paths_per_pixel=quality.paths,
        seed=seed,
        noise=noise,
        truncation=truncation,
        symmetric=head.symmetric,
    )
    transport = Transport(header, pixels, coverage, pixel_basis, texel_basis)
    targets = _targets(styles, pictures) if styles else np.empty((0, len(pixels), 3), np.float32)
    return Baked(transport, targets)


def _targets(styles: Sequence[Style], pictures: Float32) -> Float32:
    ends = np.cumsum([0, *(len(style.lamps) for style in styles)])
    spans = itertools.pairwise(ends)
    return np.stack([pictures[:, begin:end].sum(axis=1) for begin, end in spans])


def _tidy(folder: Path) -> None:
    for file in folder.glob("*.npz"):
        file.unlink(missing_ok=True)
    for path in (folder, folder.parent):
        try:
            path.rmdir()
        except OSError:
            return
