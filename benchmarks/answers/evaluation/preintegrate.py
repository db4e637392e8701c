"""Pre-integrated targets F for large sizes, without ever forming the transport.

F = f'T (eq. 3) does not need T: with T = S E, light on the points of the skin (E) and each pixel's
share of it (S), F is (f'S) E. f'S has one row for each target, so 200 x 200 pixels and 128 x 64
texels need no more memory than 100 x 100 and 64 x 32. Far fewer paths are enough, too: a target
sums thousands of pixels, so F has little noise even if every pixel of T has much. For the same
reason f'S uses only one random pixel of each small block.

Targets come from separate paths. With the same paths, their noise would be correlated with that of
T, and F would favour the target's own lamps more, the noisier it is.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.baking.exposure import Points, expose, head_coverage, place_points, shine
from app.core.baking.kernel_lanes import Watch, part_of
from app.core.baking.light_sources import LampColumns, TexelColumns, mirror_pixels
from app.core.baking.random_walk import lean_scale, scene_tables, trace_pixels
from app.core.baking.scene import HeadMesh, build_scene, frame_head
from app.core.baking.skin_light import measure_profile
from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.base.errors import BakeError
from app.core.solver.transport import FACE_COVERAGE
from app.core.solver.weights import target_weights
from app.core.styles.lamps import mirror_index

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from app.core.baking.light_sources import Columns
    from app.core.baking.random_walk import SceneTables
    from app.core.baking.skin import Skin
    from app.core.base.progress import PhraseReport, Token
    from app.core.styles.style import Style

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_BATCH_PIXELS = 96
_LAMP_RAYS = 6
_LAMP_GLINTS = 16
_CHUNK_PAIRS = 1 << 22
_MESSAGE = "Pre-integrating styles"


@dataclass(frozen=True, slots=True)
class Effort:
    """Precision of the pre-integration.

    Attributes:
        target_paths, paths: Random walks from each pixel, for the studio pictures and for the light
            of F.
        glints: Points in each pixel that sample the surface's own reflection of the texels.
        block: F uses one pixel of each block of this side.
    """

    target_paths: int = 128
    paths: int = 512
    glints: int = 2
    shadows: int = 1
    block: int = 2


@dataclass(frozen=True, slots=True)
class Preintegrated:
    """Pre-integrated targets of one head.

    Attributes:
        rows: (Z, S, H, W) float32. F of eq. 3 for Z picture sizes and S styles, panorama
            coordinates at turn 0, for luminance.
        noise: RMS noise over RMS of F, the largest of all; from the two mirrored halves. NaN for a
            head that is not symmetric.
    """

    rows: Float32
    noise: float


@dataclass(frozen=True, slots=True)
class _Job:
    scene: Any
    tables: SceneTables
    points: Points
    profile: Float64
    pixels: NDArray[np.int32]
    coverage: Float32
    picture: int
    effort: Effort
    seed: int


def preintegrate_styles(
    head: HeadMesh,
    skin: Skin,
    styles: Sequence[Style],
    *,
    environment: tuple[int, int],
    pictures: Sequence[int],
    effort: Effort,
    seed: int,
    report: PhraseReport,
    token: Token,
) -> Preintegrated:
    """Compute F of every style for several sizes of the picture.

    Args:
        environment: Rows and columns (H, W) of the environment, W = 2 H.
        pictures: Pixels along one side. The largest is rendered; its blocks of pixels make the
            others, both for targets and for T.

    Raises:
        BakeError: If Mitsuba cannot build the scene.
        Cancelled: If the token was cancelled.
    """

    def watch(share: float) -> None:
        report(share, _MESSAGE)
        token.check()

    job = _prepare(head, skin, max(pictures), effort, seed, part_of(watch, 0.0, 0.2))
    targets = _studio_pictures(job, head, styles, part_of(watch, 0.2, 0.45))
    weights = np.concatenate([_weights(job, targets, size) for size in pictures])
    texels = TexelColumns(*environment)
    flat = _integrate(job, weights, texels, part_of(watch, 0.45, 1.0))
    rows = flat.reshape(len(pictures), len(styles), *environment)
    rows, noise = _mirror_rows(styles, rows) if head.symmetric else (rows, float("nan"))
    return Preintegrated(rows.astype(np.float32), noise)


def _prepare(
    head: HeadMesh, skin: Skin, picture: int, effort: Effort, seed: int, watch: Watch
) -> _Job:
    scene = build_scene(head, skin, frame_head(head, picture))
    covered = head_coverage(scene, picture, part_of(watch, 0.0, 0.2))
    points = place_points(scene, head, seed, watch=part_of(watch, 0.2, 0.7))
    tables = scene_tables(scene, head, skin, points, picture)
    pixels = np.flatnonzero(covered > 0).astype(np.int32)
    profile = measure_profile(tables, pixels, seed, watch=part_of(watch, 0.7, 1.0))
    coverage = covered[pixels]
    if head.symmetric:
        coverage = np.float32(0.5) * (coverage + coverage[mirror_pixels(pixels, picture)])
    return _Job(scene, tables, points, profile, pixels, coverage, picture, effort, seed)


def _studio_pictures(job: _Job, head: HeadMesh, styles: Sequence[Style], watch: Watch) -> Float64:
    """Return the luminance of the styles under their own lamps, (S, P)."""
    lamps = LampColumns([lamp for style in styles for lamp in style.lamps], head.eye_point)
    moments = expose(job.scene, job.points, lamps, _LAMP_RAYS, job.seed + 1)
    straight, aslant = _as_seen(job, moments, lamps)
    # Of a symmetric head, the left half is the right half of the mirrored styles.
    half = job.pixels % job.picture < job.picture // 2
    some = job.pixels[half] if head.symmetric else job.pixels
    pictures = np.zeros((len(some), lamps.count))
    for start, pixels in _batches(some, watch):
        seen = trace_pixels(job.tables, pixels, job.effort.target_paths, _seed(job, 1, start))
        light = seen.share.reshape(len(pixels), -1) @ straight
        light += seen.lean.reshape(len(pixels), -1) @ aslant
        light += _shine(job, pixels, lamps, _LAMP_GLINTS, _seed(job, 2, start))
        pictures[start : start + len(pixels)] = light
    ends = np.cumsum([0, *(len(style.lamps) for style in styles)])
    sums = [pictures[:, a:b].sum(axis=1) for a, b in itertools.pairwise(ends)]
    return _both_halves(job, styles, np.stack(sums), half) if head.symmetric else np.stack(sums)


def _as_seen(job: _Job, moments: Float32, columns: Columns) -> tuple[Float32, Float32]:
    """Weight light on the points by luminance: for shares (V * 3, n), leans (V * 9, n).

    Rows are in the order of `Gathered.share` and `Gathered.lean`: point, then axis, then channel.
    """
    luminance = np.asarray(LUMINANCE_WEIGHTS)
    entering = np.tensordot(job.profile * luminance[:, None], moments, axes=(1, 0))
    slant = lean_scale(job.profile)[:, None, None] * columns.directions().T
    straight = entering.transpose(1, 0, 2).reshape(-1, columns.count)
    aslant = np.einsum("cvn,can->vacn", entering, slant).reshape(-1, columns.count)
    return straight.astype(np.float32), aslant.astype(np.float32)


def _both_halves(
    job: _Job, styles: Sequence[Style], found: Float64, half: NDArray[np.bool_]
) -> Float64:
    """Complete pictures of one side of the sitter with those of the mirrored styles."""
    twin = mirror_pixels(job.pixels, job.picture)
    whole = np.zeros((len(styles), len(job.pixels)))
    whole[:, half] = found
    left = whole.copy()
    for here, style in enumerate(styles):
        there = mirror_index(styles, style)
        if there is None:
            raise BakeError(f"The style {style.name} has no mirrored one, the head is symmetric.")
        whole[here] += np.where(half, 0.0, left[there][twin])
    return whole


def _integrate(job: _Job, weights: Float64, texels: TexelColumns, watch: Watch) -> Float64:
    """Pre-integrate weights (K, P); return (K, H * W)."""
    count, points = len(weights), job.points.count
    share = np.zeros((count, points * 3), np.float32)
    lean = np.zeros((count, points * 9), np.float32)
    total = np.zeros((count, texels.count))
    chosen, scale = _drawn(job)
    for start, pixels in _batches(job.pixels[chosen], part_of(watch, 0.0, 0.6)):
        stop = start + len(pixels)
        some = (weights[:, chosen[start:stop]] * scale[start:stop]).astype(np.float32)
        seen = trace_pixels(job.tables, pixels, job.effort.paths, _seed(job, 3, start))
        share += some @ seen.share.reshape(len(pixels), -1)
        lean += some @ seen.lean.reshape(len(pixels), -1)
        total += some @ _shine(job, pixels, texels, job.effort.glints, _seed(job, 4, start))
    # [channel, m]: contribution of each moment of the light to luminance.
    flat = job.profile * np.asarray(LUMINANCE_WEIGHTS)[:, None]
    slant = flat * lean_scale(job.profile)[:, None]
    straight = np.tensordot(flat, share.reshape(count, points, 3), axes=(0, 2))
    aslant = np.tensordot(slant, lean.reshape(count, points, 3, 3), axes=(0, 3))
    used = np.flatnonzero(straight.any(axis=(0, 1)))
    along = texels.directions().T
    for places, moments in _exposures(job, used, texels, part_of(watch, 0.6, 1.0)):
        for m, moment in enumerate(moments):
            total += straight[m][:, places].astype(np.float32) @ moment
            for axis in range(3):
                lit = aslant[m][:, places, axis].astype(np.float32) @ moment
                total += lit * along[axis]
    return total


def _drawn(job: _Job) -> tuple[NDArray[np.intp], Float64]:
    """Return a random pixel of each block, and the number of head pixels that it represents."""
    row, column = np.divmod(job.pixels, job.picture)
    block = job.effort.block
    number = (row // block) * job.picture + column // block
    order = np.random.default_rng(job.seed).permutation(len(number))
    _, first, counts = np.unique(number[order], return_index=True, return_counts=True)
    chosen = order[first]
    by_place = np.argsort(chosen)
    return chosen[by_place], counts[by_place].astype(np.float64)


def _batches(pixels: NDArray[np.int32], watch: Watch) -> Iterator[tuple[int, NDArray[np.int32]]]:
    for start in range(0, len(pixels), _BATCH_PIXELS):
        watch(start / len(pixels))
        yield start, pixels[start : start + _BATCH_PIXELS]


def _seed(job: _Job, purpose: int, start: int) -> int:
    return job.seed * 1_000_003 + purpose * 100_003 + start


def _shine(
    job: _Job, pixels: NDArray[np.int32], columns: Columns, glints: int, seed: int
) -> Float32:
    """Return the luminance that the surface itself reflects, (n, columns)."""
    colour = shine(job.scene, job.picture, pixels, columns, glints, seed)
    luminance: Float32 = colour @ np.asarray(LUMINANCE_WEIGHTS, np.float32)
    return luminance


def _exposures(
    job: _Job, used: NDArray[np.intp], columns: Columns, watch: Watch
) -> Iterator[tuple[NDArray[np.intp], Float32]]:
    """Yield the light at some points, a few at a time: (points, moments (3, n, columns))."""
    step = max(1, _CHUNK_PAIRS // columns.count)
    for start in range(0, len(used), step):
        watch(start / len(used))
        some = used[start : start + step]
        points = replace(
            job.points, positions=job.points.positions[some], normals=job.points.normals[some]
        )
        yield some, expose(job.scene, points, columns, job.effort.shadows, _seed(job, 5, start))


def _weights(job: _Job, targets: Float64, size: int) -> Float64:
    """Return weights of eq. 6 for another picture size, as weights of rendered pixels, (S, P)."""
    block = job.picture // size
    face = _blocks(job, job.coverage, block) >= FACE_COVERAGE
    rows = []
    for target in targets:
        picture = _blocks(job, target, block)
        weights = target_weights(picture.ravel(), face.ravel()).reshape(size, size)
        fine = weights.repeat(block, axis=0).repeat(block, axis=1) / block**2
        rows.append(fine.ravel()[job.pixels])
    return np.stack(rows)


def _blocks(job: _Job, values: NDArray[np.floating[Any]], block: int) -> Float64:
    """Average values on pixels, (P,), over square blocks: (N / block, N / block)."""
    picture = np.zeros(job.picture**2)
    picture[job.pixels] = values
    side = job.picture // block
    small: Float64 = picture.reshape(side, block, side, block).mean(axis=(1, 3))
    return small


def _mirror_rows(styles: Sequence[Style], rows: Float64) -> tuple[Float64, float]:
    """Average F with its mirrored style's mirror image; return the noise from their difference."""
    exact, noise = rows.copy(), 0.0
    for here, style in enumerate(styles):
        there = mirror_index(styles, style)
        if there is not None:
            other = rows[:, there, :, ::-1]
            exact[:, here] = 0.5 * (rows[:, here] + other)
            difference = np.square(rows[:, here] - other).mean(axis=(1, 2)) / 4
            power = np.square(exact[:, here]).mean(axis=(1, 2))
            noise = max(noise, float(np.sqrt(difference / power).max()))
    return exact, noise
