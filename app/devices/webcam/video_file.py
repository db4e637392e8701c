"""A video file in place of a webcam: it plays at its own pace, and begins again at its end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import cv2

from app.devices.webcam.capture import opened
from app.devices.webcam.pictures import as_rgb, fitted
from app.devices.webcam.protocol import WebcamError
from app.devices.webcam.rtsp import open_url
from app.devices.webcam.stream import Manner, WebcamStream

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from app.devices.clock import Clock
    from app.devices.webcam.capture import Capture
    from app.devices.webcam.protocol import Bytes

ENDINGS: Final = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpg", ".webm")
"""Of files that are offered; what is in a file counts, and not its name."""

_VIDEO: Final = Manner(
    noun="video", revive="Choose another file", quicken="Choose a smaller resolution.", still=True
)
_FPS: Final = 25.0
_MOST_FPS: Final = 240.0
_LONGEST_STEP_S: Final = 1.0  # a longer gap between two pictures is no pace
_BEHIND_S: Final = 0.5
_LARGEST: Final = 8192
_HEAD_BYTES: Final = 400
_PACKET: Final = 188
_ATOMS: Final = frozenset({b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip"})


class VideoFile(WebcamStream):
    """A video as a camera.

    Rotation that the file asks for is made. A file that goes away, with the disk that it is on, is
    waited for.

    Parameters
    ----------
    width : int, optional
        Most columns of its pictures; 0 takes them as they are.
    fov_deg : float, optional
        Horizontal field of view, deg, where it is known.
    """

    def __init__(
        self,
        path: Path,
        clock: Clock,
        *,
        width: int = 0,
        fov_deg: float | None = None,
        capture: Callable[[str], Capture] = open_url,
    ) -> None:
        source = _Player(path, clock, width, capture)
        super().__init__(source, path.name, fov_deg, clock, manner=_VIDEO)


class _Player:
    """The source of a `VideoFile`."""

    def __init__(
        self, path: Path, clock: Clock, width: int, capture: Callable[[str], Capture]
    ) -> None:
        self._path = path
        self._clock = clock
        self._width = width
        self._make = capture
        self._capture: Capture | None = None
        self._due_s = 0.0
        self._place_s = 0.0
        self._shown = 0  # since the beginning of the file

    def open(self) -> None:
        """Begin at its beginning."""
        check_video(self._path)
        capture = opened(self._make, str(self._path.resolve()))
        if capture is None:
            raise _bad(self._path)
        self._capture, self._shown = capture, 0
        self._due_s, self._place_s = self._clock.now(), 0.0
        sides = [capture.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        if not all(0 < side <= _LARGEST for side in sides):
            self.close()
            raise _bad(self._path)

    def read(self) -> Bytes | None:
        """Give the next picture when it is time for it."""
        capture = self._capture
        if capture is None:
            raise _bad(self._path)
        try:
            done, picture = capture.read()
        except cv2.error:
            done, picture = False, None
        if not done or picture is None:
            self._again()
            return None
        step = self._step(capture)
        self._shown += 1
        # Behind by more, it goes on from here: it is slower then, and never hurries.
        self._due_s = max(self._due_s + step, self._clock.now() - _BEHIND_S)
        self._clock.sleep(self._due_s - self._clock.now())
        shown = as_rgb(picture)
        return None if shown is None else fitted(shown, self._width)

    def close(self) -> None:
        """Let go of the file."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()

    def _again(self) -> None:
        if self._shown == 0:
            raise _bad(self._path)
        self.close()
        self.open()

    def _step(self, capture: Capture) -> float:
        """Seconds from the last picture to this one, as the file has them."""
        place = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        step, self._place_s = place - self._place_s, place
        if self._shown == 0 or not 0.0 < step < _LONGEST_STEP_S:
            rate = capture.get(cv2.CAP_PROP_FPS)
            step = 1.0 / (rate if math.isfinite(rate) and 1.0 <= rate <= _MOST_FPS else _FPS)
        return step


def check_video(path: Path) -> None:
    """Look whether a file is a video of a kind that holds its pictures itself.

    FFmpeg also opens lists of other files and of addresses; they are refused here by what they
    begin with, whatever they are called.

    Raises
    ------
    WebcamError
        When it is missing ("no-file") or something else ("bad-file").
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
        f"The video {path.name} is not there.",
        "Reconnect its disk to continue, or choose another file.",
        "no-file",
    )


def _bad(path: Path) -> WebcamError:
    return WebcamError(
        f"{path.name} is no video that can be played.", "Choose another file.", "bad-file"
    )
