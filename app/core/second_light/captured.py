"""A lamp that was captured in a dark room, and how it looks from the head wherever it is held.

The lamp is an environment with a mask (alpha): 1 where the lamp is, 0 elsewhere. What it gives is
**premultiplied**: where a texel is half lamp, its light is already half. So over a place's own
light L it is composited as eq. 7 of the paper has it,

    L_add + (1 - alpha) L.

L_add is first turned so that the middle of its energy lies straight in front of the face, then
raised by the altitude and swung by the azimuth toward the sitter's left: R = R_y R_x. The lamp is
turned at the size it was captured in, and only then reduced to the size that is searched.

Finding a lamp in the capture of a dark room: what is lamp, and what room, glow and reflection.

The panorama is first turned so that the brightest body of light lies in its middle, where texels
are square and neither seam nor pole is near. Then its outline is looked for over many levels of
brightness: while the level passes from the room's to the lamp's, the outline of a lamp with edges
stays where it is. Of several such levels the highest counts that still holds nearly all of the
light: below it the lamp's reflection on the table or the lit wall would be taken along, above it
a dim rim would be lost. Last, each piece of the edge is put where the light has half its step;
that is read from the capture as it came: turning it blurs, and a small lamp is nearly all edge.

The brush for correcting a mask is round on the sphere, whatever the panorama does to its shape.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage, luminance
from app.core.base.errors import CoreError
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.base.sphere import directions, remap_frame, rotate_light, rotation
from app.core.environment.environment import SHAPE, energy, enlarge, reduce_radiance, solid_angles
from app.core.environment.environment_file import repair
from app.core.measure.finish.masks import box_mask
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.text import tr

LARGEST: Final = (512, 1024)
"""Rows and columns that a captured lamp is kept in: 0.35 deg."""

_FINE_ROWS: Final = 256  # the least that it is turned at


@dataclass(frozen=True, slots=True, eq=False)
class CapturedLamp:
    """A lamp as the probe saw it from where the head will be."""

    name: str
    title: str
    # (H, 2 H, 3), all that was captured, linear Rec. 709, the dark room too; read-only. Panorama
    # frame
    radiance: FloatImage = field(repr=False)
    # (H, 2 H), share of each texel that the lamp covers, 0 to 1; read-only
    alpha: Float32 = field(repr=False)
    # luminance of radiance 1, cd/m2; None where the exposure was not known
    white_cd_m2: float | None = None
    distance_m: float | None = None  # from the probe to the lamp, metres; None where unknown
    camera: str = ""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the panorama."""
        return self.radiance.shape[0], self.radiance.shape[1]

    @property
    def light(self) -> FloatImage:
        """(H, 2 H, 3) float32: the lamp alone, premultiplied, in the unit of `radiance`."""
        return self.radiance * (self.alpha > 0.0)[..., None]

    @property
    def solid_angle_sr(self) -> float:
        """What the lamp covers, seen from the probe."""
        return float(energy(self.alpha))

    @property
    def lux(self) -> float | None:
        """Illuminance of a surface that faces the lamp, at its distance; None where unknown."""
        if self.white_cd_m2 is None:
            return None
        light = self.light @ np.array(LUMINANCE_WEIGHTS, np.float32)
        azimuth, elevation = centroid(self.light)
        toward = directions(self.shape) @ rotation(azimuth, elevation)[:, 2]
        return float(energy((light * np.maximum(toward, 0.0)).astype(np.float32))) * float(
            self.white_cd_m2
        )


@dataclass(frozen=True, slots=True, eq=False)
class PlacedLamp:
    """A captured lamp at all placements, as the face sees it (azimuth 0 = front)."""

    name: str
    title: str
    # (576, H, W, 3), premultiplied radiance, linear Rec. 709; number as in `placements`. cd/m2
    # where `absolute`
    light: FloatImage = field(repr=False)
    # (576, H, W), share of each texel that the lamp hides, 0 to 1
    alpha: Float32 = field(repr=False)
    # from the middle of the head, metres: the lamp holds for this distance only
    distance_m: float | None = None
    absolute: bool = True  # whether the light is in cd/m2; otherwise it is in a unit of its own


