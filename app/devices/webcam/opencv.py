"""This computer's webcams and their names, accessed through OpenCV."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import cv2

from app.core.base.arrays import Bytes
from app.core.base.imaging.video import as_rgb, quiet
from app.core.text import tr
from app.devices.clock import Clock
from app.devices.webcam.protocol import (
    WEBCAM,
    Manner,
    Webcam,
    WebcamError,
    no_webcam,
    unplugged,
)

Name = TypeVar("Name")
LINUX: Final = Path("/sys/class/video4linux")
"""Folder where Linux lists video devices."""

_LONGEST: Final = 60
_NAME_COMMANDS: Final[dict[str, tuple[str, ...]]] = {
    "darwin": ("/usr/sbin/system_profiler", "-json", "SPCameraDataType"),
    "win32": (
        "powershell.exe",
        "-NoProfile",
        "-NonInteractive",
        "-Command",
        "Get-PnpDevice -PresentOnly -Class Camera,Image | Select-Object FriendlyName"
        " | ConvertTo-Json",
    ),
}
_PATIENCE_S: Final = 6.0
_MOST_CHARACTERS: Final = 200_000
SIZE: Final = (1280, 720)
"""Columns and rows to request from a webcam. The webcam may deliver other sizes."""

SIZES: Final[dict[int, tuple[int, int]]] = {640: (640, 480), 1280: SIZE, 1920: (1920, 1080)}
"""Sizes to request (columns, rows), keyed by width. Every webcam supports some of them."""

_FPS: Final = 30
_FAILED_READS: Final = 10  # the first reads from some webcams are empty
_MOST_INDEX: Final = 5
_SYSTEM: str = sys.platform  # a variable, so that mypy checks every system's branch


class VideoDevice(Protocol):
    """The part of `cv2.VideoCapture` that the program uses."""

    def isOpened(self) -> bool:
        """Return whether the device is open."""

    def read(self) -> tuple[bool, Any]:
        """Return whether there is a frame, and the frame if so."""

    def set(self, propId: int, value: float) -> bool:
        """Set a property, and return whether it is supported."""

    def get(self, propId: int) -> float:
        """Return the value of a property, or 0 if the property is not supported."""

    def release(self) -> None:
        """Close the device."""


def open_capture(make: Callable[[Name], VideoDevice], name: Name) -> VideoDevice | None:
    """Open a device or a file by its name, or return None if that fails."""
    try:
        capture = make(name)
    except cv2.error:
        return None
    if capture.isOpened():
        return capture
    capture.release()
    return None


class CaptureStream(Webcam):
    """A source that is read through OpenCV, with a count of failed reads.

    Args:
        capture: Function that opens a device or file by name.
    """

    def __init__(
        self, name: str, clock: Clock, manner: Manner, capture: Callable[[Any], VideoDevice]
    ) -> None:
        super().__init__(name, None, clock, manner)
        self._make = capture
        self._capture: VideoDevice | None = None
        self._failures = 0

    def begin(self, name: int | str) -> VideoDevice | None:
        """Open a device or a file by its name and start reading, or return None if that fails."""
        self._capture, self._failures = open_capture(self._make, name), 0
        return self._capture

    def grab(self, capture: VideoDevice) -> Bytes | None:
        """Return the next frame.

        Returns:
            (H, W, 3) uint8 sRGB, or None if the frame is invalid or the read failed. Failed reads
            are counted.
        """
        try:
            ok, picture = capture.read()
        except cv2.error:
            ok, picture = False, None
        if ok and picture is not None:
            self._failures = 0
            return as_rgb(picture)
        self._failures += 1
        return None

    def disconnect(self) -> None:
        """Close the source."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()


def linux_names(folder: Path) -> tuple[tuple[int, str], ...]:
    """Return the webcams that Linux lists, without additional device nodes that carry no video.

    All the names are distinct.
    """
    names = []
    for node in folder.glob("video*"):
        number = node.name.removeprefix("video")
        if number.isdecimal() and _first_line(node / "index") in ("0", ""):
            # "HD Webcam: HD Webcam": the product, and the part of it.
            name = _tidy(_first_line(node / "name").partition(":")[0])
            names.append((int(number), name or tr("Webcam {number}", number=number)))
    return _distinct(sorted(names))


def shown_names(
    indices: Sequence[int], system: str, ask: Callable[[Sequence[str]], str] | None = None
) -> tuple[tuple[int, str], ...]:
    """Name the devices that could be opened.

    Devices are called "Webcam 1" and so on if the system does not name them, or if the order is
    uncertain.
    """
    command = _NAME_COMMANDS.get(system) if indices else None
    output = (ask or _printed)(command) if command else ""
    names = _mac_names(output) if system == "darwin" else _windows_names(output)
    sure = len(names) == len(indices) and (system == "darwin" or len(names) == 1)
    if not sure:
        names = [tr("Webcam {number}", number=index + 1) for index in indices]
    return _distinct(list(zip(indices, names, strict=True)))


