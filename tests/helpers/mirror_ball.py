"""Pictures of a mirror ball by ray tracing in plain numpy, and brackets of them as files.

Written apart from the unwrapping: a ray from the camera meets the sphere (a quadratic equation) and
is reflected there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import srgb_encode
from tests.helpers.exif_bytes import SHORT, camera_tags, exif, segment, tagged

Float32 = NDArray[np.float32]
DIAGONAL_MM = math.hypot(24.0, 36.0)
_WELL = 8000.0  # electrons at saturation
_READ = 0.0007
_BAND = 128  # rows


LAMPS = ((60.0, 20.0), (-100.0, -15.0), (130.0, 40.0), (-35.0, 55.0))
COLOURS = ((1.0, 0.1, 0.1), (0.1, 1.0, 0.1), (0.1, 0.1, 1.0), (1.0, 1.0, 0.1))


@lru_cache
def place() -> Float32:
    """Patches of all levels, and four lamps of 6 degrees, each of its own colour: (256, 512, 3)."""
    random = np.random.default_rng(3)
    patches = np.exp2(random.uniform(-4.0, 1.0, (16, 32, 3))).astype(np.float32)
    made = np.repeat(np.repeat(patches, 16, axis=0), 16, axis=1)
    azimuth = np.radians(360.0 * ((np.arange(512) + 0.5) / 512 - 0.5))
    elevation = np.radians(90.0 - 180.0 * (np.arange(256) + 0.5) / 256)[:, None]
    for lamp, colour in zip(LAMPS, COLOURS, strict=True):
        at, up = np.radians(lamp)
        near = np.sin(elevation) * np.sin(up) + np.cos(elevation) * np.cos(up) * np.cos(
            azimuth - at
        )
        made[near > math.cos(math.radians(3.0))] = 60.0 * np.array(colour)
    made.flags.writeable = False
    return made


def traced(
    panorama: Float32,
    size: tuple[int, int],
    mm: float,
    *,
    balls: Sequence[tuple[float, float, float]] = ((0.0, 0.0, 0.0),),
    pitch_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    reflectance: float | tuple[float, float, float] = 0.66,
    samples: int = 3,
    far_m: float = 1e6,
    dirt: tuple[float, float, float] | None = None,
) -> Float32:
    """What a camera 1.5 m away sees of balls of 12 cm before a panorama: (rows, columns, 3).

    `balls` are metres to the right of, above and behind the place that the camera is level with;
    the camera stands at `azimuth_deg` and looks up by `pitch_deg`. The panorama is on a sphere of
    `far_m` around the ball's place. `dirt` is the colour of matt specks of 1 to 3 mm that cover a
    twentieth of the ball.
    """
    rows, columns = size
    focal = mm * math.hypot(rows, columns) / DIAGONAL_MM
    pitch, turn = math.radians(pitch_deg), math.radians(azimuth_deg)
    total = np.zeros((rows, columns, 3), np.float64)
    # In bands: a few hundred bytes are in use for each pixel that is traced.
    bands = [np.arange(rows)[top : top + _BAND] for top in range(0, rows, _BAND)]
    for number, band in product(range(samples**2), bands):
        here = total[band[0] : band[-1] + 1]
        dy, dx = (np.array(divmod(number, samples)) + 0.5) / samples
        x, y = np.meshgrid((np.arange(columns) + dx - columns / 2) / focal,
                           (rows / 2 - band - dy) / focal)  # fmt: skip
        ray = np.stack(
            [x, y * math.cos(pitch) + math.sin(pitch), y * math.sin(pitch) - math.cos(pitch)], -1
        )
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        share, start = np.ones_like(ray), np.zeros_like(ray)
        for right, up, behind in balls:
            middle = np.array([right, up, -1.5 - behind])
            along = ray @ middle
            inside = along**2 - (middle @ middle - 0.06**2)
            hit = (inside > 0) & (share[..., 0] == 1.0)
            distance = along[hit] - np.sqrt(inside[hit])
            start[hit] = ray[hit] * distance[:, None]
            normal = (start[hit] - middle) / 0.06
            ray[hit] -= 2 * (ray[hit] * normal).sum(-1, keepdims=True) * normal
            share[hit] = reflectance
            if dirt is not None:
                dirty = np.flatnonzero(hit)[_dirty(normal)]
                here.reshape(-1, 3)[dirty] += dirt * _matt(panorama, normal[_dirty(normal)])
                share.reshape(-1, 3)[dirty] = 0.0
        start -= (0.0, 0.0, -1.5)
        along = (start * ray).sum(-1, keepdims=True)
        inside = along**2 - (start**2).sum(-1, keepdims=True) + far_m**2
        ray = (start + (np.sqrt(inside) - along) * ray) / far_m
        height, width = panorama.shape[:2]
        azimuth = np.arctan2(-ray[..., 0], ray[..., 2]) + turn
        column = np.floor((azimuth / (2 * np.pi) + 0.5) * width).astype(int) % width
        row = np.floor(np.arccos(np.clip(ray[..., 1], -1, 1)) / np.pi * height).astype(int)
        here += share * panorama[np.minimum(row, height - 1), column]
    return (total / samples**2).astype(np.float32)


def _dirty(normals: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points of a ball have a speck on them, (N,)."""
    random = np.random.default_rng(5)
    middles = random.standard_normal((600, 3))
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    near = np.cos(random.uniform(0.5, 1.5, 600) / 60.0)
    return np.asarray((normals @ middles.T > near).any(axis=1))


def _matt(panorama: Float32, normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """What white matt specks show in the light of a panorama, (N, 3)."""
    size = (64, 32)
    small = cv2.resize(panorama, size, interpolation=cv2.INTER_AREA).reshape(-1, 3)
    down = (np.arange(size[1]) + 0.5) * np.pi / size[1]
    around = (np.arange(size[0]) + 0.5) * 2 * np.pi / size[0] - np.pi
    up, flat = np.cos(down)[:, None], np.sin(down)[:, None]
    ways = np.stack([-flat * np.sin(around), up + 0 * around, flat * np.cos(around)], -1)
    areas = (flat + 0 * around).reshape(-1, 1) * 2 * np.pi**2 / (size[0] * size[1])
    return np.asarray(np.maximum(normals @ ways.reshape(-1, 3).T, 0) @ (areas * small) / np.pi)


def write_bracket(
    folder: Path,
    light: Float32,
    *,
    mm: int | None = 85,
    stops: Sequence[float] = (2.0, 0.0, -2.0, -4.0, -6.0),
    shutter_s: float = 1 / 125,
    iso: int = 100,
    seed: int = 1,
) -> list[Path]:
    """Frames of 8 bits with noise, the sRGB curve, JPEG and EXIF; 1 saturates that of 0 stops."""
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for number, stop in enumerate(stops):
        exposed = np.minimum(light * 2.0**stop, 4.0).astype(np.float32)
        noise = np.sqrt(exposed / _WELL + _READ**2)
        exposed += noise * random.standard_normal(exposed.shape, np.float32)
        codes = np.rint(255 * srgb_encode(np.clip(exposed, 0.0, 1.0))).astype(np.uint8)
        done, data = cv2.imencode(".jpg", codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
        assert done
        tags = camera_tags((round(1e6 * shutter_s * 2.0**stop), 1_000_000), iso, (80, 10))
        if mm is not None:
            tags.append(tagged(0xA405, (0, SHORT, (mm,))))
        path = folder / f"ball-{number}.jpg"
        plain = data.tobytes()
        path.write_bytes(plain[:2] + segment(0xE1, b"Exif\0\0" + exif(None, tags)) + plain[2:])
        paths.append(path)
    return paths
