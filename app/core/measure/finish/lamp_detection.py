"""Detect a place's lamps, which are bright regions of the panorama, named A, B, C ...

A lamp is a connected region that is more than four times as bright as the mean of the sphere and
within a factor of eight of its own peak. The second condition keeps the glow around the sun from
counting as part of the sun. Light that is clipped in every frame belongs to a lamp regardless of
the threshold. The panorama is first reduced to 512 x 256 texels of 0.7 degrees each, and it wraps
around at its seam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage
from app.core.base.errors import ProbeError
from app.core.base.sphere import wrapped
from app.core.environment.environment import solid_angles
from app.core.measure.read.frame import MergedLight
from app.core.text import tr

Int32: TypeAlias = NDArray[np.int32]

MAX_LIGHTS: Final = 12
"""Maximum number of named lamps. All others count as part of the place's general light."""

_GRID: Final = (256, 512)
_ABOVE_MEAN: Final = 4.0
_BELOW_PEAK: Final = 1.0 / 8.0
_LEAST_SHARE: Final = 0.003  # minimum fraction of the light for a measured lamp
# A clipped lamp has only a lower bound: the sun's own disc, clipped by 13 stops, has 1e-4.
_LEAST_CLIPPED_SHARE: Final = 2e-5
_HIDDEN: Final = 64.0  # six stops by which a clipped lamp may be brighter than its lower bound


Source: TypeAlias = Literal["sun", "lamp", "window", "wall", "ground", "sky", "above", "area"]
"""Kind of light. "above" is sky or a ceiling, and "area" is not identified by its direction."""


@dataclass(frozen=True, slots=True)
class LightGrid:
    """A panorama reduced to (h, w), at most 256 x 512, in which lamps are detected.

    Attributes:
        luminance: (h, w) float32. Luminance, in the unit of the panorama.
        clipped: (h, w) float32. Fraction of each texel that is clipped in every frame.
        loss: (h, w) float32. Luminance that clipping may have lost.
        solid_angle: (h, 1) float64. Solid angle of one texel in each row, in steradians.
    """

    luminance: FloatImage
    clipped: FloatImage
    loss: FloatImage
    solid_angle: Float64

    @property
    def energy(self) -> Float64:
        """The product of luminance and solid angle, (h, w) float64."""
        return self.luminance * self.solid_angle

    @property
    def total(self) -> float:
        """The luminance, integrated over the sphere."""
        rows = self.luminance.sum(axis=1, dtype=np.float64)
        return float(rows @ self.solid_angle[:, 0])


@dataclass(frozen=True, slots=True)
class Light:
    """A lamp, a window or the sun.

    Attributes:
        id: "A" for the lamp with the most light, then "B" ...
        azimuth_deg, elevation_deg: Centre of the light, in degrees.
        diameter_deg: Diameter of the disc with the same solid angle, in degrees.
        roundness: The second moment of a disc with the same solid angle, divided by that of the
            light. The value is 1 for a disc and less for an elongated or scattered shape.
        share: Fraction of the place's light, 0 to 1.
        surround: Luminance of the area around the light.
        texels: (N,) int32. Flat indices into the grid of `light_grid`.
    """

    id: str
    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    roundness: float
    solid_angle_sr: float
    share: float
    clipped: bool
    surround: float
    texels: Int32 = field(repr=False)


def light_grid(merged: MergedLight) -> LightGrid:
    """Reduce a panorama to at most 512 x 256 texels.

    Raises:
        ProbeError: If the light is not a full panorama.
    """
    rows, columns = merged.radiance.shape[:2]
    if columns != 2 * rows or rows < 2:
        raise ProbeError(
            tr(
                "Lamps can be found only in a full panorama; this picture is {columns} x {rows}.",
                columns=columns,
                rows=rows,
            )
        )
    height, width = min(rows, _GRID[0]), min(columns, _GRID[1])
    size = (width, height)
    # Combine the channels before reducing, which is several times faster than reducing all three.
    light = cv2.transform(merged.radiance, np.array([LUMINANCE_WEIGHTS]))
    planes = (light, merged.clipped, light * merged.clipped)
    means = [cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in planes]
    bright, clipped, loss = (np.asarray(mean, np.float32) for mean in means)
    return LightGrid(bright, clipped, loss, solid_angles((height, width))[:, None])


