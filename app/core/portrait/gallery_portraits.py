"""Portraits for the gallery, rendered many at a time with equal framing and exposure.

`benchmarks.speed.plain_portrait` defines the look of a portrait. This module produces the same look
fast enough for interaction. A framing consists of two small matrices, one for the rows and one for
the columns, which crop, pad and scale in one product each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import colour
from app.core.base.arrays import Bytes, Float32, Float64, Floats, Indices
from app.core.base.colour import FloatImage
from app.core.environment.environment import SHAPE, solid_angles
from app.core.portrait import display_pictures as pictures
from app.core.portrait.display_pictures import WELL
from app.core.portrait.exposure import head_exposure
from app.core.solver.place_light import Expose, Facing
from app.core.solver.transport import Transport, load_named
from app.core.styles.lamps import far_lamp
from app.core.styles.style import Style

_FACE_COVERAGE: Final = 0.5
_MEDIUM_HEAD: Final = "generic"
_OTHER_SKINS: Final = ("light", "dark")
_TONES: Final = 1 << 14  # steps of the table of the sRGB curve: a fifth of a byte where it is steep
_MOST_LIGHT: Final = 1e4
_BAND_PIXELS: Final = 1 << 15
_SHOULDER_STEPS: Final = 1 << 10  # steps of a table, for a factor of e

# Visible rows of a picture of 100: from just above the crown to the neck in wide pictures, to the
# shoulders in tall ones. The head fills them all alike, so faces stay in one place.
_TALL_ROWS: Final = 102.0
_WIDE_ROWS: Final = 88.0
_TALL_ASPECT: Final = 0.96
_WIDE_ASPECT: Final = 1.38
_MARGIN: Final = 0.045  # above the crown, of the visible rows
_CLOSE: Final = (
    78.0,
    61.0,
)  # rows and columns of the head alone, from crown to chin and ear to ear
CLOSE_SHAPE: Final = _CLOSE[0] / _CLOSE[1]
"""Ratio of height to width for a picture of the head alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Taps:
    """The source pixels and weights for each pixel of a scaled line.

    Attributes:
        index: (k, n) intp. Pixels of the picture.
        weight: (k, n) float32. Weights of these pixels. Their sum is below 1 for a result pixel
            that is partly outside the picture.
    """

    index: Indices = field(repr=False)
    weight: Float32 = field(repr=False)

    def along_rows(self, planes: Float32) -> Float32:
        """Scale (c, N, m) to (c, n, m) in a few passes, since a full matrix would require BLAS."""
        result: Float32 = planes[:, self.index[0]] * self.weight[0][:, np.newaxis]
        for index, weight in zip(self.index[1:], self.weight[1:], strict=True):
            result += planes[:, index] * weight[:, np.newaxis]
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Framing:
    """The crop and scale of a head's picture.

    Attributes:
        rows, columns: Source pixels of the visible rows and columns.
        picture, room: As in `framing`.
        top, left: Position of the upper left corner, in pixels of the picture.
        step: Number of picture pixels per pixel of the result.
    """

    rows: Taps
    columns: Taps
    picture: int
    room: float
    top: float
    left: float
    step: float

    @property
    def size(self) -> tuple[int, int]:
        """Number of rows and columns of the result."""
        return self.rows.index.shape[1], self.columns.index.shape[1]

    def of(self, planes: Float32) -> Float32:
        """Frame (c, N, N) as (c, w, h), with rows and columns transposed."""
        rows_first = np.ascontiguousarray(self.rows.along_rows(planes).transpose(0, 2, 1))
        return self.columns.along_rows(rows_first)

    def cut(self, picture: Float32) -> Float32:
        """Frame (N, N) or (N, N, 3) as (h, w) or (h, w, 3), to half a pixel, padded with black."""
        high, wide = (round(each * self.step) for each in self.size)
        top, left = round(self.top), round(self.left)
        part = picture[max(top, 0) : top + high, max(left, 0) : left + wide]
        above, before = max(-top, 0), max(-left, 0)
        edges = above, high - above - part.shape[0], before, wide - before - part.shape[1]
        whole = cv2.copyMakeBorder(part, *edges, cv2.BORDER_CONSTANT) if any(edges) else part
        way = cv2.INTER_AREA if self.step > 1 else cv2.INTER_LINEAR
        return np.asarray(cv2.resize(whole, self.size[::-1], interpolation=way))


