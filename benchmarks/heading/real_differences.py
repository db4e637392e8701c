"""Measure the heading on real views that differ from the panorama.

    python -m benchmarks.heading.real_differences [FOLDER ...] [-o FILE.json] [--page heading.md]

The views that look at the sitter (`benchmarks.heading.real_views`), one picture each, with the
sitter found and the lens known. Each row changes one thing: exposure, white balance, sun and
shadows, blur, people or cars in front, a moving camera with a slow sensor, or the lens. A mirrored
picture is searched as a photo, since a live camera is not mirrored.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import difference
from app.core.localization.heading import find_heading
from app.core.localization.photo_location import search_photo
from app.core.localization.picture_file import PictureFile
from app.core.localization.views import Lens
from benchmarks.heading.real_views import (
    LENS,
    View,
    index_of,
    result_row,
    run,
    views,
    with_sitter,
)

Bytes: TypeAlias = NDArray[np.uint8]
Change: TypeAlias = Callable[[Bytes, np.random.Generator], Bytes]

MARKS: Final = ("<!-- table: real_differences.py -->", "<!-- end of real_differences.py -->")
PORTRAIT: Final = Lens(50.2, (480, 640))  # 64 degrees along the longer side
WIDE: Final = Lens(100.0, (640, 480))
_GAMMA: Final = 2.2
_NOISE: Final = 3.0
_HIDDEN: Final = 0.15
_SHADE: Final = 0.3  # light in a shadow over that in the sun
_SHADED: Final = 0.4
_READOUT_DEG: Final = 1.0  # turn of the camera between the first row and the last


def _exposed(gains: tuple[float, float, float]) -> Change:
    def change(picture: Bytes, chance: np.random.Generator) -> Bytes:
        light = (picture / 255.0) ** _GAMMA * np.array(gains)
        values = 255.0 * np.minimum(light, 1.0) ** (1.0 / _GAMMA)
        return _byte(values + chance.normal(0.0, _NOISE, picture.shape))

    return change


def _other_sun(picture: Bytes, chance: np.random.Generator) -> Bytes:
    """Cast shadows of other shapes over the picture, and warm the light in the sun."""
    rows, columns = picture.shape[:2]
    blobs = chance.normal(0.0, 1.0, (5, 7)).astype(np.float32)
    field = cv2.resize(blobs, (columns, rows), interpolation=cv2.INTER_CUBIC)
    sun = 1.0 / (1.0 + np.exp(-(field - np.quantile(field, _SHADED)) * 25.0))
    tint = np.array([1.15, 1.0, 0.8]) * sun[..., None] + _SHADE * (1.0 - sun[..., None])
    return _byte(255.0 * np.minimum((picture / 255.0) ** _GAMMA * tint, 1.0) ** (1.0 / _GAMMA))


def _blurred(picture: Bytes, chance: np.random.Generator) -> Bytes:
    angle = chance.uniform(0.0, math.pi)
    kernel = np.zeros((11, 11), np.float32)
    for step in np.linspace(-4.0, 4.0, 33):
        kernel[round(5 + step * math.sin(angle)), round(5 + step * math.cos(angle))] += 1.0
    return np.asarray(cv2.filter2D(picture, -1, kernel / kernel.sum()), np.uint8)


def _hidden(picture: Bytes, chance: np.random.Generator) -> Bytes:
    """Put people and cars in front, as ellipses with a texture, over 15% of the picture."""
    rows, columns = picture.shape[:2]
    cover = np.zeros((rows, columns), np.uint8)
    while float(cover.mean()) < _HIDDEN:
        middle = (int(chance.integers(columns)), int(chance.uniform(0.4, 0.9) * rows))
        axes = (int(chance.integers(20, 70)), int(chance.integers(30, 110)))
        cv2.ellipse(cover, middle, axes, 0.0, 0.0, 360.0, 1, -1)
    cloth = chance.integers(0, 255, (rows // 16, columns // 16, 3)).astype(np.uint8)
    texture = cv2.resize(cloth, (columns, rows), interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.where(cover[..., None] > 0, texture, picture), np.uint8)


def _rolling(picture: Bytes, chance: np.random.Generator) -> Bytes:
    rows, columns = picture.shape[:2]
    shift = LENS.focal_px * math.radians(_READOUT_DEG) / rows * chance.choice([-1.0, 1.0])
    skew = np.array([[1.0, shift, -shift * rows / 2.0], [0.0, 1.0, 0.0]])
    moved = cv2.warpAffine(picture, skew, (columns, rows), borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, np.uint8)


def _byte(values: NDArray[np.floating[Any]]) -> Bytes:
    return np.asarray(np.clip(values, 0.0, 255.0), np.uint8)


def _same(picture: Bytes, _: np.random.Generator) -> Bytes:
    return picture


CHANGES: Final[dict[str, tuple[Lens, Change]]] = {
    "nothing": (LENS, _same),
    "2 stops darker": (LENS, _exposed((0.25, 0.25, 0.25))),
    "2 stops brighter, clipped": (LENS, _exposed((4.0, 4.0, 4.0))),
    "white balance": (LENS, _exposed((1.4, 1.0, 0.55))),
    "sun and shadows": (LENS, _other_sun),
    "blur of 8 pixels": (LENS, _blurred),
    "15% hidden": (LENS, _hidden),
    "rolling shutter": (LENS, _rolling),
    "portrait format": (PORTRAIT, _same),
    "ultrawide, 100°": (WIDE, _same),
}


def errors(folder: Path, lens: Lens, change: Change) -> list[float | None]:
    """Return the errors of the headings in degrees, or None for each view that is refused."""
    chance, result = np.random.default_rng(5), []
    for view in views(folder, lens):
        if view.looks != "toward":
            continue
        picture, mask = with_sitter(view, chance)
        angle = view.other_deg + chance.normal(0.0, 0.7)
        found = find_heading(
            change(picture, chance),
            index_of(view.panorama),
            lens.fov_deg,
            sitter_deg=angle,
            mask=mask,
        )
        result.append(_error(view, found.heading_deg))
    return result


def mirrored_errors(folder: Path) -> list[float | None]:
    """Return the errors of `errors` for mirrored photos."""
    result = []
    for view in views(folder):
        if view.looks == "toward":
            flipped = np.asarray(cv2.flip(view.picture, 1), np.uint8)
            photo = PictureFile(flipped, LENS.size)
            search = search_photo(photo, index_of(view.panorama), LENS.fov_deg)
            result.append(_error(view, search.heading.heading_deg))
    return result


def _error(view: View, heading_deg: float | None) -> float | None:
    return None if heading_deg is None else abs(difference(heading_deg, view.heading_deg))


def measured(folders: list[Path]) -> dict[str, Any]:
    """Return the rows of the table, by what differs."""
    rows = {}
    for name, (lens, change) in CHANGES.items():
        rows[name] = result_row([e for folder in folders for e in errors(folder, lens, change)])
    mirrored = [error for folder in folders for error in mirrored_errors(folder)]
    return {**rows, "mirrored, as a photo": result_row(mirrored)}


if __name__ == "__main__":
    run(measured, "what differs", MARKS, __doc__.splitlines()[0])