def find_lights(merged: MergedLight, grid: LightGrid | None = None) -> tuple[Light, ...]:
    """Return at most `MAX_LIGHTS` of a place's lamps, by descending share of the light.

    No lamps are returned if no direction stands out.

    Raises:
        ProbeError: If the light is not a full panorama or is entirely black.
    """
    grid = light_grid(merged) if grid is None else grid
    total = grid.total
    if not total > 0:
        raise ProbeError(
            tr("The panorama is completely black."),
            tr("Remove the lens cover, or expose longer."),
        )
    labels, count = _regions(grid, total)
    if count == 0:
        return ()
    energy, clipped = grid.energy.ravel(), (grid.loss * grid.solid_angle).ravel()
    share = _sums(labels, energy, count) / total
    loss = _sums(labels, clipped, count) / total
    matters = (share >= _LEAST_SHARE) | (loss >= _LEAST_CLIPPED_SHARE)
    order = [int(k) for k in np.argsort(-(share + _HIDDEN * loss)) if matters[k]][:MAX_LIGHTS]
    order.sort(key=lambda k: -share[k])
    members = _members(labels, count)
    around = cv2.blur(wrapped(grid.luminance * (labels == 0), 16), (33, 33))[:, 16:-16]
    weight = cv2.blur(wrapped((labels == 0).astype(np.float32), 16), (33, 33))[:, 16:-16]
    surround = np.asarray(around / np.maximum(weight, 1e-3), np.float32)
    return tuple(
        _measure(chr(ord("A") + rank), grid, members[k], surround, total)
        for rank, k in enumerate(order)
    )


def upsampled(light: Light, shape: tuple[int, ...]) -> Bools:
    """Return a mask, (H, W), of a light's texels in the panorama in which it was detected."""
    height, width = shape[0], shape[1]
    grid = np.zeros((min(height, _GRID[0]), min(width, _GRID[1])), np.uint8)
    grid.reshape(-1)[light.texels] = 1
    return cv2.resize(grid, (width, height), interpolation=cv2.INTER_NEAREST) > 0


def spread_of(
    shape: tuple[int, int], texels: NDArray[np.integer[Any]], weights: Float64
) -> tuple[float, float, float]:
    """Return the centre and the spread of weighted texels, (N,) flat indices, in a panorama.

    Args:
        shape: Rows and columns of the panorama.
        weights: (N,) float64. Non-negative weights, not all of them zero.

    Returns:
        The azimuth and elevation, in degrees, of the weighted sum of the unit vectors, and the mean
        squared distance from that direction in steradians, including the size of the texels. For a
        uniform disc, this is half the squared radius.
    """
    height, width = shape
    row, column = np.divmod(texels, width)
    elevation = np.pi * (0.5 - (row + 0.5) / height)
    azimuth = 2 * np.pi * ((column + 0.5) / width - 0.5)
    flat = np.cos(elevation)
    vectors = np.stack([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat])
    centre: Float64 = vectors @ weights
    length = float(np.linalg.norm(centre))
    if length < 1e-9 * float(weights.sum()):
        centre, length = np.array([0.0, 1.0, 0.0], np.float64), 1.0
    centre = centre / length
    cosine = np.clip(centre @ vectors, -1.0, 1.0)
    # 2 (1 - cos) is the squared chord, which is the squared distance for small angles.
    own = (np.pi / height) ** 2 * (1.0 + flat**2) / 12.0
    moment = float((weights * (2.0 * (1.0 - cosine) + own)).sum() / weights.sum())
    return (
        math.degrees(math.atan2(centre[0], centre[2])),
        math.degrees(math.asin(max(-1.0, min(1.0, float(centre[1]))))),
        moment,
    )


