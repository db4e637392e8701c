"""Where painting starts from: a style's target weights, spread smoothly over the canvas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import StyleError
from app.core.painting.canvas import Canvas, canvas_size, make_canvas, resized
from app.core.solver.transport import to_image
from app.core.solver.weights import target_weights

if TYPE_CHECKING:
    from app.core.painting.user_style import UserStyle
    from app.core.solver.style_pack import StylePack
    from app.core.solver.transport import Transport

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]


def from_style(pack: StylePack, transport: Transport, name: str) -> Canvas:
    """Start from a built-in style: the weights of its target picture (eq. 6).

    Returns
    -------
    Canvas
        Averaged over the head's pixels, its weights are those of eq. 6 to 1e-6.

    Raises
    ------
    StyleError
        If the pack has no such style, or belongs to another head.
    """
    if pack.header.picture != transport.size:
        raise StyleError("The styles belong to another head.")
    target = pack.target(name).reshape(-1, 3)[transport.pixels].astype(np.float64)
    luminance = target @ np.asarray(transport.header.luminance_weights)
    return from_weights(transport, target_weights(luminance, transport.face))


def from_weights(transport: Transport, weights: NDArray[np.floating[Any]]) -> Canvas:
    """Start from weights on the head's pixels.

    Parameters
    ----------
    weights : (P,) float
        In [-1, 1]; those outside the face are not used.

    Returns
    -------
    Canvas
        Smooth, also beyond the edge of the face, and with the weights as its averages over the
        pixels of the face.

    Raises
    ------
    StyleError
        If there is not one finite value per pixel of the head.
    """
    if weights.shape != transport.face.shape or not np.isfinite(weights).all():
        raise StyleError("The weights do not fit this head.")
    face = to_image(transport, transport.face.astype(np.float32)) > 0
    head = _continued(to_image(transport, np.clip(weights, -1, 1)), face)
    step = canvas_size(transport) // transport.size
    spread = _interpolation(transport.size, step)
    smooth = spread @ head @ spread.T
    # Where interpolation leaves the scale, the plain value is as good.
    beyond = np.abs(smooth).reshape(transport.size, step, transport.size, step).max(axis=(1, 3)) > 1
    return make_canvas(np.where(_blocks(beyond, step), _blocks(head, step), smooth))


def from_user_style(style: UserStyle, transport: Transport) -> Canvas:
    """Start from a style of the user's own, painted on this head or another.

    Returns
    -------
    Canvas
        The style's layers, brought to this head's canvas size where it differs.
    """
    size = canvas_size(transport)
    return make_canvas(resized(style.weights, size), resized(style.ignore, size))


def _blocks(picture: NDArray[Any], step: int) -> NDArray[Any]:
    return np.repeat(np.repeat(picture, step, axis=0), step, axis=1)


def _interpolation(pixels: int, step: int) -> Float64:
    """(step * pixels, pixels) cubic interpolation whose averages over each pixel are its value."""
    place = (np.arange(step * pixels) + 0.5) / step - 0.5
    spread = np.zeros((len(place), pixels))
    first = np.floor(place).astype(int)
    for neighbour in (-1, 0, 1, 2):
        column = first + neighbour
        away = np.abs(place - column)
        near = 1.5 * away**3 - 2.5 * away**2 + 1
        far = -0.5 * away**3 + 2.5 * away**2 - 4 * away + 2
        kernel = np.where(away < 1, near, np.where(away < 2, far, 0.0))
        np.add.at(spread, (np.arange(len(place)), np.clip(column, 0, pixels - 1)), kernel)
    averages = spread.reshape(pixels, step, pixels).mean(axis=1)
    result: Float64 = np.linalg.solve(averages.T, spread.T).T
    return result


def _continued(picture: Float32, known: NDArray[np.bool_]) -> Float32:
    """Spread the known pixels outward, so that no edge of the face is smoothed into nothing."""
    filled = np.where(known, picture, 0).astype(np.float32)
    share = known.astype(np.float32)
    for _ in range(len(picture)):
        if (share > 0).all() or not known.any():
            break
        sums, counts = _neighbours(filled), _neighbours(share)
        grown = (share == 0) & (counts > 0)
        filled = np.where(grown, sums / np.where(grown, counts, 1), filled).astype(np.float32)
        share = np.where(grown, np.float32(1), share)
    return filled


def _neighbours(picture: Float32) -> Float32:
    """Sum over the 3 x 3 neighbourhood, symmetric to the last bit."""
    wide = np.pad(picture, 1)
    rows = wide[:-2] + wide[2:] + wide[1:-1]
    total: Float32 = rows[:, :-2] + rows[:, 2:] + rows[:, 1:-1]
    return total
