"""Find the lamp in a capture of a dark room, without the room, its glow or its reflections.

The panorama is rotated so that the brightest light is in the centre, where texels are square and
no seam or pole is near. Outlines are then compared at many levels of brightness. Between the level
of the room and that of the lamp, the outline of a lamp with edges hardly moves. Within this range,
the highest level that still includes nearly all the light is chosen. A lower level would include
reflections on the table or the lit wall, and a higher one would lose a dim rim. Finally, each part
of the edge is moved to the middle of the step in brightness. This step is measured in the original
capture, because a rotation blurs and a small lamp is nearly all edge.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage
from app.core.base.errors import CoreError
from app.core.base.sphere import remap_frame, rotation
from app.core.environment.environment import solid_angles
from app.core.measure.finish.masks import box_mask
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, centroid, make_lamp
from app.core.second_light.captured_lamps.mask_brush import Point
from app.core.text import tr

_GRID: Final = (256, 512)
_STANDS_OUT: Final = 2.5  # times the room's median
_STEPS: Final = 17  # quarter stops below the lamp's level
_BRIDGE_DEG: Final = 0.75  # degrees, half of the largest gap between the parts of one lamp
_LARGEST: Final = 0.2  # fraction of the sphere
_STEADY: Final = 0.15  # change of the area within half a stop
_HOLDS: Final = 0.7  # fraction of the squared light, which favours bright parts over wide ones
_RING_DEG: Final = 1.0  # degrees around the edge in which the levels of both sides are measured
_DARK: Final = 10.0  # factor by which a lamp should be brighter than the room
_BURNT: Final = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class LampMask:
    """The area of the lamp in a capture.

    Attributes:
        contrast: Brightness of the lamp divided by that of the room.
        rejected: Number of other lights as bright as the lamp's edge.
    """

    # (H, 2 H), fraction of each texel that the lamp covers, 0 to 1
    alpha: Float32 = field(repr=False)
    contrast: float
    rejected: int
    clipped: float  # fraction of the lamp that is clipped in every frame, 0 to 1

    @property
    def in_lit_room(self) -> bool:
        """Whether the room is too bright for a reliable mask."""
        return self.contrast < _DARK

    @property
    def burnt_out(self) -> bool:
        """Whether part of the lamp is clipped in every frame."""
        return self.clipped > _BURNT


def find_mask(radiance: FloatImage, clipped: Float32 | None = None) -> LampMask:
    """Find the lamp that provides most of the light in a capture of a dark room.

    Args:
        radiance: (H, 2 H, 3) float32. Linear Rec. 709, at any scale, finite and not negative.
        clipped: (H, 2 H) float32. Fraction of each texel that is clipped in every frame.

    Raises:
        CoreError: If no lamp stands out.
    """
    light = np.asarray(radiance @ np.array(LUMINANCE_WEIGHTS, np.float32), np.float32)
    middle, core = _core(light)
    forward = rotation(*middle).T
    view = np.asarray(remap_frame(light, forward), np.float32)
    size = (light.shape[1], light.shape[0])
    whole = cv2.resize(core.astype(np.float32), size, interpolation=cv2.INTER_NEAREST)
    sure = np.asarray(remap_frame(np.asarray(whole, np.float32), forward)) > 0.5
    mask, contrast, rejected = _outline(view, sure)
    alpha = _as_captured(light, _at_half(view, mask), forward.T)
    clip_share = 0.0 if clipped is None else float((clipped * alpha).sum() / max(alpha.sum(), 1e-9))
    return LampMask(alpha, contrast, rejected, clip_share)


def edit_mask(
    lamp: CapturedLamp, box: tuple[float, float, float, float], *, is_lamp: bool
) -> CapturedLamp:
    """Add a box to a lamp's mask, or remove it from the mask.

    Args:
        box: (azimuth from, azimuth to, elevation from, elevation to), in degrees.
        is_lamp: Whether to add the box rather than remove it.

    Raises:
        CoreError: If no light would be left in the mask.
    """
    region = box_mask(*box, lamp.shape) > 0.5
    alpha = np.where(region, np.float32(is_lamp), lamp.alpha).astype(np.float32)
    values = {"white_cd_m2": lamp.white_cd_m2, "distance_m": lamp.distance_m}
    return make_lamp(
        lamp.name, lamp.radiance, alpha, title=lamp.title, camera=lamp.camera, **values
    )


def _core(light: Float32) -> tuple[Point, Bools]:
    """Find the source that provides most of the light: its centre, and a mask (h, w) of its core.

    Each connected area above any level of brightness is rated by its light and by its contrast with
    its surroundings, so that neither sparks nor lit walls pass for a lamp.
    """
    height, width = light.shape
    size = (min(width, _GRID[1]), min(height, _GRID[0]))
    grid = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), np.float32)
    weight = _areas(grid)
    room = _median(grid, weight)
    low, high = max(_STANDS_OUT * room, 1e-5 * float(grid.max())), float(grid.max())
    if not 0.0 < low < high:
        raise _nothing()
    excess = np.maximum(grid - room, 0.0) * weight
    best, mask = 0.0, np.zeros(grid.shape, np.bool_)
    for level in np.geomspace(low, high, max(2 * round(np.log2(high / low)), 1), endpoint=False):
        total, body = _most(grid >= level, excess, weight)
        score = total * _standing_out(grid, body, weight) ** 3 if total > 0.0 else 0.0
        # Levels rise, so the highest of nearly equal levels wins: its area has the least other
        # light.
        if score > 0.9 * best:
            best, mask = max(score, best), body
    if best == 0.0:
        raise _nothing()
    peaky = np.where(mask, grid, np.float32(0.0))
    return centroid(np.repeat(peaky[..., None], 3, axis=2)), mask


def _most(bright: Bools, excess: Float64, weight: Float64) -> tuple[float, Bools]:
    """Return the light of the brightest connected part of a mask, and that part itself."""
    columns = bright.shape[1]
    # Place two copies side by side, so that the seam does not divide a lamp.
    twice = np.concatenate([bright, bright], axis=1).astype(np.uint8)
    labels = cv2.connectedComponents(twice, connectivity=8)[1]
    areas, sums = (np.bincount(labels.ravel(), np.tile(v, 2).ravel()) for v in (weight, excess))
    sums[0] = 0.0
    sums[areas > 2.0 * _LARGEST * 4.0 * np.pi] = 0.0
    largest = labels == int(np.argmax(sums))
    body: Bools = largest[:, :columns] | largest[:, columns:]
    return float(excess[body].sum()) if sums.max() > 0.0 else 0.0, body


def _standing_out(grid: Float32, body: Bools, weight: Float64) -> float:
    """Return how many times brighter an area is than its surroundings, limited to `_DARK`."""
    near = body.astype(np.uint8)
    wide = cv2.dilate(near, np.ones((9, 9), np.uint8)) - cv2.dilate(near, np.ones((3, 3), np.uint8))
    around = _median(grid, np.where(wide > 0, weight, 0.0)) if wide.any() else 0.0
    own = float((grid * weight)[body].sum() / weight[body].sum())
    return min(own / max(around, own / _DARK), _DARK)


def _outline(view: Float32, core: Bools) -> tuple[Bools, float, int]:
    """Return the lamp's texels around its core, its contrast with the room, and rejected lights.

    In both `view` and `core`, the lamp is in the centre of the panorama.
    """
    weight = _areas(view)
    room = _median(view, weight)
    top = _own_level(view[core], weight[core])
    steps = [k for k in range(_STEPS) if top * 2.0 ** (-k / 4) > 1.5 * room]
    masks = [_body(view >= top * 2.0 ** (-k / 4), core) for k in steps]
    power = np.minimum(view, top).astype(np.float64) ** 2 * weight
    best = _best_level(
        [float(weight[mask].sum()) for mask in masks], [float(power[mask].sum()) for mask in masks]
    )
    step, mask = steps[best], masks[best]
    outside = _median(view, np.where(mask, 0.0, weight))
    inside = _median(view, np.where(mask, weight, 0.0))
    others = (view > top * 2.0 ** (-step / 4)) & ~mask
    return mask, inside / max(outside, 1e-6 * inside), _spots(others)


def _own_level(values: Float32, weight: Float64) -> float:
    """Return the level below which 60% of the lamp's squared light is found."""
    order = np.argsort(values)
    energy = np.cumsum((values.astype(np.float64) ** 2 * weight)[order])
    if not (energy.size and energy[-1] > 0.0):
        raise _nothing()
    return float(values[order[int(np.searchsorted(energy, 0.6 * energy[-1]))]])


