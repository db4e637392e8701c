"""Pieces of a panorama at any size, with what is clipped hatched: arrays only, no Qt.

A picture of 4,096 columns shown at 800 % would have tens of thousands of columns; only the
pieces in the window are ever made. Every piece is cut from the same whole, so that pieces meet
without a seam, also where the panorama wraps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

Bytes: TypeAlias = NDArray[np.uint8]

_SMALLEST: Final = 512  # columns below which no smaller copy is made
_GAP: Final = 1 / 340  # of the width, half of the widest gap: 3 texels of 1,024
_CLIPPED: Final = 0.02  # share of a texel from which it counts as clipped
_INK: Final = 16
_PAPER: Final = 245


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """A panorama and its halves, quarters and so on, each ready to be cut.

    Attributes
    ----------
    pictures : tuple of (h + 2, w + 2, 3) uint8
        sRGB, largest first, each with one more column and row on every side: columns go on
        around the panorama, rows repeat.
    masks : tuple of (h + 2, w + 2) uint8
        255 where clipped, in the same way; empty when nothing is.
    """

    pictures: tuple[Bytes, ...]
    masks: tuple[Bytes, ...]


def make_layers(picture: Bytes, clipped: NDArray[Any] | None = None) -> Layers:
    """Prepare a panorama for `cut`.

    Parameters
    ----------
    picture : NDArray[np.uint8], (h, w, 3)
        sRGB.
    clipped : (H, W) bool or float, optional
        Where it is clipped: true, or the share of the texel, 0 to 1. Any size.
    """
    pictures = [np.ascontiguousarray(picture)]
    while pictures[-1].shape[1] >= 2 * _SMALLEST:
        rows, columns = pictures[-1].shape[:2]
        size = (columns // 2, max(rows // 2, 1))
        half = cv2.resize(pictures[-1], size, interpolation=cv2.INTER_AREA)
        pictures.append(np.asarray(half, np.uint8))
    masks: list[Bytes] = []
    if clipped is not None:
        mask = np.asarray(np.asarray(clipped, np.float32) > _CLIPPED, np.uint8) * np.uint8(255)
        masks = _shrunk(_joined(mask)) if mask.any() else []
    return Layers(tuple(map(_padded, pictures)), tuple(map(_padded, masks)))


def _joined(mask: Bytes) -> Bytes:
    """Close the gaps between specks that lie close together: hatched one by one they are noise."""
    reach = round(mask.shape[1] * _GAP)
    if reach < 1:
        return mask
    size = 2 * reach + 1
    round_ = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    around = np.concatenate([mask[:, -size:], mask, mask[:, :size]], axis=1)
    closed = cv2.morphologyEx(around, cv2.MORPH_CLOSE, round_)
    return np.ascontiguousarray(closed[:, size:-size], np.uint8)


def _shrunk(mask: Bytes) -> list[Bytes]:
    """Halve a mask such that a thin lamp never vanishes."""
    masks = [mask]
    while masks[-1].shape[1] >= 2 * _SMALLEST:
        big = masks[-1]
        rows, columns = big.shape[0] // 2 * 2, big.shape[1] // 2 * 2
        blocks = big[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2)
        masks.append(np.ascontiguousarray(blocks.max(axis=(1, 3))))
    return masks


def _padded(image: Bytes) -> Bytes:
    edges = ((1, 1), (0, 0)) if image.ndim == 2 else ((1, 1), (0, 0), (0, 0))
    tall = np.pad(image, edges, mode="edge")
    return np.ascontiguousarray(np.concatenate([tall[:, -1:], tall, tall[:, :1]], axis=1))


def cut(layers: Layers, whole: tuple[int, int], place: tuple[int, int, int, int]) -> Bytes:
    """Cut a piece out of a panorama scaled to a size.

    Parameters
    ----------
    whole : (width, height)
        Size of the whole panorama, device pixels.
    place : (x, y, width, height)
        Piece of it, device pixels, within the whole.

    Returns
    -------
    NDArray[np.uint8], (height, width, 3)
        sRGB, bilinear.
    """
    return _sample(layers.pictures, whole, place)


def _sample(
    levels: tuple[Bytes, ...], whole: tuple[int, int], place: tuple[int, int, int, int]
) -> Bytes:
    """Sample from the smallest level that is at least as large as what is wanted."""
    fitting = [level for level in levels if level.shape[1] - 2 >= whole[0]]
    level = fitting[-1] if fitting else levels[0]
    x, y, width, height = place
    across = (level.shape[1] - 2) / whole[0]
    down = (level.shape[0] - 2) / whole[1]
    # The middle of pixel i lies at (i + 0.5) across; the padding moves everything by one.
    left, top = (x + 0.5) * across + 0.5, (y + 0.5) * down + 0.5
    # OpenCV counts in whole 32767ths of very large pictures: only the part needed goes in.
    first_x, first_y = max(int(left) - 1, 0), max(int(top) - 1, 0)
    last_x = int(left + width * across) + 3
    last_y = int(top + height * down) + 3
    part = level[first_y:last_y, first_x:last_x]
    matrix = np.array([[across, 0.0, left - first_x], [0.0, down, top - first_y]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    shown = cv2.warpAffine(
        part, matrix, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(shown, np.uint8)


def hatch(
    piece: Bytes,
    layers: Layers,
    whole: tuple[int, int],
    place: tuple[int, int, int, int],
    period: float,
) -> None:
    """Hatch what is clipped on a piece in black and white, with a black edge.

    Parameters
    ----------
    piece : NDArray[np.uint8], (height, width, 3)
        From `cut`; changed in place.
    period : float
        From one white line to the next along a row, device pixels.
    """
    if not layers.masks:
        return
    x, y, width, height = place
    reach = max(round(period / 8.0), 1)
    share = _around(
        layers.masks, whole, (x - reach, y - reach, width + 2 * reach, height + 2 * reach)
    )
    if not share.any():
        return
    size = 2 * reach + 1
    grown = cv2.dilate(share, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    edge = np.asarray(grown[reach:-reach, reach:-reach], np.uint8)
    left, top, columns, rows = cv2.boundingRect(edge)
    here = (slice(top, top + rows), slice(left, left + columns))
    inside = share[reach:-reach, reach:-reach][here].astype(np.float32)[..., np.newaxis] / 255.0
    black = edge[here].astype(np.float32)[..., np.newaxis] / 255.0
    lines = _lines(x + left, y + top, columns, rows, period)[..., np.newaxis]
    shown = piece[here] + black * (_INK - piece[here].astype(np.float32))
    shown += inside * (lines - shown)
    piece[here] = (shown + 0.5).astype(np.uint8)


def _around(
    masks: tuple[Bytes, ...], whole: tuple[int, int], place: tuple[int, int, int, int]
) -> Bytes:
    """Sample a mask on a piece that may reach past the panorama's edges; sharpened."""
    x, y, width, height = place
    if not _touched(masks[-1], whole, place):
        return np.zeros((height, width), np.uint8)
    rows = np.clip(np.arange(y, y + height), 0, whole[1] - 1)
    pieces = []
    start = x
    while start < x + width:
        left = start % whole[0]
        count = min(whole[0] - left, x + width - start)
        top = int(rows[0])
        strip = _sample(masks, whole, (left, top, count, int(rows[-1]) - top + 1))
        pieces.append(strip[rows - top])
        start += count
    share = np.concatenate(pieces, axis=1).astype(np.float32)
    across = masks[0].shape[1] / whole[0]
    # Of a smaller copy anything counts; the soft edge of an enlarged one is sharpened.
    sharp = share / 127.5 if across > 1.0 else (share / 255.0 - 0.5) / max(across, 0.25) + 0.5
    return np.asarray(np.clip(sharp, 0.0, 1.0) * 255.0, np.uint8)


def _touched(mask: Bytes, whole: tuple[int, int], place: tuple[int, int, int, int]) -> bool:
    """Whether the smallest mask has anything near a piece; most pieces have nothing."""
    x, y, width, height = place
    across, down = (mask.shape[1] - 2) / whole[0], (mask.shape[0] - 2) / whole[1]
    top = max(int(y * down) - 1, 0)
    rows = mask[top : int((y + height) * down) + 4]
    left, right = int(x * across) - 1, int((x + width) * across) + 4
    columns = np.arange(left, right) % (mask.shape[1] - 2)
    return bool(rows[:, columns].any())


def _lines(x: int, y: int, width: int, height: int, period: float) -> NDArray[np.float32]:
    """Slanted white lines on black that belong to the whole, not to the piece."""
    phase = np.arange(x + y, x + y + width + height - 1) / period
    distance = np.abs(phase - np.floor(phase) - 0.5)
    # White within a quarter of the period from the middle, softened over one pixel.
    white = np.clip((0.25 - distance) * period + 0.5, 0.0, 1.0)
    line = (_INK + (_PAPER - _INK) * white).astype(np.float32)
    # Every row is the one above, one pixel on.
    return np.lib.stride_tricks.sliding_window_view(line, width)