@lru_cache(maxsize=32)
def framing(
    picture: int,
    size: tuple[int, int],
    close: bool = False,
    room: float = 1.0,
    above: float | None = None,
) -> Framing:
    """Return the framing of a head, which depends on the proportions but not on the size.

    Args:
        picture: Side of the head's square picture, in pixels.
        size: Rows and columns of the result, both at least 1.
        close: Whether the head alone fills the picture, without neck and shoulders.
        room: Height of the picture divided by that of a transport's picture, which ends at the
            crown.
        above: Visible height including the room for hair, in the unit of `room`, or None for the
            value of `room`.
    """
    height, width = size
    above = room if above is None else above
    side, hair = picture / room, 100.0 * (above - 1.0)
    top = (room - above) * side
    if close:
        step = max((_CLOSE[0] + hair) / height, _CLOSE[1] / width) * side / 100.0
    else:
        aspect = width / height
        part = (aspect - _TALL_ASPECT) / (_WIDE_ASPECT - _TALL_ASPECT)
        height_rows = _TALL_ROWS + (_WIDE_ROWS - _TALL_ROWS) * min(max(part, 0.0), 1.0)
        if hair:
            # The shoulders reach down to the edge.
            step = min(height_rows + hair, 100.0 + hair) * side / 100.0 / height
        else:
            step = height_rows * side / 100.0 / height
            top = -_MARGIN * height_rows * side / 100.0
    left = 0.5 * (picture - width * step)
    rows, columns = _taps(picture, height, top, step), _taps(picture, width, left, step)
    return Framing(rows, columns, picture, room, top, left, step)


LightSource: TypeAlias = "Floats | Callable[[], Floats] | Style | None"
"""Light on a head, (H, W, 3) or (H, W), at any exposure, or a function that computes it.

A style represents its own lamps, and None represents even light.
"""


def skin_gains(transport: Transport, lights: Sequence[LightSource]) -> list[float]:
    """Return the exposure factor for a skin tone in each light, relative to medium skin.

    Pictures are exposed for the light, as with a grey card, and therefore like a face of medium
    skin in the same light. Skin tones shown side by side differ as they do in life.

    Returns:
        One factor for each light, for use in `portraits`. It is below 1 for dark skin, above 1 for
        light skin, and 1 for medium skin.
    """
    if transport.header.skin not in _OTHER_SKINS or not lights:
        return [1.0] * len(lights)
    values = [_light_values(one) for one in lights]
    if any(light.shape[:2] != transport.environment_shape for light in values):
        return [1.0] * len(lights)
    own, reference = _exposures(transport, values), _exposures(_medium(), values)
    return [one / other for one, other in zip(reference, own, strict=True)]


@lru_cache(maxsize=1)
def _medium() -> Transport:
    return load_named(_MEDIUM_HEAD)


def _exposures(
    transport: Transport, lights: Sequence[Floats], rules: Sequence[Expose] = ()
) -> list[float]:
    """Return the exposure gains of heads in several lights, in one matrix product."""
    columns = np.stack(
        [np.broadcast_to(np.atleast_3d(light), (*light.shape[:2], 3)) for light in lights], axis=-1
    ).astype(np.float32)
    size = columns.shape[0] * columns.shape[1]
    rows = (transport.texel_basis @ columns.reshape(size, -1)).reshape(-1, 3, len(lights))
    brightness = sum(
        weight * (transport.pixel_basis[channel] @ np.ascontiguousarray(rows[:, channel]))
        for channel, weight in enumerate(transport.header.luminance_weights)
    )
    faces = np.asarray(brightness)[transport.face].T
    rules = rules or ["face"] * len(lights)
    return [head_exposure(face, rule) for face, rule in zip(faces, rules, strict=True)]


def rule_of(light: LightSource) -> Expose:
    """Return the subject that a picture in a light is exposed for."""
    return light.expose if isinstance(light, Style | Facing) else "face"


def _light_values(light: LightSource) -> Floats:
    if light is None or isinstance(light, Style):
        return _studio(light)
    return light() if callable(light) else light


