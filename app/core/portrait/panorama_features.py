"""What two panoramas of a place have in common: directions to the same things.

RootSIFT features (Lowe 2004; Arandjelovic and Zisserman 2012) are found on the equirectangular
picture itself. Both cameras stand upright, so a thing appears at about the same height in both and
is stretched alike; no virtual views are needed. Contrast is evened out first (CLAHE), so that
exposure and a moved sun matter little.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_SIZE: Final = (512, 1024)
_PAD: Final = 64
_ROWS: Final = (80, 402)  # from 62 degrees up to 51 down: beyond, pictures are torn apart
_MOST: Final = 2000
_CONTRAST: Final = 0.02
_RATIO: Final = 0.85


@dataclass(frozen=True, slots=True)
class Features:
    """Things seen in a panorama.

    Attributes
    ----------
    vectors : (N, 3) float64
        Unit vectors to them, panorama axes of `app.core.base.sphere`.
    descriptors : (N, 128) float32
        RootSIFT, of length 1.
    """

    vectors: Float64
    descriptors: Float32


def features(picture: Bytes) -> Features:
    """Find features in a panorama.

    Parameters
    ----------
    picture : (h, 2 h, 3) uint8
        SRGB picture of any size; 1024 x 512 are looked at.

    Raises
    ------
    ValueError
        If it is not a panorama in bytes.
    """
    shape = picture.shape
    if picture.dtype != np.uint8 or len(shape) != 3 or shape[2] != 3 or shape[1] != 2 * shape[0]:
        raise ValueError(f"a panorama is (h, 2 h, 3) bytes, not {shape} {picture.dtype}")
    height, width = _SIZE
    method = cv2.INTER_AREA if shape[0] >= height else cv2.INTER_CUBIC
    small = cv2.resize(picture, (width, height), interpolation=method)
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)
    wide = cv2.copyMakeBorder(grey, 0, 0, _PAD, _PAD, cv2.BORDER_WRAP)
    even = cv2.createCLAHE(3.0, (8, 16)).apply(wide)
    mask = np.zeros(even.shape, np.uint8)
    mask[_ROWS[0] : _ROWS[1], _PAD:-_PAD] = 255
    points, found = cv2.SIFT.create(_MOST, contrastThreshold=_CONTRAST).detectAndCompute(even, mask)
    if not points:
        return Features(np.zeros((0, 3)), np.zeros((0, 128), np.float32))
    at = np.array([point.pt for point in points], np.float64)
    azimuth = 2.0 * np.pi * ((at[:, 0] - _PAD + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (at[:, 1] + 0.5) / height)
    level = np.cos(elevation)
    vectors = np.stack(
        [-np.sin(azimuth) * level, np.sin(elevation), np.cos(azimuth) * level], axis=1
    )
    raw = np.asarray(found, np.float32)
    root = np.sqrt(raw / np.maximum(raw.sum(axis=1, keepdims=True), 1e-6))
    return Features(vectors, root)


def matched(first: Features, second: Features) -> tuple[Float64, Float64]:
    """Pair the features of two panoramas that look alike, each with the other's best.

    Returns
    -------
    a, b : (M, 3) float64
        Unit vectors to the same things in the first and in the second panorama.
    """
    if len(first.vectors) < 2 or len(second.vectors) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3))
    likeness = first.descriptors @ second.descriptors.T
    two = np.argpartition(-likeness, 1, axis=1)[:, :2]
    values = np.take_along_axis(likeness, two, axis=1)
    order = np.argsort(-values, axis=1)
    two, values = np.take_along_axis(two, order, 1), np.take_along_axis(values, order, 1)
    distance = np.sqrt(np.maximum(2.0 - 2.0 * values, 0.0))
    best = two[:, 0]
    good = distance[:, 0] < _RATIO * distance[:, 1]
    good &= likeness.argmax(axis=0)[best] == np.arange(len(best))
    return first.vectors[good], second.vectors[best[good]]
