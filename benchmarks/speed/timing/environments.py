"""Time the work on panoramas: reducing them to the search's light, turning them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.paths import resources
from app.core.environment.environment import (
    SHAPE,
    energy,
    read_environment,
    reduce_radiance,
    solid_angles,
)
from benchmarks.speed.timing.runner.rows import Case, PeerCase

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_SCENE: Final = "courtyard"
_WHOLE: Final = (1024, 2048)
_HALF: Final = (512, 1024)
_FINE: Final = (32, 512)
_TURN_DEG: Final = 40.0
_ANGLES_DEG: Final = (40.0, 12.0, -7.0)


def environment_cases(skylibs: ModuleType | None = None) -> Iterator[Case]:
    """Yield the work on panoramas.

    Yields:
        ``environment.reduce`` (2,048 x 1,024 to 64 x 32), ``environment.turn`` (the light at any
        turn, from prepared columns), ``environment.rotate`` (1,024 x 512, any rotation).
    """
    light = read_environment(resources() / "demo" / "scenes" / f"{_SCENE}.exr").radiance
    whole = np.asarray(cv2.resize(light, _WHOLE[::-1], interpolation=cv2.INTER_LINEAR), np.float32)
    yield _reduce(whole, skylibs)
    fine = reduce_radiance(whole, _FINE)
    yield Case(
        "environment.turn",
        lambda: reduce_radiance(fine, SHAPE, _TURN_DEG),
        lambda: _averaged(fine, SHAPE, _TURN_DEG),
        "per texel: mean of what lies in it",
        fine.nbytes + 12 * SHAPE[0] * SHAPE[1],
    )
    yield _rotate(light, skylibs)


def _reduce(whole: Float32, skylibs: ModuleType | None) -> Case:
    truth = energy(whole)

    def kept(result: object) -> str:
        lost = np.abs(energy(np.asarray(result, np.float32)) / truth - 1.0).max()
        return f"energy changed by {100.0 * lost:.2g} %"

    peers = [
        PeerCase(
            "OpenCV",
            lambda: cv2.resize(whole, SHAPE[::-1], interpolation=cv2.INTER_AREA),
            kept,
            rounds=20,
        )
    ]
    if skylibs is not None:
        given = whole.astype(np.float64)  # its input; made before, not timed
        place: Any = skylibs.EnvironmentMap
        peers.append(
            PeerCase(
                "skylibs",
                lambda: place(given, "latlong", copy=False).resize(SHAPE).data,
                kept,
                rounds=5,
            )
        )
    return Case(
        "environment.reduce",
        lambda: reduce_radiance(whole, SHAPE),
        lambda: _averaged(whole, SHAPE, 0.0),
        "per texel: mean by solid angle of what lies in it",
        whole.nbytes,
        most=50,
        peers=tuple(peers),
    )


def _rotate(light: Float32, skylibs: ModuleType | None) -> Case:
    whole = np.asarray(cv2.resize(light, _HALF[::-1], interpolation=cv2.INTER_AREA), np.float32)
    matrix = sphere.rotation(*_ANGLES_DEG)
    ours = np.asarray(sphere.remap_frame(whole, matrix), np.float32)
    columns, rows = sphere.positions(sphere.directions(_HALF) @ matrix.astype(np.float32), _HALF)

    def same(result: object) -> str:
        apart = np.abs(np.asarray(result, np.float32)[8:-8, 8:-8] - ours[8:-8, 8:-8])
        return f"{100.0 * np.median(apart) / np.median(ours):.2g} % from ours in the median"

    peers = []
    if skylibs is not None:
        given = whole.astype(np.float64)
        place: Any = skylibs.EnvironmentMap
        peers.append(
            PeerCase(
                "skylibs",
                lambda: place(given, "latlong", copy=False).rotate(_mirrored(matrix)).data,
                same,
            )
        )
    return Case(
        "environment.rotate",
        lambda: sphere.remap_frame(whole, matrix),
        lambda: _rotated(whole, matrix),
        "NumPy: directions, angles, four neighbours",
        lambda: cv2.remap(whole, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP),
        "OpenCV's remap by maps made before",
        most=20,
        peers=tuple(peers),
    )


def _averaged(radiance: Float32, shape: tuple[int, int], turn_deg: float) -> Float64:
    """Reduce texel by texel; turns to the nearest column."""
    rolled = np.roll(radiance, -round(turn_deg / 360.0 * radiance.shape[1]), axis=1)
    weights = solid_angles((radiance.shape[0], radiance.shape[1]))
    down, across = (given // wanted for given, wanted in zip(radiance.shape, shape, strict=False))
    result = np.empty((*shape, radiance.shape[2]))
    for row in range(shape[0]):
        share = weights[row * down : (row + 1) * down]
        for column in range(shape[1]):
            part = rolled[row * down : (row + 1) * down, column * across : (column + 1) * across]
            result[row, column] = np.average(part.mean(axis=1), axis=0, weights=share)
    return result


def _rotated(radiance: Float32, matrix: Float64) -> Float32:
    """Rotate by plain bilinear sampling, in one go."""
    height, width = radiance.shape[:2]
    before = sphere.directions((height, width)).astype(np.float64) @ matrix
    azimuth = np.arctan2(-before[..., 0], before[..., 2])
    elevation = np.arcsin(np.clip(before[..., 1], -1.0, 1.0))
    x = (azimuth / (2.0 * np.pi) + 0.5) * width - 0.5
    y = (0.5 - elevation / np.pi) * height - 0.5
    left, top = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    right, low = (x - left)[..., None], (y - top)[..., None]
    above, below = np.clip(top, 0, height - 1), np.clip(top + 1, 0, height - 1)
    here, beside = left % width, (left + 1) % width
    upper = radiance[above, here] * (1 - right) + radiance[above, beside] * right
    lower = radiance[below, here] * (1 - right) + radiance[below, beside] * right
    mixed: Float32 = (upper * (1 - low) + lower * low).astype(np.float32)
    return mixed


def _mirrored(matrix: Float64) -> Float64:
    """Convert a rotation to the axes of skylibs: x to the picture's right, z to the back.

    It expects the source of the content, so the rotation is inverted.
    """
    flip = np.diag([-1.0, 1.0, -1.0])
    turned: Float64 = flip @ matrix.T @ flip
    return turned
