"""Frames that do not fit each other, merged by how far they agree.

Scans of film that are warped, a hand that a homography does not undo, tone curves that differ from
place to place: weights by noise leave nearly all to the brightest frame that is not clipped, and
at an edge that lies a pixel off there the light is wrong by stops although all darker frames say
otherwise. So where frames differ beyond noise in most places, each frame's log light counts by

    1 / (e^2 + d^2) / (1 + r^2 / s^2 / (e^2 + d^2))

with e the relative error of its code, d by how much it differs from its neighbours in exposure, as
measured, and r how far it lies off the mean of all (Cauchy's weights, a few rounds).
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.hdr.weighting import clipped_code, relative_error

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Bools, Bytes, Float32, Float64
    from app.core.hdr.decoding import Pixels
    from app.core.hdr.weighted_merge import FrameLight


# Codes that say how much light there is: from here on, and so far below clipping.
_DARKEST: Final = 32
_UNDER_WHITE: Final = 19
_FEWEST: Final = 300
_USUAL: Final = 0.8  # of the places keep to what frames are said to differ by
# Frames of one curve and of curves of their own differ by 0.03 to 0.08 (natural logarithm), scans
# of film by 0.1 to 0.6. Below this they are believed to fit.
_MISFIT: Final = 0.1
# With wider steps hardly a place is well exposed in three frames: there is no majority.
_WIDE_STOPS: Final = 1.5
_ODD: Final = 1.4  # standard errors from which on a frame loses its say
_ROUNDS: Final = 3
_TOLD: Final = 0.25  # of a frame's say that is enough for a mean
_LEAST: Final = 1e-12


def doubts(samples: Bytes, table: Float64, stops: Sequence[float]) -> tuple[float, ...]:
    """Measure how far each frame differs from its neighbours, in natural logarithms.

    `samples`, (K, N, 3) uint8, are coded values of the same places; `table`, (3, 256) or (K, 3,
    256), linear light of each code; `stops` true exposures. Empty where the frames fit, cannot
    be compared, or are too far apart to outvote another.
    """
    if len(stops) < 3 or np.median(np.abs(np.diff(np.sort(stops)))) > _WIDE_STOPS:
        return ()
    tables = np.broadcast_to(table, (len(stops), 3, 256))
    order = sorted(range(len(stops)), key=lambda k: -stops[k])
    off = np.full(len(stops) - 1, np.nan)
    for pair, (bright, dark) in enumerate(pairwise(order)):
        both = _telling(samples[bright], tables[bright]) & _telling(samples[dark], tables[dark])
        places, channels = np.nonzero(both)
        if places.size >= _FEWEST:
            light = [tables[k][channels, samples[k, places, channels]] for k in (bright, dark)]
            ratio = np.log(light[1] / light[0]) + np.log(2.0) * (stops[bright] - stops[dark])
            off[pair] = np.quantile(np.abs(ratio), _USUAL)
    known = np.flatnonzero(np.isfinite(off))
    if not known.size or off[known].max() < _MISFIT:
        return ()
    off = np.interp(np.arange(off.size), known, off[known])
    by_order = 0.5 * (np.append(off, off[-1]) + np.append(off[0], off))
    return tuple(float(by_order[order.index(k)]) for k in range(len(stops)))


def _telling(codes: Bytes, table: Float64) -> Bools:
    return np.asarray((codes >= _DARKEST) & (codes < clipped_code(table) - _UNDER_WHITE))


def agree(
    bands: Sequence[Pixels],
    lights: Sequence[FrameLight],
    trusts: Sequence[Float32 | None],
    doubt: Sequence[float],
    radiance: Sequence[Float32],
) -> None:
    """Put the mean of what agrees in the place of merged light, where frames are not clipped.

    `bands`, (rows, W, 3) uint8, are the same rows of each frame; `radiance`, three of (rows,
    W), what they were merged to, is changed in place.
    """
    logs, says, sure = [], [], []
    told = np.zeros(radiance[0].shape, np.float32)
    for pixels, light, trust, own in zip(bands, lights, trusts, doubt, strict=True):
        error = relative_error(light.tables.value) ** 2 + own**2
        precision = cv2.LUT(pixels.min(axis=-1), (1.0 / error).astype(np.float32))
        use = cv2.LUT(pixels.max(axis=-1), light.tables.bright)
        use = use if trust is None else use * trust
        told += use
        says.append(use * precision)
        sure.append(precision)
        logs.append(_logs(pixels, light))
    mean = _mean(logs, says)
    for _ in range(_ROUNDS):
        left = []
        for log, say, precision in zip(logs, says, sure, strict=True):
            off = np.square(log - mean).mean(axis=-1) * precision
            left.append(say / (np.float32(1.0) + off * np.float32(_ODD**-2)))
        mean = _mean(logs, left)
    share = np.minimum(told * np.float32(1.0 / _TOLD), np.float32(1.0))
    for channel, plane in enumerate(radiance):
        plain = np.log(np.maximum(plane, np.float32(_LEAST)))
        plane[...] = np.exp(plain + share * (mean[..., channel] - plain))


def _logs(pixels: Pixels, light: FrameLight) -> Float32:
    """Logarithms of the light, (rows, W, 3)."""
    table = np.log(np.maximum(light.tables.value, np.float32(_LEAST)))
    return np.asarray(cv2.LUT(pixels, np.ascontiguousarray(table.T[None])), np.float32)


def _mean(logs: Sequence[Float32], says: Sequence[Float32]) -> Float32:
    total = np.maximum(np.add.reduce(says), np.float32(_LEAST))
    some = [log * say[..., None] for log, say in zip(logs, says, strict=True)]
    return np.asarray(np.add.reduce(some) / total[..., None], np.float32)
