"""Films of a head that turns in a place while the camera goes around with it."""

from __future__ import annotations

import struct
from collections.abc import Sequence
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


_BOXES = (b"moov", b"trak", b"mdia", b"minf", b"stbl")


def retimed(path: Path, steps_s: Sequence[float]) -> Path:
    """Give the frames of an MP4 file durations of their own, in place: a variable frame rate.

    The index of the frames stands behind them in what `write_film` writes, so that it may grow.
    """
    data = path.read_bytes()
    assert data.index(b"mdat") < data.index(b"moov")
    path.write_bytes(_boxes(data, [round(1000 * step) for step in steps_s]))
    return path


def _boxes(data: bytes, steps: Sequence[int]) -> bytes:
    """Write boxes again (ISO/IEC 14496-12), time counted in milliseconds, without edit lists."""
    out, at = b"", 0
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + size]
        at += size
        if kind == b"edts":
            continue
        if kind in _BOXES:
            body = _boxes(body, steps)
        if kind == b"stts":
            body = struct.pack(">II", 0, len(steps))
            body += b"".join(struct.pack(">II", 1, step) for step in steps)
        if kind in (b"mdhd", b"mvhd"):
            body = body[:12] + struct.pack(">II", 1000, sum(steps)) + body[20:]
        if kind == b"tkhd":
            body = body[:20] + struct.pack(">I", sum(steps)) + body[24:]
        out += struct.pack(">I4s", 8 + len(body), kind) + body
    return out