def _mac_names(output: str) -> list[str]:
    table = _json(output)
    devices = table.get("SPCameraDataType") if isinstance(table, dict) else None
    rows = [row for row in devices if isinstance(row, dict)] if isinstance(devices, list) else []
    rows.sort(key=lambda row: str(row.get("spcamera_unique-id", "")))
    return [name for row in rows if (name := _tidy(str(row.get("_name", ""))))]


def _windows_names(output: str) -> list[str]:
    devices = _json(output)
    rows = devices if isinstance(devices, list) else [devices]
    names = [_tidy(str(row.get("FriendlyName") or "")) for row in rows if isinstance(row, dict)]
    return [name for name in names if name]


def _json(text: str) -> Any:
    try:
        return json.loads(text[:_MOST_CHARACTERS])
    except (ValueError, RecursionError):
        return None


def _printed(command: Sequence[str]) -> str:
    try:
        result = subprocess.run(  # noqa: S603 - commands of this file only
            command,
            capture_output=True,
            timeout=_PATIENCE_S,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return result.stdout.decode("utf-8", "replace")


def _distinct(names: list[tuple[int, str]]) -> tuple[tuple[int, str], ...]:
    """Add numbers to names that occur more than once."""
    counts: dict[str, int] = {}
    result = []
    for index, name in names:
        counts[name] = counts.get(name, 0) + 1
        result.append((index, name if counts[name] == 1 else f"{name} ({counts[name]})"))
    return tuple(result)


def _tidy(name: str) -> str:
    return "".join(sign for sign in name if sign.isprintable()).strip()[:_LONGEST]


def _first_line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")[:200].partition("\n")[0].strip()
    except OSError:
        return ""


def _is_there(index: int) -> bool | None:
    return Path(f"/dev/video{index}").exists() if _SYSTEM == "linux" else None


def _open_index(index: int) -> VideoDevice:
    """Open a device for live video, with a large frame, the full frame rate and no queue."""
    with quiet():
        capture = cv2.VideoCapture(index)
        if capture.isOpened():
            # Without compression, most webcams deliver only a few frames of this size per second.
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, SIZE[0])
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, SIZE[1])
            capture.set(cv2.CAP_PROP_FPS, _FPS)
            capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        return capture


class OpenCvWebcam(CaptureStream):
    """One of this computer's webcams.

    Args:
        is_there: Function that returns whether a device with a given index exists, or None if the
            system does not report it.
    """

    def __init__(
        self,
        index: int,
        clock: Clock,
        *,
        name: str = "",
        width: int = SIZE[0],
        capture: Callable[[int], VideoDevice] = _open_index,
        is_there: Callable[[int], bool | None] = _is_there,
    ) -> None:
        super().__init__(name or _name(index), clock, WEBCAM, capture)
        self._index = index
        self._is_there = is_there
        self._size = SIZES.get(width, SIZE)

    def ask_width(self, width: int) -> None:
        """Request a different width, which takes effect the next time the webcam is opened."""
        self._size = SIZES.get(width, SIZE)

    def connect(self) -> None:
        """Open the device."""
        there = self._is_there(self._index)
        if there is False:
            raise no_webcam()
        capture = self.begin(self._index)
        if capture is None:
            raise _busy() if there else _not_opened()
        if self._size != SIZE:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, self._size[0])
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, self._size[1])

    def read(self) -> Bytes | None:
        """Return the next frame."""
        if self._capture is None:
            raise unplugged()
        picture = self.grab(self._capture)
        failures = self._failures
        if failures >= _FAILED_READS or (failures > 0 and self._is_there(self._index) is False):
            raise unplugged()
        return picture


def list_webcams() -> tuple[tuple[int, str], ...]:
    """Return the webcams and HDMI grabbers on this computer, with their indices.

    Linux lists the devices. On other systems, the first few devices are opened one by one. This
    takes seconds and turns on their indicator lights, so do not call this function on the UI
    thread.

    All the names are distinct.
    """
    if _SYSTEM == "linux":
        return linux_names(LINUX)
    return shown_names(_probe_indices(_open_index), _SYSTEM)


def _probe_indices(capture: Callable[[int], VideoDevice]) -> tuple[int, ...]:
    indices = []
    for index in range(_MOST_INDEX + 1):
        try:
            device = capture(index)
        except cv2.error:
            continue
        if device.isOpened():
            indices.append(index)
        device.release()
    return tuple(indices)


def _name(index: int) -> str:
    """Return the system's name for a device if the name can be read quickly."""
    names = dict(linux_names(LINUX)) if _SYSTEM == "linux" else {}
    return names.get(index, tr("Webcam {number}", number=index + 1))


def _busy() -> WebcamError:
    return WebcamError(
        tr("The webcam is in use by another program, or access to it is blocked."),
        tr("Close the other program, or allow the camera in the system’s privacy settings."),
        "busy",
    )


def _not_opened() -> WebcamError:
    return WebcamError(
        tr("The webcam cannot be opened."),
        tr("Plug it in, close other programs that use it and allow it in the privacy settings."),
        "no-webcam",
    )
