"""Portraits from the side: nodes that the front does not show, and the contents of a view's pixels.

Nodes keep their order: those of the head's own file that are visible from the front, then those
that only views show, then hidden ones, of the file and new.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.core.baking.exposure import Points
from app.core.baking.random_walk import scene_tables
from app.core.baking.scene import Camera, HeadMesh, build_scene
from app.core.baking.skin import Skin, find_skin
from app.core.portrait.portrait_head import PortraitHead, PortraitSkin
from scenes.head_detail.bump import oiliness, skin_bump
from scenes.head_detail.colours import eye_albedo, relative_albedo
from scenes.portraits.light import FILM, Nodes, films, nearest, traced
from scenes.portraits.patches import Shares, fewer, packed, patches
from scenes.portraits.scene import Frame, Samples, look, portrait_frame, seen_at

Float32 = NDArray[np.float32]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SIZE = 320
PATCHES = (100, 12)
_MOST = (9, 8, 6)
"""Most sources of a node's light: fewer than for one that is visible from the front."""
_SAME = 0.003
_TURNED = 0.05
_MIRROR = np.array([-1, 1, 1], np.float32)
_PILOT = 128
_APART, _CELL = 0.025, 0.04
_INSIDE = ((0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75))
_BROKEN = 5.0
_EDGE = 0.1


@dataclass(frozen=True, eq=False)
class View:
    """The contents of a camera's picture.

    Attributes:
        three: (S, 3) int64. Visible nodes of both halves around each sample; all 0: background.
    """

    frame: Frame
    camera: Camera
    samples: Samples
    three: Ints


@dataclass(frozen=True, eq=False)
class Aside:
    """A head's nodes with those that are visible from the side.

    Attributes:
        shown: Nodes with a colour: of the front, then `extra`.
        hidden: New ones that only transmit light.
        points: Indices of the points of `extra`, then `hidden`.
        front: Number of nodes of the front.
        traced: Visible nodes whose skin is traced: those of the front that are seen edge-on there,
            then new ones.
        eye: (n,) bool. Nodes of `extra` and `hidden` on the eyes.
    """

    mesh: HeadMesh
    points: Points
    front: int
    traced: Ints
    shown: Nodes
    hidden: Nodes
    old: Nodes
    eye: NDArray[np.bool_]
    views: Sequence[View] = field(repr=False)

    @property
    def extra(self) -> Nodes:
        """New nodes: visible, then hidden."""
        shown = self.shown
        return joined(
            Nodes(shown.positions[self.front :], shown.normals[self.front :]), self.hidden
        )

    @property
    def count(self) -> int:
        """Number of new visible nodes."""
        return self.shown.count - self.front

    @cached_property
    def nodes(self) -> Nodes:
        """All nodes, in their order."""
        return joined(joined(self.shown, self.old), self.hidden)


def joined(one: Nodes, other: Nodes) -> Nodes:
    """Join two lists of nodes."""
    return Nodes(
        np.concatenate([one.positions, other.positions]),
        np.concatenate([one.normals, other.normals]),
    )


