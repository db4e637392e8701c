"""Feature points that are robust to changes of light: RootSIFT after local equalisation.

Contrast is first equalised in tiles (CLAHE), because auto exposure and the panorama's tone mapping
render the same wall in quite different tones. RootSIFT is described by R. Arandjelovic and A.
Zisserman (CVPR 2012).

`build_index` describes a whole panorama in perspective views similar to those of a camera.
`keep_index` saves the index beside the panorama as a cache, which may be deleted at any time.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Float64, Int64
from app.core.base.atomic_files import atomic_write_bytes, open_file
from app.core.base.errors import CoreError
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.localization.views import Lens, bearings, look
from app.core.text import tr

_LEAST_POINTS: Final = 48  # for a panorama
_EVERY_DEG: Final = 40
_VIEW_DEG: Final = 70.0
_PITCHES_DEG: Final = (17.0, -17.0)
_VIEW_SHAPE: Final = (60.0, 70.0)  # degrees, wide and tall: each view includes the horizon
_PER_DEG: Final = 10.0  # pixels of a view, at most
_VIEW_POINTS: Final = 1200
_FILE: Final = "background.points"
_FORM: Final = b"turnlight background 2"  # version of the file format and of the descriptors
_COLUMNS: Final = 128 + 3 + 1  # descriptor, bearing, azimuth
_MOST_POINTS: Final = 20 * _VIEW_POINTS
_SEAL: Final = 32  # bytes


@dataclass(frozen=True, slots=True, eq=False)
class HeadingIndex:
    """The feature points of a panorama and their descriptors.

    Attributes:
        descriptors: (N, 128) float32. RootSIFT descriptors.
        bearings: (N, 3) float32. Unit vectors in the panorama's coordinate system.
        azimuths: (N,) float32. Azimuths in degrees, in ascending order.
    """

    descriptors: Float32 = field(repr=False)
    bearings: Float32 = field(repr=False)
    azimuths: Float32 = field(repr=False)

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.azimuths)

    def near(self, azimuth_deg: float, reach_deg: float) -> Int64:
        """Return the indices of the points near an azimuth.

        Args:
            azimuth_deg: Centre of the range, in degrees.
            reach_deg: Extent of the range on each side of the centre, in degrees.
        """
        away = np.abs((self.azimuths - azimuth_deg + 180.0) % 360.0 - 180.0)
        return np.flatnonzero(away <= reach_deg)


def build_index(
    panorama: Bytes, token: Token | None = None, report: Report = silent
) -> HeadingIndex:
    """Compute the feature points of a panorama.

    Args:
        panorama: (H, W, 3) uint8. Equirectangular, 2:1, display sRGB
            (`app.core.measure.finish.display.display_panorama`), ideally 2,048 to 4,096 columns.

    Raises:
        CoreError: If the panorama has too few points, as with blank walls all around.
        Cancelled: If the token is cancelled.
    """
    per_degree = min(_PER_DEG, panorama.shape[1] / 360.0 * 1.3)
    focal = per_degree * 180.0 / math.pi
    tall, wide = (round(2 * focal * math.tan(math.radians(a) / 2)) for a in _VIEW_SHAPE)
    lens = Lens(_VIEW_DEG, (wide, tall))
    parts: list[tuple[Features, Float64]] = []
    views = [(a, p) for a in range(-180, 180, _EVERY_DEG) for p in _PITCHES_DEG]
    for count, (azimuth, pitch) in enumerate(views):
        if token is not None:
            token.check()
        report(count / len(views), Progress(Task.LEARNING_BACKGROUND))
        one_view = describe(look(panorama, float(azimuth), lens, pitch), _VIEW_POINTS)
        parts.append(_squarely_seen(one_view, lens, float(azimuth), pitch))
    report(1.0, Progress(Task.LEARNING_BACKGROUND))
    descriptors = np.concatenate([features.descriptors for features, _ in parts])
    vectors = np.concatenate([vectors for _, vectors in parts])
    if len(vectors) < _LEAST_POINTS:
        raise CoreError(
            tr("This panorama has too little detail to tell where a camera points."),
            tr("Turn by degrees instead, or capture the place again with more light."),
        )
    azimuths = np.degrees(np.arctan2(-vectors[:, 0], vectors[:, 2]))
    order = np.argsort(azimuths)
    arrays = (descriptors[order], vectors[order], azimuths[order])
    return HeadingIndex(*(np.ascontiguousarray(a, np.float32) for a in arrays))


def read_index(folder: Path, panorama: Bytes) -> HeadingIndex | None:
    """Return the saved index of a panorama, or None if there is no valid index.

    Args:
        panorama: As in `build_index`.
    """
    most = _SEAL + 4 * _COLUMNS * _MOST_POINTS
    with contextlib.suppress(OSError), open_file(folder / _FILE) as stream:
        data = stream.read(most + 1)
        seal, values = data[:_SEAL], data[_SEAL:]
        if len(data) > most or len(values) % (4 * _COLUMNS) or seal != _seal(panorama, values):
            return None
        table = np.frombuffer(values, np.float32).reshape(-1, _COLUMNS)
        if len(table) >= _LEAST_POINTS and np.isfinite(table).all():
            arrays = (table[:, :128], table[:, 128:131], table[:, 131])
            return HeadingIndex(*(np.ascontiguousarray(a) for a in arrays))
    return None


def keep_index(folder: Path, panorama: Bytes, index: HeadingIndex) -> None:
    """Save the index of a panorama in a folder. Failures are ignored.

    Args:
        panorama: The panorama from which `index` was built.
    """
    if len(index) > _MOST_POINTS or read_index(folder, panorama) is not None:
        return
    table = np.column_stack((index.descriptors, index.bearings, index.azimuths))
    values = np.ascontiguousarray(table, np.float32).tobytes()
    with contextlib.suppress(CoreError):
        atomic_write_bytes(folder / _FILE, _seal(panorama, values) + values)


def _seal(panorama: Bytes, values: bytes) -> bytes:
    """Return the digest of format, panorama and content with which a valid file starts."""
    digest = hashlib.blake2b(_FORM + repr(panorama.shape).encode(), digest_size=_SEAL)
    digest.update(np.ascontiguousarray(panorama).data)
    digest.update(values)
    return digest.digest()


def _squarely_seen(
    features: Features, lens: Lens, azimuth_deg: float, pitch_deg: float
) -> tuple[Features, Float64]:
    """Keep only the points that no other view shows closer to its axis."""
    vectors = bearings(lens, azimuth_deg, pitch_deg, features.places.astype(np.float64))
    azimuth = np.degrees(np.arctan2(-vectors[:, 0], vectors[:, 2]))
    away = np.abs((azimuth - azimuth_deg + 180.0) % 360.0 - 180.0)
    keep = (away <= _EVERY_DEG / 2) & ((vectors[:, 1] >= 0.0) == (pitch_deg > 0.0))
    return Features(features.places[keep], features.descriptors[keep]), vectors[keep]


_TILES: Final = (8, 8)
_CLIP_LIMIT: Final = 3.0
_CONTRAST: Final = 0.02  # lower than the default, as backgrounds are often soft
_USUAL: Final = 0.75  # similarity of the rival, if none is close
_AROUND: Final = 0.4  # cosine-like: points further from the middle are outside any picture
_BLOCK: Final = 256  # points compared at a time
_RIVALS: Final = 3  # one corner is often described twice, for two directions of its gradient


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """The feature points of a picture and their descriptors.

    Attributes:
        places: (N, 2) float32. Columns and rows in pixels. The centre of the first pixel is at
            (0.5, 0.5).
        descriptors: (N, 128) float32. RootSIFT descriptors of unit length.
    """

    places: Float32 = field(repr=False)
    descriptors: Float32 = field(repr=False)

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.places)


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Points of one set and their matches in another.

    Attributes:
        first, second: (N,) int64. Indices into the two sets. Each first index occurs once.
        ratio: (N,) float32. Distance to the match divided by the distance to the next best match
            elsewhere. A ratio of 0 means that the match is unique.
    """

    first: Int64
    second: Int64
    ratio: Float32


