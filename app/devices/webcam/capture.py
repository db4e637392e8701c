"""`cv2.VideoCapture` for devices and streams: none of its errors get out, nothing stays open."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import cv2

from app.devices.webcam.pictures import as_rgb

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.devices.webcam.protocol import Bytes

Name = TypeVar("Name")


class Capture(Protocol):
    """`cv2.VideoCapture` as far as it is used."""

    def isOpened(self) -> bool:
        """Whether there is something to read."""

    def read(self) -> tuple[bool, Any]:
        """Give whether a picture came, and it."""

    def set(self, propId: int, value: float) -> bool:
        """Ask for a property; whether it is known at all."""

    def get(self, propId: int) -> float:
        """Give a property; 0 where it is not known."""

    def release(self) -> None:
        """Let go of it."""


def opened(make: Callable[[Name], Capture], name: Name) -> Capture | None:
    """Open what has a name.

    Returns
    -------
    Capture or None
        None where it did not open; what was begun is let go of.
    """
    try:
        capture = make(name)
    except cv2.error:
        return None
    if capture.isOpened():
        return capture
    capture.release()
    return None


class Reader:
    """Reads one capture after the other, and counts what fails."""

    def __init__(self) -> None:
        self._capture: Capture | None = None
        self.failed = 0

    @property
    def on(self) -> bool:
        """Whether there is something to read from."""
        return self._capture is not None

    def begin(self, capture: Capture) -> None:
        """Read from this one."""
        self._capture, self.failed = capture, 0

    def read(self) -> Bytes | None:
        """Give the next picture.

        Returns
        -------
        (H, W, 3) uint8 or None
            sRGB; None where nothing came, which counts as failed, or what is no picture.
        """
        if self._capture is None:
            return None
        try:
            done, picture = self._capture.read()
        except cv2.error:
            done, picture = False, None
        if done and picture is not None:
            self.failed = 0
            return as_rgb(picture)
        self.failed += 1
        return None

    def end(self) -> None:
        """Let go of it."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()
