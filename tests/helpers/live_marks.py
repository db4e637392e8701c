"""Reads the numbers that a simulated camera puts into the pictures of its preview."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.devices.simulated.preview import BITS, BLOCKS, LOOP, edge, mark_rows, pattern


def read_number(picture: NDArray[np.uint8]) -> int | None:
    """Read which picture of the loop this is.

    `picture`, (H, W, 3) uint8: decoded, at any size. 0 to 31; None when the blocks are not to be
    read.
    """
    rows, columns = picture.shape[:2]
    row = rows - mark_rows(rows) // 2 - 1
    places = [(edge(index, columns) + edge(index + 1, columns)) // 2 for index in range(BLOCKS)]
    bits = [int(value > 127) for value in picture[row, places].mean(axis=-1)]
    number = sum(bit << place for place, bit in enumerate(bits[2 : 2 + BITS]))
    return number if number < LOOP and bits == pattern(number) else None