def _regions(grid: LightGrid, total: float) -> tuple[Int32, int]:
    """Label the regions from 1 to `count`, with 0 where there is no lamp."""
    level = _ABOVE_MEAN * total / (4.0 * np.pi)
    loss = grid.clipped > 0
    bright, count = components((grid.luminance > level) | loss)
    if count == 0:
        return bright, 0
    peaks = np.zeros(count + 1, np.float32)
    bright_mask = bright > 0
    np.maximum.at(peaks, bright[bright_mask], grid.luminance[bright_mask])
    core = bright_mask & (grid.luminance >= _BELOW_PEAK * peaks[bright])
    return components(core | loss)


def components(mask: Bools) -> tuple[Int32, int]:
    """Label the connected parts of a mask, bridging gaps of one texel and joining at the seam.

    Args:
        mask: (H, W) bool.

    Returns:
        The labels, (H, W) int32, which start at 1 and are 0 outside the mask, and the number of
        labels.
    """
    bridged = cv2.morphologyEx(
        wrapped(mask.astype(np.uint8), 2), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)
    )[:, 2:-2]
    count, labels = cv2.connectedComponents(np.ascontiguousarray(bridged), connectivity=8)
    join = np.arange(count)
    left, right = labels[:, 0], labels[:, -1]
    for step in (-1, 0, 1):
        rows = slice(max(step, 0), len(left) + min(step, 0))
        others = slice(max(-step, 0), len(left) + min(-step, 0))
        for a, b in zip(left[rows], right[others], strict=True):
            if a and b:
                ends = (join[a], join[b])
                join[join == max(ends)] = min(ends)
    ids, dense = np.unique(join, return_inverse=True)
    return np.where(mask, dense[labels], 0).astype(np.int32), len(ids) - 1


def _sums(labels: Int32, values: Float64, count: int) -> Float64:
    """Return the sum of the values for each label. Entry k is for label k + 1."""
    return np.asarray(np.bincount(labels.ravel(), values, count + 1)[1:], np.float64)


def _members(labels: Int32, count: int) -> list[Int32]:
    """Return the flat indices of each label's texels. Entry k is for label k + 1."""
    flat = labels.ravel()
    texels = np.flatnonzero(flat)
    order = texels[np.argsort(flat[texels], kind="stable")].astype(np.int32)
    stops = np.cumsum(np.bincount(flat, minlength=count + 1)[1:-1])
    return list(np.split(order, stops))


def _measure(
    name: str, grid: LightGrid, texels: Int32, surround: FloatImage, total: float
) -> Light:
    shape = grid.luminance.shape[0], grid.luminance.shape[1]
    areas = np.broadcast_to(grid.solid_angle, shape).ravel()[texels]
    values = grid.luminance.ravel()[texels].astype(np.float64)
    clip_weights = grid.clipped.ravel()[texels].astype(np.float64)
    energy = values * areas
    azimuth, elevation, _ = spread_of(shape, texels, energy)
    _, _, moment = spread_of(shape, texels, areas)
    solid_angle = float(areas.sum())
    return Light(
        id=name,
        azimuth_deg=azimuth,
        elevation_deg=elevation,
        diameter_deg=math.degrees(2.0 * math.acos(1.0 - min(solid_angle / (2.0 * np.pi), 2.0))),
        roundness=min(1.0, solid_angle / (2.0 * np.pi) / moment),
        solid_angle_sr=solid_angle,
        share=float(energy.sum()) / total,
        clipped=bool((clip_weights > 0).any()),
        surround=float((surround.ravel()[texels] * areas).sum() / solid_angle),
        texels=texels,
    )
