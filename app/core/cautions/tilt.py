"""Estimate how far a camera was from level, from the upright edges in its panorama.

In the panorama of a level camera, the edges of walls, posts and trunks lie on great circles through
the zenith. If the camera was tilted, they meet elsewhere. LSD (Grompone von Gioi et al. 2012) finds
line segments in flat views that cover the sphere. A segment agrees with a direction u as "up" if
the angle between the segment and the way to u is small. Each direction within 24 degrees of the
panorama's zenith scores

    T(u) = sum over sectors of sqrt(S_i(u)),

where S_i is the length of the segments in sector i of the horizon that agree. The root keeps one
object from outvoting the rest of the place. The best direction must be better than any other one
farther away than 5 degrees, and than any nearly level one. As a place with few lines has best
directions by chance, each difference is divided by its own noise, the root of the sum of squares of
the sectors' differences. The limits are those of `benchmarks/tilted-camera.md`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float32, Float64
from app.core.base.colour import FloatImage
from app.core.base.sphere import bounded, from_vector, positions, rotate_light, rotation, wrapped
from app.core.cautions.caution import Caution, Hazard
from app.core.cautions.lost_match import lost_match
from app.core.environment.environment import Environment, reduce_light
from app.core.measure.finish.clip_audit import choices
from app.core.solver.search import luminance_of
from app.core.solver.turn_choice import Objective
from app.core.styles.style_pack import StylePack

LEAST_DEG: Final = 5.0
"""Smallest tilt that is reported, in degrees."""

MOST_DEG: Final = 22.0
"""Largest tilt that is reported, in degrees. A larger one may only be the way to a better one."""

LEAST_SURENESS: Final = 1.0
"""Smallest `Tilt.sureness` that is reported."""

LOSS: Final = 3.0
"""Points of match that a turn may lose before its style is cautioned."""

_LEAST_ROWS: Final = 200  # a coarser panorama has too few lines
_COLUMNS: Final = 2048
_TURNED: Final = 1024  # columns of the light in which styles are solved again
_VIEWS: Final = ((0.0, 5), (45.0, 4), (-45.0, 4))  # elevation in degrees, and number around
_SIDE: Final = 640  # pixels of a view of 90 degrees
_DARK: Final = 0.02  # fraction of the median luminance that is added before the logarithm
_RANGE: Final = (0.01, 0.995)  # quantiles of the logarithm that become black and white
_SHORTEST_DEG: Final = 1.2
_LONGEST_DEG: Final = 15.0  # a longer segment does not count more
_MOST: Final = 8000  # segments
_CAP_DEG: Final = 24.0
_SECTORS: Final = 24
_WIDTHS: Final = ((1.5, 1.0), (3.0, 0.5))  # half the angle of agreement in degrees, and its weight
_STEEP: Final = 0.4  # sine of the angle to u within which every segment agrees
_AWAY_DEG: Final = 5.0
_LEVEL_DEG: Final = 3.5
_AWAY_SURENESS: Final = 0.75
_LEVEL_SURENESS: Final = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Tilt:
    """The estimated tilt of a camera.

    Attributes:
        degrees: Angle between the panorama's zenith and the true one.
        levelling: (3, 3) float64. Rotation that levels the panorama without a turn about the
            vertical, for `rotate_light`.
        sureness: How clearly the best direction beats all others and nearly level ones, divided by
            the least that is required of each, whichever is smaller.
    """

    degrees: float
    levelling: Float64
    sureness: float


def tilt_caution(
    environment: Environment, pack: StylePack, objective: Objective = "picture"
) -> tuple[Caution, ...]:
    """Return a caution if the camera was clearly tilted."""
    tilt = camera_tilt(environment.radiance)
    if tilt is None:
        return ()
    styles = tilted_styles(environment.radiance, tilt, pack, objective)
    return (Caution(Hazard.TILT, round(tilt.degrees), styles),)


def tilted_styles(
    radiance: FloatImage, tilt: Tilt, pack: StylePack, objective: Objective = "picture"
) -> tuple[str, ...]:
    """Return the styles whose grade differs in the levelled light, or whose turn loses match there.

    Args:
        radiance: (H, 2 H, 3) float32. Linear radiance of the tilted panorama.
    """
    light, shape = bounded(radiance, _TURNED), pack.header.environment
    level = np.maximum(rotate_light(light, tilt.levelling), 0.0)
    choice = choices(pack, [reduce_light(one, shape) for one in (light, level)], objective)
    changes = (choice.grade[1] != choice.grade[0]) | (lost_match(choice)[0] > LOSS)
    return tuple(style.name for style, hit in zip(pack.styles, changes, strict=True) if hit)


def camera_tilt(radiance: FloatImage) -> Tilt | None:
    """Return the tilt of a panorama's camera, or None if the camera was level or may have been.

    Args:
        radiance: (H, 2 H, 3) float32. Linear radiance, on an arbitrary scale.
    """
    if len(radiance) < _LEAST_ROWS:
        return None
    tilt = likeliest_tilt(radiance)
    return (
        tilt if tilt.sureness >= LEAST_SURENESS and LEAST_DEG < tilt.degrees <= MOST_DEG else None
    )


def likeliest_tilt(radiance: FloatImage) -> Tilt:
    """Return the likeliest tilt, however unlikely that is.

    Args:
        radiance: As in `camera_tilt`.
    """
    ups = _directions()
    roots = np.sqrt(_agreement(*_segments(_coded(radiance)), ups))
    totals = roots.sum(axis=0)
    best = int(totals.argmax())
    up = ups[best].astype(np.float64)
    degrees = math.degrees(math.acos(min(1.0, float(up[1]))))
    angles = np.degrees(np.arccos(np.clip(ups @ ups[best], -1.0, 1.0)))
    away = np.where(angles > _AWAY_DEG, totals, -1.0)
    level = np.where(ups[:, 1] >= math.cos(math.radians(_LEVEL_DEG)), totals, -1.0)
    sureness = min(
        _lead(roots, best, int(away.argmax())) / _AWAY_SURENESS,
        _lead(roots, best, int(level.argmax())) / _LEVEL_SURENESS,
    )
    axis = np.cross(up, [0.0, 1.0, 0.0])
    size = float(np.linalg.norm(axis))
    vector = axis / size * math.radians(degrees) if size > 0.0 else axis
    return Tilt(degrees, from_vector(vector), sureness)


def _lead(roots: Float32, best: int, other: int) -> float:
    """Return how many times its noise the best direction is ahead of another one."""
    ahead = (roots[:, best] - roots[:, other]).astype(np.float64)
    return float(ahead.sum() / math.sqrt(float((ahead**2).sum()) + 1e-9))


@lru_cache(maxsize=1)
def _directions() -> Float32:
    """Return unit vectors about one degree apart within 24 degrees of the zenith, (N, 3)."""
    ways = [(0.0, 1.0, 0.0)]
    for ring in range(1, round(_CAP_DEG) + 1):
        high, level = math.cos(math.radians(ring)), math.sin(math.radians(ring))
        count = round(2.0 * math.pi * ring)
        around = (2.0 * math.pi * k / count for k in range(count))
        ways += [(level * math.cos(a), high, level * math.sin(a)) for a in around]
    return np.array(ways, np.float32)


def _coded(radiance: FloatImage) -> Bytes:
    """Return the logarithm of the luminance of a panorama in 8 bits, (1024, 2048) uint8.

    Enlarging a small panorama lets LSD find short edges, of which parks and woods have many.
    """
    light = luminance_of(bounded(radiance, _COLUMNS))
    dark = max(_DARK * float(np.median(light)), 1e-30)
    stops = np.log2(np.maximum(light, 0.0) + np.float32(dark))
    low, high = np.quantile(stops, _RANGE)
    scaled = (stops - low) * (255.0 / max(float(high - low), 1e-6))
    codes = np.clip(scaled, 0.0, 255.0).astype(np.uint8)
    size = (_COLUMNS, _COLUMNS // 2)
    return np.asarray(cv2.resize(codes, size, interpolation=cv2.INTER_CUBIC), np.uint8)


def _segments(codes: Bytes) -> tuple[Float32, Float32, Float32]:
    """Find line segments in a panorama.

    Returns:
        Unit normals of the segments' great circles, (N, 3); unit vectors to the middle of each
        segment, (N, 3); and lengths in degrees, (N,). Longest first.
    """
    rays, shape = _rays(), (codes.shape[0], codes.shape[1])
    wide = wrapped(codes, 1)

    def ends_in(matrix: Float64) -> Float64:
        columns, rows = positions(rays @ matrix.T.astype(np.float32), shape)
        view = cv2.remap(
            wide, columns + 1.0, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        # None if there is no line, whatever the stubs say.
        lines: Any = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD).detect(view)[0]
        ends = np.zeros((0, 2, 2)) if lines is None else np.reshape(lines, (-1, 2, 2))
        return np.asarray(_ray_at(ends.astype(np.float64)) @ matrix.T)

    views = [
        rotation(360.0 * number / count, elevation)
        for elevation, count in _VIEWS
        for number in range(count)
    ]
    points = np.concatenate([ends_in(matrix) for matrix in views])
    points /= np.linalg.norm(points, axis=-1, keepdims=True)
    normals, middles = np.cross(points[:, 0], points[:, 1]), points.sum(axis=1)
    sines = np.linalg.norm(normals, axis=-1)
    lengths = np.degrees(np.arcsin(np.clip(sines, 0.0, 1.0)))
    order = np.argsort(-lengths)[:_MOST]
    order = order[lengths[order] >= _SHORTEST_DEG]
    normals = normals[order] / sines[order, None]
    middles = middles[order] / np.linalg.norm(middles[order], axis=-1, keepdims=True)
    return normals.astype(np.float32), middles.astype(np.float32), lengths[order].astype(np.float32)


def _rays() -> Float32:
    """Return the direction of each pixel of a view ahead, (640, 640, 3), of any length."""
    pixels = np.arange(_SIDE, dtype=np.float64)
    return _ray_at(np.stack(np.meshgrid(pixels, pixels), axis=-1)).astype(np.float32)


def _ray_at(pixels: Float64) -> Float64:
    """Return the directions, (..., 3), of columns and rows, (..., 2), in a view ahead."""
    across, down = np.moveaxis((pixels + 0.5) * (2.0 / _SIDE) - 1.0, -1, 0)
    # Azimuths are positive to the right, where X is negative.
    return np.stack([-across, -down, np.ones_like(across)], axis=-1)


def _agreement(normals: Float32, middles: Float32, lengths: Float32, ups: Float32) -> Float32:
    """Return the length of the segments that agree with each direction, (24, N), by sector."""
    azimuths = np.arctan2(middles[:, 0], middles[:, 2]) / (2.0 * np.pi) + 0.5
    sectors = np.minimum((azimuths * _SECTORS).astype(np.int64), _SECTORS - 1)
    result = np.zeros((_SECTORS, len(ups)), np.float32)
    weights = np.minimum(lengths, _LONGEST_DEG)[:, None]
    for sector in range(_SECTORS):
        some = sectors == sector
        sines = np.maximum(1.0 - (middles[some] @ ups.T) ** 2, 1e-6)
        off = (normals[some] @ ups.T) ** 2 / sines
        agree = np.zeros_like(off)
        for width, weight in _WIDTHS:
            bound = 4.0 * math.sin(math.radians(width)) ** 2
            agree += weight * np.maximum(1.0 - off / bound, 0.0) ** 2
        result[sector] = (agree * (sines > _STEEP**2) * weights[some]).sum(axis=0)
    return result
