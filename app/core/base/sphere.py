"""Define the axes and directions of panoramas, and rotate pictures and light.

Directions are unit vectors in the panorama's coordinate system. Its axes are right-handed and
coincide with those of the head at turn 0: **+Y is up (elevation 90), +Z is the centre column
(azimuth 0, elevation 0), and +X is azimuth -90**, left of the centre. Azimuth a and elevation e
give the direction (-sin a cos e, sin e, cos a cos e). A rotation is a 3 x 3 matrix R that acts on
column vectors and *moves the content*: the content at direction d moves to direction R d.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final, TypeAlias, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64, Floats, Int64, Numbers

Picture: TypeAlias = NDArray[np.integer[Any]] | Floats
_Pixel = TypeVar("_Pixel", bound="np.integer[Any] | np.floating[Any]")

# destination pixels per band, so that the band's maps stay within a few megabytes
_BAND_PIXELS: Final = 1 << 19
_DETAIL: Final = 5  # texels; bright detail finer than this is moved texel by texel
_LAMP: Final = np.float32(8.0)  # times the mean; brighter light is moved texel by texel too


def solid_angles(shape: tuple[int, int]) -> Float64:
    """Return the solid angle of a texel in each row of an equirectangular panorama.

    Args:
        shape: Rows and columns (H, W).

    Returns:
        Float64, (H,). Steradians per texel. The sum over all H * W texels is 4 pi.

    Examples:
        >>> float((solid_angles((32, 64)).sum() * 64 / (4 * np.pi)).round(12))
        1.0
    """
    rows, columns = shape
    return -np.diff(row_edges(rows)) * (2.0 * np.pi / columns)


def row_edges(rows: int) -> Float64:
    """Return the sine of the elevation of each row edge, (rows + 1,) float64, from 1 to -1.

    The values are exactly symmetric.
    """
    elevation = np.pi * (0.5 - np.arange(rows // 2 + 1) / rows)
    half = np.sin(elevation)
    half[0] = 1.0
    if rows % 2 == 0:
        half[-1] = 0.0
        return np.concatenate([half, -half[-2::-1]])
    return np.concatenate([half, -half[::-1]])


def bounded(panorama: NDArray[_Pixel], columns: int) -> NDArray[_Pixel]:
    """Scale a panorama, (H, 2 H) or (H, 2 H, C), down to at most `columns` columns by averaging."""
    if panorama.shape[1] <= columns:
        return panorama
    size = (columns, columns // 2)
    small = cv2.resize(panorama, size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, panorama.dtype)


def wrapped(panorama: NDArray[_Pixel], margin: int) -> NDArray[_Pixel]:
    """Pad a panorama, (H, W) or (H, W, C), on both sides with columns from the opposite side."""
    return np.concatenate([panorama[:, -margin:], panorama, panorama[:, :margin]], axis=1)


def rotation(yaw_deg: float, pitch_deg: float = 0.0, roll_deg: float = 0.0) -> Float64:
    """Compose a rotation from yaw, pitch and roll, in the order of GPano and aviation.

    A level camera is first turned by yaw, clockwise as seen from above. Its front is then raised by
    pitch. Finally, the camera is rolled about its front axis by roll, clockwise as the camera sees
    it: its right side goes down, and the horizon in its picture turns counter-clockwise. The matrix
    maps directions in the turned camera's panorama to directions in the level camera's panorama:
    R = Y(yaw) X(pitch) Z(roll). `remap_frame` with R therefore levels the turned camera's panorama.

    Args:
        yaw_deg, pitch_deg, roll_deg: Angles, in degrees. Positive means clockwise as seen from
            above for yaw, upwards for pitch, and clockwise as the camera sees it for roll.

    Returns:
        (3, 3) float64. The rotation, whose inverse is its transpose.

    Examples:
        >>> bool(np.allclose(rotation(90.0) @ direction(0.0, 0.0), direction(90.0, 0.0)))
        True
    """
    yaw, pitch, roll = (math.radians(a) for a in (yaw_deg, pitch_deg, roll_deg))
    about_up = _plane(2, 0, -yaw)
    about_side = _plane(1, 2, -pitch)
    about_front = _plane(0, 1, roll)
    return about_up @ about_side @ about_front


def angles_of(matrix: Float64) -> tuple[float, float, float]:
    """Return the yaw, pitch and roll of a rotation, inverting `rotation`.

    Args:
        matrix: (3, 3) float64. A rotation.

    Returns:
        (yaw, pitch, roll) in degrees, with yaw and roll in [-180, 180] and pitch in [-90, 90]. At a
        pitch of exactly 90 or -90 degrees, roll is 0.

    Examples:
        >>> [round(angle, 9) for angle in angles_of(rotation(10.0, -20.0, 30.0))]
        [10.0, -20.0, 30.0]
    """
    level = math.hypot(matrix[1, 0], matrix[1, 1])
    pitch = math.atan2(matrix[1, 2], level)
    if level > 1e-9:
        yaw = math.atan2(-matrix[0, 2], matrix[2, 2])
        roll = math.atan2(matrix[1, 0], matrix[1, 1])
    else:
        yaw, roll = math.atan2(matrix[2, 0], matrix[0, 0]), 0.0
    return math.degrees(yaw), math.degrees(pitch), math.degrees(roll)


def angle_of(matrix: Float64) -> float:
    """Return the angle of a rotation about its axis, in [0, 180] degrees.

    Args:
        matrix: (3, 3) float64. A rotation.
    """
    return math.degrees(float(np.linalg.norm(to_vector(matrix))))


def from_vector(vector: Float64) -> Float64:
    """Return the rotation matrix of a rotation vector, by Rodrigues' formula.

    Args:
        vector: (3,) float64. Axis times angle, in radians, right-handed about the axis.

    Returns:
        (3, 3) float64. The rotation.
    """
    matrix, _ = cv2.Rodrigues(np.asarray(vector, np.float64).reshape(3, 1))
    return np.asarray(matrix, np.float64)


def to_vector(matrix: Float64) -> Float64:
    """Return the rotation vector of a rotation matrix, inverting `from_vector`.

    Args:
        matrix: (3, 3) float64. A rotation.

    Returns:
        (3,) float64. Axis times angle, in radians.
    """
    vector, _ = cv2.Rodrigues(np.asarray(matrix, np.float64))
    return np.asarray(vector, np.float64).ravel()


def direction(azimuth_deg: float, elevation_deg: float) -> Float64:
    """Return the unit vector for an azimuth and an elevation, which are given in degrees.

    Returns:
        (3,) float64. Unit vector in the panorama's coordinate system.
    """
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    level = math.cos(elevation)
    return np.array([-math.sin(azimuth) * level, math.sin(elevation), math.cos(azimuth) * level])


def directions(shape: tuple[int, int]) -> Float32:
    """Return the unit vector towards the centre of each texel.

    Args:
        shape: Rows and columns (H, W).

    Returns:
        (H, W, 3) float32. Unit vectors in the panorama's coordinate system.
    """
    level, up, across = _row_column_parts(shape)
    result = np.empty((*shape, 3), np.float32)
    result[..., 0] = level[:, None] * across[0]
    result[..., 1] = up[:, None]
    result[..., 2] = level[:, None] * across[1]
    return result


def directions_at(shape: tuple[int, int], texels: NDArray[np.integer[Any]]) -> Float64:
    """Return the unit vectors towards the centres of selected texels, in double precision.

    Args:
        shape: Rows and columns (H, W).
        texels: (N,) integer. Texel indices: row * W + column.

    Returns:
        (N, 3) float64. Unit vectors in the panorama's coordinate system.
    """
    row, column = np.divmod(texels, shape[1])
    elevation = np.pi * (0.5 - (row + 0.5) / shape[0])
    azimuth = 2.0 * np.pi * ((column + 0.5) / shape[1] - 0.5)
    level = np.cos(elevation)
    return np.stack([-level * np.sin(azimuth), np.sin(elevation), level * np.cos(azimuth)], axis=1)


def positions(vectors: Float32, shape: tuple[int, int]) -> tuple[Float32, Float32]:
    """Return the column and row of each direction in a panorama.

    Args:
        vectors: (..., 3) float32 or float64. Directions of any non-zero length.
        shape: Rows and columns (H, W).

    Returns:
        columns, rows: (...) float32. Whole numbers are texel centres. Columns are in
            [-0.5, W - 0.5] and rows are in [-0.5, H - 0.5].
    """
    x, y, z = (np.ascontiguousarray(vectors[..., k], np.float32) for k in range(3))
    return _positions(x, y, z, shape)


def remap_frame(image: Picture, matrix: Float64) -> Picture:
    """Rotate a panorama picture by bilinear sampling, without seams at its edges or its poles.

    For light, use `rotate_light`, which preserves the energy. Apart from the result, only a few
    megabytes of maps are in memory at a time.

    Args:
        image: (H, W) or (H, W, C) uint8, uint16, float32 or float64. Equirectangular panorama, with
            C up to 4.
        matrix: (3, 3) float64. Rotation that moves the content; see the module's docstring.

    Returns:
        The rotated panorama, with the same shape and dtype.
    """
    shape = (image.shape[0], image.shape[1])
    result = np.empty_like(image)
    for start, columns, rows in _bands(shape, matrix):
        _gather(image, columns, rows, result[start : start + len(rows)])
    return result


def rotate_light(radiance: Float32, matrix: Float64) -> Float32:
    """Rotate an environment, preserving the energy of each lamp.

    Lamps and small bright spots (the detail that a morphological opening removes) are moved with
    weights that preserve the solid angle of every texel exactly: they are gathered bilinearly, and
    each source texel is divided by the solid angle that gathers it. The rest, which is dim or
    smooth, is interpolated. Near the poles, where texels are very narrow, both parts are first
    averaged to texels as wide as they are high. A uniform environment stays uniform.

    Args:
        radiance: (H, W, C) float32. Linear radiance, finite and non-negative, with C up to 4.
        matrix: (3, 3) float64. Rotation that moves the content; see the module's docstring.

    Returns:
        (H, W, C) float32. Linear radiance on the same scale, with the same energy per channel.
    """
    shape = (radiance.shape[0], radiance.shape[1])
    runs = _runs(shape)
    base = np.array(radiance, np.float32)
    _even_runs(base, runs)
    mean = np.float32(_total(base).max() / (4.0 * np.pi))
    opening = _opening(base)
    fine = np.nonzero(_brightest(base - opening) > mean)
    rest = np.minimum(base, _LAMP * mean)
    rest[fine] = np.minimum(opening[fine], _LAMP * mean)
    base -= rest
    energy_before = _total(rest)
    result = np.empty_like(rest)
    for start, columns, rows in _bands(shape, matrix):
        _gather(rest, columns, rows, result[start : start + len(rows)])
    got = _total(result)
    result *= np.divide(energy_before, got, out=np.ones_like(got), where=got > 0).astype(np.float32)
    _add_spots(result, base, matrix, runs)
    return result


def _plane(first: int, second: int, angle: float) -> Float64:
    """Return the rotation by `angle` radians from the first of two axes towards the second."""
    matrix = np.eye(3)
    cosine, sine = math.cos(angle), math.sin(angle)
    matrix[first, first] = matrix[second, second] = cosine
    matrix[second, first], matrix[first, second] = sine, -sine
    return matrix


def _row_column_parts(shape: tuple[int, int]) -> tuple[Float64, Float64, Float64]:
    """Return the cosine and sine of the elevation of each row, and X and Z, (2, W), of each column.

    All are measured at the texel centres. X and Z are given for elevation 0.
    """
    height, width = shape
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    azimuth = 2.0 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    return np.cos(elevation), np.sin(elevation), np.stack([-np.sin(azimuth), np.cos(azimuth)])


def _positions(
    x: Float32, y: Float32, z: Float32, shape: tuple[int, int]
) -> tuple[Float32, Float32]:
    """Compute `positions` from the vectors' components, which are overwritten to save memory."""
    height, width = shape
    columns = np.arctan2(-x, z)
    columns *= np.float32(width / (2.0 * np.pi))
    columns += np.float32((width - 1) / 2)
    # Use the arctangent, since the arcsine loses all precision near the poles.
    x *= x
    z *= z
    x += z
    rows = np.arctan2(np.sqrt(x, out=x), y)
    rows *= np.float32(height / np.pi)
    rows -= np.float32(0.5)
    return columns, rows


