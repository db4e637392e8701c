"""Films: a video in place of a webcam, the frames of a film, and writing one.

In place of a webcam a video plays at its own pace and begins again at its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.native import native_path
from app.core.measure.film.movie_header import read_movie_header
from app.core.text import tr
from app.devices.clock import Clock
from app.devices.webcam.opencv import Capture, CaptureStream, open_url
from app.devices.webcam.protocol import Manner, WebcamError, as_rgb, fitted

_VIDEO: Final = Manner(
    noun=tr("video"),
    revive=tr("Choose another file."),
    quicken=tr("Choose a smaller resolution."),
    still=True,
)
_VIDEO_FPS: Final = 25.0
_MOST_FPS: Final = 240.0
_LONGEST_STEP_S: Final = 1.0  # a longer gap between two pictures is no pace
_BEHIND_S: Final = 0.5
_LARGEST: Final = 8192
_LONGEST_FILM_S: Final = 300.0
_HEAD_BYTES: Final = 400
_PACKET: Final = 188
_ATOMS: Final = frozenset({b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip"})


class VideoFile(CaptureStream):
    """A video as a camera.

    Rotation that the file asks for is made. A file that goes away, with the disk that it is on, is
    waited for.

    * `width`: most columns of its pictures; 0 takes them as they are.
    """

    def __init__(
        self,
        path: Path,
        clock: Clock,
        *,
        width: int = 0,
        capture: Callable[[str], Capture] = open_url,
    ) -> None:
        super().__init__(path.name, clock, _VIDEO, capture)
        self._path = path
        self._width = width
        self._place_s = 0.0
        self._shown = 0  # since the beginning of the file

    def connect(self) -> None:
        """Begin at its beginning."""
        check_video(self._path)
        capture = self.begin(native_path(self._path.resolve()))
        if capture is None:
            raise _bad(self._path)
        self._shown = 0
        self._due_s, self._place_s = self._clock.now(), 0.0
        sides = [capture.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        if not all(0 < side <= _LARGEST for side in sides):
            self.disconnect()
            raise _bad(self._path)

    def read(self) -> Bytes | None:
        """Give the next picture when it is time for it."""
        capture = self._capture
        if capture is None:
            raise _bad(self._path)
        picture = self.grab(capture)
        if self._failed:
            self._again()
            return None
        step = self._step(capture)
        self._shown += 1
        self.pace(step, _BEHIND_S)
        return None if picture is None else fitted(picture, self._width)

    def _again(self) -> None:
        if self._shown == 0:
            raise _bad(self._path)
        self.disconnect()
        self.connect()

    def _step(self, capture: Capture) -> float:
        """Seconds from the last picture to this one, as the file has them."""
        place = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        step, self._place_s = place - self._place_s, place
        if self._shown == 0 or not 0.0 < step < _LONGEST_STEP_S:
            rate = capture.get(cv2.CAP_PROP_FPS)
            step = 1.0 / (rate if math.isfinite(rate) and 1.0 <= rate <= _MOST_FPS else _VIDEO_FPS)
        return step


def film_frames(path: Path, most: int, width: int) -> Iterator[tuple[float, float, Bytes]]:
    """Give about so many frames of a video, evenly spread, none with more columns than `width`.

    Each is the time since the first by the file's own timestamps, s, the share of the film that is
    over, and (H, W, 3) uint8.

    Raises `WebcamError` for what is no video ("bad-file"), not there ("no-file"), or too long.
    """
    check_video(path)
    capture = open_url(native_path(path.resolve()))
    try:
        rate, count = (capture.get(p) for p in (cv2.CAP_PROP_FPS, cv2.CAP_PROP_FRAME_COUNT))
        sides = [capture.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        if not (capture.isOpened() and all(0 < side <= _LARGEST for side in sides)):
            raise _bad(path)
        rate = rate if math.isfinite(rate) and 1.0 <= rate <= _MOST_FPS else _VIDEO_FPS
        if not 0 < count <= _LONGEST_FILM_S * rate:
            raise WebcamError(
                tr("{name} is longer than five minutes, or does not say how long it is.",
                   name=path.name),
                tr("Film one turn of 20 to 60 seconds."),
                "bad-file",
            )  # fmt: skip
        upright = read_movie_header(path).upright
        for time_s, share, picture in _evenly(capture, rate, max(round(count), 1), most, width):
            yield time_s, share, upright(picture)
    finally:
        capture.release()


def _evenly(
    capture: cv2.VideoCapture, rate: float, count: int, most: int, width: int
) -> Iterator[tuple[float, float, Bytes]]:
    wanted = set(np.unique(np.linspace(0, count - 1, min(most, count)).astype(int)).tolist())
    clock = FrameClock(rate)
    for number in range(count):
        # A frame that is not looked at need not be turned into colours.
        if not capture.grab():
            return
        time_s = clock.time_of(capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0)
        if number not in wanted:
            continue
        done, picture = capture.retrieve()
        shown = as_rgb(picture) if done and picture is not None else None
        if shown is not None:
            yield time_s, (number + 1) / count, fitted(shown, width)


class FrameClock:
    """Times of a film's frames, seconds since the first, by the timestamps of the file.

    A timestamp that is missing, not later than the one before, or later by more than a film may
    last counts as one frame at the mean rate. So times always increase.
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._stamp_s: float | None = None
        self._time_s = 0.0

    def time_of(self, stamp_s: float) -> float:
        """Take the timestamp of the next frame."""
        if self._stamp_s is not None:
            step = stamp_s - self._stamp_s
            self._time_s += step if 0.0 < step <= _LONGEST_FILM_S else 1.0 / self._rate
        self._stamp_s = stamp_s
        return self._time_s


