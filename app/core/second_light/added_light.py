"""A second light at every placement, prepared for one head and for the search.

A preset lamp is near the head. T describes how the skin behind each pixel responds to light from
every direction. Light from a near lamp reaches each point of the head from a different direction
and becomes weaker with distance. For a pixel that shows point x, a piece dA of the lamp at q with
luminance L contributes

    T(x, direction to q) / sr * L * cos(at the lamp) dA / |q - x|^2.

An object between x and q is also between x and everything behind q, so T's own shadows apply and
nothing has to be baked. The model ignores light that spreads under the skin, or that is reflected
from the cheek to the nose, between points that the lamp lights differently.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64, Floats, Int64
from app.core.base.errors import CoreError
from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.environment.environment import SHAPE, solid_angles
from app.core.second_light.captured_lamps.captured_lamp import PlacedLamp
from app.core.second_light.contrast import (
    Contrast,
    FaceBasis,
    HiddenTexels,
    find_contrast,
    find_hidden,
    less_mean,
    two_parts,
)
from app.core.second_light.lamp_presets import NumbersLamp
from app.core.second_light.placements import ALTITUDES_DEG, COUNT, MIRRORED, direction, placement
from app.core.solver.head_shape import HeadShape
from app.core.solver.transport import Transport
from app.core.text import tr

Float16: TypeAlias = NDArray[np.float16]

# degrees of the lamp as seen from the skin: slightly more than a texel of T
_PIECE_DEG: Final = 7.0
_PIECES: Final = (2, 8)  # least and most pieces along each side
# metres from the centre of the head at which a lamp's apparent size is computed
_SKIN_M: Final = 0.1
_DOT_DEG: Final = 0.1  # degrees of the lamp per dot, for the area that it hides
_DOTS: Final = (128, 512)  # least and most dots along each side
_GOLDEN: Final = 0.5 * (math.sqrt(5.0) - 1.0)
_PIXELS: Final = 256
_ROWS: Final = 1 << 19
_AT_ONCE: Final = 8  # pieces of a lamp, so that threads seldom wait for the interpreter
_THREADS: Final = 2
_BLACK: Final = 2.0**-14  # the smallest normal half float; fainter responses count as zero
_HALF_TO_SINGLE: Final = np.float32(2.0**112)


@dataclass(frozen=True, slots=True, eq=False)
class NearField:
    """A head prepared for nearby lamps."""

    transport: Transport = field(repr=False)
    # (P, 3), position of each pixel's skin, in metres from the middle of the head
    positions: Float32 = field(repr=False)
    # (3, P * H * W), T per steradian, linear Rec. 709: pixel by pixel, texels row-major
    columns: Float16 = field(repr=False)


def prepare_near(transport: Transport, shape: HeadShape) -> NearField:
    """Prepare a head for nearby lamps. This takes half a second and about 60 MB."""
    height, width = transport.environment_shape
    count = len(transport.pixels)
    per_steradian = np.repeat(1.0 / solid_angles((height, width)), width).astype(np.float32)
    texels = transport.texel_basis * per_steradian
    columns = np.empty((3, count, height * width), np.float16)
    for start in range(0, count, _PIXELS):
        part = slice(start, start + _PIXELS)
        for channel in range(3):
            basis = transport.pixel_basis[channel, part] @ texels
            # The low-rank approximation may be slightly negative.
            basis[basis < _BLACK] = 0.0
            columns[channel, part] = basis
    return NearField(transport, shape.positions, columns.reshape(3, -1))


def near_picture(
    near: NearField, lamp: NumbersLamp, azimuth_deg: float, altitude_deg: float
) -> Float32:
    """Return the picture of a head as lit only by a near lamp.

    Args:
        azimuth_deg, altitude_deg: Placement of the lamp, in degrees, positive towards the sitter's
            left and upwards.

    Returns:
        (P, 3) float32. Linear Rec. 709 in cd/m2, like the picture in an environment in cd/m2.
    """
    picture = _picture(near, near.columns, lamp, azimuth_deg, altitude_deg)
    return np.ascontiguousarray(picture.T) * np.asarray(lamp.colour, np.float32)


def near_luminances(
    near: NearField, lamp: NumbersLamp, token: Token | None = None, report: Report = silent
) -> Float32:
    """Return the luminance of a head under a near lamp at every placement.

    Returns:
        (576, P) float32. Luminance of `near_picture`, in cd/m2.
    """
    transport = near.transport
    weights = np.asarray(transport.header.luminance_weights) * lamp.colour
    columns = _weighed(near.columns, weights.astype(np.float32))
    twins = _twins(transport) if transport.header.symmetric else None
    numbers = [n for n in range(COUNT) if twins is None or n <= MIRRORED[n]]
    result = np.empty((COUNT, len(near.positions)), np.float32)
    pool = ThreadPoolExecutor(_THREADS)
    try:
        pictures = pool.map(lambda n: _picture(near, columns, lamp, *placement(n))[0], numbers)
        for done, (number, picture) in enumerate(zip(numbers, pictures, strict=True)):
            if token is not None:
                token.check()
            report(done / len(numbers), Progress(Task.TRYING_LAMP))
            result[number] = picture
            if twins is not None and MIRRORED[number] != number:
                result[MIRRORED[number]] = picture[twins]
    finally:
        pool.shutdown(cancel_futures=True)
    report(1.0, Progress(Task.TRYING_LAMP))
    return result


def coverage(lamp: NumbersLamp, shape: tuple[int, int]) -> Float32:
    """Return the part of the place that a lamp hides, as seen from the centre of the head.

    Args:
        shape: Number of rows and columns of the environment, (H, W), where W = 64.

    Returns:
        (576, H, W) float32. Hidden fraction of each texel, 0 to 1, at turn 0.
    """
    shares = np.empty((COUNT, *shape), np.float32)
    width = shape[1]
    for row, altitude in enumerate(ALTITUDES_DEG):
        ahead = _hides(lamp, float(altitude), shape)
        for column in range(width):
            # Azimuths towards the sitter's left are panorama azimuths to the left.
            shares[row * width + column] = np.roll(ahead, -column, axis=1)
    return shares


def _weighed(columns: Float16, weights: Float32) -> Float16:
    """Return weighted sums over the channels, (1, P * H * W), computed in parts to save 120 MB."""
    result = np.empty((1, columns.shape[1]), np.float16)
    for start in range(0, columns.shape[1], _ROWS):
        part = slice(start, start + _ROWS)
        result[0, part] = weights @ columns[:, part].astype(np.float32)
    return result


def _picture(
    near: NearField, columns: Float16, lamp: NumbersLamp, azimuth_deg: float, altitude_deg: float
) -> Float32:
    """Return the picture, (C, P), as lit by a lamp with a luminance of 1.

    Args:
        columns: (C, P * H * W). T per steradian.
    """
    places, normal = _pieces(lamp, azimuth_deg, altitude_deg)
    positions = np.ascontiguousarray(near.positions.T)
    picture = np.zeros((len(columns), len(near.positions)), np.float32)
    strength = np.float32(lamp.lux_at_1m / len(places))
    for start in range(0, len(places), _AT_ONCE):
        toward = places[start : start + _AT_ONCE, :, None] - positions
        squared = np.square(toward).sum(axis=1)
        toward /= np.sqrt(squared)[:, None]
        facing = np.maximum(np.einsum("kcp,c->kp", toward, -normal), 0.0)
        facing *= strength
        facing /= squared
        taps = _taps(near.transport.environment_shape, toward)
        for row, column in zip(picture, columns, strict=True):
            row += (_interpolated(column, taps) * facing).sum(axis=0)
    return picture


def _pieces(lamp: NumbersLamp, azimuth_deg: float, altitude_deg: float) -> tuple[Float32, Float32]:
    """Return the centres of a lamp's pieces, (K, 3) in metres, and their normal, (3,)."""
    toward, side, over = _axes(azimuth_deg, altitude_deg)
    middle = toward * lamp.distance_m
    away = max(lamp.distance_m - _SKIN_M, _SKIN_M)
    wide, tall = (_count(size, away) for size in lamp.size_m)
    places = [
        ((i + 0.5) / wide - 0.5, (j + 0.5) / tall - 0.5) for j in range(tall) for i in range(wide)
    ]
    if lamp.round:
        within = [(x, y) for x, y in places if math.hypot(x, y) <= 0.5]
        places = within or places
    width, height = lamp.size_m
    centres = [middle + side * x * width + over * y * height for x, y in places]
    return np.asarray(centres, np.float32), (-toward).astype(np.float32)


