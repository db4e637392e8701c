"""The view of any camera around the sitter of the demo location, from its rendered views.

The world position of each of the camera's pixels is found from the depth of several views: all
their points are projected into the picture, and the nearest counts. Each pixel is then looked up in
the views that see that position, nearest view first; areas that none of them shows come from the
panorama, in the direction in which the probe saw the position. So parallax and occlusion are right,
and the panorama's part is known (`SceneView.from_panorama`).

The sitter, who turns with the camera, is drawn over it: from the two views nearest to this turn, as
if both had been taken at this turn, shifted by the sitter's own depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.angles import difference, wrap
from app.core.base.colour import srgb_encode
from benchmarks.heading.scripted_turn.scene_camera import PinholeCamera
from benchmarks.heading.scripted_turn.scene_files import EYE_M, SceneFiles, Shot, level_pose, shown

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.localization.views import Lens

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

_AXES: Final = np.diag([-1.0, -1.0, 1.0])  # camera axes from those of a panorama
_COARSE: Final = 0.9  # of a shot's depth map, so that its points leave no holes
# closer to objects by this factor, for a camera that looks away from the sitter
_BEYOND: Final = 2.5
_STEPS: Final = 3  # iterations for the sitter's depth
_AGREES: Final = (0.06, 0.004)  # of inverse depths: relative, and 1/m
_WORTH: Final = 0.002  # a shot that adds less of the picture is left out
_SIDES: Final = (-20.0, 20.0)  # beside the part of the picture that the nearest views cover
_PANORAMA: Final = 2048
_LEVELS: Final = 4095
_ROW: Final = 1024


@dataclass(frozen=True, slots=True)
class Stand:
    """Position and attitude of the camera.

    Attributes:
        turn_deg: Turn of the sitter, together with the camera; deg, positive clockwise.
        distance_m: Distance from the sitter's head, metres, within that of the views.
        aim_deg: Aim to the right of the sitter, deg.
        pitch_deg, roll_deg: Up, and the camera clockwise; deg.
        away: Whether it points away from the sitter instead, like a laptop's own camera that is
            carried around them; `aim_deg` is then from that direction, and the picture shows the
            holder in place of the sitter.
    """

    turn_deg: float
    distance_m: float = 1.5
    aim_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    away: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class SceneView:
    """The camera's view, and its truth.

    Attributes:
        picture: (H, W, 3) uint8. sRGB, not mirrored.
        heading_deg: Panorama azimuth of the axis, in (-180, 180], deg.
        sitter_deg: Horizontal angle of the sitter, or of the person in their place, from the axis,
            positive to the right, deg.
        turn_deg: In (-180, 180], deg: heading + sitter - 180, and for a camera that looks away
            heading - aim.
        from_panorama: Share of the picture that no view shows, 0 to 1.
    """

    picture: Bytes = field(repr=False)
    heading_deg: float
    sitter_deg: float
    turn_deg: float
    from_panorama: float


class SceneViews:
    """The demo location as seen by any camera near the sitter; for one thread.

    Args:
        panorama: (H, 2 H, 3) float32. The probe's panorama at the sitter's head: linear Rec. 709
            radiance, cd/m2.

    Raises:
        CoreError: If the views are missing or damaged.
    """

    def __init__(self, folder: Path, panorama: Float32, *, sitter: bool = True) -> None:
        self._files = SceneFiles(folder)
        size = (_PANORAMA, _PANORAMA // 2)
        around = cv2.resize(panorama, size, interpolation=cv2.INTER_AREA)
        self._panorama = np.asarray(around, np.float32)
        self._sitter = sitter

    @property
    def distances_m(self) -> tuple[float, float]:
        """Smallest and largest distance of a camera, metres."""
        return float(self._files.distances[0]), float(self._files.distances[-1])

    def view(
        self, stand: Stand, lens: Lens, without: tuple[float, float] | None = None
    ) -> SceneView:
        """Return a camera's view.

        Args:
            without: Turn (deg) and distance (metres) of a view to leave out, for comparison with
                it.

        Returns:
            The picture, exposed like the views around it, and the truth.

        Raises:
            ValueError: If it is closer or further than the views, or the size is odd.
            CoreError: If files are missing or damaged.
        """
        nearest, furthest = self.distances_m
        if not nearest <= stand.distance_m <= furthest:
            raise ValueError(f"the camera is {nearest} to {furthest} m away")
        if lens.size[0] % 2 or lens.size[1] % 2:
            raise ValueError("columns and rows are even")
        position, _ = level_pose(stand.turn_deg, stand.distance_m)
        # The area behind the camera is visible over the sitter from the opposite side.
        across = stand if not stand.away else replace(stand, turn_deg=stand.turn_deg + 180.0)
        heading = across.turn_deg + 180.0 + stand.aim_deg
        turned = sphere.rotation(heading, stand.pitch_deg, stand.roll_deg) @ _AXES
        camera = PinholeCamera(position, turned.T, lens.focal_px, lens.size)
        around = self._around(across, without)
        shots = [self._files.shot(*key) for key in self._chosen(across, lens, around, without)]
        light, missing = self._background(camera, shots, _BEYOND if stand.away else 1.0)
        if self._sitter:
            facing = camera if not stand.away else camera.turned_round()
            self._add_sitter(light, facing, stand, self._around(stand, without))
        light *= np.float32(self._exposure(around))
        return SceneView(
            _picture(light),
            wrap(heading),
            -stand.aim_deg + 0.0,
            wrap(stand.turn_deg),
            missing,
        )

    # -- which views ---------------------------------------------------------------------------

    def _around(
        self, stand: Stand, without: tuple[float, float] | None
    ) -> list[tuple[float, float, float]]:
        """Return the two views before and after this turn: turn, distance, share."""
        away = np.abs(self._files.distances - stand.distance_m)
        ring = float(self._files.distances[int(np.argmin(away))])
        turns = [float(t) for t in self._files.turns if (float(t), ring) != without]
        gaps = [difference(stand.turn_deg, t) for t in turns]
        before = min((gap, t) for gap, t in zip(gaps, turns, strict=True) if gap >= 0.0)
        after = min((-gap, t) for gap, t in zip(gaps, turns, strict=True) if gap < 0.0)
        share = before[0] / (before[0] + after[0])
        pair = [(before[1], ring, 1.0 - share), (after[1], ring, share)]
        return sorted((one for one in pair if one[2] > 0.0), key=lambda one: -one[2])

    def _chosen(
        self,
        stand: Stand,
        lens: Lens,
        around: list[tuple[float, float, float]],
        without: tuple[float, float] | None,
    ) -> list[tuple[float, float]]:
        """Return the views for looking up pixels, best first."""
        files = self._files
        keys = [(turn, ring) for turn, ring, _ in around]
        # A view from further away shows more; areas on both sides are visible from beside.
        rings = sorted(files.distances, key=lambda d: abs(float(d) - stand.distance_m))
        keys += [(turn, float(ring)) for ring in rings[1:] for turn, _, _ in around]
        spare = max(lens.fov_deg - files.fov_deg, 0.0) / 2.0
        for side in _SIDES:
            beside = stand.aim_deg + side + math.copysign(spare, side)
            turn = _nearest(files.turns, stand.turn_deg + beside)
            keys += [(turn, around[0][1]), (turn, float(files.distances[-1]))]
        return [key for key in dict.fromkeys(keys) if key != without]

    def _exposure(self, around: list[tuple[float, float, float]]) -> float:
        logs = [share * math.log(self._files.exposure(turn, ring)) for turn, ring, share in around]
        return math.exp(math.fsum(logs))

    # -- the background ------------------------------------------------------------------------

    def _background(
        self, camera: PinholeCamera, shots: list[Shot], nearer: float
    ) -> tuple[Float32, float]:
        """Return radiance, (H, W, 3), and the panorama's share."""
        half = camera.smaller(2.0)
        near, far = self._depth(camera, half, shots, nearer)
        rays = half.rays()
        places = [half.world(rays, inverse) for inverse in (near, far)]
        left = np.ones(near.size, bool)
        used: list[tuple[Shot, Float32, Mask]] = []
        for shot in shots:
            maps, found = self._looked_up(shot, places, left)
            if found.mean() >= _WORTH:
                left &= ~found
                used.append((shot, maps, found))
        light = np.zeros((camera.size[1], camera.size[0], 3), np.float32)
        self._from_panorama(light, places[0], left, half)
        shape = (half.size[1], half.size[0])
        for order, (shot, maps, found) in reversed(list(enumerate(used))):
            _paint(light, shot.light, maps.reshape(2, *shape), found.reshape(shape), order > 0)
        return light, float(left.mean())

    def _depth(
        self, camera: PinholeCamera, half: PinholeCamera, shots: list[Shot], nearer: float
    ) -> tuple[Float32, Float32]:
        """Return inverse depth at half size; and the same with edges moved to the background."""
        coarse = camera.smaller(nearer * camera.focal_px / (_COARSE * self._files.focal_px / 2.0))
        columns, rows = coarse.size
        inverse = np.zeros(columns * rows, np.float32)
        for shot in shots:
            x, y, near = coarse.seen(shot.points.T)
            inside = (x >= 0) & (y >= 0) & (x < columns) & (y < rows) & (near > 0)
            at = y[inside].astype(np.int64) * columns + x[inside].astype(np.int64)
            np.maximum.at(inverse, at, near[inside])
        known = _completed(inverse.reshape(rows, columns), coarse)
        behind = cv2.erode(known, np.ones((3, 3), np.uint8))
        parts = [
            cv2.resize(one, half.size, interpolation=cv2.INTER_LINEAR) for one in (known, behind)
        ]
        return np.asarray(parts[0], np.float32).ravel(), np.asarray(parts[1], np.float32).ravel()

    def _looked_up(self, shot: Shot, places: list[Float32], left: Mask) -> tuple[Float32, Mask]:
        """Look up positions in a view: columns and rows, and a mask of where it sees them."""
        position, rotation = level_pose(shot.turn_deg, shot.distance_m)
        rows, columns = shot.inverse.shape
        camera = PinholeCamera(position, rotation, self._files.focal_px / 2.0, (columns, rows))
        maps = np.full((2, left.size), -9.0, np.float32)
        found = np.zeros(left.size, bool)
        for points in places:
            todo = np.flatnonzero(left & ~found)
            if not todo.size:
                break
            x, y, inverse = camera.seen(points[:, todo])
            x, y = x - np.float32(0.5), y - np.float32(0.5)
            there = _sampled(shot.inverse, x, y, cv2.INTER_LINEAR)
            clear = _sampled(shot.behind.astype(np.uint8), x, y, cv2.INTER_NEAREST)
            same = np.abs(there - inverse) <= _AGREES[0] * inverse + _AGREES[1]
            inside = (x > -0.4) & (y > -0.4) & (x < columns - 0.6) & (y < rows - 0.6)
            good = same & inside & (clear > 0) & (inverse > 0)
            at = todo[good]
            maps[0, at], maps[1, at], found[at] = x[good], y[good], True
        return maps * np.float32(2.0) + np.float32(0.5), found

    def _from_panorama(
        self, light: Float32, points: Float32, left: Mask, half: PinholeCamera
    ) -> None:
        if not left.any():
            return
        shape = (half.size[1], half.size[0])
        eye = np.array([0.0, EYE_M, 0.0], np.float32)[:, None]
        vectors = (points - eye).T.reshape(*shape, 3)
        vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
        height, width = self._panorama.shape[:2]
        columns, rows = sphere.positions(vectors, (height, width))
        small = cv2.remap(
            self._panorama, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP
        )
        size = (light.shape[1], light.shape[0])
        light[...] = cv2.resize(small, size, interpolation=cv2.INTER_LINEAR)

    # -- the sitter ----------------------------------------------------------------------------

    def _add_sitter(
        self,
        light: Float32,
        camera: PinholeCamera,
        stand: Stand,
        around: list[tuple[float, float, float]],
    ) -> None:
        total = np.zeros((*light.shape[:2], 4), np.float32)
        for turn, ring, share in around:
            shot = self._files.shot(turn, ring)
            # As if the view had been taken at this turn: the sitter turns with the camera.
            position, rotation = level_pose(stand.turn_deg, ring)
            rows, columns = shot.inverse.shape
            source = PinholeCamera(position, rotation, self._files.focal_px / 2.0, (columns, rows))
            maps = _sitter_maps(camera.smaller(4.0), source, shot)
            size = (light.shape[1], light.shape[0])
            x, y = (cv2.resize(m, size, interpolation=cv2.INTER_LINEAR) * 2.0 + 0.5 for m in maps)
            layer = np.dstack([shot.light * shot.share[..., None], shot.share])
            # Below the view's edge the clothes continue.
            total += np.float32(share) * cv2.remap(
                layer, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            )
        light *= np.float32(1.0) - total[..., 3:]
        light += total[..., :3]


