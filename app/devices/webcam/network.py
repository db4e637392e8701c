"""Network cameras that send JPEG frames over HTTP or HTTPS, or use RTSP.

RTSP streams are read by the FFmpeg in OpenCV. FFmpeg does not report why it cannot open a stream,
so the program first sends a request of its own. FFmpeg's timeouts for opening and for each frame
limit how long a thread waits, even if the camera accepts the connection and then stays silent.
"""

from __future__ import annotations

import base64
import re
import time
from collections.abc import Callable
from http.client import HTTPResponse
from typing import Final, TypeAlias
from urllib.parse import quote

from app.core.base.arrays import Bytes
from app.core.base.imaging.video import fitted, open_url
from app.core.text import tr
from app.devices.clock import Clock
from app.devices.errors import DeviceError
from app.devices.mjpeg import MjpegParser, boundary_of, decode
from app.devices.passwords import Credentials, Digest, wants_digest
from app.devices.webcam.network_connection import FAILURES, Address, Wire, camera_gone, unreachable
from app.devices.webcam.opencv import CaptureStream, VideoDevice
from app.devices.webcam.protocol import Manner, Webcam, WebcamError

Keys: TypeAlias = "Callable[[], Credentials | None]"
"""Function that returns the user name and password, or None.

It is called on the webcam's thread, since a keyring may be slow.
"""

NETWORK: Final = Manner(
    noun=tr("network camera"),
    revive=tr("Check that its app is running and on the same Wi-Fi."),
    quicken=tr("Move closer to the Wi-Fi router, or choose a smaller picture size in its app."),
    pauses_s=(0.5, 1.0, 2.0, 5.0, 10.0),
    silence_s=6.0,
)
"""Time limits and hints for network cameras."""

_CHUNK: Final = 64 << 10
_MOST_CHUNKS: Final = 256  # twice the largest frame
_WAITED_S: Final = 0.005  # seconds of real time
_GUESSES: Final = ("/", "/video")  # usual paths of the video in phone apps
_OK, _UNAUTHORIZED, _NOT_FOUND = 200, 401, 404
_ANSWERS: Final = 3

_FAILED_READS: Final = 3
_STATUS: Final = re.compile(rb"RTSP/1\.\d ([1-5]\d\d)(?: |\r|\n)")
_LONGEST_LINE: Final = 1024


def _name(address: Address) -> str:
    return tr("Network camera {host}", host=address.host)


def no_keys() -> Credentials | None:
    """Return None. This is the default, for cameras without a password."""
    return None


class MjpegWebcam(Webcam):
    """A camera at an HTTP or HTTPS address that sends a stream of JPEG frames.

    Digest and basic authentication are supported, and redirects are refused. If several frames have
    arrived, only the newest is decoded.

    Args:
        width: Maximum width of a frame in pixels, or 0 to keep the original size.
    """

    def __init__(
        self, address: Address, clock: Clock, *, keys: Keys = no_keys, width: int = 0
    ) -> None:
        super().__init__(_name(address), None, clock, NETWORK)
        self._address = address
        self._keys = keys
        self._width = width
        self._wire: Wire | None = None
        self._response: HTTPResponse | None = None
        self._parser = MjpegParser()
        self._current = False  # whether nothing older than the last read is in transit

    def connect(self) -> None:
        """Request the stream."""
        paths = _GUESSES if self._address.path == "/" else (self._address.path,)
        for place, path in enumerate(paths):
            try:
                response = self._open(self._address.at(path))
                content = _content_type(response)
            except WebcamError as error:
                self.disconnect()
                if error.code != "not-a-stream" or place + 1 == len(paths):
                    raise
            else:
                self._response = response
                self._parser = MjpegParser(boundary_of(content))
                return

    def read(self) -> Bytes | None:
        """Return the newest frame."""
        wire, response = self._wire, self._response
        if wire is None or response is None:
            raise camera_gone()
        wire.watch.allow(NETWORK.silence_s)
        newest, current = b"", self._current
        for _ in range(_MOST_CHUNKS):
            began = time.monotonic()
            data = _chunk(response)
            # A frame received after a wait is new. Received bytes alone are no reason to read on,
            # since they may be the end of a chunk with nothing behind it until the next frame.
            self._current = time.monotonic() - began > _WAITED_S
            current |= self._current
            frames = self._parser.feed(data)
            newest = frames[-1] if frames else newest
            if not data and not newest:
                raise camera_gone()
            if newest and (not data or current or not wire.ready):
                break
        # Skip a damaged frame; the next one may be intact.
        picture = decode(newest) if newest else None
        return None if picture is None else fitted(picture, self._width)

    def disconnect(self) -> None:
        """Close the connection."""
        response, self._response = self._response, None
        wire, self._wire = self._wire, None
        if response is not None:
            response.close()
        if wire is not None:
            wire.close()

    def cut(self) -> None:
        """Interrupt a blocking read."""
        wire = self._wire
        if wire is not None:
            wire.watch.close()

    def _open(self, address: Address) -> HTTPResponse:
        """Send the request, with a password if required, and leave the body of the reply unread."""
        keys: Credentials | None = None
        headers: dict[str, str] = {}
        for turn in range(_ANSWERS):
            response = self._send(address, headers)
            if response.status != _UNAUTHORIZED:
                return response
            challenge = response.getheader("WWW-Authenticate") or ""
            self.disconnect()
            keys = keys or self._keys()
            if keys is None:
                break
            signed = _answer(challenge, keys, address, again=turn > 0)
            if not signed:
                break
            headers = {"Authorization": signed}
        raise password_error(is_refused=keys is not None)

    def _send(self, address: Address, headers: dict[str, str]) -> HTTPResponse:
        wire = Wire(address, self._clock)
        self._wire = wire
        wire.connect()
        try:
            return wire.get(address.path, headers)
        except TimeoutError as error:
            raise unreachable(error) from None
        except FAILURES:
            raise no_stream(
                tr("The device at this address is not a camera."),
                tr("Check the address in its app."),
            ) from None