def _count(size_m: float, away_m: float) -> int:
    diameter_deg = math.degrees(2.0 * math.atan(size_m / 2.0 / away_m))
    return min(max(math.ceil(diameter_deg / _PIECE_DEG), _PIECES[0]), _PIECES[1])


def _axes(azimuth_deg: float, altitude_deg: float) -> tuple[Float64, Float64, Float64]:
    """Return unit vectors towards the lamp, along its (level) width, and along its height."""
    toward = direction(azimuth_deg, altitude_deg)
    angle = math.radians(azimuth_deg)
    side = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    return toward, side, np.cross(toward, side)


def _taps(shape: tuple[int, int], toward: Float32) -> list[tuple[Int64, Float32]]:
    """Return the four texels around each direction, and their shares.

    Args:
        shape: Number of rows and columns of the environment.
        toward: (K, 3, P) float32. Unit vectors from each pixel's skin.

    Returns:
        For each of the four, the position in a column of T, (K, P), and the share, (K, P).
    """
    height, width = shape
    x = np.arctan2(-toward[:, 0], toward[:, 2]) * np.float32(width / (2 * math.pi))
    x += np.float32(width / 2 - 0.5)
    y = np.arcsin(np.clip(toward[:, 1], -1.0, 1.0)) * np.float32(-height / math.pi)
    y = np.clip(y + np.float32(height / 2 - 0.5), 0.0, np.float32(height - 1))
    left, upper = np.floor(x).astype(np.int64), np.minimum(y.astype(np.int64), height - 2)
    right_share = x - left.astype(np.float32)
    lower_share = y - upper.astype(np.float32)
    left_share, upper_share = 1 - right_share, 1 - lower_share
    start = np.arange(toward.shape[2]) * (height * width) + upper * width
    first, second = start + left % width, start + (left + 1) % width
    return [
        (first, left_share * upper_share),
        (second, right_share * upper_share),
        (first + width, left_share * lower_share),
        (second + width, right_share * lower_share),
    ]