def equalised(picture: Bytes) -> Bytes:
    """Return a greyscale copy of a picture, with its contrast equalised in tiles.

    Args:
        picture: (H, W, 3) or (H, W) uint8. sRGB.

    Returns:
        (H, W) uint8. The equalised picture.
    """
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) if picture.ndim == 3 else picture
    return np.asarray(cv2.createCLAHE(_CLIP_LIMIT, _TILES).apply(grey), np.uint8)


def describe(picture: Bytes, most: int, mask: Bools | None = None) -> Features:
    """Find the feature points of a picture and describe them.

    Args:
        picture: (H, W, 3) or (H, W) uint8. sRGB.
        most: Maximum number of points.
        mask: (H, W) bool. True where points are allowed.
    """
    where = None if mask is None else mask.astype(np.uint8)
    places, descriptors = root_sift(equalised(picture), most, where)
    # OpenCV returns a few more if several are equally strong.
    return Features(places[:most] + np.float32(0.5), descriptors[:most])


def root_sift(grey: Bytes, most: int, mask: Bytes | None) -> tuple[Float32, Float32]:
    """Find feature points and describe them with RootSIFT.

    Args:
        grey: (H, W) uint8. Greyscale picture with equalised contrast.
        most: Maximum number of points.
        mask: (H, W) uint8. Non-zero where points are allowed.

    Returns:
        The columns and rows of the points, (N, 2) float32, where the centre of the first pixel is
        at (0, 0), and their descriptors, (N, 128) float32 of unit length.
    """
    finder = cv2.SIFT.create(nfeatures=most, contrastThreshold=_CONTRAST)
    points, descriptors = finder.detectAndCompute(grey, mask)
    if not points or descriptors is None:
        return np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32)
    share = descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-6)
    places = np.array([point.pt for point in points], np.float32)
    return places, np.sqrt(share).astype(np.float32)


