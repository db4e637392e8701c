"""Views of the panorama: perspective views, the goal, the background and a strip.

A view requires the panorama position of each of its pixels. Turning a level or tilted camera about
the vertical axis only moves these positions sideways. They are therefore computed once for each
lens and pitch, and each further azimuth costs one addition and one look-up. Panoramas that are
finer than the view are sampled several times per pixel and averaged, so that nothing flickers
during a turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, TypeVar

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float32, Float64
from app.core.guidance.who_moves import Mode
from app.core.localization.heading_conversion import (
    BACKGROUND_M,
    CAMERA_M,
    Looks,
    background_azimuth,
    heading_of_turn,
    sees_sitter,
    widened_fov,
)

Picture = TypeVar("Picture", Bytes, Float32)

BACKGROUND_SIZE: Final = (128, 136)
"""Number of columns and rows of the background beside a style."""

BACKGROUND_TALL_DEG: Final = 45.0
"""Vertical field of view of the background beside a style, in degrees, whatever its width."""

_MOST_SAMPLES: Final = 4  # in each direction of a pixel


@dataclass(frozen=True, slots=True)
class Lens:
    """An ideal camera with square pixels, whose axis passes through the centre of the picture.

    Attributes:
        fov_deg: Horizontal field of view, in degrees within (0, 180).
        size: Number of columns and rows of the picture.
    """

    fov_deg: float
    size: tuple[int, int]

    @property
    def focal_px(self) -> float:
        """Focal length in pixels."""
        return 0.5 * self.size[0] / math.tan(math.radians(self.fov_deg) / 2.0)


def bearings(lens: Lens, azimuth_deg: float, pitch_deg: float, pixels: Float64) -> Float64:
    """Return the directions of pixels in a view.

    Args:
        azimuth_deg, pitch_deg: Panorama azimuth and elevation of the axis, in degrees.
        pixels: (N, 2) float64. Columns and rows. The centre of the first pixel is at (0.5, 0.5).

    Returns:
        (N, 3) float64. Unit vectors in the panorama's coordinate system (see
        `app.core.base.sphere`).
    """
    x = (pixels[:, 0] - lens.size[0] / 2.0) / lens.focal_px
    y = (lens.size[1] / 2.0 - pixels[:, 1]) / lens.focal_px
    pitch, azimuth = math.radians(pitch_deg), math.radians(azimuth_deg)
    front = math.cos(pitch) - y * math.sin(pitch)
    up = y * math.cos(pitch) + math.sin(pitch)
    east = x * math.cos(azimuth) + front * math.sin(azimuth)  # towards azimuth 90
    north = front * math.cos(azimuth) - x * math.sin(azimuth)
    rays = np.stack([-east, up, north], axis=1)
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def look(panorama: Picture, azimuth_deg: float, lens: Lens, pitch_deg: float = 0.0) -> Picture:
    """Render a perspective view of a panorama.

    Args:
        panorama: (H, W), or (H, W, C) uint8 or float32. Equirectangular, 2:1, in any colour space.
            Averages are exact for linear light, and nearly exact for display values.
        azimuth_deg: Azimuth of the axis, in degrees.
        pitch_deg: Elevation of the axis, in degrees within [-90, 90].

    Returns:
        The view, (rows, columns) or (rows, columns, C), in the type and the colour space of the
        panorama.
    """
    fine = 2.0 * math.pi * lens.focal_px / panorama.shape[1]  # view pixels per texel in the middle
    samples = min(max(round(0.8 / fine), 1), _MOST_SAMPLES)
    columns, rows = lens.size
    dense = Lens(lens.fov_deg, (columns * samples, rows * samples))
    shape = (panorama.shape[0], panorama.shape[1])
    return _resample(panorama, azimuth_deg, _places(shape, dense, pitch_deg), lens.size)


def strip_view(
    panorama: Picture, azimuth_deg: float, size: tuple[int, int], wide_deg: float
) -> Picture:
    """Cut a strip from a panorama, with evenly spaced azimuths and upright verticals.

    Rows are spaced as on a cylinder, so that objects in the middle keep their proportions.

    Args:
        panorama: (H, W), or (H, W, C) uint8 or float32. Equirectangular, 2:1.
        azimuth_deg: Azimuth of the centre of the strip, in degrees.
        size: Number of columns and rows of the strip.
        wide_deg: Width of the strip, in degrees, at most 360.

    Returns:
        The strip, (rows, columns) or (rows, columns, C), in the panorama's type.
    """
    fine = 360.0 / wide_deg * size[0] / panorama.shape[1]
    samples = min(max(round(0.8 / fine), 1), _MOST_SAMPLES)
    dense = (size[0] * samples, size[1] * samples)
    shape = (panorama.shape[0], panorama.shape[1])
    return _resample(panorama, azimuth_deg, _strip_places(shape, dense, wide_deg), size)


def goal_lens(
    lens: Lens,
    *,
    camera_m: float = CAMERA_M,
    background_m: float = BACKGROUND_M,
    looks: Looks = Looks.SITTER,
    mode: Mode = Mode.WALK,
) -> Lens:
    """Return the lens that reproduces the camera's view from the position of the probe."""
    wide = widened_fov(
        lens.fov_deg, camera_m, background_m, sees_the_sitter=sees_sitter(looks, mode)
    )
    return Lens(wide, lens.size)