def _interpolated(column: Float16, taps: list[tuple[Int64, Float32]]) -> Float32:
    """Return a column of T at each direction, (K, P)."""
    result = np.zeros(taps[0][0].shape, np.float32)
    for texels, shares in taps:
        # Shifted, the bits of a half are those of a single 2^-112 times as large; numpy's own
        # conversion takes longer than all the rest. No value is negative.
        halves = column.take(texels).view(np.uint16)
        result += (halves.astype(np.uint32) << 13).view(np.float32) * shares
    result *= _HALF_TO_SINGLE
    return result


def _twins(transport: Transport) -> Int64:
    """Return the index of each pixel's mirror image, or its own if that is not on the head."""
    size, pixels = transport.size, transport.pixels
    mirrored = pixels // size * size + size - 1 - pixels % size
    where = np.minimum(np.searchsorted(pixels, mirrored), len(pixels) - 1)
    return np.where(pixels[where] == mirrored, where, np.arange(len(pixels)))


def _hides(lamp: NumbersLamp, altitude_deg: float, shape: tuple[int, int]) -> Float32:
    """Return the fraction of each texel, (H, W), hidden by a lamp in front at an altitude.

    The lamp is divided into dots, and the solid angle of each dot is assigned to the texel that
    contains it. The sum is therefore right however small the lamp is, and at the edge of a texel it
    is accurate to one dot.
    """
    height, width = shape
    toward, side, over = _axes(0.0, altitude_deg)
    x, y = _dots(*(_along(size, lamp.distance_m) for size in lamp.size_m))
    wide, tall = lamp.size_m
    places = toward * lamp.distance_m + side * wide * x[:, None] + over * tall * y[:, None]
    squared = np.square(places).sum(axis=1)
    dots = wide * tall * lamp.distance_m / (len(x) * squared**1.5)
    if lamp.round:
        dots *= np.hypot(x, y) <= 0.5
    azimuth = np.arctan2(-places[:, 0], places[:, 2])
    elevation = np.arcsin(places[:, 1] / np.sqrt(squared))
    column = np.floor((azimuth / (2 * np.pi) + 0.5) * width).astype(np.int64) % width
    row = np.clip(np.floor((0.5 - elevation / np.pi) * height), 0, height - 1).astype(np.int64)
    sums = np.bincount(row * width + column, dots, height * width).reshape(shape)
    shares = 0.5 * (sums + sums[:, ::-1]) / solid_angles(shape)[:, None]
    return np.asarray(np.minimum(shares, 1.0), np.float32)


