"""Frames that do not fit the others of a bracket as a damaged JPEG does not.

Damage in the coded data of a JPEG goes unnoticed where it still decodes: from there on blocks are
missing or too many, so that the rest of the picture is displaced sideways, and its colours are off
by a constant. What moved, or changed its light, does neither over the whole width. So strips of
rows of two frames are laid on each other at every sideways shift (circular correlation, which needs
no response), and their codes are compared with what the exposures allow.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from app.core.hdr.contradiction import Predictions, Tolerance, contradiction

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Bools, Bytes, Float64


_LOW, _HIGH = 8, 243
_STRIP: Final = 4  # rows
_LEAST_SHIFT: Final = 2  # columns: a block of 16 pixels is two in a picture an eighth as wide
_LEAST_CONTRAST: Final = 2.0
_LIKE: Final = 0.6
_BETTER: Final = 0.25
_MOST: Final = 0.6
_FEW: Final = 0.2
# The camera's own curve is not known here; it is near enough to sRGB for what damage does.
_ANY_CURVE: Final = Tolerance(stops=0.7, codes=6.0, toe=6.0, under=1.0, over=0.6, either=True)
_LEAST_STRIPS: Final = 2
_NEIGHBOURS: Final = 2


def disagreeing(frames: Sequence[Bytes], stops: Sequence[float]) -> tuple[int, ...]:
    """Find the frames that are likely damaged.

    `frames`, (h, w, 3) uint8 each, are area means of a panorama's frames, coded as in their
    files. Returns the fewest whose damage explains every pair that does not fit; both frames of
    a pair where neither is likelier. Empty with fewer than three frames.
    """
    if len(frames) < 3:
        return ()
    order = sorted(range(len(frames)), key=lambda k: stops[k])
    clashes = [
        {order[a], order[b]}
        for a, b in combinations(range(len(order)), 2)
        if b - a <= _NEIGHBOURS
        and _clash(frames[order[b]], frames[order[a]], stops[order[b]] - stops[order[a]])
    ]
    found: list[int] = []
    while clashes:
        counts = {k: sum(k in clash for clash in clashes) for k in order}
        worst = [k for k in order if counts[k] == max(counts.values())]
        found += worst
        clashes = [clash for clash in clashes if not clash & set(worst)]
    return tuple(sorted(found))


def _clash(bright: Bytes, dark: Bytes, step: float) -> bool:
    """Whether strips of one frame are displaced against the other, or impossible beside it."""
    if bright.shape != dark.shape or bright.shape[0] < 4 * _STRIP:
        return False
    rows = bright.shape[0] // _STRIP * _STRIP
    bright, dark = bright[:rows], dark[:rows]
    return _run(_displaced(bright, dark)) or _run(_contradicted(bright, dark, step))


def _displaced(one: Bytes, other: Bytes) -> Bools:
    """Mark strips in which one is like the other when moved sideways, and not as it lies."""
    sound = (one > _LOW) & (one < _HIGH) & (other > _LOW) & (other < _HIGH)
    valid = np.asarray(sound.all(axis=2))
    here, there = (_detail(frame, valid) for frame in (one, other))
    spectrum = np.conj(np.fft.rfft(here, axis=1)) * np.fft.rfft(there, axis=1)
    strips = len(here) // _STRIP
    spectrum = spectrum.reshape(strips, _STRIP, -1).sum(axis=1)
    match = np.fft.irfft(spectrum, here.shape[1], axis=1)
    power = [np.square(part).reshape(strips, -1).sum(axis=1) for part in (here, there)]
    match /= np.maximum(np.sqrt(power[0] * power[1]), 1e-9)[:, None]
    near = max(_LEAST_SHIFT, 1)
    still = np.concatenate([match[:, :near], match[:, 1 - near :]], axis=1).max(axis=1)
    best = match[:, near : match.shape[1] - near + 1].max(axis=1)
    rich = np.minimum(*power) > _LEAST_CONTRAST**2 * _STRIP * here.shape[1]
    return np.asarray(rich & (best > _LIKE) & (best > still + _BETTER))


def _detail(frame: Bytes, valid: Bools) -> Float64:
    """Keep what stands out sideways in the grey codes, where they can be compared."""
    grey = frame.astype(np.float64).mean(axis=2)
    weight = valid.astype(np.float64)
    width = (max(frame.shape[1] // 16, 3) | 1, 1)
    mean = cv2.blur(grey * weight, width, borderType=cv2.BORDER_REFLECT)
    mean /= np.maximum(cv2.blur(weight, width, borderType=cv2.BORDER_REFLECT), 1e-3)
    return np.asarray((grey - mean) * weight, np.float64)


def _contradicted(bright: Bytes, dark: Bytes, step: float) -> Bools:
    """Mark strips in which hardly a pixel of one frame can be what the other shows."""
    codes = np.arange(256) / 255.0
    curve = np.broadcast_to(
        np.where(codes > 0.04, ((codes + 0.055) / 1.055) ** 2.4, codes / 12.92), (3, 256)
    )
    expected = Predictions(curve, (step, 0.0)).between(0, 1, _ANY_CURVE)
    off = contradiction(bright, dark, expected) > 0
    share = off.reshape(len(off) // _STRIP, -1).mean(axis=1)
    bad = share > _MOST
    calm = share[~bad]
    return np.asarray(bad & (len(calm) > 0 and float(np.median(calm)) < _FEW))


def _run(marks: Any) -> bool:
    """Whether enough strips after each other are marked."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(marks, np.int8), [0]])))
    return bool(len(ends) and np.max(ends[1::2] - ends[::2]) >= _LEAST_STRIPS)