def shrunk(picture: Bytes, scale: float, mask: Bools | None = None) -> tuple[Bytes, Bools | None]:
    """Shrink a picture and its mask.

    Args:
        picture: (H, W, 3) uint8.
        scale: Scale factor for the sides. A factor of 1 or more leaves the picture unchanged.
        mask: (h, w) bool, of any size. It is resized to fit the picture.
    """
    size = picture.shape[1], picture.shape[0]
    if scale < 1.0:
        size = max(round(size[0] * scale), 1), max(round(size[1] * scale), 1)
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    if mask is None or mask.shape == picture.shape[:2]:
        return picture, mask
    fitted = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    return picture, np.asarray(fitted, np.uint8) > 0


def pair(
    first: Float32, second: Float32, spots: Float32, apart: float, limit: float = 0.8
) -> Pairs:
    """Match descriptors by the ratio test (D. Lowe, IJCV 2004), with rivals elsewhere only.

    Args:
        first: (N, 128) float32. Descriptors of unit length.
        second: (M, 128) float32. Descriptors of unit length.
        spots: (M, K) float32. Positions of the points in the second set, in any coordinates.
        apart: Distance in these coordinates beyond which a point counts as elsewhere.
        limit: Largest permitted ratio of a match.
    """
    if len(first) == 0 or len(second) < 2:
        nothing = np.zeros(0, np.int64)
        return Pairs(nothing, nothing, np.zeros(0, np.float32))
    blocks = (
        _told_apart(first[rows] @ second.T, spots, apart, limit) for rows in blocks_of(len(first))
    )
    return _joined(blocks)


def pair_near(
    first: Float32,
    second: Float32,
    spots: Float32,
    positions: Float32,
    reach: float,
    apart: float,
    limit: float,
) -> Pairs:
    """Match descriptors as `pair` does, but only near the position predicted for each point.

    A pattern that is repeated at the place or resembles many others is unique within a small area,
    so a picture has about twice as many matches.

    Args:
        positions: (N, 3) float32. Predicted positions of the points in the first set, as unit
            vectors.
        reach: Largest distance from the prediction, in radians.
    """
    around = np.flatnonzero(spots @ positions.mean(axis=0) > _AROUND)
    if len(first) == 0 or len(around) < 2:
        return pair(first, second[:0], spots[:0], apart, limit)
    second, spots = second[around], spots[around]

    def block(rows: slice) -> Pairs:
        near = positions[rows] @ spots.T > math.cos(reach)
        likeness = np.where(near, first[rows] @ second.T, np.float32(-1.0))
        return _told_apart(likeness, spots, apart, limit, _USUAL)

    pairs = _joined(block(rows) for rows in blocks_of(len(first)))
    return Pairs(pairs.first, around[pairs.second], pairs.ratio)


def blocks_of(count: int) -> Iterator[slice]:
    """Divide points into blocks, so that comparing all with all takes little memory."""
    for start in range(0, count, _BLOCK):
        yield slice(start, min(start + _BLOCK, count))


def _joined(blocks: Iterable[Pairs]) -> Pairs:
    """Join the matches of consecutive blocks of the first points."""
    parts = list(blocks)
    return Pairs(
        np.concatenate([pairs.first + _BLOCK * number for number, pairs in enumerate(parts)]),
        np.concatenate([pairs.second for pairs in parts]),
        np.concatenate([pairs.ratio for pairs in parts]),
    )


def thinned(pairs: Pairs, places: Float32, cell: float, most: int) -> Pairs:
    """Keep the most certain matches: one for each point, and a few from each part of a picture.

    Dozens of points on a striped carpet may match two or three points of the panorama, and any pose
    that explained these would outweigh everything else.

    Args:
        places: (N, 2) float32. Positions of the points in the first set.
        cell: Size of a part of the picture, in the same units as `places`.
        most: Maximum number of matches from one part.
    """
    order = np.argsort(pairs.ratio, kind="stable")
    _, once = np.unique(pairs.second[order], return_index=True)
    order = order[np.sort(once)]
    columns, rows = (places[pairs.first[order]] // cell).astype(np.int64).T
    part = rows * 10_000 + columns
    by_part = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[by_part], part[by_part], side="left")
    few = by_part[np.arange(len(part)) - starts < most]
    picks = np.sort(order[few])
    return Pairs(pairs.first[picks], pairs.second[picks], pairs.ratio[picks])


def _told_apart(
    likeness: Float32, spots: Float32, apart: float, limit: float, usual: float = -1.0
) -> Pairs:
    """Choose the most similar points, unless a rival elsewhere or `usual` is nearly as similar."""
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