def _along(size_m: float, away_m: float) -> int:
    """Return the number of dots along one side of a lamp."""
    diameter_deg = math.degrees(2.0 * math.atan(size_m / 2.0 / away_m))
    return math.ceil(min(max(diameter_deg / _DOT_DEG, _DOTS[0]), _DOTS[1]))


def _dots(wide: int, tall: int) -> tuple[Float64, Float64]:
    """Return the positions of dots along width and height, -0.5 to 0.5, one in each grid cell.

    Each row and column is shifted by a different fraction of a cell, so that the edge of a texel
    never runs along a whole row of dots.
    """
    i, j = np.divmod(np.arange(wide * tall), tall)
    x, y = (i + (j * _GOLDEN) % 1.0) / wide, (j + (i * _GOLDEN) % 1.0) / tall
    return x - 0.5, y - 0.5


_BATCH: Final = 64


@dataclass(frozen=True, slots=True, eq=False)
class AddedLight:
    """A lamp at every placement, prepared for one head. The arrays are read-only."""

    name: str
    title: str  # title of a captured lamp, or "" for a preset, which is named by its kind
    distance_m: float | None  # distance from the centre of the head in metres, or None if unknown
    # (576, 32, 64), fraction of each texel that the lamp hides, in the head's frame
    alpha: Float32 = field(repr=False)
    # (576, 32, 64, 3), premultiplied radiance of a captured lamp, linear Rec. 709, in cd/m2, or
    # None for a near lamp from numbers, which is not an environment
    light: Float32 | None = field(repr=False)
    # (576, P), luminance of the head under the lamp alone, in the same unit
    pictures: Float32 = field(repr=False)
    # (3,), radiance of the face of a lamp from numbers, linear Rec. 709, in cd/m2, or 0 for a
    # captured lamp
    glow: Float64 = field(repr=False)
    absolute: bool  # whether all values are in cd/m2; otherwise in a unit of the capture
    hidden: HiddenTexels = field(repr=False)
    contrast: Contrast = field(repr=False)

    def over(self, light: Floats, number: int, power: float = 1.0) -> Float64:
        """Composite the lamp over the light of a place (eq. 7).

        Args:
            light: (32, 64, 3) float. Linear Rec. 709 radiance as seen by the face, in cd/m2.

        Returns:
            (32, 64, 3) float64. A preset lamp appears as if it were far away. Its near light is
            only in `pictures`.
        """
        share = self.alpha[number][..., None].astype(np.float64)
        own = share * self.glow if self.light is None else self.light[number]
        return np.asarray(light * (1.0 - share) + power * own)


