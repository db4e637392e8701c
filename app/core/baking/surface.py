"""Looking at a head's shape: where each pixel's skin is, and its outlines."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.baking.lanes import run_lanes
from app.core.baking.scene import MILLIMETRES_PER_UNIT, HeadMesh
from app.core.base.arrays import Bools, Float32, Float64, Int64
from app.core.solver.head_shape import HeadShape

_STEPS: Final = 16  # rays along each side of a pixel, the very ones that find its coverage
_EARS_UNITS: Final = 0.7  # how far from the height of the eyes ears are looked for
_EAR_SHARE: Final = 0.03  # of the vertices there: the outermost
_THIN_M: Final = 0.006
_DOTS_PER_M: Final = 2000
_SMOOTH_M: Final = 0.0005
_CHIN_UNITS: Final = 1.25  # what is further under the eyes is neck


def head_middle(head: HeadMesh) -> Float64:
    """Midway between the ears, (3,) float64, scene units: the outermost points at eye height."""
    vertices = head.skin.vertices.astype(np.float64)
    beside = vertices[np.abs(vertices[:, 1] - head.eye_point[1]) < _EARS_UNITS]
    out = np.abs(beside[:, 0])
    ears = beside[out >= np.quantile(out, 1.0 - _EAR_SHARE)]
    return np.array([0.0, ears[:, 1].mean(), ears[:, 2].mean()])


def look_at_shape(head: HeadMesh, scene: Any, pixels: NDArray[np.int32], size: int) -> HeadShape:
    """Find where the pixels of a head's picture look.

    Args:
        pixels: (P,) int32. Flat row-major numbers of the pixels that the head covers.
        size: Pixels along one side.
    """
    middle = head_middle(head)
    metres = MILLIMETRES_PER_UNIT / 1000.0
    sums, hits = _seen(scene, size)
    if head.symmetric:
        sums, hits = sums + sums[:, ::-1] * [-1.0, 1.0, 1.0], hits + hits[:, ::-1]
    places = (sums / np.maximum(hits, 1.0)[..., None] - middle) * metres
    skin = (head.skin.vertices - middle) * metres
    faces = head.skin.faces.astype(np.int64)
    parts = [skin] if head.eyes is None else [skin, (head.eyes.vertices - middle) * metres]
    return HeadShape(
        head=head.name,
        pixels=pixels,
        positions=places.reshape(-1, 3)[pixels].astype(np.float32),
        skin=_thinned(np.concatenate(parts)).astype(np.float32),
        above=_outline(skin[:, [0, 2]], faces[_above_neck(head, faces)]),
        side=_outline(skin[:, [2, 1]], faces),
        eye_point=((np.array(head.eye_point) - middle) * metres).astype(np.float32),
    )


def _seen(scene: Any, size: int) -> tuple[Float64, Float64]:
    """Sum of the places on the head that each pixel's rays hit, (N, N, 3), and their number."""
    import drjit as dr
    import mitsuba as mi

    side = size * _STEPS
    sensor = scene.sensors()[0]

    def kernel(lane: Any, rng: Any) -> tuple[Any, ...]:
        del rng
        column, row = mi.Float(lane % side), mi.Float(lane // side)
        film = mi.Point2f((column + 0.5) / side, (row + 0.5) / side)
        ray, _ = sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
        found = scene.ray_intersect_preliminary(ray)
        hit = found.is_valid()
        place = ray(dr.select(hit, found.t, 0.0))
        seen = dr.select(hit, mi.Float(1), mi.Float(0))
        return seen, place.x * seen, place.y * seen, place.z * seen

    sums = np.stack(run_lanes(side * side, 0, kernel)).astype(np.float64)
    blocks = sums.reshape(4, size, _STEPS, size, _STEPS).sum(axis=(2, 4))
    return np.moveaxis(blocks[1:], 0, -1), blocks[0]


def _thinned(points: Float64) -> Float64:
    """One point for each cell of a grid: as many as it takes to measure distances."""
    _, first = np.unique(np.floor(points / _THIN_M).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(first)]


def _above_neck(head: HeadMesh, faces: Int64) -> Bools:
    heights = head.skin.vertices[:, 1][faces].min(axis=1)
    return np.asarray(heights > head.eye_point[1] - _CHIN_UNITS)


def _outline(points: Float64, faces: Int64) -> Float32:
    """(n, 2) closed outline of a mesh's shadow, metres, counter-clockwise."""
    start = points.min(axis=0) - 0.01
    dots = (points - start) * _DOTS_PER_M
    wide, tall = np.ceil(dots.max(axis=0) + 0.01 * _DOTS_PER_M).astype(int)
    shadow = np.zeros((tall, wide), np.uint8)
    for triangle in np.round(dots[faces]).astype(np.int32):
        cv2.fillConvexPoly(shadow, triangle, 255)
    contours, _ = cv2.findContours(shadow, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    longest = max(contours, key=cv2.contourArea)
    smooth = cv2.approxPolyDP(longest, _SMOOTH_M * _DOTS_PER_M, True)[:, 0].astype(np.float64)
    # OpenCV's y points down, so what it calls clockwise is counter-clockwise here.
    if cv2.contourArea(smooth.astype(np.float32), True) < 0:
        smooth = smooth[::-1]
    return np.asarray(smooth / _DOTS_PER_M + start, np.float32)
