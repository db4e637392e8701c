"""Fill masked areas from the surrounding light.

Under a mask, the radiance becomes a membrane: the harmonic function that takes on the values around
the mask (Perez, Gangnet and Blake, Poisson Image Editing, 2003, with no guidance field). It is
solved on a stereographic chart of the sphere, where harmonic functions stay harmonic, so the poles
and the panorama's seam need no special treatment. A harmonic function is nowhere brighter or darker
than its boundary, channel by channel.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import cv2
import numpy as np

from app.core.base import colour
from app.core.base.arrays import Bools
from app.core.base.colour import FloatImage
from app.core.base.errors import ProbeError
from app.core.base.sphere import direction, directions, solid_angles
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import Chart, azimuth_elevation
from app.core.text import tr

FEATHER_DEG: Final = 1.5
"""Width of the band outside the mask, in degrees, over which the picture fades into the filling."""

_MOST: Final = 0.9
_TOUCHED: Final = 0.02
_WIDEST: Final = 768  # columns, of 0.47 degrees each, of the copy that charts sample
_COARSE: Final = 256
_SIDE: Final = 256
_MARGIN_DEG: Final = 6.0
_SWEEPS: Final = 24
_COARSEST: Final = 4
_LAMP_RATIO: Final = 2.0


def fill(merged: MergedLight, mask: FloatImage, lamp_ratio: float = _LAMP_RATIO) -> MergedLight:
    """Replace masked light, (H, W) float32, with light interpolated from its surroundings.

    The light is removed completely where the mask is 1. Texels that are masked by more than 2% are
    replaced at least in proportion to the mask, which fades out over `FEATHER_DEG` around them. To
    prevent a lamp that touches the mask from spreading into it, the surrounding light is limited to
    `lamp_ratio` times its own upper quartile, keeping its hue. Filled areas count as neither
    clipped nor dark. An empty mask changes nothing.

    Raises:
        ProbeError: If the light is not a full panorama, the mask has a different size, or the mask
            leaves less than a tenth of the sphere to fill from.
    """
    shape = (merged.radiance.shape[0], merged.radiance.shape[1])
    _check(shape, mask)
    if not (mask > _TOUCHED).any():
        return merged
    light, coverage = _small(merged.radiance, mask)
    radiance, clipped, dark = (
        np.array(part) for part in (merged.radiance, merged.clipped, merged.dark)
    )
    for part in components(_coarse(mask)):
        chart = _chart(part, shape)
        masked = (chart.sample(1.0 - coverage) > 0.0) & (
            chart.sample(part.astype(np.float32)) > 0.0
        )
        filling = _solve(chart, light, coverage, masked, lamp_ratio)
        _blend(chart, filling, mask, (radiance, clipped, dark))
    for array in (radiance, clipped, dark):
        array.flags.writeable = False
    return replace(merged, radiance=radiance, clipped=clipped, dark=dark)


def components(area: Bools) -> list[Bools]:
    """Split an area of a panorama, (H, W), into connected parts, largest first.

    Parts that meet at the seam or at a pole count as one part.
    """
    count, labels = cv2.connectedComponents(area.astype(np.uint8), connectivity=8)
    pairs = {(int(a), int(b)) for a, b in zip(labels[:, 0], labels[:, -1], strict=True)}
    for row in (0, -1):
        at_pole = sorted({int(label) for label in labels[row]} - {0})
        pairs |= {(at_pole[0], label) for label in at_pole[1:]}
    names = np.arange(count)
    for a, b in sorted(pairs):
        if a and b:
            names[names == names[b]] = names[a]
    labels = names[labels]
    heights = solid_angles((area.shape[0], area.shape[1]))
    parts = [labels == name for name in sorted(set(names.tolist()) - {0})]
    return sorted(parts, key=lambda part: -float(part.sum(axis=1) @ heights))


def _check(shape: tuple[int, int], mask: FloatImage) -> None:
    if shape[1] != 2 * shape[0]:
        raise ProbeError(tr("Only a full panorama, twice as wide as it is high, can be filled."))
    if mask.shape != shape:
        raise ProbeError(
            tr(
                "The mask is {mask_shape} pixels, but the panorama is {shape}.",
                mask_shape=mask.shape,
                shape=shape,
            )
        )
    share = float((mask > _TOUCHED).mean(axis=1) @ solid_angles(shape)) * shape[1]
    if share > _MOST * 4.0 * np.pi:
        raise ProbeError(
            tr("The mask covers almost everything, so there is nothing left to fill from."),
            tr("Mask a smaller area."),
        )


def _small(radiance: FloatImage, mask: FloatImage) -> tuple[FloatImage, FloatImage]:
    """Return the light outside the mask at `_WIDEST` columns or fewer, and its visible fraction."""
    coverage = (mask <= _TOUCHED).astype(np.float32)
    height, width = mask.shape
    if width <= _WIDEST:
        return radiance * coverage[..., np.newaxis], coverage
    # Use whole factors only, so that texels on the seam stay on the seam.
    step = -(-width // _WIDEST)
    size = (width // step, height // step)
    light = cv2.resize(radiance, size, interpolation=cv2.INTER_AREA)
    share = np.asarray(cv2.resize(coverage, size, interpolation=cv2.INTER_AREA), np.float32)
    # Texels cut by the mask are not used, because they contain an object's edge.
    share = (share > 0.999).astype(np.float32)
    return np.asarray(light, np.float32) * share[..., np.newaxis], share


def _coarse(mask: FloatImage) -> Bools:
    """Reduce a mask to at most `_COARSE` columns, including every texel that the mask touches."""
    near_mask = (mask > _TOUCHED).astype(np.float32)
    step = -(-near_mask.shape[1] // _COARSE)
    if step == 1:
        return near_mask > 0.0
    size = (-(-near_mask.shape[1] // step), -(-near_mask.shape[0] // step))
    return np.asarray(cv2.resize(near_mask, size, interpolation=cv2.INTER_AREA)) > 0.0


def _chart(part: Bools, shape: tuple[int, int]) -> Chart:
    """Choose a chart that covers a masked part and some of its surroundings."""
    size = (part.shape[0], part.shape[1])
    every = directions(size).astype(np.float64)
    inside = every[part]
    flat = np.repeat(solid_angles(size)[:, np.newaxis], size[1], axis=1)
    middle = flat[part] @ inside
    if np.linalg.norm(middle) < 1e-3 * flat[part].sum():
        middle = -(flat[~part] @ every[~part])
    centre = azimuth_elevation(middle)
    farthest = float(np.degrees(np.arccos(np.clip((inside @ direction(*centre)).min(), -1, 1))))
    reach = farthest + 180.0 / size[0] + _MARGIN_DEG
    side = _SIDE if shape[0] >= _SIDE // 2 else max(4 * shape[0], 32)
    return Chart(centre, min(reach, 172.0), side)


def _solve(
    chart: Chart, light: FloatImage, coverage: FloatImage, masked: Bools, lamp_ratio: float
) -> tuple[FloatImage, FloatImage]:
    """Return the membrane on the chart, (side, side, 3), and its opacity."""
    weight = chart.sample(coverage)
    samples = chart.sample(light) / np.maximum(weight, 1e-6)[..., np.newaxis]
    outside = cv2.distanceTransform((~masked).astype(np.uint8), cv2.DIST_L2, 5)
    # The size of a pixel in degrees, which on a stereographic chart is largest in the middle.
    radius = np.tan(np.radians(chart.distances()) / 2.0)
    pixel = np.degrees(2.0 * radius[0, radius.shape[1] // 2] / (chart.side / 2.0) / (1 + radius**2))
    # Opaque for two more pixels, since the result is interpolated between pixels later.
    beyond = np.maximum(outside - 2.0, 0.0) * pixel
    share = np.clip(1.0 - beyond / FEATHER_DEG, 0.0, 1.0).astype(np.float32)
    free = (share > 0.0) | (weight < 0.999)
    edge = free ^ (cv2.dilate(free.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0)
    values = _without_lamps(samples, edge, lamp_ratio)
    return _membrane(values, (~free).astype(np.float32)), share


def _without_lamps(samples: FloatImage, edge: Bools, ratio: float) -> FloatImage:
    """Limit the light to the level of most of the surroundings, keeping its hue."""
    if not edge.any():
        return samples
    bright = colour.luminance(samples)
    limit = ratio * float(np.percentile(bright[edge], 75.0))
    scale = np.minimum(1.0, limit / np.maximum(bright, 1e-30))
    return np.asarray(samples * scale[..., np.newaxis], np.float32)


def _membrane(values: FloatImage, fixed: FloatImage) -> FloatImage:
    """Solve Laplace's equation where `fixed` is 0, from coarse to fine (cascadic multigrid)."""
    if min(fixed.shape) > _COARSEST and fixed.shape[0] % 2 == 0 and not fixed.all():
        half = (fixed.shape[1] // 2, fixed.shape[0] // 2)
        share = np.asarray(cv2.resize(fixed, half, interpolation=cv2.INTER_AREA), np.float32)
        sums = cv2.resize(values * fixed[..., np.newaxis], half, interpolation=cv2.INTER_AREA)
        mean = np.asarray(sums / np.maximum(share, 1e-6)[..., np.newaxis], np.float32)
        coarse = _membrane(mean, (share > 0.0).astype(np.float32))
        size = (fixed.shape[1], fixed.shape[0])
        guess = np.asarray(cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR), np.float32)
    else:
        total = float(fixed.sum())
        mean = (values * fixed[..., np.newaxis]).sum(axis=(0, 1)) / max(total, 1.0)
        guess = np.broadcast_to(mean.astype(np.float32), values.shape)
    return _relaxed(values, fixed, guess)