def from_numbers(
    transport: Transport,
    shape: HeadShape,
    lamp: NumbersLamp,
    token: Token | None = None,
    report: Report = silent,
    *,
    near: NearField | None = None,
    face: FaceBasis,
) -> AddedLight:
    """Prepare a preset lamp, including the near field at its distance.

    Raises:
        CoreError: If the head was baked for environments of a different size.
    """
    near = prepare_near(transport, shape) if near is None else near
    if token is not None:
        token.check()
    pictures = near_luminances(near, lamp, token, span(report, 0.0, 0.7))
    alpha = coverage(lamp, SHAPE)
    hidden = find_hidden(alpha)
    report(0.7, Progress(Task.SORTING_SHADOWS))
    coefficients, beside = _in_basis(face, pictures)
    contrast = find_contrast(face, hidden, coefficients, beside)
    report(1.0, Progress(Task.DONE))
    return AddedLight(
        name=lamp.kind,
        title="",
        distance_m=lamp.distance_m,
        alpha=alpha,
        light=None,
        pictures=pictures,
        glow=lamp.luminance * np.asarray(lamp.colour, np.float64),
        absolute=True,
        hidden=hidden,
        contrast=contrast,
    )


def from_captured(
    transport: Transport,
    lamp: PlacedLamp,
    token: Token | None = None,
    report: Report = silent,
    *,
    face: FaceBasis,
) -> AddedLight:
    """Prepare a captured lamp.

    Raises:
        CoreError: If the head or the lamp has the wrong size, or the lamp is invalid.
    """
    _check(lamp)
    report(0.3, Progress(Task.SORTING_SHADOWS, lamp.title))
    hidden = find_hidden(lamp.alpha)
    parts = two_parts(lamp.light, face.mixing).reshape(COUNT, -1)
    contrast = find_contrast(face, hidden, face.rows @ parts.T, np.zeros(COUNT))
    report(0.8, Progress(Task.HOLDING_LAMP, lamp.title))
    pictures = _luminances(transport, lamp.light, token)
    report(1.0, Progress(Task.DONE))
    return AddedLight(
        name=lamp.name,
        title=lamp.title,
        distance_m=lamp.distance_m,
        alpha=lamp.alpha,
        light=lamp.light,
        pictures=pictures,
        glow=np.zeros(3),
        absolute=lamp.absolute,
        hidden=hidden,
        contrast=contrast,
    )


def _check(lamp: PlacedLamp) -> None:
    right = lamp.light.shape == (COUNT, *SHAPE, 3) and lamp.alpha.shape == (COUNT, *SHAPE)
    if not right or not np.isfinite(lamp.light).all() or lamp.light.min() < 0:
        raise CoreError(
            tr("The lamp “{title}” is damaged.", title=lamp.title),
            tr("Capture the lamp again."),
        )
    # This is also False for NaN.
    if not ((lamp.alpha >= 0) & (lamp.alpha <= 1)).all():
        raise CoreError(
            tr("The mask of {title} is damaged.", title=lamp.title), tr("Mark the lamp again.")
        )


def _in_basis(face: FaceBasis, pictures: Float32) -> tuple[Float64, Float64]:
    """Return the pictures' coordinates, (K, 576), and the remainders' squared norms, (576,)."""
    centred = less_mean(pictures, face.root)
    basis = face.pixels.astype(np.float64)
    coefficients: Float64 = (centred @ basis).T
    beside = np.square(centred).sum(axis=1) - np.square(coefficients).sum(axis=0)
    return coefficients, np.maximum(beside, 0.0)


def _luminances(transport: Transport, light: Float32, token: Token | None) -> Float32:
    """Return the luminance of the head, (576, P), in each of the environments."""
    weights = transport.header.luminance_weights
    pictures = np.zeros((len(light), len(transport.pixels)), np.float32)
    texels = np.ascontiguousarray(transport.texel_basis.T)
    for start in range(0, len(light), _BATCH):
        if token is not None:
            token.check()
        part = slice(start, start + _BATCH)
        flat = light[part].reshape(-1, texels.shape[0], 3)
        for channel, weight in enumerate(weights):
            luminances = (flat[:, :, channel] @ texels) * np.float32(weight)
            pictures[part] += luminances @ transport.pixel_basis[channel].T
    return pictures
