"""Open a frame to get its rows, a small copy and a sample of its pixels."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, Protocol

import cv2
import numpy as np

from app.core.base.arrays import Float32, Indices
from app.core.base.colour import largest_channel
from app.core.base.progress import Token
from app.core.measure.read.decoding import (
    READ_ROWS,
    FileRows,
    MemoryRows,
    Pixels,
    RawRows,
    RowSource,
    decode,
    decode_half,
    needs_whole_decode,
    row_bands,
)
from app.core.measure.read.frame import Frame

SAMPLES: Final = 20_000
"""Approximate number of sampled pixels."""

_REDUCTION: Final = 8
_MIN_PROXY_WIDTH: Final = 256
# Convert sums over n rows and n adjacent pixels of three channels to means.
_MEANS: Final = {
    size: np.tile(np.eye(3, dtype=np.float32), (size, 1)) * np.float32(size**-2)
    for size in (_REDUCTION, _REDUCTION // 2)
}
_SEED: Final = 20190820
# The maximum is the clipping level if enough pixels are at least this fraction of it.
_PLATEAU: Final = 0.9995
_PLATEAU_SHARE: Final = 1e-5
_LEAST_PLATEAU: Final = 4


@dataclass(frozen=True, slots=True)
class OpenedFrame:
    """A frame after its first pass. The owner of the frame has to close `source`.

    Attributes:
        proxy: (h, w, 3). Thumbnail that consists of area means, in the frame's own data type.
        samples: (N, 3). Pixels at fixed positions, which all frames of the same shape share.
        top: Level at which linear pixels saturate, or 0 if they do not.
    """

    source: RowSource
    proxy: Pixels = field(repr=False)
    samples: Pixels = field(repr=False)
    top: float


class Opener(Protocol):
    """Opens a frame or returns one that is already open."""

    def __call__(
        self, frame: Frame, *, hold: bool, token: Token, half: bool = False
    ) -> OpenedFrame:
        """Open a frame, as `open_frame` does."""


def proxy_shape(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the size of the thumbnails for frames of the given shape.

    Thumbnails are an eighth as wide as the frames, but at least 256 columns wide if the frames have
    that many.

    >>> proxy_shape((2688, 5376)), proxy_shape((512, 1024)), proxy_shape((100, 200))
    ((336, 672), (128, 256), (100, 200))
    """
    height, width = shape
    target_width = min(width, max(_MIN_PROXY_WIDTH, round(width / _REDUCTION)))
    return max(1, round(height * target_width / width)), target_width


def open_frame(frame: Frame, *, hold: bool, token: Token, half: bool = False) -> OpenedFrame:
    """Open a frame, keeping it in memory (`hold`) or preparing it to be read by rows.

    Raises:
        ProbeError: If the file is damaged or truncated, or the disk is full.
        Cancelled: If the token is cancelled.
    """
    places = sample_places(frame.shape)
    if half:
        pixels = decode_half(frame, token)
        proxy = shrunk(pixels, proxy_shape(frame.shape))
        return OpenedFrame(MemoryRows(pixels), proxy, sample_codes(pixels, places // 2), 0.0)
    if hold or frame.orientation != 1 or needs_whole_decode(frame.path):
        pixels = decode(frame, token)
        source: RowSource = MemoryRows(pixels) if hold else RawRows(pixels)
        proxy = shrunk(pixels, proxy_shape(frame.shape))
        return OpenedFrame(source, proxy, sample_codes(pixels, places), _top(pixels))
    rows = FileRows(frame)
    try:
        return _by_rows(rows, frame, places, token)
    finally:
        # A closed file reopens itself, so it need not stay open until the merge.
        rows.close()


def _by_rows(source: RowSource, frame: Frame, places: Indices, token: Token) -> OpenedFrame:
    """Read a frame once by rows, without keeping it in memory."""
    height = frame.shape[0]
    small = proxy_shape(frame.shape)
    # Compute whole rows of the thumbnail per step, each from the rows that it covers.
    per_step = max(1, READ_ROWS * small[0] // height)
    proxies: list[Pixels] = []
    samples: Pixels | None = None
    rest: Pixels | None = None
    last_row, top = 0, 0.0
    for start, stop in row_bands(small[0], per_step):
        token.check()
        first, last = start * height // small[0], -(-stop * height // small[0])
        pixels = source.rows(last_row, last)
        # A row that two small rows share was read in the previous step.
        if rest is not None and first < last_row:
            pixels = np.concatenate([rest[first - last_row :], pixels])
        top = max(top, _top(pixels))
        proxies.append(shrunk(pixels, (stop - start, small[1])))
        inside = (places[:, 0] >= last_row) & (places[:, 0] < last)
        if samples is None:
            samples = np.empty((len(places), 3), pixels.dtype)
        samples[inside] = pixels[places[inside, 0] - first, places[inside, 1]]
        rest, last_row = pixels[-1:].copy(), last
    assert samples is not None
    return OpenedFrame(source, np.concatenate(proxies), samples, top)


@lru_cache(maxsize=4)
def sample_places(shape: tuple[int, int]) -> Indices:
    """Return the rows and columns, (n, 2), of samples on a fixed jittered grid, top to bottom."""
    height, width = shape
    step = max(1.0, np.sqrt(height * width / SAMPLES))
    rows, columns = max(1, int(height / step)), max(1, int(width / step))
    jitter = np.random.default_rng(_SEED).random((2, rows, columns))
    row = (np.arange(rows)[:, None] + jitter[0]) * (height / rows)
    column = (np.arange(columns) + jitter[1]) * (width / columns)
    places = np.stack([row.ravel(), column.ravel()], axis=1).astype(np.intp)
    places.flags.writeable = False  # every caller gets the same array
    return places


def sample_codes(pixels: Pixels, places: Indices) -> Pixels:
    """Return the pixels at the given positions, (N, 3)."""
    return np.asarray(pixels[places[:, 0], places[:, 1]])


def _top(pixels: Pixels) -> float:
    """Return the saturation level of linear pixels: their maximum if many share it, otherwise 0."""
    if pixels.dtype != np.float32:
        return 0.0
    largest = largest_channel(pixels)
    finite = largest[np.isfinite(largest)]
    top = float(finite.max(initial=0.0))
    flat = np.count_nonzero(finite >= top * _PLATEAU)
    return top if flat >= max(_LEAST_PLATEAU, finite.size * _PLATEAU_SHARE) else 0.0


def shrunk(pixels: Pixels, shape: tuple[int, int]) -> Pixels:
    """Return the area means of pixels at a smaller size."""
    if pixels.shape[:2] == shape:
        return pixels.copy()
    if pixels.dtype == np.uint8:
        for size, means in _MEANS.items():
            if pixels.shape[:2] == (size * shape[0], size * shape[1]):
                return _means(pixels, shape, size, means)
    return np.asarray(cv2.resize(pixels, shape[::-1], interpolation=cv2.INTER_AREA))


def _means(pixels: Pixels, shape: tuple[int, int], size: int, means: Float32) -> Pixels:
    """Return area means of blocks of bytes, as OpenCV does but in two thirds of the time."""
    small = np.empty((*shape, 3), np.uint8)
    for start, stop in row_bands(shape[0], READ_ROWS // size):
        rows = pixels[start * size : stop * size]
        sums = np.add.reduce(rows.reshape(stop - start, size, -1), axis=1, dtype=np.uint16)
        values = sums.astype(np.float32).reshape(-1, len(means)) @ means
        small[start:stop] = np.rint(values).reshape(stop - start, shape[1], 3)
    return small