def _relaxed(values: FloatImage, fixed: FloatImage, guess: FloatImage) -> FloatImage:
    """Relax values by Jacobi sweeps, replacing every free pixel with its four neighbours' mean."""
    free = fixed[..., np.newaxis] == 0.0
    now = np.where(free, guess, values).astype(np.float32)
    cross = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32) / 4.0
    rows, columns = np.nonzero(fixed == 0.0)
    if not rows.size:
        return now
    top, bottom = max(int(rows.min()) - 1, 0), int(rows.max()) + 2
    left, right = max(int(columns.min()) - 1, 0), int(columns.max()) + 2
    box = np.ascontiguousarray(now[top:bottom, left:right])
    fixed_mask = np.ascontiguousarray(np.repeat(~free[top:bottom, left:right], 3, axis=2)).view(
        np.uint8
    )
    backup = box.copy()
    for _ in range(_SWEEPS):
        box = np.asarray(cv2.filter2D(box, -1, cross, borderType=cv2.BORDER_REPLICATE), np.float32)
        np.copyto(box, backup, where=fixed_mask.view(np.bool_))
    now[top:bottom, left:right] = box
    return now


def _blend(
    chart: Chart,
    filling: tuple[FloatImage, FloatImage],
    mask: FloatImage,
    arrays: tuple[FloatImage, FloatImage, FloatImage],
) -> None:
    """Blend the filling into the panorama's arrays, which are changed in place."""
    shape = (mask.shape[0], mask.shape[1])
    for rows in _row_bands(chart, shape):
        column, row = chart.place(shape, rows)
        share = cv2.remap(filling[1], column, row, cv2.INTER_LINEAR, borderValue=(0.0,))
        near = share > 0.0
        if not near.any():
            continue
        light = cv2.remap(filling[0], column, row, cv2.INTER_LINEAR)
        share = np.where(near, np.maximum(share, mask[rows]), 0.0).astype(np.float32)
        radiance, clipped, dark = (array[rows] for array in arrays)
        radiance += share[..., np.newaxis] * (light - radiance)
        clipped *= 1.0 - share
        dark *= 1.0 - share


def _row_bands(chart: Chart, shape: tuple[int, int]) -> list[slice]:
    """Return the rows of the panorama that the chart covers, in bands."""
    top_deg = min(chart.centre[1] + chart.reach_deg * 1.05, 90.0)
    low_deg = max(chart.centre[1] - chart.reach_deg * 1.05, -90.0)
    first = int((90.0 - top_deg) / 180.0 * shape[0])
    last = min(int((90.0 - low_deg) / 180.0 * shape[0]) + 1, shape[0])
    return [slice(row, min(row + 64, last)) for row in range(first, last, 64)]