@lru_cache(maxsize=64)
def _studio(style: Style | None) -> Float64:
    """Return a style's own lamps at a large distance, (32, 64), or even light if there are none."""
    if style is None or not style.lamps:
        return np.ones(SHAPE)
    return np.asarray(sum(far_lamp(lamp, SHAPE) for lamp in style.lamps))


def exposures(values: Floats, coverage: FloatImage) -> tuple[float, ...]:
    """Return display gains that make pictures comparable with one another and across sizes.

    The gains follow the rule of `app.core.base.colour.face_exposure` for the transport's pictures,
    as in `portraits`. The heads in these pictures are bald, so hair does not count as part of the
    face.
    """
    return tuple(map(head_exposure, _faces(values, coverage)))


def style_exposures(
    transport: Transport, values: Floats, coverage: FloatImage, lights: Sequence[LightSource]
) -> tuple[float, ...]:
    """Return display gains that expose the face as each picture's style requires.

    Args:
        values: (n, N, N, 3) float. Pictures of the transport in each of the lights, at any scale.
        coverage: (N, N) float32. Fraction of each pixel that the head covers.
    """
    each = zip(_faces(values, coverage), lights, skin_gains(transport, lights), strict=True)
    return tuple(head_exposure(face, rule_of(light), skin) for face, light, skin in each)


def _faces(values: Floats, coverage: FloatImage) -> FloatImage:
    """Return the luminance of the face's pixels in each picture, (n, P)."""
    return colour.luminance(np.asarray(values)[:, coverage >= _FACE_COVERAGE])


def portraits(
    values: Floats, coverage: FloatImage, frame: Framing, gain_list: Sequence[float] = ()
) -> Bytes:
    """Develop pictures of the head on a neutral grey background.

    Args:
        values: (n, N, N, 3) float. Linear Rec. 709 on black. Pixels at the head's edge contain only
            the light from the head itself.
        coverage: (N, N) float32. Fraction of each pixel that the head covers.
        gain_list: Gains of the pictures. By default, `exposures` computes them from the pictures.

    Returns:
        (n, h, w, 3) uint8. sRGB.
    """
    linear = np.asarray(values, np.float32)
    height, width = frame.size
    well = np.float32(WELL[0] / 255.0)
    behind = (1.0 - np.clip(coverage, 0.0, 1.0))[..., np.newaxis] * colour.srgb_decode(well)
    result = np.empty((len(linear), height, width, 3), np.uint8)
    gains = gain_list or exposures(linear, coverage)
    for picture, target, gain in zip(linear, result, gains, strict=True):
        light = _compressed(np.clip(picture * np.float32(gain), 0.0, _MOST_LIGHT))
        # Outside the picture there is only background: subtract it before framing, and add it back.
        framed = frame.of((_encoded(light + behind) - well).transpose(2, 0, 1))
        framed += well
        np.clip(framed, 0.0, 1.0, out=framed)
        target[...] = (framed * np.float32(255.0) + np.float32(0.5)).astype(np.uint8).T
    return result


