"""Plain versions of the search's short cuts: full matrices, one target, one light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Floats
from app.core.measure.finish.clip_audit import choices
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS, Choice, Limits, Objective
from app.core.styles.style_pack import StylePack

Float32 = NDArray[np.float32]


def matrix(transport: Transport, channel: int | None = None) -> Float32:
    """Return the full matrix (P, H * W) float32 of one channel, or of luminance (None)."""
    basis = transport.luminance_basis if channel is None else transport.pixel_basis[channel]
    return np.asarray(basis @ transport.texel_basis)


def preintegrate(transport: Transport, weights: Floats) -> Float32:
    """Return the pre-integrated target F' = f'T (eq. 3).

    Args:
        weights: (P,) float. Target weights f on the head's pixels, zero outside the face.

    Returns:
        (H, W) float32. F in panorama coordinates at turn 0; C = sum(F * L) with L in luminance.
    """
    in_basis: Float32 = weights.astype(np.float32) @ transport.luminance_basis
    flat: Float32 = in_basis @ transport.texel_basis
    return flat.reshape(transport.environment_shape)


def choose(
    pack: StylePack,
    light: Floats,
    objective: Objective = "picture",
    limits: Limits = LIMITS,
) -> Choice:
    """Return the choice of turns under a light; see `clip_audit.choices`."""
    return choices(pack, [light], objective, limits)[0]