class FilmWriter:
    """Keeps pictures, (H, W, 3) uint8 sRGB, as a video; all have the size of the first."""

    def __init__(self, path: Path, fps: float) -> None:
        self._path, self._fps = path, fps
        self._writer: cv2.VideoWriter | None = None
        self._size = (0, 0)

    def __enter__(self) -> FilmWriter:
        """Begin with the first picture."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the video."""
        if self._writer is not None:
            self._writer.release()

    def add(self, picture: Bytes) -> None:
        """Append a picture."""
        if self._writer is None:
            self._size = picture.shape[1], picture.shape[0]
            code = cv2.VideoWriter.fourcc(*"mp4v")
            name = native_path(self._path)
            self._writer = cv2.VideoWriter(name, code, self._fps, self._size)
        if (picture.shape[1], picture.shape[0]) == self._size:
            self._writer.write(np.ascontiguousarray(picture[..., ::-1]))


def check_video(path: Path) -> None:
    """Look whether a file is a video of a kind that holds its pictures itself.

    FFmpeg also opens lists of other files and of addresses; they are refused here by what they
    begin with, whatever they are called.

    Raises `WebcamError` when it is missing ("no-file") or something else ("bad-file").
    """
    try:
        if not path.is_file():
            raise _missing(path)
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except (OSError, ValueError):
        raise _missing(path) from None
    if not _is_video(head):
        raise _bad(path)


def _is_video(head: bytes) -> bool:
    if head[4:8] in _ATOMS or head.startswith((b"\x1a\x45\xdf\xa3", b"\x00\x00\x01\xba")):
        return True
    if head.startswith(b"RIFF") and head[8:12] == b"AVI ":
        return True
    # Packets of a transport stream; those of a camcorder have four bytes in front.
    return any(
        head[start : start + 1] == b"G" and head[start + length : start + length + 1] == b"G"
        for start, length in ((0, _PACKET), (4, _PACKET + 4))
    )


def _missing(path: Path) -> WebcamError:
    return WebcamError(
        tr("The video {name} is not there.", name=path.name),
        tr("Reconnect its disk to continue, or choose another file."),
        "no-file",
    )


def _bad(path: Path) -> WebcamError:
    return WebcamError(
        tr("{name} cannot be played as a video.", name=path.name),
        tr("Choose another file."),
        "bad-file",
    )
