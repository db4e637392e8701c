"""Open videos and streams through OpenCV, and convert their frames."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.catalogue import tr
from app.core.base.errors import CoreError

OPEN_S: Final = 6.0
"""Maximum time that FFmpeg may take to open a stream, in seconds of wall-clock time."""

READ_S: Final = 6.5
"""Maximum time that FFmpeg may wait for a frame, in seconds of wall-clock time."""

_SAYS_NOTHING: Final = "-8"  # FFmpeg's AV_LOG_QUIET

SMALLEST: Final = 16
LARGEST: Final = 8192
"""Maximum length of a frame's longer side, in pixels."""

_HEAD_BYTES: Final = 400
_PACKET: Final = 188
_ATOMS: Final = frozenset({b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip"})


class VideoError(CoreError):
    """A file is missing (`code` is "no-file") or is not a video ("bad-file")."""

    def __init__(self, message: str, hint: str = "", code: str = "bad-file") -> None:
        super().__init__(message, hint)
        self.code = code


@contextmanager
def quiet() -> Iterator[None]:
    """Keep OpenCV from printing to the terminal when it cannot open a video."""
    logging = cv2.utils.logging
    before = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(before)


def open_url(url: str) -> cv2.VideoCapture:
    """Open a URL or a file with FFmpeg, limiting the time to open it and to read each frame."""
    # OpenCV reads this when it first uses FFmpeg; without it, FFmpeg prints to the terminal.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", _SAYS_NOTHING)
    limits = [
        cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
        round(OPEN_S * 1000),
        cv2.CAP_PROP_READ_TIMEOUT_MSEC,
        round(READ_S * 1000),
    ]
    # Also silences the message about a read that took too long.
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    with quiet():
        return cv2.VideoCapture(url, cv2.CAP_FFMPEG, limits)


def as_rgb(picture: Any) -> Bytes | None:
    """Convert an OpenCV frame to sRGB.

    Args:
        picture: (H, W), (H, W, 1) or (H, W, 3) uint8, greyscale or BGR.

    Returns:
        (H, W, 3) uint8 sRGB, or None if `picture` is not an image or has a side shorter than 16 or
        longer than 8,192 pixels.
    """
    array = np.asarray(picture)
    if array.dtype != np.uint8 or array.ndim not in (2, 3) or min(array.shape[:2]) < SMALLEST:
        return None
    if max(array.shape[:2]) > LARGEST:
        return None
    if array.ndim == 2 or array.shape[2] == 1:
        return np.asarray(cv2.cvtColor(array, cv2.COLOR_GRAY2RGB), np.uint8)
    if array.shape[2] != 3:
        return None
    return np.asarray(cv2.cvtColor(array, cv2.COLOR_BGR2RGB), np.uint8)


def fitted(picture: Bytes, width: int) -> Bytes:
    """Scale a picture down if it is wider than `width`.

    Args:
        picture: (H, W, 3) uint8. Picture in sRGB.
        width: Maximum width in pixels, or 0 for no limit.

    Returns:
        (h, w, 3) uint8. The picture with its proportions unchanged, or the same array if it already
        fits.
    """
    rows, columns = picture.shape[:2]
    if width <= 0 or columns <= width:
        return picture
    size = (width, max(round(rows * width / columns), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def check_video(path: Path) -> None:
    """Check that a file is a video that contains its own frames.

    FFmpeg also opens lists of other files or addresses. Such lists are recognised by their first
    bytes, whatever their names, and are rejected.

    Raises:
        VideoError: If the file is missing ("no-file") or is not a video ("bad-file").
    """
    try:
        if not path.is_file():
            raise _missing(path)
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except (OSError, ValueError):
        raise _missing(path) from None
    if not _is_video(head):
        raise not_a_video(path)


def _is_video(head: bytes) -> bool:
    if head[4:8] in _ATOMS or head.startswith((b"\x1a\x45\xdf\xa3", b"\x00\x00\x01\xba")):
        return True
    if head.startswith(b"RIFF") and head[8:12] == b"AVI ":
        return True
    # A camcorder puts four bytes before each packet of a transport stream.
    return any(
        head[start : start + 1] == b"G" and head[start + length : start + length + 1] == b"G"
        for start, length in ((0, _PACKET), (4, _PACKET + 4))
    )


def _missing(path: Path) -> VideoError:
    return VideoError(
        tr("The video file {name} is missing.", name=path.name),
        tr("Reconnect its disk to continue, or choose another file."),
        "no-file",
    )


def not_a_video(path: Path) -> VideoError:
    """Return the error for a file that is not a video."""
    return VideoError(
        tr("{name} cannot be played as a video.", name=path.name),
        tr("Choose another file."),
    )
