"""The canvas, which holds the paint on the head's picture at a finer resolution than its pixels.

The canvas covers the whole square picture of the head. Painting at a higher resolution and
averaging down keeps strokes smooth on screen, while the search uses the head's own pixels. Painting
starts from a style's target weights, spread smoothly over the canvas.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.errors import StyleError
from app.core.solver.transport import Transport, to_image
from app.core.solver.weights import PaintedWeights, painted, target_weights
from app.core.styles.style_pack import StylePack
from app.core.text import tr


def from_style(pack: StylePack, transport: Transport, name: str) -> Canvas:
    """Return the canvas of a built-in style, which contains the weights of its target (eq. 6).

    Averaged over the head's pixels, the weights on the canvas equal those of eq. 6 to within 1e-6.

    Raises:
        StyleError: If the pack has no such style or was made for a different head.
    """
    if pack.header.picture != transport.size:
        raise StyleError(tr("The styles were made for a different head."))
    target = pack.target(name).reshape(-1, 3)[transport.pixels].astype(np.float64)
    luminance = target @ np.asarray(transport.header.luminance_weights)
    return from_weights(transport, target_weights(luminance, transport.face))


def is_style(canvas: Canvas, pack: StylePack, transport: Transport, name: str) -> bool:
    """Return whether a canvas is an unpainted built-in style."""
    if name not in {style.name for style in pack.styles} or pack.header.picture != transport.size:
        return False
    start = from_style(pack, transport, name)
    return np.array_equal(canvas.weights, start.weights) and not canvas.ignore.any()


def from_weights(transport: Transport, weights: Floats) -> Canvas:
    """Create a canvas from weights on the head's pixels.

    The canvas is smooth, even beyond the edge of the face, and its average over each pixel of the
    face equals the weight of that pixel.

    Args:
        weights: (P,) float, in [-1, 1]. Weights outside the face are ignored.

    Raises:
        StyleError: If there is not exactly one finite value for each pixel of the head.
    """
    if weights.shape != transport.face.shape or not np.isfinite(weights).all():
        raise StyleError(tr("The weights do not fit this head."))
    face = to_image(transport, transport.face.astype(np.float32)) > 0
    head = _continue(to_image(transport, np.clip(weights, -1, 1)), face)
    step = canvas_size(transport) // transport.size
    spread = _interpolation(transport.size, step)
    smooth = spread @ head @ spread.T
    # Where interpolation exceeds the range, use the plain value.
    beyond = np.abs(smooth).reshape(transport.size, step, transport.size, step).max(axis=(1, 3)) > 1
    return make_canvas(np.where(_blocks(beyond, step), _blocks(head, step), smooth))


def _blocks(picture: NDArray[Any], step: int) -> NDArray[Any]:
    return np.repeat(np.repeat(picture, step, axis=0), step, axis=1)


def _interpolation(pixels: int, step: int) -> Float64:
    """Return the cubic interpolation matrix, (step * pixels, pixels), that keeps pixels' means."""
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
    return np.asarray(np.linalg.solve(averages.T, spread.T).T)


def _continue(picture: Float32, coverage: Bools) -> Float32:
    """Spread the known pixels outwards, to keep smoothing from fading the edge of the face."""
    filled = np.where(coverage, picture, 0).astype(np.float32)
    share = coverage.astype(np.float32)
    for _ in range(len(picture)):
        if (share > 0).all() or not coverage.any():
            break
        sums, counts = _neighbours(filled), _neighbours(share)
        grown = (share == 0) & (counts > 0)
        filled = np.where(grown, sums / np.where(grown, counts, 1), filled).astype(np.float32)
        share = np.where(grown, np.float32(1), share)
    return filled


def _neighbours(picture: Float32) -> Float32:
    """Sum each 3 x 3 neighbourhood. The result is symmetric to the last bit."""
    wide = np.pad(picture, 1)
    rows = wide[:-2] + wide[2:] + wide[1:-1]
    return np.asarray(rows[:, :-2] + rows[:, 2:] + rows[:, 1:-1])


MIN_SIZE: Final = 16
MAX_SIZE: Final = 1024
"""Maximum side of a canvas read from a file, in canvas pixels."""

IGNORED: Final = 0.5
"""Value in the ignore layer from which a pixel no longer counts."""


class Advice(StrEnum):
    """Requirements that a canvas must still meet before it can be saved as a style."""

    NOTHING_PAINTED = "nothing painted"
    ONE_SIDED = "one-sided"  # no area is brighter, or no area is darker


_ABOUT: Final = 400
_VISIBLE: Final = 0.01  # of full weight: less is neither visible nor counted


@dataclass(frozen=True, slots=True)
class Region:
    """A part of the canvas, in canvas pixels: columns [left, right) and rows [top, bottom)."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def empty(self) -> bool:
        """Whether the region contains no pixels."""
        return self.left >= self.right or self.top >= self.bottom

    @property
    def slices(self) -> tuple[slice, slice]:
        """Slices of rows and columns, for indexing an array."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def mirrored(self, size: int) -> Region:
        """Return the mirror image of the region on a canvas with a side of `size` pixels."""
        return Region(size - self.right, self.top, size - self.left, self.bottom)


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """Painted weights and the layers from which the painting started, as read-only arrays.

    Row 0 is the top of the picture. Column 0 is its left edge, which shows the sitter's right side.
    """

    weights: Float32 = field(repr=False)  # (S, S), in [-1, 1]: +1 should be brighter, -1 darker
    # (S, S), in [0, 1]; from `IGNORED` on, a pixel does not count
    ignore: Float32 = field(repr=False)
    # start_weights, start_ignore: (S, S), the layers that "Restore" returns to
    start_weights: Float32 = field(repr=False)
    start_ignore: Float32 = field(repr=False)

    @property
    def size(self) -> int:
        """Side S of the canvas, in pixels."""
        return int(self.weights.shape[0])

    @property
    def touched(self) -> bool:
        """Whether anything has been painted."""
        return not (
            np.array_equal(self.weights, self.start_weights)
            and np.array_equal(self.ignore, self.start_ignore)
        )