def _body(bright: Bools, core: Bools) -> Bools:
    """Return a mask of the area that is connected with most of the core, across small gaps."""
    radius = max(round(_BRIDGE_DEG * bright.shape[0] / 180.0), 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    joint = cv2.dilate(bright.astype(np.uint8), kernel)
    labels = cv2.connectedComponents(joint, connectivity=8)[1]
    counts = np.bincount(labels[core & bright], minlength=1)
    counts[0] = 0
    return np.asarray((labels == int(np.argmax(counts))) & bright & bool(counts.any()))


def _best_level(areas: list[float], powers: list[float]) -> int:
    """Choose the level at which the outline is stable (see the module docstring).

    Args:
        areas, powers: Solid angle of the lamp, in steradians, and its squared light, at each level
            of brightness.
    """
    if not areas:
        raise _nothing()
    changes = [
        (areas[min(k + 1, len(areas) - 1)] - areas[max(k - 1, 0)]) / max(areas[k], 1e-12)
        for k in range(len(areas))
    ]
    usable = [k for k, area in enumerate(areas) if k > 0 and area < _LARGEST * 4.0 * np.pi]
    if not usable:
        raise _nothing()
    limit = max(_STEADY, 1.3 * min(changes[k] for k in usable))
    runs: list[list[int]] = []
    for k in (k for k in usable if changes[k] <= limit):
        if runs and runs[-1][-1] == k - 1:
            runs[-1].append(k)
        else:
            runs.append([k])
    middles = [run[len(run) // 2] for run in runs]
    return next(k for k in middles if powers[k] >= _HOLDS * powers[middles[-1]])


def _at_half(view: Float32, mask: Bools) -> Float32:
    """Move the edge to the middle of the step in brightness.

    Returns:
        (H, W, 4) float32. The channels are the alpha, which is soft over one texel, a mask (0 or 1)
        of the texels where both sides of the edge are known, the lamp's light inside the edge, and
        the room's light outside the edge.
    """
    radius = max(round(_RING_DEG * view.shape[0] / 180.0), 2)
    size = (2 * radius + 1, 2 * radius + 1)
    three = np.ones((3, 3), np.uint8)
    edge = np.zeros((*view.shape, 4), np.float32)
    edge[..., 0] = mask
    for _ in range(2):
        hard = (edge[..., 0] >= 0.5).astype(np.uint8)
        core, clear = cv2.erode(hard, three), 1 - cv2.dilate(hard, three)
        ring = cv2.dilate(hard, three, iterations=2) - cv2.erode(hard, three, iterations=2)
        inside, any_in = _around(view, core, size)
        outside, any_out = _around(view, clear, size)
        sharp = (ring > 0) & any_in & any_out & (inside - outside > 0.2 * inside)
        alpha = np.where(sharp, _share(view, inside, outside, sharp), hard)
        edge = np.stack([alpha, sharp, inside, outside], axis=2).astype(np.float32)
    return edge


def _share(light: Float32, inside: Float32, outside: Float32, where: Bools) -> Float32:
    """Return how far light is from the outside to the inside level, 0 to 1, or 0 elsewhere."""
    zero = np.zeros_like(light)
    share = np.divide(light - outside, inside - outside, out=zero, where=where)
    return np.asarray(np.clip(share, 0.0, 1.0), np.float32)


def _as_captured(light: Float32, edge: Float32, back: Float64) -> Float32:
    """Return the alpha, (H, W), in the frame of the capture, given an edge from `_at_half`.

    The levels on both sides of an edge vary slowly, so rotating them does no harm. Between these
    levels, the brightness of each texel in the original capture determines the lamp's fraction.
    """
    alpha, sharp, inside, outside = np.moveaxis(remap_frame(edge, back), 2, 0)
    reliable = (sharp > 0.99) & (inside > outside)
    share = np.where(reliable, _share(light, inside, outside, reliable), alpha)
    return np.asarray(np.clip(share, 0.0, 1.0), np.float32)


def _around(view: Float32, where: NDArray[Any], size: tuple[int, int]) -> tuple[Float32, Bools]:
    """Return the mean of a picture over `where` around each texel, and a mask of valid texels."""
    weight = cv2.blur(where.astype(np.float32), size)
    total = cv2.blur(view * where, size)
    reliable = weight > 1e-4
    mean = np.divide(total, weight, out=np.zeros_like(view), where=reliable)
    return np.asarray(mean, np.float32), np.asarray(reliable, np.bool_)


def _spots(mask: Bools) -> int:
    """Return the number of spots in a mask that are larger than noise."""
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    least = max((0.5 * len(mask) / 180.0) ** 2, 4.0)
    return int(np.count_nonzero(stats[1:count, cv2.CC_STAT_AREA] >= least))


def _areas(picture: Float32) -> Float64:
    """Return the solid angle of each texel, (H, W), in steradians."""
    height, width = picture.shape
    return np.broadcast_to(solid_angles((height, width))[:, None], (height, width))


def _median(values: Float32, weight: Float64) -> float:
    """Return the weighted median, over every fourth texel of large panoramas."""
    step = 2 if values.size > 1 << 18 else 1
    flat, weights = values[::step, ::step].ravel(), weight[::step, ::step].ravel()
    if not weights.sum() > 0.0:
        flat, weights = values.ravel(), weight.ravel()
    order = np.argsort(flat)
    weight_sum = np.cumsum(weights[order])
    return float(
        flat[order[min(int(np.searchsorted(weight_sum, 0.5 * weight_sum[-1])), flat.size - 1)]]
    )


def _nothing() -> CoreError:
    return CoreError(
        tr("No lamp stands out in this capture."),
        tr("Make the room darker, move the lamp closer and capture it again."),
    )
