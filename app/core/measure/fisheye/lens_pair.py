"""A calibrated pair of fisheye lenses: the mapping of directions to pixels, and the seam.

The lenses are a few centimetres apart, so they see nearby objects in different directions. This
parallax runs along the meridians of the lenses' common axis. Half of the parallax is attributed to
each lens, and it fades out away from the seam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Float32, Float64
from app.core.base.sphere import from_vector
from app.core.measure.fisheye.circles import FisheyeLens

# Strips have a sample every quarter of a degree, along the seam and across it.
STEP_DEG: Final = 0.25
AROUND: Final = 1440
_MARGIN_DEG: Final = 0.8  # excluded rim, which is soft
_LEAST_BLOCKS: Final = 6
_FADE_DEG: Final = 30.0  # distance from the seam at which the parallax has faded out


@dataclass(frozen=True, slots=True)
class Pair:
    """Two calibrated lenses, the front one first, and their seam.

    Attributes:
        field_deg: Angle that each image circle spans, in degrees.
        blocks: Number of positions around the seam at which the lenses agreed.
        parallax: (1440,) float64. Angle between the two lenses' views of an object, in degrees. The
            entries run around the seam, clockwise from the top as seen by the front lens.
        seam: (1440,) float64. Position of the seam in degrees towards the front, in the same order.
        gains: (2, 3) float64. Factors for each lens and channel.
        falloff: Logarithm of a lens's light loss at 90 degrees from its axis. The loss is assumed
            to grow with the cube of the angle, which lies between the square law of simple optics
            and the effect of hoods and stops.
    """

    lenses: tuple[FisheyeLens, FisheyeLens]
    field_deg: float
    blocks: int = 0
    parallax: Float64 = field(default_factory=lambda: np.zeros(AROUND), repr=False)
    seam: Float64 = field(default_factory=lambda: np.zeros(AROUND), repr=False)
    gains: Float64 = field(default_factory=lambda: np.ones((2, 3)), repr=False)
    falloff: float = 0.0

    @property
    def measured(self) -> bool:
        """Whether enough positions agreed to calibrate the lenses."""
        return self.blocks >= _LEAST_BLOCKS

    @property
    def parallax_deg(self) -> float:
        """The median parallax of the two lenses at the seam, in degrees."""
        return float(np.median(np.abs(self.parallax)))


def upright(pair: Pair, up_deg: float) -> Pair:
    """Rotate both lenses to make `up_deg`, clockwise from the top of the front one, point up."""
    turn = about_axis(math.radians(-up_deg))
    first, second = pair.lenses
    samples = round(up_deg / 360.0 * AROUND)
    return replace(
        pair,
        lenses=(
            replace(first, axes=first.axes @ turn.T),
            replace(second, axes=second.axes @ turn.T),
        ),
        parallax=np.roll(pair.parallax, -samples),
        seam=np.roll(pair.seam, -samples),
    )


def looked_up(
    pair: Pair, index: int, vectors: Float32, toward: Float32, around: Float32
) -> tuple[Float32, Float32, Float32]:
    """Map directions to the picture from a lens, with half of the parallax removed.

    Args:
        index: 0 for the front lens, 1 for the back lens.
        vectors: (..., 3) float32. Directions in the coordinate system of the pair.
        toward, around: (...) float32. Positions of the directions, as returned by `about_seam`.

    Returns:
        The columns, the rows and the factors that correct the falloff, (...) float32 each.
    """
    fade = np.clip(1.0 - np.abs(toward) / _FADE_DEG, 0.0, 1.0)
    give = np.radians(0.5 * fade * fade * (3.0 - 2.0 * fade) * around_seam(pair.parallax, around))
    sign = -1.0 if index == 0 else 1.0
    shifted = _tipped(vectors, (sign * give).astype(np.float32))
    x, y, angle = pair.lenses[index].project(shifted)
    loss = pair.falloff * (angle / np.float32(math.pi / 2.0)) ** 3
    return x, y, np.exp(loss).astype(np.float32)


def about_seam(vectors: Float32) -> tuple[Float32, Float32]:
    """Return the positions of directions relative to the seam.

    Args:
        vectors: (..., 3) float32. Unit directions in the coordinate system of the pair.

    Returns:
        The degrees from the seam's plane towards the front, and the samples around the seam from
        the top, (...) float32 each.
    """
    toward = np.degrees(np.arcsin(np.clip(vectors[..., 2], -1.0, 1.0)))
    around = np.arctan2(-vectors[..., 0], vectors[..., 1]) * (AROUND / (2.0 * math.pi))
    return toward.astype(np.float32), around.astype(np.float32)


def _tipped(vectors: Float32, angles: Float32) -> Float32:
    """Tip directions towards the front by the given angles, in radians."""
    flat = np.maximum(np.hypot(vectors[..., 0], vectors[..., 1]), 1e-9)
    cosine, sine = np.cos(angles), np.sin(angles)
    scale = cosine - sine * vectors[..., 2] / flat
    result = vectors * scale[..., None]
    result[..., 2] = vectors[..., 2] * cosine + flat * sine
    return np.asarray(result, np.float32)


def around_seam(curve: Float64, around: Float32) -> Float32:
    """Interpolate a periodic curve that is sampled around the seam.

    Args:
        curve: (n,) float64. One value per sample around the seam.
        around: float32, any shape. Positions in samples, counted from the top.
    """
    base = np.floor(around)
    first = base.astype(np.intp) % AROUND
    share = (around - base).astype(np.float32)
    values = curve.astype(np.float32)
    return np.asarray(values[first] * (1.0 - share) + values[(first + 1) % AROUND] * share)


def about_axis(angle: float) -> Float64:
    """Return the rotation about the front axis by an angle in radians.

    The rotation is clockwise as seen by the front lens.
    """
    return from_vector(np.array([0.0, 0.0, angle]))


def seam_rows(field_deg: float) -> int:
    """Return the number of samples on each side of the seam that both lenses see."""
    return max(int((field_deg / 2.0 - 90.0 - _MARGIN_DEG) / STEP_DEG), 4)


def seam_directions(rows: int) -> Float32:
    """Return the directions of a strip, (2 rows + 1, 1440, 3), from the back towards the front."""
    toward = np.radians(np.arange(-rows, rows + 1) * STEP_DEG)[:, None]
    around = (np.arange(AROUND) * (2.0 * math.pi / AROUND))[None]
    level = np.cos(toward)
    parts = (-np.sin(around) * level, np.cos(around) * level, np.sin(toward) + 0.0 * around)
    return np.stack(parts, axis=-1).astype(np.float32)