def large_portrait(
    picture: Float32, away: FloatImage, gain: float, behind: Float32 | None = None
) -> Bytes:
    """Develop a framed linear picture, (h, w, 3), in a few milliseconds.

    Args:
        away: (h, w, 3). Fraction of each value that the head does not cover.
        behind: (h, w, 3) float32. Light behind the head, exposed like the head, or None for neutral
            grey.
    """
    display = np.empty(picture.shape, np.uint8)
    # Work in bands that fit in the cache.
    step = max(_BAND_PIXELS // picture.shape[1], 1)
    for first in range(0, len(picture), step):
        band = slice(first, first + step)
        light = picture[band] if behind is None else picture[band] + away[band] * behind[band]
        light = light * np.float32(gain)
        light = _compressed(np.clip(light, 0.0, _MOST_LIGHT, out=light))
        if behind is None:
            light += away[band] * colour.srgb_decode(np.float32(WELL[0] / 255.0))
        light *= np.float32(_TONES)
        display[band] = colour.look_up(light.astype(np.uint16), _byte_curve())
    return display


def _compressed(light: Float32) -> Float32:
    """Compress highlights in place, like `colour.develop`, using tables."""
    largest = np.maximum(np.maximum(light[..., 0], light[..., 1]), light[..., 2])
    if float(largest.max()) <= colour.SHOULDER_START:
        return light
    start = np.float32(colour.SHOULDER_START)
    place = cv2.log(np.maximum(largest, start)) - np.log(start)
    steps = (place * np.float32(_SHOULDER_STEPS)).astype(np.uint16)
    factor, haze = (cv2.merge([colour.look_up(steps, part)] * 3) for part in _shoulder())
    light *= factor
    light += haze
    return light


def light_exposures(transport: Transport, lights: Sequence[LightSource]) -> tuple[float, ...]:
    """Return the products of `exposures` and `skin_gains` for a head in several lights."""
    other = transport.header.skin in _OTHER_SKINS
    values, rules = [_light_values(one) for one in lights], [rule_of(one) for one in lights]
    return tuple(_exposures(_medium() if other else transport, values, rules)) if values else ()


def exposure_in_mean_light(transport: Transport, light: FloatImage) -> float:
    """Return the exposure of a face in uniform light equal to the mean of `light`, (32, 64, 3)."""
    solid = solid_angles(SHAPE)[:, np.newaxis]
    mean = float((colour.luminance(light) * solid).sum()) / (SHAPE[1] * float(solid.sum()))
    return light_exposures(transport, [None])[0] / max(mean, 1e-30)


def greyed(picture: Bytes) -> Bytes:
    """Grey out the portrait of a style that is out of reach.

    Args:
        picture: (h, w, 3) uint8. sRGB on the background grey.

    Returns:
        (h, w, 3) uint8. sRGB. The background grey is unchanged.
    """
    return colour.to_bytes(pictures.greyed(picture.astype(np.float32) / np.float32(255.0)))


def _encoded(linear: Float32) -> Float32:
    steps = np.clip(linear, 0.0, 1.0) * np.float32(_TONES - 1) + np.float32(0.5)
    return colour.look_up(steps.astype(np.uint16), _curve())


@lru_cache(maxsize=1)
def _curve() -> Float32:
    return _full(colour.srgb_encode(np.linspace(0.0, 1.0, _TONES)))


@lru_cache(maxsize=1)
def _shoulder() -> tuple[Float32, Float32]:
    """Return the scale and offset of `app.core.base.colour.develop`, by largest channel value."""
    last = int(math.log(_MOST_LIGHT / colour.SHOULDER_START) * _SHOULDER_STEPS) + 1
    largest = colour.SHOULDER_START * np.exp(np.arange(last + 1) / _SHOULDER_STEPS)
    haze = colour.develop(np.stack([largest, 0 * largest, 0 * largest], axis=1))
    factor = np.asarray((haze[:, 0] - haze[:, 1]) / largest, np.float32)
    return _full(factor), _full(haze[:, 1])


@lru_cache(maxsize=1)
def _byte_curve() -> Bytes:
    return _full(colour.to_bytes(colour.srgb_encode((np.arange(_TONES) + 0.5) / _TONES)))


def _full(table: NDArray[Any]) -> NDArray[Any]:
    """Extend a table to all 16-bit codes by repeating its last entry."""
    return np.pad(table, (0, (1 << 16) - len(table)), "edge")


def _taps(count: int, pixels: int, start: float, step: float) -> Taps:
    """Return taps from `start` onwards that average `count` pixels to `pixels` of width `step`."""
    first, weight = (_averaged if step >= 1 else _smooth)(pixels, start, step)
    index = first + np.arange(len(weight))[:, np.newaxis]
    weight[(index < 0) | (index >= count)] = 0.0
    return Taps(np.clip(index, 0, count - 1), np.asarray(weight, np.float32))


def _averaged(pixels: int, start: float, step: float) -> tuple[Indices, Float64]:
    """Return each pixel's fraction of the area of each result pixel, averaging as a sensor does."""
    low = start + step * np.arange(pixels)
    first = np.floor(low).astype(np.intp)
    place = first + np.arange(math.ceil(step) + 1)[:, np.newaxis]
    overlap = np.minimum(low + step, place + 1.0) - np.maximum(low, place)
    return first, np.maximum(overlap, 0.0) / step


def _smooth(pixels: int, start: float, step: float) -> tuple[Indices, Float64]:
    middle = start + step * (np.arange(pixels) + 0.5) - 0.5
    first = np.floor(middle).astype(np.intp) - 1
    return first, pictures.mitchell(np.abs(middle - first - np.arange(4)[:, np.newaxis]))
