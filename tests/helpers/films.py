"""Films of a head that turns in a place while the camera goes around with it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.localization.views import Lens, look
from tests.unit.test_facing import place, taken

LENS = Lens(62.0, (640, 360))
STEP_DEG = 9.0
_HEAD = 220  # pixels: side of the portrait


@cache
def turn_frames(name: str, count: int, step_deg: float = STEP_DEG) -> tuple[Bytes, ...]:
    """Frames at turns 0, 9, 18, ...: the portrait in front of what is behind it there."""
    return tuple(frame(name, number * step_deg) for number in range(count))


def frame(name: str, turn_deg: float) -> Bytes:
    """The sitter at a turn, before the background."""
    picture = look(place(name).display, turn_deg + 180.0, LENS).copy()
    head = taken("generic", name, round(turn_deg) % 360)
    small = cv2.resize(head, (_HEAD, _HEAD), interpolation=cv2.INTER_AREA)
    top, left = 60, (LENS.size[0] - _HEAD) // 2
    picture[top : top + _HEAD, left : left + _HEAD] = small
    return picture


def write_film(path: Path, frames: tuple[Bytes, ...], fps: float = 2.0) -> Path:
    """Keep frames as a video."""
    size = frames[0].shape[1], frames[0].shape[0]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
    for picture in frames:
        writer.write(np.ascontiguousarray(picture[..., ::-1]))
    writer.release()
    return path
