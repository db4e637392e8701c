"""Light that reaches the nodes of a portrait, and its transport in the skin from node to node."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import cv2
import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from app.core.baking.exposure import Points
from app.core.baking.random_walk import SceneTables, trace_pixels
from app.core.baking.scene import HeadMesh
from app.core.portrait.portrait_head import SPREAD
from scenes.portraits.scene import Frame, Samples

Float32 = NDArray[np.float32]
Ints = NDArray[np.int64]
SKY = (32, 64)
_FINE = 4
"""Rays along each side of a texel."""
_PAD = 24
STEP = 6.0
"""Steps of the stored distance in one ray's spacing (1.4 degrees)."""
_LIMIT = 24
_BEHIND = -0.15
_OFFSET = 1e-3
_BATCH = 256
FILM = 8192
_MIRROR = np.array([-1, 1, 1], np.float32)
_TURNED = 0.02
"""Square units equivalent to a right angle between normals, when searching the nearest node."""
_APART = 0.015
_CELL = 0.025


@dataclass(frozen=True, slots=True)
class Nodes:
    """Points on skin and eyes where light is computed; of the left half.

    The mirror image of node k is node k + count.
    """

    positions: Float32
    normals: Float32

    @property
    def count(self) -> int:
        """Number of nodes of the left half."""
        return len(self.positions)

    def both(self) -> tuple[Float32, Float32]:
        """Return the positions and normals of both halves."""
        return (
            np.concatenate([self.positions, self.positions * _MIRROR]),
            np.concatenate([self.normals, self.normals * _MIRROR]),
        )


def nearest(nodes: Nodes, positions: Float32, normals: Float32) -> tuple[Ints, Float32]:
    """Return the nearest node of both halves with a similar normal, and its distance."""
    there, way = nodes.both()
    found, away = np.empty(len(positions), np.int64), np.empty(len(positions), np.float32)
    for start in range(0, len(positions), 500):
        part = slice(start, start + 500)
        squared = ((positions[part, None] - there[None]) ** 2).sum(2)
        chosen = (squared + _TURNED * (1 - normals[part] @ way.T)).argmin(1)
        found[part] = chosen
        away[part] = np.sqrt(squared[np.arange(len(chosen)), chosen])
    return found, away


def seen_nodes(points: Points, samples: Samples) -> tuple[Nodes, Ints, Ints]:
    """Return the nodes that the samples show, each sample's three, and a point of each node."""
    used = np.unique(samples.points[samples.valid][samples.weights[samples.valid] > 0])
    key = np.round(points.positions[used].astype(np.float64) * 2e4).astype(np.int64)
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    chosen = used[first]
    of_point = np.zeros(points.count, np.int64)
    of_point[used] = inverse.ravel()
    nodes = Nodes(points.positions[chosen], points.normals[chosen])
    return nodes, of_point[samples.points] * samples.valid[:, None], chosen


def hidden_nodes(nodes: Nodes, points: Points, mass: Float32) -> Ints:
    """Return points that no pixel shows but whose light comes through, a few millimetres apart."""
    able = np.flatnonzero(mass > 0.02 * np.median(mass[mass > 0]))
    _, away = nearest(nodes, points.positions[able], points.normals[able])
    far = able[away > _APART]
    folded = points.positions[far] * np.where(points.positions[far, :1] > 0, _MIRROR, 1)
    cell = np.floor(folded / _CELL).astype(np.int64)
    keys = np.concatenate([cell, np.round(points.normals[far]).astype(np.int64)], axis=1)
    _, first = np.unique(keys, axis=0, return_index=True)
    return np.asarray(far[first], np.int64)


def films(
    frame: Frame, scene: Any, nodes: Nodes, samples: Samples, three: Ints
) -> NDArray[np.int32]:
    """Return the pixel of a film of `FILM` by `FILM` that shows each node.

    If the camera cannot see the node itself, it is that of the sample for which it counts most.
    """
    row, column = frame.place(nodes.positions + 1e-3 * nodes.normals)
    si = scene.ray_intersect(frame.rays(row, column))
    unseen = np.linalg.norm(np.array(si.p).T - nodes.positions, axis=1) > 0.02
    best, at = np.full(nodes.count, -1.0), np.zeros(nodes.count, np.int64)
    for k in range(3):
        weight = np.where(samples.valid, samples.weights[:, k], -2)
        order = np.argsort(weight)
        better = weight[order] > best[three[order, k]]
        at[three[order[better], k]] = order[better]
        np.maximum.at(best, three[:, k], weight)
    other = frame.place(samples.positions[at])
    row, column = np.where(unseen, other[0], row), np.where(unseen, other[1], column)
    x, y = frame.film(row, column)
    return ((y * FILM).astype(np.int64) * FILM + (x * FILM).astype(np.int64)).astype(np.int32)


