"""Colours of merged light that stand out by no more than the frames' codes leave open.

Rounding, noise and JPEG, which stores colour at half the size, leave a code several off. In a
channel that holds little beside the others, or near black, that is a stop and more, and shows as
salt and pepper of all colours. What a pixel's colour differs by from the median of its neighbours
is taken back as far as such an error explains it, so that a small lamp keeps its colour.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Float32, Indices
from app.core.hdr.decoding import row_bands
from app.core.hdr.pixels import workers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.progress import Token

_Change: TypeAlias = tuple[Indices, Float32]

_AROUND: Final = 5  # pixels of the square whose median is asked
_STOPS: Final = 0.15  # by which colours may differ from it as they like
_CODES: Final = 6.0  # by which a code may be wrong at the edges of colours
_OPEN: Final = 235  # codes from here on say less than those of a darker frame
_LEAST: Final = 1e-12
_BAND_PIXELS: Final = 1 << 20


def quiet_colours(radiance: Float32, values: Sequence[Float32], token: Token) -> None:
    """Take back colours of merged light, (h, w, 3), that stand out, in place.

    `values`, (3, 256) each, are the light of each code of each frame, brightest first, in that
    unit.
    """
    height, width = radiance.shape[:2]
    bands = list(row_bands(height, max(_AROUND, _BAND_PIXELS // width)))
    with ThreadPoolExecutor(workers(len(bands))) as pool:
        found = list(pool.map(partial(_changes, radiance, values, token), bands))
    flat = radiance.reshape(-1)
    for places, light in (change for changes in found for change in changes):
        flat[places] = light


def _changes(
    radiance: Float32, values: Sequence[Float32], token: Token, rows: tuple[int, int]
) -> list[_Change]:
    """Places in the flat picture, and their new light, of each channel in some rows."""
    token.check()
    start, stop = rows
    top = max(start - _AROUND // 2, 0)
    light = radiance[top : stop + _AROUND // 2]
    mean = np.maximum(light.mean(axis=-1), np.float32(_LEAST))
    inner = slice(start - top, stop - top)
    changes = []
    for channel in range(3):
        share = np.maximum(light[..., channel], np.float32(_LEAST)) / mean
        colour = np.log2(share)
        usual = np.asarray(cv2.medianBlur(colour, _AROUND), np.float32)
        over = (colour - usual)[inner]
        odd = np.flatnonzero(np.abs(over) > np.float32(_STOPS))
        kept = usual[inner].take(odd) + np.clip(over.take(odd), -_STOPS, _STOPS)
        own = light[inner][..., channel].ravel().take(odd)
        most = light[inner].max(axis=-1).ravel().take(odd)
        leeway = _leeway(own, most, values, channel)
        wanted = mean[inner].ravel().take(odd) * np.exp2(kept)
        new = own + np.clip(wanted - own, -leeway, leeway)
        changes.append(((start * radiance.shape[1] + odd) * 3 + channel, new.astype(np.float32)))
    return changes


def _leeway(own: Float32, most: Float32, values: Sequence[Float32], channel: int) -> Float32:
    """Light that a few codes stand for in the brightest frame that does not clip the pixel."""
    leeway = np.zeros(own.shape, np.float32)
    left = np.arange(own.size)
    for number, value in enumerate(values):
        open_here = most[left] < value[:, _OPEN].min()
        here = left if number == len(values) - 1 else left[open_here]
        slope = np.gradient(value[channel])
        leeway[here] = np.interp(own[here], value[channel], slope)
        left = left[~open_here]
    return np.asarray(_CODES * leeway, np.float32)
