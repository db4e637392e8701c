"""Points of a picture that are found again under other light: RootSIFT after local equalising.

Contrast is equalised in tiles first (CLAHE), since auto exposure and the panorama's tone mapping
show one wall in quite different tones. RootSIFT is R. Arandjelovic and A. Zisserman, CVPR 2012.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]

_TILES: Final = (8, 8)
_CLIP_LIMIT: Final = 3.0
_CONTRAST: Final = 0.02  # weaker points than by default, as backgrounds are often soft
_USUAL: Final = 0.75  # likeness of a rival, where none is near
_AROUND: Final = 0.4  # cosine-like: what is further from the middle is in no picture
_RIVALS: Final = 3  # one corner is often described twice, for two directions of its gradient


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Described points of a picture.

    Attributes:
        places: (N, 2) float32. Columns and rows in pixels; the middle of the first pixel is (0.5,
            0.5).
        descriptors: (N, 128) float32. RootSIFT, of unit length.
    """

    places: Float32 = field(repr=False)
    descriptors: Float32 = field(repr=False)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.places)


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Points of one set and what they look like in another.

    Attributes:
        first, second: (N,) int64. Indices in the two sets; none of the first twice.
        ratio: (N,) float32. Distance to the match over distance to the next best elsewhere: 0 is
            unique.
    """

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    ratio: Float32


def equalised(picture: Bytes) -> Bytes:
    """Return a picture in grey, its contrast equalised in tiles.

    Args:
        picture: (H, W, 3) or (H, W) uint8. sRGB.

    Returns:
        (H, W) uint8.
    """
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) if picture.ndim == 3 else picture
    return np.asarray(cv2.createCLAHE(_CLIP_LIMIT, _TILES).apply(grey), np.uint8)


def describe(picture: Bytes, most: int, mask: NDArray[np.bool_] | None = None) -> Features:
    """Find and describe a picture's points.

    Args:
        picture: (H, W, 3) or (H, W) uint8. sRGB.
        mask: (H, W) bool. Where points may lie.
    """
    finder = cv2.SIFT.create(nfeatures=most, contrastThreshold=_CONTRAST)
    where = None if mask is None else mask.astype(np.uint8)
    points, found = finder.detectAndCompute(equalised(picture), where)
    if not points or found is None:
        return Features(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32))
    # OpenCV keeps some more where several are equally strong.
    points, found = points[:most], found[:most]
    places = np.array([point.pt for point in points], np.float32) + np.float32(0.5)
    share = found / np.maximum(found.sum(axis=1, keepdims=True), 1e-6)
    return Features(places, np.sqrt(share).astype(np.float32))


def pair(
    first: Float32, second: Float32, spots: Float32, apart: float, limit: float = 0.8
) -> Pairs:
    """Match descriptors by the ratio test (D. Lowe, IJCV 2004), against rivals elsewhere only.

    Args:
        first: (N, 128) float32. Of unit length.
        second: (M, 128) float32. Of unit length.
        spots: (M, K) float32. Where the second set's points are, in any coordinates.
    """
    if len(first) == 0 or len(second) < 2:
        nothing = np.zeros(0, np.int64)
        return Pairs(nothing, nothing, np.zeros(0, np.float32))
    return _told_apart(first @ second.T, spots, apart, limit)


def pair_near(
    first: Float32,
    second: Float32,
    spots: Float32,
    expected: Float32,
    reach: float,
    apart: float,
    limit: float,
) -> Pairs:
    """Match descriptors as `pair` does, but only near where a first answer expects each.

    What stands twice in a place, or looks like much else, is unique there: so a picture has about
    twice as many matches.

    Args:
        expected: (N, 3) float32. Where the first set's points should be, unit vectors.
        reach: How far from there they may be, radians.
    """
    around = np.flatnonzero(spots @ expected.mean(axis=0) > _AROUND)
    if len(first) == 0 or len(around) < 2:
        return pair(first, second[:0], spots[:0], apart, limit)
    near = expected @ spots[around].T > math.cos(reach)
    likeness = np.where(near, first @ second[around].T, np.float32(-1.0))
    found = _told_apart(likeness, spots[around], apart, limit, _USUAL)
    return Pairs(found.first, around[found.second], found.ratio)


def thinned(pairs: Pairs, places: Float32, cell: float, most: int) -> Pairs:
    """Keep the most certain matches: one of each point found, and few from one part of a picture.

    A striped carpet makes scores of points look like two or three of the panorama, and whatever
    explains these would outweigh all else.

    Args:
        places: (N, 2) float32. Where the first set's points are.
    """
    order = np.argsort(pairs.ratio, kind="stable")
    _, once = np.unique(pairs.second[order], return_index=True)
    order = order[np.sort(once)]
    columns, rows = (places[pairs.first[order]] // cell).astype(np.int64).T
    part = rows * 10_000 + columns
    by_part = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[by_part], part[by_part], side="left")
    few = by_part[np.arange(len(part)) - starts < most]
    chosen = np.sort(order[few])
    return Pairs(pairs.first[chosen], pairs.second[chosen], pairs.ratio[chosen])


def _told_apart(
    likeness: Float32, spots: Float32, apart: float, limit: float, usual: float = -1.0
) -> Pairs:
    """Choose the most alike, where nothing elsewhere is nearly as much, or as `usual`."""
    rows = np.arange(len(likeness))
    best = np.argmax(likeness, axis=1)
    top = likeness[rows, best]
    rival = np.full(len(likeness), -1.0, np.float32)
    likeness[rows, best] = -1.0
    for _ in range(_RIVALS):
        other = np.argmax(likeness, axis=1)
        value = likeness[rows, other]
        likeness[rows, other] = -1.0
        elsewhere = np.linalg.norm(spots[other] - spots[best], axis=1) > apart
        rival = np.where((rival < 0.0) & elsewhere, value, rival)
    rival = np.maximum(rival, np.float32(usual))
    distance, further = (np.sqrt(np.maximum(2.0 - 2.0 * s, 1e-9)) for s in (top, rival))
    ratio = (distance / further).astype(np.float32)
    keep = np.flatnonzero(ratio < limit)
    return Pairs(rows[keep], best[keep], ratio[keep])
