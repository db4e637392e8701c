"""A camera's reply: its status, and its body, read within limits on size, time and pace."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

import requests
from urllib3 import BaseHTTPResponse

from app.core.text import tr
from app.devices.bounded_socket import Watch
from app.devices.clock import Clock
from app.devices.errors import BadReply
from app.devices.theta.network_errors import (
    CLOSED,
    NETWORK_ERRORS,
    broken,
    failure,
    no_camera,
    timeout,
)
from app.devices.theta.refusals import bare_refusal, refused
from app.devices.theta.untrusted import JsonValue, parse_json

_OK: Final = 200
_STREAMS: Final = frozenset({200, 206})
_NOT_OK: Final = 300
_ERRORS: Final = 400
_SERVER_ERRORS: Final = 500
_ELSEWHERE: Final = frozenset({404, 405, 407, 410, 421, 426, 451, 511})
ERROR_BYTES: Final = 65536
_PAGE: Final = re.compile(rb"[\s\xef\xbb\xbf]*<")
_CHUNK: Final = 65536
_LENGTH_DIGITS: Final = 15
_PLAIN: Final = frozenset({"", "identity"})
_WHOLE: Final = frozenset({"", "identity", "chunked"})


@dataclass(frozen=True, slots=True)
class Timeouts:
    """Time limits for a camera, in seconds of clock time."""

    connect_s: float = 3.0
    read_s: float = 20.0
    whole_s: float = 60.0
    idle_s: float = 10.0
    least_bytes: int = 1024


class Incoming:
    """A reply whose body has not been read yet."""

    def __init__(
        self, response: requests.Response, watch: Watch, clock: Clock, timeouts: Timeouts
    ) -> None:
        self.status = response.status_code
        self.headers: Mapping[str, str] = {
            str(name).lower(): str(value) for name, value in response.headers.items()
        }
        self.length = _length(self.headers)
        self._response = response
        self._watch = watch
        self._clock = clock
        self._timeouts = timeouts

    def chunks(self, size: int = _CHUNK) -> Iterator[bytes]:
        """Yield the body as it arrives, in pieces of at most `size` bytes.

        Raises:
            Unreachable: If the connection breaks, stalls, ends too early or is closed by
                `Link.close`.
        """
        idle_s, least = self._timeouts.idle_s, self._timeouts.least_bytes
        waits_s, count = 0.0, 0
        pieces = self._pieces(size)
        while True:
            start = self._clock.now()
            self._watch.allow(idle_s)
            piece = self._next(pieces)
            if piece is None:
                return
            waits_s += self._clock.now() - start
            count += len(piece)
            if waits_s >= idle_s:
                if count < least:
                    raise timeout()
                waits_s, count = 0.0, 0
            yield piece

    def whole(self, most: int) -> bytes:
        """Read a short body completely, before the deadline of the watch.

        Raises:
            BadReply: With the code "too-large" if the body has more than `most` bytes.
            Unreachable: As in `chunks`.
        """
        data = bytearray()
        pieces = self._pieces(min(_CHUNK, most + 1))
        while (piece := self._next(pieces)) is not None:
            data += piece
            if len(data) > most:
                raise BadReply(
                    tr("The camera’s answer is too large."),
                    tr("Restart the camera, then try again."),
                    "too-large",
                )
        return bytes(data)

    def release(self) -> None:
        """Release the connection, closing it unless the whole body has been read."""
        self._response.close()

    def _next(self, pieces: Iterator[bytes]) -> bytes | None:
        self._check_open()
        try:
            piece = next(pieces, None)
        except NETWORK_ERRORS as error:
            self._check_open()
            raise failure(error) from error
        self._check_open()
        if piece is not None and self._watch.late:
            raise timeout()
        return piece

    def _check_open(self) -> None:
        if self._watch.closed:
            raise broken(CLOSED)

    def _pieces(self, size: int) -> Iterator[bytes]:
        """Yield pieces of the body until it ends.

        Raises:
            Unreachable: If the connection ends too early.
        """
        if self.headers.get("content-encoding", "").strip().lower() not in _PLAIN:
            raise _packed_error()
        if self.headers.get("transfer-encoding", "").strip().lower() not in _WHOLE:
            raise _packed_error()
        count = 0
        for piece in _raw_pieces(self._response, size):
            count += len(piece)
            yield piece
        if self.length is not None and count < self.length:
            raise broken()


def _raw_pieces(response: requests.Response, size: int) -> Iterator[bytes]:
    """Yield bytes as they arrive. `iter_content` would wait until a piece is full."""
    if not isinstance(response.raw, BaseHTTPResponse):
        yield from (piece for piece in response.iter_content(size) if piece)
        return
    while piece := response.raw.read1(size, decode_content=False):
        yield piece


def _length(headers: Mapping[str, str]) -> int | None:
    text = headers.get("content-length", "").strip()
    if "chunked" in headers.get("transfer-encoding", "").lower():
        return None
    sound = text.isascii() and text.isdigit() and len(text) <= _LENGTH_DIGITS
    return int(text) if sound else None


def _packed_error() -> BadReply:
    return BadReply(
        tr("The camera sent its answer in an unexpected encoding."),
        tr("Restart the camera; if that does not help, update its firmware."),
        "packed",
    )


def judge_json(reply: Incoming, data: bytes) -> JsonValue:
    """Parse a reply that should be JSON.

    An error object with status 200 is returned like any other value.

    Raises:
        CameraRefused: If the reply is an HTTP error, with the camera's code if it sent one.
        NotACamera: If the reply is a web page or a redirect, or the path is unknown.
        BadReply: If the reply is anything other than JSON.
    """
    if _OK <= reply.status < _NOT_OK:
        if _is_page(reply, data):
            raise no_camera()
        return parse_json(data)
    _raise_error_within(data, reply.status)
    elsewhere = reply.status < _ERRORS or reply.status in _ELSEWHERE
    if elsewhere or (reply.status < _SERVER_ERRORS and _is_page(reply, data)):
        raise no_camera()
    raise bare_refusal(reply.status)


def judge_stream(reply: Incoming) -> None:
    """Check that a reply is a stream.

    Raises:
        CameraRefused: If the reply is an HTTP error (404 becomes "notFound") or an error object in
            place of the file.
        NotACamera: If the reply is a redirect or a web page.
        BadReply: If the reply is anything else.
    """
    kind = reply.headers.get("content-type", "").lower()
    if reply.status in _STREAMS:
        if "html" in kind:
            raise no_camera()
        if "json" not in kind:
            return
    _raise_error_within(reply.whole(ERROR_BYTES), reply.status)
    if _NOT_OK <= reply.status < _ERRORS:
        raise no_camera()
    if reply.status >= _ERRORS:
        raise bare_refusal(reply.status)
    raise BadReply(tr("The camera sent something other than the file."), tr("Try again."))


def _raise_error_within(data: bytes, status: int) -> None:
    with suppress(BadReply):
        error = refused(parse_json(data), status)
        if error is not None:
            raise error


def _is_page(reply: Incoming, data: bytes) -> bool:
    return "html" in reply.headers.get("content-type", "").lower() or bool(_PAGE.match(data))
