"""Compressed scattering between nodes: near nodes individually, farther ones by patches."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.portrait.portrait_head import PortraitSkin
from scenes.portraits.light import Nodes

Float32 = NDArray[np.float32]
Ints = NDArray[np.int64]
PATCHES = (800, 64)
TAKEN = (12, 12, 8)
"""Number of nodes, small patches and large patches that each node receives light from."""
_CELL = 0.03
_NORMAL = 0.3


@dataclass(frozen=True, slots=True)
class Shares:
    """Share of the light entering at nodes that leaves at visible ones, entry by entry.

    Attributes:
        row, column: Visible node, and node of both halves.
        value: (n, 3) float32.
    """

    row: Ints
    column: Ints
    value: Float32


def patches(nodes: Nodes, most: tuple[int, int] = PATCHES) -> tuple[Ints, tuple[int, ...]]:
    """Return the small and large patch of each node, (n, 2), and the number of patches."""
    feature = np.concatenate([nodes.positions, _NORMAL * nodes.normals], 1).astype(np.float32)
    _, first = np.unique(np.floor(nodes.positions / _CELL).astype(int), axis=0, return_index=True)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 1e-4)
    labels, counts = [], []
    for wanted in most:
        cv2.setRNGSeed(1)
        few = min(wanted, len(first))
        _, _, centres = cv2.kmeans(feature[first], few, None, stop, 1, cv2.KMEANS_PP_CENTERS)  # type: ignore[call-overload]
        nearest = np.concatenate(
            [
                ((feature[i : i + 500, None] - centres[None]) ** 2).sum(2).argmin(1)
                for i in range(0, len(feature), 500)
            ]
        )
        used, label = np.unique(nearest, return_inverse=True)
        labels.append(label)
        counts.append(len(used))
    return np.stack(labels, axis=1), tuple(counts)


def packed(
    shares: Shares,
    shown: int,
    labels: Ints,
    counts: tuple[int, ...],
) -> PortraitSkin:
    """Keep the strongest of each node's sources, scaled up for the rest."""
    nodes = len(labels)
    half = nodes + sum(counts)
    left, sources, values, begin = shares, [], [], 0
    own = (np.arange(nodes), labels[:, 0], labels[:, 1])
    for label, count, most in zip(own, (nodes, *counts), TAKEN, strict=True):
        side = left.column >= nodes
        group = label[left.column - nodes * side] + begin + half * side
        source, value, left = _most(left, group, shown, 2 * half, most)
        sources.append(source)
        values.append(value)
        begin += count
    source, value = np.concatenate(sources, axis=1), np.concatenate(values, axis=1)
    total = np.stack([np.bincount(shares.row, shares.value[:, k], shown) for k in range(3)], 1)
    value *= (total / np.maximum(value.sum(axis=1), 1e-9))[:, None].astype(np.float32)
    return PortraitSkin(source.T.copy(), value.transpose(1, 0, 2).copy())


def _most(
    shares: Shares, group: Ints, shown: int, groups: int, most: int
) -> tuple[Ints, Float32, Shares]:
    key, place = np.unique(shares.row * groups + group, return_inverse=True)
    value = np.stack([np.bincount(place, shares.value[:, k], len(key)) for k in range(3)], 1)
    row = key // groups
    order = np.lexsort((-value.mean(1), row))
    start = np.searchsorted(row[order], np.arange(shown + 1))
    rank = np.empty(len(key), np.int64)
    rank[order] = np.arange(len(key)) - start[row[order]]
    taken = rank < most
    source, share = np.zeros((shown, most), np.int64), np.zeros((shown, most, 3), np.float32)
    source[row[taken], rank[taken]] = (key % groups)[taken]
    share[row[taken], rank[taken]] = value[taken]
    rest = ~taken[place]
    return source, share, Shares(shares.row[rest], shares.column[rest], shares.value[rest])


def fewer(skin: PortraitSkin, most: tuple[int, ...]) -> PortraitSkin:
    """Replace the weakest sources by zeros, which compress well, and scale up the others."""
    begins = np.cumsum((0, *TAKEN))
    kept = np.concatenate([begin + np.arange(n) for begin, n in zip(begins, most, strict=False)])
    share = np.zeros_like(skin.share)
    share[kept] = skin.share[kept]
    share *= skin.share.sum(axis=0) / np.maximum(share.sum(axis=0), 1e-9)
    return PortraitSkin(skin.source * share.any(axis=2), share)
