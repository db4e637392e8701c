"""Where the parts of a face lie in its picture, and how light and shadow hang together there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.baking.scene import HeadMesh, Mesh, frame_head
from app.core.base.paths import resources

Floats: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Landmarks:
    """Places of the face in the picture, in pixels from its left and upper edge.

    The middle line, the height of the eyes, half the distance between them, the tip of the nose
    and the lower edge of the chin.
    """

    middle: float
    eyes: float
    half: float
    nose: float
    chin: float


@dataclass(frozen=True, slots=True)
class Look:
    """A target picture with the key lamp on the image's right, and where the face is in it.

    Attributes:
        light: (N, N) float64. Linear luminance, slightly smoothed.
        face: (N, N) bool.
    """

    light: Floats
    face: Mask
    at: Landmarks

    def box(self, left: float, right: float, top: float, bottom: float) -> Mask:
        """(N, N) face pixels in a box: half eye distances from the middle line, and from eyes."""
        rows, columns = np.indices(self.light.shape) + 0.5
        x = (columns - self.at.middle) / self.at.half
        y = (rows - self.at.eyes) / self.at.half
        inside: Mask = self.face & (x >= left) & (x < right) & (y >= top) & (y < bottom)
        return inside

    @property
    def nose(self) -> float:
        """How far the tip of the nose lies under the eyes, in half eye distances."""
        return (self.at.nose - self.at.eyes) / self.at.half

    @property
    def chin(self) -> float:
        """How far the edge of the chin lies under the eyes, in half eye distances."""
        return (self.at.chin - self.at.eyes) / self.at.half


def read_mesh(path: Path) -> Mesh:
    head, body = path.read_bytes().split(b"end_header\n", 1)
    lines = head.decode("ascii").splitlines()
    width = sum(line.startswith("property float") for line in lines)
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    table = np.frombuffer(body, "<f4", count * width).reshape(count, width)
    return Mesh(table[:, :3], table[:, 3:6], np.empty((0, 3), np.uint32))


@cache
def landmarks(head: str, size: int) -> Landmarks:
    """Find the face's places from the head's mesh, as the portrait camera sees them."""
    folder = resources() / "heads"
    skin, eyes = read_mesh(folder / f"{head}.ply"), read_mesh(folder / f"{head}-eyes.ply")
    camera = frame_head(HeadMesh(head, skin, eyes, symmetric=True), size)
    _, level, depth = camera.origin
    scale = size / (2 * np.tan(np.radians(camera.fov_deg) / 2))
    middle, axis = size / 2, size * (0.5 - camera.shift)

    def row(height: float, z: float) -> float:
        return float(axis - (height - level) * scale / (depth - z))

    left = eyes.vertices[eyes.vertices[:, 0] > 0]
    centre = (left.min(axis=0) + left.max(axis=0)) / 2
    line = skin.vertices[np.abs(skin.vertices[:, 0]) < 0.05]
    tip = line[line[:, 2].argmax()]
    # Under the chin the profile falls back to the neck.
    under = line[(line[:, 1] < tip[1] - 0.2) & (line[:, 2] > tip[2] - 0.45)]
    chin = under[under[:, 1].argmin()]
    return Landmarks(
        middle=middle,
        eyes=row(float(centre[1]), float(centre[2])),
        half=float(centre[0] * scale / (depth - centre[2])),
        nose=row(float(tip[1]), float(tip[2])),
        chin=row(float(chin[1]), float(chin[2])),
    )


def stops(bright: float, dark: float) -> float:
    return float(np.log2(bright / dark))


def middle_light(seen: Look, region: Mask) -> float:
    return float(np.median(seen.light[region]))


def extreme(light: Floats, region: Mask, *, darkest: bool) -> tuple[int, int]:
    """Row and column of the darkest or brightest pixel of a region."""
    values = np.where(region, light, np.inf if darkest else -np.inf)
    index = int(values.argmin() if darkest else values.argmax())
    return index // light.shape[1], index % light.shape[1]


def pass_light(light: Floats, start: tuple[int, int], goal: Mask) -> float:
    """Light of the darkest pixel that the brightest way from a pixel to a region must cross."""
    low, high = 0.0, float(light.max())
    for _ in range(40):
        level = (low + high) / 2
        _, labels = cv2.connectedComponents((light >= level).astype(np.uint8), connectivity=8)
        joined = labels[start] > 0 and bool((labels[goal] == labels[start]).any())
        low, high = (level, high) if joined else (low, level)
    return low


def ridge_light(
    light: Floats, allowed: Mask, start: tuple[int, int], goal: tuple[int, int]
) -> float:
    """Light of the brightest pixel that the darkest way between two pixels must cross."""
    inverse = np.where(allowed, 1 / light, 0.0)
    target = np.zeros_like(allowed)
    target[goal] = True
    return 1 / pass_light(inverse, start, target)