def _sitter_maps(
    camera: PinholeCamera, source: PinholeCamera, shot: Shot
) -> tuple[Float32, Float32]:
    """Return the positions of the sitter's pixels in a view's depth map, for each camera pixel."""
    depth = _continued(np.where(shot.sitter, shot.inverse, np.float32(0.0)))
    rays = camera.rays()
    inverse: Float32 = np.full(rays.shape[1], 1.0 / shot.distance_m, np.float32)
    shift = float(np.linalg.norm(camera.position - source.position))
    sign = 1.0 if np.linalg.norm(camera.position[[0, 2]]) > shot.distance_m else -1.0
    for step in range(_STEPS):
        x, y, _ = source.seen(camera.world(rays, inverse))
        x, y = x - np.float32(0.5), y - np.float32(0.5)
        if step + 1 < _STEPS:
            there = _sampled(depth, x, y, cv2.INTER_LINEAR)
            moved = 1.0 / there + np.float32(sign * shift)
            inverse = np.asarray(1.0 / moved, np.float32)
    shape = (camera.size[1], camera.size[0])
    return x.reshape(shape), y.reshape(shape)


def _sampled(image: NDArray[Any], x: Float32, y: Float32, how: int) -> NDArray[Any]:
    """Sample any number of positions, (N,), in a picture; outside it the edge is repeated."""
    rows = -(-x.size // _ROW)  # OpenCV does not accept long rows
    across, down = (np.resize(one, (rows, _ROW)) for one in (x, y))
    looked = cv2.remap(image, across, down, how, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(looked).ravel()[: x.size]


def _completed(inverse: Float32, camera: PinholeCamera) -> Float32:
    """Fill missing depth: small gaps from beside, the floor, and the rest by continuation."""
    gaps = inverse <= 0.0
    if not gaps.any():
        return inverse
    grown = cv2.dilate(inverse, np.ones((3, 3), np.uint8))
    whole = cv2.morphologyEx((~gaps).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    filled = np.where(gaps & (whole > 0), grown, inverse)
    # The rest is beyond the views: the floor is known there, walls and ceiling continue.
    down = (camera.rotation[:, 1].astype(np.float32) @ camera.rays()).reshape(inverse.shape)
    floor = np.maximum(-down, np.float32(0.0)) / np.float32(camera.position[1])
    beyond = filled <= 0.0
    return np.where(beyond, np.maximum(_continued(filled), floor), filled).astype(np.float32)


def _continued(inverse: Float32) -> Float32:
    """Replace unknown values (0) by the nearest known one."""
    mask = (inverse <= 0.0).astype(np.uint8)
    if not mask.any() or mask.all():
        return inverse
    _, labels = cv2.distanceTransformWithLabels(
        mask, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = np.zeros(int(labels.max()) + 1, np.float32)
    nearest[labels[mask == 0]] = inverse[mask == 0]
    return np.asarray(nearest[labels], np.float32)


def _paint(light: Float32, source: Float32, maps: Float32, found: Mask, below: bool) -> None:
    """Draw a view's part where it was found, in a picture of twice the size.

    A gap of one pixel is missed depth rather than another object. A view `below` others extends
    under their soft edges.
    """
    how = cv2.MORPH_DILATE if below else cv2.MORPH_CLOSE
    whole = cv2.morphologyEx(found.astype(np.uint8), how, np.ones((3, 3), np.uint8))
    across, down, wide, tall = cv2.boundingRect(whole)
    left, top = max(across - 1, 0), max(down - 1, 0)
    part = (slice(top, down + tall + 1), slice(left, across + wide + 1))
    enlarged = light[2 * part[0].start : 2 * part[0].stop, 2 * left : 2 * part[1].stop]
    size = (enlarged.shape[1], enlarged.shape[0])
    share = _twice(whole[part].astype(np.float32), size)
    x, y = (_twice(_spread(m[part], found[part]), size) for m in maps)
    seen = cv2.remap(source, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    enlarged[...] = cv2.blendLinear(seen, enlarged, share, np.float32(1.0) - share)


def _twice(values: Float32, size: tuple[int, int]) -> Float32:
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_LINEAR), np.float32)


def _spread(places: Float32, found: Mask) -> Float32:
    """Continue a map slightly over its edge, so that it can be enlarged."""
    weight = cv2.blur(found.astype(np.float32), (3, 3))
    total = cv2.blur(np.where(found, places, np.float32(0.0)), (3, 3))
    return np.where(found, places, total / np.maximum(weight, np.float32(1e-6)))


def _nearest(turns: Float64, turn_deg: float) -> float:
    return min((float(t) for t in turns), key=lambda t: abs(difference(t, turn_deg)))


def _picture(light: Float32) -> Bytes:
    table = np.round(srgb_encode(np.arange(_LEVELS + 1) / _LEVELS) * 255.0).astype(np.uint8)
    tone = shown(np.maximum(light, np.float32(0.0)))
    return np.asarray(table[(tone * np.float32(_LEVELS) + 0.5).astype(np.uint16)])
