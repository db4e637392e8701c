"""The rendered views of the demo location, decomposed: light, depth, sitter and background.

``views.json`` states the position of each view. Its picture is converted back to radiance with the
stated tone curve and exposure, so that views match whatever their exposure.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import srgb_decode
from app.core.base.errors import CoreError
from app.core.environment.environment import read_environment

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.environment.environment import Environment

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

EYE_M: Final = 1.6
"""Height of all cameras, of the sitter's eyes and of the probe above the floor, metres."""

SKY_M: Final = 1000.0
"""Assumed distance of the sky, metres."""

_WHITE: Final = 5.0  # linear light that the views' tone curve shows as white
_BEHIND_M: Final = 0.45  # areas further behind the sitter's middle are background
_MOST_VIEWS: Final = 1000
_LARGEST: Final = 2048  # columns or rows
_KEPT: Final = 40


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One rendered view.

    Attributes:
        turn_deg, distance_m: Turn of the sitter, deg, and distance of the camera, metres. The
            camera is level and its axis passes through the sitter.
        light: (H, W, 3) float32. Linear Rec. 709 radiance, cd/m2.
        inverse: (h, w) float32. 1 / depth along the axis, 1/m, at half the size; that of the sitter
            where the sitter is.
        sitter: (h, w) bool. Where the sitter is.
        behind: (h, w) bool. Background, away from the sitter.
        share: (H, W) float32. Share of the sitter in each pixel, 0 to 1.
        exposure: Displayed linear light per cd/m2.
        points: (N, 3) float32. Positions of the background's pixels, in the world's axes; metres.
    """

    turn_deg: float
    distance_m: float
    light: Float32 = field(repr=False)
    inverse: Float32 = field(repr=False)
    sitter: Mask = field(repr=False)
    behind: Mask = field(repr=False)
    share: Float32 = field(repr=False)
    exposure: float
    points: Float32 = field(repr=False)


class SceneFiles:
    """Reads views on demand, and caches the last ones; for one thread.

    Attributes:
        fov_deg: Horizontal field of view, deg.
        turns, distances: (N,) float64. Positions of the views: deg in [0, 360), ascending; metres,
            ascending.

    Raises:
        CoreError: If they are missing or damaged.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        try:
            table = json.loads((folder / "views.json").read_text(encoding="utf-8"))
            self.focal_px = float(table["focal_px"])
            self.fov_deg = float(table["horizontal_fov_deg"])
            self._near_m = float(table["depth"]["near_m"])
            self._size = (int(table["size"][0]), int(table["size"][1]))
            views = table["views"][:_MOST_VIEWS]
            self._exposures = {
                (float(v["turn_deg"]), float(v["distance_m"])): float(v["exposure"]) for v in views
            }
            self.turns = np.array(sorted({turn for turn, _ in self._exposures}))
            self.distances = np.array(sorted({metres for _, metres in self._exposures}))
        except (OSError, KeyError, IndexError, TypeError, ValueError) as error:
            raise damaged() from error
        whole = len(self._exposures) == len(self.turns) * len(self.distances)
        if not whole or len(self.turns) < 2 or not 2 <= max(self._size) <= _LARGEST:
            raise damaged()
        self._cache: OrderedDict[tuple[float, float], Shot] = OrderedDict()

    def exposure(self, turn_deg: float, distance_m: float) -> float:
        """Return the displayed linear light per cd/m2 of a view."""
        return self._exposures[turn_deg, distance_m]

    def shot(self, turn_deg: float, distance_m: float) -> Shot:
        """Return a view.

        Raises:
            CoreError: If its files are missing or damaged.
        """
        key = (turn_deg, distance_m)
        if key in self._cache:
            self._cache.move_to_end(key)
            return self._cache[key]
        shot = self._read(turn_deg, distance_m)
        self._cache[key] = shot
        if len(self._cache) > _KEPT:
            self._cache.popitem(last=False)
        return shot

    def _read(self, turn_deg: float, distance_m: float) -> Shot:
        stem = self._folder / f"view-{round(turn_deg):03d}-{round(distance_m * 100):03d}"
        picture = _decoded(stem.with_suffix(".webp"), cv2.IMREAD_COLOR_RGB)
        code = _decoded(stem.with_suffix(".png"), cv2.IMREAD_UNCHANGED)
        half = (self._size[0] // 2, self._size[1] // 2)
        if picture.shape[1::-1] != self._size or code.shape != half[::-1]:
            raise damaged()
        inverse = code.astype(np.float32) / np.float32(self._near_m * 65535.0)
        inverse = np.maximum(inverse, np.float32(1.0 / SKY_M))
        sitter = _in_the_middle(inverse > 1.0 / (distance_m + _BEHIND_M))
        around = cv2.dilate(sitter, np.ones((5, 5), np.uint8))
        share = cv2.resize(sitter * np.float32(1.0), self._size, interpolation=cv2.INTER_LINEAR)
        share = cv2.GaussianBlur(share, (0, 0), 1.2)
        exposure = self._exposures[turn_deg, distance_m]
        light = (_light() / np.float32(exposure))[np.asarray(picture, np.uint8)]
        behind = around == 0
        points = self._world(inverse, turn_deg, distance_m)[behind]
        return Shot(
            turn_deg,
            distance_m,
            light,
            inverse,
            sitter > 0,
            behind,
            np.asarray(share, np.float32),
            exposure,
            points,
        )

    def _world(self, inverse: Float32, turn_deg: float, distance_m: float) -> Float32:
        rows, columns = inverse.shape
        focal = self.focal_px / 2.0
        x = (np.arange(columns) + 0.5 - columns / 2.0) / focal
        y = (np.arange(rows) + 0.5 - rows / 2.0)[:, None] / focal
        rays = np.stack([*np.broadcast_arrays(x, y), np.ones_like(inverse)], axis=2)
        position, rotation = level_pose(turn_deg, distance_m)
        return np.asarray(rays / inverse[..., None] @ rotation + position, np.float32)


def probe_environment(location: Path) -> Environment:
    """Read the probe's panorama at the position of the views' sitter.

    Returns:
        In cd/m2.

    Raises:
        CoreError: If files are missing or damaged.
    """
    try:
        spot = json.loads((location / "location.json").read_text(encoding="utf-8"))["spots"][0]
        file, unit = str(spot["file"]), np.float32(spot["cd_per_m2_of_one"])
    except (OSError, KeyError, IndexError, TypeError, ValueError) as error:
        raise damaged() from error
    seen = read_environment(location / file)
    return replace(seen, radiance=seen.radiance * unit)


def level_pose(turn_deg: float, distance_m: float) -> tuple[Float64, Float64]:
    """Return the pose of a camera in front of the sitter.

    Args:
        turn_deg, distance_m: Turn of the sitter, deg, and distance of the camera, metres.

    Returns:
        position: (3,) float64. World, metres: +Y up, the origin on the floor under the sitter's
            head.
        rotation: (3, 3) float64. From the world's axes to the camera's: right, down, front.
    """
    sine, cosine = math.sin(math.radians(turn_deg)), math.cos(math.radians(turn_deg))
    position = np.array([-sine * distance_m, EYE_M, cosine * distance_m])
    rotation = np.array([[cosine, 0.0, sine], [0.0, -1.0, 0.0], [sine, 0.0, -cosine]])
    return position, rotation


def _decoded(path: Path, how: int) -> NDArray[np.integer]:
    try:
        picture = cv2.imdecode(np.fromfile(path, np.uint8), how)
    except (OSError, cv2.error) as error:
        raise damaged() from error
    if picture is None:
        raise damaged()
    return np.asarray(picture)


def _light() -> Float32:
    """Return the linear light of each byte, with the tone curve inverted, (256,) float32.

    x = L (1 + L / W^2) / (1 + L), the extended curve of Reinhard et al. 2002, eq. 4.
    """
    x = srgb_decode(np.arange(256) / 255.0).astype(np.float64)
    square = _WHITE**2
    root = np.sqrt((1.0 - x) ** 2 + 4.0 * x / square)
    return np.asarray(0.5 * square * (root - (1.0 - x)), np.float32)


def shown(light: Float32) -> Float32:
    """Apply the views' tone curve.

    Args:
        light: float32. Linear; 1 is a middle grey's neighbourhood, 5 white.

    Returns:
        Same shape, float32. Linear display light in [0, 1].
    """
    tone = light * (1.0 + light * np.float32(1.0 / _WHITE**2)) / (1.0 + light)
    return np.asarray(np.minimum(tone, np.float32(1.0)), np.float32)


def _in_the_middle(near: Mask) -> Bytes:
    """Keep the part connected to the middle; 1 there."""
    _, labels = cv2.connectedComponents(near.astype(np.uint8))
    middle = int(labels[labels.shape[0] // 2, labels.shape[1] // 2])
    if middle == 0:
        raise damaged()
    return np.asarray(labels == middle, np.uint8)


def damaged() -> CoreError:
    """Return the error for damaged files."""
    return CoreError(
        "The pictures of the demo location are missing or damaged.", "Reinstall Turnlight."
    )
