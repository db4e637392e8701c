"""Views of a turned head, and their compression for storage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.baking.light_sources import (
    TexelColumns,
    texel_functions,
)
from app.core.base.arrays import Float32
from app.core.portrait.head_views import pack_view
from app.core.solver.transport import Transport

_VIEW_RANK, _VIEW_TINTS = 200, 176
# 0 weights texels by their light, 1 weights them equally; this value is best in real places.
_VIEW_EVENNESS = 0.3


@dataclass(frozen=True, slots=True)
class BakedView:
    """A head as seen by a camera at its side.

    Attributes:
        pixels, coverage: (P,) int32 and (P,) float32, as in a transport.
        positions: (P, 3) float32. Position on the head at each pixel, as in `HeadShape`.
        matrix: (P, H * W, 3) float32. The uncompressed transport.
        targets: (S, P, 3) float32, as in `BakeResult`.
    """

    yaw_deg: float
    pixels: NDArray[np.int32]
    coverage: Float32
    positions: Float32
    matrix: Float32
    targets: Float32


def packed_views(
    views: Sequence[BakedView], transport: Transport
) -> tuple[Float32, dict[float, dict[str, NDArray[Any]]]]:
    """Compress the views of a head for storage.

    Args:
        transport: Transport of the same head.

    Returns:
        The functions over the texels that all views share, (rank, H * W) float32, and a dictionary
        that maps each yaw to the arrays of its view, as returned by `pack_view`.
    """
    weights = np.asarray(transport.header.luminance_weights, np.float32)
    greys = [view.matrix @ weights for view in views]
    texels = TexelColumns(*transport.environment_shape)
    basis, scale = texel_functions(greys, texels, _VIEW_RANK, _VIEW_EVENNESS)
    parts = {}
    for view, grey in zip(views, greys, strict=True):
        tints = (view.matrix[:, :, channel] - grey for channel in (0, 2))
        parts[view.yaw_deg] = pack_view(
            grey=np.asarray(grey / scale @ basis.T, np.float32),
            tints=np.stack(
                [tint / scale @ basis[:_VIEW_TINTS].T for tint in tints], dtype=np.float32
            ),
            pixels=view.pixels,
            coverage=view.coverage,
            positions=view.positions,
            targets=view.targets @ weights,
            size=transport.size,
        )
    return basis * scale, parts
