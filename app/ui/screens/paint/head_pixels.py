"""Renders the head and its weights as pixels: the grey head, the colours and the outline."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import colour
from app.core.base.arrays import Bytes, Float32
from app.core.painting.canvas import Canvas, Region
from app.core.portrait.head import Head
from app.core.solver.transport import Transport, render, to_image
from app.core.text import tr

Pixels: TypeAlias = NDArray[np.uint32]
Colour: TypeAlias = tuple[int, int, int]

_FACE: Final = 0.5  # minimum coverage of a pixel that counts as face
_SOLID: Final = 0.9  # below this coverage, pixels copy their neighbours
_LEVEL: Final = 0.30  # linear grey of the median pixel, which leaves room for orange and blue
_SKY: Final = 0.8
_FRONT: Final = 0.7
_LEVELS: Final = 127  # number of weights on either side of 0
_MIDDLE: Final = 0.58  # sRGB value of the head's median pixel
_STRONGEST: Final = 0.90  # opacity of full weight, so that the face shows through
_BEND: Final = 2.2  # makes faint weights visible, without an edge where the sign changes
_FADE: Final = 8.0  # an ignored area fades within an eighth of the layer's range
_OPAQUE: Final = np.uint32(0xFF000000)
_EDGE: Final = 1.6  # width of the outline in device pixels
_SOFT: Final = 0.4  # blur of enlarged pictures in pixels of the head
_SPREAD: Final = 2.7  # width of a smoothed edge in pixels of the head
_FINER: Final = 4
_LEAST: Final = np.float32(0.01)  # minimum coverage of a pixel by the head
_SMOOTH: Final = 1.0  # blur of the outline in pixels of the head


@dataclass(frozen=True, slots=True, eq=False)
class HeadLook:
    """A head to paint on.

    Attributes:
        grey: (N, N) float32. The head in soft grey light, as sRGB values from 0 to 1, extended
            beyond the edge of the head.
        coverage: (N, N) float32. Fraction of each pixel that the head covers.
        yaw_deg: Angle, in degrees, by which the face is turned away from the lens towards its own
            left.
        places: (N, N, 3) float32. Position in the front view of the skin at each pixel (see
            `PaintedHead.places_on_front`), or None if this is the front view.
    """

    grey: Float32 = field(repr=False)
    coverage: Float32 = field(repr=False)
    yaw_deg: float = 0.0
    places: Float32 | None = field(default=None, repr=False)


def head_words(yaw_deg: float) -> str:
    """Return a name for the view, such as "the head turned 30° to its left"."""
    if not yaw_deg:
        return tr("the head seen from the front")
    size = round(abs(yaw_deg))
    if yaw_deg > 0:
        return tr("the head turned {size}° to its left", size=size)
    return tr("the head turned {size}° to its right", size=size)


def head_look(transport: Transport) -> HeadLook:
    """Light a head softly and evenly from both sides to make its shape visible."""
    rows, columns = transport.environment_shape
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    azimuth = 2 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5)[None, :]
    ahead = np.clip(np.cos(elevation) * np.cos(azimuth), 0.0, None)
    light = _SKY * (0.5 + 0.5 * np.sin(elevation)) + _FRONT * ahead**2
    coverage = to_image(transport, transport.coverage)
    grey = _continued(to_image(transport, np.maximum(render(transport, light), 0.0)), coverage)
    face = coverage >= _FACE
    # numpy.median would first import masked arrays, which takes 40 ms.
    middle = float(np.sort(grey[face])[int(face.sum()) // 2]) if face.any() else 1.0
    tones = colour.srgb_encode(np.clip(grey * (_LEVEL / max(middle, 1e-30)), 0.0, 1.0))
    return HeadLook(np.asarray(tones, np.float32), coverage)


def turned_look(head: Head, yaw_deg: float, steps: int) -> HeadLook | None:
    """Return a head turned to its left by a number of views, or None for the front view."""
    yaws = head.aside.yaws
    yaw = yaws[min(max(yaws.index(yaw_deg) + steps, 0), len(yaws) - 1)]
    if not yaw:
        return None
    painted = head.painted()
    view = painted.view(yaw)
    return replace(head_look(view.transport), yaw_deg=yaw, places=painted.places_on_front(view))


def head_picture(linear: NDArray[np.floating[Any]], coverage: Float32) -> Bytes:
    """Render a picture of the head for the canvas.

    Args:
        linear: (N, N, 3) float. Linear Rec. 709 on black, in which edge pixels are multiplied by
            the coverage.
        coverage: (N, N) float32. Fraction of each pixel that the head covers.

    Returns:
        (N, N, 3) uint8. sRGB exposed by `app.core.base.colour.face_exposure`, extended beyond the
        edge.
    """
    whole = _continued(np.asarray(linear, np.float32), coverage)
    face = coverage >= _FACE
    gain = colour.face_exposure(colour.luminance(whole[face])) if face.any() else 1.0
    return colour.to_bytes(colour.tone_map(np.maximum(whole, 0.0), gain))


def _continued(picture: Float32, coverage: Float32) -> Float32:
    """Remove the black from edge pixels, and extend the edge by a few pixels."""
    share = np.where(coverage >= _SOLID, coverage, 0.0).astype(np.float32)
    weights = np.where(share > 0, 1.0, 0.0).astype(np.float32)
    wide = picture[..., None] if picture.ndim == 2 else picture
    values = np.where(share[..., None] > 0, wide / np.maximum(share, _SOLID)[..., None], 0.0)
    values = np.ascontiguousarray(values, np.float32)
    for _ in range(4):
        around = cv2.blur(values, (3, 3), borderType=cv2.BORDER_REPLICATE)
        around = np.asarray(around, np.float32).reshape(values.shape)
        weight = np.asarray(cv2.blur(weights, (3, 3), borderType=cv2.BORDER_REPLICATE), np.float32)
        grown = (weights == 0) & (weight > 1e-6)
        values[grown] = around[grown] / weight[grown][:, None]
        weights[grown] = 1.0
    return values.reshape(picture.shape)


def colour_table(plus: Colour, minus: Colour) -> Pixels:
    """Return a table with the colour for each pair of a grey value and a weight.

    Args:
        plus, minus: sRGB colours of positive and negative weights.

    Returns:
        (256, 255) uint32. 0xffRRGGBB, indexed by grey value (sRGB byte) and weight (127 + 127 w).
    """
    grey = np.arange(256, dtype=np.float64)[:, None, None]
    weight = np.arange(-_LEVELS, _LEVELS + 1)[None, :, None] / _LEVELS
    opacity = _STRONGEST * np.expm1(-_BEND * np.abs(weight)) / np.expm1(-_BEND)
    tint = np.where(weight < 0, np.array(minus, float), np.array(plus, float))
    # Keep the shape of the face visible in the colour.
    brightness = np.clip(0.5 + 0.5 * grey / (255 * _MIDDLE), 0.4, 1.25)
    colour = np.clip((1 - opacity) * grey + opacity * np.minimum(tint * brightness, 255.0), 0, 255)
    red, green, blue = np.moveaxis(np.rint(colour).astype(np.uint32), 2, 0)
    return np.ascontiguousarray(_OPAQUE | red << 16 | green << 8 | blue)


class CanvasColours:
    """The colours of the canvas, at the canvas's own resolution.

    Args:
        plus, minus: sRGB colours of positive and negative weights.

    Attributes:
        pixels: (S, S) uint32. 0xffRRGGBB. The array object stays the same until the size changes,
            which lets an image share its memory.
        ignored: (S, S) uint8. Opacity of the hatching.
    """

    def __init__(self, plus: Colour, minus: Colour) -> None:
        self._table = colour_table(plus, minus).ravel()
        self._grey: NDArray[np.int32] = np.zeros((0, 0), np.int32)
        self.pixels: Pixels = np.zeros((0, 0), np.uint32)
        self.ignored: Bytes = np.zeros((0, 0), np.uint8)
        self.any_ignored = False

    def set_head(self, grey: Float32, size: int) -> None:
        """Set the head underneath the weights.

        Args:
            grey: (N, N) float32. sRGB values from 0 to 1.
            size: Side length of the canvas, in pixels.
        """
        values = np.rint(np.clip(_enlarged(grey, size), 0.0, 1.0) * 255.0).astype(np.int32)
        self._grey = values * (2 * _LEVELS + 1) + _LEVELS
        if self.pixels.shape != values.shape:
            self.pixels = np.zeros(values.shape, np.uint32)
            self.ignored = np.zeros(values.shape, np.uint8)

    def show_weights(self, canvas: Canvas, region: Region | None = None) -> None:
        """Update the colours of a region in canvas pixels, or by default of the whole canvas."""
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
        """Show a picture of the head, (N, N, 3) uint8 sRGB, in place of the weights."""
        size = len(self.pixels)
        if not size:
            return
        fine = _enlarged(picture, size).astype(np.uint32)
        self.pixels[...] = _OPAQUE | fine[..., 0] << 16 | fine[..., 1] << 8 | fine[..., 2]
        self.any_ignored = False


def _enlarged(picture: NDArray[Any], size: int) -> NDArray[Any]:
    """Enlarge a picture of the head smoothly, leaving no visible pixels."""
    fine = cv2.resize(picture, (size, size), interpolation=cv2.INTER_CUBIC)
    spread = _SOFT * size / len(picture)
    return np.asarray(cv2.GaussianBlur(fine, (0, 0), spread, borderType=cv2.BORDER_REPLICATE))


def finer_places(places: Float32, size: int) -> Float32:
    """Enlarge `HeadLook.places` to (S, S, 3) float32, in canvas pixels."""
    coverage = (places[..., 2:] >= 0).astype(np.float32)
    share, sums = (
        cv2.resize(each, (size, size), interpolation=cv2.INTER_LINEAR)
        for each in (coverage, places * coverage)
    )
    scale = np.array([size, size, 1], np.float32)
    return np.asarray(scale * sums / np.maximum(share, _LEAST)[..., None], np.float32)


def veil_bytes(
    coverage: Float32, size: tuple[int, int], scale: float, offset: tuple[float, float], grey: int
) -> Pixels:
    """Return a veil over everything outside the head, with an outline at device resolution.

    Args:
        coverage: (N, N) float32. Fraction of each pixel that the head covers.
        size: Width and height in device pixels.
        scale: Device pixels per pixel of the head.
        offset: Upper left corner of the head's picture, in device pixels.

    Returns:
        (height, width) uint32. 0xAARRGGBB with premultiplied alpha.
    """
    # Enlarge first, then smooth, because a cubic through the pixels would ripple.
    side = _FINER * len(coverage)
    fine = cv2.resize(coverage, (side, side), interpolation=cv2.INTER_LINEAR)
    smooth = cv2.GaussianBlur(fine, (0, 0), _FINER * _SMOOTH, borderType=cv2.BORDER_REPLICATE)
    share = np.rint(np.clip(smooth, 0.0, 1.0) * 255.0).astype(np.uint8)
    step = scale / _FINER
    # The centre of device pixel i is at i + 0.5.
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
