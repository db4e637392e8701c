"""The scene of a portrait at full size for stock Mitsuba: camera, head with its details, place."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mitsuba as mi  # noqa: TID253 - a module that only a rendering process imports
import numpy as np
from numpy.typing import NDArray

from app.core.baking.scene import Camera, HeadMesh, sensor
from benchmarks.truth.stock import FINE, generic_head
from scenes.head_detail.colours import eye_albedo
from scenes.head_detail.scene import mitsuba_shapes
from scenes.portraits.scene import SHAPE, Frame, portrait_frame

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Crop:
    """A part of the portrait's picture: first row and column, height and width."""

    row: int = 0
    column: int = 0
    height: int = SHAPE[0]
    width: int = SHAPE[1]


def framed_head() -> tuple[HeadMesh, Frame, Camera]:
    """Return the generic head, the frame of its portrait, and the same camera for Mitsuba."""
    head, _ = generic_head()
    assert head.eyes is not None
    assert head.eyes.colours is not None
    white = eye_albedo("generic", head.eyes.vertices.astype(np.float64))
    colours = np.asarray(head.eyes.colours * white, np.float32)
    head = replace(head, eyes=replace(head.eyes, colours=colours))
    frame, _ = portrait_frame(head)
    extent = SHAPE[0] * frame.step
    middle = frame.top - extent / 2
    fov = math.degrees(2 * math.atan(extent / 2))
    return head, frame, Camera(frame.origin, fov, -middle / extent, SHAPE[0])


def cropped(camera: Camera, crop: Crop) -> dict[str, Any]:
    """Return the portrait's camera for a part of its picture."""
    found = sensor(camera)
    found["film"] |= {
        "crop_offset_x": crop.column,
        "crop_offset_y": crop.row,
        "crop_width": crop.width,
        "crop_height": crop.height,
    }
    return {**found, "sampler": {"type": "independent", "sample_count": 16}}


def details(folder: Path, hair: str = "hair-short") -> dict[str, Any]:
    """Return hair, brows, lashes and collar of the generic head."""
    folder.mkdir(parents=True, exist_ok=True)
    return mitsuba_shapes("generic", hair, folder=folder)


def surroundings(panorama: Float32, turn_deg: float, fine: tuple[int, int] = FINE) -> Float32:
    """Return a place as seen by a sitter facing `turn_deg`, fine enough for Mitsuba's rows.

    Mitsuba places row i at i / (H - 1) of the height; see `benchmarks.truth.stock.FINE`.
    """
    rows, columns = fine
    large = panorama.repeat(rows // panorama.shape[0], 0).repeat(columns // panorama.shape[1], 1)
    return np.ascontiguousarray(np.roll(large, -round(turn_deg / 360 * columns), axis=1))


def environment(panorama: Float32, turn_deg: float, fine: tuple[int, int] = FINE) -> dict[str, Any]:
    """Return the place as a light of a scene."""
    return {"type": "envmap", "bitmap": mi.Bitmap(surroundings(panorama, turn_deg, fine))}
