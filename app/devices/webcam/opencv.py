"""Real webcams, through OpenCV."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2

from app.devices.webcam.capture import Capture, Reader, opened
from app.devices.webcam.names import LINUX, linux_names, shown_names
from app.devices.webcam.protocol import WebcamError
from app.devices.webcam.quiet import quiet
from app.devices.webcam.stream import WebcamStream

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.devices.clock import Clock
    from app.devices.webcam.protocol import Bytes

SIZE: Final = (1280, 720)
"""Columns and rows that a webcam is asked for; it may give others."""

SIZES: Final[dict[int, tuple[int, int]]] = {640: (640, 480), 1280: SIZE, 1920: (1920, 1080)}
"""Columns and rows that may be asked for, by columns; every webcam has some of them."""

_FPS: Final = 30
_FAILED_READS: Final = 10  # some give nothing for their first reads
_MOST_INDEX: Final = 5
_SYSTEM: str = sys.platform  # a variable, so that each system's branch is checked on all


class OpenCvWebcam(WebcamStream):
    """A webcam of this computer.

    Parameters
    ----------
    fov_deg : float, optional
        Horizontal field of view, deg, where it is known: nothing in a webcam tells it.
    is_there : callable, optional
        Whether there is a device of an index; None where the system does not tell.
    """

    def __init__(
        self,
        index: int,
        clock: Clock,
        *,
        name: str = "",
        fov_deg: float | None = None,
        width: int = SIZE[0],
        capture: Callable[[int], Capture] | None = None,
        is_there: Callable[[int], bool | None] | None = None,
    ) -> None:
        self._device = _Device(index, capture or _opened, is_there or _is_there)
        self._device.size = SIZES.get(width, SIZE)
        super().__init__(self._device, name or _name(index), fov_deg, clock)

    def ask_width(self, width: int) -> None:
        """Ask for pictures of another size, from when it is next opened."""
        self._device.size = SIZES.get(width, SIZE)


class _Device:
    """The source of an `OpenCvWebcam`."""

    def __init__(
        self,
        index: int,
        capture: Callable[[int], Capture],
        is_there: Callable[[int], bool | None],
    ) -> None:
        self._index = index
        self._make = capture
        self._is_there = is_there
        self._reader = Reader()
        self.size = SIZE

    def open(self) -> None:
        """Get hold of the device."""
        there = self._is_there(self._index)
        if there is False:
            raise WebcamError(
                "No webcam is connected.", "Plug one in and it starts by itself.", "no-webcam"
            )
        capture = opened(self._make, self._index)
        if capture is None:
            raise _busy() if there else _not_opened()
        if self.size != SIZE:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, self.size[0])
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, self.size[1])
        self._reader.begin(capture)

    def read(self) -> Bytes | None:
        """Give the next picture."""
        if not self._reader.on:
            raise _unplugged()
        picture = self._reader.read()
        failed = self._reader.failed
        if failed >= _FAILED_READS or (failed > 0 and self._is_there(self._index) is False):
            raise _unplugged()
        return picture

    def close(self) -> None:
        """Give the device back."""
        self._reader.end()


def list_webcams() -> tuple[tuple[int, str], ...]:
    """Find the webcams of this computer, and what captures HDMI.

    On Linux the system lists them. Elsewhere the first few are opened one after the other, which
    takes seconds and lights their lamps: not for the thread of the screens.

    Returns
    -------
    tuple of (index, name)
        By index, no name twice; none where there is none.
    """
    if _SYSTEM == "linux":
        return linux_names(LINUX)
    return shown_names(_tried(_opened), _SYSTEM)


def _tried(capture: Callable[[int], Capture]) -> tuple[int, ...]:
    found = []
    for index in range(_MOST_INDEX + 1):
        try:
            device = capture(index)
        except cv2.error:
            continue
        if device.isOpened():
            found.append(index)
        device.release()
    return tuple(found)


def _name(index: int) -> str:
    """Give the name the system has for it, where that is quickly asked."""
    known = dict(linux_names(LINUX)) if _SYSTEM == "linux" else {}
    return known.get(index, f"Webcam {index + 1}")


def _is_there(index: int) -> bool | None:
    return Path(f"/dev/video{index}").exists() if _SYSTEM == "linux" else None


def _opened(index: int) -> Capture:
    """Open a device with what is best for looking: enough pixels, at full speed, none old."""
    with quiet():
        capture = cv2.VideoCapture(index)
        if capture.isOpened():
            # Uncompressed, most webcams reach this size at a few pictures a second only.
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, SIZE[0])
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, SIZE[1])
            capture.set(cv2.CAP_PROP_FPS, _FPS)
            capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        return capture


def _busy() -> WebcamError:
    return WebcamError(
        "The webcam is in use by another program, or may not be used.",
        "Close the other program, or allow the camera in the system’s privacy settings.",
        "busy",
    )


def _not_opened() -> WebcamError:
    return WebcamError(
        "The webcam cannot be opened.",
        "Plug it in, close other programs that use it, and allow it in the privacy settings.",
        "no-webcam",
    )


def _unplugged() -> WebcamError:
    return WebcamError("The webcam went away.", "Plug it in and it goes on by itself.", "unplugged")
