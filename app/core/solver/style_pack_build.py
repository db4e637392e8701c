"""Making a style pack: targets become weights, weights are pre-integrated, mirror images exact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import StyleError
from app.core.solver.lamps import mirror_index, split_lamps
from app.core.solver.search_basis import build_basis
from app.core.solver.search_light import find_colours
from app.core.solver.style_pack import PackHeader, StylePack
from app.core.solver.transport import to_image
from app.core.solver.weights import target_weights

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.solver.styles import Style
    from app.core.solver.transport import Transport

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]


def build_pack(
    transport: Transport, styles: Sequence[Style], targets: NDArray[np.floating[Any]]
) -> StylePack:
    """Pre-integrate styles against a transport (eqs. 6 and 3).

    On a symmetric head a style and its mirror image are made exact mirrors of each other, and a
    style that is its own mirror image exactly even.

    Parameters
    ----------
    targets : (S, P, 3) float
        Their target pictures on the head's pixels, linear Rec. 709, any scale per style.

    Raises
    ------
    StyleError
        If a target picture asks for nothing, or does not fit the head.
    """
    if targets.shape != (len(styles), len(transport.pixels), 3) or not len(styles):
        raise StyleError("The target pictures do not fit this head and these styles.")
    if transport.header.symmetric:
        targets = _mirror_pictures(transport, styles, targets)
    luminance = targets.astype(np.float64) @ np.asarray(transport.header.luminance_weights)
    face = transport.face
    weights = np.stack([target_weights(picture, face) for picture in luminance])
    studio = (weights * luminance).sum(axis=1) / luminance[:, face].mean(axis=1)
    colours = find_colours(transport)
    rows = np.stack([colours.integrate(f) for f in weights])
    mean = colours.integrate(face / np.count_nonzero(face))
    if transport.header.symmetric:
        rows = _mirror_exact(styles, rows)
        mean = 0.5 * (mean + mean[:, ::-1])
    basis = build_basis(transport, colours, weights)
    lamps = split_lamps(transport, colours, styles, luminance, weights)
    height = transport.environment_shape[0]
    header = PackHeader(
        head=transport.header.head,
        skin=transport.header.skin,
        environment=transport.environment_shape,
        picture=transport.size,
        transport_sha256=transport.digest,
        basis_error=basis.error,
        paired=basis.paired,
    )
    scaled = [picture / max(float(picture.max()), 1e-30) for picture in targets]
    return StylePack(
        header=header,
        styles=tuple(styles),
        targets=np.stack([to_image(transport, p) for p in scaled]).astype(np.float16),
        coverage=to_image(transport, transport.coverage).astype(np.float16),
        mixing=colours.mixing,
        mixtures=colours.mixtures,
        target_rows=rows,
        weight_norm=np.linalg.norm(weights, axis=1),
        mean_rows=np.ascontiguousarray(mean),
        basis_even=basis.even,
        basis_odd=basis.odd,
        studio_ratio=studio,
        painted_ratio=_painted_ratio(rows[:, :height], mean[:height]),
        lamp_rows=lamps.maps,
        lamp_style=lamps.style,
        lamp_ratio=lamps.ratio,
    )


def _painted_ratio(preintegrated: Float32, mean: Float32) -> Float64:
    """C / mean of the face under the environment max(F, 0), per target."""
    light = np.maximum(preintegrated, 0).astype(np.float64)
    quality = (preintegrated * light).sum(axis=(1, 2))
    result: Float64 = quality / np.maximum((mean * light).sum(axis=(1, 2)), 1e-30)
    return result


def _mirror_pictures(
    transport: Transport, styles: Sequence[Style], targets: NDArray[np.floating[Any]]
) -> NDArray[np.floating[Any]]:
    """Average every target picture with the mirror image of its mirrored style's."""
    size = transport.size
    place = np.full(size * size, -1)
    place[transport.pixels] = np.arange(len(transport.pixels))
    flipped = place.reshape(size, size)[:, ::-1].ravel()[transport.pixels]
    if (flipped < 0).any():
        return targets
    exact = np.array(targets)
    for here, style in enumerate(styles):
        there = mirror_index(styles, style)
        if there is not None:
            exact[here] = 0.5 * (targets[here] + targets[there][flipped])
    return exact


def _mirror_exact(styles: Sequence[Style], rows: Float32) -> Float32:
    """Take what rounding has left off mirror symmetry."""
    exact = rows.copy()
    for here, style in enumerate(styles):
        there = mirror_index(styles, style)
        if there is not None:
            exact[here] = 0.5 * (rows[here] + rows[there][:, ::-1])
    return exact