def goal_view(
    panorama: Picture,
    goal_deg: float,
    lens: Lens,
    *,
    camera_m: float = CAMERA_M,
    background_m: float = BACKGROUND_M,
    looks: Looks = Looks.SITTER,
    mode: Mode = Mode.WALK,
    front_deg: float = 0.0,
) -> Picture:
    """Render the goal view, without the sitter.

    The camera looks straight at the sitter, at eye height, from a distance of `camera_m`. The view
    is exact for a background `background_m` behind the sitter. Nearer objects look slightly too
    large, and farther ones too small. The azimuth behind the sitter is exact at any distance.

    Args:
        panorama: (H, W, C) uint8 or float32. Equirectangular, 2:1. The view is sharp if the
            panorama has at least 360 / fov times as many columns as the view.
        goal_deg: Turn to reach, in degrees.
        front_deg: Panorama azimuth of the photographer at turn 0, in degrees.

    Returns:
        The view, (rows, columns, C), in the panorama's type, not mirrored.
    """
    wide = goal_lens(lens, camera_m=camera_m, background_m=background_m, looks=looks, mode=mode)
    azimuth = heading_of_turn(goal_deg, looks=looks, mode=mode, front_deg=front_deg)
    return look(panorama, azimuth, wide)


def background_view(
    panorama: Picture,
    turn_deg: float,
    size: tuple[int, int] = BACKGROUND_SIZE,
    front_deg: float = 0.0,
) -> Picture:
    """Render the background behind the sitter at a turn.

    Args:
        panorama: (H, W, C) uint8 or float32. Equirectangular, 2:1.
        turn_deg: Turn, in degrees, positive clockwise.
        size: Number of columns and rows of the view: 128 x 136 beside the panorama, or 272 x 136 on
            its own tab. A wider view shows more at the same scale.
        front_deg: Panorama azimuth of the photographer at turn 0, in degrees.

    Returns:
        The background, (rows, columns, C), in the panorama's type, `BACKGROUND_TALL_DEG` degrees
        high.
    """
    half = math.tan(math.radians(BACKGROUND_TALL_DEG) / 2.0) * size[0] / size[1]
    lens = Lens(2.0 * math.degrees(math.atan(half)), size)
    return look(panorama, background_azimuth(turn_deg, front_deg), lens)


def _resample(
    panorama: Picture, azimuth_deg: float, places: tuple[Float32, Float32], size: tuple[int, int]
) -> Picture:
    columns, rows = places
    shifted = columns + np.float32(azimuth_deg % 360.0 * panorama.shape[1] / 360.0)
    view = cv2.remap(panorama, shifted, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    if (view.shape[1], view.shape[0]) != size:
        view = cv2.resize(view, size, interpolation=cv2.INTER_AREA)
    return np.asarray(view, panorama.dtype)


@lru_cache(maxsize=8)
def _places(shape: tuple[int, int], lens: Lens, pitch_deg: float) -> tuple[Float32, Float32]:
    """Return the positions of a view's pixels in a panorama, for an axis at azimuth 0."""
    columns, rows = lens.size
    pitch = math.radians(pitch_deg)
    x = ((np.arange(columns) + 0.5 - columns / 2.0) / lens.focal_px).astype(np.float32)
    y = ((rows / 2.0 - np.arange(rows) - 0.5) / lens.focal_px).astype(np.float32)[:, None]
    front = np.float32(math.cos(pitch)) - y * np.float32(math.sin(pitch))
    up = y * np.float32(math.cos(pitch)) + np.float32(math.sin(pitch))
    azimuth = np.arctan2(x, front)
    elevation = np.arctan2(up, np.hypot(x, front))
    return _texels(shape, azimuth, elevation)


@lru_cache(maxsize=6)
def _strip_places(
    shape: tuple[int, int], size: tuple[int, int], wide_deg: float
) -> tuple[Float32, Float32]:
    columns, rows = size
    radian = columns / math.radians(wide_deg)  # pixels
    azimuth = ((np.arange(columns) + 0.5 - columns / 2.0) / radian).astype(np.float32)
    elevation = np.arctan((rows / 2.0 - np.arange(rows) - 0.5) / radian).astype(np.float32)
    grid = np.broadcast_arrays(azimuth, elevation[:, None])
    return _texels(shape, grid[0], grid[1])


def _texels(
    shape: tuple[int, int], azimuth: Float32, elevation: Float32
) -> tuple[Float32, Float32]:
    """Return panorama positions for directions. Only columns may be outside the panorama."""
    height, width = shape
    columns = azimuth * np.float32(width / (2.0 * math.pi)) + np.float32(width / 2.0 - 0.5)
    rows = np.float32(height / 2.0 - 0.5) - elevation * np.float32(height / math.pi)
    np.clip(rows, 0.0, height - 1.0, out=rows)
    columns.setflags(write=False)
    rows.setflags(write=False)
    return columns, rows
