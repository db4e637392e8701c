"""Video files: playback in place of a live camera, and a writer.

When it replaces a live camera, a video loops at its own frame rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.imaging import video
from app.core.base.imaging.video import LARGEST, fitted, open_url
from app.core.base.native import native_path
from app.core.text import tr
from app.devices.clock import Clock
from app.devices.webcam.opencv import CaptureStream, VideoDevice
from app.devices.webcam.protocol import Manner, WebcamError

_VIDEO: Final = Manner(
    noun=tr("video"),
    revive=tr("Choose another file."),
    quicken=tr("Choose a smaller resolution."),
    still=True,
)
_VIDEO_FPS: Final = 25.0
_MOST_FPS: Final = 240.0
# seconds; a longer gap between two frames does not count towards the frame rate
_LONGEST_STEP_S: Final = 1.0
_BEHIND_S: Final = 0.5


class VideoFile(CaptureStream):
    """A video file played as if it were a live camera.

    The file's rotation is applied. If the file's drive is disconnected, playback waits until the
    file is back.

    Args:
        width: Maximum width of a frame in pixels, or 0 to keep the original size.
    """

    def __init__(
        self,
        path: Path,
        clock: Clock,
        *,
        width: int = 0,
        capture: Callable[[str], VideoDevice] = open_url,
    ) -> None:
        super().__init__(path.name, clock, _VIDEO, capture)
        self._path = path
        self._width = width
        self._place_s = 0.0
        self._frame_count = 0  # since the beginning of the file

    def connect(self) -> None:
        """Open the file at its beginning."""
        check_video(self._path)
        capture = self.begin(native_path(self._path.resolve()))
        if capture is None:
            raise _bad(self._path)
        self._frame_count = 0
        self._due_s, self._place_s = self._clock.now(), 0.0
        sides = [capture.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        if not all(0 < side <= LARGEST for side in sides):
            self.disconnect()
            raise _bad(self._path)

    def read(self) -> Bytes | None:
        """Return the next frame when it is due."""
        capture = self._capture
        if capture is None:
            raise _bad(self._path)
        picture = self.grab(capture)
        if self._failures:
            self._again()
            return None
        step = self._step(capture)
        self._frame_count += 1
        self.pace(step, _BEHIND_S)
        return None if picture is None else fitted(picture, self._width)

    def _again(self) -> None:
        if self._frame_count == 0:
            raise _bad(self._path)
        self.disconnect()
        self.connect()

    def _step(self, capture: VideoDevice) -> float:
        """Return the time between the previous frame and this one, in seconds."""
        place = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        step, self._place_s = place - self._place_s, place
        if self._frame_count == 0 or not 0.0 < step < _LONGEST_STEP_S:
            rate = capture.get(cv2.CAP_PROP_FPS)
            step = 1.0 / (rate if math.isfinite(rate) and 1.0 <= rate <= _MOST_FPS else _VIDEO_FPS)
        return step


class FilmWriter:
    """Writes frames, (H, W, 3) uint8 sRGB, to a video file that has the size of the first frame."""

    def __init__(self, path: Path, fps: float) -> None:
        self._path, self._fps = path, fps
        self._writer: cv2.VideoWriter | None = None
        self._size = (0, 0)

    def __enter__(self) -> FilmWriter:
        """Open the file."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        if self._writer is not None:
            self._writer.release()

    def add(self, picture: Bytes) -> None:
        """Append a frame."""
        if self._writer is None:
            self._size = picture.shape[1], picture.shape[0]
            code = cv2.VideoWriter.fourcc(*"mp4v")
            name = native_path(self._path)
            self._writer = cv2.VideoWriter(name, code, self._fps, self._size)
        if (picture.shape[1], picture.shape[0]) == self._size:
            self._writer.write(np.ascontiguousarray(picture[..., ::-1]))


def check_video(path: Path) -> None:
    """Check that a file is a video.

    Raises:
        WebcamError: As in `video.check_video`.
    """
    try:
        video.check_video(path)
    except video.VideoError as error:
        raise WebcamError(error.message, error.hint, error.code) from None


def _bad(path: Path) -> WebcamError:
    error = video.not_a_video(path)
    return WebcamError(error.message, error.hint, error.code)