def around(regions: Iterable[Region]) -> Region:
    """Return the bounding box of several regions."""
    edges = [(r.left, r.top, r.right, r.bottom) for r in regions]
    left, top, right, bottom = zip(*edges, strict=True)
    return Region(min(left), min(top), max(right), max(bottom))


def canvas_size(transport: Transport) -> int:
    """Return the canvas size for a head, which is a multiple of its picture's side below 400."""
    return transport.size * max(_ABOUT // transport.size, 1)


def blank(transport: Transport) -> Canvas:
    """Return a canvas without any paint."""
    return make_canvas(np.zeros((canvas_size(transport),) * 2, np.float32))


def make_canvas(
    weights: Floats,
    ignore: Floats | None = None,
    start_weights: Floats | None = None,
    start_ignore: Floats | None = None,
) -> Canvas:
    """Create a canvas from layers, which are copied and validated.

    Args:
        weights: (S, S) float, in [-1, 1]. Values slightly outside the range are clipped.
        ignore: (S, S) float, in [0, 1], clipped in the same way. By default, nothing is ignored.
        start_weights, start_ignore: (S, S) float. Layers that can be restored. The defaults are
            `weights` and `ignore`.

    Raises:
        StyleError: If the layers are not square, differ in size or contain NaN.
    """
    shape = weights.shape
    nothing = np.zeros(shape, np.float32)
    ignore = nothing if ignore is None else ignore
    layers = [
        (weights, -1.0),
        (ignore, 0.0),
        (weights if start_weights is None else start_weights, -1.0),
        (ignore if start_ignore is None else start_ignore, 0.0),
    ]
    fits = len(shape) == 2 and shape[0] == shape[1] and MIN_SIZE <= shape[0] <= 4 * MAX_SIZE
    if not fits or any(layer.shape != shape or not np.isfinite(layer).all() for layer, _ in layers):
        raise StyleError(tr("These weights are damaged: they do not form a square picture."))
    return Canvas(*(_frozen(np.clip(layer, low, 1.0)) for layer, low in layers))


def resized(layer: Floats, size: int) -> Float32:
    """Resize a layer, averaging its pixels if it shrinks.

    Args:
        layer: (S, S) float. Layer of a canvas.

    Returns:
        (size, size) float32. The resized layer.
    """
    values = np.ascontiguousarray(layer, np.float32)
    if len(values) == size:
        return values.copy()
    how = cv2.INTER_AREA if size < len(values) else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(values, (size, size), interpolation=how), np.float32)


def block_means(layer: Float32, pixels: int, region: Region | None = None) -> Float64:
    """Average a canvas layer over the head's pixels.

    Args:
        layer: (S, S) float32. Layer of a canvas.
        region: Region to which the result is limited, in pixels of the head rather than of the
            canvas.

    Returns:
        (n, m) float64. One value for each head pixel in the region. If there is no region, the
        shape is (N, N).
    """
    step = len(layer) // pixels
    if region is None:
        region = Region(0, 0, pixels, pixels)
    part = layer[region.top * step : region.bottom * step, region.left * step : region.right * step]
    blocks = part.reshape(region.bottom - region.top, step, region.right - region.left, step)
    # Two plain sums are several times faster than one over two axes, and their order is fixed.
    sums = np.add.reduce(np.add.reduce(blocks, axis=3, dtype=np.float64), axis=1)
    return np.asarray(sums / (step * step))


def head_values(canvas: Canvas, transport: Transport) -> tuple[Float64, Bools]:
    """Reduce a canvas to the pixels of a head.

    Returns:
        The painted weights, (P,) float64 in [-1, 1], whose mean is not yet zero, and a mask, (P,)
        bool, of the pixels that do not count.
    """
    weights, ignore = canvas.weights, canvas.ignore
    if canvas.size % transport.size:
        size = canvas_size(transport)
        weights, ignore = resized(weights, size), resized(ignore, size)
    values = block_means(weights, transport.size).ravel()[transport.pixels]
    ignored = block_means(ignore, transport.size).ravel()[transport.pixels] >= IGNORED
    return values, ignored


def weights_of(canvas: Canvas, transport: Transport) -> PaintedWeights:
    """Pre-integrate a whole canvas on a head (eq. 3, see `app.core.solver.weights.painted`)."""
    return painted(transport, *head_values(canvas, transport))


def advice(canvas: Canvas, weights: PaintedWeights) -> Advice | None:
    """Return the requirements that the canvas must still meet to be saved as a style, or None."""
    if not canvas.touched:
        return Advice.NOTHING_PAINTED
    values = weights.values[weights.active]
    if values.size == 0 or not (values.max() > _VISIBLE and values.min() < -_VISIBLE):
        return Advice.ONE_SIDED
    return None


def _frozen(layer: Floats) -> Float32:
    array = np.array(layer, np.float32, order="C")
    array.setflags(write=False)
    return array
