"""Dual-fisheye frames of known panoramas, made without the code that stitches them.

Two lenses 3 cm apart look at a room of 2 m to every wall that is painted with a panorama, so that
near the seam they see the same wall under different angles. Vignetting, unequal lenses, a rim that
is not sharp, stray light around it, noise, clipping and JPEG are those of cheap cameras.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import srgb_encode
from app.devices.simulated.exif import Tags, exif_segment, with_segments

Float = NDArray[np.float32]
Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Rig:
    """A camera of two lenses; angles in degrees, lengths in metres, sizes in pixels.

    Its lenses are a degree off each other, to opposite sides of what the camera calls ahead.
    """

    side: int = 1024
    field: float = 195.0
    fill: float = 0.985  # diameter of the circle, of the side
    apart: float = 0.03
    wall: float = 2.0
    tilts: tuple[tuple[float, float, float], ...] = ((-0.3, -0.35, 0.2), (-0.3, 0.35, 0.2))
    offsets: tuple[tuple[float, float], ...] = ((0.004, -0.003), (-0.005, 0.002))  # of the side
    stops: tuple[float, float] = (0.05, -0.05)
    falloff: float = 0.25  # of the light at the rim
    turns: tuple[float, float] = (0.0, 0.0)  # by how much the circles are stored clockwise
    stacked: bool = False
    swapped: bool = False
    bend: float = 0.0  # r = f (t + bend t^3)
    stray: float = 0.002
    camera: str = "Simulated 360"


def _turn(about: int, degrees: float) -> NDArray[np.float64]:
    angle = np.radians(degrees)
    first, second = [(1, 2), (2, 0), (0, 1)][about]
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = np.cos(angle)
    matrix[second, first], matrix[first, second] = np.sin(angle), -np.sin(angle)
    return matrix


def fisheyes(panorama: Float, rig: Rig) -> tuple[Float, Float]:
    """Return what the two lenses see, (h, w, 3) linear, before exposure; and the share of light."""
    halves, masks = zip(*(_lens(panorama, rig, back) for back in (False, True)), strict=True)
    order = (1, 0) if rig.swapped else (0, 1)
    axis = 0 if rig.stacked else 1
    return (
        np.concatenate([halves[k] for k in order], axis=axis),
        np.concatenate([masks[k] for k in order], axis=axis),
    )


def _lens(panorama: Float, rig: Rig, back: bool) -> tuple[Float, Float]:
    """One lens in a frame of its own: x right, y up, z ahead of the photographer's panorama."""
    side, k = rig.side, int(back)
    dx, dy = rig.offsets[k]
    cx, cy = (side - 1) / 2 + dx * side, (side - 1) / 2 + dy * side
    x, y = np.meshgrid(np.arange(side) - cx, np.arange(side) - cy)
    turn = np.radians(rig.turns[k])
    right = x * np.cos(turn) + y * np.sin(turn)
    up = -(-x * np.sin(turn) + y * np.cos(turn))
    radius = np.hypot(right, up)
    rim = rig.fill * side / 2
    edge = np.radians(rig.field / 2)
    angles = np.linspace(0.0, np.radians(130.0), 5000)
    radii = angles + rig.bend * angles**3
    theta = np.interp(radius / rim * (edge + rig.bend * edge**3), radii, angles)
    scale = np.sin(theta) / np.maximum(radius, 1e-9)
    ray = np.stack([right * scale, up * scale, np.cos(theta)], axis=-1)
    pitch, yaw, roll = rig.tilts[k]
    ray = ray @ (_turn(0, pitch) @ _turn(1, yaw) @ _turn(2, roll)).T
    if back:
        ray = ray * np.array([-1.0, 1.0, -1.0])
    eye = np.array([0.0, 0.0, -rig.apart / 2 if back else rig.apart / 2])
    # The wall of a cube around the camera that the ray meets first.
    with np.errstate(divide="ignore"):
        hit = ((np.sign(ray) * rig.wall - eye) / ray).min(axis=-1, where=ray != 0.0, initial=1e9)
    point = eye + hit[..., None] * ray
    point /= np.linalg.norm(point, axis=-1, keepdims=True)
    height, width = panorama.shape[:2]
    column = (np.arctan2(point[..., 0], point[..., 2]) / (2 * np.pi) + 0.5) * width - 0.5
    row = (0.5 - np.arcsin(np.clip(point[..., 1], -1, 1)) / np.pi) * height - 0.5
    wide = cv2.copyMakeBorder(panorama, 1, 1, 2, 2, cv2.BORDER_WRAP)
    wide[0], wide[-1] = wide[1], wide[-2]
    light = cv2.remap(
        wide, (column + 2).astype(np.float32), (row + 1).astype(np.float32), cv2.INTER_LINEAR
    )
    share = radius / rim
    fall = 1.0 - rig.falloff * (0.6 * share**2 + 0.4 * share**4)
    inside = 1.0 / (1.0 + np.exp((share - 1.0) * rim / (0.0012 * side)))
    gain = 2.0 ** rig.stops[k] * fall * inside
    return np.asarray(light * gain[..., None], np.float32), inside.astype(np.float32)


def bracket(
    folder: Path,
    panorama: Float,
    stops: Sequence[float],
    rig: Rig | None = None,
    *,
    quality: int = 95,
    seed: int = 1,
) -> list[Path]:
    """Write a bracket of JPEG files; at 0 EV the panorama's 1 saturates a frame."""
    rig = rig or Rig()
    seen, inside = fisheyes(panorama, rig)
    stray = rig.stray * float(np.minimum(panorama, 4.0).mean())
    seen += stray * (1.0 - 0.5 * inside)[..., None]
    return write(folder, seen, stops, rig.camera, quality=quality, seed=seed)


def write(
    folder: Path,
    light: Float,
    stops: Sequence[float],
    camera: str,
    *,
    quality: int = 95,
    seed: int = 1,
) -> list[Path]:
    """Expose any picture of light, 1 of which saturates a frame at 0 EV, to JPEG files."""
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for index, stop in enumerate(stops):
        exposed = light * np.float32(2.0**stop)
        noise = np.sqrt(np.minimum(exposed, 4.0) / 7500.0 + 0.0007**2)
        exposed += noise * random.standard_normal(exposed.shape, np.float32)
        codes = np.rint(srgb_encode(np.clip(exposed, 0.0, 1.0)) * 255.0).astype(np.uint8)
        ok, data = cv2.imencode(".jpg", codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
        assert ok
        tags = Tags(
            make="Simulated",
            model=camera,
            software="1",
            date_time="2026:06:21 12:00:00",
            shutter_s=2.0**stop / 64.0,
            aperture=2.0,
            iso=100.0,
            shape=(codes.shape[0], codes.shape[1]),
            panorama=False,
        )
        file = folder / f"IMG_{index:04d}.jpg"
        file.write_bytes(with_segments(data.tobytes(), [exif_segment(tags)]))
        files.append(file)
    return files
