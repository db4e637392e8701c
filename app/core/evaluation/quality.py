"""Quality C of pre-integrated targets at the 64 turns, for environments of any size.

The paper's way throughout: grey light, grey transport, and nothing but C (eq. 5).
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS

Float64: TypeAlias = NDArray[np.float64]
Floats: TypeAlias = NDArray[np.floating[Any]]


def quality_at_turns(targets: Floats, light: Floats, turns: int = TURNS) -> Float64:
    """C of every target at turns 0, 360 / `turns` ... deg.

    Parameters
    ----------
    targets : (S, H, W) float
        Pre-integrated targets F (eq. 3), panorama coordinates at turn 0.
    light : (H, W) float
        Luminance of the environment at turn 0.
    turns : int, optional
        How many turns. Environments of more columns are shifted by several; those of fewer are
        interpolated between their columns (band-limited, as the refined turn is).

    Returns
    -------
    (S, turns) float64
        In the unit of `light`.

    Examples
    --------
    >>> F = np.zeros((1, 2, 4)); F[0, 0, 1] = 1
    >>> L = np.zeros((2, 4)); L[0, 3] = 5
    >>> quality_at_turns(F, L, 4).round(6).tolist()
    [[0.0, 0.0, 5.0, 0.0]]
    """
    width = light.shape[1]
    forward = np.fft.rfft(np.asarray(targets, np.float64), axis=2)
    seen = np.fft.rfft(np.asarray(light, np.float64), axis=1)
    spectrum = (np.conj(forward) * seen).sum(axis=1)
    if turns > width:
        # The last frequency stands for both ends of the spectrum, which are apart from here on.
        spectrum[:, -1] *= 0.5
        between: Float64 = np.fft.irfft(spectrum, turns, axis=1) * (turns / width)
        return between
    every: Float64 = np.fft.irfft(spectrum, width, axis=1)[:, :: width // turns]
    return every


def block_sums(targets: Floats, shape: tuple[int, int]) -> Float64:
    """Pre-integrated targets for an environment of fewer texels.

    T holds the texels' solid angle, so the column of a larger texel is the sum of those in it.

    Parameters
    ----------
    targets : (..., H, W) float
        F of eq. 3.
    shape : tuple of int
        Rows and columns wanted; H and W must be whole multiples of them.

    Returns
    -------
    (..., rows, columns) float64
    """
    rows, columns = shape
    height, width = targets.shape[-2:]
    blocks = np.asarray(targets, np.float64).reshape(
        *targets.shape[:-2], rows, height // rows, columns, width // columns
    )
    result: Float64 = blocks.sum(axis=(-3, -1))
    return result
