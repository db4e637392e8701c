"""Photographs of the demo location from a known place, as a phone would file them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.paths import resources
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.views import Lens
from benchmarks.heading.scripted_turn.scene_files import probe_environment
from benchmarks.heading.scripted_turn.scene_views import SceneView, SceneViews, Stand
from tests.helpers.demo_place import demo_panorama
from tests.helpers.exif_bytes import SHORT, Entry, exif, segment, tagged, text

__all__ = ["LENS", "demo_index", "photo_bytes", "stored", "taken_from", "write_photo"]

LENS = Lens(60.0, (1200, 900))
FOCAL_MM = 30
"""Of that lens, for a frame's diagonal: 60 degrees of a picture of 4 : 3."""


@cache
def _scene() -> SceneViews:
    location = resources() / "demo" / "location"
    return SceneViews(location / "views", probe_environment(location).radiance)


@cache
def taken_from(turn_deg: float, aim_deg: float = 0.0, distance_m: float = 1.5) -> SceneView:
    """Take a picture of the sitter, with the truth about it."""
    return _scene().view(Stand(turn_deg, distance_m, aim_deg), LENS)


@cache
def demo_index() -> HeadingIndex:
    """Learn the demo location's background, once."""
    return build_index(demo_panorama())


def stored(picture: NDArray[np.uint8], orientation: int) -> NDArray[np.uint8]:
    """Lay an upright picture down as a camera of an EXIF orientation stores it (by hand)."""
    ways = {
        1: lambda p: p,
        3: lambda p: np.rot90(p, 2),
        6: lambda p: np.rot90(p, 1),
        8: lambda p: np.rot90(p, -1),
        2: lambda p: p[:, ::-1],
        4: lambda p: p[::-1],
        5: lambda p: p.transpose(1, 0, 2),
        7: lambda p: np.rot90(p, 2).transpose(1, 0, 2),
    }
    return np.ascontiguousarray(ways[orientation](picture))


def photo_bytes(
    picture: NDArray[np.uint8],
    orientation: int = 1,
    focal_mm: int | None = FOCAL_MM,
    taken: bytes | None = b"2026:11:21 14:03:20",
    offset: bytes | None = b"+01:00",
    lens: bytes | None = None,
    flash: int | None = None,
) -> bytes:
    """File an upright picture as a phone does."""
    code = cv2.imencode(".jpg", stored(picture, orientation)[..., ::-1])[1].tobytes()
    camera: list[Entry] = []
    if taken is not None:
        camera.append(tagged(0x9003, text(taken)))
    if offset is not None:
        camera.append(tagged(0x9011, text(offset)))
    if focal_mm is not None:
        camera.append((0xA405, SHORT, (focal_mm,)))
    if flash is not None:
        camera.append((0x9209, SHORT, (flash,)))
    if lens is not None:
        camera.append(tagged(0xA434, text(lens)))
    data = exif(None, camera, [(0x0112, SHORT, (orientation,))])
    return code[:2] + segment(0xE1, b"Exif\0\0" + data) + code[2:]


def write_photo(path: Path, picture: NDArray[np.uint8], orientation: int = 1) -> Path:
    """Write such a file."""
    path.write_bytes(photo_bytes(picture, orientation))
    return path
