"""Real webcams, through OpenCV."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import cv2
import numpy as np

from app.devices.webcam.protocol import WebcamError
from app.devices.webcam.stream import WebcamStream

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from app.devices.clock import Clock
    from app.devices.webcam.protocol import Bytes

__all__ = ["FOV_DEG", "SIZE", "OpenCvWebcam", "list_webcams"]

FOV_DEG: Final = 65.0
"""Horizontal field of view of a webcam of which nothing is known: most have 60 to 78 deg."""

SIZE: Final = (1280, 720)
"""Columns and rows that a webcam is asked for; it may give others."""

_FPS: Final = 30
_FAILED_READS: Final = 10  # some give nothing for their first reads
_MOST_INDEX: Final = 5
_LARGEST: Final = 8192  # pixels a side
_SYSTEM: str = sys.platform  # a variable, so that each system's branch is checked on all
_LINUX: Final = Path("/sys/class/video4linux")


class Capture(Protocol):
    """`cv2.VideoCapture` as far as it is used."""

    def isOpened(self) -> bool: ...
    def read(self) -> tuple[bool, Any]: ...
    def set(self, propId: int, value: float) -> bool: ...
    def release(self) -> None: ...


class OpenCvWebcam(WebcamStream):
    """A webcam of this computer.

    Parameters
    ----------
    index : int
        As `list_webcams` gives it.
    clock : Clock
        For pauses and rates.
    name : str, optional
        To show.
    fov_deg : float, optional
        Horizontal field of view, deg: nothing in a webcam tells it.
    capture : callable, optional
        Opens the device of an index.
    is_there : callable, optional
        Whether there is a device of an index; None where the system does not tell.
    """

    def __init__(
        self,
        index: int,
        clock: Clock,
        *,
        name: str = "",
        fov_deg: float = FOV_DEG,
        capture: Callable[[int], Capture] | None = None,
        is_there: Callable[[int], bool | None] | None = None,
    ) -> None:
        source = _Device(index, capture or _opened, is_there or _is_there)
        super().__init__(source, name or _name(index), fov_deg, clock)


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
        self._capture: Capture | None = None
        self._failed = 0

    def open(self) -> None:
        """Get hold of the device."""
        there = self._is_there(self._index)
        if there is False:
            raise WebcamError(
                "No webcam is connected.", "Plug one in and it starts by itself.", "no-webcam"
            )
        try:
            capture = self._make(self._index)
        except cv2.error:
            capture = None
        if capture is None or not capture.isOpened():
            if capture is not None:
                capture.release()
            raise _busy() if there else _not_opened()
        self._capture, self._failed = capture, 0

    def read(self) -> Bytes | None:
        """Give the next picture."""
        capture = self._capture
        if capture is None:
            raise _unplugged()
        try:
            done, picture = capture.read()
        except cv2.error:
            done, picture = False, None
        if done and picture is not None:
            self._failed = 0
            return _as_rgb(picture)
        self._failed += 1
        if self._failed >= _FAILED_READS or self._is_there(self._index) is False:
            raise _unplugged()
        return None

    def close(self) -> None:
        """Give the device back."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()


def list_webcams() -> tuple[tuple[int, str], ...]:
    """Find the webcams of this computer.

    On Linux the system lists them. Elsewhere the first few are opened one after the other, which
    takes seconds and lights their lamps: not for the thread of the screens.

    Returns
    -------
    tuple of (index, name)
        By index; none where there is none.
    """
    return _listed(_LINUX) if _SYSTEM == "linux" else _tried(_opened)


def _listed(folder: Path) -> tuple[tuple[int, str], ...]:
    """Read the list that Linux keeps; further nodes of one device carry no pictures."""
    found = []
    for node in folder.glob("video*"):
        number = node.name.removeprefix("video")
        if number.isdecimal() and _first_line(node / "index") in ("0", ""):
            name = _first_line(node / "name")
            found.append((int(number), name.partition(":")[0].strip() or f"Webcam {number}"))
    return tuple(sorted(found))


def _tried(capture: Callable[[int], Capture]) -> tuple[tuple[int, str], ...]:
    found = []
    for index in range(_MOST_INDEX + 1):
        try:
            device = capture(index)
        except cv2.error:
            continue
        if device.isOpened():
            found.append((index, _name(index)))
        device.release()
    return tuple(found)


def _first_line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")[:200].partition("\n")[0].strip()
    except OSError:
        return ""


def _name(index: int) -> str:
    return f"Webcam {index + 1}"


def _is_there(index: int) -> bool | None:
    return Path(f"/dev/video{index}").exists() if _SYSTEM == "linux" else None


def _opened(index: int) -> Capture:
    """Open a device with what is best for looking: enough pixels, at full speed, none old."""
    with _quiet():
        capture = cv2.VideoCapture(index)
        if capture.isOpened():
            # Uncompressed, most webcams reach this size at a few pictures a second only.
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, SIZE[0])
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, SIZE[1])
            capture.set(cv2.CAP_PROP_FPS, _FPS)
            capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        return capture


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep OpenCV from writing to the terminal that a device cannot be opened."""
    logging = cv2.utils.logging
    before = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(before)


def _as_rgb(picture: Any) -> Bytes | None:
    """Turn what OpenCV gives into sRGB; None for what is no picture."""
    given = np.asarray(picture)
    if given.dtype != np.uint8 or given.ndim not in (2, 3) or min(given.shape[:2]) < 16:
        return None
    if max(given.shape[:2]) > _LARGEST:
        return None
    if given.ndim == 2 or given.shape[2] == 1:
        return np.asarray(cv2.cvtColor(given, cv2.COLOR_GRAY2RGB), np.uint8)
    if given.shape[2] != 3:
        return None
    return np.asarray(cv2.cvtColor(given, cv2.COLOR_BGR2RGB), np.uint8)


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