def _chunk(response: HTTPResponse) -> bytes:
    """Return the received bytes, or no bytes at the end of the stream."""
    try:
        return response.read1(_CHUNK)
    except FAILURES:
        return b""


def _answer(challenge: str, keys: Credentials, address: Address, *, again: bool) -> str:
    """Return the Authorization header for a challenge, or "" if there is none."""
    if wants_digest(challenge):
        digest = Digest(keys)
        try:
            stale = digest.take(challenge)
            return "" if again and not stale else digest.answer("GET", str(address))
        except DeviceError:
            return ""
    if again or not challenge.strip().lower().startswith("basic"):
        return ""
    pair = f"{keys.user}:{keys.password}".encode()
    return f"Basic {base64.b64encode(pair).decode('ascii')}"


def _content_type(response: HTTPResponse) -> str:
    """Return the content type of a reply that may contain frames."""
    status = response.status
    content = (response.getheader("Content-Type") or "").strip()[:1000]
    kind = content.lower().partition(";")[0].strip()
    path = tr("Check the address in its app; many end in /video.")
    _check_status(status, tr("The camera has no pictures at this address."), path)
    if kind.startswith("text/") or kind.endswith(("json", "xml")):
        raise no_stream(tr("This address shows a web page instead of pictures."), path)
    if kind.startswith(("image/", "audio/")) or kind in ("video/mp4", "video/webm"):
        raise no_stream(tr("This address does not send a stream of JPEG pictures."), path)
    return content


def _check_status(status: int, missing: str, hint: str) -> None:
    """Raise an error, with the message `missing` for a 404, unless the status means success."""
    if 300 <= status < 400:
        raise no_stream(tr("This address redirects to another one."), tr("Type that address."))
    if status == _NOT_FOUND:
        raise no_stream(missing, hint)
    if status != _OK:
        sentence = tr("The camera answered with error {status}.", status=status)
        raise no_stream(sentence, tr("Restart its app."))


def no_stream(message: str, hint: str) -> WebcamError:
    """Return the error for an address without video."""
    return WebcamError(message, hint, "not-a-stream")


def password_error(*, is_refused: bool) -> WebcamError:
    """Return the error for a missing or incorrect password."""
    if is_refused:
        return WebcamError(
            tr("The camera does not accept this user name and password."),
            tr("Check both in its app."),
            "password-refused",
        )
    return WebcamError(
        tr("The camera requires a user name and password."),
        tr("Both are set in its app."),
        "password",
    )


class RtspWebcam(CaptureStream):
    """A camera at an RTSP address.

    Args:
        width: Maximum width of a frame in pixels, or 0 to keep the original size.
    """

    def __init__(
        self,
        address: Address,
        clock: Clock,
        *,
        keys: Keys = no_keys,
        width: int = 0,
        capture: Callable[[str], VideoDevice] = open_url,
    ) -> None:
        super().__init__(_name(address), clock, NETWORK, capture)
        self._address = address
        self._keys = keys
        self._width = width

    def connect(self) -> None:
        """Check the camera with one request, then open its stream with FFmpeg."""
        status = self._ask_status()
        keys = self._keys() if status == _UNAUTHORIZED else None
        if status == _UNAUTHORIZED and keys is None:
            raise password_error(is_refused=False)
        if self.begin(_url(self._address, keys)) is None:
            raise (
                password_error(is_refused=True)
                if keys is not None
                else no_stream(
                    tr("The network camera’s stream cannot be opened."),
                    tr("Check the address in its app, or choose H.264 there."),
                )
            )

    def read(self) -> Bytes | None:
        """Return the next frame."""
        if self._capture is None:
            raise camera_gone()
        picture = self.grab(self._capture)
        if self._failures >= _FAILED_READS:
            raise camera_gone()
        return None if picture is None else fitted(picture, self._width)

    def _ask_status(self) -> int:
        """Request the status of the address.

        Returns:
            200 or 401.

        Raises:
            WebcamError: For any other status, or if nothing answers.
        """
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
            match = _STATUS.match(wire.readline(_LONGEST_LINE))
        except TimeoutError as error:
            raise unreachable(error) from None
        except FAILURES:
            match = None
        finally:
            wire.close()
        if match is None:
            raise no_stream(
                tr("The device at this address is not an RTSP camera."),
                tr("Check the address in its app."),
            )
        status = int(match[1])
        if status != _UNAUTHORIZED:
            missing = tr("The camera has no stream at this address.")
            _check_status(status, missing, tr("Check the address in its app."))
        return status


def _url(address: Address, keys: Credentials | None) -> str:
    if keys is None:
        return str(address)
    who = f"{quote(keys.user, safe='')}:{quote(keys.password, safe='')}"
    return str(address).replace("://", f"://{who}@", 1)
