"""A first, rough answer from the camera's thumbnails, before the pictures themselves are there.

Thumbnails are means of coded values, sharpened and compressed hard: small lamps come out far too
dim. That is good enough to say roughly where the light comes from, and for nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from app.core.base.colour import srgb_decode
from app.core.base.errors import EnvironmentFileError, ProbeError
from app.core.base.progress import Token
from app.core.hdr.decoding import decode
from app.core.hdr.dual_fisheye import find_circles
from app.core.hdr.metadata import read_header
from app.core.solver.environment import from_radiance, solid_angles

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.core.base.arrays import Bytes, Float32
    from app.core.hdr.frame import Exposure
    from app.core.solver.environment import Environment

_LEAST_WIDTH: Final = 128
_MOST_WIDTH: Final = 2048
_LEAST_FRAMES: Final = 2
_LEAST_STOPS: Final = 1.0
# Means over a block that is partly clipped are too dark well below the highest code.
_CLIPPED_CODE: Final = 240
_DARK_CODE: Final = 8
_MOST_CLIPPED: Final = 0.25
_MOST_DARK: Final = 0.9
_STEP_TOLERANCE: Final = 1.0  # stops; only equal or swapped exposures are further off
_FEWEST_PLACES: Final = 100


@dataclass(frozen=True, slots=True)
class Rough:
    """Light as thumbnails tell it. To be replaced as soon as there is a merge.

    `radiance`, (h, 2 h, 3) float32, is linear Rec. 709, relative, its mean 1. `clipped_share`
    of the sphere is clipped even in the darkest thumbnail, 0 to 1.
    """

    radiance: Float32 = field(repr=False)
    frames: int
    clipped_share: float

    def environment(self, name: str) -> Environment:
        """Return it as an environment that can be solved, called rough in its name."""
        return from_radiance(self.radiance.copy(), f"{name} (rough)")


def rough_environment(
    thumbnails: Sequence[Path | None], exposures: Sequence[Exposure | None]
) -> Rough | None:
    """Make a rough environment of thumbnails and their planned exposures, None where not known.

    Thumbnails are small sRGB panoramas (320 x 160). Returns None where they do not carry
    enough: fewer than two that can be read, narrower than 128 pixels, exposures unknown or less
    than a stop apart or not those of the pictures, more than a quarter of the sphere clipped in
    all or nearly everything black in all.
    """
    pairs = zip(thumbnails, exposures, strict=True)
    known = [(path, exposure) for path, exposure in pairs if path and exposure]
    read = [(_picture(path), exposure.ev) for path, exposure in known]
    frames = sorted(((codes, ev) for codes, ev in read if codes is not None), key=_by_exposure)
    if len(frames) < _LEAST_FRAMES or frames[0][1] - frames[-1][1] < _LEAST_STOPS:
        return None
    rows = min(codes.shape[0] for codes, _ in frames)
    pictures = [_shrunk(codes, rows) for codes, _ in frames]
    stops = [ev for _, ev in frames]
    if not _steps_fit(pictures, stops):
        return None
    return _merged(pictures, stops)


def _by_exposure(frame: tuple[Any, float]) -> float:
    return -frame[1]


def _picture(path: Path) -> Bytes | None:
    """Codes of a small panorama, None for everything else, unstitched ones among it."""
    try:
        frame = read_header(path).frame
        height, width = frame.shape
        panorama = width == 2 * height and _LEAST_WIDTH <= width <= _MOST_WIDTH
        if not panorama or frame.kind != "uint8":
            return None
        codes = np.asarray(decode(frame, Token()), np.uint8)
        return None if find_circles(codes) is not None else codes
    except ProbeError:
        return None


def _shrunk(codes: Bytes, rows: int) -> Bytes:
    if codes.shape[0] == rows:
        return codes
    size = (2 * rows, rows)
    return np.asarray(cv2.resize(codes, size, interpolation=cv2.INTER_AREA), np.uint8)


def _steps_fit(pictures: Sequence[Bytes], stops: Sequence[float]) -> bool:
    """Whether neighbouring pictures differ about as much as their exposures, where both see."""
    for index in range(len(pictures) - 1):
        bright, dark = pictures[index][..., 1], pictures[index + 1][..., 1]
        both = (bright < _CLIPPED_CODE) & (dark > _DARK_CODE)
        if np.count_nonzero(both) < _FEWEST_PLACES:
            continue
        ratio = np.median(srgb_decode(bright[both] / 255.0) / srgb_decode(dark[both] / 255.0))
        if abs(np.log2(ratio) - (stops[index] - stops[index + 1])) > _STEP_TOLERANCE:
            return False
    return True


def _merged(pictures: Sequence[Bytes], stops: Sequence[float]) -> Rough | None:
    """Mean of what the pictures say, each weighed by how well it sees a place."""
    rows, columns = pictures[0].shape[:2]
    total, weight = np.zeros((rows, columns, 3)), np.zeros((rows, columns))
    for index, codes in enumerate(pictures):
        largest = codes.max(axis=-1).astype(np.float64)
        # Brighter frames are less noisy; where they near the clip the darker ones take over.
        seen = np.clip((_CLIPPED_CODE - largest) / 40.0, 0.0, 1.0) * largest
        if index == len(pictures) - 1:
            seen = np.maximum(seen, 1e-3)  # where all are clipped: the lower bound
        total += seen[..., None] * srgb_decode(codes / 255.0) * 2.0 ** -stops[index]
        weight += seen
    areas = solid_angles((rows, columns))[:, None] / (4.0 * np.pi)
    clipped = float((areas * (pictures[-1].max(axis=-1) >= _CLIPPED_CODE)).sum())
    dark = float((areas * (pictures[0].max(axis=-1) <= _DARK_CODE)).sum())
    if clipped > _MOST_CLIPPED or dark > _MOST_DARK:
        return None
    radiance = total / weight[..., None]
    mean = float((areas[..., None] * radiance).sum() / 3.0)
    relative: Float32 = (radiance / mean).astype(np.float32)
    try:
        from_radiance(relative.copy(), "thumbnails")
    except EnvironmentFileError:
        return None
    return Rough(relative, len(pictures), clipped)