def directions(height: int, width: int) -> Float32:
    """Return unit vectors of a panorama's texels at turn 0, (height * width, 3)."""
    up = np.pi / 2 - (np.arange(height) + 0.5) / height * np.pi
    round_ = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    level = np.cos(up)[:, None]
    parts = (
        -np.sin(round_) * level,
        np.repeat(np.sin(up)[:, None], width, 1),
        np.cos(round_) * level,
    )
    return np.stack(parts, -1).reshape(-1, 3).astype(np.float32)


def horizon(scene: Any, nodes: Nodes) -> NDArray[np.int8]:
    """Return the distance of each direction inside the sky that each node sees, (n, 32, 64) int8.

    It is positive in the open, negative behind the head itself; `STEP` for each 1.4 degrees. It can
    be interpolated between nodes and between directions, and an edge stays sharp.
    """
    height, width = SKY[0] * _FINE, SKY[1] * _FINE
    way = directions(height, width)
    axes = [mi.Float(np.ascontiguousarray(way[:, k])) for k in range(3)]
    out = np.empty((nodes.count, *SKY), np.int8)
    for start in range(0, nodes.count, _BATCH):
        position, normal = (a[start : start + _BATCH] for a in (nodes.positions, nodes.normals))
        lane = dr.arange(mi.UInt32, len(position) * len(way))
        node, k = lane // len(way), lane % len(way)
        n = _gathered(normal, node)
        direction = mi.Vector3f(*(dr.gather(mi.Float, axis, k) for axis in axes))
        above = dr.dot(direction, n) > 0
        ray = mi.Ray3f(_gathered(position, node) + n * _OFFSET, direction)
        free = np.array(above & ~scene.ray_test(ray, above)).reshape(-1, height, width)
        for number, one in enumerate(free.astype(np.uint8)):
            out[start + number] = _distances(one)
    return out


def limited(distances: NDArray[np.int8], nodes: Nodes) -> NDArray[np.int8]:
    """Use coarser steps, and drop directions that skin faces away from: compresses to a third."""
    step = STEP * 4 / SPREAD
    steps = np.round(distances.astype(float) / step / 2) * 2
    kept: NDArray[np.int8] = np.clip(steps, -_LIMIT, _LIMIT).astype(np.int8)
    behind = nodes.normals @ directions(*SKY).T < _BEHIND
    kept.reshape(nodes.count, -1)[behind] = -_LIMIT
    return kept


def eye_colours(head: HeadMesh, seen: Nodes) -> Float32:
    """Return the colour of the eyes' mesh next to each node, (n, 3)."""
    assert head.eyes is not None
    assert head.eyes.colours is not None
    vertices = head.eyes.vertices
    nearest_ = [int(((vertices - place) ** 2).sum(1).argmin()) for place in seen.positions]
    return head.eyes.colours[nearest_]


def _gathered(values: Float32, index: Any) -> Any:
    parts = (mi.Float(np.ascontiguousarray(values[:, k])) for k in range(3))
    return mi.Vector3f(*(dr.gather(mi.Float, part, index) for part in parts))


def _distances(free: NDArray[np.uint8]) -> NDArray[np.int8]:
    half = np.roll(free, free.shape[1] // 2, axis=1)
    tall = np.concatenate([half[:_PAD][::-1], free, half[-_PAD:][::-1]])
    wide = np.concatenate([tall[:, -_PAD:], tall, tall[:, :_PAD]], axis=1)
    inside = cv2.distanceTransform(wide, cv2.DIST_L2, 5)
    outside = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5)
    signed = np.where(wide > 0, inside - 0.5, 0.5 - outside)[_PAD:-_PAD, _PAD:-_PAD]
    blocks = signed.reshape(SKY[0], _FINE, SKY[1], _FINE)[:, 1:3, :, 1:3].mean(axis=(1, 3))
    return np.asarray(np.clip(np.round(blocks * STEP), -127, 127), np.int8)


def traced(
    tables: SceneTables, films_: NDArray[np.int32], paths: int, seed: int
) -> Iterator[tuple[int, Float32]]:
    """Yield shares of the nodes, some at a time: start, (n, V, 3)."""
    step = max(16, 192 * 1024 // paths)
    for start in range(0, len(films_), step):
        yield start, trace_pixels(tables, films_[start : start + step], paths, seed + start).share
