"""Small pictures of the frames of a place, read again from its folder or made of its light."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import srgb_encode, to_bytes
from app.core.hdr.findings import clip_level
from app.core.storage.places.originals import ORIGINALS
from app.core.storage.places.store import capture_folders
from app.ui.presenters.capturing import small_picture

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.base.colour import FloatImage
    from app.core.storage.places.place import CaptureFacts

Bytes: TypeAlias = NDArray[np.uint8]

_SIZE: Final = (256, 128)


def frame_pictures(
    folder: Path | None, facts: CaptureFacts, radiance: FloatImage
) -> tuple[Bytes | None, ...]:
    """Find small pictures of a place's frames.

    Parameters
    ----------
    radiance : NDArray[np.float32], (H, 2 H, 3)
        Linear Rec. 709 of the merge: where a file is elsewhere, what it must have looked like is
        made of it.

    Returns
    -------
    tuple of ((128, w, 3) uint8 or None)
        SRGB, in the order of `facts.frames`.
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
    """Expose a panorama as a camera without any tone mapping would.

    Parameters
    ----------
    radiance : NDArray[np.float32], (H, 2 H, 3)
        Linear Rec. 709.

    Returns
    -------
    (128, 256, 3) uint8
        SRGB.
    """
    small = cv2.resize(radiance, _SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(to_bytes(srgb_encode(np.clip(small * gain, 0.0, 1.0))), np.uint8)
