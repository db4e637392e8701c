"""Merge photos with known directions into a panorama of light.

Each photo is a pinhole picture, and all are taken from one point. Each texel is sampled several
times. Each sample is merged from all photos that show it, like the frames of a bracket
(`merge_band`): photos are weighted by noise, clipped pixels have no weight, and the weight
increases away from a photo's edge, which hides the seams. It is the merged samples, not the codes,
that are averaged, so a lamp keeps its light.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.base.sphere import directions_at
from app.core.measure.bracket.curve.response import srgb_response
from app.core.measure.bracket.merge import SIZE
from app.core.measure.bracket.merge_band import merge_band
from app.core.measure.bracket.weighting import FrameLight, float_tables, frame_tables
from app.core.measure.read.pixels import workers

_TILE, _MOST_SAMPLES = 96, 3  # texels along a side; maximum samples along a texel's side
_FEATHER: Final = 0.4  # fraction of half a side over which a photo loses its weight
_AHEAD: Final = 0.05  # minimum cosine of the angle to the axis


@dataclass(frozen=True, slots=True)
class OrientedPicture:
    """A photo with its direction and exposure.

    Attributes:
        pixels: (h, w, 3) uint8 codes, or float32 linear light in which 1 is saturated.
        rotation: (3, 3) float64. Rotation from camera axes (right, down and forward) to those of a
            panorama (see `app.core.base.sphere`).
        gains: Radiance that corresponds to linear red, green and blue values of 1. For linear
            pictures, the mean is used.
        mask: (h, w) bool. Mask of the usable area, or None if the whole picture is usable.
    """

    pixels: NDArray[Any] = field(repr=False)
    rotation: Float64 = field(repr=False)
    focal_px: float
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)
    mask: Bools | None = field(default=None, repr=False)

    @property
    def stops(self) -> float:
        """The exposure in stops, relative to an exposure that a radiance of 1 saturates."""
        return -math.log2(sum(self.gains) / 3.0)

    def look(self, rays: Float32) -> tuple[NDArray[Any], Float32]:
        """Sample the photo in the given directions, (h, w, 3), in panorama coordinates.

        Returns:
            The pixels, (h, w, 3), and their distances from the picture's edge as fractions of half
            a side, (h, w) float32, which are 0 outside the picture.
        """
        local = rays @ self.rotation.astype(np.float32)
        scale = np.float32(self.focal_px) / np.maximum(local[..., 2], np.float32(_AHEAD))
        height, width = self.pixels.shape[:2]
        columns = local[..., 0] * scale + np.float32((width - 1) / 2.0)
        rows = local[..., 1] * scale + np.float32((height - 1) / 2.0)
        off = np.maximum(
            abs((columns + 0.5) * 2.0 / width - 1.0), abs((rows + 0.5) * 2.0 / height - 1.0)
        )
        inside = np.where(local[..., 2] > _AHEAD, np.maximum(1.0 - off, 0.0), 0.0)
        if self.mask is not None:
            inside_mask = cv2.remap(self.mask.astype(np.float32), columns, rows, cv2.INTER_LINEAR)
            inside = inside * (inside_mask > 0.999)
        edge = cv2.BORDER_REPLICATE
        colours = cv2.remap(self.pixels, columns, rows, cv2.INTER_LINEAR, borderMode=edge)
        return colours, inside.astype(np.float32)


def light_around(
    pictures: Sequence[OrientedPicture],
    shape: tuple[int, int] = SIZE,
    *,
    table: Float64 | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> tuple[Float32, Bools, Float32]:
    """Merge photos into a panorama of light with the given shape, (H, W).

    Args:
        table: (3, 256) float64. Linear light of each code, or None for sRGB.

    Returns:
        The radiance, (H, W, 3) float32 in the unit of the gains, which is 0 where it is unknown; a
        mask of the known texels, (H, W); and the fraction of each texel that is clipped in every
        photo that shows it, (H, W) float32.

    Raises:
        Cancelled: If the token is cancelled.
    """
    order = sorted(pictures, key=lambda picture: -picture.stops)
    lights = _lights(order, srgb_response().table if table is None else table)
    focal = float(np.median([picture.focal_px for picture in order]))
    samples = min(max(round(focal * 2.0 * math.pi / shape[1]), 1), _MOST_SAMPLES)
    planes = [np.zeros((*shape, count), np.float32) for count in (3, 1, 1)]
    tiles = [(y, x) for y in range(0, shape[0], _TILE) for x in range(0, shape[1], _TILE)]
    work = partial(_fill_tile, planes, order, lights, samples, token or Token())
    with ThreadPoolExecutor(workers(shape[0])) as pool:
        for tile_count, _ in enumerate(pool.map(work, tiles), 1):
            report(tile_count / len(tiles), Progress(Task.MERGING))
    return planes[0], planes[1][..., 0] > 0.0, planes[2][..., 0]


def _lights(pictures: Sequence[OrientedPicture], table: Float64) -> list[FrameLight]:
    """Build the tables that convert the photos to weights and light."""
    stops = [picture.stops for picture in pictures]
    lights = []
    for index, picture in enumerate(pictures):
        tables = frame_tables(table, index, stops, 0.0)
        tint = np.array(picture.gains, np.float32)[:, None] * np.float32(2.0 ** stops[index])
        light = FrameLight(replace(tables, value=tables.value * tint))
        if picture.pixels.dtype == np.float32:
            light = FrameLight(float_tables(index, stops, clips=True), 2.0 ** -stops[index])
        lights.append(light)
    return lights


def _fill_tile(
    planes: Sequence[Float32],
    pictures: Sequence[OrientedPicture],
    lights: Sequence[FrameLight],
    samples: int,
    token: Token,
    corner: tuple[int, int],
) -> None:
    """Merge the samples in a tile from the photos that show it, and average them."""
    token.check()
    height, width = (side * samples for side in planes[0].shape[:2])
    rows, columns = (np.arange(c * samples, (c + _TILE) * samples) for c in corner)
    texels = np.add.outer(rows[rows < height] * width, columns[columns < width])
    rays = directions_at((height, width), texels.ravel()).astype(np.float32)
    rays = rays.reshape(*texels.shape, 3)
    middle = rays.mean(axis=(0, 1)) / np.linalg.norm(rays.mean(axis=(0, 1)))
    reach = math.acos(min(float((rays @ middle).min()), 1.0))
    layers = []
    for picture, light in zip(pictures, lights, strict=True):
        half = math.atan(math.hypot(*picture.pixels.shape[:2]) / 2.0 / picture.focal_px)
        if middle @ picture.rotation[:, 2] > math.cos(min(half + reach, math.pi)):
            colours, inside = picture.look(rays)
            if inside.any():
                layers.append((colours, light, np.minimum(inside, np.float32(_FEATHER))))
    if not layers:
        return
    bands, use, says = zip(*layers, strict=True)
    most = np.maximum.reduce(says)
    trusts = [(say / np.maximum(most, np.float32(1e-6))) ** 2 for say in says]
    band = merge_band(bands, use, trusts)
    clipped = np.zeros_like(most) if band.clipped is None else band.clipped / np.float32(255.0)
    visible = _mean((most > 0.0).astype(np.float32), samples) > 0.999
    tile = tuple(slice(start, start + _TILE) for start in corner)
    for plane, part in zip(planes, (np.dstack(band.radiance), most, clipped), strict=True):
        plane[tile] = _mean(part, samples) * visible


def _mean(values: Float32, samples: int) -> Float32:
    """Average samples to texels, (h, w, C)."""
    size = values.shape[1] // samples, values.shape[0] // samples
    small = np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)
    return small.reshape(size[1], size[0], -1)
