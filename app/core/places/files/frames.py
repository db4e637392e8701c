"""Thumbnails of the frames of a place."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage, largest_channel, srgb_encode, to_bytes
from app.core.base.imaging.image_input import picture_bytes
from app.core.measure.finish.findings import clip_level
from app.core.places.files.originals import ORIGINALS
from app.core.places.place import CaptureFacts
from app.core.places.place_folder import capture_folders

_SIZE: Final = (256, 128)
_TILE_ROWS: Final = 128
_MOST_BYTES: Final = 256 << 20
_MOST_PIXELS: Final = 140_000_000
_CLIPPED_CODE: Final = 250


def frame_pictures(
    folder: Path | None, facts: CaptureFacts, radiance: FloatImage
) -> tuple[Bytes | None, ...]:
    """Return thumbnails of the frames of a place.

    Args:
        radiance: (H, 2 H, 3) float32. Linear Rec. 709 radiance of the merge, from which the
            thumbnails of missing files are simulated.

    Returns:
        One entry for each frame, in the order of `facts.frames`: a thumbnail, (128, w, 3) uint8
        sRGB, or None.
    """
    homes = [] if folder is None else [folder, *reversed(capture_folders(folder))]
    level = clip_level([frame.ev for frame in facts.frames])
    darkest = min((frame.ev for frame in facts.frames), default=0.0)
    pictures: list[Bytes | None] = []
    for frame in facts.frames:
        paths = [home / ORIGINALS / frame.file for home in homes]
        path = next((each for each in paths if each.is_file()), None)
        picture = None if path is None else small_picture(path)
        if picture is None and level:
            picture = exposed_picture(radiance, 2.0 ** (frame.ev - darkest) / level)
        pictures.append(picture)
    return tuple(pictures)


def exposed_picture(radiance: FloatImage, gain: float) -> Bytes:
    """Expose a panorama without tone mapping, as a camera does.

    Args:
        radiance: (H, 2 H, 3) float32. Linear Rec. 709 radiance.

    Returns:
        (128, 256, 3) uint8. The exposed panorama in sRGB.
    """
    small = cv2.resize(radiance, _SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(to_bytes(srgb_encode(np.clip(small * gain, 0.0, 1.0))), np.uint8)


def small_picture(path: Path) -> Bytes | None:
    """Read a picture file as a thumbnail.

    Returns:
        (128, w, 3) uint8 sRGB, or None if the file cannot be read.
    """
    data = picture_bytes(path, _MOST_BYTES, _MOST_PIXELS)
    if data is None:
        return None
    try:
        image = cv2.imdecode(data, cv2.IMREAD_REDUCED_COLOR_8)
        if image is not None and image.shape[0] < _TILE_ROWS:
            image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    if image is None or image.shape[0] < 2:
        return None
    columns = max(round(image.shape[1] * _TILE_ROWS / image.shape[0]), 1)
    small = cv2.resize(image, (columns, _TILE_ROWS), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.asarray(small, np.uint8)[..., ::-1])


def clipped_in(picture: Bytes) -> float:
    """Return the clipped fraction, 0 to 1, of a thumbnail, (h, w, 3) uint8 sRGB."""
    return float((largest_channel(picture) >= _CLIPPED_CODE).mean())