def find_aside(
    mesh: HeadMesh,
    points: Points,
    nodes: Nodes,
    straight: Float32,
    yaws: Sequence[float],
    scene: Any,
    kept: Nodes | None,
) -> Aside:
    """Find the nodes that views show and the front does not.

    Args:
        nodes: Nodes of the head's own file; the first are visible from the front.
        straight: (M,) float32. Cosine of their viewing angle there.
        kept: Hidden nodes found before, which come from random paths.
    """
    seen = len(straight)
    side = points.positions[:, :1] > 0
    position = np.where(side, points.positions * _MIRROR, points.positions)
    normal = np.where(side, points.normals * _MIRROR, points.normals)
    feature = np.concatenate([position, _TURNED * normal], axis=1)
    looked = []
    for yaw in yaws:
        frame, camera = portrait_frame(mesh, yaw, SIZE)
        looked.append((frame, camera, look(scene, mesh, frame, points)))
    used = np.unique(np.concatenate([_used(samples) for *_, samples in looked]))
    front = Nodes(nodes.positions[:seen], nodes.normals[:seen])
    own = np.concatenate([front.positions, _TURNED * front.normals], axis=1)
    away, _ = cKDTree(own).query(feature[used])
    new = used[away > _SAME]
    # One of each pair of mirror images.
    pairs = cKDTree(feature[new]).query_pairs(_SAME, output_type="ndarray")
    new = np.delete(new, np.unique(pairs.max(axis=1))) if len(pairs) else new
    shown = joined(front, Nodes(position[new], normal[new]))
    _, of_point = cKDTree(np.concatenate([own, feature[new]])).query(feature)
    of_point = of_point + shown.count * side[:, 0]
    views = [
        View(frame, camera, samples, of_point[samples.points] * samples.valid[:, None])
        for frame, camera, samples in looked
    ]
    eye_points = np.zeros(points.count, bool)
    for view in views:
        eye_points[view.samples.points[view.samples.valid & ~view.samples.skin]] = True
    old = Nodes(nodes.positions[seen:], nodes.normals[seen:])
    none = Nodes(old.positions[:0], old.normals[:0])
    edge = np.intersect1d(
        np.flatnonzero(straight < _EDGE),
        np.unique(np.concatenate([view.three % shown.count for view in views])),
    )
    again = np.concatenate([edge, seen + np.arange(len(new))])
    plain = Aside(mesh, points, seen, again, shown, none, old, eye_points[new], views)
    hidden = _hidden(plain) if kept is None else kept
    return replace(
        plain, hidden=hidden, eye=np.concatenate([plain.eye, np.zeros(hidden.count, bool)])
    )


def _used(samples: Samples) -> Ints:
    return np.unique(samples.points[samples.valid][samples.weights[samples.valid] > 0])


def _hidden(aside: Aside) -> Nodes:
    """Return points whose light leaves at new nodes, and that are far from all nodes."""
    points, nodes = aside.points, aside.nodes
    mass = np.zeros(points.count, np.float32)
    for view, _, _, film in _filmed(aside):
        tables = _tables(aside, view, find_skin("medium"))
        for _, share in traced(tables, film[::2], _PILOT, 5):
            mass += share.sum(axis=(0, 2))
    able = np.flatnonzero(mass > 0.02 * np.median(mass[mass > 0]))
    _, away = nearest(nodes, points.positions[able], points.normals[able])
    far = able[away > _APART]
    side = np.where(points.positions[far, :1] > 0, _MIRROR, 1).astype(np.float32)
    position, normal = points.positions[far] * side, points.normals[far] * side
    keys = np.concatenate([np.floor(position / _CELL), np.round(normal)], axis=1)
    _, first = np.unique(keys.astype(np.int64), axis=0, return_index=True)
    return Nodes(position[first], normal[first])


def _tables(aside: Aside, view: View, skin: Skin) -> Any:
    scene = build_scene(aside.mesh, skin, view.camera)
    return scene_tables(scene, aside.mesh, skin, aside.points, FILM)


def _straight(aside: Aside) -> Float32:
    """Return viewing cosines of the nodes of both halves, (views, 2, shown); -2 if not visible."""
    cosine = np.full((len(aside.views), 2, aside.shown.count), -2.0, np.float32)
    position, normal = (part.reshape(2, -1, 3) for part in aside.shown.both())
    for number, view in enumerate(aside.views):
        toward = np.array(view.frame.origin, np.float32) - position
        toward /= np.linalg.norm(toward, axis=2, keepdims=True)
        used = np.zeros(2 * aside.shown.count, bool)
        used[np.unique(view.three[view.samples.valid])] = True
        cosine[number] = np.where(used.reshape(2, -1), (toward * normal).sum(axis=2), -2)
    return cosine


def best_views(aside: Aside) -> tuple[Ints, Float32]:
    """Return the best view of each `traced` node (view times 2 plus half), and its cosine there."""
    flat = _straight(aside)[:, :, aside.traced].reshape(-1, len(aside.traced))
    best = flat.argmax(axis=0)
    return best, np.take_along_axis(flat, best[None], axis=0)[0]


def _film(aside: Aside, view: View) -> NDArray[np.int32]:
    """Return positions of visible nodes of both halves on a view's film, (2, shown)."""
    scene = build_scene(aside.mesh, find_skin("medium"), view.camera)
    both = Nodes(*aside.shown.both())
    return films(view.frame, scene, both, view.samples, view.three).reshape(2, -1)


