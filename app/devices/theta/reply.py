"""A reply whose body is read piece by piece, within limits of size, time and pace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from urllib3 import BaseHTTPResponse

from app.devices.errors import BadReply
from app.devices.theta.failures import CLOSED, NETWORK_ERRORS, broken, failure, timeout

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import requests

    from app.devices.clock import Clock
    from app.devices.theta.transport import Watch

_CHUNK: Final = 65536
_LENGTH_DIGITS: Final = 15
_PLAIN: Final = frozenset({"", "identity"})
_WHOLE: Final = frozenset({"", "identity", "chunked"})


@dataclass(frozen=True, slots=True)
class Timeouts:
    """How long a camera may take, in seconds of the clock."""

    connect_s: float = 3.0
    read_s: float = 20.0
    whole_s: float = 60.0
    idle_s: float = 10.0
    least_bytes: int = 1024


class Incoming(Protocol):
    """A reply whose body is still to be read."""

    status: int
    headers: Mapping[str, str]
    length: int | None

    def chunks(self, size: int = _CHUNK) -> Iterator[bytes]:
        """Read the body as it comes; `Unreachable` when it breaks off, falls silent or drips."""

    def close(self) -> None:
        """End the reading, also from another thread; the reader gets `Unreachable` ("closed")."""


class Reply:
    """An `Incoming` on a response of `requests`."""

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
        """Read the body as it comes.

        Parameters
        ----------
        size : int, optional
            Most bytes in a piece.

        Raises
        ------
        Unreachable
            When the connection breaks, falls silent, brings too little, or is closed by `close`.
        """
        idle_s, least = self._timeouts.idle_s, self._timeouts.least_bytes
        waited, brought = 0.0, 0
        pieces = self._pieces(size)
        while True:
            start = self._clock.now()
            self._watch.allow(idle_s)
            piece = self._next(pieces)
            if piece is None:
                return
            waited += self._clock.now() - start
            brought += len(piece)
            if waited >= idle_s:
                if brought < least:
                    raise timeout()
                waited, brought = 0.0, 0
            yield piece

    def whole(self, most: int) -> bytes:
        """Read all of a short body before the watch's deadline.

        Raises
        ------
        BadReply
            When it is larger; the code is "too-large".
        Unreachable
            As `chunks`.
        """
        data = bytearray()
        pieces = self._pieces(min(_CHUNK, most + 1))
        while (piece := self._next(pieces)) is not None:
            data += piece
            if len(data) > most:
                raise BadReply(
                    "The camera's answer is too large.", "Switch it off and on.", "too-large"
                )
        return bytes(data)

    def close(self) -> None:
        """End the reading, also from another thread."""
        self._watch.close()

    def release(self) -> None:
        """Give the connection back; it is cut unless all of the body was read."""
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
        """Read until the end, and find out whether it came too early."""
        if self.headers.get("content-encoding", "").strip().lower() not in _PLAIN:
            raise _packed()
        if self.headers.get("transfer-encoding", "").strip().lower() not in _WHOLE:
            raise _packed()
        received = 0
        for piece in _raw_pieces(self._response, size):
            received += len(piece)
            yield piece
        if self.length is not None and received < self.length:
            raise broken()


def _raw_pieces(response: requests.Response, size: int) -> Iterator[bytes]:
    """Take bytes as they come: `iter_content` would wait until a piece is full."""
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


def _packed() -> BadReply:
    return BadReply(
        "The camera's answer is packed in a way that was not asked for.",
        "Switch the camera off and on; if that does not help, update its firmware.",
        "packed",
    )
