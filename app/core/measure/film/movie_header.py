"""Read the mirroring and the camera from a video's header, neither of which OpenCV reports.

The header is the `moov` box of ISO/IEC 14496-12. The matrix of a track (8.3.2) rotates the track's
pictures and may mirror them, as with a phone's front camera. OpenCV rotates them but does not
mirror them.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.atomic_files import open_file

VIDEO_ENDINGS: Final = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpg", ".webm")
"""Suffixes for file dialogs. The program itself recognises a video by its contents."""

_MOST_BYTES: Final = 32 << 20
_MOST_BOXES: Final = 4096
_MATRIX: Final = {0: 40, 1: 52}  # offset of the matrix in `tkhd`, by version
_FRONT: Final = b"front camera"  # in the lens model of QuickTime's metadata


@dataclass(frozen=True, slots=True)
class MovieHeader:
    """The header of a video.

    Attributes:
        flip: Axis along which a frame from OpenCV, (H, W, 3), must still be reversed, or None if
            the video is not mirrored.
        front_camera: Whether a phone's front camera recorded the video, which may then be a mirror
            image.
    """

    flip: int | None = None
    front_camera: bool = False

    def upright(self, picture: Bytes) -> Bytes:
        """Return a frame from OpenCV, (H, W, 3) uint8, as it should be displayed."""
        return picture if self.flip is None else np.ascontiguousarray(np.flip(picture, self.flip))


def read_movie_header(path: Path) -> MovieHeader:
    """Read a video's header, or return an empty one if the format is unknown."""
    try:
        with open_file(path) as stream:
            moov = _moov(stream, path.stat().st_size)
    except (OSError, ValueError):
        return MovieHeader()
    flips = [_flip(trak) for name, trak in _boxes(moov) if name == b"trak" and _is_video(trak)]
    return MovieHeader(flips[0] if flips else None, _FRONT in moov.lower())


def _moov(stream: BinaryIO, length: int) -> bytes:
    """Return the contents of the header, or empty bytes if there is none of a plausible size."""
    start = 0
    for _ in range(_MOST_BOXES):
        stream.seek(start)
        head = stream.read(16)
        if len(head) < 8:
            break
        size, name, inside = int.from_bytes(head[:4]), head[4:8], 8
        if size == 1:
            size, inside = int.from_bytes(head[8:16]), 16
        size = size or length - start
        if size < inside:
            break
        if name == b"moov":
            stream.seek(start + inside)
            return stream.read(min(size - inside, _MOST_BYTES))
        start += size
    return b""


def _boxes(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the name and the contents of each box inside a box."""
    start = 0
    for _ in range(_MOST_BOXES):
        size = int.from_bytes(content[start : start + 4])
        if size < 8 or start + size > len(content):
            return
        yield content[start + 4 : start + 8], content[start + 8 : start + size]
        start += size


def _is_video(trak: bytes) -> bool:
    parts = [part for name, part in _boxes(trak) if name == b"mdia"]
    handlers = [part for mdia in parts for name, part in _boxes(mdia) if name == b"hdlr"]
    return any(handler[8:12] == b"vide" for handler in handlers)


def _flip(trak: bytes) -> int | None:
    """Return the axis that a track's matrix mirrors after OpenCV's rotation."""
    head = next((part for name, part in _boxes(trak) if name == b"tkhd"), b"")
    start = _MATRIX.get(head[0]) if head else None
    if start is None or len(head) < start + 36:
        return None
    a, b, _, c, d, *_ = struct.unpack(">9i", head[start : start + 36])
    if a * d - b * c >= 0:
        return None
    # After a quarter turn, the mirrored rows are columns.
    return 0 if abs(a) > abs(b) else 1