def make_lamp(
    name: str,
    radiance: FloatImage,
    alpha: Float32,
    *,
    title: str = "",
    white_cd_m2: float | None = None,
    distance_m: float | None = None,
    camera: str = "",
) -> CapturedLamp:
    """Make a lamp of a capture and its mask, repaired, and reduced where it is very fine.

    `radiance`: (H, 2 H, 3) float32, linear Rec. 709. It is not changed.
    `alpha`: (H, 2 H) float32, mask; values outside 0 to 1 are clipped, what is not a number becomes
    0.
    Raises CoreError when the sizes do not fit, or there is no light within the mask.
    """
    shape = radiance.shape
    if radiance.ndim != 3 or shape[2] != 3 or shape[0] < 1 or shape[1] != 2 * shape[0]:
        raise CoreError(
            tr("{name} is not a full panorama: it has the shape {shape}.", name=name, shape=shape)
        )
    if alpha.shape != shape[:2]:
        raise CoreError(
            tr(
                "The mask of {name} has the shape {mask}, its light {light}.",
                name=name,
                mask=alpha.shape,
                light=shape[:2],
            )
        )
    both = np.empty((*shape[:2], 4), np.float32)
    both[..., :3] = radiance
    repair(both[..., :3], name)
    both[..., 3] = np.clip(np.nan_to_num(alpha, nan=0.0), 0.0, 1.0)
    if shape[0] > LARGEST[0]:
        # The lamp's own light, so that its edge does not take the room's in.
        lamp = both[..., :3] * (both[..., 3:] > 0)
        edge = reduce_radiance(lamp, LARGEST)
        both = reduce_radiance(both, LARGEST)
        coverage = both[..., 3] > 0
        both[coverage, :3] = edge[coverage]
    light, mask = np.ascontiguousarray(both[..., :3]), np.clip(both[..., 3], 0.0, 1.0)
    if not (light[mask > 0] > 0).any():
        raise CoreError(
            tr("The mask of {name} has no light in it.", name=name), tr("Mark where the lamp is.")
        )
    light.flags.writeable = mask.flags.writeable = False
    return CapturedLamp(name, title or name, light, mask, white_cd_m2, distance_m, camera)


def centroid(light: FloatImage) -> tuple[float, float]:
    """Find the direction of the middle of an environment's energy.

    `light`: (H, W, 3) float32, linear Rec. 709, not all black.
    Panorama frame: of the sum of the directions, weighted by luminance and solid angle.
    """
    shape = light.shape[0], light.shape[1]
    bright = light @ np.array(LUMINANCE_WEIGHTS, np.float32)
    weight = bright * solid_angles(shape)[:, None]
    middle = np.einsum("hw,hwk->k", weight, directions(shape).astype(np.float64))
    return (
        math.degrees(math.atan2(-middle[0], middle[2])),
        math.degrees(math.atan2(middle[1], math.hypot(middle[0], middle[2]))),
    )


def centring(light: FloatImage) -> Float64:
    """Return the rotation that brings the middle of the energy to azimuth 0, elevation 0.

    It swings about the vertical, then lowers: a lamp that stood upright stays upright.

    `light`: (H, W, 3) float32, the lamp alone.
    Returns (3, 3) float64: moves the content, see `app.core.base.sphere`.
    """
    azimuth, elevation = centroid(light)
    return rotation(azimuth, elevation).T


def grey_lamp(lamp: CapturedLamp) -> CapturedLamp:
    """Take the colours out of a lamp, as the paper's search does."""
    grey = luminance(lamp.radiance)
    return replace(lamp, radiance=np.repeat(grey[..., None], 3, axis=2))


def place_lamp(
    lamp: CapturedLamp,
    shape: tuple[int, int] = SHAPE,
    *,
    token: Token | None = None,
    report: Report = silent,
) -> PlacedLamp:
    """Turn a lamp to all placements.

    The energy of the light is kept to 0.1 %.
    Raises ValueError when `shape` does not have one column to each azimuth.
    """
    columns = COUNT // len(ALTITUDES_DEG)
    if shape[1] != columns:
        raise ValueError(f"{shape[1]} columns for {columns} azimuths")
    fine, mask, ahead_of_face = _fine(lamp)
    light = np.empty((COUNT, *shape, 3), np.float32)
    alpha = np.empty((COUNT, *shape), np.float32)
    for row, altitude in enumerate(ALTITUDES_DEG):
        (token or Token()).check()
        report(row / len(ALTITUDES_DEG), Progress(Task.TURNING_LAMP))
        raised = rotation(0.0, float(altitude)) @ ahead_of_face
        ahead, hidden = _rotate(fine, mask, raised, shape)
        for column in range(columns):
            # Toward the sitter's left is to the left in the panorama.
            light[row * columns + column] = np.roll(ahead, -column, axis=1)
            alpha[row * columns + column] = np.roll(hidden, -column, axis=1)
    has_white = lamp.white_cd_m2 is not None
    return PlacedLamp(lamp.name, lamp.title, light, alpha, lamp.distance_m, has_white)


