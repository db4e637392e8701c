"""Pictures on their way from a source: of the right kind, and no larger than is wanted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

if TYPE_CHECKING:
    from app.devices.webcam.protocol import Bytes

_SMALLEST: Final = 16  # pixels a side
_LARGEST: Final = 8192
_SEED: Final = 7
_SHIFT: Final = 64  # pixels that the grain is shifted about


def as_rgb(picture: Any) -> Bytes | None:
    """Turn what OpenCV gives into sRGB.

    Parameters
    ----------
    picture : array, (H, W), (H, W, 1) or (H, W, 3) uint8
        Grey, or blue first.

    Returns
    -------
    (H, W, 3) uint8 or None
        sRGB, red first; None for what is no picture, or one of less than 16 or more than 8,192
        pixels a side.
    """
    given = np.asarray(picture)
    if given.dtype != np.uint8 or given.ndim not in (2, 3) or min(given.shape[:2]) < _SMALLEST:
        return None
    if max(given.shape[:2]) > _LARGEST:
        return None
    if given.ndim == 2 or given.shape[2] == 1:
        return np.asarray(cv2.cvtColor(given, cv2.COLOR_GRAY2RGB), np.uint8)
    if given.shape[2] != 3:
        return None
    return np.asarray(cv2.cvtColor(given, cv2.COLOR_BGR2RGB), np.uint8)


def fitted(picture: Bytes, width: int) -> Bytes:
    """Make a picture smaller where it is wider than is wanted.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        sRGB.
    width : int
        Most columns; 0 for any.

    Returns
    -------
    (h, w, 3) uint8
        In the same proportions; the same array where it fits.
    """
    rows, columns = picture.shape[:2]
    if width <= 0 or columns <= width:
        return picture
    size = (width, max(round(rows * width / columns), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


class Grain:
    """Noise of a sensor, new in each picture: made once, and then only shifted about.

    Parameters
    ----------
    size : tuple[int, int]
        Columns and rows of the pictures.
    """

    def __init__(self, size: tuple[int, int], noise: float) -> None:
        self._chance = np.random.default_rng(_SEED)
        shape = (size[1] + _SHIFT, size[0] + _SHIFT, 3)
        values = np.round(self._chance.normal(0.0, noise, shape))
        self._plus = np.clip(values, 0, 255).astype(np.uint8)
        self._minus = np.clip(-values, 0, 255).astype(np.uint8)

    def on(self, picture: Bytes) -> Bytes:
        """Return a noisy copy of a picture.

        Parameters
        ----------
        picture : (H, W, 3) uint8
            Of the size it was made for.

        Returns
        -------
        (H, W, 3) uint8
            A new array.
        """
        left, top = (int(n) for n in self._chance.integers(0, _SHIFT, 2))
        rows, columns = picture.shape[:2]
        box = (slice(top, top + rows), slice(left, left + columns))
        return np.asarray(
            cv2.subtract(cv2.add(picture, self._plus[box]), self._minus[box]), np.uint8
        )
