"""From weights to colours: a buffer of bytes that follows the brush region by region."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.painting.canvas import Region

if TYPE_CHECKING:
    from app.core.painting.canvas import Canvas

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Pixels: TypeAlias = NDArray[np.uint32]
Colour: TypeAlias = tuple[int, int, int]

_LEVELS: Final = 127  # of weights on either side of 0
_MIDDLE: Final = 0.58  # sRGB value of the head's median pixel
_STRONGEST: Final = 0.90  # opacity of full weight: the face still shows through
_BEND: Final = 2.2  # faint weights are to be seen too, without an edge where they change sign
_FADE: Final = 8.0  # an ignored area ends within an eighth of the layer's range
_OPAQUE: Final = np.uint32(0xFF000000)
_EDGE: Final = 1.6  # width of the head's outline, device pixels
_SOFT: Final = 0.4  # pixels of the head
_SPREAD: Final = 2.7  # pixels of the head over which a smoothed edge rises
_FINER: Final = 4
_SMOOTH: Final = 1.0  # pixels of the head: its outline is a line, not steps


def colour_table(plus: Colour, minus: Colour) -> Pixels:
    """Colour every pair of a grey value and a weight.

    Parameters
    ----------
    plus, minus : tuple of int
        sRGB of positive and negative weights.

    Returns
    -------
    (256, 255) uint32
        0xffRRGGBB by grey value (sRGB byte) and weight (127 + 127 w).
    """
    grey = np.arange(256, dtype=np.float64)[:, None, None]
    weight = np.arange(-_LEVELS, _LEVELS + 1)[None, :, None] / _LEVELS
    opacity = _STRONGEST * np.expm1(-_BEND * np.abs(weight)) / np.expm1(-_BEND)
    tint = np.where(weight < 0, np.array(minus, float), np.array(plus, float))
    # The form of the face stays visible in the colour.
    lit = np.clip(0.5 + 0.5 * grey / (255 * _MIDDLE), 0.4, 1.25)
    colour = np.clip((1 - opacity) * grey + opacity * np.minimum(tint * lit, 255.0), 0, 255)
    red, green, blue = np.moveaxis(np.rint(colour).astype(np.uint32), 2, 0)
    return np.ascontiguousarray(_OPAQUE | red << 16 | green << 8 | blue)


class CanvasColours:
    """What the canvas looks like, at the canvas's own resolution.

    Parameters
    ----------
    plus, minus : tuple of int
        sRGB of positive and negative weights.

    Attributes
    ----------
    pixels : (S, S) uint32
        0xffRRGGBB; always the same array for one size, so that an image may lie on it.
    ignored : (S, S) uint8
        Opacity of the hatch.
    """

    def __init__(self, plus: Colour, minus: Colour) -> None:
        self._table = colour_table(plus, minus).ravel()
        self._grey: NDArray[np.int32] = np.zeros((0, 0), np.int32)
        self.pixels: Pixels = np.zeros((0, 0), np.uint32)
        self.ignored: Bytes = np.zeros((0, 0), np.uint8)
        self.any_ignored = False

    def set_head(self, grey: Float32, size: int) -> None:
        """Lay a head under the weights.

        Parameters
        ----------
        grey : (N, N) float32
            sRGB values, 0 to 1.
        size : int
            Side of the canvas, pixels.
        """
        fine = _enlarged(grey, size)
        values = np.rint(np.clip(fine, 0.0, 1.0) * 255.0).astype(np.int32)
        self._grey = values * (2 * _LEVELS + 1) + _LEVELS
        if self.pixels.shape != values.shape:
            self.pixels = np.zeros(values.shape, np.uint32)
            self.ignored = np.zeros(values.shape, np.uint8)

    def show_weights(self, canvas: Canvas, region: Region | None = None) -> None:
        """Colour what has changed.

        Parameters
        ----------
        region : Region, optional
            Canvas pixels; everything by default.
        """
        part = region or Region(0, 0, canvas.size, canvas.size)
        if part.empty or self.pixels.shape != canvas.weights.shape:
            return
        place = part.slices
        ignore = canvas.ignore[place]
        hidden = np.clip((ignore - np.float32(0.5)) * np.float32(_FADE) + np.float32(0.5), 0, 1)
        weights = canvas.weights[place] * (1 - hidden)
        index = self._grey[place] + np.rint(weights * np.float32(_LEVELS)).astype(np.int32)
        self.pixels[place] = self._table[index]
        self.ignored[place] = (hidden * 255).astype(np.uint8)
        self.any_ignored = bool(self.ignored.any())

    def show_picture(self, picture: Bytes) -> None:
        """Show a picture of the head in place of the weights.

        Parameters
        ----------
        picture : (N, N, 3) uint8
            sRGB.
        """
        size = len(self.pixels)
        if not size:
            return
        fine = _enlarged(picture, size).astype(np.uint32)
        self.pixels[...] = _OPAQUE | fine[..., 0] << 16 | fine[..., 1] << 8 | fine[..., 2]
        self.any_ignored = False


def _enlarged(picture: NDArray[Any], size: int) -> NDArray[Any]:
    """Enlarge a picture of the head smoothly: its pixels must not be seen as squares."""
    fine = cv2.resize(picture, (size, size), interpolation=cv2.INTER_CUBIC)
    spread = _SOFT * size / len(picture)
    return np.asarray(cv2.GaussianBlur(fine, (0, 0), spread, borderType=cv2.BORDER_REPLICATE))


def veil_bytes(
    coverage: Float32, size: tuple[int, int], scale: float, offset: tuple[float, float], grey: int
) -> Pixels:
    """Cover everything that is not head, with a clean outline at the screen's own resolution.

    Parameters
    ----------
    coverage : (N, N) float32
        Share of each pixel that the head covers.
    size : tuple of int
        Width and height, device pixels.
    scale : float
        Device pixels per pixel of the head.
    offset : tuple of float
        Where the head's picture has its upper left corner, device pixels.

    Returns
    -------
    (height, width) uint32
        0xAARRGGBB, colours multiplied by opacity.
    """
    # Finer first, then smoothed: a cubic through the pixels themselves would make waves.
    side = _FINER * len(coverage)
    fine = cv2.resize(coverage, (side, side), interpolation=cv2.INTER_LINEAR)
    smooth = cv2.GaussianBlur(fine, (0, 0), _FINER * _SMOOTH, borderType=cv2.BORDER_REPLICATE)
    share = np.rint(np.clip(smooth, 0.0, 1.0) * 255.0).astype(np.uint8)
    step = scale / _FINER
    # Device pixel i has its middle at i + 0.5.
    half = 0.5 / step - 0.5
    matrix = np.array(
        [[1 / step, 0.0, half - offset[0] / step], [0.0, 1 / step, half - offset[1] / step]]
    )
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    inside = cv2.warpAffine(share, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    place = np.arange(256) / 255.0
    opacity = 1.0 - np.clip((place - 0.5) * max(_SPREAD * scale / _EDGE, 1.0) + 0.5, 0.0, 1.0)
    alpha = np.rint(opacity * 255.0).astype(np.uint32)
    level = np.rint(opacity * grey).astype(np.uint32)
    table = (alpha << 24 | level << 16 | level << 8 | level).astype(np.uint32)
    return np.ascontiguousarray(table[np.asarray(inside)])
