"""Equalise two lenses where their views overlap and find the seam between them.

The lenses are equalised by one gain per channel and one falloff. The seam runs where the two agree
best.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.measure.fisheye.lens_pair import (
    AROUND,
    STEP_DEG,
    Pair,
    about_seam,
    looked_up,
    seam_directions,
    seam_rows,
)

_MOST_FALLOFF: Final = 0.5

BLEND_DEG: Final = 0.6
"""Width of the band across the seam over which one lens fades into the other, in degrees."""


def equalise(light: Float32, clipped: Float32, pair: Pair) -> Pair:
    """Measure the relative brightness of the lenses in each channel and their falloff."""
    one, two, toward = _overlap(np.dstack([light, clipped]), pair)
    valid = (one[..., 3] < 0.01) & (two[..., 3] < 0.01)
    level = float(np.median(one[..., :3]))
    valid &= (one[..., :3].min(axis=-1) > 0.02 * level) & (two[..., :3].min(axis=-1) > 0.02 * level)
    if valid.sum() < 500:
        return pair
    ratio = np.log(one[..., :3][valid] / two[..., :3][valid])
    place = np.broadcast_to(np.radians(toward)[:, None], valid.shape)[valid]
    mean = ratio.mean(axis=1)
    slope, weight = 0.0, np.ones(len(place))
    for _ in range(10):
        centre = float(np.average(mean, weights=weight))
        slope = float((weight * place * (mean - centre)).sum() / (weight * place * place).sum())
        off = np.abs(mean - centre - slope * place)
        weight = 1.0 / np.maximum(off / max(float(np.median(off)), 0.01), 1.0) ** 2
    gains = [float(np.average(ratio[:, c], weights=weight)) for c in range(3)]
    # Both lose exp(-falloff (t / 90 degrees)^3): towards the front, one loses less and one more.
    falloff = slope * math.pi / 12.0
    half = np.array(gains) / 2.0
    return replace(
        pair,
        gains=np.stack([np.exp(-half), np.exp(half)]),
        falloff=min(max(falloff, 0.0), _MOST_FALLOFF),
    )


def find_seam(light: Float32, pair: Pair) -> Float64:
    """Find the path where the lenses agree best, by dynamic programming around the seam twice."""
    one, two, toward = _overlap(light, pair)
    one, two = one * pair.gains[0].astype(np.float32), two * pair.gains[1].astype(np.float32)
    floor = 0.02 * float(np.median(one)) + 1e-9
    cost = np.abs(np.log(one + floor) - np.log(two + floor)).max(axis=-1)
    cost = cv2.GaussianBlur(cost, (5, 5), 0) + 0.01 + 0.004 * np.abs(toward)[:, None]
    edge = round(BLEND_DEG / STEP_DEG)
    cost[:edge] = cost[-edge:] = 1e3
    total, back = cost[:, 0].copy(), np.zeros((2 * AROUND, len(cost)), np.int8)
    for column in range(1, 2 * AROUND):
        padded = np.pad(total, 1, constant_values=np.inf)
        ways = np.stack([padded[:-2] + 0.02, padded[1:-1], padded[2:] + 0.02])
        back[column] = ways.argmin(axis=0) - 1
        total = ways.min(axis=0) + cost[:, column % AROUND]
    place, path = int(total.argmin()), np.zeros(2 * AROUND)
    for column in range(2 * AROUND - 1, -1, -1):
        path[column] = toward[place]
        place += int(back[column, place])
    half = AROUND // 2
    middle = path[half : half + AROUND]
    return np.asarray(np.roll(middle, half))


def _overlap(picture: Float32, pair: Pair) -> tuple[Float32, Float32, Float64]:
    """Return each lens's view of the overlap, (rows, 1440, channels), and the rows in degrees."""
    rows = seam_rows(pair.field_deg)
    grid = seam_directions(rows)
    toward, around = about_seam(grid)
    strips = []
    for index in range(2):
        x, y, _ = looked_up(pair, index, grid, toward, around)
        strip = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        strips.append(np.asarray(strip, np.float32))
    return strips[0], strips[1], np.asarray(np.arange(-rows, rows + 1) * STEP_DEG, np.float64)