def placed_at(
    lamp: CapturedLamp, azimuth_deg: float, altitude_deg: float, shape: tuple[int, int] = SHAPE
) -> tuple[FloatImage, Float32]:
    """Turn a lamp to any one placement.

    Returns `light`: (H, W, 3) float32, as one of `PlacedLamp.light`.
    and `alpha`: (H, W) float32, as one of `PlacedLamp.alpha`.
    """
    light, alpha, ahead = _fine(lamp)
    return _rotate(light, alpha, rotation(-azimuth_deg, altitude_deg) @ ahead, shape)


def _fine(lamp: CapturedLamp) -> tuple[Float32, Float32, Float64]:
    """Bring a lamp to the size that it is turned at, in cd/m2 where that is known.

    Returns its light, its mask, and the rotation that brings it straight ahead.
    """
    light = lamp.light
    if lamp.white_cd_m2 is not None:
        light = light * np.float32(lamp.white_cd_m2)
    alpha = lamp.alpha
    times = -(-_FINE_ROWS // lamp.shape[0])
    if times > 1:
        fine_shape = lamp.shape[0] * times, lamp.shape[1] * times
        light, alpha = enlarge(light, fine_shape), enlarge(alpha, fine_shape)
    return light, alpha, centring(light)


def _rotate(
    light: Float32, alpha: Float32, matrix: Float64, shape: tuple[int, int]
) -> tuple[Float32, Float32]:
    rotated = rotate_light(light, matrix)
    energy_before, got = energy(light), energy(rotated)
    # Of a lamp over a pole some 0.1 % is lost.
    rotated *= np.divide(energy_before, got, out=np.ones_like(got), where=got > 0).astype(
        np.float32
    )
    # Plain interpolation for the mask: an area that is covered stays covered, with 1.
    hidden = np.asarray(remap_frame(alpha, matrix), np.float32)
    hidden_share = reduce_radiance(hidden[..., None], shape)[..., 0]
    return reduce_radiance(rotated, shape), np.clip(hidden_share, 0.0, 1.0)


Point: TypeAlias = tuple[float, float]
"""Azimuth and elevation in the capture, deg."""

_APART: Final = 0.5  # of the radius: dabs of a stroke lie no farther from each other


def stroke(alpha: Float32, points: tuple[Point, ...], radius_deg: float, is_lamp: bool) -> Float32:
    """Set or clear what a round brush covers from point to point, the shorter way around.

    `alpha`: (H, 2 H) float32, share of each texel that the lamp covers, 0 to 1; not changed.
    `radius_deg`: of the brush, deg; at least one texel is taken.
    Returns (H, 2 H) float32: texels that the edge goes through are blended.
    """
    rows, columns = alpha.shape
    step = 180.0 / rows
    radius = max(radius_deg, 0.5 * step)
    new = alpha.copy()
    height = np.radians(90.0 - step * (np.arange(rows) + 0.5))
    around = np.radians(step * (np.arange(columns) + 0.5) - 180.0)
    for azimuth, elevation in _along(points, max(_APART * radius, step)):
        # Only the rows that it can reach.
        first = max(math.floor((90.0 - elevation - radius) / step) - 1, 0)
        last = min(math.ceil((90.0 - elevation + radius) / step) + 1, rows)
        if first >= last:
            continue
        across, middle = np.cos(around - math.radians(azimuth)), math.radians(elevation)
        near = np.outer(math.cos(middle) * np.cos(height[first:last]), across)
        near += (math.sin(middle) * np.sin(height[first:last]))[:, None]
        away = np.degrees(np.arccos(np.clip(near, -1.0, 1.0)))
        share = np.clip((radius - away) / step + 0.5, 0.0, 1.0).astype(np.float32)
        part = new[first:last]
        new[first:last] = np.maximum(part, share) if is_lamp else np.minimum(part, 1.0 - share)
    return new


def _along(points: tuple[Point, ...], step: float) -> list[Point]:
    """Points of a stroke, none farther than `step` from the next, deg."""
    path = [points[0]]
    for (a, e), (b, f) in pairwise(points):
        across = (b - a + 180.0) % 360.0 - 180.0
        count = max(math.ceil(math.hypot(across, f - e) / step), 1)
        path += [(a + across * k / count, e + (f - e) * k / count) for k in range(1, count + 1)]
    return path


_GRID: Final = (256, 512)
_STANDS_OUT: Final = 2.5  # times the room's median
_STEPS: Final = 17  # quarter stops below the lamp's level
_BRIDGE_DEG: Final = 0.75  # half of what may lie between the parts of one lamp
_LARGEST: Final = 0.2  # share of the sphere
_STEADY: Final = 0.15  # change of the area within half a stop
_HOLDS: Final = 0.7  # of the squared light, which counts bright parts more than wide ones
_RING_DEG: Final = 1.0  # around the edge, for its two sides' levels
_DARK: Final = 10.0  # times brighter than the room a lamp should be
_BURNT: Final = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class LampMask:
    """Where the lamp is in a capture."""

    alpha: Float32 = field(repr=False)  # (H, 2 H), share of each texel that the lamp covers, 0 to 1
    contrast: float
    rejected: int
    clipped: float  # share of the lamp that is clipped in every frame, 0 to 1

    @property
    def in_lit_room(self) -> bool:
        """Whether the room is too bright for a lamp to be told apart well."""
        return self.contrast < _DARK

    @property
    def burnt_out(self) -> bool:
        """Whether part of the lamp is clipped in every frame."""
        return self.clipped > _BURNT


def find_mask(radiance: FloatImage, clipped: Float32 | None = None) -> LampMask:
    """Find the lamp in a capture of a dark room.

    `radiance`: (H, 2 H, 3) float32, linear Rec. 709, any scale, finite and not negative.
    `clipped`: (H, 2 H) float32, share of each texel that is clipped in every frame.
    One lamp: the body of light that holds most of it.
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
    """Set or clear a box of a lamp's mask: azimuth from and to, elevation from and to, deg.

    Raises CoreError when no light would be left.
    """
    region = box_mask(*box, lamp.shape) > 0.5
    alpha = np.where(region, np.float32(is_lamp), lamp.alpha).astype(np.float32)
    values = {"white_cd_m2": lamp.white_cd_m2, "distance_m": lamp.distance_m}
    return make_lamp(
        lamp.name, lamp.radiance, alpha, title=lamp.title, camera=lamp.camera, **values
    )


def _core(light: Float32) -> tuple[Point, Bools]:
    """Find the body that holds most of the light: its middle, and (h, w) where it is surely.

    Over all levels of brightness, what hangs together above a level is counted by its light and
    by how it stands out of what is around it: neither sparks nor lit walls shall pass for a lamp.
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
        # Upward, so that of nearly equal ones the highest counts: less hangs on to it.
        if score > 0.9 * best:
            best, mask = max(score, best), body
    if best == 0.0:
        raise _nothing()
    peaky = np.where(mask, grid, np.float32(0.0))
    return centroid(np.repeat(peaky[..., None], 3, axis=2)), mask


def _most(bright: Bools, excess: Float64, weight: Float64) -> tuple[float, Bools]:
    """Find which connected part of a mask holds the most light, and how much."""
    columns = bright.shape[1]
    # Twice, side by side, so that no seam parts a lamp.
    twice = np.concatenate([bright, bright], axis=1).astype(np.uint8)
    labels = cv2.connectedComponents(twice, connectivity=8)[1]
    areas, sums = (np.bincount(labels.ravel(), np.tile(v, 2).ravel()) for v in (weight, excess))
    sums[0] = 0.0
    sums[areas > 2.0 * _LARGEST * 4.0 * np.pi] = 0.0
    largest = labels == int(np.argmax(sums))
    body: Bools = largest[:, :columns] | largest[:, columns:]
    return float(excess[body].sum()) if sums.max() > 0.0 else 0.0, body


def _standing_out(grid: Float32, body: Bools, weight: Float64) -> float:
    """How many times brighter a body is than what is around it; no more than dark rooms need."""
    near = body.astype(np.uint8)
    wide = cv2.dilate(near, np.ones((9, 9), np.uint8)) - cv2.dilate(near, np.ones((3, 3), np.uint8))
    around = _median(grid, np.where(wide > 0, weight, 0.0)) if wide.any() else 0.0
    own = float((grid * weight)[body].sum() / weight[body].sum())
    return min(own / max(around, own / _DARK), _DARK)


def _outline(view: Float32, core: Bools) -> tuple[Bools, float, int]:
    """Find the lamp's texels, its core being known, both around the middle of the panorama.

    With them its contrast to the room, and how many other spots are as bright.
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
    """Find the lamp's own level: more than half of its squared light lies below it."""
    order = np.argsort(values)
    energy = np.cumsum((values.astype(np.float64) ** 2 * weight)[order])
    if not (energy.size and energy[-1] > 0.0):
        raise _nothing()
    return float(values[order[int(np.searchsorted(energy, 0.6 * energy[-1]))]])


def _body(bright: Bools, core: Bools) -> Bools:
    """Mark what hangs together with most of the core, small gaps bridged."""
    radius = max(round(_BRIDGE_DEG * bright.shape[0] / 180.0), 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    joint = cv2.dilate(bright.astype(np.uint8), kernel)
    labels = cv2.connectedComponents(joint, connectivity=8)[1]
    counts = np.bincount(labels[core & bright], minlength=1)
    counts[0] = 0
    return np.asarray((labels == int(np.argmax(counts))) & bright & bool(counts.any()))


def _best_level(areas: list[float], powers: list[float]) -> int:
    """Choose the level at which the outline stands still, see the module's text.

    Args:
        areas, powers: Of the lamp at each level of brightness: sr, and its squared light.
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
    """Put the edge where the light has half its step.

    Returns (H, W, 4) float32: alpha, soft over one texel; whether it was found from the lamp's
    light and the room's on both sides of the edge, 0 or 1; and these two.
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
    """How far light is from outside's level to inside's, 0 to 1; 0 elsewhere."""
    zero = np.zeros_like(light)
    share = np.divide(light - outside, inside - outside, out=zero, where=where)
    return np.asarray(np.clip(share, 0.0, 1.0), np.float32)


def _as_captured(light: Float32, edge: Float32, back: Float64) -> Float32:
    """(H, W) alpha in the frame of the capture, from `_at_half`.

    The levels on both sides of an edge change slowly and can be turned; where they are known, a
    texel of the capture itself says how much of it is lamp.
    """
    alpha, sharp, inside, outside = np.moveaxis(remap_frame(edge, back), 2, 0)
    reliable = (sharp > 0.99) & (inside > outside)
    share = np.where(reliable, _share(light, inside, outside, reliable), alpha)
    return np.asarray(np.clip(share, 0.0, 1.0), np.float32)


def _around(view: Float32, where: NDArray[Any], size: tuple[int, int]) -> tuple[Float32, Bools]:
    """Mean of a picture over a region around each texel, and where there is any of it."""
    weight = cv2.blur(where.astype(np.float32), size)
    total = cv2.blur(view * where, size)
    reliable = weight > 1e-4
    mean = np.divide(total, weight, out=np.zeros_like(view), where=reliable)
    return np.asarray(mean, np.float32), np.asarray(reliable, np.bool_)


def _spots(mask: Bools) -> int:
    """Count the spots of a mask that are larger than noise."""
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    least = max((0.5 * len(mask) / 180.0) ** 2, 4.0)
    return int(np.count_nonzero(stats[1:count, cv2.CC_STAT_AREA] >= least))


def _areas(picture: Float32) -> Float64:
    """Solid angle of each texel, (H, W)."""
    height, width = picture.shape
    return np.broadcast_to(solid_angles((height, width))[:, None], (height, width))


def _median(values: Float32, weight: Float64) -> float:
    """Weighted median, over every fourth texel of large panoramas."""
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
        tr("Make the room darker, put the lamp nearer, and capture again."),
    )