def _filmed(aside: Aside) -> list[tuple[View, int, Ints, NDArray[np.int32]]]:
    """Return, by view and half, which of `traced` start there, and their film positions."""
    best, _ = best_views(aside)
    out = []
    for number, view in enumerate(aside.views):
        film = _film(aside, view)
        for side in range(2):
            some = np.flatnonzero(best == 2 * number + side)
            if len(some):
                out.append((view, side, some, film[side, aside.traced[some]]))
    return out


def aside_skin(
    aside: Aside, labels: Ints, counts: tuple[int, ...], skin: Skin, paths: int, colours: Float32
) -> PortraitSkin:
    """Trace paths from every `traced` node.

    Args:
        labels, counts: Patches of all nodes.
        colours: (n, 3). Of those on the eyes, 0 elsewhere.
    """
    near, _ = nearest(aside.nodes, aside.points.positions, aside.points.normals)
    order = np.argsort(near, kind="stable")
    starts = np.flatnonzero(np.diff(near[order], prepend=-1))
    ids, whole = near[order][starts], 2 * aside.nodes.count
    rows, columns, values = [], [], []
    for view, side, some, film in _filmed(aside):
        for start, share in traced(_tables(aside, view, skin), film, paths, 77):
            summed = np.add.reduceat(share[:, order], starts, axis=1)
            row, column = np.nonzero(summed.any(axis=2))
            rows.append(some[row + start])
            columns.append((ids[column] + side * aside.nodes.count) % whole)
            values.append(summed[row, column])
    shares = Shares(np.concatenate(rows), np.concatenate(columns), np.concatenate(values))
    found = fewer(packed(shares, len(aside.traced), labels, counts), _MOST)
    return PortraitSkin(
        np.concatenate([found.source, aside.traced[None]]),
        np.concatenate([found.share, colours[None]]),
    )


def all_patches(aside: Aside, head: PortraitHead) -> Ints:
    """Return the patches of all nodes: those of the head's file, and others for the new ones."""
    known = head.nodes.patches
    labels, _ = patches(aside.extra, PATCHES)
    labels = labels + known.max(axis=0) + 1
    parts = known[: aside.front], labels[: aside.count], known[aside.front :], labels[aside.count :]
    return np.concatenate(parts)


def colours_and_pores(name: str, view: View, scene: Any) -> tuple[Float32, Float32]:
    """Return mean colour, (h, w, 3), and strength of the sheen, (h, w), of each pixel of a view."""
    rows, columns = view.frame.shape
    row, column = np.divmod(np.arange(rows * columns), columns)
    colour, detail, weight = (np.zeros((rows * columns, k)) for k in (3, 1, 1))
    for down, across in _INSIDE:
        seen = seen_at(scene, view.frame, row + down, column + across)
        at = np.flatnonzero(seen["valid"])
        place, normal = (seen[one][at].astype(np.float64) for one in ("place", "normal"))
        skin = seen["skin"][at]
        kinds = relative_albedo(name, place, normal), eye_albedo(name, place)
        colour[at] += np.where(skin[:, None], *kinds)
        detail[at, 0] += np.where(skin, _pores(name, place, normal, view.frame), 1)
        weight[at] += 1
    shape = (rows, columns)
    empty = (weight == 0).reshape(shape)
    weight = np.maximum(weight, 1)
    return _filled((colour / weight).reshape(*shape, 3), empty), _filled(
        (detail / weight).reshape(shape), empty
    )


def _pores(name: str, place: Floats, normal: Floats, frame: Frame) -> Floats:
    slope = np.linalg.norm(skin_bump(place, normal, name) - normal, axis=1)
    broken = np.exp(-_BROKEN * slope)
    straight = np.clip(-1.2 * normal @ frame.axes[2], 0, 1) ** 2
    broken = 1 + straight * (broken / broken.mean() - 1)
    return np.asarray(broken * oiliness(name, place))


def _filled(values: NDArray[Any], empty: NDArray[np.bool_]) -> Float32:
    """Spread values at the head's edge outward, so that they compress without a seam."""
    _, label = cv2.distanceTransformWithLabels(
        empty.astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    place = np.zeros(label.max() + 1, np.int64)
    place[label[~empty]] = np.flatnonzero(~empty)
    flat = values.reshape(empty.size, -1)[place[label.ravel()]]
    smooth = cv2.GaussianBlur(flat.reshape(values.shape).astype(np.float32), (0, 0), 2)
    keep = empty[..., None] if values.ndim == 3 else empty
    return np.where(keep, smooth, values).astype(np.float32)