def _bands(shape: tuple[int, int], matrix: Float64) -> Iterator[tuple[int, Float32, Float32]]:
    """Yield the first row of each band, with the source columns and rows of the band's texels."""
    height, width = shape
    level, up, across = _row_column_parts(shape)
    inverse = np.asarray(matrix, np.float64).T
    sideways = (inverse[:, [0, 2]] @ across).astype(np.float32)
    upward = (inverse[:, 1:2] * up).astype(np.float32)
    flat = level.astype(np.float32)
    step = max(_BAND_PIXELS // width, 1)
    for start in range(0, height, step):
        band = slice(start, min(start + step, height))
        x, y, z = (
            flat[band, None] * sideways[axis] + upward[axis, band, None] for axis in range(3)
        )
        yield start, *_positions(x, y, z, shape)


def _gather(image: Picture, columns: Float32, rows: Float32, into: Picture) -> None:
    """Sample a panorama bilinearly at the given positions, across its edges and its poles."""
    last = np.float32(image.shape[0] - 1)
    inside = np.clip(rows, np.float32(0.0), last)
    cv2.remap(image, columns, inside, cv2.INTER_LINEAR, dst=into, borderMode=cv2.BORDER_WRAP)
    beyond = np.nonzero(inside != rows)
    if beyond[0].size:
        into[beyond] = _over_the_pole(image, columns[beyond], rows[beyond])


def _over_the_pole(image: Picture, columns: Float32, rows: Float32) -> Picture:
    """Sample between the row next to a pole and the same row on the opposite side of the pole."""
    at, shares = _corners(columns, rows, (image.shape[0], image.shape[1]))
    flat = image.reshape(image.shape[0] * image.shape[1], -1)
    value = np.einsum("kn,knc->nc", shares, flat[at].astype(np.float64))
    if np.issubdtype(image.dtype, np.integer):
        value = np.rint(value)
    result: Picture = value.reshape(-1, *image.shape[2:]).astype(image.dtype)
    return result


def _total(radiance: Float32) -> Float64:
    """Return the energy per channel, several times faster than `environment.energy`."""
    sums = cv2.reduce(radiance, 1, cv2.REDUCE_SUM, dtype=cv2.CV_64F)
    shape = (radiance.shape[0], radiance.shape[1])
    return np.asarray(solid_angles(shape) @ sums.reshape(shape[0], -1), np.float64)


def _runs(shape: tuple[int, int]) -> Int64:
    """Return, for each row, how many adjacent texels are together about as wide as one is high.

    Each number divides the width.
    """
    height, width = shape
    level, _, _ = _row_column_parts(shape)
    aspect = width / (2.0 * height) / level
    divisors = np.array([n for n in range(1, width + 1) if width % n == 0])
    places = np.searchsorted(divisors, 0.75 * aspect)
    return np.asarray(divisors[np.minimum(places, divisors.size - 1)], np.int64)


def _even_runs(values: Numbers, runs: Int64) -> None:
    """Average each row over runs of texels, in place, preserving the row's sum."""
    width = values.shape[1]
    for run in np.unique(runs[runs > 1]):
        rows = np.nonzero(runs == run)[0]
        split = values[rows].reshape(len(rows), width // run, run, -1)
        # A matrix product sums short runs many times faster than a reduction does.
        means = np.einsum("abcd,c->abd", split, np.full(run, 1.0 / run, np.float32))
        values[rows] = np.repeat(means, run, axis=1).reshape(values[rows].shape)


def _opening(radiance: Float32) -> Float32:
    """Remove bright detail narrower than `_DETAIL` texels by grey opening, even across the edge."""
    pad = 2 * (_DETAIL // 2)
    kernel = np.ones((_DETAIL, _DETAIL), np.uint8)
    opening = cv2.morphologyEx(wrapped(radiance, pad), cv2.MORPH_OPEN, kernel)
    height, _, channels = radiance.shape
    return np.ascontiguousarray(opening.reshape(height, -1, channels)[:, pad:-pad])


def _add_spots(result: Float32, spots: Float32, matrix: Float64, runs: Int64) -> None:
    """Rotate small bright spots onto an environment, preserving the energy of each texel."""
    shape = (spots.shape[0], spots.shape[1])
    spot_mask = np.where(_brightest(spots) > 0, np.uint8(255), np.uint8(0))
    if not spot_mask.any():
        return
    maps = []
    for start, columns, rows in _bands(shape, matrix):
        near = np.empty(rows.shape, np.uint8)
        _gather(spot_mask, columns, rows, near)
        # Add one texel all around, so that rounding the positions loses no spot.
        row, column = np.nonzero(cv2.dilate(near, np.ones((3, 3), np.uint8)))
        maps.append((row + start, column, columns[row, column], rows[row, column]))
    row, column, columns, rows = (np.concatenate(parts) for parts in zip(*maps, strict=True))
    at, shares = _corners(columns, rows, shape)
    angles = solid_angles(shape)
    weights = (shares * angles[row]).ravel()
    area = np.bincount(at.ravel(), weights, shape[0] * shape[1]).reshape(shape)
    _even_runs(area, runs)
    spots *= np.divide(angles[:, None], area, out=np.zeros_like(area), where=area > 0).astype(
        np.float32
    )[..., None]
    flat = spots.reshape(-1, spots.shape[2])
    for corner, share in zip(at, shares, strict=True):
        result[row, column] += flat[corner] * share[:, None].astype(np.float32)


def _brightest(radiance: Float32) -> Float32:
    """Return the largest channel of each texel, (H, W).

    This function is several times faster than `max` over so short an axis.
    """
    largest = radiance[..., 0]
    for channel in range(1, radiance.shape[2]):
        largest = np.maximum(largest, radiance[..., channel])
    return largest


def _corners(columns: Float32, rows: Float32, shape: tuple[int, int]) -> tuple[Int64, Float64]:
    """Return the four texels around each position, (4, N), and their weights, (4, N).

    Where necessary, the texels lie across the panorama's edge or poles.
    """
    height, width = shape
    top, left = np.floor(rows).astype(np.int64), np.floor(columns).astype(np.int64)
    low, right = (rows - top).astype(np.float64), (columns - left).astype(np.float64)
    at, shares = [], []
    for down in (0, 1):
        line = top + down
        beyond = (line < 0) | (line >= height)
        line = np.clip(line, 0, height - 1)
        for across in (0, 1):
            place = (left + across + np.where(beyond, width // 2, 0)) % width
            at.append(line * width + place)
            shares.append((low if down else 1.0 - low) * (right if across else 1.0 - right))
    return np.stack(at), np.stack(shares)
