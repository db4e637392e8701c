"""A network camera that speaks RTSP, through the FFmpeg that is part of OpenCV.

FFmpeg tells nobody why it cannot open a stream, so the camera is first asked with one request of
our own. FFmpeg itself then has a limit for opening and one for each picture: no thread of it waits
longer than that, even for a camera that accepts the connection and says nothing.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

import cv2

from app.devices.webcam.capture import Reader, opened
from app.devices.webcam.network import NETWORK, Keys, no_keys, no_stream, password_error
from app.devices.webcam.pictures import fitted
from app.devices.webcam.quiet import quiet
from app.devices.webcam.stream import WebcamStream
from app.devices.webcam.wire import FAILURES, Wire, gone, unreachable

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.devices.clock import Clock
    from app.devices.theta.digest import Credentials
    from app.devices.webcam.address import Address
    from app.devices.webcam.capture import Capture
    from app.devices.webcam.protocol import Bytes

OPEN_S: Final = 6.0
"""Longest time that FFmpeg may take to open a stream, real seconds."""

READ_S: Final = 6.5
"""Longest time that FFmpeg may wait for a picture, real seconds."""

_FAILED_READS: Final = 3
_STATUS: Final = re.compile(rb"RTSP/1\.\d ([1-5]\d\d)(?: |\r|\n)")
_LONGEST_LINE: Final = 1024
_OK, _UNAUTHORIZED, _NOT_FOUND = 200, 401, 404
_SAYS_NOTHING: Final = "-8"  # FFmpeg's own number for it


class RtspWebcam(WebcamStream):
    """A camera at an rtsp address.

    Parameters
    ----------
    width : int, optional
        Most columns of its pictures; 0 takes them as they come.
    fov_deg : float, optional
        Horizontal field of view, deg, where it is known.
    """

    def __init__(
        self,
        address: Address,
        clock: Clock,
        *,
        keys: Keys = no_keys,
        width: int = 0,
        fov_deg: float | None = None,
        capture: Callable[[str], Capture] | None = None,
    ) -> None:
        source = _Stream(address, clock, keys, width, capture or open_url)
        name = f"Network camera {address.host}"
        super().__init__(source, name, fov_deg, clock, manner=NETWORK)


class _Stream:
    """The source of an `RtspWebcam`."""

    def __init__(
        self,
        address: Address,
        clock: Clock,
        keys: Keys,
        width: int,
        capture: Callable[[str], Capture],
    ) -> None:
        self._address = address
        self._clock = clock
        self._keys = keys
        self._width = width
        self._make = capture
        self._reader = Reader()

    def open(self) -> None:
        """Ask the camera, then let FFmpeg open it."""
        status = self._asked()
        keys = self._keys() if status == _UNAUTHORIZED else None
        if status == _UNAUTHORIZED and keys is None:
            raise password_error(refused=False)
        capture = opened(self._make, _url(self._address, keys))
        if capture is None:
            raise (
                password_error(refused=True)
                if keys is not None
                else no_stream(
                    "The network camera’s stream cannot be opened.",
                    "Look at the address in its app, or choose H.264 there.",
                )
            )
        self._reader.begin(capture)

    def read(self) -> Bytes | None:
        """Give the next picture."""
        if not self._reader.on:
            raise gone()
        picture = self._reader.read()
        if self._reader.failed >= _FAILED_READS:
            raise gone()
        return None if picture is None else fitted(picture, self._width)

    def close(self) -> None:
        """Hang up."""
        self._reader.end()

    def _asked(self) -> int:
        """Ask what is at the address: 200 or 401; anything else is an error."""
        wire = Wire(self._address, self._clock)
        wire.connect()
        try:
            wire.send(
                [
                    f"DESCRIBE {self._address} RTSP/1.0",
                    "CSeq: 1",
                    "Accept: application/sdp",
                    "User-Agent: Turnlight",
                ]
            )
            found = _STATUS.match(wire.readline(_LONGEST_LINE))
        except TimeoutError as error:
            raise unreachable(error) from None
        except FAILURES:
            found = None
        finally:
            wire.close()
        if found is None:
            raise no_stream(
                "What answers at this address is no RTSP camera.", "Look at the address in its app."
            )
        return _judged(int(found[1]))


def _judged(status: int) -> int:
    if status in (_OK, _UNAUTHORIZED):
        return status
    if status == _NOT_FOUND:
        raise no_stream(
            "The camera has no stream at this address.", "Look at the address in its app."
        )
    if 300 <= status < 400:
        raise no_stream("This address leads to another one.", "Type that address.")
    raise no_stream(f"The camera answers with error {status}.", "Start its app again.")


def _url(address: Address, keys: Credentials | None) -> str:
    if keys is None:
        return str(address)
    who = f"{quote(keys.user, safe='')}:{quote(keys.password, safe='')}"
    return str(address).replace("://", f"://{who}@", 1)


def open_url(url: str) -> Capture:
    """Let FFmpeg open a URL or a file, with a limit for opening and for each picture."""
    # Read by OpenCV when FFmpeg is first used; without it, it talks to the terminal.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", _SAYS_NOTHING)
    limits = [
        cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
        round(OPEN_S * 1000),
        cv2.CAP_PROP_READ_TIMEOUT_MSEC,
        round(READ_S * 1000),
    ]
    # Not even that a read took too long is for the terminal.
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    with quiet():
        return cv2.VideoCapture(url, cv2.CAP_FFMPEG, limits)
